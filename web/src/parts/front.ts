// The front panel of the controller: its buttons, key, cover and mains switch, drawn as at the
// machine.
import type { Signal } from "../api";
import type { App, Part } from "../app";
import { card, h, mark, put, Rebuilt } from "../dom";
import type { Machine } from "../machine";
import { explained, named, say, translated } from "../words";

/** The order on the plate; what else there is follows. */
const ORDER = ["key", "on", "start", "stop", "cover-button", "cover", "estop"];

export function front(app: App): Part {
  const lamp = h("span", { class: "lamp", attrs: { "aria-hidden": "true" } });
  const state = h("output", { class: "state", attrs: { "aria-live": "polite" } });
  const mains = h("button", { class: "mains", attrs: { "data-once": "" }, onclick: () => void app.order(mains.dataset.order ?? "power off") });
  const plate = h("div", { class: "plate" });
  const rebuilt = new Rebuilt(plate);
  const shown = new Map<string, (signal: Signal) => void>();

  const button = (signal: Signal): HTMLElement => {
    const { name } = signal;
    const press = () => {
      const isHeld = element.getAttribute("aria-pressed") === "true";
      void app.order(signal.latches ? `${isHeld ? "release" : "hold"} ${name}` : `press ${name}`);
    };
    const label = h("span", { class: "name" }, named(name));
    const element = h("button", { class: `knob knob-${name}`, title: explained(signal.about), onclick: press, attrs: { "data-signal": name, ...(signal.latches && { "data-once": "" }) } },
      h("span", { class: "cap", attrs: { "aria-hidden": "true" } }), label);
    shown.set(name, (now) => {
      const isDown = Boolean(now.value);
      if (!signal.latches) return mark(element, "data-down", String(isDown));
      mark(element, "aria-pressed", String(isDown));
      mark(element, "title", say(isDown ? "estopRelease" : "estopHold"));
    });
    return element;
  };

  const turn = (signal: Signal): HTMLElement => {
    const positions = signal.positions ?? ["0", "1"];
    const buttons = positions.map((position, value) => {
      const put = () => void app.set(signal.name, value);
      return h("button", { onclick: put, attrs: { "data-signal": signal.name, "data-position": position } }, named(position));
    });
    shown.set(signal.name, (now) =>
      buttons.forEach((one, value) => mark(one, "aria-pressed", String(now.value === value))));
    return h("div", { class: "turn", title: explained(signal.about), attrs: { role: "group", "aria-label": named(signal.name) } },
      h("span", { class: "name" }, named(signal.name)), h("span", { class: "ways" }, ...buttons));
  };

  const element = card("front", say("panel"),
    h("div", { class: "bar" }, lamp, state, mains), plate);
  element.id = "front";
  element.tabIndex = -1;
  return {
    element,
    show(machine: Machine) {
      const isOn = machine.view?.powered ?? true;
      const program = machine.view?.details.program;
      const line = program?.marker != null ? `, ${translated("line")} ${program.marker + 1}` : "";
      const held = isOn ? machine.holdsBack : null;
      put(state, (held ? `${say(held)} · ` : "") + translated(machine.activity) + line);
      mark(state, "data-held", String(held !== null));
      mark(lamp, "data-state", isOn ? held ? "held" : machine.position?.moving ? "moves" : "on" : "off");
      put(mains, say(isOn ? "powerOff" : "powerOn"));
      mains.dataset.order = isOn ? "power off" : "power on";
      plate.inert = app.film !== undefined;
      const place = (signal: Signal) => (ORDER.indexOf(signal.name) + ORDER.length + 1) % (ORDER.length + 1);
      const own = machine.signals.filter(({ kind }) => kind === "button" || kind === "switch");
      own.sort((a, b) => place(a) - place(b));
      rebuilt.from([machine.number, own.map((signal) => signal.name)], () => {
        shown.clear();
        return own.map((signal) => (signal.kind === "button" ? button(signal) : turn(signal)));
      });
      for (const signal of own) shown.get(signal.name)?.(signal);
    },
  };
}
