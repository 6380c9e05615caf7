// The explorer in a cell of a notebook: the page in a frame of its own, which asks the kernel for the solutions that it does not contain.

/** Milliseconds after which a kernel that does not answer counts as gone. */
const PATIENCE = 8000;

/** True if the notebook has dark colours; undefined if it does not say. */
function isDark() {
  const { jpThemeLight, vscodeThemeKind } = document.body.dataset;
  if (jpThemeLight !== undefined) return jpThemeLight === "false";
  if (vscodeThemeKind !== undefined) return vscodeThemeKind.includes("dark") || vscodeThemeKind === "vscode-high-contrast";
  return undefined;
}

function render({ model, el }) {
  const waiting = new Map();
  // Several views, perhaps in several browsers, share one kernel.
  const own = Math.random().toString(36).slice(2);
  let [count, gone] = [0, false];
  const heard = (message, buffers) => {
    waiting.get(message.id)?.(buffers?.[0] ?? null);
    waiting.delete(message.id);
  };
  const solution = async (branch, position, special) => {
    if (gone) return null;
    const id = `${own}-${(count += 1)}`;
    const answer = await new Promise((done) => {
      waiting.set(id, done);
      setTimeout(() => done(undefined), PATIENCE);
      model.send({ id, branch, position, special });
    });
    waiting.delete(id);
    gone = answer === undefined;
    // The bytes of a message may begin at any place of its memory; numbers need a multiple of eight.
    return answer ? answer.buffer.slice(answer.byteOffset, answer.byteOffset + answer.byteLength) : null;
  };
  model.on("msg:custom", heard);
  const frame = document.createElement("iframe");
  frame.title = "foldline explorer";
  frame.style.cssText = `width: 100%; height: ${model.get("height")}px; box-sizing: border-box; border: 1px solid #8886; border-radius: 8px; display: block;`;
  frame.foldline = { solution, dark: isDark() };
  frame.srcdoc = model.get("page");
  el.append(frame);
  return () => model.off("msg:custom", heard);
}

export default { render };
