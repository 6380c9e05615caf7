// The bifurcation diagram: branches, special points, results of simulation; hover and selection.

import { branchColour, kindOf } from "./colours.js";
import { Chart } from "./chart.js";
import { make } from "./dom.js";
import { marker } from "./draw.js";
import { greek, labelled, shown } from "./numbers.js";

/** Distance in pixels within which a point is under the pointer. */
const NEAR = 18;
/** Distance in pixels within which a special point is preferred to the points of its branch. */
const NEAR_SPECIAL = 9;
/** Steps of a line shorter than this, in pixels, are drawn together. */
const FINE = 0.6;

/** Text of a quantity with its unit. */
export function quantityLabel(about) {
  const prefix = { min: "min ", max: "max ", mean: "mean ", rms: "rms ", integral: "integral of " }[about.class] ?? "";
  return labelled(prefix + greek(about.base), about.unit);
}

/** The diagram. */
export class Diagram {
  /**
   * @param {HTMLElement} host
   * @param {import("./run.js").Run} run
   * @param {{select: (place: any) => void, hover: (place: any) => void, viewed: () => void}} heard
   */
  constructor(host, run, heard) {
    this.run = run;
    this.heard = heard;
    this.qx = 0;
    this.qy = 0;
    this.hidden = new Set();
    this.alone = null;
    this.selected = null;
    this.hovered = null;
    this.paths = new Map();
    this.chart = new Chart(host, {
      label: "Bifurcation diagram. Arrow keys walk along the branch, brackets go to special points, Tab leaves.",
      draw: (surface, x, y, theme) => this.draw(surface, x, y, theme),
      overlay: (surface, x, y, theme) => this.overlay(surface, x, y, theme),
      extent: () => this.extent(),
      hover: (px, py, inside) => this.hover(inside ? this.pick(px, py) : null),
      press: (px, py) => {
        const place = this.pick(px, py);
        if (place) this.heard.select(place);
      },
      viewed: () => this.heard.viewed(),
    });
    this.tip = make("div", { class: "tip", hidden: true });
    host.append(this.tip);
  }

  setAxes(qx, qy, logX, logY) {
    const changed = qx !== this.qx || qy !== this.qy || logX !== this.chart.x.log || logY !== this.chart.y.log;
    [this.qx, this.qy, this.chart.x.log, this.chart.y.log] = [qx, qy, logX, logY];
    this.chart.labels = { x: quantityLabel(this.run.about.quantities[qx]), y: quantityLabel(this.run.about.quantities[qy]) };
    if (changed) {
      this.paths.clear();
      this.chart.past.length = 0;
      this.chart.future.length = 0;
      this.chart.fitted = true;
      this.chart.changed();
    }
  }

  /** True if a branch belongs to the axes: its parameter is the one on the axis, or its plane is that of the axes. */
  belongs(branch) {
    const quantity = (k) => this.run.about.quantities[k];
    const [x, y] = [quantity(this.qx), quantity(this.qy)];
    const parameters = [x, y].map((own, k) => (own.class === "parameter" ? [this.qx, this.qy][k] : -1));
    const { free, follows } = branch.about;
    if (parameters[0] >= 0 && parameters[1] >= 0) return follows !== null && parameters.includes(free) && parameters.includes(follows);
    if (follows !== null) return false;
    return parameters.every((own) => own < 0 || own === free);
  }

  visible(branch) {
    if (this.alone !== null) return branch.id === this.alone && branch.length > 0;
    return !this.hidden.has(branch.id) && this.belongs(branch) && branch.length > 0;
  }

  shownBranches() {
    return this.run.listed().filter((branch) => this.visible(branch));
  }

  /** Values of a branch in the axes, special points included, and the stability after each. */
  path(branch) {
    const known = this.paths.get(branch.id);
    if (known && known.version === branch.version && known.special === branch.special) return known;
    const places = branch.places();
    const [xs, ys] = [new Float64Array(places.length), new Float64Array(places.length)];
    const unstable = new Uint8Array(places.length);
    for (let k = 0; k < places.length; k += 1) {
      xs[k] = this.chart.x.even(branch.value(places[k], this.qx));
      ys[k] = this.chart.y.even(branch.value(places[k], this.qy));
      const next = places[k + 1];
      const count = next && next.special >= 0 ? branch.special[next.special].before : branch.unstable(places[k]);
      unstable[k] = count > 0 ? 1 : 0;
    }
    const box = [Infinity, -Infinity, Infinity, -Infinity];
    for (let k = 0; k < places.length; k += 1) {
      if (Number.isNaN(xs[k]) || Number.isNaN(ys[k])) continue;
      box[0] = Math.min(box[0], xs[k]);
      box[1] = Math.max(box[1], xs[k]);
      box[2] = Math.min(box[2], ys[k]);
      box[3] = Math.max(box[3], ys[k]);
    }
    const path = { version: branch.version, special: branch.special, places, xs, ys, unstable, box };
    this.paths.set(branch.id, path);
    return path;
  }

  extent() {
    const box = [Infinity, -Infinity, Infinity, -Infinity];
    const widen = (x0, x1, y0, y1) => {
      box[0] = Math.min(box[0], x0);
      box[1] = Math.max(box[1], x1);
      box[2] = Math.min(box[2], y0);
      box[3] = Math.max(box[3], y1);
    };
    for (const branch of this.shownBranches()) widen(...this.path(branch).box);
    for (const { x, y } of this.responses()) widen(x, x, y, y);
    return box[1] >= box[0] && box[3] >= box[2] ? { x: [box[0], box[1]], y: [box[2], box[3]] } : null;
  }

  /** Results of surveys and sweeps in the axes. */
  *responses() {
    if (this.alone !== null || this.hidden.has("responses")) return;
    const free = this.run.about.quantities[this.qx].class === "parameter" ? this.qx : -1;
    for (const set of this.run.state.responses) {
      if (free >= 0 && set.free !== free) continue;
      for (const own of set.rows) {
        const [x, y] = [this.chart.x.even(own.values[this.qx] ?? NaN), this.chart.y.even(own.values[this.qy] ?? NaN)];
        if (!Number.isNaN(x) && !Number.isNaN(y)) yield { x, y, motion: own.motion };
      }
    }
  }

  draw(surface, x, y, theme) {
    for (const { x: a, y: b, motion } of this.responses()) {
      const style = ["torus", "chaos", "other"].includes(motion) ? { fill: theme.faint, alpha: 0.6 } : { stroke: theme.soft, width: 1, alpha: 0.8 };
      const [px, py] = [x.pixelOfEven(a), y.pixelOfEven(b)];
      surface.shape((path) => path.arc(px, py, 1.8, 0, 2 * Math.PI), style);
    }
    const branches = this.shownBranches();
    branches.forEach((branch) => this.drawBranch(surface, x, y, branch, theme));
    branches.forEach((branch) => this.drawSpecial(surface, x, y, branch, theme));
  }

  drawBranch(surface, x, y, branch, theme) {
    const { xs, ys, unstable, box, places } = this.path(branch);
    const angles = [this.qx, this.qy].map((k) => this.run.about.quantities[k].class === "phase");
    const turned = (k) => (angles[0] && Math.abs(xs[k] - xs[k - 1]) > 180) || (angles[1] && Math.abs(ys[k] - ys[k - 1]) > 180);
    if (box[1] < x.low || box[0] > x.high || box[3] < y.low || box[2] > y.high) return;
    const colour = branchColour(branch.colour, theme.dark);
    const styles = [{ stroke: colour, width: 2 }, { stroke: colour, width: 1.5, dash: [5, 4] }];
    let [px, py] = [[], []];
    const flush = (dashed) => {
      if (px.length > 1) surface.line(px, py, px.length, styles[dashed]);
      [px, py] = [px.slice(-1), py.slice(-1)];
    };
    for (let k = 0; k < xs.length; k += 1) {
      const [a, b] = [x.pixelOfEven(xs[k]), y.pixelOfEven(ys[k])];
      if (k > 0 && turned(k)) {
        // -180° and 180° are one angle: the line ends at one and goes on at the other.
        flush(unstable[k - 1]);
        [px, py] = [[], []];
      }
      const last = px.length - 1;
      const turn = k > 0 && unstable[k] !== unstable[k - 1];
      const close = last > 0 && Math.abs(a - px[last]) < FINE && Math.abs(b - py[last]) < FINE;
      if (!close || turn || k === xs.length - 1) {
        px.push(a);
        py.push(b);
      }
      if (turn) flush(unstable[k - 1]);
    }
    flush(unstable[Math.max(0, xs.length - 2)]);
    if (places.length === 1) surface.shape((path) => path.arc(px[0], py[0], 2, 0, 2 * Math.PI), { fill: colour });
  }

  drawSpecial(surface, x, y, branch, theme) {
    const { xs, ys, places } = this.path(branch);
    const size = places.length > 3000 ? 3.2 : 4.4;
    places.forEach((place, k) => {
      if (place.special < 0 || Number.isNaN(xs[k]) || Number.isNaN(ys[k])) return;
      if (xs[k] < x.low || xs[k] > x.high || ys[k] < y.low || ys[k] > y.high) return;
      const { shape, colour } = kindOf(branch.special[place.special].kind);
      marker(surface, shape, x.pixelOfEven(xs[k]), y.pixelOfEven(ys[k]), size, colour, theme.panel);
    });
  }

  overlay(surface, x, y, theme) {
    const ring = (place, r, width, colour) => {
      const at = place && this.pixel(place, x, y);
      if (at) surface.shape((path) => path.arc(at[0], at[1], r, 0, 2 * Math.PI), { stroke: colour, width });
    };
    const branch = this.selected && this.run.branches.get(this.selected.branch);
    if (branch && this.visible(branch)) {
      const at = this.pixel(this.selected, x, y);
      if (at) {
        const faint = { stroke: theme.faint, width: 1, dash: [2, 3], alpha: 0.8 };
        surface.line([at[0], at[0]], [this.chart.box.top, this.chart.box.bottom], 2, faint);
        surface.line([this.chart.box.left, this.chart.box.right], [at[1], at[1]], 2, faint);
      }
      ring(this.selected, 8.5, 4, theme.panel);
      ring(this.selected, 8.5, 2, theme.fg);
    }
    ring(this.hovered, 7.5, 1.5, theme.accent);
  }

  /** Pixel of a place; null if the axes do not show it. */
  pixel(place, x = this.chart.x, y = this.chart.y) {
    const branch = this.run.branches.get(place.branch);
    if (!branch) return null;
    const at = [x.pixel(branch.value(place, this.qx)), y.pixel(branch.value(place, this.qy))];
    return at.some(Number.isNaN) ? null : at;
  }

  /** The place closest to a pixel. */
  pick(px, py) {
    let [best, distance] = [null, NEAR * NEAR];
    let [special, ofSpecial] = [null, NEAR_SPECIAL * NEAR_SPECIAL];
    const { x, y } = this.chart;
    for (const branch of this.shownBranches()) {
      const { xs, ys, places, box } = this.path(branch);
      const away = (axis, pixel, low, high) => Math.max(0, Math.min(axis.pixelOfEven(low), axis.pixelOfEven(high)) - pixel, pixel - Math.max(axis.pixelOfEven(low), axis.pixelOfEven(high)));
      if (away(x, px, box[0], box[1]) > NEAR || away(y, py, box[2], box[3]) > NEAR) continue;
      for (let k = 0; k < xs.length; k += 1) {
        const [dx, dy] = [x.pixelOfEven(xs[k]) - px, y.pixelOfEven(ys[k]) - py];
        const d = dx * dx + dy * dy;
        if (d < distance) [best, distance] = [places[k], d];
        if (d < ofSpecial && places[k].special >= 0) [special, ofSpecial] = [places[k], d];
      }
    }
    return special ?? best ?? this.pickLine(px, py);
  }

  /** The point closest along a line that passes under the pointer between two distant points. */
  pickLine(px, py) {
    let [best, distance] = [null, 7 * 7];
    const { x, y } = this.chart;
    for (const branch of this.shownBranches()) {
      const { xs, ys, places } = this.path(branch);
      for (let k = 1; k < xs.length; k += 1) {
        const [ax, ay, bx, by] = [x.pixelOfEven(xs[k - 1]), y.pixelOfEven(ys[k - 1]), x.pixelOfEven(xs[k]), y.pixelOfEven(ys[k])];
        const [ux, uy] = [bx - ax, by - ay];
        const t = Math.max(0, Math.min(1, ((px - ax) * ux + (py - ay) * uy) / (ux * ux + uy * uy || 1)));
        const d = (ax + t * ux - px) ** 2 + (ay + t * uy - py) ** 2;
        if (d < distance) [best, distance] = [places[t < 0.5 ? k - 1 : k], d];
      }
    }
    return best;
  }

  hover(place) {
    this.hovered = place;
    this.heard.hover(place);
    this.chart.canvas.style.cursor = place ? "pointer" : "crosshair";
    this.chart.ask();
    const at = place && this.pixel(place);
    this.tip.hidden = !at;
    if (!at) return;
    this.tip.replaceChildren(...this.describe(place));
    const { width, height } = this.tip.getBoundingClientRect();
    const [w, h] = [this.chart.width, this.chart.height];
    this.tip.style.left = `${Math.max(2, at[0] + 14 + width > w ? at[0] - width - 14 : at[0] + 14)}px`;
    this.tip.style.top = `${Math.max(2, Math.min(h - height - 2, at[1] - height - 10 < 2 ? at[1] + 12 : at[1] - height - 10))}px`;
  }

  /** Names and values of a place, for reading. */
  values(place) {
    const branch = this.run.branches.get(place.branch);
    if (!branch) return [];
    const about = this.run.about.quantities;
    const period = this.run.quantity("period");
    const rows = [...new Set([this.qx, this.qy, period])].map((k) => [k, branch.value(place, k)]);
    return rows.filter(([k, value]) => k >= 0 && !(k === period && Number.isNaN(value))).map(([k, value]) => [about[k].name, value]);
  }

  title(place) {
    const branch = this.run.branches.get(place.branch);
    if (!branch) return "";
    const special = branch.special[place.special];
    const kind = special && (this.run.about.kinds.find((own) => own.name === special.kind)?.title ?? special.kind);
    return special ? `${kind} on ${branch.about.name}` : branch.about.name;
  }

  stability(place) {
    const branch = this.run.branches.get(place.branch);
    if (!branch) return "";
    const special = branch.special[place.special];
    if (special) return `unstable ${special.before} → ${special.after}`;
    const count = branch.unstable(place);
    return count === 0 ? "stable" : `unstable (${count})`;
  }

  describe(place) {
    const list = make("dl");
    for (const [name, value] of this.values(place)) list.append(make("dt", { text: greek(name) }), make("dd", { text: shown(value) }));
    list.append(make("dt", { text: "stability" }), make("dd", { text: this.stability(place) }));
    return [make("b", { text: this.title(place) }), list];
  }

  /** One line of text about a place; `plain` for programs. */
  line(place) {
    const values = this.values(place).map(([name, value]) => `${name} = ${shown(value)}`);
    return [this.title(place), ...values, this.stability(place)].join("   ");
  }
}
