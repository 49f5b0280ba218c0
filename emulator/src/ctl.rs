//! `vimc4 ctl`: a client of the control API, with the orders of standard input.

pub(crate) mod client;
pub(crate) mod complete;
mod view;
mod watch;
mod words;

use std::io::{self, Write};
use std::path::PathBuf;

use serde_json::{Value, json};
use vimc4_device::{Time, escape, is_like, unescape};

use crate::failure::Failure;
use crate::output;
use crate::text;
use client::{Client, Trouble, part};
use watch::Wanted;
use words::WORDS;

#[derive(clap::Args)]
#[command(
    long_about = words::about(),
    after_long_help = "\
Examples:
  vimc4 ctl --url http://127.0.0.1:8080 view
  vimc4 ctl --url http://127.0.0.1:8080 press stop
  vimc4 ctl --url http://127.0.0.1:8080 'run until x > 2500'
  vimc4 ctl --url http://127.0.0.1:8080 watch --after 0 --kinds command,answer --count 2

Exit codes: 0 done, 1 the controller cannot do that, or not now, or the server has gone, 2 wrong usage, or
no server: nothing was done."
)]
pub(crate) struct Arguments {
    /// An order, or another word with what follows it
    #[arg(value_name = "ORDER", required = true, allow_negative_numbers = true, add = complete::orders())]
    words: Vec<String>,
    /// Where the API listens; by default the environment variable VIMC4_URL
    #[arg(long, value_name = "URL", add = crate::completions::words(&["http://127.0.0.1:8080"]))]
    url: Option<String>,
    /// The file with the token, where one is needed; by default the environment variable VIMC4_TOKEN
    #[arg(long, value_name = "FILE")]
    token: Option<PathBuf>,
    /// Which of several controllers, by its number from 1
    #[arg(long, value_name = "NUMBER", add = complete::controllers())]
    controller: Option<usize>,
    /// Print what the API answers, as a line of JSON; problems, too
    #[arg(long)]
    json: bool,
    /// `watch`: only entries of these kinds, which docs/api.md leads to
    #[arg(long, value_name = "KIND", value_delimiter = ',', add = complete::kinds())]
    kinds: Vec<String>,
    /// `watch`: begin behind the entry of this number, 0 for the oldest that is kept, and not now
    #[arg(long, value_name = "NUMBER")]
    after: Option<u64>,
    /// `watch`: end after so many entries
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u64).range(1..))]
    count: Option<u64>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Err(trouble) = carry_out(arguments) else { return Ok(()) };
    if arguments.json {
        output::print(&format!("{}\n", trouble.document()))?;
    }
    Err(words::typed(trouble).into())
}

fn carry_out(arguments: &Arguments) -> Result<(), Trouble> {
    let line = arguments.words.join(" ");
    let (word, rest) = line.trim().split_once(' ').unwrap_or((line.trim(), ""));
    let rest = rest.trim();
    if word != "watch"
        && (!arguments.kinds.is_empty() || arguments.after.is_some() || arguments.count.is_some())
    {
        let why = "--kinds, --after and --count are for `watch`; leave them out";
        return Err(Trouble::Other(why.to_owned()));
    }
    if word.is_empty() {
        let why = "no order is given; `vimc4 ctl help` lists those that there are";
        return Err(Trouble::Other(why.to_owned()));
    }
    let client = Client::at(arguments.url.as_deref(), arguments.token.as_deref())?;
    let known = WORDS.iter().find(|known| known.name == word);
    if let Some(known) = known
        && !rest.is_empty()
        && known.forms.iter().all(|(form, _)| form.is_empty())
    {
        return Err(Trouble::Other(format!(
            "`{rest}` means nothing behind `{word}`; leave it out"
        )));
    }
    if word == "send" && rest.is_empty() {
        let why =
            r"there is nothing to send; write it behind `send`, as in `vimc4 ctl send '@07\r'`";
        return Err(Trouble::Other(why.to_owned()));
    }
    if word == "help"
        && let Some(said) = words::help_on(rest)
    {
        return Ok(match arguments.json {
            true => output::print(&format!("{}\n", json!({ "text": said }))),
            false => output::print(&said),
        }?);
    }
    if word == "watch" {
        let (kinds, after, count) = (&arguments.kinds, arguments.after, arguments.count);
        let (controller, is_json) = (arguments.controller, arguments.json);
        return watch::watch(&client, &Wanted { controller, kinds, after, count, is_json });
    }
    let (document, said) = ask(&client, arguments.controller, word, rest, line.trim())?;
    if word == "send" && !ends_a_command(rest) {
        // Where standard error is closed there is nowhere else to say it.
        let _ = writeln!(
            io::stderr(),
            "note: `{}` has no end, so the controller waits for the rest; a command ends with \\r, as in \
             `vimc4 ctl send '@07\\r'`",
            text::shown_in_line(rest)
        );
    }
    Ok(match arguments.json {
        true => output::print(&format!("{document}\n")),
        false if said.is_empty() => Ok(()),
        false => output::print(&format!("{}\n", text::shown(&said))),
    }?)
}

/// Whether a text to send, as it is typed, ends a command or is a byte of its own, such as a stop.
fn ends_a_command(typed: &str) -> bool {
    let bytes = unescape(typed).unwrap_or_default();
    bytes.last().is_none_or(|last| matches!(last, b';') || !(b' '..0x7F).contains(last))
}

/// Asks, and returns what is answered and how that is told to people.
fn ask(
    client: &Client,
    controller: Option<usize>,
    word: &str,
    rest: &str,
    line: &str,
) -> Result<(Value, String), Trouble> {
    if word == "controllers" {
        let all = client.get("/controllers", &[])?;
        let lines = all.as_array().into_iter().flatten().map(listed);
        let said = lines.collect::<Vec<_>>().join("\n");
        return Ok((all, said));
    }
    let number = match (word, controller) {
        // All of them are told the same.
        ("help", None) => 1,
        _ => client
            .controller(controller)
            .map_err(|trouble| unknown(client, word).unwrap_or(trouble))?,
    };
    let path = |rest: &str| format!("/controllers/{number}{rest}");
    Ok(match (word, rest) {
        ("view", _) => {
            let view = client.get(&path("/view"), &[])?;
            let signals = client.get(&path("/signals"), &[])?;
            let said = view::told(&view, &signals);
            (view, said)
        }
        ("send", typed) => {
            if let Some(letter) = typed.chars().find(|letter| !letter.is_ascii()) {
                let bytes = escape(letter.encode_utf8(&mut [0; 4]).as_bytes());
                return Err(Trouble::Other(format!(
                    "`{letter}` is no byte; write the bytes that are meant, such as {bytes}"
                )));
            }
            let bytes = unescape(typed).map_err(|wrong| {
                Trouble::Other(format!(
                    "`{wrong}` stands for nothing; write \\r, \\n, \\t, \\\\ or \\xFD"
                ))
            })?;
            let send: String = bytes.into_iter().map(char::from).collect();
            (client.post(&path("/line"), json!({ "send": send }))?, String::new())
        }
        ("clock", "") => {
            let clock = client.get(&path("/clock"), &[])?;
            let said = clock_told(&clock);
            (clock, said)
        }
        ("clock", deed @ ("pause" | "resume" | "step")) => {
            let now = client.post(&path(&format!("/clock/{deed}")), Value::Null)?;
            let what = if deed == "step" { part(&now, "step") } else { "now" };
            let said = format!("{what} {}", time(&now["now"]));
            (now, said)
        }
        ("clock", speed) => {
            let clock = client.put(&path("/clock"), json!({ "clock": speed }))?;
            let said = clock_told(&clock);
            (clock, said)
        }
        _ => {
            let answer = client.post(&path("/orders"), json!({ "order": line }))?;
            let said = part(&answer, "text");
            let said = match line {
                "help" => format!("{}{said}", words::listed()),
                _ => said.to_owned(),
            };
            (answer, said)
        }
    })
}

/// That a word means nothing to any controller, if the server says so.
fn unknown(client: &Client, word: &str) -> Option<Trouble> {
    let get = |what| client.get(&format!("/controllers/1/{what}"), &[]).ok();
    let (verbs, signals) = (get("orders")?, get("signals")?);
    let verbs = verbs.as_array()?.iter().map(|verb| part(verb, "verb"));
    // A switch is an order by itself.
    let switches = signals.as_array()?.iter().filter(|signal| signal["positions"].is_array());
    let switches = switches.map(|switch| part(switch, "name"));
    let known: Vec<&str> =
        WORDS.iter().map(|known| known.name).chain(verbs).chain(switches).collect();
    if known.iter().any(|name| name.split(' ').next() == Some(word)) {
        return None;
    }
    let like: Vec<&str> = known.into_iter().filter(|name| is_like(word, name)).collect();
    let remedy = match like.as_slice() {
        [] => "`vimc4 ctl help` lists those that there are".to_owned(),
        like => format!("did you mean {}? `vimc4 ctl help` lists them", like.join(" or ")),
    };
    Some(Trouble::Other(format!("`{word}` is not an order; {remedy}")))
}

/// A controller, as one line.
fn listed(one: &Value) -> String {
    let places = ["pty", "tcp", "rfc2217", "serial"]
        .into_iter()
        .filter_map(|place| one[place].as_str().map(|there| format!(", {place} {there}")));
    let places: String = places.collect();
    format!("{}: {} on {}{places}", one["number"], part(one, "model"), part(one, "machine"))
}

/// A time of a document, in words.
fn time(nanoseconds: &Value) -> String {
    nanoseconds.as_u64().map_or_else(String::new, |at| Time::from_nanos(at).to_string())
}

fn clock_told(clock: &Value) -> String {
    let paused = match &clock["paused"] {
        Value::Null => String::new(),
        pause if pause["by"].is_null() => ", paused at a breakpoint".to_owned(),
        pause => format!(", paused by {}", part(pause, "by")),
    };
    format!("{}, clock {}{paused}", time(&clock["now"]), part(clock, "clock"))
}
