// Where the data come from: the server, or the page itself if it was saved as one file.

/**
 * @typedef {{header: any, columns: Float64Array[] | Float32Array[]}} Frame
 * @typedef {{
 *   live: boolean,
 *   run: () => Promise<any>,
 *   state: () => Promise<any>,
 *   points: (epoch: number, since: number, columns: number[]) => Promise<Frame>,
 *   special: (columns: number[]) => Promise<Frame | null>,
 *   solution: (branch: number, position: number, special: number) => Promise<Frame | null>,
 *   page: (columns: number[]) => Promise<string>,
 *   order: (what: string, body: any) => Promise<any>,
 *   listen: (heard: (notice: any) => void, lost: (isLost: boolean) => void) => void,
 * }} Source
 */

/** Largest number of columns that the server sends at a time. */
export const COLUMNS = 16;

/**
 * Reads a frame: header length, zero, JSON, columns. `split` returns the length of each column from the header.
 * @returns {Frame}
 */
function frameOf(buffer, split) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, length)));
  const Numbers = header.single ? Float32Array : Float64Array;
  let at = 8 + length;
  const columns = split(header).map((rows) => {
    const column = new Numbers(buffer, at, rows);
    at += rows * Numbers.BYTES_PER_ELEMENT;
    return column;
  });
  return { header, columns };
}

const ofPoints = (header) => (header.restart ? [] : new Array(3 + header.columns.length).fill(header.rows));
const ofSpecial = (header) => new Array(2 + header.columns.length).fill(header.rows);
const ofSolution = (header) => {
  if (header.rows === 0) return [];
  const orbit = new Array(1 + header.channels).fill(header.rows);
  const harmonics = header.harmonics > 0 ? new Array(2 * header.channels).fill(header.harmonics) : [];
  return orbit.concat(harmonics, new Array(header.switches?.length ?? 0).fill(header.rows));
};

/** @returns {Source} */
function server() {
  const get = async (path) => {
    const answer = await fetch(path, { credentials: "same-origin" });
    if (answer.status === 404) return null;
    if (!answer.ok) throw new Error(`${path.split("?")[0]}: ${answer.status}`);
    return answer;
  };
  return {
    live: true,
    run: async () => (await get("/api/run")).json(),
    state: async () => (await get("/api/state")).json(),
    points: async (epoch, since, columns) => {
      const answer = await get(`/api/points?epoch=${epoch}&since=${since}&columns=${columns.join(",")}`);
      return frameOf(await answer.arrayBuffer(), ofPoints);
    },
    special: async (columns) => {
      const answer = await get(`/api/special?columns=${columns.join(",")}`);
      return answer && frameOf(await answer.arrayBuffer(), ofSpecial);
    },
    solution: async (branch, position, special) => {
      const place = special >= 0 ? `special=${special}` : `position=${position}`;
      const answer = await get(`/api/solution?branch=${branch}&${place}`);
      return answer && frameOf(await answer.arrayBuffer(), ofSolution);
    },
    page: async (columns) => {
      const answer = await fetch(`/api/export?columns=${columns.join(",")}`, { credentials: "same-origin" });
      if (!answer.ok) throw new Error(answer.status === 404 ? "there are no results yet" : "the run is too large to save from here; `foldline export DIR --format html` writes it");
      return answer.text();
    },
    order: async (what, body) => {
      const answer = await fetch(`/api/${what}`, { method: "POST", credentials: "same-origin", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
      const found = await answer.json().catch(() => ({ error: `${what}: ${answer.status}` }));
      if (!answer.ok) {
        const first = found.mistakes?.[0];
        throw new Error(first ? `line ${first.line}: ${first.message}` : found.error);
      }
      return found;
    },
    listen: (heard, lost) => {
      const events = new EventSource("/api/events");
      events.addEventListener("grew", (event) => heard(JSON.parse(event.data)));
      events.addEventListener("open", () => lost(false));
      events.addEventListener("error", () => lost(true));
    },
  };
}

/** @returns {Source} */
function embedded() {
  const text = (id) => document.getElementById(`data-${id}`)?.textContent ?? null;
  const bytes = (id) => {
    const base = text(id);
    if (base === null) return null;
    const found = atob(base);
    const out = new Uint8Array(found.length);
    for (let k = 0; k < found.length; k += 1) out[k] = found.charCodeAt(k);
    return out.buffer;
  };
  let part = 0;
  const frames = [];
  const all = () => {
    for (let buffer = bytes(`points-${part}`); buffer; buffer = bytes(`points-${part}`)) {
      frames.push(frameOf(buffer, ofPoints));
      part += 1;
    }
    return frames;
  };
  return {
    live: false,
    run: async () => JSON.parse(text("run") ?? "{}"),
    state: async () => JSON.parse(text("state") ?? "{}"),
    points: async (epoch, since, columns) => {
      let first = 0;
      const found = all().find((frame) => {
        if (first === since) return true;
        first = frame.header.next;
        return false;
      });
      if (!found) return { header: { epoch, columns, rows: 0, next: since, more: false }, columns: new Array(3 + columns.length).fill(new Float64Array(0)) };
      const chosen = columns.map((k) => found.columns[3 + found.header.columns.indexOf(k)]);
      return { header: { ...found.header, epoch, columns }, columns: [...found.columns.slice(0, 3), ...chosen] };
    },
    // The special points of a page have all their values.
    special: async () => null,
    solution: async (branch, position, special) => {
      const own = bytes(special >= 0 ? `special-${branch}-${special}` : `solution-${branch}-${position}`);
      if (own) return frameOf(own, ofSolution);
      const asked = await notebook()?.solution(branch, position, special);
      if (asked) return frameOf(asked, ofSolution);
      // A file has the solutions of some points only: the closest one is shown, and its position said.
      for (let away = 1; away < 10000; away += 1) {
        for (const other of [position - away, position + away]) {
          const near = bytes(`solution-${branch}-${other}`);
          if (near) return frameOf(near, ofSolution);
        }
      }
      return null;
    },
    page: async () => {
      throw new Error("this page is saved already");
    },
    order: async () => {
      throw new Error("a saved page computes nothing");
    },
    listen: () => {},
  };
}

/** The view with which a saved page opens. */
export function savedView() {
  const text = document.getElementById("data-view")?.textContent;
  return text ? JSON.parse(text) : "";
}

/**
 * The notebook that shows this page in a frame, if there is one: it can be asked for any solution.
 * @returns {{solution: (branch: number, position: number, special: number) => Promise<ArrayBuffer | null>, dark?: boolean} | null}
 */
export function notebook() {
  return window.frameElement?.foldline ?? null;
}

/** The source of this page. */
export function source() {
  return document.getElementById("data-run") ? embedded() : server();
}
