// The drawing of the machine, with its views and legend.
import type { App, Part } from "../app";
import { card, h, mark, put } from "../dom";
import type { Machine } from "../machine";
import { KINDS } from "../path";
import { MachineScene, type Way } from "../scene";
import { figure, say, translated } from "../words";

const WAYS: readonly Way[] = ["isometric", "top", "front", "side"];

export function view(app: App): Part {
  const canvas = h("canvas", { attrs: { role: "img", "aria-label": say("drawing") } });
  const labels = h("div", { class: "labels", attrs: { "aria-hidden": "true" } },
    ...["X", "Y", "Z"].map((name) => h("span", {}, name)));
  const coarse = h("p", { class: "coarse", attrs: { "aria-hidden": "true" } }, say("coarse"));
  const stage = h("div", { class: "stage" }, canvas, labels, coarse);
  const thinned = h("p", { class: "note" });
  let scene: MachineScene | null = null;
  try {
    scene = new MachineScene(canvas, labels);
  } catch {
    stage.replaceChildren(h("p", { class: "note" }, say("no3d")));
  }
  const ways = WAYS.map((way) => {
    const look = () => {
      scene?.look(way);
      for (const [i, button] of ways.entries()) mark(button, "aria-pressed", String(WAYS[i] === way));
    };
    return h("button", { onclick: look, attrs: { "aria-pressed": String(way === "isometric") } }, say(way));
  });
  const clear = () => {
    app.shown?.path.clear();
    app.changed();
  };
  const element = card("machine", say("machine"),
    h("div", { class: "bar", attrs: { role: "group", "aria-label": say("view") } },
      ...ways, h("button", { onclick: () => scene?.fit() }, say("fit")), h("button", { onclick: clear }, say("clearPath"))),
    stage,
    h("ul", { class: "legend", attrs: { "aria-label": say("legend") } },
      ...KINDS.map((kind) => h("li", { class: `of-${kind}` }, say(kind)))),
    thinned);
  return {
    element,
    leave: () => scene?.leave(),
    show(machine: Machine) {
      scene?.show(machine);
      const { path, position } = machine;
      mark(stage, "data-corners", String(path.corners));
      mark(stage, "data-kinds", [...path.kinds].join(" "));
      mark(stage, "data-carriage", position?.carriage.join(" ") ?? "");
      const steps = machine.byIndex(position?.carriage ?? []);
      const places = machine.about.axes.map(({ name, index }) => `${name} ${steps[index] ?? 0}`);
      mark(canvas, "aria-label", `${say("drawing")}: ${translated(machine.activity)}, ${places.join(", ")} ${say("steps")}`);
      put(thinned, path.thinned > 0 ? `${figure(path.thinned)} ${say("thinned")}` : "");
    },
  };
}
