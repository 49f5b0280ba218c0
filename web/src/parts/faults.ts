// Faults at a click: what goes wrong on the line and at the machine, and what is wrong now.
import type { App, Part } from "../app";
import { card, h, Rebuilt } from "../dom";
import type { Machine } from "../machine";
import { figure, say } from "../words";

const READY = [
  ["loseAnswer", "drop to-host once"],
  ["garbleAnswer", "garble to-host once"],
  ["doubleAnswer", "duplicate to-host once"],
  ["cutLine", "cut both for 2s"],
  ["powerFailure", "power-off for 1s"],
] as const;

export function faults(app: App): Part {
  const begin = (fault: string) => app.act((path) => app.api.post(`${path}/faults`, { fault }));
  const jams = h("span", { class: "jams" });
  const jamRows = new Rebuilt(jams);
  const ways = h("datalist", { id: "fault-ways" });
  const field = h("input", {
    type: "text", placeholder: "drop to-host once after @0P", spellcheck: false, autocomplete: "off",
    attrs: { list: ways.id, "aria-label": say("ownFault") },
  });
  // What can be written next, as standard input completes it.
  const complete = async () => {
    const path = `/controllers/${app.machine?.number ?? 1}/completions?line=`;
    const found = await app.api.get<{ line: string; about: string }[]>(path + encodeURIComponent(`fault ${field.value}`)).catch(() => []);
    ways.replaceChildren(...found.map(({ line, about }) =>
      h("option", { value: line.replace(/^fault /, "") }, about ?? "")));
  };
  field.onfocus = field.oninput = () => void complete();
  const submit = (event: Event) => {
    event.preventDefault();
    const fault = field.value;
    // What was refused stays, to be mended.
    if (fault.trim() !== "") void begin(fault.trim()).then((isDone) => isDone && field.value === fault && (field.value = ""));
  };
  const list = h("ul", { class: "list", attrs: { "aria-label": say("active") } });
  const rows = new Rebuilt(list);
  const element = card("faults", say("faults"),
      h("div", { class: "bar", attrs: { role: "group", "aria-label": say("oftenUsed") } },
        ...READY.map(([word, fault]) => h("button", { title: `fault ${fault}`, attrs: { "data-once": "" }, onclick: () => void begin(fault) }, say(word))), jams),
      h("form", { class: "bar", onsubmit: submit }, field, ways, h("button", { type: "submit", attrs: { "data-once": "" } }, say("begin"))),
      list);
  return {
    element,
    show(machine: Machine) {
      // They belong to the line, which has no past.
      element.inert = app.past?.isOpen ?? false;
      const axes = machine.about.axes.filter((axis) => axis.scale).map((axis) => axis.name);
      jamRows.from(axes, () => axes.map((name) =>
        h("button", { title: `fault jam ${name.toLowerCase()}`, attrs: { "data-once": "" }, onclick: () => void begin(`jam ${name.toLowerCase()}`) }, `${say("jamAxis")} ${name}`)));
      rows.from(machine.faults, () => {
        const active = machine.faults.filter((fault) => fault.stage !== "over");
        const shown = active.map(({ number, fault, struck }) =>
          h("li", {}, h("code", {}, fault), h("span", { class: "note" }, `${figure(struck)} ${say("times")}`),
            h("button", { onclick: () => void app.act((path) => app.api.delete(`${path}/faults/${number}`)), attrs: { "data-once": "", "aria-label": `${say("end")}: ${fault}` } }, say("end"))));
        const all = h("li", {}, h("button", { onclick: () => void app.act((path) => app.api.delete(`${path}/faults`)) }, say("endAll")));
        return active.length > 1 ? [...shown, all] : shown;
      });
    },
  };
}
