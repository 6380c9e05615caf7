// The pictures of the explorer in the book: `cargo xtask page --write` writes them into docs/images.

import { execFileSync } from "node:child_process";
import { cpSync, rmSync } from "node:fs";
import { join } from "node:path";
import { browse, drawn, folder, FOLDLINE, ROOT, view } from "./common.mjs";

const size = { width: 1120, height: 700 };
const images = join(ROOT, "docs/images");

/** A page with a run, or with the examples, and the function that ends it. */
async function shown(what) {
  const viewer = view(what);
  const browser = await browse({ viewport: size, colorScheme: "light" });
  const page = await browser.open();
  await page.goto(await viewer.address);
  return { page, end: async () => (await browser.browser.close(), viewer.end()) };
}

const photograph = async (page, name) => {
  await page.mouse.move(0, 0);
  await page.evaluate(() => document.activeElement?.blur());
  // The bitmap of the diagram is drawn anew some time after the last change.
  await page.waitForTimeout(500);
  await page.screenshot({ path: join(images, `explorer${name && `-${name}`}.png`) });
};

/** Selects the special point of a kind on a branch that lies at the largest value of the horizontal axis. */
const select = async (page, branch, kind) => {
  await page.evaluate(([name, wanted]) => {
    const { app } = window.foldline;
    const of = app.run.listed().find((own) => own.about.name === name);
    const found = of.special.filter((own) => own.kind === wanted).sort((a, b) => b.values[app.diagram.qx] - a.values[app.diagram.qx])[0];
    app.select({ branch: of.id, position: found.position, special: of.special.indexOf(found) });
  }, [branch, kind]);
  await page.waitForFunction(() => window.foldline.app.orbit.solution?.rows > 100 && window.foldline.app.selected !== null);
};

// The page shows the names of files as they were typed: the study lies in its folder, as in a clone.
for (const part of ["models", "studies"]) cpSync(join(ROOT, part), join(folder, part), { recursive: true });
process.chdir(folder);
execFileSync(FOLDLINE, ["run", "studies/exact/rotor.toml", "-q"], { stdio: "ignore" });

const { page, end } = await shown("runs/rotor");
/** Shows the branches, without the resonance of S, which is far above the others. */
const branches = async () => {
  await page.evaluate(async () => {
    const { app } = window.foldline;
    const { x, y } = app.run.defaults();
    await app.axes(x, y);
    app.diagram.chart.look([0, 12.5, -0.5, 11]);
  });
  await select(page, "SL", "fold");
};
await drawn(page);
await branches();
await photograph(page, "");

await page.selectOption('[aria-label="y axis"]', { label: "r_h1_dB [dB]" });
await page.waitForFunction(() => location.hash.includes("y=r_h1_dB"));
// The doubled cycles have no such harmonic: it is as small as the rounding of the others.
await page.evaluate(() => window.foldline.app.diagram.chart.look([2, 11, -45, 17]));
await photograph(page, "harmonics");

await branches();
await page.click('#orbit-controls button:has-text("Contact")');
await page.click('#actions button:text-is("Verify")');
await page.locator("#log-text table").waitFor();
await photograph(page, "contact");

await page.click('#log-tabs button:has-text("Ends")');
await page.click('#axes button:has-text("Ω–ζ")');
await page.click('#orbit-controls button:has-text("3-D")');
await page.evaluate(() => {
  const { app } = window.foldline;
  const branch = app.diagram.shownBranches().find((own) => own.about.name === "SL doubles");
  app.select({ branch: branch.id, position: branch.low, special: -1 });
});
await page.waitForFunction(() => window.foldline.app.orbit.solution?.header.position === window.foldline.app.selected.position);
await photograph(page, "plane");

await branches();
await page.click('#orbit-controls button:has-text("Phase")');
await page.click('#actions button:text-is("Follow it")');
await page.locator(".editor .added").first().waitFor();
await photograph(page, "compute");
await end();

const beginning = await shown(null);
await beginning.page.locator("#examples li").first().waitFor();
await photograph(beginning.page, "examples");
await beginning.end();
rmSync(folder, { recursive: true, force: true });
