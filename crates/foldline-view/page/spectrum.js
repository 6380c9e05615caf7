// Harmonics of the orbit, and multipliers or eigenvalues in the complex plane.

import { branchColour } from "./colours.js";
import { Chart } from "./chart.js";
import { button, choice, make } from "./dom.js";
import { greek, labelled, shown } from "./numbers.js";

/** Amplitudes smaller than this part of the largest are not shown on a logarithmic axis. */
const SMALLEST = 1e-8;

/** The harmonics. */
export class SpectrumPanel {
  constructor(host, controls) {
    this.controls = controls;
    this.log = true;
    this.channel = 0;
    this.signed = false;
    this.bars = [];
    this.solution = null;
    this.chart = new Chart(host, {
      label: "Harmonics of the orbit",
      small: true,
      draw: (surface, x, y, theme) => this.draw(surface, x, y, theme),
      extent: () => this.extent(),
    });
  }

  begin(about) {
    this.about = about;
    this.signed = about.whirl !== null;
    this.channel = about.whirl ? about.whirl[0] : 0;
    this.showControls();
  }

  showControls() {
    const { channels, whirl } = this.about;
    const items = channels.map((own, k) => [String(k), greek(own.name)]);
    if (whirl) items.unshift(["signed", `${greek(channels[whirl[0]].name)} + i ${greek(channels[whirl[1]].name)}`]);
    const pick = (value) => {
      this.signed = value === "signed";
      this.channel = this.signed ? whirl[0] : Number(value);
      this.set(this.solution, this.colour);
    };
    const toggle = button("log", "Logarithmic amplitudes", () => {
      this.log = !this.log;
      this.showControls();
      this.set(this.solution, this.colour);
    }, this.log);
    this.controls.replaceChildren(choice("Quantity", [["", items]], this.signed ? "signed" : String(this.channel), pick), toggle);
  }

  set(solution, colour) {
    this.solution = solution;
    this.colour = colour;
    this.bars = solution && solution.header.harmonics > 0 ? this.amplitudes() : [];
    this.chart.empty.textContent = this.bars.length === 0 && solution ? "An equilibrium has no harmonics." : "";
    this.chart.y.log = this.log;
    this.chart.labels = { x: "harmonic of 1/T", y: this.signed ? "amplitude" : labelled("amplitude", this.about.channels[this.channel].unit) };
    this.chart.fitted = true;
    this.chart.changed();
  }

  /** Amplitude at each harmonic: of a complex signal with sign, otherwise twice the modulus from 1 on. */
  amplitudes() {
    const { harmonics, header } = this.solution;
    const part = (channel, own) => harmonics[2 * channel + own];
    const bars = [];
    if (this.signed) {
      const [u, v] = this.about.whirl;
      for (let k = 1 - header.harmonics; k < header.harmonics; k += 1) {
        // c(-k) of a real signal is the conjugate of c(k).
        const [j, sign] = [Math.abs(k), k < 0 ? -1 : 1];
        const re = part(u, 0)[j] - sign * part(v, 1)[j];
        const im = sign * part(u, 1)[j] + part(v, 0)[j];
        bars.push([k, Math.hypot(re, im)]);
      }
    } else {
      for (let k = 0; k < header.harmonics; k += 1) {
        bars.push([k, (k === 0 ? 1 : 2) * Math.hypot(part(this.channel, 0)[k], part(this.channel, 1)[k])]);
      }
    }
    return bars;
  }

  extent() {
    if (this.bars.length === 0) return null;
    const largest = Math.max(...this.bars.map(([, size]) => size), 1e-300);
    const counted = this.bars.filter(([, size]) => size > largest * 1e-4).map(([k]) => Math.abs(k));
    const far = Math.min(this.bars.length, Math.max(6, ...counted) + 1);
    const low = this.log ? Math.log10(Math.max(largest * SMALLEST, Math.min(...this.bars.filter(([k]) => Math.abs(k) <= far).map(([, size]) => size || largest)))) : 0;
    return { x: [this.signed ? -far : -0.5, far], y: [low, this.log ? Math.log10(largest) : largest] };
  }

  draw(surface, x, y, theme) {
    const colour = branchColour(this.colour ?? 0, theme.dark);
    const width = Math.max(1.5, Math.min(9, 0.6 * (x.pixelOfEven(1) - x.pixelOfEven(0))));
    for (const [k, size] of this.bars) {
      const top = y.even(size);
      if (Number.isNaN(top)) continue;
      const px = x.pixelOfEven(k);
      const base = this.log ? Math.max(y.from, y.to) + 10 : y.pixelOfEven(0);
      surface.line([px, px], [base, y.pixelOfEven(top)], 2, { stroke: colour, width });
    }
  }
}

/** The multipliers on the unit circle, or the eigenvalues beside the imaginary axis. */
export class MultipliersPanel {
  constructor(host, head) {
    this.head = head;
    this.header = null;
    this.isCycle = true;
    this.chart = new Chart(host, {
      label: "Multipliers or eigenvalues in the complex plane",
      small: true,
      draw: (surface, x, y, theme) => this.draw(surface, x, y, theme),
      extent: () => this.extent(),
      equal: () => this.isCycle,
      hover: (px, py, inside) => this.hover(px, py, inside),
    });
    this.tip = make("div", { class: "tip", hidden: true });
    host.append(this.tip);
  }

  set(solution) {
    this.header = solution?.header ?? null;
    this.isCycle = solution?.isCycle ?? true;
    this.head.textContent = this.isCycle ? "Multipliers" : "Eigenvalues";
    this.chart.labels = this.isCycle ? { x: "Re μ", y: "Im μ" } : { x: "Re λ", y: "Im λ" };
    this.chart.fitted = true;
    this.chart.changed();
  }

  extent() {
    const values = this.header?.spectrum ?? [];
    if (this.isCycle) {
      // A large multiplier would make the circle a dot; the tooltip and the table name it.
      const far = Math.max(1.15, Math.min(2, Math.max(0, ...values.map(([re, im]) => 1.1 * Math.max(Math.abs(re), Math.abs(im))))));
      return { x: [-far, far], y: [-far, far] };
    }
    if (values.length === 0) return null;
    const [re, im] = [values.map((z) => z[0]), values.map((z) => z[1])];
    const size = Math.max(...re.map(Math.abs), 1e-300);
    const high = Math.max(...im.map(Math.abs), 0.1 * size);
    return { x: [Math.min(...re, -0.2 * size), Math.max(...re, 0.2 * size)], y: [-1.1 * high, 1.1 * high] };
  }

  /** Number in the list, real and imaginary part of each value; those outside are put at the edge. */
  *shownValues(x, y) {
    const values = this.header?.spectrum ?? [];
    for (let k = 0; k < values.length; k += 1) {
      const [re, im] = values[k];
      const inside = re >= x.low && re <= x.high && im >= y.low && im <= y.high;
      yield { k, re, im, inside, px: x.pixelOfEven(Math.max(x.low, Math.min(x.high, re))), py: y.pixelOfEven(Math.max(y.low, Math.min(y.high, im))) };
    }
  }

  draw(surface, x, y, theme) {
    const axis = { stroke: theme.faint, width: 1 };
    if (this.isCycle) {
      const count = 181;
      const angle = (k) => (2 * Math.PI * k) / (count - 1);
      const xs = Array.from({ length: count }, (_, k) => x.pixelOfEven(Math.cos(angle(k))));
      const ys = Array.from({ length: count }, (_, k) => y.pixelOfEven(Math.sin(angle(k))));
      surface.line(xs, ys, count, { stroke: theme.soft, width: 1.2 });
    } else {
      const px = x.pixelOfEven(0);
      surface.line([px, px], [y.from, y.to], 2, { stroke: theme.soft, width: 1.2 });
    }
    const py = y.pixelOfEven(0);
    surface.line([x.from, x.to], [py, py], 2, { ...axis, alpha: 0.5 });
    const trivial = this.header?.trivial ?? 0;
    const within = (axis, value) => Math.max(axis.low, Math.min(axis.high, value));
    for (const { k, re, im } of this.shownValues(this.chart.x, this.chart.y)) {
      const [px, own] = [x.pixelOfEven(within(this.chart.x, re)), y.pixelOfEven(within(this.chart.y, im))];
      const unstable = this.isCycle ? Math.hypot(re, im) > 1 : re > 0;
      const colour = k < trivial ? theme.faint : unstable ? "#d55e00" : theme.accent;
      const style = k < trivial ? { stroke: colour, width: 1.6 } : { fill: colour, stroke: theme.panel, width: 1 };
      surface.shape((path) => path.arc(px, own, 4, 0, 2 * Math.PI), style);
    }
  }

  hover(px, py, inside) {
    let best = null;
    for (const own of inside ? this.shownValues(this.chart.x, this.chart.y) : []) {
      const distance = Math.hypot(own.px - px, own.py - py);
      if (distance < 14 && distance < (best?.distance ?? Infinity)) best = { ...own, distance };
    }
    this.tip.hidden = best === null;
    if (!best) return;
    const size = Math.hypot(best.re, best.im);
    const sign = best.im < 0 ? "−" : "+";
    const number = best.im === 0 ? shown(best.re) : `${shown(best.re)} ${sign} ${shown(Math.abs(best.im))} i`;
    const lines = [make("div", { text: number })];
    if (this.isCycle) lines.push(make("div", { text: `modulus ${shown(size)}` }));
    this.tip.replaceChildren(...lines);
    this.tip.style.top = `${Math.max(2, best.py - 46)}px`;
    this.tip.style.left = `${Math.max(2, Math.min(best.px - 40, this.chart.width - this.tip.offsetWidth - 4))}px`;
  }
}
