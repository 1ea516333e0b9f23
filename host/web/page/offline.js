// Service worker: the page works without a network once it was loaded. The build writes the version and the files.

const PREFIX = "trisect-";
const VERSION = `${PREFIX}@VERSION@`;
const FILES = JSON.parse('@FILES@');

self.addEventListener("install", (event) => {
  event.waitUntil(
    caches
      .open(VERSION)
      // Not from the browser's own cache, which may have files of another version.
      .then((cache) => cache.addAll(FILES.map((file) => new Request(file, { cache: "reload" })))),
  );
});

self.addEventListener("activate", (event) => {
  event.waitUntil(
    caches
      .keys()
      .then((names) => Promise.all(names.filter((name) => name.startsWith(PREFIX) && name !== VERSION).map((name) => caches.delete(name))))
      .then(() => self.clients.claim()),
  );
});

// Returns a file of the page with the headers that isolate it from other origins: threads need that, and not each host of
// static files can send them.
function isolated({ body, headers: own }) {
  const headers = new Headers(own);
  headers.set("Cross-Origin-Opener-Policy", "same-origin");
  headers.set("Cross-Origin-Embedder-Policy", "require-corp");
  return new Response(body, { headers });
}

self.addEventListener("fetch", (event) => {
  const found = caches.match(event.request, { ignoreSearch: true });
  event.respondWith(found.then((kept) => (kept ? isolated(kept) : fetch(event.request))));
});
