//! The past of a controller, as it is asked for and answered.

use std::collections::BTreeMap;
use std::num::NonZeroU64;
use std::sync::Arc;

use serde_json::{Map, Value, json};
use vimc4_catalogue::Controller;
use vimc4_debug::{CANCELLED, DebugError, Debugger, Directive, Remedy, Wired};
use vimc4_device::{
    CommandNumber, Device, Event, Input, Names, Output, OwnedInput, SignalKind, Time, escape,
    show_nanos,
};
use vimc4_language::Order;
use vimc4_session::{Deed, LineEvent, Report, ReportKind, Sink};
use vimc4_timeline::recording::{Mismatch, MismatchKind};
use vimc4_timeline::{Branch, BranchId, History, Moment, Place, Progress};

use crate::feed::{Feed, Item};
use crate::fields::{NO_BYTES, bytes_of};
use crate::problem::{Kind, Problem};

/// The remedy of a line of the debugger whose refusal says none itself.
#[must_use]
pub fn line_remedy(line: &str) -> String {
    match Directive::named(line.split_whitespace().next().unwrap_or_default()) {
        Some(directive) => format!("the line `help {}` explains it", directive.name),
        None => "the line `help` lists all".to_owned(),
    }
}

/// Why a line of the debugger was refused.
#[must_use]
pub fn wrong_line(line: &str, why: &str) -> Problem {
    refused(why, &line_remedy(line))
}

/// Why a look at the past was refused.
#[must_use]
pub fn wrong_look(why: &str) -> Problem {
    let otherwise = "GET the history, which tells the moments and the branches that there are";
    let mut problem = refused(why, otherwise);
    if MISSING.iter().any(|missing| why.starts_with(missing)) {
        problem.kind = Kind::NoSuchThing;
    }
    problem
}

/// So begins every refusal of a branch, a command or an entry that is not there.
const MISSING: [&str; 4] = [
    "there is no branch",
    "there is no command",
    "no command with the number",
    "there is no entry",
];

/// What a request about the moment that is looked at is answered while no debugger is open.
#[must_use]
pub fn not_open() -> Problem {
    let remedy = "POST to history/go, which opens it; the journal has what happened";
    Problem::new(Kind::NotNow, "the debugger is not open", remedy)
}

/// Why the debugger has refused something, with this remedy if it says none itself. With a request that was
/// cancelled nothing was wrong: it is refused as a journey is that was given up.
fn refused(why: &str, otherwise: &str) -> Problem {
    match why {
        CANCELLED => Problem::new(Kind::NotNow, why, "ask again, and let it come to its end"),
        why => Problem::said(Kind::NotUnderstood, why, otherwise),
    }
}

/// So far ahead is worked out what would come of something that is done in the past.
const AHEAD: u64 = 60_000_000_000;

/// And no more than so many causes of it.
const CAUSES: usize = 200_000;

/// A moment to look at.
#[derive(Clone, Debug, PartialEq)]
pub enum Goal {
    /// Where the controller itself is.
    Now,
    /// The end of a branch.
    End(u64),
    /// A time, after everything that happened then: on this branch and the ones that it has left, or on
    /// the way that is looked at.
    At(Option<u64>, Time),
    /// When a command began.
    Command(u64),
    /// When an entry of the journal happened, where that was.
    Entry(Entry),
}

/// An entry of the journal, which may be of a branch that was left.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    number: u64,
    at: Time,
    /// How often the controller was put elsewhere since.
    left: usize,
    /// What the controller told next to it, by which its moment is known: news have none of their own.
    told: Option<Box<Report>>,
}

impl Entry {
    /// That of a number.
    ///
    /// # Errors
    ///
    /// If it is not kept.
    fn of(number: u64, feed: &Feed) -> Result<Entry, String> {
        let items = feed.after(0, usize::MAX).items;
        let place = items.iter().position(|item| item.number == number);
        let split = place.and_then(|place| items.split_at_checked(place));
        let (before, own, onwards) = split
            .and_then(|(before, onwards)| Some((before, onwards.first()?, onwards)))
            .ok_or_else(|| {
                format!("there is no entry {number}; the journal has those that are kept")
            })?;
        let leaves = |item: &&Arc<Item>| {
            matches!(item.report.news(), Some(LineEvent::Deed { deed: Deed::Restore, .. }))
        };
        let next = onwards.iter().take_while(|item| !leaves(item));
        let mut near = next.chain(before.iter().rev().take_while(|item| !leaves(item)));
        // A warning may be of the host, of which the controller knows nothing.
        let told = near.find(|item| {
            item.report.event().is_some_and(|event| !matches!(event, Event::Warning(_)))
        });
        Ok(Entry {
            number,
            at: own.report.at,
            left: onwards.iter().filter(leaves).count(),
            told: told.map(|item| Box::new(item.report.clone())),
        })
    }

    /// Where it happened: on the way that is looked at, if it did there, or else on the branch on which the
    /// controller itself was, which is at `live` now; `None` if that is not known any more.
    fn branch(&self, history: &mut History<Wired>, live: Place) -> Option<BranchId> {
        let mut places = std::iter::once(&live).chain(history.left().iter().rev());
        let branch = places.nth(self.left)?.branch;
        let heading = history.heading();
        let end = |of| history.branches().find(|own| own.id == of).map(|own| own.end);
        let way = way(history, Place { branch: heading, moment: end(heading)? });
        let place = self.told.as_ref().and_then(|told| tells(history, branch, told));
        let is_there = place.is_some_and(|place| {
            let is_on = |on: &Place| on.branch == place.branch && place.moment <= on.moment;
            way.iter().any(|on| is_on(on) && self.at <= on.moment.at)
        });
        Some(if is_there { heading } else { branch })
    }
}

/// Where on the way to the end of a branch the controller tells something.
fn tells(history: &mut History<Wired>, branch: BranchId, told: &Report) -> Option<Place> {
    let Branch { parted, first, .. } = history.branches().find(|own| own.id == branch)?;
    match told.at.as_nanos().checked_sub(1) {
        Some(before) if parted.is_some() || told.at > first.at => {
            history.go_to_end(branch);
            history.go_to_time(Time::from_nanos(before));
        }
        _ => _ = history.go_to(Place { branch, moment: first }),
    }
    let is_found = history.find_next(told.at, |_, _, outputs| {
        outputs.iter().filter_map(report).any(|own| own.at == told.at && own.what == told.what)
    });
    is_found.then(|| history.present())
}

/// The moment that a request names; `feed` has the entries of the journal.
///
/// # Errors
///
/// If that is none, or more than one, or there is no such entry.
pub fn goal(body: &Map<String, Value>, feed: &Feed) -> Result<Goal, Problem> {
    let number = |name: &str| body.get(name).and_then(Value::as_u64);
    if let Some((name, value)) = body.iter().find(|(name, _)| number(name).is_none()) {
        let detail = format!("`{name}` is not to be {value}");
        return Err(Problem::new(Kind::WrongRequest, detail, "send a number from 0 on"));
    }
    let several = ["at", "command", "entry"].into_iter().filter(|name| number(name).is_some());
    if several.count() > 1 {
        let detail = "a moment is named by one of at, command and entry";
        return Err(Problem::new(Kind::WrongRequest, detail, "send only one of them"));
    }
    if number("branch").is_some() && number("at").is_none() && body.len() > 1 {
        let (detail, remedy) = match number("entry") {
            Some(_) => ("an entry is looked for where it happened", "leave out the branch"),
            None => (
                "a command is looked for on the branch that is looked at",
                "leave out the branch if that is looked at; otherwise look at it before, by the branch alone",
            ),
        };
        return Err(Problem::new(Kind::WrongRequest, detail, remedy));
    }
    if let Some(command) = number("command") {
        return Ok(Goal::Command(command));
    }
    if let Some(wanted) = number("entry") {
        return Entry::of(wanted, feed).map(Goal::Entry).map_err(|why| wrong_look(&why));
    }
    Ok(match (number("branch"), number("at")) {
        (branch, Some(at)) => Goal::At(branch, Time::from_nanos(at)),
        (Some(branch), None) => Goal::End(branch),
        (None, None) => Goal::Now,
    })
}

/// Looks at where a command began.
///
/// # Errors
///
/// If it has not begun on the way of the present; for whoever has the journal at hand, and no lines.
pub fn look_at_command(
    debugger: &mut Debugger,
    number: u64,
    progress: &mut Progress<'_>,
) -> Result<(), String> {
    let number = NonZeroU64::new(number).map(CommandNumber);
    let number = number.ok_or("there is no command 0; the journal has their numbers")?;
    debugger.look_at_command(number, progress).map_err(|error| in_requests(&error))
}

/// Why the debugger has refused something, for those who send requests and no lines.
#[must_use]
pub fn in_requests(error: &DebugError) -> String {
    error.worded(|remedy| {
        let remedy = match remedy {
            Remedy::Help => "GET the orders, which lists them",
            Remedy::Numbers => "the journal has their numbers",
        };
        remedy.to_owned()
    })
}

/// The moment that a client sees, which it means: its branch and its time, as far as it says them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sight {
    branch: Option<u64>,
    at: Option<u64>,
}

impl Sight {
    /// As a request says it.
    #[must_use]
    pub fn of(body: &Map<String, Value>) -> Sight {
        let number = |name: &str| body.get(name).and_then(Value::as_u64);
        Sight { branch: number("branch"), at: number("at") }
    }

    /// Whether that is looked at, where this [history] is told.
    ///
    /// # Errors
    ///
    /// If something else is, and what.
    pub fn is_right(self, history: &Value) -> Result<(), Problem> {
        let is =
            |seen: Option<u64>, now: &Value| seen.is_none_or(|seen| now.as_u64() == Some(seen));
        let (branch, at) = (&history["branch"], &history["at"]);
        match is(self.branch, branch) && is(self.at, at) {
            true => Ok(()),
            false => Err(Problem::new(
                Kind::NotNow,
                format!("another moment is looked at by now: {at} ns on branch {branch}"),
                "look there, or GET the history, which tells it",
            )),
        }
    }
}

/// What a request wants done at a moment, as a line of the debugger: an order that does something to the controller
/// at once, or bytes.
///
/// # Errors
///
/// If it wants neither, or both, or that cannot be.
pub fn deed(body: &Map<String, Value>, names: &Names) -> Result<String, Problem> {
    let text = |name: &str| body.get(name).and_then(Value::as_str);
    match (text("order"), text("send")) {
        (Some(order), None) => ordered(order, names),
        (None, Some("")) => Err(Problem::new(
            Kind::NotUnderstood,
            NO_BYTES,
            "send some, such as {\"send\":\"@0P\\r\"}",
        )),
        (None, Some(send)) => Ok(format!("sendraw {}", escape(&bytes_of(send)?))),
        _ => {
            let detail = "what is to be done is an order, or bytes to send";
            Err(Problem::new(Kind::WrongRequest, detail, "send one of order and send"))
        }
    }
}

fn ordered(text: &str, names: &Names) -> Result<String, Problem> {
    match Order::read(text, names)? {
        Some(Order::Do(_) | Order::Rule(_) | Order::Reset | Order::Erase) => Ok(text.to_owned()),
        _ => Err(Problem::new(
            Kind::NotUnderstood,
            format!("`{text}` does nothing to the controller"),
            "order something such as `press stop`; go to another time for what comes later",
        )),
    }
}

/// A place as the API has it.
#[must_use]
pub fn moment(Place { branch, moment }: Place) -> Value {
    json!({ "branch": branch, "at": moment.at })
}

/// Where the emulation differs from the recording that it was opened on: on the way of the present, or
/// everywhere.
#[must_use]
pub fn differences(debugger: &Debugger, is_of_way: bool) -> Value {
    let way: Vec<&Mismatch> = match is_of_way {
        true => debugger.differences_on_way().collect(),
        false => Vec::new(),
    };
    let all = debugger.differences().iter();
    let list = all.filter(|own| !is_of_way || way.contains(&&own.mismatch)).map(|own| {
        let Mismatch { at, line, command, kind } = &own.mismatch;
        let [recorded, emulated] = own.mismatch.sides();
        let replies = match kind {
            MismatchKind::Reply { emulated, .. } => Some(!emulated.bytes.is_empty()),
            MismatchKind::State { .. } => None,
        };
        json!({
            "branch": own.branch,
            "at": at,
            "line": line,
            "command": command,
            "replies": replies,
            "recorded": recorded,
            "emulated": emulated,
            "text": own.mismatch.to_string(),
        })
    });
    list.collect()
}

/// The past, where the controller itself is `live`, and the moment that is looked at.
#[must_use]
pub fn history(debugger: &Debugger, live: Place) -> Value {
    let history = debugger.history();
    let branches = history.branches().map(|branch| {
        // What made it leave the other one was given at once, unless it was put there.
        let first = history.inputs(branch.id, 0).next();
        let first = first.filter(|first| branch.parted.is_some() && first.at == branch.first.at);
        json!({
            "id": branch.id,
            "name": branch.name,
            "why": first.map(|first| in_words(debugger.device(), debugger.names(), &first.input)),
            "parted": branch.parted.map(moment),
            "first": branch.first.at,
            "end": branch.end.at,
        })
    });
    let mut past = json!({
        "first": history.branches().next().map(|branch| branch.first.at),
        "at": history.now(),
        "branch": history.heading(),
        "now": moment(live),
        "branches": branches.collect::<Vec<_>>(),
    });
    if !debugger.differences().is_empty() {
        past["differences"] = differences(debugger, false);
    }
    past
}

/// What was done, for people.
#[must_use]
pub fn in_words(device: &Controller, names: &Names, input: &OwnedInput) -> String {
    match input.as_input() {
        Input::Bytes(bytes) => {
            let line = bytes.trim_ascii();
            format!("{}  {}", escape(line), device.explain(line)).trim().to_owned()
        }
        Input::Signal(id, value) => {
            let Some(signal) = names.signals().iter().find(|signal| signal.id == id) else {
                return String::new();
            };
            let name = &signal.name;
            match signal.kind {
                SignalKind::Button if value == 0 => format!("{name} released"),
                SignalKind::Button => format!("{name} pressed"),
                _ => format!("{name} {value}"),
            }
        }
        Input::Power(on) => format!("power {}", if on { "on" } else { "off" }),
        Input::Fault(_) => "a fault".to_owned(),
        Input::Rule(_) => "a scenario".to_owned(),
        Input::Wake => String::new(),
    }
}

/// The branch of a number.
///
/// # Errors
///
/// If there is none.
pub fn branch_of(debugger: &Debugger, number: u64) -> Result<BranchId, String> {
    let mut branches = debugger.history().branches();
    let found = branches.find(|branch| u64::from(branch.id.0) == number);
    found.map(|branch| branch.id).ok_or_else(|| {
        let count = debugger.history().branches().count();
        format!("there is no branch {number}; their numbers are 0 to {}", count - 1)
    })
}

/// Looks at the end of a branch, or at a time: after everything that happened then, on this branch or on
/// the way that is looked at.
///
/// # Errors
///
/// If there is no such branch, or it does not go so far.
pub fn look_at(
    debugger: &mut Debugger,
    branch: Option<u64>,
    at: Option<Time>,
) -> Result<(), String> {
    let (looked_at, heading) = (debugger.place(), debugger.history().heading());
    let branch = branch.map_or(Ok(heading), |branch| branch_of(debugger, branch))?;
    let history = debugger.history_mut();
    history.go_to_end(branch);
    let (end, Some(at)) = (history.now(), at) else {
        history.drain();
        return Ok(());
    };
    let first = history.branches().next().map_or(end, |trunk| trunk.first.at);
    if !(first..=end).contains(&at) {
        history.go_to_end(heading);
        history.go_back_to(looked_at);
        history.drain();
        let (end, first) = (end.as_nanos(), first.as_nanos());
        return Err(match at.as_nanos() < first {
            true => format!("the past begins at {first} ns; look at a moment from then on"),
            false => format!(
                "this branch ends at {end} ns; look at a moment up to then, or at another branch"
            ),
        });
    }
    let history = debugger.history_mut();
    history.go_to_time(at);
    history.drain();
    Ok(())
}

/// Looks at when an entry of the journal of the controller, which is at `live`, happened: on the way that is
/// looked at if it happened there, or else on the branch on which it did.
///
/// # Errors
///
/// If the past does not know it any more.
pub fn look_at_entry(debugger: &mut Debugger, live: Place, entry: &Entry) -> Result<(), String> {
    let (looked_at, heading) = (debugger.place(), debugger.history().heading());
    let history = debugger.history_mut();
    let branch = entry.branch(history, live);
    history.go_to_end(heading);
    history.go_back_to(looked_at);
    history.drain();
    let branch = branch.ok_or_else(|| {
        format!(
            "what led to the entry {} is not known any more; look at a time that the history has",
            entry.number
        )
    })?;
    look_at(debugger, Some(branch.0.into()), Some(entry.at))
}

/// What really happened stays as it is: something that is done at the end of it, where the controller
/// itself has left it, begins a branch.
pub fn part_from_what_happened(debugger: &mut Debugger, live: Place) {
    let looked_at = debugger.place();
    let history = debugger.history_mut();
    let is_behind = looked_at.branch != live.branch
        && way(history, live).iter().any(|on| on.branch == looked_at.branch);
    if is_behind && history.is_at_end() {
        let state = history.device().state();
        history.fork(format!("from {}", show_nanos(looked_at.moment.at.as_nanos())), state);
    }
}

/// The controller itself goes on from the present: on a branch of its own if something else follows there.
pub fn go_on_from_here(history: &mut History<Wired>) {
    if history.is_at_end() {
        // What was just given takes effect now.
        let now = history.now();
        history.run_to(now);
    } else {
        let (present, heading) = (history.present(), history.heading());
        let is_new = history.inputs(heading, present.moment.inputs).next().is_some()
            || heading != present.branch;
        if is_new {
            let name = format!("from {}", show_nanos(present.moment.at.as_nanos()));
            let state = history.device().state();
            history.fork(name, state);
        }
    }
    history.drain();
}

/// Where the controller itself is, in a sentence, if something else is looked at.
#[must_use]
pub fn elsewhere(debugger: &Debugger, live: Place) -> Option<String> {
    if debugger.place() == live {
        return None;
    }
    let place = shown(debugger, live);
    Some(format!(
        "this is only looked at: the controller itself stays at {place}; `take` takes it here"
    ))
}

/// The same where it has been taken to.
#[must_use]
pub fn taken(debugger: &Debugger, live: Place) -> String {
    format!("the controller is at {} now and goes on from there", shown(debugger, live))
}

/// A place for people.
fn shown(debugger: &Debugger, Place { branch, moment }: Place) -> String {
    let mut branches = debugger.history().branches();
    let name = branches.find(|own| own.id == branch).map(|own| own.name);
    format!("{} on {}", show_nanos(moment.at.as_nanos()), name.unwrap_or_default())
}

/// What is known of what comes after the present, worked out.
pub fn look_ahead(history: &mut History<Wired>, is_given_up: impl Fn() -> bool) {
    let heading = history.heading();
    history.at_end(heading, |history| {
        let end = history.now().after_nanos(AHEAD);
        for _ in 0..CAUSES {
            if is_given_up() || !history.find_next(end, |_, _, _| true) {
                break;
            }
        }
    });
}

/// Reports what happened on a branch, or on the one that is looked at, and how many reports before those
/// lead up to it.
///
/// # Errors
///
/// If there is no such branch.
pub fn happened(
    debugger: &mut Debugger,
    branch: Option<u64>,
    sink: &mut dyn Sink,
) -> Result<u64, String> {
    let heading = debugger.history().heading();
    let branch = branch.map_or(Ok(heading), |branch| branch_of(debugger, branch))?;
    let history = debugger.history_mut();
    let Some(found) = history.branches().find(|own| own.id == branch) else { return Ok(0) };
    let (first, end) = (found.first, Place { branch, moment: found.end });
    let place = history.present();
    history.go_to(Place { branch, moment: first });
    // A motion that was under way is told from its beginning.
    if history.device().running().is_some() {
        history.find_last(|device, _, _| device.running().is_none());
    }
    let (mut told, mut before) = (0, 0);
    while !has_come_to(history.present(), end)
        && history.find_next(Time::NEVER, |device, _, outputs| {
            for output in outputs {
                if let Some(report) = report(output) {
                    sink.report(&report, &|line| device.explain(line));
                    told += 1;
                }
            }
            true
        })
    {
        if history.present().branch != branch {
            before = told;
        }
    }
    history.go_to_end(heading);
    history.go_back_to(place);
    history.drain();
    Ok(before)
}

/// Whether all of a branch has happened up to a place.
#[must_use]
pub fn has_come_to(present: Place, end: Place) -> bool {
    let counts = |moment: Moment| (moment.inputs, moment.bytes, moment.causes);
    present.branch == end.branch && counts(present.moment) >= counts(end.moment)
}

/// What came out of a controller, as whoever watches it is told of it.
#[must_use]
pub fn report(output: &Output) -> Option<Report> {
    let Output::Event(stamp, event) = output else { return None };
    let what = ReportKind::Event { command: stamp.command, event: event.clone() };
    Some(Report { controller: "".into(), at: stamp.at, what })
}

/// The moments on the way to a place, the latest first: one of each branch.
#[must_use]
pub fn way<D: Device>(history: &History<D>, place: Place) -> Vec<Place> {
    let branches: Vec<_> = history.branches().collect();
    let mut way = vec![place];
    while let Some(last) = way.last()
        && let Some(branch) = branches.iter().find(|branch| branch.id == last.branch)
        && let Some(parted) = branch.parted
    {
        way.push(parted);
    }
    way
}

/// How far the controller itself has come on each branch. What it has sent there is with its clients.
#[derive(Clone, Debug, Default)]
pub struct Lived(BTreeMap<BranchId, Moment>);

impl Lived {
    /// A history of which everything has really happened.
    #[must_use]
    pub fn all<D: Device>(history: &History<D>) -> Lived {
        Lived(history.branches().map(|branch| (branch.id, branch.end)).collect())
    }

    /// The controller itself has come to a place.
    pub fn came_to<D: Device>(&mut self, history: &History<D>, place: Place) {
        for Place { branch, moment } in way(history, place) {
            let farthest = self.0.entry(branch).or_insert(moment);
            *farthest = moment.max(*farthest);
        }
    }

    /// Where the controller itself has been last on the way to a place.
    #[must_use]
    pub fn last_on_way<D: Device>(&self, history: &History<D>, place: Place) -> Place {
        let mut way = way(history, place).into_iter();
        way.find_map(|Place { branch, moment }| {
            let farthest = *self.0.get(&branch)?;
            Some(Place { branch, moment: moment.min(farthest) })
        })
        .unwrap_or(place)
    }
}

/// Whether a place is on the way to another.
#[must_use]
pub fn is_on_way<D: Device>(history: &History<D>, place: Place, to: Place) -> bool {
    way(history, to).iter().any(|on| on.branch == place.branch && place.moment <= on.moment)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_cancelled_was_not_wrong() {
        for problem in [wrong_line("why", CANCELLED), wrong_look(CANCELLED)] {
            assert_eq!(problem.status(), 409, "{problem:?}");
            assert!(problem.document()["remedy"].as_str().is_some_and(|it| it.contains("again")));
        }
        assert_eq!(wrong_line("whi", "there is no command `whi`").status(), 422);
        assert_eq!(wrong_look("there is no branch 5").status(), 404);
    }
}
