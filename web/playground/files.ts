// What a file is that somebody drops or opens, by what is in it, not by its name alone.
import { tell } from "./words";

export type Kind = "recording" | "film" | "work" | "unknown";

/** The largest file that is read, in bytes, packed or not. */
export const LARGEST = 64 << 20;

/** What an archive of the kind that recordings are begins with. */
const GZIP = [0x1f, 0x8b, 8];
/** No member of it is shorter, in bytes. */
const SHORTEST = 18;
/** What zstd, xz and zip begin with. */
const OTHERS = [[0x28, 0xb5, 0x2f, 0xfd], [0xfd, 0x37, 0x7a, 0x58, 0x5a, 0], [0x50, 0x4b, 3, 4]];
/** So many bytes are unpacked at a time, so that there is never much more than is allowed. */
const PIECE = 1 << 16;

/** Why a file is not read, in the language of the page. */
export class Unread extends Error {}

/** The text of a file, unpacked if it is an archive of the kind that recordings are, and whether that is all of it:
    of an archive that was torn off, what is there is taken; one that is damaged is not. */
export async function textOf(file: Blob): Promise<{ text: string; isTorn: boolean }> {
  if (file.size > LARGEST) throw tooLarge();
  const bytes = new Uint8Array(await file.arrayBuffer());
  if (OTHERS.some((sign) => begins(bytes, 0, sign))) throw new Unread(tell("otherArchive"));
  if (!begins(bytes, 0)) return { text: await file.text(), isTorn: false };
  const parts: BlobPart[] = [];
  let [from, room, isTorn] = [0, LARGEST, false];
  while (from < bytes.length && !isTorn) {
    const member = await unpacked(bytes, from, room);
    parts.push(...member.parts);
    if (member.end === "damaged") throw new Unread(tell("damaged"));
    [from, room, isTorn] = [member.next, room - member.size, member.end === "torn"];
  }
  return { text: await new Blob(parts).text(), isTorn };
}

const tooLarge = () => new Unread(`${tell("tooLarge")} ${LARGEST >> 20} MiB`);

function begins(bytes: Uint8Array, at: number, sign = GZIP): boolean {
  return sign.every((byte, i) => bytes[at + i] === byte);
}

/** What is in a part of an archive. */
interface Member {
  parts: Uint8Array<ArrayBuffer>[];
  size: number;
  end: "whole" | "torn" | "damaged";
  /** Where the next one begins. */
  next: number;
}

/** The member of an archive that begins there. What unpacks it knows of no other that follows, and does not say where
    it has met with it: where one may begin it is tried. */
async function unpacked(bytes: Uint8Array<ArrayBuffer>, from: number, room: number): Promise<Member> {
  const all = await inflated(bytes, from, bytes.length, room);
  // What follows a member that is whole is damage for it.
  if (all.end !== "damaged") return all;
  for (let next = from + SHORTEST; (next = bytes.indexOf(GZIP[0]!, next)) >= 0; next++) {
    // The next one may be torn off in its first bytes.
    if (!begins(bytes, next, GZIP.slice(0, bytes.length - next))) continue;
    const one = await inflated(bytes, from, next, room);
    if (one.end === "whole") return one;
  }
  return all;
}

async function inflated(bytes: Uint8Array<ArrayBuffer>, from: number, next: number, room: number): Promise<Member> {
  const member: Member = { parts: [], size: 0, end: "whole", next };
  const stream = new DecompressionStream("gzip");
  // What cannot be unpacked is damaged; what can be, and then ends too early, is torn off.
  const fed = feed(stream.writable.getWriter(), bytes.subarray(from, next));
  const reader = stream.readable.getReader();
  for (;;) {
    const piece = await reader.read().catch(() => null);
    if (!piece || piece.done) break;
    member.size += piece.value.length;
    if (member.size > room) {
      void reader.cancel();
      throw tooLarge();
    }
    member.parts.push(piece.value);
  }
  member.end = await fed;
  return member;
}

/** Gives all of it to what unpacks it. */
async function feed(writer: WritableStreamDefaultWriter<BufferSource>, bytes: Uint8Array<ArrayBuffer>): Promise<Member["end"]> {
  try {
    for (let at = 0; at < bytes.length; at += PIECE) await writer.write(bytes.subarray(at, at + PIECE));
  } catch {
    return "damaged";
  }
  return writer.close().then(() => "whole", () => "torn");
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
