// The guided tour that somebody takes: one step at a time, each done when the controller says so.
import type { App, Part } from "../src/app";
import { card, h, mark, put, Rebuilt } from "../src/dom";
import type { Machine } from "../src/machine";
import { inLanguage } from "../src/words";
import { TOURS, type Tour } from "./tours";
import { tell } from "./words";

/** Where somebody is in a tour; it outlives the page being built again in another language. */
export class Taken {
  tour: Tour | null = null;
  index = 0;
  /** The steps that were done. */
  done = new Set<number>();
  /** The number of the last entry before the step. */
  since = 0;

  take(name: string): void {
    this.tour = TOURS[name] ?? null;
    this.index = this.since = 0;
    this.done.clear();
  }
}

/** `write` writes a line where it can be sent; `begin` puts the controller and the machine of a tour there. */
export function tourPart(app: App, taken: Taken, write: (line: string) => void, begin: (tour: Tour) => void): Part {
  const title = h("h3");
  const text = h("p");
  const lines = h("div", { class: "bar lines" });
  const rows = new Rebuilt(lines);
  const state = h("p", { class: "note", attrs: { role: "status" } });
  const walk = (by: number) => {
    const last = (app.machine?.entries.at(-1)?.number ?? 0);
    taken.index = Math.min(Math.max(taken.index + by, 0), taken.tour!.steps.length);
    taken.since = last;
    app.changed();
    if (by !== 0) title.focus();
  };
  title.tabIndex = -1;
  const previous = h("button", { onclick: () => walk(-1) }, tell("previousStep"));
  const next = h("button", { class: "next", onclick: () => walk(1) }, tell("nextStep"));
  const back = h("button", { class: "tour-back", onclick: () => begin(taken.tour!) }, tell("backToTour"));
  const leave = h("button", {
    onclick: () => {
      taken.tour = null;
      app.changed();
    },
  }, tell("leaveTour"));
  const element = card("tour", tell("tour"), title, text, lines, state, h("div", { class: "bar" }, previous, next, back, leave));
  element.hidden = true;
  return {
    element,
    show(machine: Machine) {
      const { tour, index, done } = taken;
      element.hidden = tour === null;
      if (!tour) return;
      const step = tour.steps[index];
      const live = app.machine ?? machine;
      const { about } = live;
      // What another controller does is none of what it asks for.
      const isHere = about.model === tour.model && about.machine === tour.machine;
      if (step && isHere && !done.has(index)) {
        // Numbers begin again in another session.
        if ((live.entries.at(-1)?.number ?? 0) < taken.since) taken.since = 0;
        const entries = live.entries.filter(({ number }) => number > taken.since);
        const isPast = (app.past?.isOpen ?? false) && !app.past!.isNow;
        if (step.met({ entries, machine: live, isPast })) done.add(index);
      }
      const isDone = done.has(index);
      const count = tour.steps.length;
      put(title, step ? `${tell("step")} ${index + 1} ${tell("of")} ${count}: ${inLanguage(step.title)}` : inLanguage(tour.title));
      put(text, step ? inLanguage(step.text) : tell("tourEnd"));
      rows.from([index, tour.title[0]], () => (step?.type ?? "").split("\n").filter(Boolean).map((line) =>
        h("span", { class: "suggested" }, h("code", {}, line),
          h("button", { onclick: () => write(line), attrs: { "aria-label": `${tell("showMe")}: ${line}` } }, tell("showMe")))));
      const needs = isHere ? "" : `${tell("tourNeeds")} ${tour.model}, ${tour.machine}`;
      put(state, step ? (isDone ? `✓ ${tell("done")}` : needs) : "");
      mark(element, "data-done", String(isDone));
      mark(element, "data-step", String(index + 1));
      previous.disabled = index === 0;
      next.disabled = !step || !isDone;
      next.hidden = !step;
      back.hidden = isHere || !step;
    },
  };
}
