// Elements of the page.

/**
 * Makes an element. Text is never parsed as markup.
 * @param {string} tag
 * @param {Record<string, any>} [attributes] attributes; `on...` are listeners, `text` is the text
 * @param {...(Node | string)} children
 */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key === "text") element.textContent = value;
    else if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (value === true) element.setAttribute(key, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(key, String(value));
  }
  element.append(...children);
  return element;
}

/** The element with an id. */
export function byId(id) {
  return /** @type {HTMLElement} */ (document.getElementById(id));
}

/** A selection list; `groups` is a list of [group, [value, text][]]. */
export function choice(label, groups, value, change) {
  const select = make("select", { "aria-label": label, title: label, onchange: () => change(select.value) });
  for (const [group, items] of groups) {
    const options = items.map(([key, text]) => make("option", { value: key, text }));
    if (group === "") select.append(...options);
    else select.append(make("optgroup", { label: group }, ...options));
  }
  select.value = value;
  return select;
}

/** A button; `pressed` makes it a switch. */
export function button(text, label, press, pressed) {
  const attributes = { type: "button", text, title: label, "aria-label": label, onclick: press };
  if (pressed !== undefined) attributes["aria-pressed"] = String(pressed);
  return make("button", attributes);
}

/** Copies a text to the clipboard; resolves to false if the browser refuses. */
export async function copied(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}

/** Offers a file for download. */
export function download(name, content, type) {
  const address = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  const link = make("a", { href: address, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 60000);
}

/** True if the user prefers pages that do not move. */
export function still() {
  return matchMedia("(prefers-reduced-motion: reduce)").matches;
}
