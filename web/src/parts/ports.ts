// The ports: outputs as lamps, inputs as switches, what is measured as a number.
import type { Signal } from "../api";
import type { App, Part } from "../app";
import { card, h, mark, put, Rebuilt } from "../dom";
import type { Machine } from "../machine";
import { explained, say } from "../words";

const BITS = [7, 6, 5, 4, 3, 2, 1, 0];
/** Ports above are none that a person sees. */
const TERMINALS = 256;

export function ports(app: App): Part {
  const outputs = h("div", { class: "outputs" });
  const inputs = h("div", { class: "inputs" });
  const [lamps, switches] = [new Rebuilt(outputs), new Rebuilt(inputs)];
  let bits: HTMLElement[][] = [];
  let words: HTMLElement[] = [];
  const shown = new Map<string, (signal: Signal) => void>();
  const set = (name: string, value: number) => void app.set(name, value);

  const input = (signal: Signal): HTMLElement => {
    const text = signal.terminal ? `${signal.name} (${signal.terminal})` : signal.name;
    if (typeof signal.kind === "object") {
      const { low, high } = signal.kind.analogue;
      const field = h("input", { type: "number", min: String(low), max: String(high), attrs: { "aria-label": text } });
      const tell = () => field.value !== "" && set(signal.name, Number(field.value));
      shown.set(signal.name, (now) => {
        if (document.activeElement !== field) field.value = now.value === null ? "" : String(now.value);
      });
      return h("label", { class: "measured", title: explained(signal.about) }, h("span", {}, text), field,
        h("button", { onclick: tell }, say("set")));
    }
    const toggle = h("button", { class: "toggle", title: explained(signal.about), attrs: { role: "switch", "data-signal": signal.name } }, text);
    toggle.onclick = () => set(signal.name, toggle.getAttribute("aria-checked") === "true" ? 0 : 1);
    shown.set(signal.name, (now) => mark(toggle, "aria-checked", String(Boolean(now.value))));
    return toggle;
  };

  return {
    element: card("ports", say("ports"), h("h3", {}, say("outputs")), outputs, h("h3", {}, say("inputs")), inputs),
    show(machine: Machine) {
      const out = machine.view?.ports.filter(({ input, port }) => !input && port < TERMINALS) ?? [];
      lamps.from([machine.number, out.map(({ port }) => port)], () => {
        bits = out.map(() => BITS.map((bit) => h("span", { class: "bit" }, String(bit))));
        words = out.map(() => h("span", { class: "word" }));
        return out.map(({ port }, i) =>
          h("div", { class: "byte", attrs: { role: "img" } }, h("span", { class: "port" }, `${say("port")} ${port}`), ...bits[i]!, words[i]!));
      });
      out.forEach(({ port, value }, i) => {
        bits[i]!.forEach((lamp, k) => mark(lamp, "data-on", String(Boolean((value >> BITS[k]!) & 1))));
        put(words[i]!, String(value));
        mark(words[i]!.parentElement!, "aria-label", `${say("output")} ${say("port")} ${port}: ${value.toString(2).padStart(8, "0")}`);
      });
      inputs.inert = app.film !== undefined;
      const own = machine.signals.filter(({ kind }) => kind !== "button" && kind !== "switch");
      switches.from([machine.number, own.map(({ name }) => name)], () => {
        shown.clear();
        return own.map(input);
      });
      for (const signal of own) shown.get(signal.name)?.(signal);
    },
  };
}
