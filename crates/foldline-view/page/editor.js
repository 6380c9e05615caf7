// A text that can be edited, with line numbers, highlighted lines, and mistakes at line and column.

import { make } from "./dom.js";

/** Height of a line, as in the style sheet, in pixels. */
const LINE = 18;
/** Pause in typing after which the text is checked, in milliseconds. */
const TYPED = 250;

/** An editor of one text. */
export class Editor {
  /**
   * @param {string} label
   * @param {{check: (text: string) => Promise<{mistakes: any[], unfit?: string | null}>, changed: () => void}} heard
   */
  constructor(label, heard) {
    this.heard = heard;
    this.area = make("textarea", { "aria-label": label, spellcheck: "false", wrap: "off", autocapitalize: "off", autocomplete: "off" });
    this.numbers = make("div", { class: "numbers", "aria-hidden": "true" });
    this.marks = make("div", { class: "marks", "aria-hidden": "true" });
    this.list = make("ul", { class: "mistakes", "aria-live": "polite" });
    this.element = make("div", { class: "editor" },
      make("div", { class: "paper" }, make("div", { class: "gutter" }, this.numbers), make("div", { class: "sheet" }, this.marks, this.area)), this.list);
    this.lines = null;
    this.mistakes = [];
    this.unfit = null;
    this.number = 0;
    this.area.addEventListener("input", () => this.typed());
    this.area.addEventListener("scroll", () => this.scrolled());
  }

  get text() {
    return this.area.value;
  }

  /** True if the text has been checked and has no mistakes. */
  get sound() {
    return this.checked === this.text && this.mistakes.length === 0 && !this.unfit;
  }

  /** Shows a text; `lines` are the first and last to be highlighted, from 1. The text of a run is known to be sound. */
  set(text, lines = null, sound = false) {
    if (text !== this.text) this.area.value = text;
    this.lines = lines;
    [this.mistakes, this.unfit] = [[], null];
    if (sound) {
      // An answer about an earlier text is dropped.
      this.number += 1;
      this.checked = this.text;
    }
    this.show();
    if (!sound) this.check();
    if (lines) this.reveal(lines[0]);
  }

  /** Scrolls to a line. */
  reveal(line) {
    this.area.scrollTop = Math.max(0, (line - 2) * LINE);
    this.scrolled();
  }

  /** Puts the cursor at a line and column, from 1. */
  goTo(line, column) {
    const lines = this.text.split("\n");
    const before = lines.slice(0, line - 1).reduce((sum, own) => sum + own.length + 1, 0);
    const at = before + Math.min(column - 1, (lines[line - 1] ?? "").length);
    this.area.focus();
    this.area.setSelectionRange(at, at);
    this.reveal(line);
  }

  typed() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.check(), TYPED);
    this.show();
    this.heard.changed();
  }

  /** Checks the text; an answer that arrives after a later change is dropped. */
  async check() {
    clearTimeout(this.timer);
    this.number += 1;
    const { number, text } = this;
    let found;
    try {
      found = await this.heard.check(text);
    } catch {
      return;
    }
    if (number !== this.number || text !== this.text) return;
    [this.mistakes, this.unfit, this.checked] = [found.mistakes, found.unfit ?? null, text];
    this.show();
    this.heard.changed();
  }

  show() {
    const count = this.text.split("\n").length;
    if (this.count !== count) {
      this.count = count;
      this.numbers.textContent = Array.from({ length: count }, (_, k) => k + 1).join("\n");
    }
    const mark = (kind, line, lines) => {
      const own = make("div", { class: kind });
      own.style.top = `${(line - 1) * LINE}px`;
      own.style.height = `${lines * LINE}px`;
      return own;
    };
    const added = this.lines ? [mark("added", this.lines[0], this.lines[1] - this.lines[0] + 1)] : [];
    this.marks.replaceChildren(...added, ...this.mistakes.map((own) => mark("wrong", own.line, 1)));
    const row = (own) => make("li", {}, make("button", { type: "button", text: `${own.line}:${own.column}`, "aria-label": `Go to line ${own.line}, column ${own.column}`, onclick: () => this.goTo(own.line, own.column) }),
      make("span", { text: own.hint ? `${own.message}; ${own.hint}` : own.message }));
    const unfit = this.unfit && this.mistakes.length === 0 ? [make("li", {}, make("span", { text: `the run cannot go on with this study: ${this.unfit}` }))] : [];
    this.list.replaceChildren(...this.mistakes.slice(0, 20).map(row), ...unfit);
    this.list.hidden = this.list.childElementCount === 0;
    this.scrolled();
  }

  scrolled() {
    const { scrollTop } = this.area;
    this.numbers.style.transform = `translateY(${-scrollTop}px)`;
    this.marks.style.transform = `translateY(${-scrollTop}px)`;
  }
}
