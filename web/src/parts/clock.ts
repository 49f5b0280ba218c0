// The clock of the controller: its pace, single steps, running until something is so, breakpoints,
// and moments to which one can go back.
import type { App, Part } from "../app";
import { card, h, mark, put, Rebuilt } from "../dom";
import type { Machine } from "../machine";
import { say, seconds } from "../words";

const PACES = ["0.1x", "0.5x", "real", "2x", "8x", "100x", "instant"];

export function clock(app: App): Part {
  const now = h("output", { class: "now" });
  const state = h("span", { class: "note", attrs: { role: "status" } });
  const post = (path: string, body?: unknown) => void app.act((own) => app.api.post(`${own}/${path}`, body));
  const pace = h("select", { attrs: { "aria-label": say("pace") } });
  pace.onchange = async () => {
    const before = app.machine?.clock?.clock;
    const isDone = await app.act((path) => app.api.ask("PUT", `${path}/clock`, { clock: pace.value }));
    if (!isDone && before) pace.value = before;
  };
  const paces = new Rebuilt(pace);
  const pause = h("button", { attrs: { "data-once": "" }, onclick: () => post(`clock/${pause.dataset.deed ?? "pause"}`) });
  const step = h("button", { onclick: () => post("clock/step") }, say("step"));
  /** A line to fill in, with its button. */
  const form = (text: string, button: string, value: string, run: (text: string) => void) => {
    const field = h("input", { type: "text", value, spellcheck: false, autocomplete: "off", attrs: { "aria-label": text } });
    const submit = (event: Event) => {
      event.preventDefault();
      if (field.value.trim() !== "") run(field.value.trim());
    };
    return h("form", { class: "bar", onsubmit: submit }, h("span", {}, text), field, h("button", { type: "submit", attrs: { "data-once": "" } }, button));
  };
  let journeys = 0;
  /** A way through time that somebody waits for; it can be given up until it has arrived. */
  const travel = async (path: string, body: unknown) => {
    journeys += 1;
    app.changed();
    await app.act((own) => app.api.post(`${own}/${path}`, body));
    journeys -= 1;
    app.changed();
  };
  const advance = form(say("advance"), say("go"), "250ms", (span) => void travel("clock/advance", { span }));
  const until = form(say("runUntil"), say("go"), "idle", (condition) => void travel("clock/run-until", { condition }));
  const cancel = h("button", { onclick: () => post("clock/cancel") }, say("cancel"));
  const points = h("ul", { class: "list", attrs: { "aria-label": say("breakpoints") } });
  const moments = h("ul", { class: "list", attrs: { "aria-label": say("moments") } });
  const [pointRows, momentRows] = [new Rebuilt(points), new Rebuilt(moments)];
  const gone = (path: string, name: string) =>
    h("button", { onclick: () => void app.act((own) => app.api.delete(`${own}/${path}`)), attrs: { "data-once": "", "aria-label": `${say("remove")}: ${name}` } }, "×");
  let taken = 0;
  const take = () => post("snapshots", { name: `${say("moment")} ${++taken}` });

  const element = card("clock", say("clock"),
      h("div", { class: "bar" }, now, state),
      h("div", { class: "bar" }, h("label", {}, `${say("pace")} `, pace), pause, step, cancel),
      advance, until,
      h("h3", {}, say("breakpoints")), points,
      form(say("condition"), say("add"), "x > 1000", (condition) => post("breakpoints", { condition })),
      h("h3", {}, say("moments")), moments, h("button", { onclick: take, attrs: { "data-once": "" } }, say("takeMoment")));
  const tell = () => {
    const [shown, machine] = [app.shown, app.machine];
    if (shown) put(now, seconds(machine && shown !== machine ? shown.view?.at ?? 0 : shown.now));
  };
  // Time passes while nothing happens.
  const ticks = setInterval(tell, 100);
  return {
    element,
    leave: () => clearInterval(ticks),
    show(shown: Machine) {
      // In the past the time line leads.
      element.inert = app.past?.isOpen ?? false;
      const machine = app.machine ?? shown;
      const { clock, breakpoints, snapshots } = machine;
      tell();
      cancel.hidden = journeys === 0;
      if (!clock) return;
      const { paused } = clock;
      const isManual = clock.clock === "manual";
      put(state, say(paused ? "paused" : isManual ? "stands" : "running"));
      put(pause, say(paused ? "resume" : "pause"));
      pause.dataset.deed = paused ? "resume" : "pause";
      step.disabled = !paused;
      const can = isManual ? [] : clock.changes_to;
      paces.from([clock.clock, can], () => {
        const offered = PACES.filter((name) => can.includes(name === "instant" ? name : "speed"));
        const all = [...new Set([...offered, clock.clock])];
        return all.map((name) => h("option", { value: name, selected: name === clock.clock },
          name === "real" || name === "manual" || name === "instant" ? say(name) : name.replace("x", "×")));
      });
      pace.disabled = can.length === 0;
      // Where time passes by itself nobody can move it on.
      advance.hidden = !isManual && clock.clock !== "instant";
      pointRows.from(breakpoints, () => breakpoints.map(({ id, condition }) => {
        const isHit = paused?.breakpoints.includes(id) ?? false;
        return h("li", { class: isHit ? "hit" : "" }, h("code", {}, condition), gone(`breakpoints/${id}`, condition));
      }));
      for (const [i, { id }] of breakpoints.entries()) {
        mark(points.children[i]!, "class", paused?.breakpoints.includes(id) ? "hit" : null);
      }
      momentRows.from(snapshots, () => snapshots.map(({ id, name, at }) =>
        h("li", {}, h("span", {}, `${name} · ${seconds(at)}`),
          h("button", { onclick: () => post(`snapshots/${id}/restore`), attrs: { "data-once": "", "aria-label": `${say("goBack")}: ${name}` } }, say("goBack")),
          gone(`snapshots/${id}`, name))));
    },
  };
}
