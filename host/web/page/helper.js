// Worker that renders rows for the worker that renders; see helpers.js.

import init, * as trisect from "./trisect_web.js";
import { WELL, WORKING } from "./helpers.js";

let memory;
let state;
// Bytes of the arrays of rows that the module has, by their index.
const sizes = new Map();

const at = (first, bytes) => new Uint8Array(memory.buffer, first >>> 0, bytes);

function render({ features, params, rows, fresh, written, next, done }) {
  // What is replaced goes first, so that it makes place.
  for (const [array] of fresh) {
    sizes.delete(array);
    trisect.allocate_array(array, 0);
  }
  for (const [array, content] of fresh) {
    const first = trisect.allocate_array(array, content.length);
    at(first, content.length).set(content);
  }
  for (const { array, bytes } of written) {
    if (sizes.get(array) !== bytes) trisect.allocate_array(array, bytes);
    sizes.set(array, bytes);
  }
  trisect.begin_rows(features, params);
  for (;;) {
    const row = Atomics.add(next, 0, 1);
    if (row >= rows) return;
    const places = written.map(({ array, rowBytes, lent }) => {
      const place = trisect.place_of_row(array, row, rowBytes);
      at(place, rowBytes).set(lent.subarray(row * rowBytes, (row + 1) * rowBytes));
      return place;
    });
    trisect.render_row(row);
    written.forEach(({ rowBytes, lent }, index) => lent.set(at(places[index], rowBytes), row * rowBytes));
    Atomics.store(done, row, 1);
  }
}

// The rows that are not finished are rendered by the worker that asked.
function fail(error) {
  if (state) Atomics.store(state, WELL, 0);
  postMessage({ failed: error.message });
}

function rest() {
  if (!state) return;
  Atomics.store(state, WORKING, 0);
  Atomics.notify(state, WORKING);
}

async function begin(module) {
  try {
    ({ memory } = await init({ module_or_path: module }));
    Atomics.store(state, WELL, 1);
    postMessage({ ready: true });
  } catch (error) {
    fail(error);
  }
}

onmessage = ({ data }) => {
  if (data.module) {
    ({ state } = data);
    begin(data.module);
    return;
  }
  try {
    render(data);
  } catch (error) {
    fail(error);
  } finally {
    rest();
  }
};

onmessageerror = () => {
  fail(new Error("a message could not be read"));
  rest();
};
