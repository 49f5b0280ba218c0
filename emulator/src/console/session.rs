//! A debugger and what it is opened on, as both faces of the console see it.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;

#[cfg(feature = "api")]
use vimc4::Control;
use vimc4::{Emulator, Report, Reports};
use vimc4_catalogue::{Details, Machine};
#[cfg(feature = "api")]
use vimc4_debug::Wired;
use vimc4_debug::{
    Answer, Candidate, Completion, DebugError, Debugger, Directive, Stop, Watched, uninterrupted,
};
use vimc4_device::{Device, View, show_nanos};
#[cfg(feature = "api")]
use vimc4_timeline::History;
use vimc4_timeline::Progress;

use super::cancel::Cancel;
use super::reading::{SearchProgress, Show};
use super::screen::{SaidKind, SaidLine};
use crate::live::{self, Live, Until};
use crate::recording::file::Share;
use crate::text::shown;

/// A command of the console's own, beside those of the debugger.
pub(crate) struct Own {
    pub(crate) name: &'static str,
    pub(crate) arguments: &'static str,
    pub(crate) about: &'static str,
    /// It needs the controller in the program that has the terminal.
    is_local: bool,
}

impl Own {
    /// Those that there are where the controller is in this program, or where it is not.
    pub(crate) fn all(is_local: bool) -> impl Iterator<Item = &'static Own> {
        OWN.iter().filter(move |own| is_local || !own.is_local)
    }
}

/// The console's own commands.
const OWN: &[Own] = &[
    Own {
        name: "screen",
        arguments: "",
        about: "fill the terminal with everything at once; `q` comes back",
        is_local: true,
    },
    Own {
        name: "picture",
        arguments: "FILE [WIDTHxHEIGHT]",
        about: "write that screen into a file, as SVG; by default 80x24 characters",
        is_local: true,
    },
    Own {
        name: "source",
        arguments: "FILE",
        about: "carry out the commands in a file",
        is_local: false,
    },
    Own {
        name: "take",
        arguments: "",
        about: "take the controller that runs to the moment that is looked at: from there it goes on",
        is_local: false,
    },
    Own {
        name: "controller",
        arguments: "[NUMBER]",
        about: "of several that run: pause this one and look at it; without a number, which one it is",
        is_local: false,
    },
];

/// What came of a line.
#[derive(Debug)]
pub(crate) enum Outcome {
    /// This is to be said; it may be nothing.
    Said(String),
    /// The full screen is wanted.
    Screen,
    /// The screen is to be written into this file, in so many columns and rows.
    Picture(String, (u16, u16)),
    /// The commands of a file are wanted.
    Source(String),
    /// The end is wanted.
    Quit,
}

/// Why a line was not carried out: a sentence without its point.
#[derive(Debug)]
pub(crate) struct Wrong(pub(crate) String);

impl Wrong {
    pub(crate) fn new(message: impl Into<String>) -> Wrong {
        Wrong(message.into())
    }
}

impl From<String> for Wrong {
    fn from(message: String) -> Wrong {
        Wrong(message)
    }
}

impl From<DebugError> for Wrong {
    fn from(error: DebugError) -> Wrong {
        Wrong(error.to_string())
    }
}

/// A debugger and what it is opened on.
pub(crate) struct Session {
    pub(crate) debugger: Debugger,
    pub(crate) machine: Arc<Machine>,
    pub(crate) cancel: Cancel,
    /// The controller behind ports that the debugger's history follows.
    pub(crate) live: Option<Live>,
    /// Its number, from 1, and the others that run beside it.
    number: usize,
    others: Vec<Option<Other>>,
    /// The line that was carried out last, which an empty one repeats.
    last: String,
    /// What was typed and answered last.
    pub(crate) said: VecDeque<SaidLine>,
    /// How much of a recording has been read.
    pub(crate) share: Option<Share>,
    /// Where it is shown how far a search has come.
    pub(crate) show: Option<Show>,
    /// The files that it was opened on, which no output may replace.
    pub(crate) inputs: Vec<PathBuf>,
}

/// So much of what was said is remembered.
const REMEMBERED: usize = 200;

/// A controller that is not looked at now.
enum Other {
    /// Nobody has looked at it yet: it runs.
    Runs(Box<Emulator>),
    /// It is as it was left.
    Left(Box<(Debugger, Live)>),
}

impl Session {
    pub(crate) fn new(debugger: Debugger, machine: Arc<Machine>, cancel: Cancel) -> Session {
        Session {
            debugger,
            machine,
            cancel,
            live: None,
            number: 1,
            others: Vec::new(),
            last: String::new(),
            said: VecDeque::new(),
            share: None,
            show: None,
            inputs: Vec::new(),
        }
    }

    /// One of controllers that run behind ports: the first of them is paused and looked at.
    pub(crate) fn live(
        emulators: Vec<Emulator>,
        machine: Arc<Machine>,
        cancel: Cancel,
    ) -> Result<Session, Wrong> {
        let mut emulators = emulators.into_iter();
        let first = emulators.next().ok_or_else(|| Wrong::new("there is no controller"))?;
        let (live, debugger) = Live::of(first, None)?;
        let others = std::iter::once(None);
        let others =
            others.chain(emulators.map(|emulator| Some(Other::Runs(Box::new(emulator))))).collect();
        let session = Session::new(debugger, machine, cancel);
        Ok(Session { live: Some(live), others, ..session })
    }

    /// A controller that runs for others, and goes on afterwards. `past` gives its history, if that is
    /// known.
    #[cfg(feature = "api")]
    pub(crate) fn beside(
        control: &Control,
        who: &str,
        cancel: Cancel,
        past: impl FnOnce(&Wired) -> Option<History<Wired>>,
    ) -> Result<Session, Wrong> {
        let (live, debugger) = Live::with(control, who, None, past)?;
        let session = Session::new(debugger, Arc::clone(control.machine()), cancel);
        Ok(Session { live: Some(live), ..session })
    }

    /// Whether its lines come by requests, about this controller and no other.
    fn is_served(&self) -> bool {
        self.live.is_some() && self.others.is_empty()
    }

    /// All controllers that run, to be ended.
    pub(crate) fn into_emulators(self) -> Vec<Emulator> {
        let others = self.others.into_iter().flatten().map(|other| match other {
            Other::Runs(emulator) => Some(*emulator),
            Other::Left(left) => left.1.into_emulator(),
        });
        others.chain([self.live.and_then(Live::into_emulator)]).flatten().collect()
    }

    /// Carries out a line. An empty one does the last one again, where somebody types; a comment
    /// does nothing.
    pub(crate) fn carry_out(&mut self, line: &str) -> Result<Outcome, Wrong> {
        let line = match line.trim() {
            "" => self.last.clone(),
            line => line.to_owned(),
        };
        self.last.clone_from(&line);
        self.carry_out_once(&line)
    }

    /// The same, where an empty line does nothing. What is answered is remembered for the screen.
    pub(crate) fn carry_out_once(&mut self, line: &str) -> Result<Outcome, Wrong> {
        let line = line.trim();
        let mut outcome = self.carry_out_unheard(line);
        if let Ok(Outcome::Said(said)) = &mut outcome
            && let Some(notice) = self.debugger.notice()
        {
            *said = if said.is_empty() { notice } else { format!("{notice}\n{said}") };
        }
        match &outcome {
            Ok(Outcome::Said(said)) if !line.is_empty() && !line.starts_with('#') => {
                self.say(line, SaidKind::Typed);
                self.say(said, SaidKind::Answer);
            }
            Err(Wrong(wrong)) => {
                self.say(line, SaidKind::Typed);
                self.say(wrong, SaidKind::Wrong);
            }
            Ok(_) => {}
        }
        outcome
    }

    /// Remembers what the screen shows of what was typed and answered.
    pub(crate) fn say(&mut self, text: &str, kind: SaidKind) {
        if !text.is_empty() {
            self.said.push_back(SaidLine { text: text.to_owned(), kind });
        }
        if self.said.len() > REMEMBERED {
            self.said.pop_front();
        }
    }

    fn carry_out_unheard(&mut self, line: &str) -> Result<Outcome, Wrong> {
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        if let Some(outcome) = self.carry_out_own(word, rest)? {
            return Ok(outcome);
        }
        self.cancel.forget();
        let known = Directive::named(word);
        let directive = known.map_or("", |directive| directive.name);
        if self.live.is_some() && directive == "continue" {
            let until = self.until_of(rest)?;
            return self.run(until).map(Outcome::Said);
        }
        let branches = self.debugger.history().branches().count();
        let Some(answer) = self.execute(line, known)? else {
            return Ok(Outcome::Said(self.cancelled()));
        };
        let has_parted = self.debugger.history().branches().count() > branches;
        match answer {
            Answer::Quit => Ok(Outcome::Quit),
            answer @ Answer::Help(_) => {
                let own: Vec<String> = Own::all(!self.is_served()).map(Own::listed).collect();
                let (table, end) = answer.to_string().rsplit_once("\n\n").map_or_else(
                    || (answer.to_string(), String::new()),
                    |(table, end)| (table.to_owned(), end.to_owned()),
                );
                Ok(Outcome::Said(format!("{table}\n{}\n\n{end}", own.join("\n"))))
            }
            answer => {
                let mut said = shown(&answer.to_string());
                if has_parted {
                    self.tell_of_elsewhere(&mut said);
                }
                if has_parted && directive != "what" {
                    self.tell_of_the_rest(&mut said);
                }
                Ok(Outcome::Said(said))
            }
        }
    }

    /// Carries out a command that only the console has.
    fn carry_out_own(&mut self, word: &str, rest: &str) -> Result<Option<Outcome>, Wrong> {
        if let Some(own) = OWN.iter().find(|own| own.name == word && own.arguments.is_empty())
            && !rest.is_empty()
        {
            return Err(Wrong(format!("nothing follows `{}`, and here does `{rest}`", own.name)));
        }
        let outcome = match (word, rest) {
            ("screen", "") => Outcome::Screen,
            ("source", "") => return Err(Wrong::new("how it is typed: source FILE")),
            ("source", file) => Outcome::Source(file.to_owned()),
            ("picture", rest) => picture(rest)?,
            ("help" | "h", name) => {
                let own = Own::all(!self.is_served()).find(|own| own.name == name);
                return Ok(own.map(|own| Outcome::Said(own.told())));
            }
            ("controller", _) if self.is_served() => {
                let remedy = "ask /v1/controllers/2/debugger for the second";
                return Err(Wrong(format!("the address says which controller it is; {remedy}")));
            }
            ("controller", "") => Outcome::Said(self.number.to_string()),
            ("controller", number) => self.change_to(number)?,
            ("take", "") => Outcome::Said(self.take()?),
            _ => return Ok(None),
        };
        Ok(Some(outcome))
    }

    /// Has the debugger carry out a line; nothing if somebody has cancelled it.
    fn execute(
        &mut self,
        line: &str,
        directive: Option<&Directive>,
    ) -> Result<Option<Answer>, Wrong> {
        let mut watched = self.watched_search();
        let progress = &mut |at| watched.goes_on(at);
        let Some(live) = &mut self.live else {
            return Ok(Some(self.debugger.execute(line, progress)?));
        };
        let goes_forward = directive.is_some_and(Directive::goes_forward);
        // What would come is looked at; what is done to the controller is done to it.
        let is_meant = directive.is_none_or(|directive| directive.name != "what");
        let execute =
            |debugger: &mut Debugger, progress: &mut Progress<'_>| debugger.execute(line, progress);
        match live.during(&mut self.debugger, goes_forward, is_meant, progress, execute)? {
            (answer, true) => Ok(Some(answer?)),
            (_, false) => Ok(None),
        }
    }

    /// Lets a search go on until somebody wants it to end, and shows meanwhile how far it has come.
    pub(crate) fn watched_search(&self) -> SearchProgress {
        SearchProgress::new(&self.cancel, self.show.clone(), self.share.clone())
    }

    /// Says what is sent of what follows in the file.
    fn tell_of_the_rest(&self, said: &mut String) {
        let Some(source) = self.debugger.source() else { return };
        let Some(feed) = self.debugger.feed() else { return };
        if feed.is_done(self.debugger.history()) {
            return;
        }
        if !said.is_empty() {
            said.push('\n');
        }
        let name = shown(&source.name);
        said.push_str(&format!("this is a branch: as you go on, the rest of {name} is sent on it"));
    }

    /// Says where the controller itself is, if that is not looked at.
    fn tell_of_elsewhere(&self, said: &mut String) {
        let Some(elsewhere) = self.live.as_ref().and_then(|live| live.elsewhere(&self.debugger))
        else {
            return;
        };
        if !said.is_empty() {
            said.push('\n');
        }
        said.push_str(&shown(&elsewhere));
    }

    /// Reads on in a recording until somebody wants something else. What cannot be read is told where
    /// one comes to it.
    pub(crate) fn read_on(&mut self, mut is_wanted: impl FnMut() -> bool) {
        let _ = self.debugger.read_on(usize::MAX, &mut |_| match is_wanted() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        });
    }

    /// What is to be known of a recording that has been read to its end; the screen shows it, too.
    pub(crate) fn notice(&mut self) -> Option<String> {
        let notice = self.debugger.notice()?;
        self.say(&notice, SaidKind::Answer);
        Some(notice)
    }

    // --- a controller that runs ---

    /// What its time does, in a word.
    pub(crate) fn clock(&self) -> &'static str {
        match &self.live {
            Some(live) if live.is_running() => "RUNS",
            Some(_) => "paused",
            None => "",
        }
    }

    pub(crate) fn is_running(&self) -> bool {
        self.live.as_ref().is_some_and(Live::is_running)
    }

    /// Whether a line lets a running controller go on, and for how long at most.
    pub(crate) fn goes_on(&self, line: &str) -> Option<Result<Until, Wrong>> {
        self.live.as_ref()?;
        let (word, rest) = line.trim().split_once(' ').unwrap_or((line.trim(), ""));
        let directive = Directive::named(word)?;
        (directive.name == "continue").then(|| self.until_of(rest.trim()))
    }

    fn until_of(&self, span: &str) -> Result<Until, Wrong> {
        if span.is_empty() {
            return Ok(Until::Paused);
        }
        let span = vimc4_debug::span(span).map_err(|error| Wrong(error.to_string()))?;
        Ok(Until::Time(self.debugger.now() + span))
    }

    /// Takes the controller itself to the moment that is looked at.
    fn take(&mut self) -> Result<String, Wrong> {
        let mut watched = self.watched_search();
        let Some(live) = &mut self.live else {
            return Err(Wrong::new("nothing runs here that could be taken anywhere"));
        };
        self.cancel.forget();
        Ok(shown(&live.take(&mut self.debugger, &mut |at| watched.goes_on(at))?))
    }

    /// Lets the controller run until a breakpoint pauses it, or Ctrl-C.
    fn run(&mut self, until: Until) -> Result<String, Wrong> {
        if let Some(said) = self.let_go(until)? {
            return Ok(said);
        }
        if !self.is_served()
            && until == Until::Paused
            && let Some(waits) = self.waits_for_a_host()
        {
            let _ = writeln!(io::stderr(), "{waits}");
        }
        loop {
            let reports = self.live.as_mut().and_then(Live::take_reports);
            let Some(mut reports) = reports else { return Err(Wrong::new("nothing runs here")) };
            let pause = loop {
                let Some(report) = reports.wait() else {
                    return Err(Wrong::new("the controller has ended"));
                };
                if live::is_pause(&report) {
                    break report;
                }
                live::follow(&mut self.debugger, &report);
            };
            if let Some(said) = self.paused(reports, &pause)? {
                return Ok(said);
            }
        }
    }

    /// What is to be known of a controller that was let go and that only a host can keep going.
    fn waits_for_a_host(&self) -> Option<String> {
        let at = self.debugger.rests_at()?;
        let ends = "Ctrl-C ends that; `continue 5s` waits so long at most";
        Some(match at == self.debugger.now() {
            true => {
                format!("nothing is under way: the controller waits for what a host sends; {ends}")
            }
            false => {
                let at = show_nanos(at.as_nanos());
                format!("it rests at {at}, and then waits for what a host sends; {ends}")
            }
        })
    }

    /// Goes through what is recorded to where the controller is, and lets that go on; does not wait for
    /// it. If one has stopped before, or looks at something that it is not a part of, nothing runs, and
    /// what there is to say is returned.
    pub(crate) fn let_go(&mut self, until: Until) -> Result<Option<String>, Wrong> {
        self.cancel.forget();
        let mut watched = self.watched_search();
        let Some(live) = &mut self.live else { return Err(Wrong::new("nothing runs here")) };
        let stop = live.let_go(&mut self.debugger, until, &mut |at| watched.goes_on(at))?;
        drop(watched);
        let Some(stop) = stop else {
            let control = live.control().clone();
            // Whoever waits for the pause hears of it.
            self.cancel.also(Some(Box::new(move || drop(control.pause()))));
            return Ok(None);
        };
        let leads_there = live.is_ahead(&self.debugger);
        let mut said = self.stopped(stop);
        if !leads_there {
            self.tell_of_elsewhere(&mut said);
        }
        Ok(Some(said))
    }

    /// What is said where somebody has had enough.
    fn cancelled(&mut self) -> String {
        let stop = live::cancelled(&mut self.debugger);
        self.stopped(stop)
    }

    /// What is said where one stops.
    fn stopped(&self, stop: Stop) -> String {
        let watched = self.debugger.watches().into_iter().map(|(expression, value)| Watched {
            expression: expression.to_string(),
            value: value.map_err(|error| error.to_string()),
        });
        shown(&Answer::Stopped(stop, watched.collect()).to_string())
    }

    /// The controller was paused: what there is to say, or nothing if it goes on.
    pub(crate) fn paused(
        &mut self,
        reports: Reports,
        pause: &Report,
    ) -> Result<Option<String>, Wrong> {
        let Some(live) = &mut self.live else { return Err(Wrong::new("nothing runs here")) };
        let progress = &mut uninterrupted;
        let stop = live.paused(&mut self.debugger, reports, pause, progress)?;
        let Some(stop) = stop else { return Ok(None) };
        self.cancel.also(None);
        Ok(Some(self.stopped(stop)))
    }

    /// Looks at another controller, which is paused for that. This one stays as it is.
    fn change_to(&mut self, number: &str) -> Result<Outcome, Wrong> {
        let count = self.others.len().max(1);
        let wanted = number.parse().ok().filter(|number| (1..=count).contains(number));
        let Some(wanted) = wanted else {
            return Err(no_controller(number, count));
        };
        if wanted == self.number {
            return Ok(Outcome::Said(String::new()));
        }
        let Some(other) = self.others.get_mut(wanted - 1).and_then(Option::take) else {
            return Err(Wrong(format!("controller {number} has ended")));
        };
        let (debugger, live) = match other {
            Other::Runs(emulator) => {
                let (live, debugger) = Live::of(*emulator, None)?;
                (debugger, live)
            }
            Other::Left(left) => *left,
        };
        let left = std::mem::replace(&mut self.debugger, debugger);
        if let Some(live) = self.live.replace(live) {
            self.others[self.number - 1] = Some(Other::Left(Box::new((left, live))));
        }
        self.number = wanted;
        self.carry_out_once("where")
    }

    // --- what is typed ---

    /// How a line can go on.
    pub(crate) fn complete(&self, line: &str, cursor: usize) -> Completion {
        let mut completion = self.debugger.complete(line, cursor);
        let begun = line.get(..cursor).unwrap_or(line);
        if completion.from == 0 {
            let own = Own::all(!self.is_served())
                .filter(|own| own.name.starts_with(begun) && own.name != begun);
            completion.candidates.extend(
                own.map(|own| Candidate { text: own.name.to_owned(), about: own.about.to_owned() }),
            );
        }
        completion
    }

    /// What is seen now.
    pub(crate) fn view(&self) -> View<Details> {
        if let Some(live) = self.live.as_ref().filter(|live| live.is_running())
            && let Ok(view) = live.control().view().wait()
        {
            return view;
        }
        self.debugger.device().view(self.debugger.now())
    }
}

/// Another controller is wanted than those that there are.
pub(crate) fn no_controller(number: &str, count: usize) -> Wrong {
    Wrong(match count {
        1 => format!("there is no controller {number}; there is only one"),
        count => format!("there is no controller {number}; there are 1 to {count}"),
    })
}

/// What can follow what is typed, to be shown behind it: the rest of the only word that it can
/// be, or the arguments.
pub(crate) fn hint(line: &str) -> Option<String> {
    let word = line.strip_suffix(' ')?;
    let own = OWN.iter().find(|own| own.name == word).map(|own| own.arguments);
    let arguments = own.or_else(|| Some(Directive::named(word)?.arguments))?;
    (!arguments.is_empty()).then(|| arguments.to_owned())
}

/// Which file the screen is to be written into, and in which size.
fn picture(rest: &str) -> Result<Outcome, Wrong> {
    let wrong =
        || Wrong::new("how it is typed: picture FILE [WIDTHxHEIGHT], as in picture now.svg 80x24");
    let (file, size) = rest.rsplit_once(' ').unwrap_or((rest, "80x24"));
    if file.is_empty() {
        return Err(wrong());
    }
    let (width, height) = size.split_once('x').ok_or_else(wrong)?;
    let number = |text: &str| text.parse().ok().filter(|number| (1..=1_000).contains(number));
    let size = (number(width).ok_or_else(wrong)?, number(height).ok_or_else(wrong)?);
    if size.0 < 60 || size.1 < 20 {
        return Err(Wrong::new("the screen needs 60x20 characters at least"));
    }
    Ok(Outcome::Picture(file.to_owned(), size))
}

impl Own {
    fn usage(&self) -> String {
        match self.arguments {
            "" => self.name.to_owned(),
            arguments => format!("{} {arguments}", self.name),
        }
    }

    fn listed(&self) -> String {
        format!("  {:<18} {}", self.name, self.about)
    }

    fn told(&self) -> String {
        format!("{}\n    {}.", self.usage(), self.about)
    }
}
