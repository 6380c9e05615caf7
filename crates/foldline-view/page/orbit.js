// The orbit at a point: phase plane, time series, or in three dimensions; animated.

import { branchColour } from "./colours.js";
import { Chart } from "./chart.js";
import { button, choice, make, still } from "./dom.js";
import { greek, labelled, shown } from "./numbers.js";

/** Seconds in which the animation goes through one period. */
const SECONDS = 4;
/** Number of levels by which lines fade with depth. */
const LEVELS = 16;

/** A solution as the server sends it, with names. */
export class Solution {
  /** @param {import("./source.js").Frame} frame @param {any[]} channels */
  constructor(frame, channels) {
    this.header = frame.header;
    this.channels = channels;
    this.rows = frame.header.rows;
    this.times = frame.columns[0] ?? new Float64Array(0);
    this.values = frame.columns.slice(1, 1 + channels.length);
    const names = frame.header.switches ?? [];
    const last = frame.columns.length - (this.rows > 0 ? names.length : 0);
    this.harmonics = frame.columns.slice(1 + channels.length, last);
    /** Switching functions along the orbit, with their names. */
    this.switches = names.map((name, k) => ({ name, values: frame.columns[last + k] ?? new Float64Array(0) }));
  }

  get isCycle() {
    return this.header.period !== undefined;
  }

  /** Value of a channel at a normalised time. */
  at(channel, time) {
    const { times } = this;
    const values = this.values[channel];
    let [low, high] = [0, times.length - 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle;
      else high = middle;
    }
    const part = high > low ? (time - times[low]) / (times[high] - times[low]) : 0;
    return values[low] + Math.max(0, Math.min(1, part)) * (values[high] - values[low]);
  }
}

/** Intervals of time in which values are positive; where they pass zero is interpolated. */
export function positive(times, values) {
  const found = [];
  let start = values[0] > 0 ? times[0] : null;
  for (let k = 1; k < times.length; k += 1) {
    const [a, b] = [values[k - 1], values[k]];
    if (a > 0 === b > 0) continue;
    const at = times[k - 1] + (a / (a - b)) * (times[k] - times[k - 1]);
    if (b > 0) start = at;
    else {
      found.push([start ?? times[0], at]);
      start = null;
    }
  }
  if (start !== null) found.push([start, times[times.length - 1]]);
  return found;
}

/** The panel. */
export class OrbitPanel {
  constructor(host, controls, play, changed) {
    this.controls = controls;
    this.play = play;
    this.changedChannels = changed;
    this.mode = "phase";
    this.chosen = [0, 0, 0];
    this.turn = { azimuth: -0.5, height: 0.4 };
    this.time = 0;
    this.playing = false;
    this.frames = 0;
    this.solution = null;
    this.note = "";
    this.chart = new Chart(host, {
      label: "Orbit",
      small: true,
      draw: (surface, x, y, theme) => this.draw(surface, x, y, theme),
      overlay: (surface, x, y, theme) => this.overlay(surface, x, y, theme),
      extent: () => this.extent(),
      equal: () => this.mode === "3d" || (this.mode === "phase" && this.isWhirl()),
      plain: () => this.mode === "3d",
      rows: () => this.mode === "contact",
      drag: (dx, dy) => this.rotate(dx, dy),
    });
  }

  begin(about) {
    this.about = about;
    const states = about.channels.filter((own) => own.class === "state").length;
    const [u, v] = about.whirl ?? [0, Math.min(1, about.channels.length - 1)];
    this.chosen = [u, v, [0, 1, 2].find((k) => k !== u && k !== v && k < about.channels.length) ?? v];
    if (states === 1 && about.channels.length === 1) this.mode = "time";
    this.showControls();
  }

  /** True if the two quantities are the plane of the whirl. */
  isWhirl() {
    const { whirl } = this.about;
    return whirl !== null && whirl.includes(this.chosen[0]) && whirl.includes(this.chosen[1]) && this.chosen[0] !== this.chosen[1];
  }

  showControls() {
    const kinds = [["phase", "Phase"], ["time", "Time"], ["3d", "3-D"], ...(this.about.switches > 0 ? [["contact", "Contact"]] : [])];
    const modes = kinds.map(([mode, text]) =>
      button(text, `Show as ${text}`, () => this.setMode(mode), this.mode === mode));
    const group = make("span", { class: "buttons", role: "group", "aria-label": "Kind of picture" }, ...modes);
    const names = [["", this.about.channels.map((own, k) => [String(k), greek(own.name)])]];
    const axes = { phase: ["Horizontal axis", "Vertical axis"], time: [null, "Quantity"], "3d": ["First axis", "Second axis", "Third axis"], contact: [] }[this.mode];
    const lists = axes.map((label, k) => (label ? choice(label, names, String(this.chosen[k]), (value) => this.choose(k, Number(value))) : null));
    this.controls.replaceChildren(group, ...lists.filter((own) => own !== null));
    this.button = button(this.playing ? "Pause" : "Play", "Move a point along the orbit (p)", () => this.toggle(), this.playing);
    this.slider = make("input", { type: "range", min: 0, max: 1000, value: Math.round(this.time * 1000), "aria-label": "Time along the orbit",
      oninput: () => this.seek(Number(this.slider.value) / 1000) });
    this.output = make("output", { text: "" });
    this.play.replaceChildren(this.button, this.slider, this.output);
    this.tell();
  }

  setMode(mode) {
    this.mode = mode;
    this.showControls();
    this.chart.place();
    this.chart.fitted = true;
    this.show();
  }

  choose(k, channel) {
    this.chosen[k] = channel;
    this.chart.fitted = true;
    this.show();
    this.changedChannels();
  }

  /** Shows a solution; null while there is none. */
  set(solution, colour, note = "") {
    this.solution = solution;
    this.colour = colour;
    this.note = note;
    this.show();
  }

  show() {
    const { solution } = this;
    const moves = solution !== null && solution.isCycle && solution.rows > 1;
    this.play.hidden = !moves;
    this.button.disabled = !moves;
    this.slider.disabled = !moves;
    const removed = "The profile of this point was not kept (store in the study).";
    this.chart.empty.textContent = solution === null ? this.note || "Select a point of the diagram." : solution.header.removed ? removed : "";
    const label = (k) => labelled(greek(this.about.channels[k].name), this.about.channels[k].unit);
    const time = labelled("t", this.about.time);
    const [x, y] = this.chosen;
    this.chart.labels = { phase: { x: label(x), y: label(y) }, time: { x: time, y: label(y) }, "3d": { x: "", y: "" }, contact: { x: time, y: "" } }[this.mode];
    const rests = this.mode === "contact" && solution !== null && !solution.isCycle;
    if (rests) this.chart.empty.textContent = "An equilibrium has no contact sequence.";
    this.chart.changed();
    this.tell();
  }

  // Geometry.

  /** Function that maps row k to a point of the picture. */
  mapped() {
    const { solution: own, mode } = this;
    const [x, y, z] = this.chosen.map((channel) => own.values[channel]);
    if (mode === "phase") return (k) => [x[k], y[k]];
    if (mode === "time") return (k) => [own.times[k] * (own.header.period ?? 1), y[k]];
    const project = this.projection([x, y, z]);
    return (k) => project(x[k], y[k], z[k]);
  }

  /** The same at a time between rows. */
  mappedAt(time) {
    const own = this.solution;
    const [x, y, z] = this.chosen.map((channel) => own.at(channel, time));
    if (this.mode === "phase") return [x, y];
    if (this.mode === "time") return [time * own.header.period, y];
    return this.projection(this.chosen.map((channel) => own.values[channel]))(x, y, z);
  }

  /** Projection of a box around the values, scaled to a cube from -1 to 1, with the depth as third number. */
  projection(columns) {
    const boxes = columns.map((column) => {
      let [low, high] = [Infinity, -Infinity];
      for (const value of column) [low, high] = [Math.min(low, value), Math.max(high, value)];
      return { middle: (low + high) / 2, half: (high - low) / 2 || 1, low, high };
    });
    const { azimuth, height } = this.turn;
    const [ca, sa, ch, sh] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(height), Math.sin(height)];
    const project = (x, y, z) => {
      const [a, b, c] = [x, y, z].map((value, k) => (value - boxes[k].middle) / boxes[k].half);
      const [across, depth] = [ca * a - sa * b, sa * a + ca * b];
      return [across, c * ch + depth * sh, depth * ch - c * sh];
    };
    project.boxes = boxes;
    return project;
  }

  extent() {
    if (!this.solution || this.solution.rows === 0) return null;
    if (this.mode === "3d") return { x: [-1.75, 1.75], y: [-1.6, 1.6] };
    if (this.mode === "contact") {
      return this.solution.isCycle ? { x: [0, this.solution.header.period], y: [0, Math.max(1, this.solution.switches.length)] } : null;
    }
    const map = this.mapped();
    const box = [Infinity, -Infinity, Infinity, -Infinity];
    for (let k = 0; k < this.solution.rows; k += 1) {
      const [a, b] = map(k);
      box[0] = Math.min(box[0], a);
      box[1] = Math.max(box[1], a);
      box[2] = Math.min(box[2], b);
      box[3] = Math.max(box[3], b);
    }
    if (this.mode === "phase" && this.isWhirl()) {
      const far = Math.max(...box.map(Math.abs));
      return { x: [-far, far], y: [-far, far] };
    }
    return box[1] >= box[0] ? { x: [box[0], box[1]], y: [box[2], box[3]] } : null;
  }

  draw(surface, x, y, theme) {
    const own = this.solution;
    if (!own || own.rows === 0) return;
    const colour = branchColour(this.colour, theme.dark);
    if (this.mode === "contact") {
      this.drawContact(surface, x, y, theme, colour);
      return;
    }
    const map = this.mapped();
    if (this.mode === "3d") this.drawCube(surface, x, y, theme);
    if (own.rows === 1) {
      const [a, b] = map(0);
      surface.shape((path) => path.arc(x.pixelOfEven(a), y.pixelOfEven(b), 4, 0, 2 * Math.PI), { fill: colour });
      return;
    }
    const points = Array.from({ length: own.rows }, (_, k) => map(k));
    const [px, py] = [points.map(([a]) => x.pixelOfEven(a)), points.map(([, b]) => y.pixelOfEven(b))];
    const style = { stroke: colour, width: 1.6 };
    if (this.mode !== "3d") {
      surface.line(px, py, px.length, style);
      return;
    }
    // Farther parts first, and fainter.
    const levels = Array.from({ length: LEVELS }, () => [[], []]);
    for (let k = 1; k < px.length; k += 1) {
      const depth = (points[k][2] + points[k - 1][2]) / 2;
      const level = Math.max(0, Math.min(LEVELS - 1, Math.floor(((1.75 - depth) / 3.5) * LEVELS)));
      levels[level][0].push(px[k - 1], px[k], NaN);
      levels[level][1].push(py[k - 1], py[k], NaN);
    }
    levels.forEach(([xs, ys], level) => surface.line(xs, ys, xs.length, { ...style, alpha: 0.3 + (0.7 * level) / (LEVELS - 1) }));
  }

  /** A row for each switching function, filled while it is positive. */
  drawContact(surface, x, y, theme, colour) {
    const { switches, times, header } = this.solution;
    switches.forEach(({ name, values }, k) => {
      const [top, bottom] = [0.55, 0.12].map((part) => y.pixelOfEven(switches.length - 1 - k + part));
      surface.line([x.pixelOfEven(0), x.pixelOfEven(header.period)], [bottom, bottom], 2, { stroke: theme.faint });
      for (const [from, to] of positive(times, values)) {
        const [a, b] = [x.pixelOfEven(from * header.period), x.pixelOfEven(to * header.period)];
        surface.shape((path) => {
          path.moveTo(a, top);
          path.lineTo(b, top);
          path.lineTo(b, bottom);
          path.lineTo(a, bottom);
          path.closePath();
        }, { fill: colour });
      }
      surface.text(`${name} > 0`, x.pixelOfEven(0) + 4, y.pixelOfEven(switches.length - 1 - k + 0.76), { size: 10, colour: theme.fg });
    });
  }

  drawCube(surface, x, y, theme) {
    const columns = this.chosen.map((channel) => this.solution.values[channel]);
    const project = this.projection(columns);
    const corner = (i, j, k) => project(...[i, j, k].map((side, axis) => project.boxes[axis].middle + side * project.boxes[axis].half));
    const pixel = (at) => [x.pixelOfEven(at[0]), y.pixelOfEven(at[1])];
    const edge = (a, b, style) => {
      const [p, q] = [pixel(a), pixel(b)];
      surface.line([p[0], q[0]], [p[1], q[1]], 2, style);
    };
    const sides = [-1, 1];
    for (const i of sides) {
      for (const j of sides) {
        edge(corner(-1, i, j), corner(1, i, j), { stroke: theme.grid });
        edge(corner(i, -1, j), corner(i, 1, j), { stroke: theme.grid });
        edge(corner(i, j, -1), corner(i, j, 1), { stroke: theme.grid });
      }
    }
    const origin = corner(-1, -1, -1);
    [[1.14, -1, -1], [-1, 1.14, -1], [-1, -1, 1.14]].forEach((tip, axis) => {
      const end = corner(...tip);
      edge(origin, end, { stroke: theme.faint, width: 1.2 });
      const [px, py] = pixel(corner(...tip.map((side) => (side > 1 ? 1.3 : side))));
      surface.text(greek(this.about.channels[this.chosen[axis]].name), px, py, { size: 11, colour: theme.fg, align: "center" });
      const { low, high } = project.boxes[axis];
      [[-0.8, low], [0.8, high]].forEach(([side, value]) => {
        const place = [-1, -1, -1].map((own, k) => (k === axis ? side : own - (k === [1, 0, 0][axis] ? 0.28 : 0)));
        const [tx, ty] = pixel(corner(...place));
        surface.text(shown(value, 3), tx, ty, { size: 9, colour: theme.faint, align: "center" });
      });
    });
  }

  overlay(surface, x, y, theme) {
    const own = this.solution;
    if (!own || own.rows < 2) return;
    if (this.mode === "contact") {
      const px = x.pixelOfEven(this.time * own.header.period);
      surface.line([px, px], [y.from, y.to], 2, { stroke: theme.fg, width: 1.2 });
      return;
    }
    const [a, b] = this.mappedAt(this.time);
    const [px, py] = [x.pixelOfEven(a), y.pixelOfEven(b)];
    surface.shape((path) => path.arc(px, py, 5, 0, 2 * Math.PI), { fill: theme.fg, stroke: theme.panel, width: 1.5 });
  }

  rotate(dx, dy) {
    if (this.mode !== "3d") return false;
    this.turn.azimuth += dx * 0.01;
    this.turn.height = Math.max(-1.5, Math.min(1.5, this.turn.height + dy * 0.01));
    this.chart.redraw();
    return true;
  }

  // Time.

  toggle() {
    this.playing = !this.playing;
    this.button.textContent = this.playing ? "Pause" : "Play";
    this.button.setAttribute("aria-pressed", String(this.playing));
    if (this.playing) {
      this.last = null;
      requestAnimationFrame((now) => this.step(now));
    }
  }

  step(now) {
    if (!this.playing) return;
    // Who wants pages that do not move gets single steps instead of a motion.
    const pace = still() ? 500 : 0;
    if (this.last === null || now - this.last >= pace) {
      if (this.last !== null) this.seek((this.time + (now - this.last) / 1000 / SECONDS) % 1);
      this.last = now;
      this.frames += 1;
    }
    requestAnimationFrame((next) => this.step(next));
  }

  seek(time) {
    this.time = time;
    this.slider.value = String(Math.round(time * 1000));
    this.tell();
    this.chart.ask();
  }

  tell() {
    const period = this.solution?.header.period;
    this.output.textContent = period === undefined ? "" : `t = ${shown(this.time * period, 4)}${this.about.time ? ` ${this.about.time}` : ""}`;
  }
}
