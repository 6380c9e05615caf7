// Keys, and the list of them.

import { byId, make } from "./dom.js";

const KEYS = [
  ["← →", "previous, next point of the branch; with Shift ten points"],
  ["[ ]", "previous, next special point of the branch"],
  ["n b", "next, previous branch"],
  ["+ −", "zoom in and out; the wheel zooms at the pointer"],
  ["drag", "move; with Shift: zoom into a box"],
  ["0", "show everything, as does a double click"],
  ["u r", "previous, next view"],
  ["i", "show this branch alone, or all again"],
  ["p", "move along the orbit"],
  ["w", "walk along the branch"],
  ["c", "copy the numbers of the point"],
  ["Escape", "stop walking; then clear the selection"],
  ["?", "this list"],
];

/** Opens the list of keys. */
export function showKeys() {
  const dialog = /** @type {HTMLDialogElement} */ (byId("keys"));
  const rows = KEYS.map(([keys, text]) => make("tr", {}, make("td", {}, ...keys.split(" ").flatMap((key) => [make("kbd", { text: key }), " "])), make("td", { text })));
  const close = make("button", { type: "button", text: "Close", onclick: () => dialog.close() });
  dialog.replaceChildren(make("h2", { id: "keys-head", text: "Keys" }), make("table", {}, make("tbody", {}, ...rows)), make("form", {}, close));
  dialog.showModal();
}

/** Listens to keys; `act` maps keys to functions. */
export function listenToKeys(act) {
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    const target = /** @type {HTMLElement} */ (event.target);
    const typing = target.matches("select, input:not([type=checkbox]), textarea") || target.closest("dialog") !== null;
    if (typing && event.key !== "Escape") return;
    const pressed = act[event.key];
    if (!pressed) return;
    event.preventDefault();
    pressed(event);
  });
}
