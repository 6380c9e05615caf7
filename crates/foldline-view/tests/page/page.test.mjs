// The page in a browser: numbers, orbits, keys, growth, and the page without a server.

import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { readFileSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, test } from "node:test";
import { pathToFileURL } from "node:url";
import { appears, browse, drawn, finishedRun, folder, FOLDLINE, PATIENCE, ROOT, STUDY, table, view } from "./common.mjs";

after(() => rmSync(folder, { recursive: true, force: true }));

/** A page with a finished run. */
async function finishedPage(context, options, run = finishedRun()) {
  const viewer = view(run);
  const browser = await browse(options);
  context.after(async () => {
    await browser.browser.close();
    await viewer.end();
  });
  const page = await browser.open();
  await page.goto(await viewer.address);
  await drawn(page);
  return { page, viewer, ...browser };
}

const limit = { timeout: PATIENCE };

/** Moves the pointer onto a special point; returns what the tooltip says. */
async function pointAt(page, kind, value) {
  const at = await page.evaluate(([wanted, near]) => {
    const { app } = window.foldline;
    const own = app.run.state.special.find((one) => one.kind === wanted && Math.abs(one.values[app.diagram.qx] - near) < 1e-6);
    const [x, y] = app.diagram.pixel({ branch: own.branch, position: own.position, special: own.index });
    const { left, top } = app.diagram.chart.canvas.getBoundingClientRect();
    return [left + x, top + y];
  }, [kind, value]);
  await page.mouse.move(at[0] + 2, at[1] - 1);
  return at;
}

test("the address loses its token and works once, and nothing is loaded from elsewhere", limit, async (t) => {
  const { page, viewer, context, errors, requests } = await finishedPage(t);
  assert.match(page.url(), /^http:\/\/127\.0\.0\.1:\d+\/(#.*)?$/);
  const origin = new URL(page.url()).origin;
  const second = await context.browser().newContext();
  const answer = await (await second.newPage()).goto(await viewer.address);
  assert.equal(answer.status(), 403);
  assert.deepEqual(requests.filter((url) => !url.startsWith(origin)), []);
  assert.deepEqual(errors, []);
});

test("pages of other origins can neither read nor frame the page", limit, async (t) => {
  const { page, context } = await finishedPage(t);
  const origin = new URL(page.url()).origin;
  const other = await context.newPage();
  await other.route("http://elsewhere.test/", (route) => route.fulfill({ contentType: "text/html", body: "<iframe></iframe>" }));
  await other.goto("http://elsewhere.test/");
  const read = await other.evaluate((base) => fetch(`${base}/api/run`, { credentials: "include" }).then(() => "read", () => "refused"), origin);
  assert.equal(read, "refused");
  const events = await other.evaluate((base) => new Promise((done) => {
    const source = new EventSource(`${base}/api/events`, { withCredentials: true });
    source.onopen = () => done("open");
    source.onerror = () => done("refused");
  }), origin);
  assert.equal(events, "refused");
});

test("a special point under the pointer has the numbers of foldline table", limit, async (t) => {
  const { page, errors } = await finishedPage(t);
  const rows = table(finishedRun()).filter((row) => row.branch === "SL" && row.kind === "fold");
  const row = rows.find((one) => one.Omega > 10);
  await pointAt(page, "fold", row.Omega);
  const tip = page.locator("#diagram-chart .tip");
  await tip.waitFor({ state: "visible" });
  const said = await tip.locator("dd").allInnerTexts();
  assert.equal(await tip.locator("b").innerText(), "fold on SL");
  const expected = [row.Omega, row.r_max, row.period].map((value) => value.toPrecision(9));
  assert.deepEqual(said.slice(0, 3), expected);
  assert.match(await page.locator("#status").innerText(), new RegExp(`Omega = ${expected[0].replace(".", "\\.")}`));
  assert.deepEqual(errors, []);
});

test("the table of special points is that of foldline table", limit, async (t) => {
  const { page } = await finishedPage(t);
  const rows = table(finishedRun());
  const shown = await page.locator("#special-list tbody tr").evaluateAll((list) => list.map((row) => [
    row.dataset.kind, row.children[2].textContent, ...[...row.querySelectorAll("[data-value]")].map((cell) => Number(cell.dataset.value))]));
  assert.deepEqual(shown, rows.map((row) => [row.kind, row.branch, row.Omega, row.r_max]));
});

test("a click shows the orbit, its harmonics and multipliers, and the orbit can be played", limit, async (t) => {
  const { page, errors } = await finishedPage(t);
  const row = table(finishedRun()).find((one) => one.branch === "SL" && one.kind === "fold" && one.Omega > 10);
  const at = await pointAt(page, "fold", row.Omega);
  await page.mouse.click(at[0], at[1]);
  await page.waitForFunction(() => window.foldline.app.orbit.solution?.rows > 100);
  const seen = await page.evaluate(() => {
    const { app } = window.foldline;
    const own = app.orbit.solution;
    const r = app.run.about.channels.findIndex((channel) => channel.name === "r");
    return { period: own.header.period, largest: Math.max(...own.values[r]), bars: app.spectrum.bars.length, spectrum: own.header.spectrum };
  });
  assert.equal(seen.period, row.period);
  assert.ok(Math.abs(seen.largest - row.r_max) < 1e-3 * row.r_max, `${seen.largest} beside ${row.r_max}`);
  assert.ok(seen.bars > 40);
  // At a fold of cycles a multiplier besides the trivial one is 1.
  assert.ok(seen.spectrum.slice(1).some(([re, im]) => Math.hypot(re - 1, im) < 1e-4));
  const frames = await page.evaluate(() => window.foldline.app.orbit.frames);
  await page.keyboard.press("p");
  await page.waitForFunction((before) => window.foldline.app.orbit.frames > before + 5 && window.foldline.app.orbit.time > 0, frames);
  await page.keyboard.press("p");
  for (const mode of ["Time", "3-D", "Phase"]) {
    const count = await page.evaluate(() => window.foldline.app.orbit.chart.cost.frames);
    await page.click(`#orbit-controls button:has-text("${mode}")`);
    await page.waitForFunction((before) => window.foldline.app.orbit.chart.cost.frames > before, count);
  }
  assert.deepEqual(errors, []);
});

test("keys walk along the branch, from special point to special point, and back in the history of views", limit, async (t) => {
  const { page, errors } = await finishedPage(t);
  await page.click('[data-branch] button:has-text("SL")');
  const where = () => page.evaluate(() => {
    const { app } = window.foldline;
    return { ...app.selected, name: app.run.branches.get(app.selected.branch).about.name, status: document.getElementById("status").textContent };
  });
  assert.equal((await where()).name, "SL");
  await page.keyboard.press("]");
  const special = await where();
  assert.ok(special.special >= 0);
  await page.keyboard.press("ArrowRight");
  assert.equal((await where()).special, -1);
  await page.keyboard.press("[");
  assert.deepEqual(await where(), special);
  const kinds = table(finishedRun()).map((row) => row.kind.replaceAll("-", " "));
  assert.ok(kinds.some((kind) => special.status.startsWith(kind)));
  const views = () => page.evaluate(() => window.foldline.app.diagram.chart.view());
  const before = await views();
  await page.keyboard.press("+");
  assert.notDeepEqual(await views(), before);
  await page.keyboard.press("u");
  assert.deepEqual(await views(), before);
  await page.keyboard.press("Escape");
  assert.equal(await page.evaluate(() => window.foldline.app.selected), null);
  assert.deepEqual(errors, []);
});

test("a view is kept in the address", limit, async (t) => {
  const { page } = await finishedPage(t);
  await page.selectOption('[aria-label="y axis"]', { label: "max u" });
  await page.waitForFunction(() => location.hash.includes("y=u_max"));
  await page.reload();
  await drawn(page);
  assert.equal(await page.evaluate(() => window.foldline.app.run.about.quantities[window.foldline.app.diagram.qy].name), "u_max");
});

test("harmonics are axes, with the values of foldline table, and are saved with the page", limit, async (t) => {
  const study = join(folder, "recorded.toml");
  const text = readFileSync(STUDY, "utf8").replace(/^model = "\.\.\/\.\.\/(.*)"$/m, (_, path) => `model = ${JSON.stringify(join(ROOT, path))}\nrecord = ["r_h1_dB"]`);
  writeFileSync(study, text);
  const run = join(folder, "recorded");
  execFileSync(FOLDLINE, ["run", study, "--out", run, "-q"], { stdio: "ignore" });
  const { page, context, errors } = await finishedPage(t, {}, run);
  await page.selectOption('[aria-label="y axis"]', { label: "r_h1_dB [dB]" });
  await page.waitForFunction(() => location.hash.includes("y=r_h1_dB"));
  const rows = table(run, "--points").filter((row) => row.branch === "SL");
  const drawn_values = (own) => own.evaluate(() => {
    const { app } = window.foldline;
    const branch = app.run.listed().find((one) => one.about.name === "SL");
    const of = (special) => branch.places().filter((place) => (place.special >= 0) === special).map((place) => branch.value(place, app.diagram.qy));
    return [of(false), of(true)];
  });
  const [points, special] = await drawn_values(page);
  // The equilibria of S have an amplitude of zero, which has no level: the others are drawn all the same.
  const view = await page.evaluate(() => window.foldline.app.diagram.chart.view());
  assert.ok(points.every((value) => value > view[2] && value < view[3]), `${view}`);
  assert.deepEqual(points, rows.map((row) => row.r_h1_dB));
  const found = table(run).filter((row) => row.branch === "SL");
  assert.deepEqual([...special].sort(), found.map((row) => row.r_h1_dB).sort());
  assert.ok(special.length > 2 && special.every(Number.isFinite));
  const [file] = await Promise.all([page.waitForEvent("download"), page.click('#saving button:has-text("HTML")')]);
  const saved = join(folder, "harmonics.html");
  await file.saveAs(saved);
  const copy = await (await context.browser().newContext({ offline: true })).newPage();
  await copy.goto(pathToFileURL(saved).href);
  await drawn(copy);
  assert.deepEqual(await drawn_values(copy), [points, special]);
  assert.deepEqual(errors, []);
});

test("the line of a phase is interrupted where it passes 180 degrees", limit, async (t) => {
  const model = '[parameters]\nOmega = 0.8\n[forcing]\nfrequency = "Omega"\n[states.x]\nequation = "v"\nrange = [-2, 2]\n[states.v]\nequation = "-x - 0.1*v + 0.1*cos(Omega*t)"\nrange = [-2, 2]\n[outputs]\nback = "-v"\n';
  const text = 'model = "phase-model.toml"\n[[seed]]\nname = "start"\nattractor = "cycle"\n[[branch]]\nname = "main"\nfrom = "start"\nfree = "Omega"\nrange = [0.5, 2]\n';
  writeFileSync(join(folder, "phase-model.toml"), model);
  writeFileSync(join(folder, "phase.toml"), text);
  const run = join(folder, "phase");
  execFileSync(FOLDLINE, ["run", join(folder, "phase.toml"), "--out", run, "-q"], { stdio: "ignore" });
  const { page } = await finishedPage(t, {}, run);
  await page.selectOption('[aria-label="y axis"]', { label: "back_h1_phase [deg]" });
  await page.waitForFunction(() => location.hash.includes("y=back_h1_phase"));
  const { values, svg, height } = await page.evaluate(() => {
    const { app, svg: picture } = window.foldline;
    const branch = app.run.listed()[0];
    const { top, bottom } = app.diagram.chart.box;
    return { values: branch.places().map((place) => branch.value(place, app.diagram.qy)), svg: picture(), height: bottom - top };
  });
  // x lags by 0 to 180 degrees, so -v does by 90 to 270.
  assert.ok(Math.max(...values) > 150 && Math.min(...values) < -150);
  const lines = [...svg.matchAll(/<path d="(M[^"]*)" fill="none" stroke="[^"]*" stroke-width="2"/g)].map((own) => own[1].split(/[ML]/).slice(1).map((pair) => Number(pair.split(" ")[1])));
  assert.ok(lines.length >= 2);
  for (const ys of lines) for (let k = 1; k < ys.length; k += 1) assert.ok(Math.abs(ys[k] - ys[k - 1]) < height / 2);
});

test("a quantity that is in no list is shown by its name, and a wrong name says why", limit, async (t) => {
  const { page } = await finishedPage(t);
  await page.selectOption('[aria-label="y axis"]', { label: "by name …" });
  await page.fill("#quantity-name", "u_h0");
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => document.querySelector("#quantity [role=alert]").textContent.startsWith("there is no quantity u_h0"));
  await page.fill("#quantity-name", "whirl_h-1/whirl_h1_dB");
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => location.hash.includes("y=whirl_h-1%2Fwhirl_h1_dB"));
  await page.reload();
  await drawn(page);
  assert.equal(await page.evaluate(() => window.foldline.app.run.about.quantities[window.foldline.app.diagram.qy].name), "whirl_h-1/whirl_h1_dB");
  // Leaving without a name leaves the axis as it was.
  await page.selectOption('[aria-label="y axis"]', { label: "by name …" });
  await page.click('#quantity button:text-is("Cancel")');
  await page.waitForFunction(() => document.querySelector('[aria-label="y axis"]').selectedOptions[0].textContent.includes("whirl_h-1/whirl_h1_dB"));
});

test("curves in two parameters have axes of their own", limit, async (t) => {
  const { page } = await finishedPage(t);
  await page.click('#axes button:has-text("Ω–ζ")');
  await page.waitForFunction(() => window.foldline.app.diagram.shownBranches().length > 0 && window.foldline.app.diagram.shownBranches().every((own) => own.about.held !== null));
  const names = await page.evaluate(() => window.foldline.app.diagram.shownBranches().map((own) => own.about.name));
  assert.ok(names.includes("SL begins") && !names.includes("SL"));
});

test("every control has a name, and the status is announced", limit, async (t) => {
  const { page } = await finishedPage(t);
  const nameless = await page.evaluate(() => [...document.querySelectorAll("button, select, input, canvas")]
    .filter((own) => !(own.getAttribute("aria-label") || own.textContent.trim())).map((own) => own.outerHTML));
  assert.deepEqual(nameless, []);
  assert.equal(await page.getAttribute("#status", "role"), "status");
});

test("saved pictures and numbers are those of the diagram", limit, async (t) => {
  const { page } = await finishedPage(t);
  const saved = async (name) => {
    const [file] = await Promise.all([page.waitForEvent("download"), page.click(`#saving button:has-text("${name}")`)]);
    assert.match(file.suggestedFilename(), new RegExp(`rotor-Omega-r_max\\.${name.toLowerCase()}$`));
    return readFileSync(await file.path());
  };
  const svg = String(await saved("SVG"));
  const picture = await page.context().newPage();
  await picture.goto(`data:image/svg+xml,${encodeURIComponent(svg)}`);
  assert.equal(await picture.evaluate(() => document.documentElement.nodeName), "svg");
  assert.equal(await picture.locator("parsererror").count(), 0);
  assert.ok((await picture.locator("path").count()) > 30);
  assert.deepEqual([...(await saved("PNG")).subarray(1, 4)], [...Buffer.from("PNG")]);
  const pdf = String(await saved("PDF"));
  assert.ok(pdf.startsWith("%PDF-1.4\n") && pdf.endsWith("%%EOF\n"));
  // Every entry of the table of objects points to its object.
  const table_at = Number(pdf.match(/startxref\n(\d+)\n/)[1]);
  assert.equal(pdf.slice(table_at, table_at + 4), "xref");
  const entries = [...pdf.slice(table_at).matchAll(/(\d{10}) 00000 n/g)].map((own) => Number(own[1]));
  entries.forEach((at, k) => assert.ok(pdf.slice(at).startsWith(`${k + 1} 0 obj\n`), `object ${k + 1}`));
  const stream = pdf.match(/\/Length (\d+) >>\nstream\n/);
  assert.equal(pdf.slice(stream.index + stream[0].length + Number(stream[1])).slice(0, 10), "\nendstream");
  // The axis is Ω, in the font Symbol; the other one is in Helvetica.
  assert.match(pdf, /\/S 12 Tf \(W\) Tj/);
  assert.match(pdf, /\/H 12 Tf \(max r\) Tj/);
  const lines = String(await saved("CSV")).trim().split("\n");
  const branches = table(finishedRun(), "--branches").filter((row) => row.held === null || row.held === undefined);
  assert.equal(lines.length - 1, branches.reduce((sum, row) => sum + row.points + row.special, 0));
});

test("the page saves itself with its view, and opens from the file", limit, async (t) => {
  const { page, context } = await finishedPage(t);
  await page.selectOption('[aria-label="y axis"]', { label: "max u" });
  await page.locator("#special-list tr.pick").nth(1).click();
  await page.waitForFunction(() => location.hash.includes("special=") && location.hash.includes("y=u_max"));
  const [file] = await Promise.all([page.waitForEvent("download"), page.click('#saving button:has-text("HTML")')]);
  assert.equal(file.suggestedFilename(), "rotor.html");
  const saved = join(folder, "itself.html");
  await file.saveAs(saved);
  const other = await context.browser().newContext({ offline: true });
  const copy = await other.newPage();
  await copy.goto(pathToFileURL(saved).href);
  await drawn(copy);
  const seen = (own) => own.evaluate(() => {
    const { app } = window.foldline;
    return [app.run.about.quantities[app.diagram.qy].name, app.selected, document.querySelectorAll("#special-list tr.pick").length];
  });
  assert.deepEqual(await seen(copy), await seen(page));
  // It cannot save itself again, and has nothing to compute with.
  assert.equal(await copy.locator('#saving button:has-text("HTML")').count(), 0);
  assert.ok(!(await copy.textContent("#title")).includes("/"));
});

test("the contact sequence of a grazing cycle has one contact more after it", limit, async (t) => {
  const { page, errors } = await finishedPage(t);
  const row = table(finishedRun()).find((one) => one.branch === "SL" && one.kind === "grazing" && /^contacts 2 → 1/.test(one.normal_form));
  const at = await pointAt(page, "grazing", row.Omega);
  await page.mouse.click(at[0], at[1]);
  await page.waitForFunction(() => window.foldline.app.orbit.solution?.switches.length === 1);
  await page.click('#orbit-controls button:has-text("Contact")');
  const touches = () => page.evaluate(() => {
    const { solution } = window.foldline.app.orbit;
    const { values } = solution.switches[0];
    let count = 0;
    for (let k = 1; k < values.length; k += 1) count += values[k - 1] > 0 !== values[k] > 0 ? 1 : 0;
    return count / 2;
  });
  const counts = [];
  for (const steps of [["ArrowLeft"], ["ArrowRight", "ArrowRight"]]) {
    for (const step of steps) await page.keyboard.press(step);
    await page.waitForFunction(() => {
      const { selected, orbit } = window.foldline.app;
      return selected.special < 0 && orbit.solution?.header.position === selected.position;
    });
    counts.push(await touches());
  }
  assert.deepEqual([...counts].sort(), [1, 2]);
  assert.deepEqual(errors, []);
});

test("a point is verified by an independent method", limit, async (t) => {
  const { page, errors } = await finishedPage(t);
  const row = table(finishedRun()).find((one) => one.branch === "SL" && one.kind === "fold" && one.Omega > 10);
  const at = await pointAt(page, "fold", row.Omega);
  await page.mouse.click(at[0], at[1]);
  await page.waitForFunction(() => document.getElementById("actions").hidden === false);
  // The study of a run that is opened by its folder can be extended too.
  await page.locator('#actions button:text-is("Continue")').waitFor();
  await page.click('#actions button:text-is("Verify")');
  await page.locator("#log-text table").waitFor();
  await page.waitForFunction(() => document.querySelector("#log-text p")?.textContent.includes("within the stated error"));
  assert.ok((await page.locator("#log-text tbody tr").count()) > 0);
  assert.deepEqual(errors, []);
});

test("narrow windows and dark colours show the same diagram", limit, async (t) => {
  const { page, errors } = await finishedPage(t, { viewport: { width: 400, height: 800 }, colorScheme: "dark" });
  assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), "dark");
  assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= 400));
  await page.click('#tabs button:has-text("Special")');
  await page.locator("#special-list tr.pick").first().click();
  await page.click('#tabs button:has-text("Orbit")');
  await page.locator("#orbit-chart canvas").waitFor({ state: "visible" });
  assert.deepEqual(errors, []);
});

test("a run is shown while it grows, and does not notice when the viewer is killed", limit, async (t) => {
  const run = join(folder, "growing");
  const child = spawn(FOLDLINE, ["run", STUDY, "--out", run, "-q", "--jobs", "1"], { stdio: "ignore" });
  const code = new Promise((done) => child.on("exit", done));
  await appears(join(run, "run.sqlite"));
  const shown = table.bind(null, run);
  // The run is halted as soon as it has points, so that it cannot end before the page has been opened.
  for (;;) {
    try {
      if (shown("--points").length > 0) break;
    } catch {
      // The tables do not exist yet.
    }
  }
  child.kill("SIGSTOP");
  const viewer = view(run);
  const { browser, open, errors } = await browse();
  t.after(() => browser.close());
  const page = await open();
  await page.goto(await viewer.address);
  await drawn(page);
  const points = () => page.evaluate(() => Number(document.getElementById("progress").textContent.match(/(\d+) points/)[1]));
  const first = await points();
  assert.match(await page.textContent("#progress"), /^running/);
  child.kill("SIGCONT");
  await page.waitForFunction((before) => Number(document.getElementById("progress").textContent.match(/(\d+) points/)[1]) > before, first);
  child.kill("SIGSTOP");
  const branches = await page.evaluate(() => document.querySelectorAll("#branch-list [data-branch]").length);
  assert.ok(branches >= 1);
  assert.deepEqual(errors, []);
  viewer.child.kill("SIGKILL");
  await viewer.ended;
  child.kill("SIGCONT");
  assert.equal(await code, 0);
  assert.deepEqual(shown("--points"), table(finishedRun(), "--points"));
});

test("foldline view of a study runs it and shows it until it is complete", limit, async (t) => {
  const run = join(folder, "viewed");
  const viewer = view(STUDY, "--out", run);
  const { browser, open, errors } = await browse();
  t.after(() => browser.close());
  const page = await open();
  await page.goto(await viewer.address);
  await page.waitForFunction(() => document.getElementById("progress").textContent.startsWith("complete"));
  const expected = table(finishedRun(), "--points").length;
  await page.waitForFunction((count) => document.getElementById("progress").textContent.includes(`${count} points`), expected);
  assert.deepEqual(table(run), table(finishedRun()));
  await viewer.end().then((code) => assert.equal(code, 0));
  await page.waitForFunction(() => document.getElementById("progress").textContent.startsWith("no connection"));
  // Connections that are refused are the only errors.
  assert.deepEqual(errors.filter((error) => !error.includes("ERR_")), []);
});

test("the exported page opens from a file without any network", limit, async (t) => {
  const file = join(folder, "rotor.html");
  execFileSync(FOLDLINE, ["export", finishedRun(), "--format", "html", "--out", file], { stdio: "ignore" });
  const { browser, context, open, errors, requests } = await browse({ offline: true });
  t.after(() => browser.close());
  await context.route(/^https?:/, (route) => route.abort());
  const page = await open();
  await page.goto(pathToFileURL(file).href);
  await drawn(page);
  assert.deepEqual(requests.filter((url) => /^(https?|wss?):/.test(url)), []);
  const row = table(finishedRun()).find((one) => one.branch === "SL" && one.kind === "fold" && one.Omega > 10);
  const at = await pointAt(page, "fold", row.Omega);
  assert.equal((await page.locator("#diagram-chart .tip dd").allInnerTexts())[0], row.Omega.toPrecision(9));
  await page.mouse.click(at[0], at[1]);
  await page.waitForFunction(() => window.foldline.app.orbit.solution?.rows > 100);
  assert.ok((await page.textContent("#progress")).startsWith(`saved page · ${table(finishedRun(), "--points").length} points`));
  assert.deepEqual(errors, []);
});
