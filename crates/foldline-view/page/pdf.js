// A surface that writes a PDF of one page: vectors, and text in two of the fonts that every reader has.

/** Greek letters and some signs in the encoding of the font Symbol. */
const SYMBOL = { "α": 0x61, "β": 0x62, "γ": 0x67, "δ": 0x64, "ε": 0x65, "ζ": 0x7a, "η": 0x68, "θ": 0x71, "κ": 0x6b, "λ": 0x6c, "μ": 0x6d, "ν": 0x6e,
  "ξ": 0x78, "π": 0x70, "ρ": 0x72, "σ": 0x73, "τ": 0x74, "φ": 0x6a, "χ": 0x63, "ψ": 0x79, "ω": 0x77, "Ω": 0x57, "Γ": 0x47, "Δ": 0x44, "Θ": 0x51,
  "Λ": 0x4c, "Ξ": 0x58, "Π": 0x50, "Σ": 0x53, "Φ": 0x46, "Ψ": 0x59, "→": 0xae, "∞": 0xa5, "≤": 0xa3, "≥": 0xb3 };
/** Signs outside Latin-1 in the encoding WinAnsi; the minus sign is drawn as an en dash. */
const WINANSI = { "−": 0x96, "–": 0x96, "—": 0x97, "…": 0x85, "’": 0x92, "‘": 0x91, "“": 0x93, "”": 0x94, "•": 0x95, "€": 0x80 };

const number = (v) => String(Math.round(v * 1000) / 1000);

/** Draws into the content of a page; the operations are those of the other surfaces. */
export class PdfSurface {
  constructor(width, height) {
    this.size = [width, height];
    // y downwards, as on a canvas.
    this.parts = [`1 0 0 -1 0 ${number(height)} cm 1 j`];
    this.alphas = new Map();
    this.ruler = document.createElement("canvas").getContext("2d");
  }

  clip(x, y, w, h) {
    this.parts.push(`q ${[x, y, w, h].map(number).join(" ")} re W n`);
  }

  unclip() {
    this.parts.push("Q");
  }

  line(xs, ys, count, style) {
    let path = "";
    let open = false;
    for (let k = 0; k < count; k += 1) {
      if (Number.isNaN(xs[k]) || Number.isNaN(ys[k])) open = false;
      else {
        path += `${number(xs[k])} ${number(ys[k])} ${open ? "l" : "m"} `;
        open = true;
      }
    }
    if (path) this.paint(path, style);
  }

  shape(trace, style) {
    let path = "";
    const curve = (...v) => (path += `${v.map(number).join(" ")} c `);
    trace({
      moveTo: (x, y) => (path += `${number(x)} ${number(y)} m `),
      lineTo: (x, y) => (path += `${number(x)} ${number(y)} l `),
      closePath: () => (path += "h "),
      arc: (x, y, r) => {
        // Four cubic pieces approximate a circle to 0.03 % of its radius.
        const k = 0.5523 * r;
        path += `${number(x + r)} ${number(y)} m `;
        curve(x + r, y + k, x + k, y + r, x, y + r);
        curve(x - k, y + r, x - r, y + k, x - r, y);
        curve(x - r, y - k, x - k, y - r, x, y - r);
        curve(x + k, y - r, x + r, y - k, x + r, y);
        path += "h ";
      },
    });
    this.paint(path, style);
  }

  paint(path, { stroke, width = 1, dash = [], fill, alpha = 1 }) {
    const state = [this.alpha(alpha)];
    if (fill) state.push(`${this.colour(fill)} rg`);
    if (stroke) state.push(`${this.colour(stroke)} RG ${number(width)} w [${dash.map(number).join(" ")}] 0 d`);
    this.parts.push(`q ${state.join(" ")} ${path}${fill && stroke ? "B" : fill ? "f" : "S"} Q`);
  }

  alpha(alpha) {
    if (!this.alphas.has(alpha)) this.alphas.set(alpha, `A${this.alphas.size}`);
    return `/${this.alphas.get(alpha)} gs`;
  }

  /** Red, green and blue of `#rrggbb` from 0 to 1. */
  colour(text) {
    const full = text.length === 4 ? `#${[...text.slice(1)].map((c) => c + c).join("")}` : text;
    return [1, 3, 5].map((k) => number((parseInt(full.slice(k, k + 2), 16) || 0) / 255)).join(" ");
  }

  text(text, x, y, { size = 11, colour = "#000", align = "left", base = "middle", turn = 0, bold = false }) {
    this.ruler.font = `${bold ? "bold " : ""}${size}px Helvetica, Arial, "Liberation Sans", sans-serif`;
    const width = this.ruler.measureText(text).width;
    const back = { left: 0, center: width / 2, right: width }[align];
    const down = { middle: 0.35, top: 0.8, bottom: -0.2, alphabetic: 0 }[base] * size;
    const angle = (turn * Math.PI) / 180;
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    const matrix = [c, s, s, -c, x - c * back - s * down, y - s * back + c * down].map(number).join(" ");
    this.parts.push(`BT ${this.alpha(1)} ${this.colour(colour)} rg ${matrix} Tm ${this.runs(text, size, bold)} ET`);
  }

  /** Parts of a text, each with its font. */
  runs(text, size, bold) {
    const parts = [];
    for (const sign of text) {
      const greek = SYMBOL[sign === "µ" ? "μ" : sign];
      const font = greek !== undefined ? "S" : bold ? "B" : "H";
      const code = greek ?? WINANSI[sign] ?? (sign.codePointAt(0) < 256 ? sign.codePointAt(0) : 0x3f);
      const own = code < 32 || code > 126 || "()\\".includes(String.fromCharCode(code)) ? `\\${code.toString(8).padStart(3, "0")}` : String.fromCharCode(code);
      if (parts.at(-1)?.font === font) parts.at(-1).text += own;
      else parts.push({ font, text: own });
    }
    return parts.map((part) => `/${part.font} ${number(size)} Tf (${part.text}) Tj`).join(" ");
  }

  /** The file; all its characters are ASCII, so that positions in the text are those of bytes. */
  picture(background) {
    const [w, h] = this.size.map(number);
    const ground = `q ${this.colour(background)} rg 0 0 ${w} ${h} re f Q`;
    const content = [this.parts[0], ground, ...this.parts.slice(1)].join("\n");
    const alphas = [...this.alphas].map(([alpha, name]) => `/${name} << /ca ${alpha} /CA ${alpha} >>`).join(" ");
    const font = (name, encoding) => `<< /Type /Font /Subtype /Type1 /BaseFont /${name}${encoding ? " /Encoding /WinAnsiEncoding" : ""} >>`;
    const objects = [
      "<< /Type /Catalog /Pages 2 0 R >>",
      "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
      `<< /Type /Page /Parent 2 0 R /MediaBox [0 0 ${w} ${h}] /Contents 4 0 R /Resources << /Font << /H 5 0 R /B 6 0 R /S 7 0 R >> /ExtGState << ${alphas} >> >> >>`,
      `<< /Length ${content.length} >>\nstream\n${content}\nendstream`,
      font("Helvetica", true), font("Helvetica-Bold", true), font("Symbol", false),
    ];
    let out = "%PDF-1.4\n";
    const places = objects.map((object, k) => {
      const at = out.length;
      out += `${k + 1} 0 obj\n${object}\nendobj\n`;
      return at;
    });
    const start = out.length;
    const rows = places.map((at) => `${String(at).padStart(10, "0")} 00000 n \n`).join("");
    return `${out}xref\n0 ${objects.length + 1}\n0000000000 65535 f \n${rows}trailer\n<< /Size ${objects.length + 1} /Root 1 0 R >>\nstartxref\n${start}\n%%EOF\n`;
  }
}
