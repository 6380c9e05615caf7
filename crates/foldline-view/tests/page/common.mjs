// A run, `foldline view` for it, and a browser.

import { execFileSync, spawn } from "node:child_process";
import { existsSync, mkdtempSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { chromium } from "playwright-core";

/** The command, the studies and the browser; `cargo xtask page` names them. */
export const { FOLDLINE, ROOT, BROWSER } = process.env;
export const STUDY = join(ROOT, "studies/exact/rotor.toml");
/** Hard limit, in milliseconds, on waiting for something that is bound to come. */
export const PATIENCE = 240000;

export const folder = mkdtempSync(join(tmpdir(), "foldline-page-"));

let finished;
/** Folder of a complete run of the study. */
export function finishedRun() {
  if (!finished) {
    finished = join(folder, "finished");
    execFileSync(FOLDLINE, ["run", STUDY, "--out", finished, "-q"], { stdio: "ignore" });
  }
  return finished;
}

/** A table of a run as a list of objects. */
export function table(run, what = "--special") {
  return JSON.parse(execFileSync(FOLDLINE, ["table", run, what, "--format", "json"], { encoding: "utf8", maxBuffer: 1 << 28 }));
}

/** Starts `foldline view`, of nothing if `what` is null; resolves when it has printed its address. */
export function view(what, ...options) {
  const child = spawn(FOLDLINE, ["view", ...(what === null ? [] : [what]), "--no-browser", ...options], { stdio: ["ignore", "pipe", "ignore"] });
  const ended = new Promise((done) => child.on("exit", (code, signal) => done(code ?? signal)));
  const address = new Promise((done, fail) => {
    let text = "";
    child.stdout.on("data", (data) => {
      text += data;
      const found = text.match(/http:\S+\n/);
      if (found) done(found[0].trim());
    });
    ended.then((code) => fail(new Error(`foldline view ended with ${code}`)));
  });
  address.catch(() => {});
  return { child, address, ended, end: () => (child.kill("SIGINT"), ended) };
}

/** Waits until something exists on the disk. */
export async function appears(path) {
  while (!existsSync(path)) await new Promise((done) => setTimeout(done, 5));
}

/** A browser whose pages may not report errors. */
export async function browse(options = {}) {
  const args = ["--no-sandbox", "--disable-gpu-rasterization", "--disable-accelerated-2d-canvas"];
  const browser = await chromium.launch({ executablePath: BROWSER, args });
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, ...options });
  context.setDefaultTimeout(PATIENCE);
  const errors = [];
  const requests = [];
  const open = async () => {
    const page = await context.newPage();
    page.on("pageerror", (error) => errors.push(error.message));
    page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
    page.on("request", (request) => requests.push(request.url()));
    return page;
  };
  return { browser, context, open, errors, requests };
}

/** Waits until the page shows the diagram. */
export async function drawn(page) {
  await page.waitForFunction(() => window.foldline?.app.ready && window.foldline.app.diagram.chart.drawn !== null);
}
