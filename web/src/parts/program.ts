// The stored program: a marker at the line that is being executed, the rounds that open loops still
// make, breakpoints at lines, and steps from line to line, forward and back.
import type { Clock } from "../api";
import type { App, Part } from "../app";
import { card, h, mark, put, Rebuilt } from "../dom";
import type { Machine } from "../machine";
import { figure, say, translated } from "../words";

export function program(app: App): Part {
  const state = h("p", { class: "note", attrs: { role: "status" } });
  const list = h("ol", { class: "program-lines", tabIndex: 0, attrs: { "aria-label": say("program") } });
  const rows = new Rebuilt(list);
  const walk = (line: string) => void app.past?.walk(line);
  const back = h("button", { onclick: () => walk("back line") }, say("lineBack"));
  const on = h("button", { onclick: () => walk("step line") }, say("lineOn"));
  const goes = h("button", { attrs: { "data-once": "" }, onclick: () => void goOn() }, say("continue"));
  const goOn = async () => {
    if (app.past?.isOpen) await app.past.leave();
    // It may have been paused before anybody looked back, and stays so then.
    await app.act(async (path) => {
      const { paused } = await app.api.get<Clock>(`${path}/clock`);
      if (paused) await app.api.post(`${path}/clock/resume`);
    });
  };
  const steps = h("div", { class: "bar" }, back, on, goes);
  const element = card("program", say("program"), state, steps, list);
  let marker: number | null = null;
  let lines: { point: HTMLButtonElement; rounds: HTMLElement }[] = [];

  /** The breakpoint at a line, by its condition. */
  const at = (machine: Machine, line: number) =>
    machine.breakpoints.find(({ condition }) => condition === `line ${line + 1}`);
  const toggle = (line: number) => {
    const point = app.machine && at(app.machine, line);
    void app.act((path) => point
      ? app.api.delete(`${path}/breakpoints/${point.id}`)
      : app.api.post(`${path}/breakpoints`, { condition: `line ${line + 1}` }));
  };

  return {
    element,
    show(machine: Machine) {
      const details = machine.view?.details;
      // Controllers of other families store none.
      element.hidden = details !== undefined && !("program" in details);
      const stored = details?.program;
      list.hidden = steps.hidden = !stored;
      put(state, stored ? translated(stored.status) : say("noProgram"));
      const past = app.past;
      steps.hidden ||= past?.isFilm ?? false;
      back.disabled = on.disabled = !past?.history?.possible;
      goes.disabled = !past?.isOpen && !app.machine?.clock?.paused;
      rows.from([machine.number, stored?.lines], () => {
        marker = null;
        lines = (stored?.lines ?? []).map((_, line) => ({
          point: h("button", { class: "point", onclick: () => toggle(line), attrs: { "data-once": "", "aria-label": `${say("breakpoint")} ${figure(line + 1)}` } }),
          rounds: h("span", { class: "rounds" }),
        }));
        return (stored?.lines ?? []).map((text, i) =>
          h("li", {}, lines[i]!.point, h("code", {}, text), lines[i]!.rounds));
      });
      const live = app.machine ?? machine;
      for (const [i, { point, rounds }] of lines.entries()) {
        mark(point, "aria-pressed", String(at(live, i) !== undefined));
        const open = stored?.loops.find(({ line }) => line === i);
        put(rounds, open?.left == null ? "" : `↻ ${figure(open.left)} ${say("roundsLeft")}`);
      }
      const now = stored?.marker ?? null;
      if (now === marker) return;
      if (marker !== null) mark(list.children[marker] ?? list, "aria-current", null);
      marker = now;
      const row = now === null ? null : (list.children[now] as HTMLElement | undefined);
      if (!row) return;
      mark(row, "aria-current", "step");
      list.scrollTop = row.offsetTop - list.offsetTop - list.clientHeight / 2;
    },
  };
}
