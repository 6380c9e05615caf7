// Colours of the theme, of branches, and shapes and colours of the kinds of special points (Okabe and Ito's palette).

const LIGHT = ["#0072b2", "#d55e00", "#009e73", "#b8528f", "#c68500", "#2f9bd8", "#444c55", "#8c8400"];
const DARK = ["#4aa8e0", "#f08043", "#2fc298", "#dd94bd", "#e9ae33", "#86cdf2", "#c3ccd5", "#e6da4e"];

/** Shape, index of the colour, and short name of each kind of special point. */
const KINDS = {
  "fold": ["circle", "#d55e00", "F"],
  "branch-point": ["square", "#cc79a7", "BP"],
  "hopf": ["diamond", "#c68500", "H"],
  "period-doubling": ["up", "#009e73", "PD"],
  "torus": ["star", "#2f9bd8", "T"],
  "grazing": ["cross", "#7a5cc0", "G"],
  "boundary-equilibrium": ["plus", "#7a5cc0", "BE"],
  sliding: ["cross", "#a0522d", "SL"],
  "impact-grazing": ["diamond", "#7a5cc0", "IG"],
  "mark": ["ring", "#808890", "M"],
  "peak": ["ring", "#6b7580", "P"],
  "unexplained": ["down", "#d02020", "?"],
  "cusp": ["down", "#cc79a7", "CP"],
  "bogdanov-takens": ["pentagon", "#c68500", "BT"],
  "zero-hopf": ["pentagon", "#0072b2", "ZH"],
  "generalised-hopf": ["pentagon", "#009e73", "GH"],
  "double-hopf": ["pentagon", "#cc79a7", "HH"],
};

/** Marker of a kind; kinds of codimension two without an own one are pentagons. */
export function kindOf(name) {
  const [shape, colour, short] = KINDS[name] ?? ["pentagon", "#d55e00", name];
  return { shape, colour, short };
}

/** Colour of the k-th branch. */
export function branchColour(k, dark) {
  return (dark ? DARK : LIGHT)[k % LIGHT.length];
}

/** True if the page is dark. */
export function isDark() {
  return document.documentElement.dataset.theme === "dark";
}

/** Colours of the theme, as the style sheet defines them. */
export function themeColours() {
  const style = getComputedStyle(document.documentElement);
  const get = (name) => style.getPropertyValue(name).trim();
  return {
    panel: get("--panel"), fg: get("--fg"), soft: get("--soft"), faint: get("--faint"), line: get("--line"), grid: get("--grid"),
    accent: get("--accent"), warn: get("--warn"), font: get("--sans"), dark: isDark(),
  };
}
