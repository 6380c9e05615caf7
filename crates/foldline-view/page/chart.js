// A chart on a canvas: axes, zoom, pan, history. What it shows is drawn by a function.
//
// While the hand moves, a bitmap that reaches a quarter beyond the frame on each side is moved and scaled; it is drawn
// again when the hand stops or the margin is used up.

import { Axis, around } from "./axis.js";
import { themeColours } from "./colours.js";
import { make } from "./dom.js";
import { CanvasSurface, SvgSurface } from "./draw.js";
import { PdfSurface } from "./pdf.js";

/** Part of the frame by which the bitmap reaches beyond it. */
const BEYOND = 0.25;
/** Pause after which the bitmap is drawn again, in milliseconds. */
const SETTLED = 120;
/** Largest number of views that can be gone back. */
const VIEWS = 100;

/**
 * @typedef {{
 *   label: string,
 *   draw: (surface: any, x: Axis, y: Axis, theme: any) => void,
 *   overlay?: (surface: any, x: Axis, y: Axis, theme: any) => void,
 *   extent: () => {x: [number, number], y: [number, number]} | null,
 *   hover?: (x: number, y: number, inside: boolean) => void,
 *   press?: (x: number, y: number) => void,
 *   drag?: (dx: number, dy: number) => void,
 *   viewed?: () => void,
 *   equal?: () => boolean,
 *   plain?: () => boolean,
 *   rows?: () => boolean,
 *   small?: boolean,
 * }} Options
 */

/** A chart in an element of the page. */
export class Chart {
  /** @param {HTMLElement} host @param {Options} options */
  constructor(host, options) {
    this.options = options;
    this.x = new Axis();
    this.y = new Axis();
    this.labels = { x: "", y: "" };
    this.host = host;
    this.canvas = make("canvas", { tabindex: 0, role: "application", "aria-label": options.label });
    this.empty = make("div", { class: "empty" });
    host.append(this.canvas, this.empty);
    this.bitmap = document.createElement("canvas");
    this.drawn = null;
    this.past = [];
    this.future = [];
    this.fitted = true;
    this.band = null;
    this.asked = false;
    this.cost = { redraw: 0, frame: 0, frames: 0 };
    this.pointers = new Map();
    this.listen();
    new ResizeObserver(() => this.resized()).observe(host);
  }

  // Size and limits.

  resized() {
    const { width, height } = this.host.getBoundingClientRect();
    if (width < 20 || height < 20) return;
    // Whole pixels, so that the bitmap is moved onto the screen without being blurred.
    [this.width, this.height] = [Math.floor(width), Math.floor(height)];
    [this.canvas.style.width, this.canvas.style.height] = [`${this.width}px`, `${this.height}px`];
    this.ratio = Math.min(3, window.devicePixelRatio || 1);
    this.canvas.width = Math.round(this.width * this.ratio);
    this.canvas.height = Math.round(this.height * this.ratio);
    this.place();
    if (this.fitted) this.fit(false);
    else if (this.options.equal?.()) this.even();
    this.redraw();
  }

  /** Room for labels around the frame. */
  place() {
    const small = this.options.small;
    const plain = this.options.plain?.() ?? false;
    this.box = plain
      ? { left: 4, top: 4, right: this.width - 4, bottom: this.height - 4 }
      : { left: small ? 52 : 62, top: small ? 6 : 10, right: this.width - (small ? 10 : 16), bottom: this.height - (small ? 32 : 40) };
    [this.x.from, this.x.to] = [this.box.left, this.box.right];
    [this.y.from, this.y.to] = [this.box.bottom, this.box.top];
  }

  get ready() {
    return this.box !== undefined && this.box.right - this.box.left > 10 && this.box.bottom - this.box.top > 10;
  }

  view() {
    return [this.x.low, this.x.high, this.y.low, this.y.high];
  }

  /** Sets the limits; those of before can be gone back to if `remember`. */
  look([x0, x1, y0, y1], remember = true) {
    const tooSmall = (a, b) => !(b - a > 1e-13 * Math.max(Math.abs(a), Math.abs(b), 1e-300)) || !Number.isFinite(b - a);
    if (tooSmall(x0, x1) || tooSmall(y0, y1)) return;
    if (remember) this.remember();
    [this.x.low, this.x.high, this.y.low, this.y.high] = [x0, x1, y0, y1];
    this.fitted = false;
    this.options.viewed?.();
    this.settle();
  }

  remember() {
    this.past.push({ view: this.view(), fitted: this.fitted });
    if (this.past.length > VIEWS) this.past.shift();
    this.future.length = 0;
  }

  /** Goes back or forward in the history of views. */
  travel(from, to) {
    const found = from.pop();
    if (!found) return;
    to.push({ view: this.view(), fitted: this.fitted });
    [this.x.low, this.x.high, this.y.low, this.y.high] = found.view;
    this.fitted = found.fitted;
    this.options.viewed?.();
    this.redraw();
  }

  back() {
    this.travel(this.past, this.future);
  }

  forward() {
    this.travel(this.future, this.past);
  }

  /** Shows everything. */
  fit(remember = true) {
    if (!this.ready) return;
    if (remember) this.remember();
    const extent = this.options.extent();
    if (extent) {
      [this.x.low, this.x.high] = around(...extent.x);
      [this.y.low, this.y.high] = around(...extent.y);
      if (this.options.equal?.()) this.even();
    }
    this.fitted = true;
    if (remember) this.options.viewed?.();
    this.redraw();
  }

  /** One unit is the same length on both axes. */
  even() {
    const [w, h] = [this.box.right - this.box.left, this.box.bottom - this.box.top];
    const unit = Math.max((this.x.high - this.x.low) / w, (this.y.high - this.y.low) / h);
    const middle = (axis, length) => {
      const centre = (axis.low + axis.high) / 2;
      [axis.low, axis.high] = [centre - (unit * length) / 2, centre + (unit * length) / 2];
    };
    middle(this.x, w);
    middle(this.y, h);
  }

  /** The data have changed: draws them, and shows everything if that was shown before. */
  changed() {
    if (this.fitted) this.fit(false);
    else this.redraw();
  }

  zoom(factor, px, py) {
    const part = (axis, pixel) => {
      const at = axis.evenOfPixel(pixel);
      return [at - (at - axis.low) * factor, at + (axis.high - at) * factor];
    };
    const now = performance.now();
    const go = this.lastZoom === undefined || now - this.lastZoom > 700;
    this.lastZoom = now;
    this.look([...part(this.x, px ?? (this.x.from + this.x.to) / 2), ...part(this.y, py ?? (this.y.from + this.y.to) / 2)], go);
  }

  pan(dx, dy, remember = false) {
    const shift = (axis, d) => (d / (axis.to - axis.from)) * (axis.high - axis.low);
    const [sx, sy] = [shift(this.x, dx), shift(this.y, dy)];
    this.look([this.x.low - sx, this.x.high - sx, this.y.low - sy, this.y.high - sy], remember);
  }

  // Drawing.

  /** Draws a frame soon. */
  ask() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.frame();
    });
  }

  /** Draws the data soon. */
  redraw() {
    this.drawn = null;
    this.ask();
  }

  /** Moves the bitmap now and draws the data when the hand has stopped. */
  settle() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.redraw(), SETTLED);
    this.ask();
  }

  frame() {
    if (!this.ready) return;
    const start = performance.now();
    const theme = themeColours();
    if (!this.drawn || this.isUsedUp()) this.drawBitmap(theme);
    const context = this.canvas.getContext("2d");
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.fillStyle = theme.panel;
    context.fillRect(0, 0, this.width, this.height);
    const surface = new CanvasSurface(context, theme.font);
    this.axes(surface, theme, true);
    this.blit(context);
    this.axes(surface, theme, false);
    const { left, top, right, bottom } = this.box;
    surface.clip(left, top, right - left, bottom - top);
    this.options.overlay?.(surface, this.x, this.y, theme);
    surface.unclip();
    if (this.band) {
      const { x0, y0, x1, y1 } = this.band;
      context.fillStyle = theme.accent;
      context.globalAlpha = 0.15;
      context.fillRect(x0, y0, x1 - x0, y1 - y0);
      context.globalAlpha = 1;
      context.strokeStyle = theme.accent;
      context.strokeRect(x0, y0, x1 - x0, y1 - y0);
    }
    this.cost.frame = performance.now() - start;
    this.cost.frames += 1;
  }

  drawBitmap(theme) {
    const start = performance.now();
    const { left, top, right, bottom } = this.box;
    const [w, h] = [right - left, bottom - top];
    const [ox, oy] = [Math.round(BEYOND * w), Math.round(BEYOND * h)];
    this.bitmap.width = Math.ceil((w + 2 * ox) * this.ratio);
    this.bitmap.height = Math.ceil((h + 2 * oy) * this.ratio);
    const context = this.bitmap.getContext("2d");
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    const wide = (axis, from, to, part) => {
      const copy = axis.copy();
      const extra = part * (axis.high - axis.low);
      [copy.low, copy.high, copy.from, copy.to] = [axis.low - extra, axis.high + extra, from, to];
      return copy;
    };
    const [x, y] = [wide(this.x, 0, w + 2 * ox, ox / w), wide(this.y, h + 2 * oy, 0, oy / h)];
    this.options.draw(new CanvasSurface(context, theme.font), x, y, theme);
    this.drawn = { x, y };
    this.cost.redraw = performance.now() - start;
  }

  isUsedUp() {
    const { x, y } = this.drawn;
    const out = (wide, now) => now.low < wide.low || now.high > wide.high || (now.high - now.low) * 4 < wide.high - wide.low;
    return out(x, this.x) || out(y, this.y);
  }

  blit(context) {
    const { x, y } = this.drawn;
    const { left, top, right, bottom } = this.box;
    const [x0, x1] = [this.x.pixelOfEven(x.low), this.x.pixelOfEven(x.high)];
    const [y1, y0] = [this.y.pixelOfEven(y.low), this.y.pixelOfEven(y.high)];
    context.save();
    context.beginPath();
    context.rect(left, top, right - left, bottom - top);
    context.clip();
    context.drawImage(this.bitmap, x0, y0, x1 - x0, y1 - y0);
    context.restore();
  }

  /** Grid behind the data, or frame, ticks and labels in front of them. */
  axes(surface, theme, behind) {
    if (this.options.plain?.()) return;
    const { left, top, right, bottom } = this.box;
    const small = this.options.small;
    const xs = this.x.ticks((right - left) / (small ? 42 : 90));
    // The vertical axis of rows has no numbers.
    const ys = this.options.rows?.() ? [] : this.y.ticks((bottom - top) / (small ? 30 : 50));
    const line = (x0, y0, x1, y1, stroke, width = 1) => surface.line([x0, x1], [y0, y1], 2, { stroke, width });
    const px = (tick) => Math.round(this.x.pixelOfEven(tick.at)) + 0.5;
    const py = (tick) => Math.round(this.y.pixelOfEven(tick.at)) + 0.5;
    if (behind) {
      xs.forEach((tick) => line(px(tick), top, px(tick), bottom, theme.grid));
      ys.forEach((tick) => line(left, py(tick), right, py(tick), theme.grid));
      return;
    }
    const corners = [[left, right, right, left, left], [top, top, bottom, bottom, top]];
    surface.line(corners[0].map((v) => Math.round(v) + 0.5), corners[1].map((v) => Math.round(v) + 0.5), 5, { stroke: theme.line });
    const size = small ? 10 : 11;
    xs.forEach((tick) => {
      line(px(tick), bottom, px(tick), bottom + 4, theme.faint);
      surface.text(tick.text, px(tick), bottom + (small ? 11 : 13), { size, colour: theme.soft, align: "center" });
    });
    let widest = 0;
    ys.forEach((tick) => {
      line(left - 4, py(tick), left, py(tick), theme.faint);
      surface.text(tick.text, left - 7, py(tick), { size, colour: theme.soft, align: "right" });
      widest = Math.max(widest, tick.text.length);
    });
    const label = { size: size + 1, colour: theme.fg, align: "center" };
    surface.text(this.labels.x, (left + right) / 2, bottom + (small ? 24 : 29), label);
    surface.text(this.labels.y, small ? 8 : 13, (top + bottom) / 2, { ...label, turn: -90 });
  }

  /** The chart as SVG text. */
  svg(title) {
    return this.onto(new SvgSurface(Math.round(this.width), Math.round(this.height), themeColours().font, title));
  }

  /** The chart as the text of a PDF. */
  pdf() {
    return this.onto(new PdfSurface(Math.round(this.width), Math.round(this.height)));
  }

  /** Draws onto a surface, and returns its picture. */
  onto(surface) {
    const theme = themeColours();
    const { left, top, right, bottom } = this.box;
    this.axes(surface, theme, true);
    surface.clip(left, top, right - left, bottom - top);
    this.options.draw(surface, this.x, this.y, theme);
    surface.unclip();
    this.axes(surface, theme, false);
    return surface.picture(theme.panel);
  }

  /** The chart as a PNG image with twice the resolution of the screen. */
  png() {
    const theme = themeColours();
    const canvas = document.createElement("canvas");
    const scale = 2 * this.ratio;
    [canvas.width, canvas.height] = [Math.round(this.width * scale), Math.round(this.height * scale)];
    const context = canvas.getContext("2d");
    context.scale(scale, scale);
    context.fillStyle = theme.panel;
    context.fillRect(0, 0, this.width, this.height);
    const surface = new CanvasSurface(context, theme.font);
    const { left, top, right, bottom } = this.box;
    this.axes(surface, theme, true);
    surface.clip(left, top, right - left, bottom - top);
    this.options.draw(surface, this.x, this.y, theme);
    surface.unclip();
    this.axes(surface, theme, false);
    return new Promise((done) => canvas.toBlob(done, "image/png"));
  }

  // The hand.

  listen() {
    const { canvas } = this;
    const at = (event) => {
      const rect = canvas.getBoundingClientRect();
      return [event.clientX - rect.left, event.clientY - rect.top];
    };
    const inside = ([px, py]) => this.ready && px >= this.box.left && px <= this.box.right && py >= this.box.top && py <= this.box.bottom;
    let start = null;
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || !inside(at(event))) return;
      this.pointers.set(event.pointerId, at(event));
      canvas.setPointerCapture(event.pointerId);
      start = { at: at(event), last: at(event), moved: false, box: event.shiftKey };
    });
    canvas.addEventListener("pointermove", (event) => {
      const now = at(event);
      if (this.pointers.size === 2 && this.pointers.has(event.pointerId)) {
        this.pinch(event.pointerId, now);
        return;
      }
      if (!start || !this.pointers.has(event.pointerId)) {
        this.options.hover?.(now[0], now[1], inside(now));
        return;
      }
      if (!start.moved && Math.hypot(now[0] - start.at[0], now[1] - start.at[1]) < 4) return;
      if (!start.moved && !start.box && !this.options.drag) this.remember();
      start.moved = true;
      this.options.hover?.(0, 0, false);
      if (start.box) {
        this.band = { x0: start.at[0], y0: start.at[1], x1: now[0], y1: now[1] };
        this.ask();
      } else if (this.options.drag?.(now[0] - start.last[0], now[1] - start.last[1]) !== true) {
        this.pan(now[0] - start.last[0], now[1] - start.last[1]);
      }
      start.last = now;
    });
    const end = (event) => {
      this.pointers.delete(event.pointerId);
      if (!start) return;
      const done = start;
      start = null;
      if (this.band) this.boxed();
      else if (!done.moved && event.type === "pointerup") this.options.press?.(...done.at);
    };
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
    canvas.addEventListener("pointerleave", () => this.options.hover?.(0, 0, false));
    canvas.addEventListener("dblclick", () => this.fit());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 30 : 1;
      this.zoom(1.0015 ** Math.max(-600, Math.min(600, event.deltaY * lines)), ...at(event));
    }, { passive: false });
  }

  boxed() {
    const { x0, y0, x1, y1 } = this.band;
    this.band = null;
    if (Math.abs(x1 - x0) < 5 || Math.abs(y1 - y0) < 5) {
      this.ask();
      return;
    }
    const sorted = (axis, a, b) => [axis.evenOfPixel(a), axis.evenOfPixel(b)].sort((p, q) => p - q);
    this.look([...sorted(this.x, x0, x1), ...sorted(this.y, y0, y1)]);
    this.redraw();
  }

  pinch(id, now) {
    const [a, b] = [...this.pointers.values()];
    const before = Math.hypot(a[0] - b[0], a[1] - b[1]);
    this.pointers.set(id, now);
    const [c, d] = [...this.pointers.values()];
    const after = Math.hypot(c[0] - d[0], c[1] - d[1]);
    if (before > 10 && after > 10) this.zoom(before / after, (c[0] + d[0]) / 2, (c[1] + d[1]) / 2);
  }
}
