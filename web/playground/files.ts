// What a file is that somebody drops or opens, by what is in it, not by its name alone.
import { tell } from "./words";

export type Kind = "recording" | "film" | "work" | "unknown";

/** The largest file that is read, in bytes, packed or not. */
export const LARGEST = 64 << 20;

/** The text of a file, unpacked if it is an archive of the kind that recordings are, and whether that is all of it:
    of an archive that was torn off, what is there is taken. */
export async function textOf(file: Blob): Promise<{ text: string; isTorn: boolean }> {
  const tooLarge = () => new Error(`${tell("tooLarge")} ${LARGEST >> 20} MiB`);
  if (file.size > LARGEST) throw tooLarge();
  const head = new Uint8Array(await file.slice(0, 2).arrayBuffer());
  if (head[0] !== 0x1f || head[1] !== 0x8b) return { text: await file.text(), isTorn: false };
  const decoder = new TextDecoder();
  const reader = file.stream().pipeThrough(new DecompressionStream("gzip")).getReader();
  let [text, size] = ["", 0];
  for (;;) {
    const piece = await reader.read().catch(() => null);
    if (!piece) return { text, isTorn: true };
    if (piece.done) return { text: text + decoder.decode(), isTorn: false };
    size += piece.value.length;
    if (size > LARGEST) {
      void reader.cancel();
      throw tooLarge();
    }
    text += decoder.decode(piece.value, { stream: true });
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
