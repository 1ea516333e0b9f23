// Calls of the worker that renders. A worker that died is replaced when it is next opened.

export class RendererError extends Error {}

// The worker is gone, and with it the scene.
export class WorkerError extends RendererError {}

export class Renderer {
  #worker;
  #waiting = new Map();
  #next = 0;
  #panic = "";
  onprogress = () => {};
  // Receives the number of threads that are left and why one ended.
  onloss = () => {};

  #start() {
    this.#panic = "";
    this.#worker = new Worker("./worker.js", { type: "module" });
    this.#worker.onmessage = ({ data }) => this.#receive(data);
    this.#worker.onerror = (event) => this.#fail(event.message || "The worker of the page could not be loaded.");
  }

  #receive(data) {
    if (typeof data === "string") {
      const { progress, panic } = JSON.parse(data);
      if (panic) this.#panic = panic;
      else this.onprogress(...progress);
      return;
    }
    if ("lost" in data) {
      this.onloss(data.threads, data.lost);
      return;
    }
    const { resolve, reject } = this.#waiting.get(data.id) ?? {};
    this.#waiting.delete(data.id);
    if (data.dead) this.#fail(this.#panic || data.facts.error, reject);
    else if (data.facts.error) reject?.(new RendererError(data.facts.error));
    else resolve?.(data);
  }

  #fail(message, reject) {
    const error = new WorkerError(`The renderer stopped: ${message}`);
    this.#worker?.terminate();
    this.#worker = undefined;
    reject?.(error);
    for (const waiting of this.#waiting.values()) waiting.reject(error);
    this.#waiting.clear();
  }

  // Sends a request, with files as pairs of path and bytes, which are copied and replace all others if `forget`. Returns
  // facts and bytes.
  call(request, files = [], forget = false) {
    if (!this.#worker) {
      if (request.do !== "open") return Promise.reject(new WorkerError("The renderer is not open."));
      this.#start();
    }
    const id = this.#next++;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject });
      this.#worker.postMessage({ id, request, files, forget });
    });
  }

  stop() {
    this.#worker?.postMessage({ stop: true });
  }
}
