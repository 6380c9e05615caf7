// Numbers as text, and places of ticks.

/** Significant digits of numbers that can be read and copied. */
export const DIGITS = 9;

const GREEK = {
  alpha: "α", beta: "β", gamma: "γ", delta: "δ", epsilon: "ε", zeta: "ζ", eta: "η", theta: "θ", kappa: "κ", lambda: "λ",
  mu: "μ", nu: "ν", xi: "ξ", rho: "ρ", sigma: "σ", tau: "τ", phi: "φ", chi: "χ", psi: "ψ", omega: "ω", Omega: "Ω",
  Gamma: "Γ", Delta: "Δ", Lambda: "Λ",
};

/**
 * A number with the given count of significant digits; "·" where there is none.
 * @param {number | null | undefined} value
 */
export function shown(value, digits = DIGITS) {
  if (value === null || value === undefined || Number.isNaN(value)) return "·";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  if (value === 0) return "0";
  const size = Math.abs(value);
  const text = size >= 1e-4 && size < 10 ** digits ? value.toPrecision(digits) : value.toExponential(digits - 1);
  return text.replace("-", "−").replace("e−", "e-").replace("e+", "e");
}

/** A number for a program: all digits, with an ordinary minus sign. */
export function exact(value) {
  return value === null || value === undefined || Number.isNaN(value) ? "" : String(value);
}

/** A small number of which only the magnitude matters. */
export function magnitude(value) {
  return value === null || value === undefined || Number.isNaN(value) ? "·" : value === 0 ? "0" : value.toExponential(1).replace("e+", "e");
}

/** A name with its first part as a Greek letter, if it is one: Omega_n → Ω_n. */
export function greek(name) {
  const cut = name.indexOf("_");
  const head = cut < 0 ? name : name.slice(0, cut);
  return Object.hasOwn(GREEK, head) ? GREEK[head] + name.slice(head.length) : name;
}

/** A name with its unit in brackets. */
export function labelled(name, unit) {
  return unit && unit !== "1" && unit !== "-" ? `${name} [${unit}]` : name;
}

/**
 * Round values between two limits, about `count` of them, with their texts.
 * @returns {{at: number, text: string}[]}
 */
export function ticks(low, high, count) {
  if (!(high > low) || !Number.isFinite(high - low)) return [];
  const raw = (high - low) / Math.max(1, count);
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = power * (raw < 1.5 * power ? 1 : raw < 3.3 * power ? 2 : raw < 7.5 * power ? 5 : 10);
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const far = Math.max(Math.abs(low), Math.abs(high));
  const found = [];
  for (let k = first; k <= last && found.length < 100; k += 1) {
    const at = k * step;
    found.push({ at, text: k === 0 ? "0" : tickText(at, decimals, far, step) });
  }
  return found;
}

function tickText(value, decimals, far, step) {
  if (far < 1e5 && decimals <= 5) return value.toFixed(decimals).replace("-", "−");
  const digits = Math.max(0, Math.floor(Math.log10(Math.abs(value)) + 1e-9) - Math.floor(Math.log10(step) + 1e-9));
  return value.toExponential(Math.min(12, digits)).replace("-", "−").replace("e−", "e-").replace("e+", "e");
}

/**
 * Powers of ten between two logarithms, or round values if there are fewer than two.
 * @returns {{at: number, text: string}[]} places as logarithms
 */
export function logTicks(low, high, count) {
  if (!(high > low)) return [];
  if (high - low < 1.2) {
    return ticks(10 ** low, 10 ** high, count).filter((t) => t.at > 0).map((t) => ({ at: Math.log10(t.at), text: t.text }));
  }
  const step = Math.max(1, Math.ceil((high - low) / Math.max(1, count)));
  const found = [];
  for (let k = Math.ceil((low - 1e-9) / step) * step; k <= high + 1e-9; k += step) {
    const text = k >= -3 && k <= 4 ? String(Number((10 ** k).toPrecision(1))) : `1e${k}`;
    found.push({ at: k, text });
  }
  return found;
}
