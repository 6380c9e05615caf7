// Lists beside the diagram: branches, special points, the selected point, notes and ends.

import { branchColour, isDark, kindOf } from "./colours.js";
import { button, make } from "./dom.js";
import { traceMarker } from "./draw.js";
import { exact, greek, labelled, magnitude, shown } from "./numbers.js";

/** A marker as a small picture. */
function kindIcon(kind) {
  const space = "http://www.w3.org/2000/svg";
  const { shape, colour } = kindOf(kind);
  let path = "";
  traceMarker(shape, 8, 8, 5)({
    moveTo: (x, y) => (path += `M${x} ${y}`),
    lineTo: (x, y) => (path += `L${x} ${y}`),
    closePath: () => (path += "Z"),
    arc: (x, y, r) => (path += `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0Z`),
  });
  const svg = document.createElementNS(space, "svg");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("aria-hidden", "true");
  const element = document.createElementNS(space, "path");
  element.setAttribute("d", path);
  element.setAttribute("fill", shape === "ring" ? "none" : colour);
  if (shape === "ring") element.setAttribute("stroke", colour);
  svg.append(element);
  return svg;
}

/** The list of branches with switches for each. */
export class BranchList {
  constructor(host, run, diagram, heard) {
    Object.assign(this, { host, run, diagram, heard, shown: "" });
  }

  show() {
    const { run, diagram } = this;
    const rows = run.listed().map((branch) => [branch.id, branch.about.name, branch.length, branch.special.length, diagram.belongs(branch), diagram.hidden.has(branch.id), diagram.alone]);
    const now = JSON.stringify([rows, diagram.selected?.branch, isDark(), run.state.responses.length, diagram.hidden.has("responses")]);
    if (now === this.shown) return;
    this.shown = now;
    const focused = document.activeElement?.closest?.("[data-branch]")?.getAttribute("data-branch");
    const list = run.listed().map((branch) => this.row(branch));
    if (run.state.responses.length > 0) list.push(this.responses());
    if (diagram.alone !== null) list.unshift(button("Show all branches", "Show all branches", () => this.heard.alone(null)));
    this.host.replaceChildren(...list);
    if (focused) this.host.querySelector(`[data-branch="${CSS.escape(focused)}"] .branch`)?.focus({ preventScroll: true });
  }

  row(branch) {
    const { diagram } = this;
    const { name } = branch.about;
    const shownNow = !diagram.hidden.has(branch.id);
    const belongs = diagram.belongs(branch);
    const check = make("input", { type: "checkbox", "aria-label": `Show ${name}`, title: "Show or hide",
      onchange: () => this.heard.hide(branch.id, !check.checked) });
    check.checked = shownNow;
    const colour = make("span", { class: "swatch" });
    colour.style.background = branchColour(branch.colour, isDark());
    const short = branch.depth > 0 && name.startsWith(`${branch.about.parent}/`) ? name.slice(branch.about.parent.length + 1) : name;
    const why = belongs ? "" : "; not in these axes";
    const label = `${name}: ${branch.about.family}, ${branch.length} points, from ${branch.about.origin}${why}. Double click: this branch alone`;
    const press = make("button", { class: "branch", type: "button", title: label, onclick: () => this.heard.branch(branch.id), ondblclick: () => this.heard.alone(branch.id) },
      colour, make("span", { text: short }), make("small", { text: String(branch.length) }));
    const current = diagram.selected?.branch === branch.id;
    if (current) press.setAttribute("aria-current", "true");
    return make("div", { class: `branch-row d${branch.depth}${current ? " current" : ""}${belongs ? "" : " away"}`, "data-branch": branch.id }, check, press);
  }

  responses() {
    const check = make("input", { type: "checkbox", "aria-label": "Show results of simulation", onchange: () => this.heard.hide("responses", !check.checked) });
    check.checked = !this.diagram.hidden.has("responses");
    const count = this.run.state.responses.reduce((sum, set) => sum + set.rows.length, 0);
    return make("div", { class: "branch-row d0" }, check, make("span", { class: "branch" }, make("span", { text: "surveys and sweeps" }), make("small", { text: String(count) })));
  }
}

/** The table of special points. */
export class SpecialTable {
  constructor(host, run, diagram, select) {
    Object.assign(this, { host, run, diagram, select, order: null, down: false, shown: "" });
  }

  show() {
    const { run, diagram } = this;
    const chosen = diagram.selected?.special >= 0 ? `${diagram.selected.branch}:${diagram.selected.special}` : "";
    const free = this.columns();
    const now = JSON.stringify([run.epoch, run.state.special.length, run.changes, free, this.order, this.down, chosen]);
    if (now === this.shown) return;
    this.shown = now;
    const about = run.about.quantities;
    const quantities = free.map((k) => [k, greek(about[k].name)]);
    const heads = [["kind", "kind"], ...quantities.slice(0, 1), ["branch", "branch"], ...quantities.slice(1)];
    const focused = this.host.contains(document.activeElement) ? document.activeElement.getAttribute("data-key") : null;
    const head = heads.map(([key, text]) => {
      const sorted = this.order === key ? (this.down ? "descending" : "ascending") : "none";
      const mark = this.order === key ? (this.down ? " ↓" : " ↑") : "";
      const press = button(text + mark, `Sort by ${text}`, () => this.sort(key));
      press.setAttribute("data-key", `head-${key}`);
      return make("th", { scope: "col", "aria-sort": sorted, class: typeof key === "number" ? "number" : null }, press);
    });
    const rows = this.rows().map((own) => this.row(own, free, chosen));
    const none = make("tr", {}, make("td", { colspan: heads.length, text: "none yet" }));
    this.host.replaceChildren(make("table", {}, make("thead", {}, make("tr", {}, ...head)), make("tbody", {}, ...(rows.length ? rows : [none]))));
    if (focused) this.host.querySelector(`[data-key="${CSS.escape(focused)}"]`)?.focus({ preventScroll: true });
    this.host.querySelector('tr[aria-selected="true"]')?.scrollIntoView({ block: "nearest" });
  }

  /** The quantities shown: those of the axes. */
  columns() {
    return [...new Set([this.diagram.qx, this.diagram.qy])];
  }

  rows() {
    const value = (own) => (this.order === "kind" ? own.kind : this.order === "branch" ? this.name(own) : own.values[this.order] ?? NaN);
    const list = this.run.state.special.filter((own) => this.run.branches.has(own.branch));
    if (this.order === null) return list;
    const compare = (a, b) => (a === b ? 0 : a < b || Number.isNaN(b) ? -1 : 1);
    return [...list].sort((a, b) => (this.down ? -1 : 1) * compare(value(a), value(b)));
  }

  name(own) {
    return this.run.branches.get(own.branch)?.about.name ?? "";
  }

  sort(key) {
    [this.order, this.down] = this.order === key ? [key, !this.down] : [key, false];
    this.show();
  }

  row(own, free, chosen) {
    const id = `${own.branch}:${own.index}`;
    const title = this.run.about.kinds.find((kind) => kind.name === own.kind)?.title ?? own.kind;
    const go = () => this.select({ branch: own.branch, position: own.position, special: own.index });
    const key = (event) => {
      if (event.key === "Enter" || event.key === " ") {
        event.preventDefault();
        go();
      } else if (event.key === "ArrowDown" || event.key === "ArrowUp") {
        event.preventDefault();
        event.stopPropagation();
        const row = event.currentTarget;
        (event.key === "ArrowDown" ? row.nextElementSibling : row.previousElementSibling)?.focus();
      }
    };
    const cells = free.map((k) => make("td", { class: "number", text: shown(own.values[k], 7), title: shown(own.values[k]), "data-value": exact(own.values[k]), "data-quantity": this.run.about.quantities[k].name }));
    return make("tr", { class: "pick", tabindex: 0, "aria-selected": String(id === chosen), "data-key": id, "data-kind": own.kind, onclick: go, onkeydown: key, title: own.form || title },
      make("td", {}, make("span", { class: "kind" }, kindIcon(own.kind), title)),
      ...cells.slice(0, 1), make("td", { text: this.name(own) }), ...cells.slice(1));
  }
}

/** The numbers of the selected point. */
export function showPoint(host, run, branch, place, header) {
  if (!branch) {
    host.replaceChildren(make("p", { class: "empty", text: "" }));
    return [];
  }
  const about = run.about.quantities;
  const special = branch.special[place.special];
  const text = [];
  const rows = [];
  const add = (name, value, title, kind = "number") => {
    rows.push(make("tr", {}, make("td", { text: name, title }), make("td", { class: kind, text: value })));
    text.push(`${name} = ${value}`);
  };
  const head = (name) => rows.push(make("tr", {}, make("th", { colspan: 2, scope: "colgroup", text: name })));
  const value = (k) => (special ? special.values[k] : header?.values[k]) ?? NaN;
  const list = (classes) => about.forEach((own, k) => {
    if (classes.includes(own.class) && !Number.isNaN(value(k))) add(labelled(greek(own.name), own.unit), shown(value(k)), own.description);
  });
  if (special) {
    add("kind", run.about.kinds.find((kind) => kind.name === special.kind)?.title ?? special.kind, "", "word");
    if (special.form) add("normal form", special.form, "", "word");
    add("error", magnitude(special.error), "bound on the error of parameter and solution");
    add("unstable", `${special.before} → ${special.after}`);
  } else if (header) {
    add("position", String(place.position));
    add("unstable", String(header.unstable));
  }
  head("parameters");
  list(["parameter"]);
  head("solution");
  list(["period", "max", "min", "norm"]);
  if (header) {
    head(header.period === undefined ? "eigenvalues" : "multipliers");
    header.spectrum.slice(0, 60).forEach(([re, im], k) => {
      const sign = im < 0 ? "−" : "+";
      add(`${header.period === undefined ? "λ" : "μ"}${k + 1}`, im === 0 ? shown(re) : `${shown(re)} ${sign} ${shown(Math.abs(im))} i`);
    });
    head("accuracy");
    const { trust } = header;
    add("discretisation", magnitude(trust.discretisation), "estimated error of the profile");
    add("residual", magnitude(trust.residual));
    add("spectrum", magnitude(trust.spectrum), "estimated error of the eigenvalues or multipliers");
    if (header.trivial > 0) add("|μ₁ − 1|", magnitude(trust.trivial), "error of the multiplier that is 1");
    if (header.period !== undefined) add("Liouville defect", magnitude(trust.liouville));
    if (header.mesh) add("mesh", `${header.mesh.length - 1} intervals of degree ${header.degree}`);
  }
  host.replaceChildren(make("table", {}, make("tbody", {}, ...rows)));
  return text;
}

/** Ends, notes, and texts of study and model. */
export class Log {
  constructor(host, tabs, run, desk = null) {
    Object.assign(this, { host, tabs, run, desk, tab: "ends", shown: "" });
  }

  /** Shows one of the texts. */
  open(tab) {
    this.tab = tab;
    this.show();
  }

  show() {
    const { state, about } = this.run;
    const notes = state.notes.length + state.shortfalls.length;
    const all = [["ends", "Ends"], ["notes", `Notes (${notes})`], ["study", "Study"], ["model", "Model"], ...(this.desk?.verified ? [["verified", "Verification"]] : [])];
    const now = JSON.stringify([this.tab, this.run.epoch, this.run.changes, this.desk?.verified?.text]);
    if (now === this.shown) return;
    // An editor keeps its place and its focus.
    const panel = this.desk?.panels[this.tab];
    if (panel && this.host.contains(panel)) return;
    this.shown = now;
    document.body.toggleAttribute("data-editing", panel !== undefined);
    this.tabs.replaceChildren(...all.map(([key, text]) => make("button", { type: "button", role: "tab", text, "aria-selected": String(this.tab === key), onclick: () => {
      this.tab = key;
      this.show();
      this.tabs.querySelector('[aria-selected="true"]').focus();
    } })));
    this.host.replaceChildren(this.content(state, about));
  }

  content(state, about) {
    const panel = this.desk?.panels[this.tab];
    if (panel) return panel;
    if (this.tab === "study" || this.tab === "model") return make("pre", { text: about[this.tab].text, "aria-label": about[this.tab].file });
    if (this.tab === "verified") return this.desk.verification();
    const rows = this.tab === "ends" ? this.ends(state) : this.notes(state);
    return make("table", {}, make("tbody", {}, ...rows));
  }

  ends(state) {
    const end = (own) => make("td", { text: own ? own.text : "…", class: own && !own.complete ? "bad" : null });
    return state.branches.map((own) => make("tr", {}, make("td", { text: own.name }), end(own.ends[0]), end(own.ends[1])));
  }

  notes(state) {
    const rows = state.notes.map(([name, note]) => make("tr", {}, make("td", { text: name }), make("td", { text: note })));
    const short = state.shortfalls.map(([name, what]) => make("tr", {}, make("td", { text: name }), make("td", { class: "bad", text: `incomplete: ${what}` })));
    const all = [...short, ...rows];
    return all.length ? all : [make("tr", {}, make("td", { text: "none" }))];
  }
}
