// The page that needs no installing, in both browsers: what people do with it, as they do it.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { deflateRawSync, gzipSync } from "node:zlib";
import { bridge, played } from "./port.mjs";
import { absent, browser, host } from "./tab.mjs";
import { program, run, serve, until } from "./stand.mjs";

/** What is fetched before the first answer, in bytes. */
const LIMIT = 420_000;
/** What comes after it. */
const LATER = /^(page-.*\.wasm|scene-.*\.js|service\.js)$/;
let film, quirky, folder;
before(async () => {
  if (absent) return;
  folder = await mkdtemp(join(tmpdir(), "film-"));
  const page = join(folder, "limit.html");
  await run("replay", new URL("../../examples/limit.jsonl", import.meta.url).pathname, "--html", page);
  film = await readFile(page, "utf8");
  quirky = join(folder, "quirky.toml");
  const profile = await told("models", "show", "imc4");
  await writeFile(quirky, profile.replace('version_handshake = "last"', 'version_handshake = "first"'));
});
after(() => folder && rm(folder, { recursive: true, force: true }));

/** What the program prints, whatever its exit code is. */
const told = (...options) => new Promise((resolve) => execFile(program, options, (_, text) => resolve(text)));
/** What `vimc4 replay` says of a recording. */
const replayed = async (text) => {
  const path = join(folder, "saved.jsonl");
  await writeFile(path, text);
  // How fast this computer is decides about the times.
  return told("replay", path, "--tolerance", "20s");
};
/** A link to a session. */
const linked = (...session) => `#1.${deflateRawSync(JSON.stringify(session)).toString("base64url")}`;
/** What a controller records at a line on which characters take their time. */
async function paced() {
  const server = await serve("--line-pacing", "--time", "instant", "--http", "127.0.0.1:0");
  try {
    await server.ask("POST", "/controllers/1/recording");
    for (const line of ["@07", "@0A3000,700,0,900,0,900,0,900", "@0P"]) await server.send(line);
    await until("it has answered", async () => {
      const { entries } = await server.ask("GET", "/controllers/1/journal?kinds=answer");
      return entries.at(-1)?.bytes === "0000BB8000000000000";
    });
    return (await fetch(`${server.url}/v1/controllers/1/recording`)).text();
  } finally {
    await server.end();
  }
}
const example = (name) => readFile(new URL(`../../examples/${name}`, import.meta.url), "utf8");

for (const name of ["chromium", "firefox"]) {
  describe(name, { skip: absent }, () => {
    let own;
    before(async () => (own = await browser(name)));
    after(() => own?.end());

    /** A test with a host and a tab of its own. */
    function with_(title, body, options = {}) {
      test(title, async () => {
        const site = await host();
        const tabs = [];
        const opened = async (url = "", before_, where = options.locale === "de" ? "läuft in dieser Seite" : "runs in this page") => {
          const tab = await own.tab(options);
          tabs.push(tab);
          if (before_) await tab.before(before_);
          await tab.goto(`${site.url}/${url}`);
          await tab.seen(".link", where);
          return tab;
        };
        try {
          await body(site, opened);
          for (const { asked, complaints } of tabs) {
            const foreign = asked.filter((url) => !url.startsWith(`${site.url}/`) && !/^(data|blob|about):/.test(url));
            assert.deepEqual(foreign, [], "no request leaves for elsewhere");
            assert.deepEqual(complaints, [], "the browser complains of nothing");
          }
        } catch (error) {
          // What the pages showed then.
          for (const tab of tabs) error.message += `\n${await tab.state()}`;
          throw error;
        } finally {
          for (const tab of tabs) await tab.close();
          await site.end();
        }
      });
    }

    with_("the five minutes of the README, and the first answer within its bytes", async (site, opened) => {
      site.hold(LATER);
      const tab = await opened();
      await tab.send("@07");
      await tab.seen(".entry-answer", "0");
      assert.ok(site.told.bytes <= LIMIT, `${site.told.bytes} bytes before the first answer`);
      site.letGo();
      await tab.choose(".clock select", "8x");
      await tab.send("@0R7");
      await until("it is referenced", () => tab.look(() => document.querySelectorAll(".referenced[data-on=true]").length === 3));
      await tab.send("@0A12000,10000,0,900,0,900,0,900");
      await until("it is there", async () => (await tab.carriage())[0] === 12_000);
      await tab.send("@0P");
      await tab.seen(".entry-answer", "0002EE0000000000000");
      await tab.choose(".clock select", "real");
      await tab.send("@0A-12000,2000,0,900,0,900,0,900");
      await until("it moves", async () => (await tab.carriage())[0] < 11_500);
      await tab.click('.knob[data-signal="stop"]');
      await tab.seen(".entry-answer", "stopped by STOP");
      const [held] = await tab.carriage();
      assert.ok(held > 0 && held < 12_000, `${held}`);
      await tab.choose(".clock select", "100x");
      await tab.send("@0S");
      await until("it is back", async () => (await tab.carriage())[0] === 0);
    });

    with_("what only the whole page can do waits for it, in its order, and nothing else does", async (site, opened) => {
      site.hold(LATER);
      const tab = await opened();
      await tab.choose(".clock select", "8x");
      await tab.send("@07");
      await tab.seen(".entry-answer", "0");
      await tab.choose(".bench select.model", "smcu");
      await tab.seen(".link", "waits for the rest of this page");
      await tab.choose(".bench select.model", "imc4-m");
      const now = async () => Number((await tab.text(".clock .now")).replace(/\D/g, ""));
      const before = await now();
      await until("time goes on meanwhile", async () => (await now()) > before);
      site.letGo();
      await until("the last choice holds", async () => /imc4-m/.test(await tab.text("header")));
      await tab.seen(".link", "runs in this page");
      await tab.send("@07");
      await tab.seen(".entry-answer", "0");
    });

    with_("buttons work from the first moment, and a rest of the page that did not come is asked for again", async (site, opened) => {
      site.miss(/^page-.*\.wasm$/);
      const tab = await opened();
      await tab.send("@07");
      await tab.send("@0A12000,1000,0,900,0,900,0,900");
      await until("it moves", async () => (await tab.carriage())[0] > 0);
      await tab.click('.knob[data-signal="stop"]');
      await tab.seen(".entry-answer", "stopped by STOP");
      await tab.click(".timeline button", "Previous entry");
      await tab.seen(".notice", "404");
      site.letGo();
      await until("the past is there", async () => {
        await tab.click(".timeline button", "Previous entry");
        return tab.look(() => document.querySelectorAll(".entry.later").length > 0);
      });
      tab.complaints.length = 0;
    });

    with_("a choice that needs a rest of the page that did not come stays chosen, and Begin anew asks again", async (site, opened) => {
      site.miss(/^page-.*\.wasm$/);
      const tab = await opened();
      const chosen = () => tab.look(() => document.querySelector(".bench select.model").value);
      await tab.send("@07");
      await tab.seen(".entry-answer", "0");
      for (const again of [() => tab.choose(".bench select.model", "smcu"), () => tab.click(".bench button", "Begin anew")]) {
        await tab.drop("nothing.bin", "\0\0\0");
        await tab.seen(".notice", "no recording");
        await again();
        await tab.seen(".notice", "smcu needs the rest of this page. Begin anew asks for it again: ");
        await tab.seen(".notice", "404");
        await until("it stays chosen", async () => (await chosen()) === "smcu");
        assert.equal(await tab.text(".tab .model"), "imc4");
        assert.equal(await tab.look(() => document.querySelectorAll(".entry-answer").length), 1, "the controller goes on");
      }
      site.letGo();
      await tab.click(".bench button", "Begin anew");
      await tab.seen(".tab .model", "smcu");
      tab.complaints.length = 0;
    });

    with_("a first visit that was cut short says what is missing and what to do", async (site, opened) => {
      for (const [missing, why] of [[/^worker\.js$/, "worker.js did not come"], [/^first-.*\.wasm$/, "404"]]) {
        site.miss(missing);
        const tab = await opened("", undefined, "the controllers could not begin");
        await tab.seen(".notice", "The controllers could not begin. Load this page again when it can be reached: ");
        await tab.seen(".notice", why);
        site.letGo();
        await tab.reload();
        await tab.seen(".link", "runs in this page");
        await tab.send("@07");
        await tab.seen(".entry-answer", "0");
        tab.complaints.length = 0;
      }
    });

    with_("an address that ends in no link says so, and the name of a part of the page is none", async (_, opened) => {
      const tab = await opened("#hello");
      await tab.seen(".notice", "is no link to a moment. A new session has begun.");
      await tab.look(() => void (location.hash = "#world"));
      await tab.seen(".notice", "is no link to a moment. Nothing has changed.");
      const link = linked("imc4", "mill", 2e9, [[0, "send", "@07\r"]]);
      await tab.look((link) => void (location.hash = link), link);
      await tab.seen(".notice", "the moment of the link");
      await tab.look(() => void (location.hash = "#hello"));
      await tab.seen(".notice", "is no link to a moment. Nothing has changed.");
      await tab.click(".notice button");
      await tab.look(() => void (location.hash = "#front"));
      await tab.send("@0P");
      // What was sent while time is paused is told of, and nothing else.
      await tab.seen(".notice", "Time is paused: what was sent is heard after Resume or Step.");
      await tab.click(".clock button", "Resume");
      await tab.seen(".entry-answer", "000000000000000000");
    });

    with_("a file that cannot be opened is refused with what is wrong with it, as the program does", async (_, opened) => {
      const tab = await opened();
      const text = await example("limit.jsonl");
      const packed = gzipSync(text);
      const damaged = Buffer.from(packed);
      damaged.fill(0xff, 200, 260);
      const files = [
        ["head.jsonl.gz", packed.subarray(0, 5), "broken off in its first line"],
        ["line.jsonl.gz", packed.subarray(0, 300), "broken off in its first line"],
        ["zeros.jsonl.gz", Buffer.concat([packed, Buffer.alloc(512)]), "is damaged: it is not opened"],
        ["bits.jsonl.gz", damaged, "is damaged: it is not opened"],
        ["session.jsonl.zst", Buffer.from([0x28, 0xb5, 0x2f, 0xfd, 4, 0, 1, 2, 3]), "Unpack it first"],
        ["empty.jsonl", "", "It is empty."], ["empty.ncp.gz", gzipSync(""), "It is empty."],
      ];
      for (const [name, content, why] of files) {
        await tab.drop(name, content);
        await tab.seen(".notice", `${name}: `);
        const said = await tab.text(".notice");
        assert.ok(said.includes(why), `${name}: ${said}`);
        assert.equal(await tab.look(() => document.querySelectorAll(".entry").length), 0, "nothing was opened");
      }
      // Behind a part that is whole, the next may be torn off in its first bytes.
      for (const size of [1, 2, 5]) {
        await tab.drop(`${size}.jsonl.gz`, Buffer.concat([packed, packed.subarray(0, size)]));
        await tab.seen(".notice", `${size}.jsonl.gz: A recording`);
        await tab.seen(".notice", "It was torn off");
      }
    });

    with_("a link that is of nothing known begins anew, and one that comes later changes nothing", async (site, opened) => {
      const links = [
        [linked("unknown", "mill", 0, []), "no model `unknown`"], [linked("imc4", "mill", 10, [[0, "dance", "@07\r"]]), "not whole"],
        ["#2.AAAA", "of another edition"], ["#1.AAAA", "not whole"],
      ];
      for (const [link, why] of links) {
        const tab = await opened(link);
        await tab.seen(".notice", "A new session has begun.");
        await tab.seen(".notice", why);
        await tab.send("@07");
        await tab.seen(".entry-answer", "0");
        await tab.look((link) => void (location.hash = "", location.hash = link), link);
        await tab.seen(".notice", "Nothing has changed.");
        await tab.seen(".notice", why);
        await tab.send("@0P");
        await tab.seen(".entry-answer", "000000000000000000");
        tab.complaints.length = 0;
      }
    });

    with_("a link that waits for what does not come changes nothing, and says why", async (site, opened) => {
      site.miss(/^page-.*\.wasm$/);
      const tab = await opened();
      await tab.send("@07");
      const [start] = await tab.carriage();
      await tab.send("@0A500,5000,0,900,0,900,0,900");
      await until("it is there", async () => (await tab.carriage())[0] === start + 500);
      const there = await tab.carriage();
      const link = linked("imc4", "mill", 2e9, [[0, "send", "@07\r"], [1e6, "fault", "drop to-host once"], [1e6, "send", "@0A4000,2000,0,900,0,900,0,900\r"]]);
      await tab.look((link) => void (location.hash = link), link);
      await tab.seen(".notice", "could not be carried out. Nothing has changed.");
      await tab.seen(".notice", "404");
      await tab.send("@0P");
      await tab.seen(".entry-answer", "0001F4000000000000");
      assert.deepEqual(await tab.carriage(), there);
      const other = await opened(link);
      await other.seen(".notice", "could not be carried out. A new session has begun.");
      site.letGo();
      await tab.look((link) => void (location.hash = "", location.hash = link), link);
      await tab.seen(".notice", "the moment of the link");
      await tab.seen(".faults .list", "drop to-host");
      for (const { complaints } of [tab, other]) complaints.length = 0;
    });

    with_("a file that waits is not for a controller that is chosen meanwhile", async (site, opened) => {
      site.hold(LATER);
      const tab = await opened();
      await tab.drop("commands.txt", "@07\n@0V\n");
      await tab.seen(".link", "waits for the rest of this page");
      await tab.choose(".bench select.model", "imc4-m");
      site.letGo();
      await tab.seen(".tab .model", "imc4-m");
      await tab.seen(".notice", "commands.txt has been given up");
      await tab.send("@0P");
      await tab.seen(".entry-answer");
      assert.equal(await tab.look(() => document.querySelectorAll(".entry-command").length), 1);
      await tab.drop("commands.txt", "@07\n@0V\n");
      await tab.seen(".bench .note", "commands.txt has been carried out");
      // What has begun goes on where another controller cannot be had, and not at one that can.
      await tab.click(".clock button", "Pause");
      await tab.drop("commands.txt", "@07\n@0V\n");
      await tab.seen(".bench .note", "time is paused");
      await tab.look((link) => void (location.hash = link), linked("unknown", "mill", 0, []));
      await tab.seen(".notice", "Nothing has changed");
      await tab.click(".clock button", "Resume");
      await tab.seen(".bench .note", "commands.txt has been carried out");
    });

    with_("a rule is typed where faults are, and acts", async (_, opened) => {
      const tab = await opened();
      await tab.send("@07");
      await tab.write(".faults form input", "when x > 300: press stop");
      await tab.press("Enter");
      await tab.seen(".faults .list li", "when x > 300: press stop");
      await tab.send("@0A5000,2000,0,900,0,900,0,900");
      await tab.seen(".entry-answer", "stopped by STOP");
      await tab.seen(".faults .list li", "1 times acted");
      await tab.click(".faults .list button", "End");
      await until("it is gone", () => tab.look(() => document.querySelectorAll(".faults .list li").length === 0));
    });

    with_("a new edition is all of one piece, whatever caches say, and begins when the old one is closed", async (site, opened) => {
      // The first visit is one as any other.
      const tab = await opened();
      await tab.seen("footer", "works offline");
      assert.ok(!(await tab.text(".link")).includes("new edition"));
      const [old, service] = [await site.read("examples.json"), await site.read("service.js")];
      const fresh = JSON.stringify([...JSON.parse(old), { name: "new.txt", model: "", machine: "" }]);
      const digest = (text) => createHash("sha256").update(text).digest("hex");
      site.put("examples.json", fresh);
      // As the build would write it.
      const [edition] = service.match(/(?<=")[0-9a-f]{12}(?=")/);
      assert.ok(service.includes(digest(old)));
      site.put("service.js", service.replace(digest(old), digest(fresh)).replaceAll(edition, "0123456789ab"));
      await tab.look(async () => (await navigator.serviceWorker.getRegistration()).update());
      await until("it waits", () => tab.look(async () => (await navigator.serviceWorker.getRegistration()).waiting !== null));
      await tab.seen(".link", "a new edition begins when all tabs of this page are closed");
      assert.equal(await tab.look(async () => (await fetch("examples.json")).text()), old, "an open page goes on with its own files");
      const isNew = () => tab.look(() => [...document.querySelectorAll(".bench option")].some((option) => option.value === "new.txt"));
      assert.equal(await isNew(), false);
      const kept = await tab.look(async () => {
        const name = (await caches.keys()).find((name) => name.endsWith("0123456789ab"));
        return (await (await caches.open(name)).match("examples.json")).text();
      });
      assert.equal(kept, fresh);
      // A page that Firefox could go back to is still open for it.
      if (name === "firefox") return;
      await until("the new one is there", async () => {
        await tab.goto("about:blank");
        await tab.goto(`${site.url}/`);
        await tab.seen(".link", "runs in this page");
        return isNew();
      });
    });

    with_("a page of another edition than the one that is kept goes on without it, and says so", async (site, opened) => {
      const service = await site.read("service.js");
      const [edition] = service.match(/(?<=")[0-9a-f]{12}(?=")/);
      // It was put there while the page was being opened.
      site.put("service.js", service.replaceAll(edition, "0123456789ab"));
      const tab = await opened();
      await tab.seen(".link", "a new edition begins");
      assert.ok(!(await tab.text("footer")).includes("offline"));
      await tab.reload();
      await tab.seen("footer", "works offline");
      assert.ok(!(await tab.text(".link")).includes("new edition"));
    });

    with_("what comes in the place of the rest of this page is not kept", async (site, opened) => {
      const [page] = (await site.read("worker.js")).match(/page-[0-9A-F]{8}\.wasm/);
      site.put(page, "<!doctype html><title>Log in to this network</title>");
      const tab = await opened();
      await until("it has been fetched to be kept", () => site.told.paths.filter((path) => path === `/${page}`).length > 1);
      await until("that has come to an end", () => tab.look(async () => {
        const found = await navigator.serviceWorker.getRegistration();
        return !found || (!found.installing && (found.active?.state ?? "activated") === "activated");
      }));
      site.letGo();
      await tab.reload();
      await tab.seen(".link", "runs in this page");
      await tab.choose(".bench select.model", "smcu");
      await tab.seen(".tab .model", "smcu");
      tab.complaints.length = 0;
    });

    with_("the time line goes on while nothing happens", async (_, opened) => {
      const tab = await opened();
      await tab.send("@07");
      await tab.seen(".entry-answer", "0");
      const at = async () => Number(await tab.attribute(".timeline", "data-at"));
      const before = await at();
      await until("it shows the time that has passed", async () => (await at()) > before + 3e9);
    });

    with_("what a line means is said before it is sent", async (_, opened) => {
      const tab = await opened();
      await tab.send("@07");
      await tab.write(".log form input", "@0A500,900,0,900,0,900,0,900");
      await tab.seen(".meaning", "relative move X +500 steps at 900 Hz");
    });

    with_("a job is carried out, stepped back in, and gone on with", async (_, opened) => {
      const tab = await opened();
      await tab.choose(".clock select", "100x");
      await tab.drop("plate.ncp", await example("plate.ncp"));
      await tab.seen(".bench .note", "plate.ncp has been carried out");
      // Where `vimc4 ncp run --machine mill` says that it ends.
      const end = [9_840, 4_000, -500, 0];
      await until("it stands at the end of the job", async () => String(await tab.carriage()) === String(end));
      await until("its way is drawn", async () => Number(await tab.attribute(".stage", "data-corners")) > 50);
      // Nobody waits for the answer to one click before the next: each goes one entry further.
      await tab.look(() => {
        const previous = [...document.querySelectorAll(".timeline button")].find((button) => button.textContent === "Previous entry");
        for (let i = 0; i < 4; i++) previous.click();
      });
      await until("it stands elsewhere", async () => (await tab.carriage()).some((at, i) => at !== end[i]));
      await tab.seen(".timeline .when", "This is past");
      await tab.click(".timeline button", "Leave the past");
      await until("it is at its end again", async () => (await tab.carriage()).every((at, i) => at === end[i]));
    });

    with_("a link has the same moment in it", async (_, opened) => {
      const tab = await opened();
      await tab.choose(".bench select.model", "imc-s8");
      await tab.seen(".tab .model", "imc-s8");
      await tab.send("@07");
      const [start] = await tab.carriage();
      await tab.send("@0A3000,700,200,700,0,900,0,900");
      await until("it moves", async () => (await tab.carriage())[0] > start + 100);
      await tab.click('.knob[data-signal="stop"]');
      await tab.seen(".entry-answer", "stopped by STOP");
      await tab.click(".bench .share");
      await tab.seen(".notice", "link to this moment");
      const held = await tab.carriage();
      const talk = await tab.look(() => [...document.querySelectorAll(".entry-answer")].map((entry) => entry.textContent));
      const fragment = await tab.look(() => location.hash);
      assert.ok(fragment.length < 500, `${fragment.length} letters`);
      const other = await opened(fragment);
      await other.seen(".notice", "the moment of the link");
      await other.seen(".tab .model", "imc-s8");
      await until("it stands there", async () => String(await other.carriage()) === String(held));
      await until("the same was said", async () => String(await other.look(() => [...document.querySelectorAll(".entry-answer")].map((entry) => entry.textContent))) === String(talk));
      await other.click(".clock button", "Resume");
      await other.send("@0S");
      await until("it goes on", async () => (await other.carriage())[0] === start + 3_000);
      // A link that was cut is no reason to show nothing.
      const cut = await opened(fragment.slice(0, -9));
      await cut.seen(".notice", "not whole");
      await cut.seen(".log form input");
    });

    with_("a recording that is dropped can be gone through", async (_, opened) => {
      const tab = await opened();
      await tab.drop("limit.jsonl", await example("limit.jsonl"));
      await tab.seen(".notice", "A recording");
      await tab.seen(".entry-answer", "2");
      await tab.click(".timeline button", "Previous entry");
      await tab.seen(".timeline .when", "This is past");
      // Of one that was cut there is what was written, packed or not, and the page says so.
      const text = await example("limit.jsonl");
      const packed = gzipSync(text);
      for (const part of [text.slice(0, -60), packed.subarray(0, packed.length - 100)]) {
        await tab.drop("nothing.bin", "\0\0\0");
        await tab.seen(".notice", "no recording");
        await tab.drop("limit.jsonl", part);
        await tab.seen(".notice", "It was torn off");
        await tab.seen(".entry-answer", "2");
      }
      // One in two parts is read to its end, and a byte order mark is none of it.
      const [one, other] = [text.slice(0, 5_000), text.slice(5_000)].map((part) => gzipSync(part));
      for (const part of [Buffer.concat([one, other]), gzipSync(`\u{feff}${text}`), `\u{feff}${text}`]) {
        await tab.drop("nothing.bin", "\0\0\0");
        await tab.seen(".notice", "no recording");
        await tab.drop("limit.jsonl", part);
        await tab.seen(".notice", "A recording");
        assert.doesNotMatch(await tab.text(".notice"), /torn/);
        await tab.seen(".entry-answer", "2");
      }
      await tab.drop("nothing.bin", "\0\0\0");
      await tab.seen(".notice", "no recording");
      await tab.drop("limit.jsonl", Buffer.concat([one, other.subarray(0, -20)]));
      await tab.seen(".notice", "It was torn off");
      await tab.drop("plate.ncp.gz", gzipSync(await example("plate.ncp")).subarray(0, -20));
      await tab.seen(".notice", "plate.ncp.gz: It was torn off");
      await tab.drop("nothing.bin", "\0\0\0");
      await tab.seen(".notice", "no recording");
      // The page of a recording is opened as well, and the controller is there again after it.
      await tab.drop("limit.html", film);
      await tab.seen(".timeline .when", "A recording.");
      assert.equal(await tab.look(() => document.querySelector(".notice").checkVisibility()), false, "what was said of another file");
      await tab.click(".bench button", "Back to the controller");
      await tab.send("@0P");
      await tab.seen(".entry-answer", "0000000000000000000");
    });

    with_("where the past was left is marked in the conversation, in the language of the page", async (_, opened) => {
      const tab = await opened();
      await tab.choose(".clock select", "100x");
      await tab.send("@07");
      await tab.send("@0A3000,700,0,900,0,900,0,900");
      await until("it is there", () => tab.look(() => document.querySelectorAll(".entry-answer").length === 2));
      for (let i = 0; i < 2; i++) await tab.click(".timeline button", "Previous entry");
      await tab.seen(".timeline .when", "This is past");
      await tab.click(".timeline button", "Go on from here");
      await tab.seen(".entry-left .text", "The controller left this moment and goes on from another one");
      const others = () => tab.look(() => [...document.querySelectorAll(".entry")].map((row) => row.className).join());
      const before = await others();
      await tab.send("@0P");
      await until("what comes then stands behind it", async () => (await others()).startsWith(before) && (await others()) !== before);
      await tab.choose('header select[aria-label="Language"]', "de");
      await tab.seen(".entry-left .text", "Die Steuerung hat diesen Moment verlassen");
      assert.equal(await tab.attribute(".entry-left .text", "lang"), null);
    });

    with_("a recording of a line on which characters take their time is gone through, and saved", async (_, opened) => {
      const tab = await opened();
      // However its time was led: whoever goes on from it sees time pass.
      await tab.drop("paced.jsonl", (await paced()).replace(/"clock":"\w+"/, '"clock":"manual"'));
      await tab.seen(".notice", "A recording");
      await tab.seen(".entry-answer", "0000BB8");
      const at = () => tab.attribute(".timeline", "data-at");
      const end = await at();
      await tab.click(".timeline button", "Previous entry");
      await tab.seen(".timeline .when", "This is past");
      await until("it stands earlier", async () => Number(await at()) < Number(end));
      assert.equal(await tab.look(() => document.querySelector(".bench .share").disabled), true);
      await tab.click(".timeline button", "Next entry");
      await tab.seen(".timeline .when", "The present");
      await tab.send("@0P");
      await tab.seen(".notice", "what was sent is heard after Leave the past");
      await tab.click(".timeline button", "Leave the past");
      await tab.click(".clock button", "Resume");
      await until("it has answered", async () => (await tab.look(() => [...document.querySelectorAll(".entry-answer")].length)) === 4);
      // All of it, with what followed.
      const saved = await tab.look(() => new Promise((resolve) => {
        URL.createObjectURL = (blob) => (blob.text().then(resolve), "#");
        [...document.querySelectorAll(".bench button")].find((one) => one.textContent === "Save a recording").click();
      }));
      assert.match(saved, /"line":"paced"/);
      assert.match(await replayed(saved), /^equal: \d+ inputs and 40 bytes/m);
    });

    with_("a recording that is opened behind another has its own entries, from the first to the last", async (_, opened) => {
      // Whatever happens between two looks at the page.
      const tab = await opened("", () => {
        window.requestAnimationFrame = (show) => setTimeout(() => show(performance.now()), 500);
      });
      const text = await example("limit.jsonl");
      const [head, state] = text.split("\n");
      const none = `${[head, state, '{"at":0,"end":"it was saved"}'].join("\n")}\n`;
      const other = `${[head, state, '{"at":0,"in":"@07\\r","by":"a test"}', '{"at":0,"out":"0"}', '{"at":0,"end":"it was saved"}'].join("\n")}\n`;
      const count = '.log [role="status"]';
      const open = async (file, entries) => {
        await tab.drop("session.jsonl", file);
        await tab.seen(count, entries);
      };
      await open(text, "24 of 64 entries");
      // Only that it is paused at its end, and then something else at the same time under the same number.
      await open(none, "0 of 1 entries");
      await open(other, "2 of 3 entries");
      await open(none, "0 of 1 entries");
      await open(text, "24 of 64 entries");
      assert.equal(await tab.look(() => document.querySelectorAll(".entry").length), 24);
    });

    with_("what was said of one thing is not said of the next", async (_, opened) => {
      const tab = await opened();
      const isSilent = () => tab.look(() => !document.querySelector(".notice").checkVisibility());
      const wrong = async () => {
        await tab.drop("nothing.bin", "\0\0\0");
        await tab.seen(".notice", "no recording");
      };
      await wrong();
      await tab.drop("commands.txt", "@07\n");
      await tab.seen(".bench .note", "commands.txt has been carried out");
      assert.ok(await isSilent(), "a file that is carried out");
      await wrong();
      await tab.choose(".bench select.model", "imc-s8");
      await tab.seen(".tab .model", "imc-s8");
      assert.ok(await isSilent(), "another controller");
    });

    with_("a tour goes on when the controller has done what it asks for", async (_, opened) => {
      const tab = await opened();
      await tab.choose(".bench select.tours", "circles");
      await tab.seen(".tour h3", "Step 1 of");
      const next = () => tab.look(() => document.querySelector(".tour .next").disabled);
      assert.equal(await next(), true);
      await tab.send("@0P");
      await tab.seen(".entry-answer", "000000");
      assert.equal(await next(), true, "another command is not what was asked for");
      await tab.send("@03");
      await tab.seen(".tour .note", "done");
      await tab.click(".tour .next");
      await tab.seen(".tour h3", "Step 2 of");
      await tab.choose(".clock select", "100x");
      // A half circle is none.
      await tab.send("@0y1600,1000,-200,400,0,-1,1");
      await until("it is drawn", async () => (await tab.carriage())[0] === -800);
      assert.equal(await next(), true, "half a circle is no whole one");
      // Another controller cannot do it: the tour says which can, and brings it back.
      await tab.choose(".bench select.model", "imc4-m");
      await tab.seen(".tour .note", "This tour needs another controller and machine: imc4, bench");
      await tab.click(".tour .tour-back");
      await until("it is there again", () => tab.look(() => document.querySelector(".tour-back").hidden));
      assert.equal(await tab.text(".tour .note"), "");
      await tab.send("@03");
      await tab.click(".tour .suggested button");
      await tab.press("Enter");
      await tab.seen(".tour .note", "done");
    });

    with_("without a network it opens again, and answers", async (site, opened) => {
      const tab = await opened();
      await until("the page is kept", () => tab.look(async () => (await navigator.serviceWorker.ready).active?.state === "activated"));
      await site.end();
      await tab.reload();
      await tab.seen(".link", "runs in this page");
      await tab.send("@0V");
      await tab.seen(".entry-answer", "");
    });

    test("a real controller beside the virtual one: differences are marked, and the quirk is named", async () => {
      // It answers V in another order than the virtual one.
      const real = await serve("--http", "127.0.0.1:0", "--model", quirky, "--machine", "mill");
      const site = await host(bridge(real));
      const tab = await own.tab();
      const sent = async (line) => {
        await tab.write(".real form input", line);
        await tab.press("Enter");
        await tab.seen(".exchanges tbody th", line);
      };
      const verdict = () => tab.look(() => [...document.querySelectorAll(".exchanges tbody tr")].at(-1)?.dataset.verdict);
      try {
        await tab.before(bridge.page);
        await tab.goto(site.url);
        await tab.seen(".link", "runs in this page");
        await tab.click(".bench .real-one");
        assert.equal(await tab.look(() => [...document.querySelectorAll(".real button")].find((one) => one.textContent.startsWith("Connect")).disabled), true, "somebody is at the machine first");
        await tab.click('.real input[type="checkbox"]');
        await tab.click(".real button", "Connect");
        await tab.seen(".real button", "Disconnect");
        await sent("@07");
        // How fast this computer is decides about the time, not about the bytes.
        await until("both have answered", async () => ["same", "time"].includes(await verdict()));
        // So does what is typed where lines always are, but no file.
        await tab.send("@0P");
        await tab.seen(".exchanges tbody th", "@0P");
        await until("both have answered", async () => ["same", "time"].includes(await verdict()));
        await tab.drop("commands.txt", "@0V\n@0P\n");
        await tab.seen(".notice", "by the virtual controller alone");
        await tab.seen(".bench .note", "commands.txt has been carried out");
        assert.ok(["same", "time"].includes(await verdict()), "what a file was answered is not compared");
        assert.equal(await tab.look(() => document.querySelectorAll(".exchanges tbody tr").length), 2);
        await tab.click(".clock button", "Pause");
        await tab.drop("commands.txt", "@0V\n");
        await tab.seen(".bench .note", "time is paused");
        await sent("@0d900,900,900");
        await until("that is said", async () => (await verdict()) === "apart");
        await tab.click(".clock button", "Resume");
        await tab.seen(".bench .note", "commands.txt has been carried out");
        await real.order("fault delay 700ms to-host once");
        await sent("@0P");
        await until("it is late", async () => (await verdict()) === "time");
        await sent("@0V");
        await until("they part", async () => (await verdict()) === "bytes");
        await tab.seen(".exchanges .cause", "version_handshake = first");
        const saved = await tab.look(() => new Promise((resolve) => {
          URL.createObjectURL = (blob) => (blob.text().then(resolve), "#");
          [...document.querySelectorAll(".real button")].find((one) => one.textContent === "Save a recording").click();
        }));
        assert.match(saved, /^{"recording":1,.*"clock":"wall"/);
        assert.equal(await tab.look(() => window.openedWith), 19_200);
        assert.deepEqual(tab.complaints, []);
        // The program plays what the page has saved, and names the same quirk.
        assert.match(await replayed(saved), /quirk version_handshake = first would explain it/);
      } finally {
        await tab.close();
        await site.end();
        await real.end();
      }
    });
  });
}

test("a real line that never falls silent fills neither the page nor its memory", { skip: absent }, async () => {
  const site = await host();
  const own = await browser("chromium");
  try {
    const tab = await own.tab();
    await tab.before(() => {
      const noise = new Uint8Array(65_536).fill(85);
      let due;
      const port = {
        open: async () => {},
        close: async () => {},
        // Nothing comes any more once nobody reads it.
        readable: new ReadableStream({
          pull: (stream) => new Promise((soon) => void (due = setTimeout(() => (stream.enqueue(noise), soon())))),
          cancel: () => clearTimeout(due),
        }),
        writable: new WritableStream(),
      };
      Object.defineProperty(Navigator.prototype, "serial", { configurable: true, get: () => ({ requestPort: async () => port }) });
    });
    await tab.goto(site.url);
    await tab.seen(".link", "runs in this page");
    await tab.click(".bench .real-one");
    await tab.click('.real input[type="checkbox"]');
    await tab.click(".real button", "Connect");
    await tab.write(".real form input", "@0P");
    await tab.press("Enter");
    await tab.seen(".real .note", "More was said than the page keeps");
    assert.equal(await tab.look(() => document.querySelector(".exchanges td code").textContent.length), 4_096);
    await tab.click(".real button", "Disconnect");
    assert.deepEqual(tab.complaints, []);
  } finally {
    await own.end();
    await site.end();
  }
});

test("an error of a real line ends no conversation, and what was unplugged is opened again", { skip: absent }, async () => {
  const site = await host();
  const own = await browser("chromium");
  try {
    const tab = await own.tab();
    await tab.before(() => {
      // An error ends a stream, and there is another one, until the port is gone; what is open is not opened again.
      let [stream, isOpen] = [null, false];
      const next = () => {
        port.readable = new ReadableStream({ start: (it) => void (stream = it) });
      };
      const port = {
        readable: null, writable: new WritableStream(),
        open: async () => {
          if (isOpen) throw new DOMException("The port is already open.", "InvalidStateError");
          isOpen = true;
          next();
        },
        close: async () => void (isOpen = false),
      };
      window.wrong = () => {
        const broken = stream;
        next();
        broken.error(new DOMException("A framing error has been detected.", "FramingError"));
      };
      window.said = (text) => stream.enqueue(new TextEncoder().encode(text));
      window.unplug = () => {
        port.readable = null;
        stream.error(new DOMException("The device has been lost.", "NetworkError"));
      };
      Object.defineProperty(Navigator.prototype, "serial", { configurable: true, get: () => ({ requestPort: async () => port }) });
    });
    await tab.goto(site.url);
    await tab.seen(".link", "runs in this page");
    await tab.click(".bench .real-one");
    await tab.click('.real input[type="checkbox"]');
    await tab.click(".real button", "Connect");
    await tab.seen(".real button", "Disconnect");
    await tab.write(".real form input", "@0P");
    await tab.press("Enter");
    await tab.seen(".exchanges tbody th", "@0P");
    await tab.look(() => window.wrong());
    await tab.seen(".real .note", "Errors of the line: 1.");
    await tab.look(() => window.said("0"));
    await tab.seen(".exchanges td code", "0");
    await tab.look(() => window.unplug());
    await tab.seen(".real button", "Connect");
    await tab.seen(".notice", "The port is gone");
    assert.match(await tab.text(".real .note[role=status]"), /: 1\. /, "that it is gone is no error of the line");
    // What was said is lost only if a person says so.
    const asks = (answer) => new Promise((resolve) => tab.page.once("dialog", (dialog) => resolve(dialog[answer]().then(() => dialog.message()))));
    const [no] = [asks("dismiss"), await tab.click(".real button", "Connect")];
    assert.match(await no, /has not been saved/);
    await tab.seen(".exchanges tbody th", "@0P");
    const [yes] = [asks("accept"), await tab.click(".real button", "Connect")];
    await yes;
    await tab.seen(".real button", "Disconnect");
    assert.equal(await tab.look(() => document.querySelectorAll(".exchanges tbody tr").length), 0);
  } finally {
    await own.end();
    await site.end();
  }
});

test("STOP goes before what a port has not sent, and a port that takes nothing is told of loudly", { skip: absent }, async () => {
  const site = await host();
  const own = await browser("chromium");
  try {
    const tab = await own.tab();
    await tab.before(() => {
      // As Web Serial has it: what is told to give up throws away what it has not sent, and there is another stream then.
      const next = () => {
        port.writable = new WritableStream({
          write: (bytes, { signal }) => {
            if (!window.isStalled) return void window.sent.push(...bytes);
            return new Promise((resolve, reject) => {
              const give = (how) => (what) => (window.isStalled = window.isDeaf = false, how(what));
              window.release = give(resolve);
              if (!window.isDeaf) signal.addEventListener("abort", () => give(reject)(signal.reason));
            });
          },
          abort: next,
        });
      };
      let isOpen = false;
      const port = {
        open: async () => {
          if (isOpen) throw new DOMException("The port is already open.", "InvalidStateError");
          isOpen = true;
          port.readable = new ReadableStream({ start: (it) => void (window.said = (text) => it.enqueue(new TextEncoder().encode(text))) });
          next();
        },
        close: async () => {
          if (port.readable.locked || port.writable.locked) throw new TypeError("Cannot close a locked stream");
          isOpen = false;
        },
      };
      window.sent = [];
      Object.defineProperty(Navigator.prototype, "serial", { configurable: true, get: () => ({ requestPort: async () => port }) });
    });
    const stall = (isDeaf) => tab.look((isDeaf) => void ([window.isStalled, window.isDeaf] = [true, isDeaf]), isDeaf);
    const sent = () => tab.look(() => String.fromCharCode(...window.sent.splice(0)));
    const line = async (text) => {
      await tab.look(() => void (document.querySelector(".real form input").value = ""));
      await tab.write(".real form input", text);
      await tab.press("Enter");
      await tab.seen(".exchanges tbody th", text);
    };
    await tab.goto(site.url);
    await tab.seen(".link", "runs in this page");
    await tab.click(".bench .real-one");
    await tab.click('.real input[type="checkbox"]');
    await tab.click(".real button", "Connect");
    await line("@07");
    assert.equal(await sent(), "@07\r");
    await tab.look(() => window.said("0"));
    await stall(false);
    await line("@0A4000,500,0,900,0,900,0,900");
    await line("@0P");
    await tab.click(".real button", "Stop both");
    await until("STOP has gone out", async () => (await sent()) === "\u00fd");
    await tab.seen(".notice", "STOP went before");
    // Every line keeps what came of it: what was given up says so, and what STOP is answered is its own.
    const rows = () => tab.look(() => [...document.querySelectorAll(".exchanges tbody tr")].map((row) => [row.querySelector("th").textContent, row.dataset.verdict, row.cells[1].textContent]));
    await tab.look(() => window.said("F"));
    await until("the real one has answered STOP", () => tab.look(() => [...document.querySelectorAll(".exchanges tbody tr")].at(-1).cells[1].textContent.startsWith("F")));
    assert.deepEqual((await rows()).slice(1, 3), [["@0A4000,500,0,900,0,900,0,900", "cut", ""], ["@0P", "cut", ""]]);
    assert.equal((await rows())[3][0], "STOP (253)");
    // Another controller takes nothing away of that.
    const before = await rows();
    const virtual = () => tab.look(() => [...document.querySelectorAll(".exchanges tbody tr")].map((row) => row.cells[2].textContent));
    const said = await virtual();
    assert.deepEqual(said, [said[0], "", "", "no answer"], "what the real one never got whole the virtual one has not got either");
    assert.doesNotMatch(await tab.text(".log"), /@0A4000/);
    await tab.choose(".bench select.model", "imc4-m");
    await tab.seen(".tab .model", "imc4-m");
    await tab.send("@07");
    await tab.seen(".entry-answer", "0");
    await sent();
    const kept = ([name, , said]) => [name, said];
    assert.deepEqual((await rows()).slice(0, 4).map(kept), before.map(kept));
    assert.deepEqual((await virtual()).slice(0, 4), said);
    const saved = await tab.look(() => new Promise((resolve) => {
      URL.createObjectURL = (blob) => (blob.text().then(resolve), "#");
      [...document.querySelectorAll(".real button")].find((one) => one.textContent === "Save a recording").click();
    }));
    const given = saved.trim().split("\n").map((line) => JSON.parse(line)).filter((line) => "in" in line || "out" in line).map((line) => line.in ?? line.out);
    assert.deepEqual(given, ["@07\r", "0", "\u00fd", "F", "@07\r"], "what was given up was not sent");
    await line("@0V");
    assert.equal(await sent(), "@0V\r");
    // Whoever stands at a machine that goes on has to know.
    await stall(true);
    await line("@0Q");
    await tab.click(".real button", "Stop both");
    await tab.seen(".notice", "THE REAL MACHINE WAS NOT STOPPED");
    await tab.seen(".real .alarm", "THE REAL MACHINE WAS NOT STOPPED");
    assert.equal(await sent(), "");
    await tab.look(() => window.release());
    await tab.seen(".notice", "Only now");
    assert.equal(await sent(), "\u00fd");
    // What hangs hinders nobody to begin again.
    await stall(true);
    await line("@0W");
    await tab.click(".real button", "Disconnect");
    await tab.seen(".real button", "Connect");
    await tab.look(() => void (window.isStalled = false));
    // The page was built anew for the other controller.
    await tab.click('.real input[type="checkbox"]');
    tab.page.once("dialog", (dialog) => dialog.accept());
    await tab.click(".real button", "Connect");
    await tab.seen(".real button", "Disconnect");
    await line("@08");
    assert.equal(await sent(), "@08\r");
    assert.deepEqual(tab.complaints, []);
  } finally {
    await own.end();
    await site.end();
  }
});

/** A tab beside the port that is played in the page. */
async function beside(site, own) {
  const tab = await own.tab();
  await tab.before(played);
  await tab.goto(site.url);
  await tab.seen(".link", "runs in this page");
  await tab.click(".bench .real-one");
  await tab.click('.real input[type="checkbox"]');
  await tab.click(".real button", "Connect");
  await tab.seen(".real button", "Disconnect");
  const line = async (text) => {
    await tab.look(() => void (document.querySelector(".real form input").value = ""));
    await tab.write(".real form input", text);
    await tab.press("Enter");
    await until(`${text} is there`, async () => (await rows()).at(-1)?.[0] === text);
  };
  /** Line, verdict, and what both have said. */
  const rows = () => tab.look(() => [...document.querySelectorAll(".exchanges tbody tr")].map((row) =>
    [row.querySelector("th").textContent, row.dataset.verdict, ...[1, 2].map((cell) => row.cells[cell].querySelector("code")?.textContent ?? null), row.cells[3].textContent]));
  return { tab, line, rows };
}
/** How fast this computer is decides about the times. */
const isAlike = (verdict) => verdict === "same" || verdict === "time";

test("whose answer it is, where lines wait behind a motion, is known of both controllers", { skip: absent }, async () => {
  const site = await host();
  const own = await browser("chromium");
  try {
    const { tab, line, rows } = await beside(site, own);
    const version = "isel IMC4 (virtual)\r\nVersion 2.00\r\n4 axes, 19200 baud\r\n0";
    await tab.look((version) => {
      window.place = "0001518000000000000";
      window.real = (line) => line.startsWith("@0A") ? [line.startsWith("@0A9") ? 600_000 : 6_010, "0"] : [1, line === "@0P" ? window.place : line === "@0V" ? version : "0"];
    }, version);
    await line("@07");
    await until("both have answered", async () => isAlike((await rows())[0][1]));
    await line("@0A5400,900,0,900,0,900,0,900");
    await line("@0P");
    await until("both have answered", async () => (await rows()).every(([, verdict]) => isAlike(verdict)));
    assert.deepEqual((await rows()).slice(1).map(([, , ...said]) => said.slice(0, 2)), [["0", "0"], ["0001518000000000000", "0001518000000000000"]]);
    // The one that waited was sent before it had its turn.
    const waited = await tab.look(() => parseFloat([...document.querySelectorAll(".exchanges tbody tr")].at(-1).cells[2].querySelector(".note").textContent.replace(",", "")));
    assert.ok(waited > 500, String(waited));
    // Behind a motion that STOP ends another place has as many digits.
    await tab.look(() => void (window.place = "0000999000000000000"));
    await line("@0A9000,90,0,900,0,900,0,900");
    await line("@0P");
    await line("@0V");
    await tab.seen(".entry-command", "@0A9000");
    await tab.click(".real button", "Stop both");
    await until("both have answered", async () => (await rows()).length === 7 && isAlike((await rows())[5][1]));
    await until("STOP has none of its own", async () => (await rows())[6][1] === "silent");
    const [move, place, shown, stop] = (await rows()).slice(3);
    assert.deepEqual(move.slice(2, 4), ["F", "F"]);
    assert.deepEqual([place[1], place[2], place[3]?.length], ["bytes", "0000999000000000000", 19]);
    assert.equal(shown[2], shown[3]);
    assert.match(shown[2], /^isel IMC4/);
    assert.deepEqual(stop.slice(0, 4), ["STOP (253)", "silent", "", ""]);
    await line("@07");
    await until("it is settled", async () => isAlike((await rows()).at(-1)[1]) && (await rows())[6][1] === "silent");
    // Who puts the virtual one back while a line is under way has it do something else.
    await tab.look(() => void (window.real = () => [1, "0"]));
    await line("@0A9000,90,0,900,0,900,0,900");
    await until("the real one has answered", async () => (await rows()).at(-1)[2] === "0");
    await tab.click(".timeline button", "Previous entry");
    await tab.seen(".timeline .when", "This is past");
    await tab.click(".timeline button", "Go on from here");
    await until("that is said", async () => (await rows()).at(-1)[1] === "apart");
    // No byte stops a controller of LPKF.
    await tab.choose(".bench select.model", "smcu");
    await tab.seen(".real", "has no byte that stops a motion");
    assert.equal(await tab.look(() => [...document.querySelectorAll(".real button")].find((one) => one.textContent.startsWith("Stop both")).disabled), true);
    assert.deepEqual(tab.complaints, []);
  } finally {
    await own.end();
    await site.end();
  }
});

test("the table and the recording of a real controller measure from when a line had come whole", { skip: absent }, async () => {
  const site = await host();
  const own = await browser("chromium");
  try {
    const { tab, line, rows } = await beside(site, own);
    // What takes its time on its way; and what is answered before the port says that it is out.
    for (const [text, way, late] of [["@07", 300, 0], ["@03", 0, 300]]) {
      await tab.look(([way, late]) => {
        [window.way, window.late] = [way, late];
        window.real = () => [1, "0"];
      }, [way, late]);
      await line(text);
      await until("both have answered", async () => isAlike((await rows()).at(-1)[1]));
    }
    const told = await tab.look(() => [...document.querySelectorAll(".exchanges tbody tr")].map(({ cells }) => parseFloat(cells[1].querySelector(".note").textContent.replace(",", ""))));
    const saved = await tab.look(() => new Promise((resolve) => {
      URL.createObjectURL = (blob) => (blob.text().then(resolve), "#");
      [...document.querySelectorAll(".real button")].find((one) => one.textContent === "Save a recording").click();
    }));
    const passed = saved.split("\n").filter(Boolean).map((text) => JSON.parse(text)).filter((one) => one.in !== undefined || one.out !== undefined);
    assert.deepEqual(passed.map((one) => one.in ?? one.out), ["@07\r", "0", "@03\r", "0"]);
    for (const [i, after] of told.entries()) {
      const recorded = (passed[2 * i + 1].at - passed[2 * i].at) / 1e6;
      // It is shown in tenths, from ten on in whole ones.
      assert.ok(Math.abs(recorded - after) <= 0.51, `${recorded} ms in the recording, ${after} ms in the table`);
    }
    assert.deepEqual(tab.complaints, []);
  } finally {
    await own.end();
    await site.end();
  }
});

test("a port that is closed, or gone, leaves every line with what came of it", { skip: absent }, async () => {
  const site = await host();
  const own = await browser("chromium");
  try {
    const { tab, line, rows } = await beside(site, own);
    await line("@07");
    await until("both have answered", async () => isAlike((await rows())[0][1]));
    // No controller knows such a character.
    await tab.write(".real form input", "ä€");
    await tab.press("Enter");
    await tab.seen(".notice", "€ is not one byte");
    assert.equal((await rows()).length, 1);
    await tab.look(() => void (window.real = () => [600_000, ""]));
    await line("@0A9000,90,0,900,0,900,0,900");
    await tab.look(() => void (window.isHeld = true));
    await line("@0V");
    await line("@0W3");
    await tab.look(() => window.unplug());
    await tab.seen(".notice", "The port is gone");
    assert.doesNotMatch(await tab.text(".notice"), /Refused|STOP/);
    const verdicts = async () => (await rows()).slice(1).map(([, verdict]) => verdict);
    await until("each says so", async () => String(await verdicts()) === "closed,unsent,unsent");
    assert.doesNotMatch(await tab.text(".real"), /yet|rrors of the line/);
    assert.doesNotMatch(await tab.text(".log"), /@0W3/, "the virtual one has not got it either");
    // Whoever closes it learns the same, and what is saved is not asked about.
    await tab.look(() => new Promise((resolve) => {
      URL.createObjectURL = (blob) => (blob.text().then(resolve), "#");
      [...document.querySelectorAll(".real button")].find((one) => one.textContent === "Save a recording").click();
    }));
    await tab.click(".real button", "Connect");
    await tab.seen(".real button", "Disconnect");
    await line("@0P");
    await tab.click(".real button", "Disconnect");
    await until("it says so", async () => (await rows())[0][1] === "closed");
    assert.deepEqual(tab.complaints, []);
  } finally {
    await own.end();
    await site.end();
  }
});

test("axe finds nothing to complain of, whatever is open, in both languages, light, dark and small", { skip: absent }, async () => {
  const axe = await readFile(new URL("../node_modules/axe-core/axe.min.js", import.meta.url), "utf8");
  const site = await host();
  const own = await browser("chromium");
  try {
    for (const [locale, colorScheme, viewport] of [["en", "light", { width: 1600, height: 1200 }], ["de", "dark", { width: 390, height: 844 }]]) {
      const tab = await own.tab({ locale, colorScheme, viewport });
      await tab.before(bridge.page);
      await tab.goto(site.url);
      await tab.choose(".bench select.tours", "commands");
      await tab.seen(".tour h3", locale === "de" ? "Schritt 1 von 10" : "Step 1 of 10");
      await tab.click(".bench .real-one");
      await tab.send("@07");
      await tab.seen(".tour .note", locale === "de" ? "erledigt" : "done");
      assert.equal(await tab.look(() => document.documentElement.lang), locale);
      const { wide, high } = await tab.look(() => ({ wide: document.documentElement.scrollWidth, high: innerWidth }));
      assert.ok(wide <= high, `nothing stands beyond the edge: ${wide} of ${high}`);
      await tab.look(axe);
      const found = await tab.look(async () => (await window.axe.run()).violations.map(({ id, nodes }) => [id, nodes.map((node) => node.html)]));
      assert.deepEqual(found, [], `${locale} ${colorScheme}`);
      await tab.close();
    }
  } finally {
    await own.end();
    await site.end();
  }
});

test("by keyboard alone: a controller is chosen, a line is sent, a moment is shared", { skip: absent }, async () => {
  const site = await host();
  const own = await browser("chromium");
  try {
    const tab = await own.tab();
    await tab.goto(site.url);
    await tab.seen(".link", "runs in this page");
    const reach = async (selector) => {
      for (let i = 0; i < 60; i++) {
        await tab.press("Tab");
        if (await tab.look((selector) => document.activeElement?.matches(selector), selector)) return;
      }
      assert.fail(`${selector} is not reached`);
    };
    await reach(".bench select.model");
    await tab.press("i");
    await tab.seen(".tab .model", "imc4-m");
    await reach(".log form input");
    await tab.page.keyboard.type("@0V");
    await tab.press("Enter");
    await tab.seen(".entry-answer");
    await tab.look(() => document.querySelector(".bench select.model").focus());
    await reach(".bench .share");
    await tab.press("Enter");
    await tab.seen(".notice", "link to this moment");
  } finally {
    await own.end();
    await site.end();
  }
});
