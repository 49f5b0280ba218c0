// The stored program, with a marker at the line that is being executed.
import type { Part } from "../app";
import { card, h, mark, put, Rebuilt } from "../dom";
import type { Machine } from "../machine";
import { say, translated } from "../words";

export function program(): Part {
  const state = h("p", { class: "note" });
  const list = h("ol", { class: "program-lines", tabIndex: 0, attrs: { "aria-label": say("program") } });
  const rows = new Rebuilt(list);
  let marker: number | null = null;
  const element = card("program", say("program"), state, list);
  return {
    element,
    show(machine: Machine) {
      const details = machine.view?.details;
      // Controllers of other families store none.
      element.hidden = details !== undefined && !("program" in details);
      const stored = details?.program;
      list.hidden = !stored;
      const loops = stored?.loops.length ?? 0;
      put(state, stored ? translated(stored.status) + (loops ? ` · ${loops} ${say("loops")}` : "") : say("noProgram"));
      rows.from([machine.number, stored?.lines], () => {
        marker = null;
        return (stored?.lines ?? []).map((text) => h("li", {}, h("code", {}, text)));
      });
      const at = stored?.marker ?? null;
      if (at === marker) return;
      if (marker !== null) mark(list.children[marker] ?? list, "aria-current", null);
      marker = at;
      const row = at === null ? null : (list.children[at] as HTMLElement | undefined);
      if (!row) return;
      mark(row, "aria-current", "step");
      list.scrollTop = row.offsetTop - list.offsetTop - list.clientHeight / 2;
    },
  };
}
