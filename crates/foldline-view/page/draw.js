// Two surfaces with the same operations: a canvas, and the text of an SVG picture.

/**
 * @typedef {{stroke?: string, width?: number, dash?: number[], fill?: string, alpha?: number}} Style
 */

/** Draws on a canvas. */
export class CanvasSurface {
  /** @param {CanvasRenderingContext2D} context */
  constructor(context, font) {
    this.context = context;
    this.font = font;
  }

  /** Restricts what follows to a rectangle, until `unclip`. */
  clip(x, y, w, h) {
    this.context.save();
    this.context.beginPath();
    this.context.rect(x, y, w, h);
    this.context.clip();
  }

  unclip() {
    this.context.restore();
  }

  /** Polyline through `count` points; NaN interrupts it. */
  line(xs, ys, count, style) {
    const { context } = this;
    context.beginPath();
    let open = false;
    for (let k = 0; k < count; k += 1) {
      if (Number.isNaN(xs[k]) || Number.isNaN(ys[k])) open = false;
      else if (open) context.lineTo(xs[k], ys[k]);
      else {
        context.moveTo(xs[k], ys[k]);
        open = true;
      }
    }
    this.paint(style);
  }

  /** A closed path given by functions of a path: moveTo, lineTo, arc. */
  shape(trace, style) {
    this.context.beginPath();
    trace(this.context);
    this.paint(style);
  }

  paint({ stroke, width = 1, dash = [], fill, alpha = 1 }) {
    const { context } = this;
    context.globalAlpha = alpha;
    if (fill) {
      context.fillStyle = fill;
      context.fill();
    }
    if (stroke) {
      context.strokeStyle = stroke;
      context.lineWidth = width;
      context.lineJoin = "round";
      context.setLineDash(dash);
      context.stroke();
      context.setLineDash([]);
    }
    context.globalAlpha = 1;
  }

  /** Text; `align` is left, center or right, `turn` in degrees. */
  text(text, x, y, { size = 11, colour = "#000", align = "left", base = "middle", turn = 0, bold = false }) {
    const { context } = this;
    context.save();
    context.translate(x, y);
    if (turn) context.rotate((turn * Math.PI) / 180);
    context.font = `${bold ? "600 " : ""}${size}px ${this.font}`;
    context.fillStyle = colour;
    context.textAlign = align;
    context.textBaseline = base;
    context.fillText(text, 0, 0);
    context.restore();
  }
}

const escape = (text) => text.replace(/[&<>"]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[c]);
const short = (value) => String(Math.round(value * 100) / 100);

/** Collects an SVG picture. */
export class SvgSurface {
  constructor(width, height, font, title) {
    this.parts = [];
    this.clips = 0;
    this.size = [width, height];
    this.font = font;
    this.title = title;
  }

  clip(x, y, w, h) {
    this.clips += 1;
    const box = `<rect x="${short(x)}" y="${short(y)}" width="${short(w)}" height="${short(h)}"/>`;
    this.parts.push(`<clipPath id="c${this.clips}">${box}</clipPath><g clip-path="url(#c${this.clips})">`);
  }

  unclip() {
    this.parts.push("</g>");
  }

  line(xs, ys, count, style) {
    let path = "";
    let open = false;
    for (let k = 0; k < count; k += 1) {
      if (Number.isNaN(xs[k]) || Number.isNaN(ys[k])) open = false;
      else {
        path += `${open ? "L" : "M"}${short(xs[k])} ${short(ys[k])}`;
        open = true;
      }
    }
    if (path) this.paint(path, style);
  }

  shape(trace, style) {
    let path = "";
    trace({
      moveTo: (x, y) => (path += `M${short(x)} ${short(y)}`),
      lineTo: (x, y) => (path += `L${short(x)} ${short(y)}`),
      closePath: () => (path += "Z"),
      arc: (x, y, r) => (path += `M${short(x - r)} ${short(y)}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0Z`),
    });
    this.paint(path, style);
  }

  paint(path, { stroke, width = 1, dash = [], fill, alpha = 1 }) {
    const dashes = dash.length ? ` stroke-dasharray="${dash.join(" ")}"` : "";
    const line = stroke ? ` stroke="${stroke}" stroke-width="${width}" stroke-linejoin="round"${dashes}` : "";
    this.parts.push(`<path d="${path}" fill="${fill ?? "none"}"${line}${alpha < 1 ? ` opacity="${alpha}"` : ""}/>`);
  }

  text(text, x, y, { size = 11, colour = "#000", align = "left", base = "middle", turn = 0, bold = false }) {
    const anchor = { left: "start", center: "middle", right: "end" }[align];
    const down = { middle: 0.35, top: 0.8, bottom: -0.2, alphabetic: 0 }[base] * size;
    const place = `translate(${short(x)} ${short(y)})${turn ? ` rotate(${turn})` : ""} translate(0 ${short(down)})`;
    const weight = bold ? ' font-weight="600"' : "";
    this.parts.push(`<text transform="${place}" font-size="${size}" fill="${colour}" text-anchor="${anchor}"${weight}>${escape(text)}</text>`);
  }

  /** The whole picture. */
  picture(background) {
    const [w, h] = this.size;
    const head = `<svg xmlns="http://www.w3.org/2000/svg" width="${w}" height="${h}" viewBox="0 0 ${w} ${h}" font-family="${escape(this.font)}">`;
    return `${head}<title>${escape(this.title)}</title><rect width="${w}" height="${h}" fill="${background}"/>${this.parts.join("")}</svg>\n`;
  }
}

/** Traces a marker around a point. */
export function traceMarker(shape, x, y, r) {
  const corners = (count, turn, size = r) => (path) => {
    for (let k = 0; k < count; k += 1) {
      const angle = turn + (2 * Math.PI * k) / count;
      path[k === 0 ? "moveTo" : "lineTo"](x + size * Math.cos(angle), y + size * Math.sin(angle));
    }
    path.closePath();
  };
  const up = -Math.PI / 2;
  switch (shape) {
    case "square": return corners(4, Math.PI / 4, r * 1.15);
    case "diamond": return corners(4, 0, r * 1.25);
    case "up": return corners(3, up, r * 1.3);
    case "down": return corners(3, -up, r * 1.3);
    case "pentagon": return corners(5, up, r * 1.15);
    case "star": return (path) => {
      for (let k = 0; k < 10; k += 1) {
        const size = k % 2 === 0 ? r * 1.45 : r * 0.6;
        const angle = up + (Math.PI * k) / 5;
        path[k === 0 ? "moveTo" : "lineTo"](x + size * Math.cos(angle), y + size * Math.sin(angle));
      }
      path.closePath();
    };
    case "cross":
    case "plus": return (path) => {
      const turn = shape === "cross" ? Math.PI / 4 : 0;
      const arm = [r * 1.3, r * 0.45];
      const tips = [0, 1, 2, 3].flatMap((q) => [[arm[0], -arm[1], q], [arm[0], arm[1], q]]);
      tips.forEach(([a, b, q], k) => {
        const angle = turn + (q * Math.PI) / 2;
        const px = x + a * Math.cos(angle) - b * Math.sin(angle);
        const py = y + a * Math.sin(angle) + b * Math.cos(angle);
        path[k === 0 ? "moveTo" : "lineTo"](px, py);
        if (k % 2 === 1) {
          const inner = angle + Math.PI / 4;
          path.lineTo(x + arm[1] * Math.SQRT2 * Math.cos(inner), y + arm[1] * Math.SQRT2 * Math.sin(inner));
        }
      });
      path.closePath();
    };
    default: return (path) => path.arc(x, y, r, 0, 2 * Math.PI);
  }
}

/** Draws a marker with an outline in the colour of the background. */
export function marker(surface, shape, x, y, r, colour, outline) {
  const style = shape === "ring" ? { stroke: colour, width: 1.8, fill: outline } : { fill: colour, stroke: outline, width: 1.2 };
  surface.shape(traceMarker(shape, x, y, r), style);
}
