// The drawing of the machine, with its views and legend.
import type { App, Part } from "../app";
import { card, h, mark, put } from "../dom";
import type { Machine } from "../machine";
import { KINDS } from "../path";
import type { MachineScene, Way } from "../scene";
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
  let from: Way = "isometric";
  let isLeft = false;
  let drawing: Promise<void> | null = null;
  /** What draws is more than all the rest of the page: it comes when there is something to draw. */
  const draw = async (): Promise<void> => {
    const { MachineScene } = await import("../scene");
    if (isLeft) return;
    scene = new MachineScene(canvas, labels);
    scene.look(from);
    app.changed();
  };
  const ways = WAYS.map((way) => {
    const look = () => {
      from = way;
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
    leave() {
      isLeft = true;
      scene?.leave();
    },
    show(machine: Machine) {
      drawing ??= draw().catch(() => stage.replaceChildren(h("p", { class: "note" }, say("no3d"))));
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
