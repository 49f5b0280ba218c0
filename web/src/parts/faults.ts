// Faults at a click: what goes wrong on the line and at the machine, and what is wrong now. Beside them rules, by which
// things happen by themselves.
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

/** How a rule begins, and no fault. */
const isRule = (text: string) => /^\s*(when|while|at|every|rule)\b/.test(text);

export function faults(app: App): Part {
  const begin = (text: string) => app.act((path) =>
    (isRule(text) ? app.api.post(`${path}/rules`, { rules: text }) : app.api.post(`${path}/faults`, { fault: text })));
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
    const begun = isRule(field.value) ? field.value : `fault ${field.value}`;
    const found = await app.api.get<{ line: string; about: string }[]>(path + encodeURIComponent(begun)).catch(() => []);
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
      rows.from([machine.faults, machine.rules], () => {
        const gone = (what: string) => app.act((path) => app.api.delete(`${path}/${what}`));
        const row = (text: string, count: string, what: string) =>
          h("li", {}, h("code", {}, text), h("span", { class: "note" }, count),
            h("button", { onclick: () => void gone(what), attrs: { "data-once": "", "aria-label": `${say("end")}: ${text}` } }, say("end")));
        const faults = machine.faults.filter(({ stage }) => stage !== "over")
          .map(({ number, fault, struck }) => row(fault, `${figure(struck)} ${say("times")}`, `faults/${number}`));
        const rules = machine.rules.filter(({ stage }) => stage !== "over")
          .map(({ scenario, rule, acted }) => row(rule, `${figure(acted)} ${say("acted")}`, `rules/${scenario}`));
        const endAll = async () => {
          if (faults.length > 0) await gone("faults");
          if (rules.length > 0) await gone("rules");
        };
        const all = h("li", {}, h("button", { onclick: () => void endAll() }, say("endAll")));
        return faults.length + rules.length > 1 ? [...faults, ...rules, all] : [...faults, ...rules];
      });
    },
  };
}
