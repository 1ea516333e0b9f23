// The page: options, frames while the camera moves, and the image that is rendered and saved.

import { Camera } from "./camera.js";
import { dropped, FileError, picked, read } from "./files.js";
import { Renderer, RendererError, WorkerError } from "./renderer.js";

const at = (id) => document.getElementById(id);
const renderer = new Renderer();
const canvas = at("canvas");
const camera = new Camera(canvas);
const screen = canvas.getContext("2d");

// Frames while the camera moves take about this many seconds, by fewer pixels.
const MOVING_SECONDS = 0.08;

// What the page shows: the scene that was asked for last, whether the renderer has one and no other is being loaded, whether
// an image is being rendered, numbers that grow with each scene that is asked for and that is loaded, the factor on the size of
// frames, whether frames are being rendered, and the number of threads that was asked for.
const state = { wanted: null, has: false, loaded: false, rendering: false, asked: 0, version: 0, scale: 1, drawing: false, threads: undefined };
let scenes = [];

function say(text) {
  at("status").textContent = text;
}

function complain(error) {
  at("error").textContent = error.message;
  at("error").hidden = false;
  at("remedy").hidden = !(error instanceof RendererError);
  if (error instanceof WorkerError) state.has = state.loaded = false;
  if (!(error instanceof RendererError || error instanceof FileError)) console.error(error);
}

function forgive() {
  at("error").hidden = at("remedy").hidden = true;
}

// Runs what a control began; what goes wrong is said in the page.
async function attempt(work) {
  forgive();
  try {
    return await work();
  } catch (error) {
    complain(error);
  }
}

function image() {
  const number = (id) => {
    const field = at(id);
    if (!field.checkValidity()) throw new FileError(`${field.labels[0].textContent.trim()}: ${field.validationMessage}`);
    return Number(field.value);
  };
  return {
    width: number("width"),
    height: number("height"),
    samples: number("samples"),
    depth: number("depth"),
    denoise: at("denoise").value || null,
    stops: Number(at("stops").value),
  };
}

function draw({ facts, bytes }) {
  if (!bytes?.length) return;
  const { width, height } = facts;
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  screen.putImageData(new ImageData(new Uint8ClampedArray(bytes.buffer), width, height), 0, 0);
}

function showSize() {
  canvas.style.aspectRatio = `${at("width").value} / ${at("height").value}`;
  canvas.style.width = `${at("width").value}px`;
}

// Renders live frames until the image rests.
async function frames() {
  if (state.drawing || state.rendering || !state.loaded) return;
  state.drawing = true;
  const version = state.version;
  try {
    while (state.loaded && !state.rendering && version === state.version) {
      const moving = camera.isMoving;
      const scale = moving ? state.scale : 1;
      const wanted = image();
      const answer = await renderer.call({ do: "view", image: wanted, scale, moves: camera.take() });
      if (version !== state.version || state.rendering) break;
      draw(answer);
      const { samples, seconds, rests } = answer.facts;
      if (moving && seconds) {
        state.scale = Math.min(1, Math.max(0.1, scale * Math.sqrt(MOVING_SECONDS / seconds)));
      }
      if (samples) at("live").textContent = `Live: ${samples} of ${wanted.samples} samples per pixel.`;
      if (rests && !camera.isMoving) break;
    }
  } catch (error) {
    if (version === state.version) complain(error);
  } finally {
    state.drawing = false;
  }
  // What was asked for meanwhile found this loop at work.
  if (version !== state.version) frames();
}

function showWarnings(warnings) {
  const details = at("warnings");
  details.hidden = warnings.length === 0;
  details.querySelector("summary").textContent = `${warnings.length} warning${warnings.length === 1 ? "" : "s"}`;
  details.querySelector("ul").replaceChildren(
    ...warnings.map((text) => Object.assign(document.createElement("li"), { textContent: text })),
  );
}

// Ends what runs for the scene before: frames, and an image.
function leave() {
  state.version++;
  state.loaded = false;
  if (state.rendering) renderer.stop();
  state.rendering = false;
  at("live").textContent = "";
}

function showDevice({ backend, name, details, why, alone, lost }) {
  const parts = [backend === "wgpu" ? `WebGPU: ${name || "unnamed adapter"}` : `CPU: ${details}`];
  if (why) parts.push(`not on a GPU: ${why}`);
  if (alone) parts.push(`no more threads: ${alone}`);
  if (lost) parts.push(`another ended: ${lost}`);
  at("device").textContent = parts.join(" – ");
}

// Opens a device. The CPU has `threads` threads from now on, else one for each processor.
async function open(backend, threads = state.threads) {
  leave();
  state.threads = threads;
  state.has = false;
  const { facts } = await renderer.call({ do: "open", backend, threads });
  showDevice(facts);
  renderer.onloss = (threads, lost) => showDevice({ ...facts, details: `${threads} thread${threads === 1 ? "" : "s"}`, lost });
  return facts;
}

// Loads the scene `path` of these files, pairs of path and bytes. If it is refused, the scene before stays.
async function load({ path, panorama, files }) {
  leave();
  state.wanted = { path, panorama, files };
  say(`Reading ${path}…`);
  let facts;
  try {
    ({ facts } = await renderer.call({ do: "load", path, panorama }, files, true));
  } catch (error) {
    // The one before may have been loaded only meanwhile.
    state.loaded = state.has && !(error instanceof WorkerError);
    say("");
    throw error;
  }
  for (const id of ["width", "height", "samples", "depth"]) at(id).value = facts[id];
  showSize();
  showWarnings(facts.warnings);
  at("fingerprint").textContent = "–";
  for (const id of ["save-png", "save-exr"]) at(id).disabled = true;
  state.has = state.loaded = true;
  say(`${facts.name}: ${facts.primitives} primitives.`);
  const mode = document.querySelector("input[name=mode]:checked").value;
  camera.take();
  camera.add({ orbit: mode === "orbit" });
  return facts;
}

// Runs what finds files and loads them, unless another scene was asked for meanwhile; then frames follow.
async function ask(find) {
  const asked = ++state.asked;
  try {
    const found = await find();
    if (asked === state.asked) await load(found);
  } finally {
    if (asked === state.asked) frames();
  }
}

async function fetched(path) {
  const answer = await fetch(path);
  if (!answer.ok) throw new FileError(`${path} could not be loaded: ${answer.status} ${answer.statusText}`);
  return answer.arrayBuffer();
}

// Fetches a scene of the page's own list.
async function listed({ path, files }) {
  say(`Loading ${path}…`);
  return { path, files: await Promise.all(files.map(async (file) => [file, await fetched(file)])) };
}

// Reads the files of pairs of path and file: a scene, or a panorama for the scene before.
async function given(pairs) {
  const { scene, panorama, files } = await read(pairs);
  if (scene) return { path: scene, files };
  if (!state.wanted) throw new FileError("A panorama needs a scene: load one first.");
  const { path, panorama: earlier, files: before } = state.wanted;
  const kept = before.filter(([name]) => name !== earlier && !files.some(([other]) => other === name));
  return { path, panorama, files: [...kept, ...files] };
}

// Renders the image part by part. Returns the facts of the last one.
async function render() {
  const wanted = image();
  const version = state.version;
  const isOurs = () => state.rendering && version === state.version;
  state.rendering = true;
  at("render").disabled = at("save-png").disabled = at("save-exr").disabled = true;
  at("stop").disabled = at("progress").hidden = false;
  at("progress").value = 0;
  at("fingerprint").textContent = "–";
  try {
    await renderer.call({ do: "begin", image: wanted });
    let facts = { done: false };
    while (isOurs() && !facts.done) {
      const answer = await renderer.call({ do: "part" });
      if (version !== state.version) return facts;
      draw(answer);
      facts = answer.facts;
      for (const id of ["save-png", "save-exr"]) at(id).disabled = false;
    }
    if (version !== state.version) return facts;
    if (facts.done) at("fingerprint").textContent = facts.fingerprint;
    say(facts.done ? `${facts.samples} samples per pixel in ${facts.seconds.toFixed(1)} s.` : "Stopped; what is there can be saved.");
    return facts;
  } catch (error) {
    if (version === state.version) throw error;
  } finally {
    if (version === state.version) state.rendering = false;
    at("render").disabled = false;
    at("stop").disabled = at("progress").hidden = true;
    camera.take();
    if (version !== state.version) frames();
  }
}

async function save(name) {
  const { bytes } = await renderer.call({ do: "save", name });
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([bytes]));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

// Opens a device, and loads the scene that was asked for last.
async function reopen(backend) {
  await open(backend);
  await ask(async () => state.wanted ?? listed(scenes[at("scene").selectedIndex]));
}

function listen() {
  const options = at("options");
  options.addEventListener("submit", (event) => event.preventDefault());
  for (const id of ["width", "height", "samples", "depth", "denoise", "stops"]) {
    at(id).addEventListener("input", () => {
      at("stops-shown").textContent = `${at("stops").value} stops`;
      showSize();
      attempt(frames);
    });
  }
  camera.onmove = () => frames();
  for (const radio of document.querySelectorAll("input[name=mode]")) {
    radio.addEventListener("change", () => camera.add({ orbit: radio.value === "orbit" }));
  }
  at("reset").addEventListener("click", () => camera.add("reset"));
  at("render").addEventListener("click", () => attempt(render));
  at("stop").addEventListener("click", () => {
    state.rendering = false;
    renderer.stop();
  });
  at("save-png").addEventListener("click", () => attempt(() => save("image.png")));
  at("save-exr").addEventListener("click", () => attempt(() => save("image.exr")));
  at("backend").addEventListener("change", () => attempt(() => reopen(at("backend").value)));
  at("retry").addEventListener("click", () => attempt(() => reopen(at("backend").value)));
  at("on-cpu").addEventListener("click", () => {
    at("backend").value = "cpu";
    attempt(() => reopen("cpu"));
  });
  at("files").addEventListener("change", () => {
    const pairs = picked(at("files").files);
    attempt(() => ask(() => given(pairs)).finally(() => (at("files").value = "")));
  });
  at("scene").addEventListener("change", () => attempt(() => ask(() => listed(scenes[at("scene").selectedIndex]))));
  const stage = document.body;
  for (const kind of ["dragenter", "dragover"]) {
    stage.addEventListener(kind, (event) => {
      event.preventDefault();
      at("stage").classList.add("over");
    });
  }
  stage.addEventListener("dragleave", () => at("stage").classList.remove("over"));
  stage.addEventListener("drop", (event) => {
    event.preventDefault();
    at("stage").classList.remove("over");
    const pairs = dropped(event.dataTransfer);
    attempt(() => ask(async () => given(await pairs)));
  });
  renderer.onprogress = (done, total) => {
    at("progress").value = total > 0 ? done / total : 0;
  };
}

// Keeps the page for use without a network, or says why not.
function keepOffline() {
  const kept = navigator.serviceWorker?.register("./offline.js") ?? Promise.reject(new Error("not from https or localhost"));
  kept.catch((error) => {
    at("offline").textContent = `Needs the network each time: ${error.message}`;
    at("offline").hidden = false;
  });
}

async function begin() {
  listen();
  keepOffline();
  scenes = JSON.parse(new TextDecoder().decode(await fetched("scenes.json")));
  at("scene").replaceChildren(...scenes.map(({ name }) => new Option(name)));
  const asked = new URLSearchParams(location.search);
  const backend = ["wgpu", "cpu"].includes(asked.get("backend")) ? asked.get("backend") : "auto";
  at("backend").value = backend;
  at("scene").selectedIndex = Math.max(0, scenes.findIndex(({ name }) => name === asked.get("scene")));
  await open(backend, Number(asked.get("threads")) || undefined);
  if (asked.get("scene") !== "none") await ask(() => listed(scenes[at("scene").selectedIndex]));
}

// For other programs that drive the page.
window.trisect = { renderer, ready: attempt(begin), load, open };
