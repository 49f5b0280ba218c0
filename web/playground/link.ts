// A session as the end of an address: compressed, and in letters that every program leaves as they are.
// It never reaches a server, since browsers send no fragment.
import { KINDS, type Deed, type Told } from "./session";

/** The version of what is behind it. */
const MARK = "#1.";
/** What can be unpacked from a link, in bytes: far more than anybody types. */
const MOST = 4_000_000;

async function through(bytes: Uint8Array<ArrayBuffer>, stream: CompressionStream | DecompressionStream): Promise<Uint8Array<ArrayBuffer>> {
  const parts: Uint8Array[] = [];
  let size = 0;
  const reader = new Blob([bytes]).stream().pipeThrough(stream).getReader();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    size += value.length;
    if (size > MOST) throw new Error("too long");
    parts.push(value);
  }
  return new Uint8Array(await new Blob(parts as Uint8Array<ArrayBuffer>[]).arrayBuffer());
}

/** The fragment of a session. */
export async function written({ model, machine, deeds, at }: Told): Promise<string> {
  const text = JSON.stringify([model, machine, at, deeds]);
  const bytes = await through(new TextEncoder().encode(text), new CompressionStream("deflate-raw"));
  const letters = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
  return MARK + letters.replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
}

/** Whether it is something that a session does. */
function isDeed(one: unknown): one is Deed {
  if (!Array.isArray(one) || !Number.isFinite(one[0]) || one[0] < 0 || typeof one[2] !== "string") return false;
  return one[1] === "set" ? one.length === 4 : one.length === 3 && KINDS.includes(one[1]);
}

/** A link that is of another edition of this page. */
export class OfAnother extends Error {}

/** What is no link to a moment at all. */
export class NoLink extends Error {}

/** The session of a fragment; `null` if there is none. */
export async function read(fragment: string): Promise<Told | null> {
  if (fragment.length < 2) return null;
  if (!/^#\d+\./.test(fragment)) throw new NoLink("no link");
  if (!fragment.startsWith(MARK)) throw new OfAnother("of another version");
  const letters = fragment.slice(MARK.length).replaceAll("-", "+").replaceAll("_", "/");
  const bytes = Uint8Array.from(atob(letters), (letter) => letter.charCodeAt(0));
  const text = new TextDecoder().decode(await through(bytes, new DecompressionStream("deflate-raw")));
  const [model, machine, at, deeds] = JSON.parse(text) as unknown[];
  if (typeof model !== "string" || typeof machine !== "string" || typeof at !== "number" || !Array.isArray(deeds) || !deeds.every(isDeed)) {
    throw new Error("not a session");
  }
  return { model, machine, at, deeds };
}
