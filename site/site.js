// What the site can do beside showing pages: sessions open where they are named, and the behaviours can be
// filtered. Without it every page can be read nonetheless.
"use strict";

(() => {
  // Of mdBook: the way from this page to the first.
  const root = typeof path_to_root === "string" ? path_to_root : "";

  const element = (name, properties = {}, ...inner) => {
    const made = Object.assign(document.createElement(name), properties);
    made.append(...inner);
    return made;
  };

  // --- sessions ---

  const files = new Map();

  /** How the sessions of a file go; each file is read once. */
  const told = (id) => {
    const file = id.slice(0, id.lastIndexOf("/"));
    if (!files.has(file)) {
      const read = fetch(`${root}sessions/${file}.json`).then((answer) => {
        if (!answer.ok) throw new Error(`${file}: ${answer.status}`);
        return answer.json();
      });
      files.set(file, read);
    }
    return files.get(file).then((sessions) => sessions[id]);
  };

  /** A time of nanoseconds in the unit that suits it. */
  const time = (nanos) => {
    const units = [["s", 1e9], ["ms", 1e6], ["µs", 1e3], ["ns", 1]];
    const [unit, size] = units.find(([, size]) => nanos >= size) ?? units[3];
    return `${(nanos / size).toLocaleString("en", { maximumFractionDigits: 6 })} ${unit}`;
  };

  /** Numbers of axes without the zeros at the end. */
  const position = (axes) => {
    const last = axes.findLastIndex((axis) => axis !== 0);
    return axes.slice(0, Math.max(last + 1, 1)).map((axis) => axis.toLocaleString("en")).join(", ");
  };

  const line = (told) => {
    const row = element("tr", { className: told.text === "a new controller" ? "new" : "" });
    const heard = element("td", {}, told.heard ? element("code", {}, told.heard) : "");
    if (told.why) heard.append(` ${told.why}`);
    row.append(
      element("td", {}, row.className ? told.text : element("code", {}, told.text)),
      heard,
      element("td", { className: "number", title: `it took ${time(told.took)}` }, time(told.at)),
      element("td", { className: "number" }, position(told.position)),
      element("td", {}, told.doing === "idle" ? "" : told.doing.replaceAll("-", " ")),
    );
    return row;
  };

  /** The session of an element, opened: its lines, one after the other or all at once. */
  const show = (id, session) => {
    const body = element("div", { className: "session-body" });
    const rows = element("tbody");
    const heads = ["the script", "what comes", "time", "position", "doing"];
    const table = element(
      "table",
      { className: "session-lines" },
      element("thead", {}, element("tr", {}, ...heads.map((text) => element("th", { scope: "col" }, text)))),
      rows,
    );
    const model = element("select", { ariaLabel: "Model" });
    session.told.forEach((told, at) => {
      for (const name of told.models) model.append(element("option", { value: at }, name));
    });
    const button = (text, label, does) => {
      const made = element("button", { type: "button", title: label, ariaLabel: label }, text);
      made.addEventListener("click", does);
      return made;
    };
    let at = 0;
    let playing = 0;
    const lines = () => session.told[model.value].lines;
    const mark = () => {
      [...rows.children].forEach((row, number) => {
        row.classList.toggle("later", number >= at);
        row.classList.toggle("now", number === at - 1);
      });
      back.disabled = at === 0;
      on.disabled = at === rows.children.length;
    };
    const halt = () => {
      clearTimeout(playing);
      playing = 0;
      play.textContent = "Play";
    };
    const go = (to) => {
      at = Math.max(0, Math.min(to, rows.children.length));
      mark();
    };
    const step = () => {
      go(at + 1);
      // As long as it took, but so that one can follow it and need not wait.
      const took = lines()[at]?.took ?? 0;
      if (at < rows.children.length) playing = setTimeout(step, Math.min(Math.max(took / 1e6, 250), 2000));
      else halt();
    };
    const first = button("|◀", "To the beginning", () => { halt(); go(0); });
    const back = button("◀", "A line back", () => { halt(); go(at - 1); });
    const on = button("▶", "A line on", () => { halt(); go(at + 1); });
    const last = button("▶|", "To the end", () => { halt(); go(rows.children.length); });
    const play = button("Play", "Play it line by line", () => {
      if (playing) return halt();
      if (at === rows.children.length) go(0);
      play.textContent = "Pause";
      step();
    });
    const fill = () => {
      halt();
      rows.replaceChildren(...lines().map(line));
      go(rows.children.length);
    };
    model.addEventListener("change", fill);
    const where = [`${session.evidence}: ${session.source}`];
    if (session.machine.name !== "bench") where.push(`machine ${session.machine.name}`);
    if (session.paced) where.push("characters take their time on the line");
    const differs = { ...session.profile };
    if (Object.keys(session.machine.differs).length) differs.machine = session.machine.differs;
    if (Object.keys(differs).length) where.push(JSON.stringify(differs));
    body.append(
      element("div", { className: "session-bar" }, model, first, back, on, last, play),
      element("div", { className: "scrolls" }, table),
      element("p", {}, element("small", {}, where.join("; "))),
    );
    fill();
    return body;
  };

  const open = (details) => {
    if (!details.open || details.dataset.shown) return;
    details.dataset.shown = "yes";
    const link = details.querySelector("a");
    const place = element("p", {}, "…");
    link.before(place);
    told(details.dataset.id).then(
      (session) => place.replaceWith(show(details.dataset.id, session)),
      (error) => place.replaceWith(element("p", {}, `It cannot be read: ${error.message}`)),
    );
  };

  // It does not bubble.
  document.addEventListener("toggle", ({ target }) => {
    if (target instanceof HTMLElement && target.matches("details.session")) open(target);
  }, true);

  // --- the behaviours ---

  /** The models that a cell of the table means. */
  const means = (cell, family) => {
    const all = { isel: ["imc4", "imc4-m", "imc-m", "imc-mp", "imc-s8"], lpkf: ["smcu", "motionsystem"] };
    return cell.split(",").map((word) => word.trim()).flatMap((word) => {
      if (word === "all") return all[family] ?? [];
      return word === "iMC-xx" ? ["imc-m", "imc-mp", "imc-s8"] : [word];
    });
  };

  const filter = (main) => {
    const tables = [...main.querySelectorAll("table")].filter((table) => {
      const heads = [...table.querySelectorAll("th")].map((head) => head.textContent.trim());
      return heads[0] === "behaviour" && heads[3] === "models";
    });
    let family = "";
    let table = 0;
    const rows = [];
    for (const found of main.querySelectorAll("h2, table")) {
      if (found.matches("h2")) family = found.textContent.trim().toLowerCase();
      else if (found === tables[table]) {
        table += 1;
        for (const row of found.querySelectorAll("tbody tr")) {
          const cells = [...row.cells].map((cell) => cell.textContent);
          rows.push({
            row,
            text: cells.join(" ").toLowerCase(),
            evidence: cells[1],
            models: means(cells[3], family),
          });
        }
      }
    }
    const text = element("input", { type: "search", placeholder: "Words in a behaviour", ariaLabel: "Words" });
    const choice = (label, options) => {
      const made = element("select", { ariaLabel: label }, element("option", { value: "" }, label));
      made.append(...options.map(([value, shown]) => element("option", { value }, shown ?? value)));
      return made;
    };
    const names = [...new Set(rows.flatMap((row) => row.models))];
    const model = choice("Any model", names.map((name) => [name]));
    const evidence = choice("Any evidence", [["D", "D documented"], ["F", "F field"], ["A", "A assumed"]]);
    const count = element("output");
    const apply = () => {
      const words = text.value.toLowerCase().split(/\s+/).filter(Boolean);
      let left = 0;
      for (const below of main.querySelectorAll("tr.unfolded")) below.remove();
      for (const { row, text, evidence: marks, models } of rows) {
        const fits = words.every((word) => text.includes(word))
          && (!model.value || models.includes(model.value))
          && (!evidence.value || marks.includes(evidence.value));
        row.hidden = !fits;
        left += fits ? 1 : 0;
      }
      // A heading without a row is left out; so is its table.
      for (const table of tables) {
        const none = !table.querySelector("tbody tr:not([hidden])");
        const wrapper = table.closest(".table-wrapper") ?? table;
        wrapper.hidden = none;
        const heading = wrapper.previousElementSibling;
        if (heading?.matches("h3")) heading.hidden = none;
      }
      count.textContent = `${left} of ${rows.length}`;
      const kept = new URLSearchParams();
      if (text.value) kept.set("words", text.value);
      if (model.value) kept.set("model", model.value);
      if (evidence.value) kept.set("evidence", evidence.value);
      history.replaceState(null, "", `${location.pathname}${kept.size ? `?${kept}` : ""}${location.hash}`);
    };
    const asked = new URLSearchParams(location.search);
    text.value = asked.get("words") ?? "";
    model.value = asked.get("model") ?? "";
    evidence.value = asked.get("evidence") ?? "";
    for (const control of [text, model, evidence]) control.addEventListener("input", apply);
    const bar = element("div", { className: "filter", role: "search" }, text, model, evidence, count);
    main.querySelector("h2")?.before(bar);
    apply();
  };

  /** A behaviour's session opens below its row. */
  const unfold = (link, event) => {
    const row = link.closest("tr");
    const file = link.getAttribute("href").match(/fixtures\/sessions\/(.+)\.toml/)?.[1];
    if (!row || !file || event.ctrlKey || event.metaKey || event.shiftKey) return;
    event.preventDefault();
    const below = row.nextElementSibling;
    if (below?.matches(".unfolded")) return below.remove();
    const id = `${file}/${link.textContent.split("/").at(-1)}`;
    const cell = element("td", { colSpan: row.cells.length });
    row.after(element("tr", { className: "unfolded" }, cell));
    told(id).then(
      (session) => cell.append(show(id, session)),
      (error) => cell.append(`It cannot be read: ${error.message}`),
    );
  };

  const begin = () => {
    const main = document.querySelector("main");
    if (!main) return;
    if (location.pathname.endsWith("/behaviour.html")) filter(main);
    main.addEventListener("click", (event) => {
      const link = event.target.closest?.('a[href*="fixtures/sessions/"]');
      if (link) unfold(link, event);
    });
  };
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", begin);
  else begin();
})();
