// The view as a file: SVG, PNG, CSV.

import { download } from "./dom.js";
import { exact } from "./numbers.js";

const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

/** File name without ending, from study and axes. */
export function fileName(run, diagram) {
  const about = run.about.quantities;
  const study = run.about.study.file.split(/[\\/]/).pop().replace(/\.toml$/, "");
  return [study, about[diagram.qx].name, about[diagram.qy].name].join("-").replace(/[^\w.-]+/g, "_");
}

export function saveSvg(run, diagram) {
  download(`${fileName(run, diagram)}.svg`, diagram.chart.svg(run.about.model.name), "image/svg+xml");
}

export function savePdf(run, diagram) {
  download(`${fileName(run, diagram)}.pdf`, diagram.chart.pdf(), "application/pdf");
}

/** Beginning of an element with data. This script is part of a page, so the name of the element may not follow a bracket. */
const TAG = "script";
const data = (id) => `<${TAG} type="application/json" id="data-${id}">`;

/** Saves the whole page with its data, so that it opens without a server; it shows the view of now. */
export async function savePage(run) {
  const page = await run.source.page([...run.loaded].filter((k) => run.about.quantities[k].profile));
  const view = `${data("view")}${JSON.stringify(location.hash).replaceAll("<", "\\u003c")}</${TAG}>\n`;
  const study = run.about.study.file.split(/[\\/]/).pop().replace(/\.toml$/, "");
  download(`${study.replace(/[^\w.-]+/g, "_")}.html`, page.replace(data("run"), (found) => view + found), "text/html");
}

export async function savePng(run, diagram) {
  const image = await diagram.chart.png();
  if (image) download(`${fileName(run, diagram)}.png`, image, "image/png");
}

/** The branches that are shown, with the columns that are loaded, as comma-separated values with all digits. */
export function csvText(run, diagram) {
  const about = run.about.quantities;
  const columns = [...run.loaded].sort((a, b) => a - b);
  const lines = [["branch", "position", "kind", "unstable_before", "unstable_after", ...columns.map((k) => about[k].name)].map(quoted).join(",")];
  for (const branch of diagram.shownBranches()) {
    for (const place of branch.places()) {
      const special = branch.special[place.special];
      const unstable = special ? [special.before, special.after] : [branch.unstable(place), branch.unstable(place)];
      const cells = [branch.about.name, place.position, special?.kind ?? "", ...unstable, ...columns.map((k) => exact(branch.value(place, k)))];
      lines.push(cells.map((cell) => quoted(String(cell))).join(","));
    }
  }
  return `${lines.join("\n")}\n`;
}

export function saveCsv(run, diagram) {
  download(`${fileName(run, diagram)}.csv`, csvText(run, diagram), "text/csv");
}
