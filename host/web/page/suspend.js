// Suspends WebAssembly until the browser has handled events: how Rust waits for a GPU. It needs JavaScript Promise
// Integration; without that no GPU is opened, see worker.js.

const EAGER_MS = 5;
let began = 0;
let last = 0;

const channel = new MessageChannel();

// Waits for one turn of the event loop: at once at the beginning of a wait, then at intervals, so that no processor spins.
function turn() {
  const now = performance.now();
  if (now - last > EAGER_MS) began = now;
  last = now;
  return new Promise((resolve) => {
    if (now - began > EAGER_MS) {
      setTimeout(resolve, 1);
      last = now + 4;
    } else {
      channel.port1.onmessage = resolve;
      channel.port2.postMessage(0);
    }
  });
}

export const canSuspend = typeof WebAssembly.Suspending === "function";

export const suspend = canSuspend
  ? new WebAssembly.Suspending(turn)
  : () => {
      throw new Error("this browser cannot suspend WebAssembly");
    };
