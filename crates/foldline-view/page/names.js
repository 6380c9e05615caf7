// A quantity by its name: for those that are in no list.

import { byId, make } from "./dom.js";

/** Asks for the name of a quantity for an axis; `chosen` receives its index, `left` is called if none was chosen. */
export function askForQuantity(axis, run, chosen, left) {
  const dialog = /** @type {HTMLDialogElement} */ (byId("quantity"));
  const name = make("input", { type: "text", id: "quantity-name", autocomplete: "off", spellcheck: "false", size: 40, "aria-describedby": "quantity-about" });
  const wrong = make("p", { class: "bad", role: "alert" });
  let found = -1;
  const take = async (event) => {
    event.preventDefault();
    try {
      found = await run.add(name.value.trim());
      dialog.close();
    } catch (error) {
      wrong.textContent = error.message;
    }
  };
  const about = "A parameter, or a state or output with an ending: x_max, x_rms, x_h1, x_h1_dB, x_h1_phase. Ratios and differences of phases: x_h1/y_h1_dB, x_h1_phase-y_h1_phase. Subharmonics: x_h1_2.";
  dialog.replaceChildren(
    make("h2", { id: "quantity-head", text: `Quantity on the ${axis} axis` }),
    make("form", { class: "named", onsubmit: take }, make("label", { for: "quantity-name", text: "Name" }), name, make("p", { id: "quantity-about", text: about }), wrong,
      make("div", {}, make("button", { type: "button", text: "Cancel", onclick: () => dialog.close() }), " ", make("button", { type: "submit", class: "first", text: "Show" }))));
  dialog.onclose = () => (found >= 0 ? chosen(String(found)) : left());
  dialog.showModal();
}
