// What a file is that somebody drops or opens, by what is in it, not by its name alone.
import { tell } from "./words";

export type Kind = "recording" | "film" | "work" | "unknown";

/** The largest file that is read, in bytes, packed or not. */
export const LARGEST = 64 << 20;

/** What an archive of the kind that recordings are begins with. */
const GZIP = [0x1f, 0x8b, 8];
/** No member of it is shorter, in bytes. */
const SHORTEST = 18;

/** The text of a file, unpacked if it is an archive of the kind that recordings are, and whether that is all of it:
    of an archive that was torn off, what is there is taken. */
export async function textOf(file: Blob): Promise<{ text: string; isTorn: boolean }> {
  if (file.size > LARGEST) throw tooLarge();
  const bytes = new Uint8Array(await file.arrayBuffer());
  if (!begins(bytes, 0)) return { text: await file.text(), isTorn: false };
  const parts: BlobPart[] = [];
  let [from, room, isTorn] = [0, LARGEST, false];
  while (from < bytes.length && !isTorn) {
    const member = await unpacked(bytes, from, room);
    parts.push(...member.parts);
    [from, room, isTorn] = [member.end, room - member.size, member.isTorn];
  }
  return { text: await new Blob(parts).text(), isTorn };
}

const tooLarge = () => new Error(`${tell("tooLarge")} ${LARGEST >> 20} MiB`);

function begins(bytes: Uint8Array, at: number): boolean {
  return GZIP.every((byte, i) => bytes[at + i] === byte);
}

/** What is in a part of an archive. */
interface Member {
  parts: Uint8Array<ArrayBuffer>[];
  size: number;
  isTorn: boolean;
  end: number;
}

/** The member of an archive that begins there. What unpacks it knows of no other that follows, and does not say where
    it has met with it: where one may begin it is tried. */
async function unpacked(bytes: Uint8Array<ArrayBuffer>, from: number, room: number): Promise<Member> {
  const all = await inflated(bytes, from, bytes.length, room);
  if (!all.isTorn) return all;
  for (let next = from + SHORTEST; (next = bytes.indexOf(GZIP[0]!, next)) >= 0; next++) {
    if (!begins(bytes, next)) continue;
    const one = await inflated(bytes, from, next, room);
    if (!one.isTorn) return one;
  }
  return all;
}

async function inflated(bytes: Uint8Array<ArrayBuffer>, from: number, end: number, room: number): Promise<Member> {
  const member: Member = { parts: [], size: 0, isTorn: false, end };
  const reader = new Blob([bytes.subarray(from, end)]).stream().pipeThrough(new DecompressionStream("gzip")).getReader();
  for (;;) {
    const piece = await reader.read().catch(() => null);
    member.isTorn = piece === null;
    if (!piece || piece.done) return member;
    member.size += piece.value.length;
    if (member.size > room) {
      void reader.cancel();
      throw tooLarge();
    }
    member.parts.push(piece.value);
  }
}

export function kindOf(name: string, text: string): Kind {
  if (/^\s*\{"recording":/.test(text)) return "recording";
  if (/<script[^>]*id="?film/.test(text)) return "film";
  // A controller reads text; what has a 0 in it is none.
  if (text.includes("\0") || text.trim() === "") return "unknown";
  if (/\.(ncp|plt|hpgl|txt|nc|lst)$/i.test(name) || /^\s*(@\d|IN;|IMF_|;)/.test(text)) return "work";
  return "unknown";
}

/** Gives a person a file to keep. */
export function keep(name: string, text: string, type = "application/x-ndjson"): void {
  const url = URL.createObjectURL(new Blob([text], { type }));
  const link = Object.assign(document.createElement("a"), { href: url, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
