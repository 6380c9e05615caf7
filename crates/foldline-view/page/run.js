// The run as the page knows it: branches with columns of numbers, and special points.

import { COLUMNS } from "./source.js";

/**
 * A point or special point on a branch.
 * @typedef {{branch: number, position: number, special: number}} Place  special is -1 for a point
 */

/** A branch: columns of numbers by position, and the order of its points with special points between them. */
export class Branch {
  constructor(id) {
    this.id = id;
    this.low = 0;
    this.high = -1;
    /** @type {Map<string | number, Float64Array>} */
    this.columns = new Map();
    /** @type {any} */
    this.about = { name: "", family: "", free: 0, follows: null, ends: [null, null], parent: null };
    /** @type {any[]} */
    this.special = [];
    this.colour = 0;
    this.depth = 0;
    this.version = 0;
    this.order = null;
  }

  get length() {
    return this.high - this.low + 1;
  }

  /** Makes room for positions from `low` to `high`. */
  extend(low, high) {
    if (this.length > 0 && low >= this.low && high <= this.high) return;
    const [first, last] = this.length > 0 ? [Math.min(low, this.low), Math.max(high, this.high)] : [low, high];
    for (const [key, old] of this.columns) {
      const column = new Float64Array(last - first + 1).fill(NaN);
      if (this.length > 0) column.set(old, this.low - first);
      this.columns.set(key, column);
    }
    this.low = first;
    this.high = last;
    this.touch();
  }

  column(key) {
    let column = this.columns.get(key);
    if (!column) {
      column = new Float64Array(Math.max(0, this.length)).fill(NaN);
      this.columns.set(key, column);
    }
    return column;
  }

  touch() {
    this.version += 1;
    this.order = null;
  }

  /** Points and special points in the order of the branch. */
  places() {
    if (!this.order) {
      const after = new Map();
      this.special.forEach((own, k) => {
        const at = Math.min(Math.max(own.position, this.low - 1), this.high);
        after.set(at, [...(after.get(at) ?? []), k]);
      });
      const order = (after.get(this.low - 1) ?? []).map((k) => ({ branch: this.id, position: this.low, special: k }));
      for (let position = this.low; position <= this.high; position += 1) {
        order.push({ branch: this.id, position, special: -1 });
        for (const k of after.get(position) ?? []) order.push({ branch: this.id, position, special: k });
      }
      this.order = order;
    }
    return this.order;
  }

  /** Index of a place in the order; -1 if it does not exist. */
  indexOf(place) {
    return this.places().findIndex((own) => own.position === place.position && own.special === place.special);
  }

  /** Value of a quantity at a place. */
  value(place, quantity) {
    if (place.special >= 0) return this.special[place.special]?.values[quantity] ?? NaN;
    return this.columns.get(quantity)?.[place.position - this.low] ?? NaN;
  }

  unstable(place) {
    if (place.special >= 0) return this.special[place.special]?.after ?? 0;
    return this.columns.get("unstable")?.[place.position - this.low] ?? 0;
  }
}

/** A run. */
export class Run {
  /** @param {import("./source.js").Source} source */
  constructor(source) {
    this.source = source;
    this.about = null;
    this.state = { branches: [], special: [], notes: [], responses: [], shortfalls: [], running: false, code: null, points: 0 };
    /** @type {Map<number, Branch>} */
    this.branches = new Map();
    this.epoch = 0;
    this.cursor = 0;
    this.loaded = new Set();
    /** @type {Map<number, Map<string, number>>} Values of special points by quantity, if they follow from profiles. */
    this.profiles = new Map();
    this.mark = "";
    this.queue = Promise.resolve();
    this.changes = 0;
  }

  /** Runs one task after the other. */
  inTurn(task) {
    const done = this.queue.then(task);
    this.queue = done.catch(() => {});
    return done;
  }

  async begin() {
    this.about = await this.source.run();
  }

  /** Index of a quantity by name; -1 if there is none. */
  quantity(name) {
    return this.about.quantities.findIndex((own) => own.name === name);
  }

  /** Fetches the state, and all points that are new. */
  refresh() {
    return this.inTurn(async () => {
      const { epoch, state } = await this.source.state();
      if (epoch !== this.epoch) this.restart(epoch);
      this.take(state);
      // Before the axes are known no column is wanted.
      if (this.loaded.size > 0) await this.fetchPoints([...this.loaded]);
      await this.complete();
    });
  }

  /** Makes sure that columns are there. */
  ensure(columns) {
    return this.inTurn(async () => {
      const missing = columns.filter((k) => k >= 0 && !this.loaded.has(k));
      if (missing.length === 0) return;
      const last = this.cursor;
      this.cursor = 0;
      await this.fetchPoints(missing, last);
      missing.forEach((k) => this.loaded.add(k));
      await this.fetchPoints([...this.loaded]);
      await this.complete();
    });
  }

  /** Fetches the values of special points that follow from their profiles: the state does not have them. */
  async complete() {
    const { special } = this.state;
    const mark = `${this.epoch}:${special.length}`;
    // A special point that is found later may come before others of its branch.
    if (mark !== this.mark) this.profiles.clear();
    this.mark = mark;
    const missing = [...this.loaded].filter((k) => this.about.quantities[k]?.profile && !this.profiles.has(k));
    for (let from = 0; from < missing.length; from += COLUMNS) {
      const found = await this.source.special(missing.slice(from, from + COLUMNS));
      if (!found) return;
      const [branches, indices, ...values] = found.columns;
      found.header.columns.forEach((k, at) => this.profiles.set(k, new Map(Array.from(values[at], (value, row) => [`${branches[row]}:${indices[row]}`, value]))));
    }
    if (this.profiles.size === 0) return;
    for (const own of [...special, ...[...this.branches.values()].flatMap((branch) => branch.special)]) {
      for (const [k, values] of this.profiles) own.values[k] = values.get(`${own.branch}:${own.index}`) ?? NaN;
    }
    for (const branch of this.branches.values()) branch.touch();
    this.changes += 1;
  }

  /** Adds a quantity by its name, and returns its index. */
  add(name) {
    return this.inTurn(async () => {
      const { index } = await this.source.order("quantity", { name });
      await this.begin();
      return index;
    });
  }

  restart(epoch) {
    this.epoch = epoch;
    this.cursor = 0;
    this.branches.clear();
  }

  async fetchPoints(columns, until = Infinity) {
    let more = true;
    while (more && this.cursor < until) {
      const parts = [];
      for (let k = 0; k === 0 || k < columns.length; k += COLUMNS) {
        parts.push(await this.source.points(this.epoch, this.cursor, columns.slice(k, k + COLUMNS)));
      }
      if (parts.some((part) => part.header.restart)) {
        // The next notice names the new epoch.
        this.epoch = -1;
        return;
      }
      const rows = Math.min(...parts.map((part) => part.header.rows));
      for (const part of parts) this.insert(part, rows);
      this.cursor += rows;
      more = rows > 0 && parts[0].header.more;
    }
  }

  insert(frame, rows) {
    const [branches, positions, unstable, ...values] = frame.columns;
    for (let from = 0; from < rows; ) {
      let to = from + 1;
      while (to < rows && branches[to] === branches[from] && positions[to] === positions[to - 1] + 1) to += 1;
      const branch = this.branch(branches[from]);
      branch.extend(positions[from], positions[to - 1]);
      const at = positions[from] - branch.low;
      branch.column("unstable").set(unstable.subarray(from, to), at);
      frame.header.columns.forEach((k, index) => branch.column(k).set(values[index].subarray(from, to), at));
      branch.touch();
      from = to;
    }
    if (rows > 0) this.changes += 1;
  }

  branch(id) {
    let branch = this.branches.get(id);
    if (!branch) {
      branch = new Branch(id);
      this.branches.set(id, branch);
    }
    return branch;
  }

  take(state) {
    this.state = state;
    this.changes += 1;
    const special = new Map();
    for (const own of state.special) special.set(own.branch, [...(special.get(own.branch) ?? []), own]);
    const byName = new Map(state.branches.map((own) => [own.name, own]));
    const depth = (own, seen = 0) => (own?.parent && byName.has(own.parent) && seen < 4 && own.held === null ? 1 + depth(byName.get(own.parent), seen + 1) : 0);
    state.branches.forEach((own, k) => {
      const branch = this.branch(own.id);
      branch.about = own;
      branch.colour = k;
      branch.depth = depth(own);
      const list = special.get(own.id) ?? [];
      if (list.length !== branch.special.length || list.some((s, i) => s.position !== branch.special[i].position)) {
        branch.special = list;
        branch.touch();
      }
    });
  }

  /** Branches in the order of the tables. */
  listed() {
    return this.state.branches.map((own) => this.branches.get(own.id)).filter((own) => own !== undefined);
  }

  /** Default axes: the free parameter of most points, and the largest value of the first output or state. */
  defaults() {
    const count = new Map();
    for (const branch of this.listed().filter((own) => own.about.held === null)) {
      const reach = branch.about.reach;
      count.set(branch.about.free, (count.get(branch.about.free) ?? 0) + (reach ? reach[1] - reach[0] + 1 : 1));
    }
    const free = [...count].sort((a, b) => b[1] - a[1])[0]?.[0] ?? this.state.responses[0]?.free ?? 0;
    const channels = this.about.channels;
    const first = channels.find((own) => own.class === "output") ?? channels[0];
    const x = Math.max(0, this.about.quantities.findIndex((own, k) => own.class === "parameter" && k === free));
    return { x, y: Math.max(0, this.quantity(`${first?.name}_max`)) };
  }
}
