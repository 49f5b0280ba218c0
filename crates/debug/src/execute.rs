//! Carrying out a typed line.

use std::ops::ControlFlow;

use strsim::osa_distance;
use vimc4_catalogue::Controller;
use vimc4_device::{
    CommandNumber, Deed, Device, Faulting, Input, NotADuration, OwnedInput, Ruling, Time, escape,
    faults_in_words, parse_duration, rules_in_words, unescape,
};
use vimc4_language::{Order, Sort, Verb, help_on, read_condition};
use vimc4_session::BreakpointId;
use vimc4_session::Effect;
use vimc4_session::order::said;
use vimc4_timeline::Progress;

use crate::answer::{Answer, Watched, Where};
use crate::breakpoint::{Breakpoint, Hits, Note, Options};
use crate::debugger::Debugger;
use crate::expression::{begins_with_operator, in_braces};
use crate::field::is_axis;
use crate::table::{Directive, Group, TABLE};
use crate::walk::Walk;
use crate::why::About;
use crate::{
    DebugError, Depth, Expression, Field, Reason, Remedy, Replies, Stop, Unit, Way, WhatIf,
};

type Result<T = Answer, E = DebugError> = std::result::Result<T, E>;

/// What ends a command of every family: CR.
const END: &str = "\r";

/// Commands that mean nothing without arguments.
const NEED_ARGUMENTS: [&str; 11] = [
    "goto", "break", "delete", "enable", "disable", "unwatch", "trace", "assert", "mark", "unmark",
    "rename",
];

/// A line as typed, and its command.
struct Typed<'l> {
    line: &'l str,
    directive: &'static Directive,
    rest: &'l str,
}

impl Typed<'_> {
    /// Something is missing in it, or wrong.
    fn missing(&self) -> DebugError {
        let how = if self.rest.is_empty() { "finished" } else { "understood" };
        let (line, usage, example) = (self.line, self.directive.usage(), self.directive.example);
        DebugError::new(format!("`{line}` is not {how}; it is typed `{usage}`, as in `{example}`"))
    }
}

impl Debugger {
    /// Carries out a line as typed, or says the value of an expression. An empty line and one that begins
    /// with `#` do nothing.
    ///
    /// If its walk is cancelled, the [`Stop`] says so.
    ///
    /// # Errors
    ///
    /// What is wrong with the line, and what would be right. Nothing has happened then.
    pub fn execute(&mut self, line: &str, progress: &mut Progress<'_>) -> Result {
        let line = line.trim();
        self.obey(line, progress).or_else(|error| {
            // Text that is not a command may be an expression.
            self.shown(line).map(Answer::Value).map_err(|wrong| {
                match is_expression(self.device(), line) {
                    true => wrong,
                    false => error,
                }
            })
        })
    }

    /// Carries out a command.
    fn obey(&mut self, line: &str, progress: &mut Progress<'_>) -> Result {
        if line.is_empty() || line.starts_with('#') {
            return Ok(Answer::Done);
        }
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        // An axis may be called like the short form of a command, which takes no operator.
        if is_axis(self.device(), word) && begins_with_operator(rest) {
            return Ok(Answer::Value(self.shown(line)?));
        }
        let Some(directive) = Directive::named(word) else {
            return self.ordered(line, progress);
        };
        if directive.arguments.is_empty() && !rest.is_empty() {
            return Err(DebugError::new(format!(
                "nothing follows `{}`, and here does `{rest}`; leave that out",
                directive.name
            )));
        }
        let typed = Typed { line, directive, rest };
        if rest.is_empty() && NEED_ARGUMENTS.contains(&directive.name) {
            return Err(typed.missing());
        }
        match directive.group {
            Group::Going => self.travel(&typed, progress),
            Group::Breakpoints => self.manage_breakpoints(&typed, progress),
            Group::Looking => self.look_at(&typed),
            Group::Asking => self.inquire(&typed, progress),
            Group::Doing => self.do_to_controller(&typed),
            Group::History => self.manage_history(&typed),
            Group::Console => self.manage_console(&typed),
        }
    }

    fn travel(&mut self, typed: &Typed<'_>, progress: &mut Progress<'_>) -> Result {
        let (name, rest) = (typed.directive.name, typed.rest);
        let stop = match name {
            "step" => return self.stepped(rest, Way::Forward, progress),
            "back" => return self.stepped(rest, Way::Back, progress),
            "goto" => return self.goto(rest, progress),
            "over" | "out" => {
                let count = if rest.is_empty() { 1 } else { number(rest)? };
                let depth = if name == "over" { Depth::Over } else { Depth::Out };
                self.unit = Some(Unit::Line);
                self.step(Unit::Line, Way::Forward, depth, count, progress)
            }
            "continue" => {
                let until = match rest {
                    "" => None,
                    span => Some(self.now() + self::span(span)?),
                };
                self.go_while(Way::Forward, until, false, progress)
            }
            "reverse" => self.go(Way::Back, None, progress),
            "next" | "last" => {
                let condition = read_condition(rest, self.names());
                let condition = condition.map_err(|error| DebugError::new(error.to_string()))?;
                let way = if name == "next" { Way::Forward } else { Way::Back };
                self.seek(&condition, way, progress)
            }
            _ => return Err(unknown(name)),
        };
        self.told(stop)
    }

    fn manage_breakpoints(&mut self, typed: &Typed<'_>, progress: &mut Progress<'_>) -> Result {
        let rest = typed.rest;
        match typed.directive.name {
            "break" => {
                let (trigger, options) = self.read_breakpoint(rest)?;
                let id = self.add_breakpoint(trigger, options);
                let made = self.breakpoints().last().map(|made| made.describe(self.names()));
                Ok(Answer::Breakpoint(id, made.unwrap_or_default()))
            }
            "breakpoints" => {
                if !self.count_hits(|_| true, progress) {
                    return Err(DebugError::cancelled());
                }
                let names = self.names();
                let list = self.breakpoints().iter();
                let list = list.map(|breakpoint| (breakpoint.clone(), breakpoint.describe(names)));
                Ok(Answer::Breakpoints(list.collect()))
            }
            name @ ("delete" | "enable" | "disable") => self.change_breakpoint(name, rest),
            "trace" => self.trace(rest, progress),
            name => Err(unknown(name)),
        }
    }

    fn look_at(&mut self, typed: &Typed<'_>) -> Result {
        let rest = typed.rest;
        Ok(match typed.directive.name {
            "where" => self.whereabouts(),
            "print" => Answer::Value(self.shown(rest)?),
            "watch" => {
                if !rest.is_empty() {
                    self.watch(rest)?;
                }
                Answer::Watches(self.watched())
            }
            "unwatch" => match self.unwatch(usize::try_from(number(rest)?).unwrap_or(0)) {
                true => Answer::Watches(self.watched()),
                false => {
                    return Err(DebugError::new(format!(
                        "nothing is watched with the number {rest}; `watch` lists what is"
                    )));
                }
            },
            "list" => self.listed(rest)?,
            "frames" => Answer::Frames(self.frames()),
            "motion" => Answer::Motion(self.motion()),
            "timers" => Answer::Timers(self.device().view(self.now()).timers),
            "queue" => {
                let received = self.device().view(self.now()).received;
                Answer::Queue { used: received.used, size: received.size }
            }
            "flash" => Answer::Flash(self.device().flash_image()),
            "digest" => Answer::Digest(self.digest()),
            name => return Err(unknown(name)),
        })
    }

    fn inquire(&mut self, typed: &Typed<'_>, progress: &mut Progress<'_>) -> Result {
        let rest = typed.rest;
        match typed.directive.name {
            "why" => {
                let about = About::named(rest).ok_or_else(|| typed.missing())?;
                Ok(Answer::Why(self.why(about, progress)?))
            }
            "who" => {
                let field = rest.strip_prefix("changed ").unwrap_or(rest);
                if field.is_empty() {
                    return Err(typed.missing());
                }
                let field = Field::parse(field, self.device())?;
                Ok(Answer::Change(self.who_changed(&field, progress)?))
            }
            "what" => {
                let what = rest.strip_prefix("if ").ok_or_else(|| typed.missing())?;
                let what = self.read_what_if(what.trim())?;
                Ok(Answer::Parting(Box::new(self.what_if(&what, progress)?)))
            }
            "assert" => self.assert(rest),
            name => Err(unknown(name)),
        }
    }

    fn do_to_controller(&mut self, typed: &Typed<'_>) -> Result {
        match typed.directive.name {
            name @ ("send" | "sendraw") => {
                let end = if name == "send" { END } else { "" };
                let bytes = bytes_of(&(typed.rest.to_owned() + &escape(end.as_bytes())))?;
                self.give(Input::Bytes(&bytes));
                Ok(Answer::Done)
            }
            "put" => self.put(typed),
            name => Err(unknown(name)),
        }
    }

    /// `FIELD = VALUE`.
    fn put(&mut self, typed: &Typed<'_>) -> Result {
        let (field, value) = typed
            .rest
            .split_once('=')
            .ok_or_else(|| self.without_equals(typed.rest).unwrap_or_else(|| typed.missing()))?;
        let value = value.trim();
        // A word that is not a field is taken as text.
        let is_word = value.chars().all(|c| c.is_alphanumeric() || matches!(c, '-' | '_'));
        let value = match self.evaluate(value) {
            Err(_) if is_word => value.into(),
            value => value?,
        };
        let branches = self.history().branches().count();
        self.set_variable(field.trim(), value)?;
        match self.history().branches().count() > branches {
            true => Ok(Answer::Done),
            false => {
                let why = Some("it was so already");
                Ok(Answer::Text(said(&Effect::Nothing { why })))
            }
        }
    }

    fn manage_history(&mut self, typed: &Typed<'_>) -> Result {
        let rest = typed.rest;
        match typed.directive.name {
            "mark" => {
                self.free_name(rest, self.marks().contains_key(rest))?;
                self.mark(rest);
                Ok(Answer::Done)
            }
            "unmark" => match self.unmark(rest) {
                true => Ok(Answer::Done),
                false => Err(DebugError::new(format!(
                    "no moment is called `{rest}`; `marks` lists those that there are"
                ))),
            },
            "marks" => {
                let marks = self.marks().iter().map(|(name, mark)| (name.clone(), mark.place));
                Ok(Answer::Marks(marks.collect()))
            }
            "branches" => {
                let history = self.history();
                Ok(Answer::Branches(history.branches().collect(), history.present().branch))
            }
            "rename" => {
                let branch = self.place().branch;
                let own = self.history().branches().find(|own| own.id == branch);
                self.free_name(rest, own.is_some_and(|own| own.name == rest))?;
                self.history_mut().rename(branch, rest);
                Ok(Answer::Done)
            }
            "differences" => Ok(Answer::Differences(
                self.differences().iter().map(|own| own.mismatch.clone()).collect(),
                self.more_differences(),
            )),
            "replies" => {
                self.show_replies(match rest {
                    "recorded" => Replies::Recorded,
                    "emulated" => Replies::Emulated,
                    _ => return Err(typed.missing()),
                });
                Ok(Answer::Done)
            }
            "usage" => Ok(Answer::Usage(self.history().usage(), self.share_read())),
            name => Err(unknown(name)),
        }
    }

    fn manage_console(&mut self, typed: &Typed<'_>) -> Result {
        match (typed.directive.name, typed.rest) {
            ("quit", _) => Ok(Answer::Quit),
            ("help", "") => Ok(self.helped()),
            ("help", name) => match Directive::named(name) {
                Some(directive) => Ok(Answer::HelpOn(directive)),
                None => match Order::read(typed.line, self.names()) {
                    Ok(Some(Order::Help(Some(verb)))) => {
                        Ok(Answer::Text(help_on(verb, self.names())))
                    }
                    _ => Err(unknown(name)),
                },
            },
            (name, _) => Err(unknown(name)),
        }
    }

    /// What is probably meant by `put x 5`.
    fn without_equals(&self, rest: &str) -> Option<DebugError> {
        let (field, value) = rest.split_once(char::is_whitespace)?;
        Field::parse(field, self.device()).ok()?;
        let meant = format!("put {field} = {}", value.trim());
        Some(DebugError::new(format!("`put {rest}` has no `=`; `{meant}` is probably meant")))
    }

    // --- going ---

    /// `[COUNT] [UNIT|over|out]`.
    fn stepped(&mut self, text: &str, way: Way, progress: &mut Progress<'_>) -> Result {
        let (mut count, mut unit, mut depth) = (1, None, Depth::Into);
        for (place, word) in text.split_whitespace().enumerate() {
            if let (0, Ok(given)) = (place, word.parse()) {
                count = given;
                if count == 0 {
                    return Err(DebugError::new(
                        "the count of steps is from 1 on, and here it is 0",
                    ));
                }
            } else if place > 0 && is_number(word) {
                let before: Vec<&str> = text.split_whitespace().take(place).collect();
                let name = if way == Way::Forward { "step" } else { "back" };
                return Err(DebugError::new(format!(
                    "the count comes before the unit, as in `{name} {word} {}`",
                    before.join(" ")
                )));
            } else if is_number(word) {
                return Err(DebugError::new(format!(
                    "the count of steps is a number from 1 to {}, and not `{word}`",
                    u64::MAX
                )));
            } else if unit.is_some() {
                return Err(DebugError::new(format!(
                    "nothing follows the unit, and here does `{word}`"
                )));
            } else if let Some(named) = Unit::named(word) {
                unit = Some(named);
            } else if word == "over" || word == "out" {
                depth = if word == "over" { Depth::Over } else { Depth::Out };
                unit = Some(Unit::Line);
            } else if let Ok(span) = parse_duration(word) {
                unit = Some(Unit::Time(span));
            } else if parse_duration(word) == Err(NotADuration::TooLong) {
                span(word)?;
            } else {
                let names: Vec<&str> = Unit::NAMED.iter().map(|(name, ..)| *name).collect();
                return Err(DebugError::new(format!(
                    "`{word}` is not a unit; there are {}, over, out, and times such as 10ms",
                    names.join(", ")
                )));
            }
        }
        self.unit = unit.or(self.unit);
        let unit = self.usual_unit();
        let stop = self.step(unit, way, depth, count, progress);
        self.told(stop)
    }

    fn goto(&mut self, place: &str, progress: &mut Progress<'_>) -> Result {
        let wrong = || {
            DebugError::new(format!(
                "`{place}` is not a place; a time such as 1.5s, +10ms or -10ms is one, `command 12`, `line 7`, \
                 `difference 1`, `start`, `end`, and the name of a bookmark or branch: `marks` and `branches` list them"
            ))
        };
        let now = self.now();
        let (first, rest) = place.split_once(' ').unwrap_or((place, ""));
        let number = |text: &str| text.trim().parse().ok().and_then(std::num::NonZeroU64::new);
        let stop = match (first, rest) {
            ("start", "") => self.go_to(self.start())?,
            ("end", "") => self.go_to_end(progress),
            ("difference", "") => self.go_to_difference(1, progress)?,
            ("difference", text) => {
                let number = usize::try_from(number(text).ok_or_else(wrong)?.get());
                self.go_to_difference(number.unwrap_or(usize::MAX), progress)?
            }
            ("command", text) => {
                let number = CommandNumber(number(text).ok_or_else(wrong)?);
                self.go_to_command(number, progress)?
            }
            ("line", text) => {
                let line: u32 = text.trim().parse().map_err(|_| wrong())?;
                if line == 0 {
                    return Err(DebugError::new(crate::debugger::NO_LINE));
                }
                let source = self.source().ok_or_else(|| {
                    DebugError::new(format!("{NO_FILE}; `goto command 1` goes to one of them"))
                })?;
                let none = || DebugError::new(format!("no command comes from line {line}"));
                let sent = source.command_at(line);
                match (sent, self.line_that_does(line)) {
                    (Some((number, of)), Some(first)) if of == first => {
                        self.go_to_command(number, progress)?
                    }
                    (_, Some(asks)) => self.go_to_question(asks, progress)?,
                    (_, None) => return Err(none()),
                }
            }
            _ => {
                let is_known = |own: &Debugger| {
                    own.marks().contains_key(place) || own.end_of_branch(place).is_some()
                };
                let is_time = parse_duration(place.trim_start_matches(['+', '-'])).is_ok();
                if !is_time {
                    self.read_until(is_known, progress)?;
                }
                if let Some(mark) = self.marks().get(place).copied() {
                    self.go_to_mark(mark)?
                } else if let Some(end) = self.end_of_branch(place) {
                    self.history_mut().go_to_end(end.branch);
                    self.stopped(Reason::Gone, Vec::new())
                } else {
                    let span = parse_duration(place.strip_prefix(['+', '-']).unwrap_or(place));
                    let span = span.map_err(|_| wrong())?;
                    let nanos = u64::try_from(span.as_nanos()).unwrap_or(u64::MAX);
                    match place.as_bytes().first() {
                        Some(b'+') => self.go_to_time(now.after_nanos(nanos), progress),
                        Some(b'-') => {
                            let at = now.as_nanos().saturating_sub(nanos);
                            self.go_back_to_time(Time::from_nanos(at));
                            self.stopped(Reason::Gone, Vec::new())
                        }
                        _ => self.go_to_time(Time::from_nanos(nanos), progress),
                    }
                }
            }
        };
        self.told(stop)
    }

    /// A name must not read as another place.
    fn free_name(&self, name: &str, is_own: bool) -> Result<()> {
        let first = name.split_whitespace().next().unwrap_or_default();
        let is_time = parse_duration(name.trim_start_matches(['+', '-'])).is_ok();
        let is_place = is_time
            || matches!(name, "start" | "end")
            || matches!(first, "command" | "line")
            || name.starts_with(['+', '-']);
        if is_place {
            return Err(DebugError::new(format!(
                "`{name}` cannot be a name: `goto {name}` reads it as another place; take another name"
            )));
        }
        if !is_own && (self.marks().contains_key(name) || self.end_of_branch(name).is_some()) {
            return Err(DebugError::new(format!(
                "another place is called `{name}` already; `marks` and `branches` list the names that are taken"
            )));
        }
        Ok(())
    }

    fn told(&self, stop: Stop) -> Result {
        match stop.why {
            Reason::Broken(why) => Err(DebugError::new(why)),
            _ => Ok(Answer::Stopped(stop, self.watched())),
        }
    }

    fn watched(&self) -> Vec<Watched> {
        let watches = self.watches().into_iter();
        let watched = watches.map(|(expression, value)| Watched {
            expression: expression.to_string(),
            value: value.map_err(|error| error.to_string()),
        });
        watched.collect()
    }

    // --- breakpoints ---

    /// `WHAT [if EXPRESSION] [hit N|from N|every N] [log TEXT]`.
    fn read_breakpoint(&self, text: &str) -> Result<(crate::Trigger, Options)> {
        let mut options = Options::default();
        let mut text = text;
        if let Some((before, log)) = split_word(text, "log") {
            if log.is_empty() {
                return Err(DebugError::new("a text follows `log`, as in `log x is {x}`"));
            }
            for inside in in_braces(log) {
                Expression::parse(inside, self.device())?;
            }
            options.log = Some(log.to_owned());
            text = before;
        }
        for (word, hits) in
            [("hit", Hits::Only as fn(u64) -> Hits), ("from", Hits::From), ("every", Hits::Every)]
        {
            if let Some((before, count)) = split_word(text, word)
                && let Ok(count) = count.parse::<u64>()
            {
                if count == 0 {
                    return Err(DebugError::new(format!("a number from 1 on follows `{word}`")));
                }
                options.hits = hits(count);
                text = before;
            }
        }
        if let Some((before, condition)) = split_word(text, "if") {
            options.condition = Some(Expression::parse(condition, self.device())?);
            text = before;
        }
        Ok((self.read_trigger(text)?, options))
    }

    fn change_breakpoint(&mut self, what: &str, which: &str) -> Result {
        let ids: Vec<BreakpointId> = match which {
            "all" => self.breakpoints().iter().map(|breakpoint| breakpoint.id).collect(),
            number => vec![BreakpointId(self::number(number)?)],
        };
        for id in ids {
            let is_there = match what {
                "delete" => self.remove_breakpoint(id),
                what => self.enable_breakpoint(id, what == "enable"),
            };
            if !is_there {
                return Err(DebugError::new(format!(
                    "there is no breakpoint {id}; `breakpoints` lists those that there are"
                )));
            }
        }
        Ok(Answer::Done)
    }

    /// Every time that a condition held, on the way to the end.
    fn trace(&mut self, text: &str, progress: &mut Progress<'_>) -> Result {
        let (trigger, mut options) = self.read_breakpoint(text)?;
        if self.goes_on_reading() {
            self.read_until(|_| false, progress)?;
        }
        options.log.get_or_insert_with(|| "x {x} y {y}".to_owned());
        let hits = options.hits;
        let options = Options { hits: Hits::All, ..options };
        let mut breakpoint = [Breakpoint::new(BreakpointId::INTERNAL, trigger, options)];
        let (begin, heading) = (self.place(), self.history().heading());
        let known = self.known();
        let source = self.source().cloned();
        let end = self.history().branches().find(|branch| branch.id == heading);
        let end = end.map_or(self.now(), |branch| branch.end.at);
        let first = self.history().branches().next().map(|branch| branch.first.at);
        let history = self.history_mut();
        history.go_to_time(first.unwrap_or_default());
        // Events at the first instant come after its first moment.
        let moment = history.branches().next().map(|branch| branch.first).unwrap_or_default();
        let branch = vimc4_timeline::BranchId(0);
        history.go_back_to(vimc4_timeline::Place { branch, moment });
        let mut walk = Walk::new(Way::Forward).heeding(&mut breakpoint, source.as_ref());
        let found = history.seek_next(end, &mut walk, progress);
        let mut notes: Vec<Note> = std::mem::take(&mut walk.notes);
        let more = walk.left_out > 0;
        history.go_to_end(heading);
        let [breakpoint] = breakpoint;
        notes.extend(self.questions_noted(&breakpoint));
        notes.sort_by_key(|note| note.at);
        let mut times = 1..;
        notes.retain(|_| times.next().is_some_and(|time| hits.allow(time)));
        self.history_mut().go_back_to(begin);
        self.forget_beyond(known);
        self.history_mut().drain();
        match found {
            vimc4_timeline::Found::GivenUp => Err(DebugError::cancelled()),
            _ => Ok(Answer::Notes(notes, more)),
        }
    }

    // --- looking ---

    fn whereabouts(&mut self) -> Answer {
        let command = self.executing();
        let place = self.place();
        let branch = self.history().branches().find(|branch| branch.id == place.branch);
        let view = self.device().view(self.now());
        Answer::Where(Box::new(Where {
            place,
            branch: branch.map_or_else(String::new, |branch| branch.name),
            at: self.now(),
            is_end: self.history().is_at_end() && !self.goes_on_reading(),
            activity: view.activity,
            waits_for: view.waits_for,
            line: self.file_line(command.as_ref()),
            held: self.waits(),
            command,
            axes: view.axes,
        }))
    }

    fn shown(&self, text: &str) -> Result<crate::Variable> {
        if let Ok(variable) = self.variable(text) {
            return Ok(variable);
        }
        let value = self.evaluate(text)?;
        Ok(crate::Variable { name: text.to_owned(), path: text.to_owned(), value })
    }

    fn listed(&mut self, of: &str) -> Result {
        let listing = match of {
            "file" => self.file().ok_or_else(|| {
                DebugError::new(format!("{NO_FILE}; `list commands` shows them as they came"))
            })?,
            "program" => self.marked_program().ok_or_else(|| {
                DebugError::new(
                    "no program is stored; `list commands` shows what came over the line",
                )
            })?,
            "commands" => self.commands(),
            "" => match self.file() {
                Some(file) => file,
                None => {
                    let commands = self.commands();
                    let shows_program = self.is_in_program() || commands.lines.is_empty();
                    self.marked_program().filter(|_| shows_program).unwrap_or(commands)
                }
            },
            other => {
                return Err(DebugError::new(format!(
                    "`{other}` cannot be listed; file, program and commands can"
                )));
            }
        };
        Ok(Answer::Listing(around(listing)))
    }

    /// The stored program with a marker at the line that was begun last, if it runs.
    fn marked_program(&mut self) -> Option<crate::Listing> {
        let mut listing = self.program()?;
        if self.is_in_program() {
            let begun = self.line_begun().map(u64::from);
            listing.lines.iter_mut().for_each(|line| line.is_present = begun == Some(line.number));
        }
        Some(listing)
    }

    fn is_in_program(&self) -> bool {
        self.device().details().program().is_some_and(|program| program.marker.is_some())
    }

    // --- asking ---

    fn assert(&mut self, text: &str) -> Result {
        let (is_so, what) = match read_condition(text, self.names()) {
            Ok(condition) => {
                let device = self.device();
                let is_so = device.crossing(&condition) == Some(self.now());
                if condition.has_happenings() {
                    return Err(DebugError::new(format!(
                        "`{text}` happens and is not so afterwards; `last {text}` finds it"
                    )));
                }
                (is_so, self.values_of(&condition))
            }
            Err(error) => match Expression::parse(text, self.device()) {
                Ok(expression) if expression.is_claim() => {
                    (expression.is_so(self.device(), self.now()), String::new())
                }
                Ok(_) => return Err(DebugError::new(error.to_string())),
                Err(other) => {
                    let is_field = text.contains('.');
                    let error = if is_field { other } else { DebugError::new(error.to_string()) };
                    return Err(error);
                }
            },
        };
        if is_so {
            return Ok(Answer::Done);
        }
        let at = crate::stop::time(self.now());
        Err(DebugError::failed(format!("`{text}` is not so at {at}{what}")))
    }

    /// The positions of the axes that a condition is about.
    fn values_of(&self, condition: &vimc4_device::Condition) -> String {
        use vimc4_device::Condition as C;
        let mut axes = Vec::new();
        let mut parts = vec![condition];
        while let Some(part) = parts.pop() {
            match part {
                C::AxisAt { axis, .. } | C::AxisBelow { axis, .. } | C::AxisAbove { axis, .. } => {
                    axes.push(*axis);
                }
                C::All(more) | C::Any(more) => parts.extend(more),
                _ => {}
            }
        }
        axes.sort_unstable();
        axes.dedup();
        let view = self.device().view(self.now());
        let texts = view.axes.iter().filter(|axis| axes.contains(&axis.index));
        let texts = texts.map(|axis| format!("{} is {}", axis.name.to_lowercase(), axis.position));
        let texts: Vec<String> = texts.collect();
        if texts.is_empty() { String::new() } else { format!(": {}", texts.join(", ")) }
    }

    /// `quirk NAME = VALUE`, `model NAME`, `machine NAME`, `send TEXT`, or a signal and a value.
    fn read_what_if(&self, text: &str) -> Result<WhatIf> {
        let (word, rest) = text.split_once(' ').unwrap_or((text, ""));
        let rest = rest.trim();
        let unknown = |error: vimc4_catalogue::Unknown| DebugError::new(error.to_string());
        Ok(match word {
            "quirk" => {
                let (name, value) = rest.split_once('=').ok_or_else(|| {
                    DebugError::new("a quirk and its value follow, as in `quirk NAME = VALUE`")
                })?;
                WhatIf::Quirk(name.trim().to_owned(), value.trim().to_owned())
            }
            "model" => WhatIf::Model(vimc4_catalogue::model(rest).map_err(unknown)?),
            "machine" => WhatIf::Machine(vimc4_catalogue::machine(rest).map_err(unknown)?),
            "send" => {
                let bytes = bytes_of(&(rest.to_owned() + &escape(END.as_bytes())))?;
                WhatIf::Inputs(vec![OwnedInput::from(Input::Bytes(&bytes))])
            }
            _ => match Order::read(text, self.names()) {
                Ok(Some(Order::Do(deed))) => WhatIf::Inputs(self.inputs_of(&deed)?),
                Ok(_) => {
                    return Err(DebugError::new(format!(
                        "`{text}` is nothing that could be otherwise: a quirk, a model, a machine, \
                         `send`, or something done at the panel"
                    )));
                }
                Err(error) => return Err(DebugError::new(error.to_string())),
            },
        })
    }

    // --- orders of the panel ---

    /// A line whose command is not in the table: orders of the panel and of time.
    fn ordered(&mut self, line: &str, progress: &mut Progress<'_>) -> Result {
        let order = match Order::read(line, self.names()) {
            Ok(order) => order,
            Err(error) => {
                let word = line.split_whitespace().next().unwrap_or_default();
                let is_known = Verb::all().any(|verb| verb.name().split(' ').next() == Some(word))
                    || self.names().signals().iter().any(|signal| signal.name == word);
                let wrong =
                    if is_known { DebugError::new(error.to_string()) } else { unknown(word) };
                return Err(wrong);
            }
        };
        match order {
            Some(Order::Do(deed)) => {
                let inputs = self.inputs_of(&deed)?;
                Ok(self.done(&inputs))
            }
            Some(Order::Advance(span)) => {
                let until = self.now() + span;
                let stop = self.go(Way::Forward, Some(until), progress);
                self.told(stop)
            }
            Some(Order::RunUntil(condition)) => {
                let is_so = self.device().crossing(&condition) == Some(self.now());
                let stop = if is_so && !condition.has_happenings() {
                    self.stopped(Reason::Found, Vec::new())
                } else {
                    self.seek(&condition, Way::Forward, progress)
                };
                self.told(stop)
            }
            Some(Order::Position) => Ok(self.whereabouts()),
            Some(Order::Rule(ruling)) => Ok(self.done(&[OwnedInput::Rule(ruling)])),
            Some(Order::Reset) => {
                let ends = [OwnedInput::Rule(Ruling::EndAll), OwnedInput::Fault(Faulting::EndAll)];
                Ok(self.done(&ends))
            }
            Some(Order::Faults) => {
                Ok(Answer::Text(faults_in_words(&self.line().faults(), self.names())))
            }
            Some(Order::Rules) => {
                Ok(Answer::Text(rules_in_words(&self.line().rules(), self.names())))
            }
            Some(Order::Signals) => Ok(Answer::Signals(self.device().view(self.now()).signals)),
            Some(Order::Help(None)) => Ok(self.helped()),
            Some(Order::Help(Some(verb))) => Ok(Answer::Text(help_on(verb, self.names()))),
            Some(Order::Quit) => Ok(Answer::Quit),
            Some(Order::Complete(begun)) => {
                let cursor = begun.len();
                Ok(Answer::Candidates(self.complete(&begun, cursor).candidates))
            }
            Some(Order::Erase) => Err(DebugError::new(
                "what erases the memory is a row of things done at the panel; do them one by one",
            )),
            // Nothing is in transit here when a line is carried out.
            Some(Order::Cancel) | None => Ok(Answer::Done),
        }
    }

    /// Does something at the machine, and says so if nothing came of it.
    fn done(&mut self, inputs: &[OwnedInput]) -> Answer {
        match self.act(inputs) {
            Effect::Something => Answer::Done,
            nothing => Answer::Text(said(&nothing)),
        }
    }

    fn inputs_of(&self, deed: &Deed) -> Result<Vec<OwnedInput>> {
        let inputs = deed.inputs(self.names().signals());
        inputs.map_err(|error| DebugError::new(error.to_string()))
    }

    fn helped(&self) -> Answer {
        let deeds = Verb::all().filter(|verb| verb.is_of(self.names()));
        let deeds = deeds.filter(|verb| matches!(verb.sort(), Sort::Deed | Sort::Time));
        let forms = deeds.filter(|verb| !is_elsewhere(*verb)).flat_map(typed);
        Answer::Help(forms.collect())
    }
}

impl From<&str> for DebugError {
    fn from(message: &str) -> DebugError {
        DebugError::new(message)
    }
}

/// The forms that a verb of the panel is typed in, with what each does.
fn typed(verb: Verb) -> impl Iterator<Item = (String, String)> {
    verb.forms().iter().map(move |form| (verb.typed(form), form.about.to_owned()))
}

/// Whether a verb has no use where nothing runs by itself, or consists of several steps.
fn is_elsewhere(verb: Verb) -> bool {
    matches!(verb, Verb::Cancel | Verb::Erase)
}

/// Whether it is meant as an expression although it is none: it does not begin as a command does.
fn is_expression(device: &Controller, line: &str) -> bool {
    let first = line.split_whitespace().next().unwrap_or_default();
    let is_word = first.chars().all(|c| c.is_alphanumeric() || matches!(c, '-' | '_'));
    Directive::named(first).is_none() && (!is_word || is_axis(device, first))
}

fn unknown(word: &str) -> DebugError {
    let wrong = format!("`{word}` is not a command");
    let begun = TABLE.iter().map(|directive| directive.name);
    let begun: Vec<&str> =
        begun.filter(|name| !word.is_empty() && name.starts_with(word)).collect();
    if !begun.is_empty() {
        return DebugError::new(format!("{wrong}; there is {}", begun.join(", ")));
    }
    match meant(word) {
        Some(meant) => DebugError::new(format!("{wrong}; `{meant}` is probably meant")),
        None => DebugError::new(wrong).with(Remedy::Help),
    }
}

/// What is typed nearly so: a letter in three may be wrong, and two that are exchanged are one.
fn meant(word: &str) -> Option<&'static str> {
    let verbs = Verb::all().filter_map(|verb| verb.name().split(' ').next());
    let names = TABLE.iter().map(|directive| directive.name).chain(verbs);
    let (distance, name) = names.map(|name| (osa_distance(word, name), name)).min()?;
    (distance * 3 <= name.len()).then_some(name)
}

/// Why no line of a file can be shown or gone to.
const NO_FILE: &str = "the commands come from no file";

/// The longest span of time that there is: what the nanoseconds of a [`Time`] hold.
const LONGEST: &str = "5124095h";

fn number(text: &str) -> Result<u64> {
    text.parse().map_err(|_| {
        DebugError::new(match is_number(text) {
            true => format!("`{text}` is not from 0 to {}", u64::MAX),
            false => format!("`{text}` is not a number"),
        })
    })
}

/// Whether it is a whole number of any size.
fn is_number(text: &str) -> bool {
    let digits = text.trim_start_matches(['+', '-']);
    !digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit())
}

/// A span of time as a line of the debugger has it.
///
/// # Errors
///
/// If it is none, or too long.
pub fn span(text: &str) -> Result<std::time::Duration> {
    parse_duration(text).map_err(|error| {
        DebugError::new(match error {
            NotADuration::TooLong => format!("`{text}` {error}; it can be {LONGEST} at most"),
            _ => format!("`{text}` {error}; a span of time is such as 10ms or 1.5s"),
        })
    })
}

/// The text before and after the last separate occurrence of a word.
fn split_word<'t>(text: &'t str, word: &str) -> Option<(&'t str, &'t str)> {
    let pattern = format!(" {word} ");
    let at = text.find(&pattern)?;
    Some((text[..at].trim(), text[at + pattern.len()..].trim()))
}

/// The lines around the present one.
fn around(mut listing: crate::Listing) -> crate::Listing {
    /// The number of lines shown before and after the present one.
    const AROUND: usize = 10;
    let present = listing.lines.iter().position(|line| line.is_present).unwrap_or(0);
    listing.lines.truncate(present + AROUND + 1);
    listing.lines.drain(..present.saturating_sub(AROUND));
    listing
}

fn bytes_of(text: &str) -> Result<Vec<u8>> {
    unescape(text)
        .map_err(|wrong| DebugError::new(format!("`{wrong}`: \\r, \\n, \\t, \\\\ or \\xFD")))
}

/// Carries out several lines, and stops at the first that fails.
///
/// # Errors
///
/// The number of the line, from 1, and what was wrong with it.
pub fn script(
    debugger: &mut Debugger,
    text: &str,
    mut answered: impl FnMut(&Answer) -> ControlFlow<()>,
) -> Result<(), (usize, DebugError)> {
    for (number, line) in (1..).zip(text.lines()) {
        let answer = debugger.execute(line, &mut crate::uninterrupted);
        let answer = answer.map_err(|error| (number, error))?;
        if answer == Answer::Quit || answered(&answer).is_break() {
            break;
        }
    }
    Ok(())
}
