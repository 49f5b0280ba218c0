// Where the axes are: counters, carriages and speeds, in millimetres or steps.
import type { App, Part } from "../app";
import { card, h, mark, put, Rebuilt } from "../dom";
import { keep, recall } from "../kept";
import type { Machine } from "../machine";
import { figure, say } from "../words";

export function axes(app: App): Part {
  let unit = recall("unit") === "steps" ? "steps" : "mm";
  const choices = ["mm", "steps"].map((name) => {
    const choose = () => {
      unit = name;
      keep("unit", name);
      app.changed();
    };
    return h("button", { onclick: choose }, name === "mm" ? "mm / °" : say("steps"));
  });
  const body = h("tbody");
  const rows = new Rebuilt(body);
  let cells: HTMLElement[][] = [];
  const table = h("table", {},
    h("thead", {}, h("tr", {},
      ...[say("axis"), say("position"), say("carriage"), say("speed")].map((text) => h("th", { scope: "col" }, text)))),
    body);
  const element = card("axes", say("axes"),
    h("div", { class: "bar", attrs: { role: "group", "aria-label": say("units") } }, ...choices), table);
  return {
    element,
    show(machine: Machine) {
      choices.forEach((button, i) => mark(button, "aria-pressed", String(unit === ["mm", "steps"][i])));
      const { view, position } = machine;
      if (!view) return;
      const shown = view.axes;
      rows.from(shown.map((axis) => axis.name), () => {
        cells = shown.map(() => [h("span", { class: "referenced" }), h("td"), h("td"), h("td")]);
        return shown.map((axis, i) => {
          const [lamp, ...figures] = cells[i]!;
          return h("tr", {}, h("th", { scope: "row" }, axis.name, lamp!), ...figures);
        });
      });
      shown.forEach((axis, i) => {
        const step = unit === "mm" ? machine.perStep(axis.index) : null;
        const write = (steps: number) => (step ? `${figure(steps * step.factor, 3)} ${step.unit}` : figure(steps));
        // In a position all axes of the controller follow each other as in the view.
        const at = position?.positions[i] ?? axis.position;
        const carriage = position?.carriage[i] ?? axis.carriage;
        // Speeds are in millionths of a step a second.
        const speed = (position?.speed[i] ?? axis.speed) / 1e6;
        const [lamp, first, second, third] = cells[i]!;
        put(first!, write(at));
        put(second!, write(carriage));
        put(third!, step ? `${figure(speed * step.factor, 1)} ${step.unit}/s` : `${figure(speed)} Hz`);
        mark(lamp!, "title", say(axis.referenced ? "referenced" : "notReferenced"));
        mark(lamp!, "role", "img");
        mark(lamp!, "aria-label", say(axis.referenced ? "referenced" : "notReferenced"));
        mark(lamp!, "data-on", String(axis.referenced));
      });
    },
  };
}
