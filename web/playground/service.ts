// Keeps the page, so that it opens without a network. Nothing else is kept, and nothing is asked of elsewhere.

import type { Asked, Told } from "./edition";

/** What there is, each with the digest of what is in it, and which edition: put in by the build. */
declare const FILES: [name: string, digest: string][];
declare const EDITION: string;

interface Kept extends Event {
  waitUntil(what: Promise<unknown>): void;
  respondWith(what: Promise<Response>): void;
  request: Request;
  data: Asked;
  source: { postMessage(told: Told): void } | null;
}
const own = self as unknown as { registration: { scope: string }; clients: { claim(): Promise<void> } };
/** Other editions may lie in other folders of the same host. */
const OWN = `vimc4 ${own.registration.scope} `;
const KEPT = OWN + EDITION;
const listen = (type: string, heard: (event: Kept) => void) => addEventListener(type, heard as (event: Event) => void);

async function digest(answer: Response): Promise<string> {
  const bytes = new Uint8Array(await crypto.subtle.digest("SHA-256", await answer.arrayBuffer()));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** A file of this edition. What comes may be of another one, from a cache on the way, or none at all: then it is asked for
    past all caches, and if that does not help either the page is not kept, and all of it is tried again another time. */
async function file([name, expected]: [string, string]): Promise<[string, Response]> {
  for (const cache of ["default", "reload"] as const) {
    const answer = await fetch(name, { cache });
    if (answer.ok && await digest(answer.clone()) === expected) return [name, answer];
  }
  throw new Error(`${name} is not that of this edition`);
}

listen("install", (event) => event.waitUntil((async () => {
  const files = await Promise.all(FILES.map(file));
  const kept = await caches.open(KEPT);
  await Promise.all(files.map(([name, answer]) => kept.put(name, answer)));
})()));

// Those of earlier editions go when no page needs them any more: only then this one begins.
listen("activate", (event) =>
  event.waitUntil(caches.keys().then((names) =>
    Promise.all(names.filter((name) => name.startsWith(OWN) && name !== KEPT).map((name) => caches.delete(name))))));

// A page that was there before this one is not its page yet, and holds no later edition back: it asks to be, if it is of
// this edition.
listen("message", (event) => {
  const { edition } = event.data;
  if (edition === EDITION) event.waitUntil(own.clients.claim());
  else event.source?.postMessage({ edition: EDITION });
});

listen("fetch", (event) => {
  const url = new URL(event.request.url);
  if (event.request.method !== "GET" || url.origin !== location.origin) return;
  event.respondWith(caches.open(KEPT).then(async (kept) => (await kept.match(url.pathname.replace(/\/index\.html$/, "/"))) ?? fetch(event.request)));
});
