// Keeps the page, so that it opens without a network. Nothing else is kept, and nothing is asked of elsewhere.

/** What there is, and which edition: put in by the build. */
declare const FILES: string[];
declare const EDITION: string;

interface Kept extends Event {
  waitUntil(what: Promise<unknown>): void;
  respondWith(what: Promise<Response>): void;
  request: Request;
}
/** Other editions may lie in other folders of the same host. */
const OWN = `vimc4 ${(self as unknown as { registration: { scope: string } }).registration.scope} `;
const KEPT = OWN + EDITION;
const listen = (type: string, heard: (event: Kept) => void) => addEventListener(type, heard as (event: Event) => void);

listen("install", (event) => event.waitUntil(caches.open(KEPT).then((kept) => kept.addAll(FILES))));

// Those of earlier editions go when no page needs them any more: only then this one begins.
listen("activate", (event) =>
  event.waitUntil(caches.keys().then((names) =>
    Promise.all(names.filter((name) => name.startsWith(OWN) && name !== KEPT).map((name) => caches.delete(name))))));

listen("fetch", (event) => {
  const url = new URL(event.request.url);
  if (event.request.method !== "GET" || url.origin !== location.origin) return;
  event.respondWith(caches.open(KEPT).then(async (kept) => (await kept.match(url.pathname.replace(/\/index\.html$/, "/"))) ?? fetch(event.request)));
});
