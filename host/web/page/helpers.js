// Helpers of the CPU: workers that render rows of the launches of this worker's module, each with a module of its own. Bytes
// pass through memory that all workers see, which browsers give to cross-origin isolated pages only.

// Words of a helper's state: whether it can help, and whether it has a launch.
export const WELL = 0;
export const WORKING = 1;

// Each thread takes memory, and the gain of more was not measured.
const MAX_THREADS = 16;
// Bytes of all copies of a scene and its film: one that helpers read, and those of helpers. Helpers beyond that end.
const MAX_BYTES = 2 ** 31;

let memory;
let helpers = [];
let lose = () => {};
let helped = 0;

// The launch that is being made: arrays that it only reads, arrays of rows that it writes, and the helpers that have it. With
// helpers also `next`, the counter of its rows, and `done`, 1 for each row that a helper rendered; else `taken` counts rows.
let launch;
const noLaunch = () => ({ given: [], written: [], asked: [], taken: 0 });
// Memory for rows, by array, for the next launch with as many bytes.
const lent = new Map();

const own = (first, count) => new Uint8Array(memory.buffer, first >>> 0, count >>> 0);
const isWell = ({ state }) => Atomics.load(state, WELL) === 1;
const shared = (bytes) => new Uint8Array(new SharedArrayBuffer(bytes));

// Starts a helper for each of `threads` but the first. Returns why there are fewer, or "". `onloss` receives why one ended.
export async function start(threads, module, ownMemory, onloss) {
  stop();
  [memory, lose] = [ownMemory, onloss];
  const wanted = Math.min(threads, MAX_THREADS) - 1;
  if (!(wanted >= 1)) return "";
  if (!globalThis.crossOriginIsolated) {
    return "the page is not cross-origin isolated; a second visit is, where it works offline";
  }
  const hired = await Promise.all(Array.from({ length: wanted }, () => hire(module)));
  helpers = hired.filter(isWell);
  return hired.find((helper) => !isWell(helper))?.why ?? "";
}

export function stop() {
  for (const { worker } of helpers) worker.terminate();
  helpers = [];
  launch = noLaunch();
  lent.clear();
}

// Ends a helper for good.
function dismiss(helper, why) {
  Atomics.store(helper.state, WELL, 0);
  helper.worker?.terminate();
  helper.why = why;
  if (!helpers.includes(helper)) return;
  helpers = helpers.filter((other) => other !== helper);
  lose(why);
}

// Returns a new helper once it is ready, or has failed.
function hire(module) {
  const helper = { worker: undefined, state: new Int32Array(new SharedArrayBuffer(8)), has: new Map(), why: "" };
  return new Promise((resolve) => {
    const fail = (why) => {
      dismiss(helper, why);
      resolve(helper);
    };
    let panic = "";
    try {
      helper.worker = new Worker("./helper.js", { type: "module" });
    } catch (error) {
      fail(error.message);
      return;
    }
    helper.worker.onerror = (event) => fail(event.message || "a helper could not be loaded");
    helper.worker.onmessage = ({ data }) => {
      if (typeof data === "string") panic = JSON.parse(data).panic ?? panic;
      else if (data.ready) resolve(helper);
      else fail(panic || data.failed || "a helper failed");
    };
    helper.worker.postMessage({ module, state: helper.state });
  });
}

// Returns the number of rows that helpers rendered since the last call.
export function takeHelped() {
  const rows = helped;
  helped = 0;
  return rows;
}

// The functions that the module calls, none of which throws; see host/device/src/cpu/helped.rs.

export function count() {
  return helpers.filter(isWell).length;
}

export function share(array, stamp, first, bytes) {
  launch.given.push({ array, stamp, first, bytes: bytes >>> 0 });
}

export function share_rows(array, bytes, rowBytes, rows) {
  let of = lent.get(array);
  try {
    if (of?.length !== rowBytes * rows) of = shared(rowBytes * rows);
  } catch {
    of = undefined; // No memory: `begin` asks no helper.
  }
  lent.set(array, of);
  launch.written.push({ array, bytes: bytes >>> 0, rowBytes, lent: of });
}

const rowOf = ({ lent, rowBytes }, y) => lent.subarray(y * rowBytes, (y + 1) * rowBytes);

export function lend(array, y, first) {
  const rows = launch.written.find((written) => written.array === array);
  if (rows.lent) rowOf(rows, y).set(own(first, rows.rowBytes));
}

// Ends helpers whose copies would take too much memory.
function fit() {
  const size = [...launch.given, ...launch.written].reduce((sum, { bytes }) => sum + bytes, 0);
  const able = Math.max(Math.floor(MAX_BYTES / Math.max(size, 1)) - 1, 0);
  for (const helper of helpers.filter(isWell).slice(able)) {
    dismiss(helper, `all copies of a scene of ${Math.ceil(size / 2 ** 20)} MiB would take too much memory`);
  }
}

export function begin(features, params, bytes, rows) {
  fit();
  const { given, written } = launch;
  const able = helpers.filter(isWell);
  const lacks = ({ has }) => given.filter(({ array, stamp }) => has.get(array) !== stamp);
  try {
    if (written.some((rows) => !rows.lent)) throw new RangeError("no memory for rows that threads share");
    const copies = new Map();
    for (const { array, first, bytes } of new Set(able.flatMap(lacks))) {
      copies.set(array, shared(bytes));
      copies.get(array).set(own(first, bytes));
    }
    const [next, done] = [new Int32Array(new SharedArrayBuffer(4)), shared(rows)];
    const job = { features, params: own(params, bytes).slice(), rows, written, next, done };
    Object.assign(launch, { next, done });
    for (const helper of able) {
      const missing = lacks(helper);
      Atomics.store(helper.state, WORKING, 1);
      launch.asked.push(helper);
      helper.worker.postMessage({ ...job, fresh: missing.map(({ array }) => [array, copies.get(array)]) });
      for (const { array, stamp } of missing) helper.has.set(array, stamp);
      for (const { array } of written) helper.has.delete(array);
    }
  } catch (error) {
    // No memory to share. Helpers that have the launch render it; the last of them did not get it.
    const last = launch.asked.pop();
    if (last) Atomics.store(last.state, WORKING, 0);
    for (const helper of able.filter((helper) => !launch.asked.includes(helper))) dismiss(helper, error.message);
  }
}

export function next_row() {
  return launch.next ? Atomics.add(launch.next, 0, 1) : launch.taken++;
}

export function end() {
  for (const { state } of launch.asked) {
    // A wait may end for a notification of the launch before.
    while (Atomics.load(state, WORKING) === 1) Atomics.wait(state, WORKING, 1);
  }
}

export function is_helped(y) {
  return launch.done?.[y] ?? 0;
}

export function take_back(array, y, first) {
  const rows = launch.written.find((written) => written.array === array);
  own(first, rows.rowBytes).set(rowOf(rows, y));
}

export function finish(rows) {
  helped += rows;
  for (const array of lent.keys()) {
    if (!launch.written.some((written) => written.array === array)) lent.delete(array);
  }
  launch = noLaunch();
}
