// The panel: the page that a server has, and that a recording is.
import { App } from "./app";
import { h } from "./dom";
import { read } from "./film";
import { show } from "./page";
import { askToken } from "./parts/shell";
import { Server } from "./server";
import { say } from "./words";

const app = new App(new Server());
app.askToken = askToken;
// Before the page is built, which takes the place of all that is in it.
const film = await read();
show(app, {
  foot: () => [
    h("a", { href: "/v1/docs" }, say("apiPage")), new Text(" · "), h("a", { href: "/licences.txt" }, say("licences")),
  ],
});
if (film) app.play(film);
else app.start();
