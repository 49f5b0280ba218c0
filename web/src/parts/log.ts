// The conversation as people read it: searchable, and each entry with all that is known of it.
import type { Entry } from "../api";
import type { App, Part } from "../app";
import { card, h, mark, put } from "../dom";
import type { Machine } from "../machine";
import { figure, language, say, seconds, translated, type Word } from "../words";

const SIGNS: Record<string, string> = { command: "→", answer: "←", warning: "!", fault: "!", motion: "↗", line: "›" };
/** The controller has left this moment, and goes on from another one: what follows comes after that, and not after this. */
const isLeft = ({ kind, about }: Entry): boolean => kind === "news" && about?.deed === "restore";
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
  const meaning = h("p", { class: "note meaning", id: "meaning", lang: "en", attrs: { role: "status" } });
  const line = h("input", { type: "text", spellcheck: false, autocomplete: "off", placeholder: "@0P", attrs: { "aria-label": say("sendAbout"), "aria-describedby": meaning.id } });
  let asked = 0;
  line.oninput = async () => {
    const question = ++asked;
    const said = line.value === "" ? "" : await app.means?.(line.value).catch(() => "");
    if (question === asked) put(meaning, said ?? "");
  };
  const send = (event: Event) => {
    event.preventDefault();
    if (line.value === "") return;
    const sent = line.value;
    // What was refused stays, to be mended.
    void app.send(sent).then((isSent) => isSent && line.value === sent && clear());
  };

  const clear = () => {
    asked += 1;
    line.value = "";
    put(meaning, "");
  };

  /** The entries that are shown: those of another session are others, under the same numbers. */
  let of: Entry[] | null = null;
  let edition = -1;
  /** Which replies are shown where a recording differs. */
  let shown: string | undefined;
  let taken = 0;
  let matches: Entry[] = [];
  let limit = PAGE;
  let first = 0;
  let rows: HTMLElement[] = [];
  /** The way that the matches are of, where the past is shown. */
  let way: Entry[] | null = null;

  const matching = (): ((entry: Entry) => boolean) => {
    const isShown = SHOWN[which.value]!;
    const wanted = field.value.trim().toLowerCase();
    // Whatever is shown of the rest: it is where that parts.
    return (entry) => entry.text !== undefined && (isShown(entry) || isLeft(entry)) &&
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
    const jump = h("button", { onclick: () => void app.past?.lookAt(entry) }, say("lookAt"));
    detail.replaceChildren(...pairs.flatMap(([word, text]) =>
      text === undefined ? [] : [h("dt", {}, say(word)), h("dd", word === "why" ? { lang: "en" } : {}, text)]),
    ...(app.past?.history?.possible ? [h("dt"), h("dd", {}, jump)] : []));
    row.append(detail);
  };

  const row = (entry: Entry): HTMLElement => {
    const left = isLeft(entry);
    const element = h("li", { class: `entry entry-${entry.kind}${entry.why ? " entry-error" : ""}${left ? " entry-left" : ""}` });
    const button = h("button", { attrs: { "aria-expanded": "false" }, onclick: () => open(entry, element) },
      h("time", {}, seconds(entry.at)),
      h("span", { class: "sign", attrs: { role: "img", "aria-label": translated(entry.kind) } }, left ? "↩" : SIGNS[entry.kind] ?? "·"),
      left ? h("span", { class: "text" }, say("leftHere")) : h("span", { class: "text", lang: "en" }, entry.text!));
    element.append(button);
    if (!left) app.differing?.row(entry, button.lastElementChild as HTMLElement);
    return element;
  };

  const again = () => {
    [taken, matches, rows, first, way] = [0, [], [], 0, null];
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

  /** A part of the way around the moment that is looked at; what came later is faint. */
  const around = (machine: Machine) => {
    if (way !== machine.entries) {
      way = machine.entries;
      matches = way.filter(matching());
      rows = [];
    }
    const reached = machine.reached ?? 0;
    let now = matches.findIndex((entry) => entry.number > reached);
    if (now < 0) now = matches.length;
    const isIn = rows.length > 0 && now >= first && now <= first + rows.length;
    const isNear = isIn && (now - first > PAGE / 6 || first === 0) && (first + rows.length - now > PAGE / 6 || first + rows.length === matches.length);
    if (!isNear) {
      first = Math.max(0, Math.min(now - PAGE / 2, matches.length - PAGE));
      rows = matches.slice(first, first + PAGE).map(row);
      list.replaceChildren(...rows);
    }
    for (const [i, element] of rows.entries()) {
      element.classList.toggle("later", first + i >= now);
      mark(element, "aria-current", first + i === now - 1 ? "step" : null);
    }
    earlier.hidden = true;
    put(count, `${figure(now)} ${say("of")} ${figure(matches.length)} ${say("entries")}`);
    const current = rows[now - 1 - first];
    if (current && follow.checked) list.scrollTop = current.offsetTop - list.offsetTop - list.clientHeight / 2;
  };

  return {
    element: card("log", say("conversation"),
      h("div", { class: "bar" }, field, which, h("label", { class: "tick" }, follow, say("follow"))),
      earlier, list, count, language() !== "en" && h("p", { class: "note" }, say("inEnglish")),
      h("form", { class: "bar", onsubmit: send }, line, h("button", { type: "submit", attrs: { "data-once": "" } }, say("send"))), meaning),
    show(machine: Machine) {
      const replies = app.differing && `${app.differing.isRecorded} ${app.past?.history?.differences?.length}`;
      if (replies !== shown) {
        shown = replies;
        return again();
      }
      const lastKnown = taken > 0 ? machine.entries.findLastIndex((entry) => entry.number <= taken) : -1;
      if (machine.entries !== of || (taken > 0 && lastKnown < 0)) {
        of = machine.entries;
        detail.hidden = true;
        return again();
      }
      if (machine.edition === edition) return;
      edition = machine.edition;
      if (machine.reached !== null) return around(machine);
      const isMatch = matching();
      const added: Entry[] = [];
      for (let i = lastKnown + 1; i < machine.entries.length; i++) {
        const entry = machine.entries[i]!;
        taken = entry.number;
        if (isMatch(entry)) added.push(entry);
      }
      matches.push(...added);
      // What the machine no longer keeps is not found either.
      const oldest = machine.entries[0]?.number ?? 0;
      if (matches[0] && matches[0].number < oldest) matches.splice(0, matches.findIndex(({ number }) => number >= oldest));
      const news = added.slice(-limit).map(row);
      rows.push(...news);
      list.append(...news);
      while (rows.length > limit) rows.shift()!.remove();
      first = Math.max(0, matches.length - rows.length);
      earlier.hidden = first === 0;
      const missing = machine.missing > 0 ? ` · ${figure(machine.missing)} ${say("missing")}` : "";
      put(count, `${figure(matches.length)} ${say("of")} ${figure(machine.entries.length)} ${say("entries")}${missing}`);
      if (news.length > 0 && follow.checked) list.scrollTop = list.scrollHeight;
    },
  };
}
