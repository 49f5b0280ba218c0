// Which value of a quirk would make the virtual controller say what the real one has said: found out by
// saying the same to one controller for each value that there is.
import type { Answer } from "../src/api";
import type { Passed } from "./exchange";

interface Desk {
  ask(method: string, path: string, body?: unknown): Answer;
  hear(now: number): object[];
}

const OWN = "/controllers/1";
/** So long after the last line an answer may still come, in ns. */
const LINGERS = 60_000_000_000;

interface Setup {
  model: string;
  machine: string;
  quirks?: Record<string, unknown>;
}

/** All that is said to these lines, each at its time, by a controller that has just been switched on. */
function said(desk: Desk, setup: Setup, passed: readonly Passed[]): string | null {
  if (desk.ask("PUT", "/controllers", [{ ...setup, clock: "manual" }]).status !== 200) return null;
  let now = 0;
  const pass = (span: number) => span > 0 && desk.ask("POST", `${OWN}/clock/advance`, { span: `${span}ns` });
  for (const one of passed) {
    if (!("in" in one)) continue;
    pass(one.at - now);
    now = Math.max(now, one.at);
    desk.ask("POST", `${OWN}/line`, { send: one.in });
  }
  pass(LINGERS);
  const messages = desk.hear(0) as { type: string; send?: string }[];
  return messages.filter(({ type }) => type === "sent").map(({ send }) => send ?? "").join("");
}

/** The quirks, each with the value that explains everything that came; none if nothing has to be explained. */
export function causes(desk: Desk, setup: Setup, passed: readonly Passed[]): string[] {
  const heard = passed.map((one) => ("out" in one ? one.out : "")).join("");
  if (said(desk, setup, passed) === heard) return [];
  const quirks = desk.ask("GET", `${OWN}/quirks`);
  if (quirks.status !== 200) return [];
  // A value is written as in TOML, which is as in JSON for these.
  const all = (quirks.body as [string, string[]][]).flatMap(([name, values]) => values.map((value): [string, unknown] => [name, JSON.parse(value)]));
  const explains = ([name, value]: [string, unknown]) => said(desk, { ...setup, quirks: { [name]: value } }, passed) === heard;
  return all.filter(explains).map(([name, value]) => `${name} = ${value}`);
}
