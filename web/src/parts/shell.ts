// The head of the page: which controllers there are and what each does, whether the server is there,
// language and colours; and what came of the last order.
import type { App } from "../app";
import { h, mark, put, Rebuilt } from "../dom";
import { keep, recall } from "../kept";
import { LANGUAGES, language, say, speak, translated, type Language } from "../words";

const COLOURS = ["system", "light", "dark"] as const;
const NAMES: Record<Language, string> = { en: "English", de: "Deutsch" };
/** What came of an order is shown so long, in ms. */
const NOTICE = 8_000;

/** Gives the page the colours that were chosen. */
export function colour(): void {
  const chosen = recall("colours");
  if (chosen === "light" || chosen === "dark") document.documentElement.dataset.colours = chosen;
  else delete document.documentElement.dataset.colours;
}

/** What came of the last order. It outlives the rest of the page, which is built anew for other controllers. */
export function notice(app: App): HTMLElement {
  const [first, text] = [h("span"), h("span")];
  const close = h("button", {}, "×");
  const element = h("div", { class: "notice", hidden: true, attrs: { role: "status" } }, h("p", {}, first, text), close);
  let timer = 0;
  let isRefusal = false;
  const end = () => (element.hidden = true);
  close.onclick = end;
  document.addEventListener("keydown", ({ key }) => key === "Escape" && end());
  app.onNotice = (said, isError, isOwn, lead) => {
    put(first, lead ? `${lead} ` : "");
    put(text, said);
    isRefusal = lead === say("refused");
    text.lang = isOwn ? language() : "en";
    close.ariaLabel = say("close");
    mark(element, "data-error", String(isError));
    element.hidden = false;
    clearTimeout(timer);
    if (!isError) timer = window.setTimeout(end, NOTICE);
  };
  app.onNoticeOver = end;
  app.onTry = () => void (isRefusal && end());
  return element;
}

export interface Shell {
  head: HTMLElement;
  foot: HTMLElement;
  show(): void;
}

export function shell(app: App, more: { foot: () => Node[]; where?: () => string }, redraw: () => void): Shell {
  const tabs = h("nav", { class: "tabs", attrs: { "aria-label": say("controllers") } });
  const rows = new Rebuilt(tabs);
  const link = h("output", { class: "link", attrs: { "aria-live": "polite" } });
  const chooser = (label: string, choices: readonly [string, string][], now: string, choose: (value: string) => void) => {
    const select = h("select", { attrs: { "aria-label": label } },
      ...choices.map(([value, text]) => h("option", { value, selected: value === now }, text)));
    select.onchange = () => choose(select.value);
    return select;
  };
  const languages = chooser(say("language"), LANGUAGES.map((one) => [one, NAMES[one]]), language(), (value) => {
    speak(value as Language);
    redraw();
  });
  const colours = chooser(say("colours"), COLOURS.map((one) => [one, say(one)]), recall("colours") ?? "system", (value) => {
    keep("colours", value);
    colour();
    app.changed();
  });
  return {
    head: h("header", {},
      h("a", { class: "skip", href: "#front" }, say("skip")),
      h("h1", {}, app.film?.title ?? "virtual IMC4"), tabs, link, languages, colours),
    foot: h("footer", {}, ...more.foot()),
    show() {
      put(link, more.where?.() ?? say(app.isConnected ? "connected" : "lost"));
      mark(link, "data-on", String(app.isConnected));
      const { machines, machine } = app;
      rows.from(machines.map(({ number, about }) => [number, about.model]), () => machines.map(({ number, about }) =>
        h("button", { class: "tab", onclick: () => app.choose(number), title: about.title },
          h("span", { class: "lamp", attrs: { "aria-hidden": "true" } }),
          h("span", { class: "model" }, machines.length > 1 ? `${number} ${about.model}` : about.model), h("span", { class: "does" }))));
      for (const [i, one] of machines.entries()) {
        const tab = tabs.children[i];
        if (!tab) continue;
        mark(tab, "aria-current", one === machine ? "true" : null);
        put(tab.querySelector<HTMLElement>(".does")!, translated(one.activity));
        const isOn = one.view?.powered ?? true;
        mark(tab.querySelector(".lamp")!, "data-state", isOn ? one.holdsBack ? "held" : one.position?.moving ? "moves" : "on" : "off");
      }
    },
  };
}

/** Asks a person for the token of the server. */
export function askToken(): Promise<string> {
  return new Promise((resolve) => {
    const field = h("input", { type: "password", required: true, autocomplete: "off", attrs: { "aria-label": say("token") } });
    const dialog = h("dialog", { attrs: { "aria-label": say("tokenTitle") } });
    const enter = (event: Event) => {
      event.preventDefault();
      dialog.remove();
      resolve(field.value.trim());
    };
    dialog.append(h("form", { onsubmit: enter },
      h("h2", {}, say("tokenTitle")), h("p", {}, say("tokenAbout")), field, h("button", { type: "submit" }, say("enter"))));
    // It has to be answered.
    dialog.oncancel = (event) => event.preventDefault();
    document.body.append(dialog);
    dialog.showModal();
  });
}
