// Computing from the page: lines that a click adds, the run that goes on with them, and undoing.

import assert from "node:assert/strict";
import { copyFileSync, existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { browse, PATIENCE, ROOT, table, view } from "./common.mjs";

const folder = mkdtempSync(join(tmpdir(), "foldline-compute-"));
after(() => rmSync(folder, { recursive: true, force: true }));

const limit = { timeout: PATIENCE };

/** The single-loop cycles of the reference rotor with contact. */
const STUDY = `# Cycles of the rotor
model = "rotor.toml"

[[seed]]
name = "SL at 5"
attractor = "2:1"
parameters = { Omega = 5, kappa = 1 }
samples = 48

[[branch]]
name = "SL" # followed on
from = "SL at 5"
free = "Omega"
range = [0.5, 12]
`;

let count = 0;
/** A page with the run of the study, complete. */
async function page(context) {
  count += 1;
  const study = join(folder, `study-${count}.toml`);
  const run = join(folder, `run-${count}`);
  copyFileSync(join(ROOT, "models/overhung-rotor.toml"), join(folder, "rotor.toml"));
  writeFileSync(study, STUDY);
  const viewer = view(study, "--out", run);
  const browser = await browse();
  context.after(async () => {
    await browser.browser.close();
    await viewer.end();
  });
  const own = await browser.open();
  await own.goto(await viewer.address);
  await complete(own);
  return { page: own, study, run, viewer, ...browser };
}

const complete = (own) => own.waitForFunction(() => window.foldline?.app.ready && !window.foldline.app.run.state.running && /^complete/.test(document.getElementById("progress").textContent));

/** Selects a special point by a click on it in the diagram. */
async function pick(own, kind, value) {
  await own.waitForFunction(() => window.foldline.app.diagram.chart.drawn !== null);
  const at = await own.evaluate(([wanted, near]) => {
    const { app } = window.foldline;
    const special = app.run.state.special.find((one) => one.kind === wanted && Math.abs(one.values[app.diagram.qx] - near) < 1e-4);
    const [x, y] = app.diagram.pixel({ branch: special.branch, position: special.position, special: special.index });
    const { left, top } = app.diagram.chart.canvas.getBoundingClientRect();
    return [left + x, top + y];
  }, [kind, value]);
  await own.mouse.click(at[0], at[1]);
  await own.waitForFunction((wanted) => document.getElementById("status").textContent.startsWith(wanted), kind.replace("-", " "));
}

const text = (own) => own.evaluate(() => window.foldline.app.desk.editor.text);
const press = async (own, label) => {
  await own.waitForFunction((name) => [...document.querySelectorAll("#log button")].some((one) => one.textContent === name && !one.disabled), label);
  await own.click(`#log button:text-is("${label}")`);
};

test("a period doubling is switched at, its fold followed in a second parameter, and both undone", limit, async (t) => {
  const { page: own, study, run, errors } = await page(t);
  await pick(own, "period-doubling", 4.86241178);
  await own.click('#actions button:text-is("Switch here")');
  await own.waitForFunction(() => window.foldline.app.desk.editor.lines !== null);
  assert.equal(await own.locator("#log .editor .added").count(), 1);
  // Nothing is computed or written yet.
  assert.equal(readFileSync(study, "utf8"), STUDY);
  assert.match(await text(own), /name = "SL" # followed on\nswitch = \{ period-doubling-2 = 1 \}\nfrom/);
  await press(own, "Compute");
  await own.waitForFunction(() => window.foldline.app.run.listed().some((branch) => branch.about.name === "SL/period-doubling-2" && branch.length > 5));
  await complete(own);
  assert.match(readFileSync(study, "utf8"), /switch = \{ period-doubling-2 = 1 \}/);
  const switched = readFileSync(study, "utf8");

  await pick(own, "fold", 10.34061714);
  await own.selectOption('#actions select', "kappa");
  await own.click('#actions button:text-is("Follow it")');
  await own.waitForFunction(() => window.foldline.app.desk.changed);
  const longer = (await text(own)).replace(/range = \[0\.5, 2\]\n$/, "range = [0.8, 1]\n");
  assert.ok(longer.startsWith(switched) && longer.endsWith('free = "kappa"\nrange = [0.8, 1]\n'), longer);
  // The lines can be changed before they are computed.
  await own.fill("#log textarea", longer);
  await press(own, "Compute");
  await own.waitForFunction(() => window.foldline.app.run.listed().some((branch) => branch.about.held === "fold" && branch.length > 3));
  await complete(own);
  assert.equal(readFileSync(study, "utf8"), longer);
  const names = table(run, "--branches").map((row) => row.branch);
  assert.deepEqual([...names].sort(), ["SL", "SL/period-doubling-2", "fold of SL in kappa"].sort());

  await press(own, "Undo");
  assert.equal(readFileSync(study, "utf8"), longer);
  await press(own, "Remove");
  await own.waitForFunction(() => window.foldline.app.run.listed().length === 2);
  assert.equal(readFileSync(study, "utf8"), switched);
  await press(own, "Undo");
  await press(own, "Remove");
  await own.waitForFunction(() => window.foldline.app.run.listed().length === 1);
  assert.equal(readFileSync(study, "utf8"), STUDY);
  assert.deepEqual(table(run, "--branches").map((row) => row.branch), ["SL"]);
  assert.deepEqual(errors, []);
});

test("a sweep starts from an unstable point, and mistakes are shown where they are", limit, async (t) => {
  const { page: own, study, run } = await page(t);
  await own.click('[data-branch] button:has-text("SL")');
  await own.click('#actions button:text-is("Sweep ↑")');
  await own.waitForFunction(() => window.foldline.app.desk.changed);
  const right = (await text(own)).replace(/count = 61\n$/, "count = 5\n");
  await own.fill("#log textarea", right.replace('free = "Omega"\nrange = [0.5', 'free = "Omgea"\nrange = [0.5'));
  const mistake = own.locator("#log .mistakes li").first();
  await mistake.waitFor();
  assert.match(await mistake.innerText(), /^13:8[\s\S]*no parameter `Omgea`/);
  assert.ok(await own.locator('#log button:text-is("Compute")').isDisabled());
  await mistake.locator("button").click();
  const line = await own.evaluate(() => {
    const { area } = window.foldline.app.desk.editor;
    return area.value.slice(0, area.selectionStart).split("\n").length;
  });
  assert.equal(line, 13);
  await own.fill("#log textarea", right);
  await press(own, "Compute");
  await own.waitForFunction(() => window.foldline.app.run.state.responses.length === 1);
  await complete(own);
  assert.equal(readFileSync(study, "utf8"), right);
  assert.equal(table(run, "--responses").length >= 5, true);
});

test("a run is stopped and resumed from the page", limit, async (t) => {
  const study = join(folder, "long.toml");
  const run = join(folder, "long");
  copyFileSync(join(ROOT, "models/overhung-rotor.toml"), join(folder, "rotor.toml"));
  writeFileSync(study, `${STUDY}[[survey]]\nname = "many"\nparameters = { kappa = 1 }\nfree = "Omega"\nvalues = [4, 4.5, 5]\nstarts = 100000\n`);
  const viewer = view(study, "--out", run);
  const { browser, open } = await browse();
  t.after(async () => {
    await browser.close();
    await viewer.end();
  });
  const own = await open();
  await own.goto(await viewer.address);
  await own.click('#pace button:text-is("Stop")');
  await own.click('#pace button:text-is("Resume")');
  await own.click('#pace button:text-is("Stop")');
  await own.waitForFunction(() => !window.foldline.app.run.state.running);
  assert.match(await own.textContent("#progress"), /^incomplete/);
  assert.ok(!existsSync(join(run, "run.stop")) && !existsSync(join(run, "run.lock")));
});

test("a model is edited and computed beside its diagram, each time in a new folder", limit, async (t) => {
  const model = join(folder, "decay.toml");
  writeFileSync(model, 'name = "decay"\n[parameters]\nmu = 1.0\n[states.x]\nequation = "mu - x"\n');
  const viewer = view(model, "--out", join(folder, "decayed"));
  const { browser, open } = await browse();
  t.after(async () => {
    await browser.close();
    await viewer.end();
  });
  const own = await open();
  await own.goto(await viewer.address);
  await own.waitForFunction(() => window.foldline?.app.ready);
  assert.match(await own.textContent("#progress"), /^not computed/);
  const first = readFileSync(model, "utf8");
  await own.fill("#log textarea", first.replace("mu - x", "mu - y"));
  await own.locator("#log .mistakes li").first().waitFor();
  assert.match(await own.locator("#log .mistakes li").first().innerText(), /^5:18[\s\S]*`y`/);
  assert.ok(!existsSync(join(folder, "decay-study.toml")));
  const cubic = first.replace("mu - x", "mu*x - x^3");
  await own.fill("#log textarea", cubic);
  await press(own, "Compute");
  await own.waitForFunction(() => window.foldline?.app.ready && window.foldline.app.run.listed().some((branch) => branch.length > 3));
  await complete(own);
  assert.equal(readFileSync(model, "utf8"), cubic);
  assert.ok(existsSync(join(folder, "decayed/run.sqlite")));
  await own.click('#log-tabs button:text-is("Model")');
  await own.fill("#log textarea", first);
  await press(own, "Compute again");
  await own.waitForFunction(() => window.foldline?.app.ready && window.foldline.app.run.about.folder.endsWith("decayed-2") && window.foldline.app.run.listed().some((branch) => branch.length > 3));
  assert.ok(existsSync(join(folder, "decayed/run.sqlite")) && existsSync(join(folder, "decayed-2/run.sqlite")));
  assert.equal(readFileSync(model, "utf8"), first);
});
