// Worker that renders: it hands requests to the WebAssembly module, one after the other, and posts the answers.

import init, * as trisect from "./trisect_web.js";
import * as helpers from "./helpers.js";
import { canSuspend } from "./suspend.js";

let perform;
let module;
let memory;

async function start() {
  const url = new URL("./trisect_web_bg.wasm", import.meta.url);
  // While it arrives, if the server names its media type.
  const arriving = WebAssembly.compileStreaming(fetch(url));
  module = await arriving.catch(async () => WebAssembly.compile(await (await fetch(url)).arrayBuffer()));
  const exports = await init({ module_or_path: module });
  perform = canSuspend ? WebAssembly.promising(exports.perform) : exports.perform;
  ({ memory } = exports);
}

const started = start();

// Backends that this browser can use, with the reason why not all.
function usable(request) {
  const lacks = !canSuspend
    ? "This browser has no JavaScript Promise Integration, which a GPU needs."
    : !navigator.gpu
      ? "This browser has no WebGPU, or the page was not loaded from https or localhost."
      : "";
  if (request.do !== "open" || request.backend === "cpu" || !lacks) return [request, ""];
  if (request.backend === "wgpu") throw new Error(lacks);
  return [{ ...request, backend: "cpu" }, lacks];
}

async function facts(request) {
  trisect.set_request(JSON.stringify(request));
  await perform();
  return JSON.parse(trisect.facts());
}

// Opens a device; the CPU with helpers, whose number it asks for when it is opened.
async function opened(request) {
  helpers.stop();
  const first = await facts(request);
  if (first.error || first.backend !== "cpu") return first;
  const onloss = (why) => postMessage({ lost: why, threads: 1 + helpers.count() });
  const alone = await helpers.start(request.threads ?? navigator.hardwareConcurrency ?? 1, module, memory, onloss);
  return { ...(await facts({ ...request, backend: "cpu" })), why: first.why, alone };
}

async function answer({ id, request, files, forget }) {
  let usage;
  try {
    usage = usable(request);
  } catch (error) {
    postMessage({ id, facts: { error: error.message } });
    return;
  }
  const [possible, why] = usage;
  try {
    await started;
    if (forget) trisect.forget_files();
    for (const [path, bytes] of files ?? []) trisect.put_file(path, new Uint8Array(bytes));
    const found = possible.do === "open" ? await opened(possible) : await facts(possible);
    if (why && found.why === "") found.why = why;
    const bytes = trisect.take_bytes();
    postMessage({ id, facts: { ...found, helped: helpers.takeHelped() }, bytes }, [bytes.buffer]);
  } catch (error) {
    // Rust cannot go on: after a panic, without memory, or if the module was not loaded.
    postMessage({ id, facts: { error: error.message }, dead: true });
  }
}

let queue = Promise.resolve();
onmessage = ({ data }) => {
  // A wish to stop is heard while a GPU works. On the CPU a request ends first, and the page asks for no further part.
  if (data.stop) trisect.stop();
  else queue = queue.then(() => answer(data));
};
