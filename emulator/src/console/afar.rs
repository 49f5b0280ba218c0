//! The console of a controller that is served elsewhere: lines go there, and come back answered.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{self, ExitCode};
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use serde_json::{Value, json};
use vimc4_api::line_remedy;
use vimc4_debug::{Candidate, Completion, Directive, TABLE};

use super::cancel::Cancel;
use super::interrupts;
use super::script::{self, Console, Flow, Script};
use super::session::{Outcome, Own, Wrong, no_controller};
use super::shell::{PROMPT, Shell};
use crate::ctl::client::{Client, Trouble, part};
use crate::ctl::complete;
use crate::failure::Failure;
use crate::output;
use crate::text;

/// So long somebody who has pressed Tab waits.
const PATIENCE: Duration = Duration::from_secs(1);

/// Of each option by itself: that of a whole struct would stay for the options that follow.
const HEADING: &str = "A controller elsewhere";

#[derive(clap::Args)]
#[group(skip)]
pub(crate) struct Arguments {
    /// Debug a controller of the `vimc4 serve --http` that listens there, where time passes by itself:
    /// not with --time manual or --dap
    #[arg(help_heading = HEADING, long, value_name = "URL", conflicts_with_all = NOT_THERE, add = crate::completions::words(&["http://127.0.0.1:8080"]))]
    connect: Option<String>,
    /// The file with the token, where one is needed; by default the environment variable VIMC4_TOKEN
    #[arg(help_heading = HEADING, long, value_name = "FILE", requires = "connect", conflicts_with_all = NOT_THERE)]
    token: Option<PathBuf>,
    /// Which of several controllers, by its number from 1
    #[arg(help_heading = HEADING, long, value_name = "NUMBER", requires = "connect", conflicts_with_all = NOT_THERE, add = complete::controllers())]
    controller: Option<usize>,
}

/// What is said where the controller is started.
const NOT_THERE: [&str; 21] = [
    "what",
    "model",
    "machine",
    "screen",
    "keep_going",
    "for",
    "axes",
    "no_ref",
    "drilldef_unit",
    "lenient",
    "zero",
    "wpreg",
    "pty",
    "replace",
    "tcp",
    "serial",
    "time",
    "flash",
    "count",
    "tcp_clients",
    "fresh_clients",
];

impl Arguments {
    pub(crate) fn is_meant(&self) -> bool {
        self.connect.is_some()
    }
}

/// The debuggers of a server that are held, by the numbers of the controllers. The server lets the
/// controllers go on when this program ends, however it ends.
#[derive(Clone)]
struct Opened {
    client: Client,
    numbers: Arc<Mutex<BTreeMap<usize, Hold>>>,
}

struct Hold {
    is_closed: Arc<AtomicBool>,
    /// Somebody else had opened it, and keeps it.
    was_open: bool,
}

impl Opened {
    /// Holds one, if it is not held.
    fn hold(&self, number: usize) -> Result<(), Trouble> {
        let mut numbers = self.numbers.lock().unwrap_or_else(PoisonError::into_inner);
        if numbers.contains_key(&number) {
            return Ok(());
        }
        let by = format!("process {} (vimc4 console)", process::id());
        let history = self.client.get(&format!("/controllers/{number}/history"), &[])?;
        let path = format!("/controllers/{number}/debugger/hold");
        let mut answer = self.client.hold(&path, &json!({ "by": by }))?;
        let is_closed = Arc::new(AtomicBool::new(false));
        let was_open = history["open"] == true;
        numbers.insert(number, Hold { is_closed: Arc::clone(&is_closed), was_open });
        let wait = move || {
            let _ = io::copy(&mut answer, &mut io::sink());
            is_closed.store(true, Ordering::Release);
        };
        let thread = thread::Builder::new().name("hold".to_owned()).spawn(wait);
        thread.map_err(|error| Trouble::Other(format!("cannot start a thread: {error}")))?;
        Ok(())
    }

    /// Forgets one that somebody else has closed. Returns whether it was so.
    fn was_closed(&self, number: usize) -> bool {
        let mut numbers = self.numbers.lock().unwrap_or_else(PoisonError::into_inner);
        let is_closed =
            numbers.get(&number).is_some_and(|hold| hold.is_closed.load(Ordering::Acquire));
        if is_closed {
            numbers.remove(&number);
        }
        is_closed
    }

    /// The controllers go on.
    fn close(&self) {
        let mut numbers = self.numbers.lock().unwrap_or_else(PoisonError::into_inner);
        for (number, hold) in std::mem::take(&mut *numbers) {
            if !hold.was_open && !hold.is_closed.load(Ordering::Acquire) {
                // A server that has ended has nothing to close.
                let _ = self.client.delete(&format!("/controllers/{number}/debugger"));
            }
        }
    }
}

/// A console whose controller is elsewhere.
struct Afar {
    client: Client,
    cancel: Cancel,
    opened: Opened,
    /// Which controller is looked at.
    number: usize,
    /// The line that was carried out last.
    last: String,
}

impl Drop for Afar {
    fn drop(&mut self) {
        self.cancel.also(None);
        self.opened.close();
    }
}

pub(crate) fn run(arguments: &Arguments, file: Option<&Path>) -> Result<ExitCode, Failure> {
    let script = file.map(Script::read).transpose()?;
    let client = Client::at(arguments.connect.as_deref(), arguments.token.as_deref())?;
    let number = client.controller(arguments.controller)?;
    let opened = Opened { client: client.clone(), numbers: Arc::default() };
    let (cancel, left) = (Cancel::default(), opened.clone());
    interrupts::listen(&cancel, move || left.close());
    let mut afar = Afar { client, cancel, opened, number, last: String::new() };
    // Time stands still from here on.
    let view = afar.look()?;
    if let Some(code) = script::written_down(&mut afar, script.as_ref())? {
        return Ok(code);
    }
    output::print(&text::shown(&format!(
        "{} on {}. `help` lists the commands.\n",
        part(&view, "model"),
        part(&view, "machine")
    )))?;
    interactive(afar)
}

/// Somebody is at the terminal.
fn interactive(afar: Afar) -> Result<ExitCode, Failure> {
    let console = Rc::new(RefCell::new(afar));
    let mut shell = Shell::new(Rc::clone(&console))?;
    while let Some(line) = shell.line(PROMPT)? {
        let outcome = console.borrow_mut().carry_out(&line);
        match outcome {
            Ok(Outcome::Said(text)) if text.is_empty() => {}
            Ok(Outcome::Said(text)) => output::print(&format!("{text}\n"))?,
            Ok(Outcome::Source(file)) => {
                match script::called(&mut *console.borrow_mut(), &file, 0) {
                    Ok(Flow::GoesOn) => {}
                    Ok(Flow::Ends) => break,
                    Err(failure) => _ = failure.report(),
                }
            }
            Ok(Outcome::Quit) => break,
            Ok(Outcome::Screen | Outcome::Picture(..)) => {}
            Err(Wrong(wrong)) => output::print(&format!("error: {}\n", text::shown(&wrong)))?,
        }
    }
    Ok(ExitCode::SUCCESS)
}

impl Afar {
    fn path(&self, rest: &str) -> String {
        format!("/controllers/{}{rest}", self.number)
    }

    /// Opens the debugger, and returns what is seen.
    fn look(&mut self) -> Result<Value, Trouble> {
        self.opened.hold(self.number)?;
        let (client, path) = (self.client.clone(), self.path("/debugger/cancel"));
        // Whoever waits for an answer gets one.
        self.cancel.also(Some(Box::new(move || drop(client.post(&path, Value::Null)))));
        self.client.get(&self.path("/debugger/view"), &[])
    }

    /// Looks at another controller, which is paused for that. This one stays as it is.
    fn change_to(&mut self, number: &str) -> Result<Outcome, Wrong> {
        let wrong = |trouble: Trouble| Wrong(trouble.text());
        let count = self.client.get("/controllers", &[]).map_err(wrong)?;
        let count = count.as_array().map_or(0, Vec::len);
        let wanted = number.parse().ok().filter(|number| (1..=count).contains(number));
        let Some(wanted) = wanted else {
            return Err(no_controller(number, count));
        };
        if wanted == self.number {
            return Ok(Outcome::Said(String::new()));
        }
        let before = std::mem::replace(&mut self.number, wanted);
        if let Err(trouble) = self.look() {
            self.number = before;
            return Err(wrong(trouble));
        }
        self.carry_out_once("where")
    }
}

impl Console for Afar {
    fn carry_out(&mut self, line: &str) -> Result<Outcome, Wrong> {
        let line = match line.trim() {
            "" => self.last.clone(),
            line => line.to_owned(),
        };
        self.last.clone_from(&line);
        self.carry_out_once(&line)
    }

    fn carry_out_once(&mut self, line: &str) -> Result<Outcome, Wrong> {
        let line = line.trim();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        match (word, rest.trim()) {
            ("screen" | "picture", _) => {
                return Err(Wrong(format!(
                    "`{word}` needs the controller in this program; the panel of the server shows it"
                )));
            }
            ("source", "") => return Err(Wrong::new("how it is typed: source FILE")),
            ("source", file) => return Ok(Outcome::Source(file.to_owned())),
            ("controller", "") => return Ok(Outcome::Said(self.number.to_string())),
            ("controller", number) => return self.change_to(number),
            (word, "") if Directive::named(word).is_some_and(|known| known.name == "quit") => {
                return Ok(Outcome::Quit);
            }
            _ => {}
        }
        if self.opened.was_closed(self.number) {
            // By a server that has ended, perhaps.
            let there = self.client.get(&self.path("/history"), &[]);
            there.map_err(|trouble| Wrong(trouble.text()))?;
            return Err(Wrong::new(
                "somebody else has closed the debugger, and the controller has gone on; the next \
                 line pauses it again",
            ));
        }
        self.opened.hold(self.number).map_err(|trouble| Wrong(trouble.text()))?;
        let answer = self.client.post(&self.path("/debugger"), json!({ "line": line }));
        let answer = answer.map_err(|trouble| match trouble {
            // A console here says no remedy there, either.
            Trouble::Refused(problem) if part(&problem, "remedy") == line_remedy(line) => {
                Wrong::new(part(&problem, "detail"))
            }
            trouble => Wrong(trouble.text()),
        })?;
        Ok(Outcome::Said(part(&answer, "text").to_owned()))
    }

    /// The names of the table, and the orders that the server knows.
    fn complete(&self, line: &str, cursor: usize) -> Completion {
        let begun = line.get(..cursor).unwrap_or(line);
        let from = begun.rfind(char::is_whitespace).map_or(0, |at| at + 1);
        let mut candidates = Vec::new();
        let mut offer = |text: &str, about: &str| {
            let candidate = Candidate { text: text.to_owned(), about: about.to_owned() };
            let fits = text.starts_with(&begun[from..]) && text != &begun[from..];
            if fits && !candidates.contains(&candidate) {
                candidates.push(candidate);
            }
        };
        if from == 0 {
            TABLE.iter().for_each(|known| offer(known.name, known.about));
            Own::all(false).for_each(|own| offer(own.name, own.about));
        }
        let client = self.client.clone().hurried(PATIENCE);
        let ways = client.get(&self.path("/completions"), &[("line", begun)]).unwrap_or_default();
        for way in ways.as_array().into_iter().flatten() {
            offer(part(way, "line").get(from..).unwrap_or_default().trim_end(), part(way, "about"));
        }
        Completion { from, candidates }
    }
}
