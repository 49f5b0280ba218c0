// What a file is that somebody drops or opens, by what is in it, not by its name alone.

export type Kind = "recording" | "film" | "work" | "unknown";

/** The largest file that is read, in bytes. */
export const LARGEST = 64 << 20;

/** The text of a file, unpacked if it is an archive of the kind that recordings are. */
export async function textOf(file: Blob): Promise<string> {
  if (file.size > LARGEST) throw new Error(`${LARGEST >> 20} MiB`);
  const head = new Uint8Array(await file.slice(0, 2).arrayBuffer());
  if (head[0] !== 0x1f || head[1] !== 0x8b) return file.text();
  return new Response(file.stream().pipeThrough(new DecompressionStream("gzip"))).text();
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
