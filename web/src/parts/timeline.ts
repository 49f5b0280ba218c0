// The time line: what there is of the past, with what happened in it and its branches, and the moment
// that is looked at, which the mouse and the arrow keys move.
import type { Branch, Entry, History } from "../api";
import type { App, Part } from "../app";
import { card, h, mark, put, Rebuilt } from "../dom";
import type { Machine } from "../machine";
import { figure, say, seconds } from "../words";

/** The height of a branch, and where the first one is, in pixels. */
const LANE = 18;
const TOP = 12;
/** So often the present is drawn where it is by now, in ms. */
const TICKS = 1_000;
/** So many branches are drawn; all are listed. */
const LANES = 12;

type Sort = "command" | "answer" | "stop" | "error";

/** What an entry is on the line; what is none of these has no mark. */
export function sortOf(entry: Entry): Sort | null {
  const isStop = (entry.signal === "stop" || entry.signal === "estop") && Boolean(entry.value);
  if (isStop) return "stop";
  if (entry.why !== undefined || ["warning", "fault", "cut-short"].includes(entry.kind)) return "error";
  return entry.kind === "command" || entry.kind === "answer" ? entry.kind : null;
}
const COLOURS: Record<Sort, string> = { command: "--soft", answer: "--good", stop: "--lamp", error: "--alarm" };
/** What is drawn over what. */
const SORTS: readonly Sort[] = ["command", "answer", "stop", "error"];

export function timeline(app: App): Part {
  const canvas = h("canvas", { class: "marks", attrs: { "aria-hidden": "true" } });
  const range = h("input", { type: "range", class: "scrub", min: "0", step: "any", attrs: { "aria-label": say("timeline") } });
  const status = h("p", { class: "when", attrs: { role: "status" } });
  const go = (moment: { branch?: number; at?: number }) => void app.past?.go(moment);
  const past = () => app.past;
  const previous = h("button", { onclick: () => jump(-1) }, say("previousEntry"));
  const next = h("button", { onclick: () => jump(1) }, say("nextEntry"));
  const back = h("button", { onclick: () => go({}) }, say("toPresent"));
  const take = h("button", { attrs: { "data-once": "" }, onclick: () => void past()?.takeOver() }, say("takeOver"));
  const leave = h("button", { attrs: { "data-once": "" }, onclick: () => void past()?.leave() }, say("goOn"));
  const list = h("ul", { class: "list branches", attrs: { "aria-label": say("branches") } });
  const rows = new Rebuilt(list);
  const element = card("timeline", say("timeline"), canvas, range,
    h("div", { class: "bar" }, status, previous, next, back, take, leave), list);
  const differing = () => {
    if (!past()?.history?.differences?.length && !app.differing) return undefined;
    void app.differ();
    if (app.differing && !app.differing.element.isConnected) list.before(app.differing.element);
    app.differing?.show();
    return app.differing;
  };

  let isHeld = false;
  let first = 0;
  let last = 1;
  let drawn = "";
  const shown = (): Machine | undefined => app.shown;
  /** The time that is looked at, or is asked for. */
  const at = () => first + Number(range.value) * 1e6;

  range.oninput = () => go({ ...branchOfHistory(), at: Math.round(at()) });
  range.onpointerdown = () => (isHeld = true);
  range.onpointerup = range.onpointercancel = () => (isHeld = false);
  const branchOfHistory = () => {
    const history = past()?.history;
    return history?.open ? { branch: history.branch } : {};
  };
  /** To the nearest time before or after at which something was said or went wrong. */
  const jump = (by: 1 | -1) => {
    const machine = shown();
    if (!machine) return;
    // Whoever clicks faster than the past is worked out goes on from what was asked for.
    const now = past()?.aim ?? last;
    const times = machine.entries.filter((entry) => sortOf(entry) !== null).map((entry) => entry.at);
    const found = by < 0 ? times.findLast((time) => time < now) : times.find((time) => time > now);
    if (found !== undefined) go({ ...branchOfHistory(), at: found });
    else if (by > 0 && past()?.isOpen) go(branchOfHistory());
  };
  range.onkeydown = (event) => {
    const span = last - first;
    const to: Record<string, () => void> = {
      ArrowLeft: () => jump(-1), ArrowDown: () => jump(-1), ArrowRight: () => jump(1), ArrowUp: () => jump(1),
      Home: () => go({ ...branchOfHistory(), at: first }), End: () => past()?.isOpen && go({}),
      PageDown: () => go({ ...branchOfHistory(), at: Math.round(Math.max(first, at() - span / 10)) }),
      PageUp: () => go({ ...branchOfHistory(), at: Math.round(Math.min(last, at() + span / 10)) }),
    };
    if (!to[event.key] || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    to[event.key]!();
  };
  canvas.onpointerdown = (event) => {
    canvas.setPointerCapture(event.pointerId);
    const lane = Math.max(0, Math.round((event.offsetY - TOP) / LANE));
    const branch = past()?.history?.branches[lane];
    const follow = (moved: PointerEvent) => {
      const share = Math.min(1, Math.max(0, moved.offsetX / canvas.clientWidth));
      const time = Math.round(first + share * (last - first));
      go({ ...(branch ? { branch: branch.id } : {}), at: time });
    };
    follow(event);
    canvas.onpointermove = follow;
    canvas.onpointerup = canvas.onpointercancel = () => (canvas.onpointermove = null);
  };

  /** The lines, with their marks: at most one of a sort for each column of pixels. */
  const draw = (history: History | null, lanes: { branch: Branch | null; entries: Entry[] }[]) => {
    const ratio = Math.min(devicePixelRatio, 2);
    const [width, height] = [canvas.clientWidth, TOP + LANE * lanes.length];
    canvas.style.height = `${height}px`;
    [canvas.width, canvas.height] = [width * ratio, height * ratio];
    const context = canvas.getContext("2d");
    if (!context || width === 0) return;
    const css = getComputedStyle(canvas);
    const colour = (name: string) => css.getPropertyValue(name).trim();
    const x = (time: number) => ((time - first) / (last - first)) * width;
    const y = (lane: number) => TOP + LANE * lane;
    context.scale(ratio, ratio);
    for (const [i, { branch, entries }] of lanes.entries()) {
      context.strokeStyle = colour(history?.open && branch?.id === history.branch ? "--accent" : "--faint");
      context.lineWidth = 2;
      context.beginPath();
      if (branch?.parted) {
        const from = lanes.findIndex((lane) => lane.branch?.id === branch.parted!.branch);
        context.moveTo(x(branch.parted.at), y(Math.max(from, 0)));
        context.lineTo(x(branch.first), y(i));
      } else context.moveTo(x(branch?.first ?? first), y(i));
      context.lineTo(x(branch?.end ?? last), y(i));
      context.stroke();
      for (const sort of SORTS) {
        context.fillStyle = colour(COLOURS[sort]);
        const tall = sort === "stop" || sort === "error" ? 13 : 8;
        let column = -1;
        for (const entry of entries) {
          if (sortOf(entry) !== sort) continue;
          const place = Math.round(x(entry.at));
          if (place === column) continue;
          column = place;
          context.fillRect(place - 1, y(i) - tall / 2, 2, tall);
        }
      }
    }
    app.differing?.draw(context, colour("--alarm"), x, (id) => y(Math.max(0, lanes.findIndex(({ branch }) => branch?.id === id))));
    if (!history?.open) return;
    const lane = lanes.findIndex(({ branch }) => branch?.id === history.branch);
    context.fillStyle = colour("--tool");
    context.fillRect(x(history.at) - 1, 0, 2, height);
    context.beginPath();
    context.arc(x(history.at), y(Math.max(lane, 0)), 5, 0, 2 * Math.PI);
    context.fill();
  };

  // Time passes while nothing happens. Whoever has the line in hand is not disturbed.
  const ticks = setInterval(() => {
    const machine = shown();
    if (machine && document.activeElement !== range) part.show(machine);
  }, TICKS);
  const part: Part = {
    element,
    leave: () => clearInterval(ticks),
    show(machine: Machine) {
      const live = app.machine ?? machine;
      const { past } = app;
      if (!past) return;
      const { history } = past;
      const isOpen = past.isOpen;
      const { now } = live;
      const branches = isOpen ? history!.branches : [];
      first = Math.min(history?.first ?? 0, ...branches.map((branch) => branch.first));
      last = Math.max(isOpen ? history!.now.at : now, first + 1e6, ...branches.map((branch) => branch.end));
      range.max = String((last - first) / 1e6);
      range.disabled = !history?.possible;
      const looked = isOpen ? history!.at : last;
      if (!isHeld) range.value = String((looked - first) / 1e6);
      const on = branches.find(({ id }) => id === history?.branch);
      mark(range, "aria-valuetext", `${seconds(looked)}${on ? `, ${on.name}` : ""}`);
      const isNow = past.isNow;
      const differs = differing();
      const left = app.film && live.missing > 0 ? ` · ${figure(live.missing)} ${say("leftOut")}` : "";
      const gone = app.film?.back ? ` · ${figure(app.film.back)} ${say("wentBack")}` : "";
      const cut = app.film?.isCutOff ? ` · ${say("cutOff")}` : "";
      if (app.film) put(status, `${seconds(looked)} · ${say(app.film.every > 1 ? "filmThinned" : "film")}${left}${gone}${cut}`);
      else put(status, !history || history.possible
        ? isOpen ? `${seconds(looked)} · ${say(isNow ? "pausedNow" : "isPast")}` : say("dragBack")
        : say("noPast"));
      mark(element, "data-past", String(isOpen && !isNow));
      mark(element, "data-at", String(looked));
      mark(element, "data-branch", isOpen ? String(history!.branch) : "");
      for (const button of [back, take]) button.hidden = !isOpen || isNow;
      leave.hidden = !isOpen || past.isFilm;
      for (const button of [previous, next]) button.disabled = !history?.possible;
      rows.from(branches.map(({ id, name, why, first, parted }) => [id, name, why, first, parted, id === history?.branch]), () =>
        branches.length < 2 ? [] : branches.map(({ id, name, why, first, parted }) => {
          const from = branches.find((other) => other.id === parted?.branch);
          const text = `${why ?? name}${parted ? ` · ${seconds(parted.at)} ${say("leaves")} ${from?.name ?? parted.branch}` : ""}`;
          return h("li", {}, h("button", {
            onclick: () => go({ branch: id, at: first }),
            attrs: id === history?.branch ? { "aria-current": "true" } : {},
          }, why ? `${name}: ${text}` : text));
        }));
      const lanes = isOpen
        ? branches.slice(0, LANES).map((branch) => ({ branch, entries: past.entriesOf(branch) }))
        : [{ branch: null, entries: live.entries }];
      // The present moves all the time; what is drawn of it less than half a pixel is not drawn.
      const width = Math.round(2 * canvas.clientWidth * Math.log(last - first));
      const key = [first, width, isOpen ? looked : "", lanes.length, live.entries.at(-1)?.number, canvas.clientWidth,
        getComputedStyle(canvas).color, differs && history?.differences?.length, ...lanes.map(({ entries }) => entries.length)].join();
      mark(element, "data-marks", String(lanes.reduce((sum, { entries }) => sum + entries.filter(sortOf).length, 0)));
      if (key === drawn) return;
      drawn = key;
      draw(history, lanes);
    },
  };
  return part;
}
