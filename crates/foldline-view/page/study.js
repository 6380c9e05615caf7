// What to compute from a point, and the study that requests it.
//
// A button at a point computes nothing: it shows the lines that it adds to the study. They can be changed, and are
// computed when that is confirmed.

import { button, byId, choice, copied, make } from "./dom.js";
import { Editor } from "./editor.js";
import { greek, magnitude } from "./numbers.js";

/** Kinds of special points at which branches leave, and those that are followed in two parameters. */
const LEAVING = ["period-doubling", "branch-point", "hopf"];
const FOLLOWED = ["fold", "branch-point", "hopf", "period-doubling", "torus", "grazing", "boundary-equilibrium"];

/** The study and the model beside the diagram, with what is to be computed. */
export class Desk {
  /** @param {import("./run.js").Run} run @param {{tell: (text: string) => void, open: (tab: string) => void}} heard */
  constructor(run, heard) {
    Object.assign(this, { run, heard, busy: false, said: "", free: null, before: [] });
    this.base = run.about.study.text;
    this.model = run.about.model.text;
    this.editor = new Editor("Text of the study", {
      check: (text) => run.source.order("check", this.modelChanged ? { study: text, model: this.modelEditor.text } : { study: text }),
      changed: () => this.show(),
    });
    this.modelEditor = new Editor("Text of the model", {
      check: (text) => run.source.order("check", { model: text }),
      changed: () => {
        if (this.modelEditor.sound) this.editor.check();
        this.show();
      },
    });
    const buttons = () => ({
      go: button("Compute", "Compute the changes", () => this.compute()),
      drop: button("Discard", "Restore the texts of the run", () => this.discard()),
      undo: button("Undo", "Show the study without its latest addition", () => this.undo()),
      python: button("Python", "Copy Python code that runs this study", () => this.python()),
      note: make("span", { class: "note", role: "status" }),
    });
    this.rows = [buttons(), buttons()];
    const panel = (row, editor) => make("div", { class: "desk" }, make("div", { class: "controls" }, ...Object.values(row)), editor.element);
    this.panels = { study: panel(this.rows[0], this.editor), model: panel(this.rows[1], this.modelEditor) };
    this.modelEditor.set(this.model, null, true);
    this.editor.set(this.base, null, true);
    this.show();
  }

  get fixed() {
    return this.run.state.fixed ?? null;
  }

  get modelChanged() {
    return this.modelEditor.text !== this.model;
  }

  get changed() {
    return this.editor.text !== this.base || this.modelChanged;
  }

  /** True if nothing that was computed can be kept. */
  get fresh() {
    return this.run.state.draft === true || this.modelChanged || this.editor.unfit !== null;
  }

  /** Checks a first study, which nothing has read yet. */
  drafted() {
    this.editor.check();
  }

  /** The run has another text by now. */
  refreshed() {
    const { text } = this.run.about.study;
    if (text === this.base) return;
    const untouched = !this.changed;
    const computed = this.editor.text === text;
    this.base = text;
    if (untouched || computed) this.editor.set(text, this.editor.lines);
    this.show();
  }

  show() {
    const shorter = this.before.at(-1) === this.editor.text;
    const draft = this.run.state.draft === true;
    const mistaken = this.editor.mistakes.length > 0 || this.modelEditor.mistakes.length > 0;
    const checked = this.editor.checked === this.editor.text && this.modelEditor.checked === this.modelEditor.text;
    const said = this.fixed !== null ? `The texts cannot be changed here: ${this.fixed}`
      : this.busy || !this.changed || mistaken || draft || !this.fresh ? this.said
      : "The results so far do not fit these texts: Compute again starts a run in a new folder and keeps the one shown.";
    for (const { go, drop, undo, note } of this.rows) {
      go.textContent = draft ? "Compute" : this.fresh && this.changed ? "Compute again" : shorter ? "Remove" : "Compute";
      go.disabled = (!this.changed && !draft) || this.busy || this.fixed !== null || mistaken || !checked;
      go.classList.toggle("first", !go.disabled);
      drop.disabled = !this.changed || this.busy;
      undo.disabled = this.before.length === 0 || this.busy || this.changed;
      if (note.textContent !== said) note.textContent = said;
    }
    this.editor.area.readOnly = this.fixed !== null;
    this.modelEditor.area.readOnly = this.fixed !== null;
  }

  say(text) {
    this.said = text;
    this.show();
  }

  /** Asks for the lines of an action at a place, and shows them. */
  async act(place, action, free) {
    let found;
    try {
      found = await this.run.source.order("act", { ...place, action, free });
    } catch (error) {
      this.heard.tell(error.message);
      return;
    }
    this.heard.open("study");
    this.editor.set(found.text, found.lines);
    const [first, last] = found.lines;
    const lines = first === last ? `line ${first}` : `lines ${first} to ${last}`;
    this.say(`New: ${lines}. Edit them if necessary, then Compute.`);
    this.heard.tell(`${found.name}: ${lines} added to the study, not yet computed.`);
  }

  async compute() {
    const [before, text, fresh] = [this.base, this.editor.text, this.fresh];
    const removing = this.before.at(-1) === text;
    this.busy = true;
    this.say(this.run.state.running ? "Waiting for the run to reach its next point …" : "Starting …");
    try {
      if (fresh) await this.run.source.order("new", { model: this.modelEditor.text, study: text });
      else await this.run.source.order("study", { before, text });
      if (removing) this.before.pop();
      else if (!fresh) this.before.push(before);
      [this.base, this.model] = [text, this.modelEditor.text];
      this.said = removing ? "Removed." : "The run continues with this study.";
      this.editor.set(text);
    } catch (error) {
      this.said = error.message;
    }
    this.busy = false;
    this.show();
  }

  discard() {
    this.modelEditor.set(this.model);
    this.editor.set(this.base);
    this.say("");
  }

  undo() {
    const last = this.before.at(-1);
    if (last === undefined) return;
    this.editor.set(last);
    this.say("This is the study without its latest addition. Remove deletes the results of that addition.");
  }

  async python() {
    const { study, folder } = this.run.about;
    const quoted = (text) => JSON.stringify(text);
    const text = `import foldline\n\ndiagram = foldline.run(${quoted(study.file)}, out=${quoted(folder)}, resume=True)\ndiagram.plot()\n`;
    this.say((await copied(text)) ? "Copied." : text);
  }

  /** Buttons for what can be computed from a place. */
  actions(branch, place) {
    const special = branch?.special[place.special];
    const { about } = this.run;
    const isCurve = branch && branch.about.held !== null;
    const parameters = about.quantities.map((own, k) => [k, own]).filter(([k, own]) => own.class === "parameter" && !own.determined && k !== branch?.about.free);
    if (!parameters.some(([, own]) => own.name === this.free)) this.free = parameters[0]?.[1].name ?? null;
    const at = branch && { branch: place.branch, position: place.position, special: place.special };
    const press = (text, label, action, free) => button(text, label, () => this.act(at, action, free ? this.free : undefined));
    const found = [];
    const verify = button("Verify", "Recompute this point by an independent method", () => this.verify(at));
    if (this.fixed !== null) return [verify];
    if (special && !isCurve && LEAVING.includes(special.kind)) found.push(press("Switch here", "Follow the branch that leaves here", "switch"));
    const inOther = parameters.length > 0 && !isCurve;
    if (inOther) {
      if (special && FOLLOWED.includes(special.kind)) found.push(press("Follow it", "Follow this special point in a second parameter", "follow", true));
      found.push(press("Continue", "Continue this solution in another parameter", "continue", true));
      found.push(make("label", {}, "in ", choice("Parameter", [["", parameters.map(([, own]) => [own.name, greek(own.name)])]], this.free, (value) => (this.free = value))));
    }
    if (!isCurve) {
      found.push(press("Simulate", "Simulate from a state of this solution", "simulate"));
      found.push(press("Sweep ↑", "Simulate at increasing values of the parameter, from here", "up"));
      found.push(press("Sweep ↓", "Simulate at decreasing values of the parameter, from here", "down"));
    }
    found.push(press("Attractors", "Sample initial states at this value of the parameter", "survey"));
    found.push(verify);
    return found;
  }

  /** Recomputes a place by an independent method, and shows the differences beside the stated errors. */
  async verify(place) {
    const { name } = this.run.branches.get(place.branch).about;
    this.heard.tell(`Verifying ${name} …`);
    try {
      const { checks, wrong, undecided, removed } = await this.run.source.order("verify", place);
      const rows = checks.filter((own) => own.found !== 0 || own.stated !== null);
      const said = removed > 0 ? "its profile was not kept (store in the study)"
        : checks.length === 0 ? `nothing could be compared: ${undecided[0] ?? "the method does not apply here"}`
        : wrong > 0 ? `${wrong} of ${checks.length} differences are larger than the stated errors` : checks.length === 1 ? "the difference is within the stated error" : `all ${checks.length} differences are within the stated errors`;
      const text = `${name}, position ${place.position}: ${said}.`;
      this.verified = { text, rows, undecided: checks.length > 0 ? undecided : [] };
      this.heard.open("verified");
      this.heard.tell(text);
    } catch (error) {
      this.heard.tell(`This point cannot be verified: ${error.message}`);
    }
  }

  /** The latest verification as a table. */
  verification() {
    const { text, rows, undecided } = this.verified;
    const head = make("tr", {}, ...["quantity", "difference found", "error stated", "ratio"].map((own, k) => make("th", { text: own, class: k > 0 ? "number" : "" })));
    const row = (own) => make("tr", { class: own.ratio > 1 ? "bad" : "" }, make("td", { text: own.quantity }), ...[own.found, own.stated, own.ratio].map((value) => make("td", { class: "number", text: magnitude(value) })));
    const table = make("table", {}, make("thead", {}, head), make("tbody", {}, ...rows.map(row)));
    return make("div", {}, make("p", { text }), ...(rows.length > 0 ? [table] : []), ...undecided.map((why) => make("p", { text: `undecided: ${why}` })));
  }

  /** Shows what can be computed from the selected place. */
  offer(branch, place) {
    const host = byId("actions");
    const key = branch ? JSON.stringify([branch.id, place.special, branch.special[place.special]?.kind, branch.about.held, this.fixed]) : "";
    if (key === this.offered) return;
    this.offered = key;
    host.hidden = !branch;
    host.replaceChildren(...(host.hidden ? [] : [make("span", { class: "lead", text: "From here:" }), ...this.actions(branch, place)]));
  }
}

/** Buttons that stop and resume the run. */
export class Pace {
  constructor(host, run, tell) {
    Object.assign(this, { host, run, tell, shown: "" });
  }

  show() {
    const { state, source: from } = this.run;
    const open = state.branches.some((own) => own.ends.some((end) => end === null)) || (state.code !== null && state.code !== 0);
    const now = !from.live || state.fixed ? "" : state.running ? "stop" : open ? "resume" : "";
    if (now === this.shown) return;
    this.shown = now;
    const order = (what) => async () => {
      try {
        await from.order(what, {});
        this.tell(what === "stop" ? "The run stops at its next point." : "The run continues.");
      } catch (error) {
        this.tell(error.message);
      }
    };
    const all = { stop: ["Stop", "Stop the run at its next point"], resume: ["Resume", "Continue the run"] }[now];
    this.host.replaceChildren(...(all ? [button(all[0], all[1], order(now))] : []));
  }
}

/** Opens the examples. */
export function showExamples(run, tell) {
  const dialog = /** @type {HTMLDialogElement} */ (byId("examples"));
  const open = async (index) => {
    dialog.close();
    try {
      await run.source.order("example", { index });
    } catch (error) {
      tell(error.message);
    }
  };
  const list = run.about.examples.map((own, index) => make("li", {}, button(own.name, `Start from ${own.name}`, () => open(index)), make("span", { text: own.about })));
  const close = make("button", { type: "button", text: "Close", onclick: () => dialog.close() });
  dialog.replaceChildren(make("h2", { id: "examples-head", text: "Start from an example" }), make("ul", { class: "examples" }, ...list), make("form", {}, close));
  dialog.showModal();
}
