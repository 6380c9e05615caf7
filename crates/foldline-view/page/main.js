// The page: connects data, diagram and panels.

import { isDark } from "./colours.js";
import { Diagram, quantityLabel } from "./diagram.js";
import { askForQuantity } from "./names.js";
import { button, byId, choice, copied, make, still } from "./dom.js";
import { listenToKeys, showKeys } from "./keys.js";
import { BranchList, Log, showPoint, SpecialTable } from "./lists.js";
import { greek } from "./numbers.js";
import { OrbitPanel, Solution } from "./orbit.js";
import { Run } from "./run.js";
import { csvText, saveCsv, savePage, savePdf, savePng, saveSvg } from "./save.js";
import { notebook, savedView, source } from "./source.js";
import { MultipliersPanel, SpectrumPanel } from "./spectrum.js";
import { Desk, Pace, showExamples } from "./study.js";

/** Milliseconds between two steps of a walk along a branch. */
const STEP = 70;
/** Number of solutions kept. */
const KEPT = 200;

class App {
  constructor() {
    this.run = new Run(source());
    this.selected = null;
    this.pinned = null;
    this.solutions = new Map();
    this.header = null;
    this.pointText = [];
    this.walking = false;
    this.connected = true;
    this.ready = false;
    this.log = [false, false];
  }

  async begin() {
    this.theme();
    await this.run.begin();
    const { about } = this.run;
    this.diagram = new Diagram(byId("diagram-chart"), this.run, {
      select: (place) => this.select(place),
      hover: (place) => this.hover(place),
      viewed: () => this.remember(),
    });
    this.orbit = new OrbitPanel(byId("orbit-chart"), byId("orbit-controls"), byId("orbit-play"), () => {});
    this.spectrum = new SpectrumPanel(byId("spectrum-chart"), byId("spectrum-controls"));
    this.multipliers = new MultipliersPanel(byId("multipliers-chart"), byId("multipliers-head"));
    this.branchList = new BranchList(byId("branch-list"), this.run, this.diagram, {
      branch: (id) => this.selectBranch(id),
      hide: (id, hidden) => this.hide(id, hidden),
      alone: (id) => this.alone(id),
    });
    this.specialTable = new SpecialTable(byId("special-list"), this.run, this.diagram, (place) => this.select(place, true));
    if (this.run.source.live) this.desk = new Desk(this.run, { tell: (text) => this.tell(text), open: (tab) => this.notes.open(tab) });
    this.pace = new Pace(byId("pace"), this.run, (text) => this.tell(text));
    this.notes = new Log(byId("log-text"), byId("log-tabs"), this.run, this.desk ?? null);
    this.orbit.begin(about);
    this.orbit.show();
    this.spectrum.begin(about);
    this.spectrum.set(null);
    this.multipliers.set(null);
    byId("title").textContent = `${about.study.file} · ${about.model.name}`;
    document.title = `${about.study.file} – foldline`;
    this.controls();
    this.tabs();
    this.keys();
    await this.run.refresh();
    const asked = new URLSearchParams((location.hash || savedView()).slice(1));
    const named = async (key, fallback) => {
      const name = asked.get(key) ?? "";
      const found = this.run.quantity(name);
      if (found >= 0 || !name || !this.run.source.live) return found >= 0 ? found : fallback;
      return this.run.add(name).catch(() => fallback);
    };
    const defaults = this.run.defaults();
    this.log = [asked.get("logx") === "1", asked.get("logy") === "1"];
    await this.axes(await named("x", defaults.x), await named("y", defaults.y));
    this.recall(asked);
    this.early = this.run.listed().length === 0 && !asked.has("x");
    if (this.run.state.draft) this.drafted();
    this.ready = true;
    this.run.source.listen((notice) => this.grew(notice), (lost) => this.lost(lost));
  }

  /** Shows the place and the part of the plane that the address names. */
  recall(asked) {
    const branch = this.run.listed().find((own) => own.about.name === asked.get("branch"));
    if (branch) {
      const place = { branch: branch.id, position: Number(asked.get("position") ?? branch.low), special: Number(asked.get("special") ?? -1) };
      if (branch.indexOf(place) >= 0) this.select(place);
    }
    const view = (asked.get("view") ?? "").split(",").map(Number);
    if (view.length === 4 && view.every(Number.isFinite)) this.diagram.chart.look(view, false);
  }

  /** Puts axes, place and view into the address, so that it can be kept. */
  remember() {
    // A page in a frame has no address of its own.
    if (location.protocol === "about:") return;
    clearTimeout(this.remembering);
    this.remembering = setTimeout(() => {
      const { quantities } = this.run.about;
      const { chart, qx, qy } = this.diagram;
      const found = new URLSearchParams({ x: quantities[qx].name, y: quantities[qy].name });
      if (this.log[0]) found.set("logx", "1");
      if (this.log[1]) found.set("logy", "1");
      if (this.selected) {
        found.set("branch", this.run.branches.get(this.selected.branch)?.about.name ?? "");
        found.set("position", String(this.selected.position));
        if (this.selected.special >= 0) found.set("special", String(this.selected.special));
      }
      if (!chart.fitted) found.set("view", chart.view().map((v) => v.toPrecision(8)).join(","));
      history.replaceState(null, "", `#${found}`);
    }, 300);
  }

  // Data.

  /** Fetches what is new; notices that arrive meanwhile are one. */
  async grew(notice) {
    this.notice = notice;
    if (this.refreshing) return;
    this.refreshing = true;
    while (this.notice) {
      this.notice = null;
      const { epoch } = this.run;
      try {
        await this.run.refresh();
      } catch {
        // The next notice, or the next connection, tries again.
        break;
      }
      if (this.run.epoch !== epoch) {
        this.solutions.clear();
        this.diagram.paths.clear();
        if (this.selected && !this.run.branches.has(this.selected.branch)) this.select(null);
      }
      await this.texts();
      if (this.early && this.run.listed().some((own) => own.length > 0)) {
        this.early = false;
        this.diagram.chart.empty.textContent = "";
        const { x, y } = this.run.defaults();
        await this.axes(x, y);
      }
      this.show();
      const { redraw } = this.diagram.chart.cost;
      // A large diagram is drawn less often.
      if (redraw > 25) await new Promise((done) => setTimeout(done, 4 * redraw));
    }
    this.refreshing = false;
  }

  /** Fetches the study again if the run has another one. */
  async texts() {
    const { texts } = this.run.state;
    if (texts === undefined || texts === this.known) return;
    const first = this.known === undefined;
    this.known = texts;
    if (first) return;
    const { model, folder } = this.run.about;
    await this.run.begin();
    const { about } = this.run;
    if (about.model.text !== model.text || about.folder !== folder) {
      // Another run: other quantities, other places.
      history.replaceState(null, "", location.pathname);
      location.reload();
      return;
    }
    this.desk?.refreshed();
  }

  /** Nothing has been computed yet: the texts come first. */
  drafted() {
    this.diagram.chart.empty.textContent = "Nothing has been computed yet. Compute runs the study.";
    this.notes.open("model");
    this.desk.drafted();
    const { about } = this.run;
    if (about.examples?.length > 0) {
      const show = () => showExamples(this.run, (text) => this.tell(text));
      byId("pace").after(button("Examples", "Start from an example", show));
      if (!sessionStorage.getItem("begun")) show();
      sessionStorage.setItem("begun", "yes");
    }
  }

  lost(lost) {
    const again = this.connected === false && !lost;
    this.connected = !lost;
    this.progress();
    if (again) this.grew({});
  }

  /** Shows everything that depends on the data. */
  show() {
    if (this.presets().length > 0 && !byId("axes").querySelector(".buttons")) this.controls();
    this.diagram.chart.changed();
    this.lists();
    this.progress();
    this.slider();
  }

  lists() {
    this.branchList.show();
    this.specialTable.show();
    this.notes.show();
    this.desk?.show();
    this.pace.show();
    const branch = this.selected && this.run.branches.get(this.selected.branch);
    this.desk?.offer(branch ?? null, this.selected);
  }

  progress() {
    const { state, source: from } = this.run;
    const points = [...this.run.branches.values()].reduce((sum, branch) => sum + branch.length, 0);
    const element = byId("progress");
    const [done, of] = state.requests ?? [0, 0];
    const short = done < of || state.shortfalls.length > 0 || state.branches.some((own) => own.ends.some((end) => end && !end.complete));
    const said = !from.live ? (notebook() ? "notebook" : "saved page") : state.draft ? "not computed" : !this.connected ? "no connection: foldline view has ended" : state.running ? "running" : state.code === null || state.code === 0 ? "complete" : state.code === 3 ? "incomplete" : "stopped";
    const now = said === "complete" && short ? "incomplete" : said;
    element.className = now === "running" ? "running" : ["incomplete", "stopped"].includes(now) || !this.connected ? "short" : "";
    // Branches, curves, surveys and sweeps of the study; how long each takes is not known beforehand.
    const part = now === "running" && of > 1 ? ` · ${done} of ${of} done` : "";
    const text = `${now}${part} · ${points} points · ${state.special.length} special`;
    if (element.textContent !== text) element.textContent = text;
    // Announced only when it changes, not with every point.
    if (this.said !== undefined && this.said !== now) this.tell(`The run is ${now}: ${points} points, ${state.special.length} special points.`);
    this.said = now;
  }

  // Axes.

  async axes(qx, qy) {
    const computed = [qx, qy].filter((k) => this.run.about.quantities[k].profile && !this.run.loaded.has(k));
    if (computed.length > 0) this.tell(`Computing ${computed.map((k) => this.run.about.quantities[k].name).join(" and ")} from the orbits …`);
    try {
      await this.run.ensure([qx, qy, this.run.quantity("period")]);
    } catch (error) {
      this.tell(`The points cannot be read: ${error.message}`);
      this.controls();
      return;
    }
    this.diagram.setAxes(qx, qy, this.log[0], this.log[1]);
    if (computed.length > 0) this.tell(this.selected ? this.diagram.line(this.selected) : "");
    this.controls();
    this.show();
    this.remember();
  }

  controls() {
    const { about } = this.run;
    const groups = new Map();
    about.quantities.forEach((own, k) => {
      const name = { parameter: "parameters", min: "smallest value", max: "largest value", mean: "mean", rms: "root mean square", integral: "integral", amplitude: "amplitude of harmonic", decibel: "in decibels", phase: "phase", ratio: "ratio" }[own.class] ?? "solution";
      groups.set(name, [...(groups.get(name) ?? []), [String(k), quantityLabel(own)]]);
    });
    if (this.run.source.live) groups.set("", [["name", "by name …"]]);
    const { qx, qy } = this.diagram;
    const axis = (label, own, set) => {
      const named = () => askForQuantity(label, this.run, set, () => this.controls());
      return make("label", {}, label, choice(`${label} axis`, [...groups], String(own), (value) => (value === "name" ? named() : set(value))));
    };
    const log = (k) => button("log", `${["Horizontal", "Vertical"][k]} axis logarithmic`, () => {
      this.log[k] = !this.log[k];
      this.axes(qx, qy);
    }, this.log[k]);
    const focused = document.activeElement?.getAttribute?.("aria-label");
    byId("axes").replaceChildren(axis("x", qx, (value) => this.axes(Number(value), qy)), log(0), axis("y", qy, (value) => this.axes(qx, Number(value))), log(1), ...this.presets());
    if (focused) byId("axes").querySelector(`[aria-label="${CSS.escape(focused)}"]`)?.focus();
    if (byId("zoom").childElementCount === 0) this.buttons();
  }

  /** Ready-made pairs of axes: the default, and the planes of curves. */
  presets() {
    const planes = new Map();
    for (const branch of this.run.listed()) {
      const { free, follows } = branch.about;
      if (follows === null) continue;
      // The parameter of the branch that the curve comes from is horizontal, as in its diagram.
      const [x, y] = follows === this.run.defaults().x ? [follows, free] : [free, follows];
      planes.set(`${x},${y}`, [x, y]);
    }
    if (planes.size === 0) return [];
    const defaults = this.run.defaults();
    const name = (k) => greek(this.run.about.quantities[k].name);
    const all = [["Branches", defaults.x, defaults.y], ...[...planes.values()].map(([x, y]) => [`${name(x)}–${name(y)}`, x, y])];
    const { qx, qy } = this.diagram;
    return [make("span", { class: "buttons", role: "group", "aria-label": "Ready-made axes" }, ...all.map(([text, x, y]) => button(text, `Show ${text}`, () => {
      this.log = [false, false];
      this.axes(x, y);
    }, x === qx && y === qy)))];
  }

  buttons() {
    const { chart } = this.diagram;
    byId("zoom").replaceChildren(
      button("◂", "Previous view (u)", () => chart.back()), button("▸", "Next view (r)", () => chart.forward()),
      button("−", "Zoom out (−)", () => chart.zoom(1.4)), button("+", "Zoom in (+)", () => chart.zoom(1 / 1.4)),
      button("fit", "Show everything (0)", () => chart.fit()));
    byId("saving").replaceChildren(
      button("SVG", "Save the diagram as SVG", () => saveSvg(this.run, this.diagram)),
      button("PNG", "Save the diagram as PNG", () => savePng(this.run, this.diagram)),
      button("PDF", "Save the diagram as PDF", () => savePdf(this.run, this.diagram)),
      button("CSV", "Save the branches shown as CSV", () => saveCsv(this.run, this.diagram)),
      ...(this.run.source.live ? [button("HTML", "Save the whole page as one file that opens without foldline", () => this.savePage())] : []));
    byId("help").onclick = showKeys;
    byId("copy").onclick = () => this.copy();
    this.walk();
  }

  async savePage() {
    this.tell("Collecting the results …");
    try {
      await savePage(this.run);
      this.tell("Saved. The file opens in any browser, without foldline and without a network.");
    } catch (error) {
      this.tell(`The page cannot be saved: ${error.message}`);
    }
  }

  tabs() {
    const names = [["diagram", "Diagram"], ["branches", "Branches"], ["special", "Special"], ["orbit", "Orbit"], ["point", "Point"], ["log", "Log"]];
    const show = (tab) => {
      document.body.dataset.tab = tab;
      byId("tabs").replaceChildren(...names.map(([key, text]) => button(text, text, () => show(key), key === tab)));
      byId("tabs").querySelector('[aria-pressed="true"]')?.focus({ preventScroll: true });
    };
    byId("tabs").replaceChildren(...names.map(([key, text]) => button(text, text, () => show(key), key === "diagram")));
  }

  theme() {
    const press = byId("theme");
    const system = matchMedia("(prefers-color-scheme: dark)");
    // A notebook has colours of its own.
    const dark = notebook()?.dark;
    let chosen = dark === undefined ? null : dark ? "dark" : "light";
    const show = () => {
      document.documentElement.dataset.theme = chosen ?? (system.matches ? "dark" : "light");
      press.textContent = isDark() ? "Light" : "Dark";
      press.setAttribute("aria-label", `${press.textContent} colours`);
      for (const panel of [this.diagram, this.orbit, this.spectrum, this.multipliers]) panel?.chart.redraw();
      if (this.diagram) this.lists();
    };
    press.onclick = () => {
      chosen = isDark() ? "light" : "dark";
      show();
    };
    system.addEventListener("change", show);
    show();
  }

  // Selection.

  /** Selects a place; `look` brings it into view. */
  select(place, look = false) {
    if (place) {
      const branch = this.run.branches.get(place.branch);
      if (!branch || branch.length === 0) return;
      if (look) this.bring(branch, place);
    }
    this.selected = place;
    this.diagram.selected = place;
    this.lists();
    this.slider();
    this.diagram.chart.ask();
    this.tell(place ? this.diagram.line(place) : "");
    this.load();
    this.remember();
  }

  /** Chooses axes in which a place can be seen, and moves the view if it is outside. */
  bring(branch, place) {
    this.diagram.hidden.delete(branch.id);
    if (this.diagram.alone !== null && this.diagram.alone !== branch.id) this.diagram.alone = null;
    if (!this.diagram.belongs(branch)) {
      const { free, follows } = branch.about;
      const defaults = this.run.defaults();
      const pair = follows === null ? [free, defaults.y] : follows === defaults.x ? [follows, free] : [free, follows];
      this.axes(...pair);
      return;
    }
    const { chart } = this.diagram;
    const at = this.diagram.pixel(place);
    if (!at || !chart.ready) return;
    const { left, right, top, bottom } = chart.box;
    if (at[0] >= left && at[0] <= right && at[1] >= top && at[1] <= bottom) return;
    chart.pan((left + right) / 2 - at[0], (top + bottom) / 2 - at[1], true);
  }

  selectBranch(id) {
    const branch = this.run.branches.get(id);
    if (!branch || branch.length === 0) return;
    const start = branch.places().find((own) => own.position === 0 && own.special < 0) ?? branch.places()[0];
    this.select(this.selected?.branch === id ? this.selected : start, true);
  }

  hover(place) {
    if (place) this.tell(this.diagram.line(place), true);
    else this.tell(this.selected ? this.diagram.line(this.selected) : "", true);
  }

  hide(id, hidden) {
    if (hidden) this.diagram.hidden.add(id);
    else this.diagram.hidden.delete(id);
    this.show();
  }

  alone(id) {
    this.diagram.alone = this.diagram.alone === id ? null : id;
    this.show();
  }

  /** Shows a text in the status line; a quiet one is not read out. */
  tell(text, quiet = false) {
    const status = byId("status");
    status.setAttribute("aria-live", quiet ? "off" : "polite");
    if (status.textContent !== text) status.textContent = text;
  }

  /** Fetches and shows the solution at the selected place. */
  async load() {
    const place = this.selected;
    const branch = place && this.run.branches.get(place.branch);
    if (!place || !branch) {
      this.header = null;
      this.orbit.set(null, 0);
      this.spectrum.set(null, 0);
      this.multipliers.set(null);
      this.pointText = showPoint(byId("point-table"), this.run, null, null, null);
      return;
    }
    this.pointText = showPoint(byId("point-table"), this.run, branch, place, null);
    const key = `${place.branch}:${place.position}:${place.special}`;
    let solution = this.solutions.get(key);
    if (!solution) {
      let frame = null;
      try {
        frame = await this.run.source.solution(place.branch, place.position, place.special);
      } catch {
        frame = null;
      }
      if (frame) {
        solution = new Solution(frame, this.run.about.channels);
        if (this.solutions.size >= KEPT) this.solutions.delete(this.solutions.keys().next().value);
        this.solutions.set(key, solution);
      }
    }
    if (this.selected !== place) return;
    if (!solution) {
      this.orbit.set(null, 0, "The solution cannot be read.");
      return;
    }
    const { header } = solution;
    this.header = header;
    // A saved page has some solutions only.
    const other = place.special < 0 && header.position !== place.position;
    this.orbit.set(solution, branch.colour);
    this.spectrum.set(solution, branch.colour);
    this.multipliers.set(solution);
    byId("orbit-head").textContent = !solution.isCycle ? "Equilibrium" : other ? `Orbit at ${header.position}` : "Orbit";
    this.pointText = showPoint(byId("point-table"), this.run, branch, place, other ? null : header);
  }

  async copy() {
    if (!this.selected) return;
    const text = [this.diagram.title(this.selected), ...this.pointText].join("\n").replaceAll("−", "-");
    this.tell((await copied(text)) ? "Copied." : "The browser does not allow copying here.");
  }

  // Walking.

  walk() {
    this.range = make("input", { type: "range", min: 0, max: 0, value: 0, "aria-label": "Position along the branch", oninput: () => this.step(Number(this.range.value), true) });
    this.where = make("output", { text: "" });
    this.walkButton = button("Walk", "Walk along the branch (w)", () => this.toggleWalk(), false);
    byId("walk").replaceChildren(button("[", "Previous special point ([)", () => this.nextSpecial(-1)), this.walkButton, this.range, button("]", "Next special point (])", () => this.nextSpecial(1)), this.where);
    this.slider();
  }

  slider() {
    if (!this.range) return;
    const branch = this.selected && this.run.branches.get(this.selected.branch);
    for (const element of byId("walk").querySelectorAll("button, input")) element.disabled = !branch;
    if (!branch) {
      this.where.textContent = "Select a point, or a branch on the left.";
      return;
    }
    const places = branch.places();
    const index = branch.indexOf(this.selected);
    this.range.max = String(places.length - 1);
    this.range.value = String(index);
    this.range.setAttribute("aria-valuetext", `${this.diagram.title(this.selected)}, ${index + 1} of ${places.length}`);
    this.where.textContent = `${branch.about.name} ${index + 1}/${places.length}`;
  }

  /** Goes by a number of places along the branch, or to an index. */
  step(by, absolute = false) {
    if (!this.selected) {
      const first = this.diagram.shownBranches()[0];
      if (first) this.selectBranch(first.id);
      return false;
    }
    const branch = this.run.branches.get(this.selected.branch);
    const places = branch.places();
    const index = absolute ? by : branch.indexOf(this.selected) + by;
    const place = places[Math.max(0, Math.min(places.length - 1, index))];
    if (place !== this.selected) this.select(place, true);
    return index >= 0 && index < places.length - 1;
  }

  nextSpecial(direction) {
    if (!this.selected) return void this.step(0);
    const branch = this.run.branches.get(this.selected.branch);
    const places = branch.places();
    for (let k = branch.indexOf(this.selected) + direction; k >= 0 && k < places.length; k += direction) {
      if (places[k].special >= 0) return void this.select(places[k], true);
    }
    this.tell(`${branch.about.name} has no further special point in this direction.`);
  }

  nextBranch(direction) {
    const list = this.diagram.shownBranches();
    if (list.length === 0) return;
    const index = list.findIndex((own) => own.id === this.selected?.branch);
    const next = index < 0 ? list[0] : list[(index + direction + list.length) % list.length];
    this.selectBranch(next.id);
  }

  toggleWalk() {
    this.walking = !this.walking;
    this.walkButton.textContent = this.walking ? "Stop" : "Walk";
    this.walkButton.setAttribute("aria-pressed", String(this.walking));
    if (!this.walking) return;
    const branch = this.selected && this.run.branches.get(this.selected.branch);
    if (branch && branch.indexOf(this.selected) === branch.places().length - 1) this.step(0, true);
    const go = () => {
      if (!this.walking) return;
      if (this.step(1)) setTimeout(go, still() ? 10 * STEP : STEP);
      else this.toggleWalk();
    };
    go();
  }

  keys() {
    const { chart } = this.diagram;
    const by = (direction) => (event) => this.step(direction * (event.shiftKey ? 10 : 1));
    listenToKeys({
      "ArrowRight": by(1), "ArrowLeft": by(-1), "]": () => this.nextSpecial(1), "[": () => this.nextSpecial(-1),
      "n": () => this.nextBranch(1), "b": () => this.nextBranch(-1), "+": () => chart.zoom(1 / 1.4), "=": () => chart.zoom(1 / 1.4),
      "-": () => chart.zoom(1.4), "0": () => chart.fit(), "u": () => chart.back(), "r": () => chart.forward(),
      "i": () => this.selected && this.alone(this.selected.branch), "p": () => !this.orbit.button.disabled && this.orbit.toggle(),
      "w": () => this.toggleWalk(), "c": () => this.copy(), "?": () => showKeys(),
      "Escape": () => {
        if (this.walking) this.toggleWalk();
        else this.select(null);
      },
    });
  }
}

const app = new App();
// For tests and for the console of the browser.
window.foldline = { app, csv: () => csvText(app.run, app.diagram), svg: () => app.diagram.chart.svg("foldline"), pdf: () => app.diagram.chart.pdf() };
app.begin().catch((error) => {
  byId("status").textContent = `The run cannot be shown: ${error.message}`;
});
