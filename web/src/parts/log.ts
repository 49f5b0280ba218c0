// The conversation as people read it: searchable, and each entry with all that is known of it.
import type { Entry } from "../api";
import type { App, Part } from "../app";
import { card, h, mark, put } from "../dom";
import type { Machine } from "../machine";
import { figure, say, seconds, translated, type Word } from "../words";

const SIGNS: Record<string, string> = { command: "→", answer: "←", warning: "!", fault: "!", motion: "↗", line: "›" };
const SHOWN: Record<string, (entry: Entry) => boolean> = {
  talk: (entry) => entry.kind === "command" || entry.kind === "answer" || entry.kind === "line",
  everything: () => true,
  problems: (entry) => entry.why !== undefined || ["warning", "fault", "ignored", "cut-short", "missed"].includes(entry.kind),
};
/** So many entries are on the page; more come when asked for. */
const PAGE = 300;

export function log(app: App): Part {
  const field = h("input", { type: "search", placeholder: say("search"), attrs: { "aria-label": say("search") } });
  const which = h("select", { attrs: { "aria-label": say("show") } },
    ...Object.keys(SHOWN).map((name) => h("option", { value: name }, say(name as Word))));
  const follow = h("input", { type: "checkbox", checked: true });
  const list = h("ol", { class: "entries", tabIndex: 0, attrs: { "aria-label": say("conversation") } });
  const earlier = h("button", { class: "earlier", hidden: true }, say("earlier"));
  const count = h("p", { class: "note", attrs: { role: "status" } });
  const detail = h("dl", { class: "detail", hidden: true });
  const line = h("input", { type: "text", spellcheck: false, autocomplete: "off", placeholder: "@0P", attrs: { "aria-label": say("sendAbout") } });
  const send = (event: Event) => {
    event.preventDefault();
    if (line.value === "") return;
    void app.act((path) => app.api.post(`${path}/line`, { send: `${line.value}\r` }));
    line.value = "";
  };

  let of: Machine | null = null;
  let edition = -1;
  let taken = 0;
  let matches: Entry[] = [];
  let limit = PAGE;
  let first = 0;
  let rows: HTMLElement[] = [];

  const matching = (): ((entry: Entry) => boolean) => {
    const isShown = SHOWN[which.value]!;
    const wanted = field.value.trim().toLowerCase();
    return (entry) => entry.text !== undefined && isShown(entry) &&
      (wanted === "" || `${entry.text} ${entry.kind}`.toLowerCase().includes(wanted));
  };

  const open = (entry: Entry, row: HTMLElement) => {
    for (const other of list.querySelectorAll("[aria-expanded=true]")) mark(other, "aria-expanded", "false");
    const isOpen = detail.previousElementSibling !== row || detail.hidden;
    detail.hidden = !isOpen;
    mark(row.querySelector("button")!, "aria-expanded", String(isOpen));
    const pairs: [Word, string | undefined][] = [
      ["entry", figure(entry.number)], ["time", seconds(entry.at, 6)], ["kind", translated(entry.kind)],
      ["bytes", entry.bytes], ["why", entry.why],
    ];
    detail.replaceChildren(...pairs.flatMap(([word, text]) =>
      text === undefined ? [] : [h("dt", {}, say(word)), h("dd", {}, text)]));
    row.append(detail);
  };

  const row = (entry: Entry): HTMLElement => {
    const element = h("li", { class: `entry entry-${entry.kind}${entry.why ? " entry-error" : ""}` });
    const button = h("button", { attrs: { "aria-expanded": "false" }, onclick: () => open(entry, element) },
      h("time", {}, seconds(entry.at)),
      h("span", { class: "sign", attrs: { role: "img", "aria-label": translated(entry.kind) } }, SIGNS[entry.kind] ?? "·"),
      h("span", { class: "text" }, entry.text!));
    element.append(button);
    return element;
  };

  const again = () => {
    [taken, matches, rows, first] = [0, [], [], 0];
    list.replaceChildren();
    edition = -1;
    app.changed();
  };
  field.oninput = which.onchange = () => {
    limit = PAGE;
    again();
  };
  earlier.onclick = () => {
    limit += PAGE;
    again();
  };
  // Who scrolls back wants to read; a page that only became smaller does not count.
  let touched = -Infinity;
  for (const type of ["wheel", "pointerdown", "touchmove", "keydown"]) {
    list.addEventListener(type, (event) => (touched = event.timeStamp), { passive: true });
  }
  list.onscroll = (event) => {
    const isAtEnd = list.scrollHeight - list.scrollTop - list.clientHeight < 24;
    if (event.timeStamp - touched < 1_000) follow.checked = isAtEnd;
  };

  return {
    element: card("log", say("conversation"),
      h("div", { class: "bar" }, field, which, h("label", { class: "tick" }, follow, say("follow"))),
      earlier, list, count,
      h("form", { class: "bar", onsubmit: send }, line, h("button", { type: "submit" }, say("send")))),
    show(machine: Machine) {
      const lastKnown = taken > 0 ? machine.entries.findLastIndex((entry) => entry.number <= taken) : -1;
      if (machine !== of || (taken > 0 && lastKnown < 0)) {
        of = machine;
        detail.hidden = true;
        return again();
      }
      if (machine.edition === edition) return;
      edition = machine.edition;
      const isMatch = matching();
      const added: Entry[] = [];
      for (let i = lastKnown + 1; i < machine.entries.length; i++) {
        const entry = machine.entries[i]!;
        taken = entry.number;
        if (isMatch(entry)) added.push(entry);
      }
      matches.push(...added);
      const news = added.slice(-limit).map(row);
      rows.push(...news);
      list.append(...news);
      while (rows.length > limit) rows.shift()!.remove();
      first = matches.length - rows.length;
      earlier.hidden = first === 0;
      const missing = machine.missing > 0 ? ` · ${figure(machine.missing)} ${say("missing")}` : "";
      put(count, `${figure(matches.length)} ${say("of")} ${figure(machine.entries.length)} ${say("entries")}${missing}`);
      if (news.length > 0 && follow.checked) list.scrollTop = list.scrollHeight;
    },
  };
}
