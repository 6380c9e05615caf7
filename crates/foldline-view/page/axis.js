// One axis: from values to pixels and back. Limits are kept in the coordinates in which the axis is even.

import { logTicks, ticks } from "./numbers.js";

/** An axis, linear or logarithmic. */
export class Axis {
  constructor() {
    this.low = 0;
    this.high = 1;
    this.log = false;
    this.from = 0;
    this.to = 1;
  }

  /** Even coordinate of a value; NaN if the axis cannot show it. */
  even(value) {
    const even = this.log ? (value > 0 ? Math.log10(value) : NaN) : value;
    // An amplitude of zero has a level of -∞ dB.
    return Number.isFinite(even) ? even : NaN;
  }

  value(even) {
    return this.log ? 10 ** even : even;
  }

  pixelOfEven(even) {
    return this.from + ((even - this.low) / (this.high - this.low)) * (this.to - this.from);
  }

  pixel(value) {
    return this.pixelOfEven(this.even(value));
  }

  evenOfPixel(pixel) {
    return this.low + ((pixel - this.from) / (this.to - this.from)) * (this.high - this.low);
  }

  ticks(count) {
    return this.log ? logTicks(this.low, this.high, count) : ticks(this.low, this.high, count);
  }

  copy() {
    return Object.assign(new Axis(), this);
  }
}

/** Limits around values with a margin; something sensible for a single value or none. */
export function around(low, high, margin = 0.04) {
  if (!(high >= low)) return [0, 1];
  if (high - low <= 1e-12 * Math.max(Math.abs(low), Math.abs(high))) {
    const half = Math.max(Math.abs(low) * 0.1, 1e-12) || 1;
    return low === 0 ? [-1, 1] : [low - half, high + half];
  }
  const extra = margin * (high - low);
  return [low - extra, high + extra];
}
