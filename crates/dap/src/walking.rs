//! Controllers on their way, and where they stop.

use serde_json::{Value, json};
use vimc4_debug::{
    BreakpointId, Depth, FrameKind, Reason, Stop, Trigger, Unit, Way, uninterrupted,
};
use vimc4_device::{Condition, Device, Event, Output};
use vimc4_timeline::{Begins, Found, Progress};

use crate::arguments::{Goto, Granularity, Lines, OfFrame, OfThread, Step};
use crate::held::{Held, Placed, Text, Walk};
use crate::message::{Outgoing, Refusal};
use crate::state::{Answered, DONE, Run, Session, Stage, answer};

/// What is known of a run from outside.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Running {
    /// The number of the run, which is also that of its progress.
    pub number: u64,
    /// What it does, for people.
    pub title: String,
    /// The thread, as clients count them.
    pub thread: i64,
    /// Whether it can be interrupted and resumed without loss.
    pub can_pause: bool,
    /// Whether there are others that wait for their turn.
    pub has_others: bool,
}

impl Session {
    /// The present run, if there is one: [`run`](Session::run) continues it.
    #[must_use]
    pub fn running(&self) -> Option<Running> {
        let run = self.runs.front()?;
        let title = match run.walk.way() {
            Way::Back => "Going back",
            Way::Forward => "Running",
        };
        let title = match self.held.len() {
            1 => title.to_owned(),
            _ => format!("{title}: {}", self.held.get(run.thread)?.opened.name),
        };
        Some(Running {
            number: run.number,
            title,
            thread: run.thread as i64 + 1,
            can_pause: matches!(run.walk, Walk::Go(Way::Forward)),
            has_others: self.runs.len() > 1,
        })
    }

    /// Whether the run of a number is still going.
    #[must_use]
    pub fn is_running(&self, number: u64) -> bool {
        self.runs.iter().chain(&self.away).any(|run| run.number == number)
    }

    /// Whether the client shows progress.
    #[must_use]
    pub fn shows_progress(&self) -> bool {
        self.client.shows_progress
    }

    /// Runs the first controller until it stops or `progress` interrupts it. An interrupted run
    /// continues with the next call, after others that wait for their turn; a run that cannot be
    /// resumed ends.
    pub fn run(&mut self, progress: &mut Progress<'_>) {
        let Some(run) = self.runs.pop_front() else { return };
        let Some(held) = self.held.get_mut(run.thread) else { return };
        let stop = match held.walk(&run.walk, progress) {
            Ok(Some(stop)) => stop,
            Ok(None) => return self.away.push(run),
            Err(refusal) => return self.is_lost(run.thread, &refusal),
        };
        if stop.why == Reason::Cancelled && run.walk == Walk::Go(Way::Forward) {
            self.tell_notes(run.thread, &stop);
            self.runs.push_back(run);
            return;
        }
        self.stopped(run.thread, &run.walk, stop);
    }

    /// Attends to controllers that run by themselves: to be called when one of them has news.
    pub fn look(&mut self) {
        let mut place = 0;
        while let Some(run) = self.away.get(place) {
            let Some(held) = self.held.get_mut(run.thread) else { return };
            let looked = match held.live() {
                Some((debugger, live)) => live.look(debugger),
                None => Ok(None),
            };
            match looked {
                Ok(None) => place += 1,
                Ok(Some(stop)) => {
                    let run = self.away.remove(place);
                    self.stopped(run.thread, &run.walk, stop);
                }
                Err(refusal) => {
                    let run = self.away.remove(place);
                    self.is_lost(run.thread, &refusal);
                }
            }
        }
    }

    /// A controller that ran by itself has ended.
    fn is_lost(&mut self, thread: usize, refusal: &Refusal) {
        let output = format!("{refusal}\n");
        self.tell("output", json!({ "category": "important", "output": output }));
        if let Some(held) = self.held.get_mut(thread) {
            held.opened.live = None;
        }
        self.is_over_for(thread);
    }

    /// Gives controllers that run by themselves the present breakpoints.
    pub(crate) fn heed_again(&mut self) {
        for run in &self.away {
            let live = self.held.get_mut(run.thread).and_then(Held::live);
            // One that has ended says so when it is looked at.
            let _ = live.map(|(debugger, live)| live.heed(debugger));
        }
    }

    /// Whether more of a recording can be read while there is nothing else to do.
    #[must_use]
    pub fn has_unread(&self) -> bool {
        self.held.iter().any(|held| held.opened.debugger.has_unread())
    }

    /// Reads on as long as `progress` allows. The present stays.
    pub fn read_on(&mut self, progress: &mut Progress<'_>) {
        let unread = self.held.iter().position(|held| held.opened.debugger.has_unread());
        let Some(thread) = unread else { return };
        // Unreadable parts are reported when a run reaches them.
        let _ = self.held[thread].debugger().read_on(usize::MAX, progress);
        if !self.held[thread].opened.debugger.has_unread() {
            self.tell_of_new_lines(thread);
        }
    }

    /// Reports that a recording has yielded more lines.
    fn tell_of_new_lines(&mut self, thread: usize) {
        let Some(held) = self.held.get_mut(thread).filter(|held| !held.opened.is_file) else {
            return;
        };
        if let Some(notice) = held.debugger().notice() {
            let output = format!("{notice}\n");
            self.out.push(Outgoing::event(
                "output",
                json!({ "category": "important", "output": output }),
            ));
        }
        let lines = held.opened.debugger.source().map_or(0, |source| source.lines.len());
        if std::mem::replace(&mut held.listed, lines) < lines {
            let source = self.source(thread, Text::Source);
            self.tell("loadedSource", json!({ "reason": "changed", "source": source }));
        }
    }

    /// Sends a controller on its way.
    pub(crate) fn begin(&mut self, thread: usize, walk: Walk) {
        self.frames.forget(thread);
        self.values.forget(thread);
        if !matches!(walk, Walk::To(..)) {
            self.targets.retain(|(own, ..)| *own != thread);
        }
        self.begun += 1;
        self.runs.push_back(Run { number: self.begun, thread, walk });
    }

    /// A controller has stopped.
    pub(crate) fn stopped(&mut self, thread: usize, walk: &Walk, stop: Stop) {
        // A target that leads nowhere is no reason to forget the others.
        if stop.why != Reason::Nowhere {
            self.targets.retain(|(own, ..)| *own != thread);
        }
        self.tell_notes(thread, &stop);
        self.tell_of_elsewhere(thread);
        self.tell_of_new_lines(thread);
        let Some(held) = self.held.get_mut(thread) else { return };
        let is_ahead = walk.way() == Way::Forward;
        let is_live = held.opened.live.is_some();
        let rests =
            |stop: &Stop| matches!(stop.why, Reason::Rest | Reason::Refused(_) | Reason::End);
        let comes_to_rest = rests(&stop) && is_ahead;
        let debugger = &held.opened.debugger;
        let feed = debugger.feed();
        let is_idle = debugger.device().is_idle() || stop.why == Reason::End;
        let is_done = is_idle && feed.is_none_or(|feed| feed.is_done(debugger.history()));
        let is_end = comes_to_rest && is_done && !is_live;
        // A run that starts at the end is meant to go beyond it; a step finds nothing more.
        let again = is_end && held.end == Some(stop.place) && !matches!(walk, Walk::Step(..));
        held.end = is_end.then_some(stop.place);
        let before = held.stop.take();
        let before = before.filter(|before| matches!(walk, Walk::Step(..)) && !rests(before));
        let line = before.or(held.last_line.take()).filter(|_| comes_to_rest);
        held.last_line = line.filter(|line| line.place == stop.place);
        let activity = debugger.device().activity();
        held.stop = Some(stop.clone());
        let ends = |configuration: &crate::open::Configuration| {
            configuration.end_at_end || configuration.no_debug
        };
        if is_end && (again || self.configuration.as_ref().is_some_and(ends)) {
            return self.is_over_for(thread);
        }
        let (reason, description) = match &stop.why {
            _ if *walk == Walk::Entry && is_live => ("entry", "paused".to_owned()),
            _ if *walk == Walk::Entry && !comes_to_rest => ("entry", "the first line".to_owned()),
            Reason::Step(unit) => ("step", format!("a {unit}")),
            Reason::Breakpoints(ids) => self.met(thread, ids, &stop),
            Reason::Found | Reason::Gone => ("goto", "here".to_owned()),
            Reason::Nowhere => ("goto", "that is nowhere; still here".to_owned()),
            Reason::Endless(why) => ("pause", format!("still here: {why}")),
            Reason::Beginning => ("entry", "the beginning".to_owned()),
            Reason::Time => ("pause", "the time has come".to_owned()),
            Reason::Cancelled => ("pause", "paused".to_owned()),
            Reason::End => ("pause", "the end of what is recorded".to_owned()),
            Reason::Broken(why) => ("pause", why.clone()),
            Reason::Waits(what) if stop.met.is_empty() => ("pause", what.clone()),
            Reason::Waits(what) => ("breakpoint", what.clone()),
            Reason::Refused(why) => ("pause", format!("the end: {why} (`keepGoing` sends it)")),
            Reason::Rest if is_live && is_idle => ("pause", "idle: nothing has come".to_owned()),
            Reason::Rest if is_done => ("pause", "the end: everything is done".to_owned()),
            Reason::Rest => match &stop.awaits {
                Some(awaits) => ("pause", awaits.clone()),
                None => ("pause", activity.to_string()),
            },
        };
        let ids = match &stop.why {
            Reason::Breakpoints(ids) => self.points_of(thread, ids),
            Reason::Waits(_) => self.points_of(thread, &stop.met),
            _ => Vec::new(),
        };
        self.tell(
            "stopped",
            json!({
                "reason": reason,
                "description": capital(&description),
                "text": description,
                "threadId": thread + 1,
                "allThreadsStopped": false,
                "hitBreakpointIds": ids,
            }),
        );
    }

    /// Says where a controller that runs by itself is, if the debugger stands off its way.
    pub(crate) fn tell_of_elsewhere(&mut self, thread: usize) {
        let Some(held) = self.held.get_mut(thread) else { return };
        let elsewhere = held.live().and_then(|(debugger, live)| {
            live.elsewhere(debugger).filter(|_| !live.is_ahead(debugger))
        });
        if let Some(elsewhere) = elsewhere {
            let output = format!("{elsewhere}\n");
            self.tell("output", json!({ "category": "console", "output": output }));
        }
    }

    /// What a stop at breakpoints is called, and a few words on it.
    fn met(&mut self, thread: usize, ids: &[BreakpointId], stop: &Stop) -> (&'static str, String) {
        // The most important reason comes first.
        const ORDER: [&str; 4] =
            ["exception", "data breakpoint", "function breakpoint", "breakpoint"];
        let met = |id: &(usize, BreakpointId)| id.0 == thread && ids.contains(&id.1);
        let reasons: Vec<&str> = self
            .points
            .all()
            .filter(|point| point.on.iter().any(met))
            .map(|point| point.reason())
            .collect();
        let reason = ORDER.into_iter().find(|reason| reasons.contains(reason));
        let reason = reason.unwrap_or("breakpoint");
        let error = error_in(&stop.outputs).filter(|_| reason == "exception");
        let first = self.held.get(thread).and_then(|held| {
            let debugger = &held.opened.debugger;
            let found = debugger.breakpoints().iter().find(|own| ids.contains(&own.id))?;
            let mut found = found.clone();
            // A line of a program that comes from a file is one of the file for its editor.
            if let Trigger::Condition(Condition::Line { line: Some(line) }) = found.trigger
                && let Some(of) = (line as usize).checked_sub(1)
                && let Some(of) = held.opened.stored.get(of)
            {
                found.trigger = Trigger::SourceLine(*of);
            }
            Some(found.describe(debugger.names()))
        });
        let text = error.map(|(code, why)| format!("error reply {code}: {why}"));
        (reason, text.or(first).unwrap_or_else(|| reason.to_owned()))
    }

    fn points_of(&mut self, thread: usize, ids: &[BreakpointId]) -> Vec<u32> {
        let met = |id: &(usize, BreakpointId)| id.0 == thread && ids.contains(&id.1);
        let points = self.points.all();
        points.filter(|point| point.on.iter().any(met)).map(|point| point.id).collect()
    }

    /// Reports the notes of breakpoints that only log, and where the recording differs.
    fn tell_notes(&mut self, thread: usize, stop: &Stop) {
        for difference in &stop.differences {
            let output = format!("{difference}\n");
            self.tell("output", json!({ "category": "important", "output": output }));
        }
        for note in &stop.notes {
            let by = (thread, note.by);
            let point = self.points.all().find(|point| point.on.contains(&by));
            let line = point.and_then(|point| point.line);
            let mut body = json!({ "category": "console", "output": format!("{}\n", note.text) });
            if let Some(line) = line {
                body["source"] = self.source(thread, Text::Source);
                body["line"] = self.line_out(line).into();
            }
            self.tell("output", body);
        }
    }

    /// A controller is at its end and is not continued.
    fn is_over_for(&mut self, thread: usize) {
        if let Some(held) = self.held.get_mut(thread) {
            held.is_over = true;
        }
        if self.held.iter().all(|held| held.is_over) {
            return self.end();
        }
        self.tell("thread", json!({ "reason": "exited", "threadId": thread + 1 }));
    }

    /// All controllers are at their end.
    pub(crate) fn end(&mut self) {
        if self.stage == Stage::Ended {
            return;
        }
        self.stage = Stage::Ended;
        self.let_go_of_all();
        self.held.iter_mut().for_each(|held| held.is_over = true);
        let error = Condition::Error { code: None };
        let has_failed = self.held.iter_mut().any(|held| {
            let history = held.debugger().history_mut();
            history.seek_last_or_here(&mut Begins::new(&error), &mut uninterrupted) == Found::Here
        });
        if !self.held.is_empty() {
            self.tell("exited", json!({ "exitCode": i32::from(has_failed) }));
        }
        self.tell("terminated", Value::Null);
    }

    // --- requests ---

    pub(crate) fn go(&mut self, OfThread { thread_id }: OfThread, way: Way) -> Answered {
        self.resting(thread_id)?;
        self.begin(self.thread(thread_id)?, Walk::Go(way));
        match way {
            Way::Forward => answer(json!({ "allThreadsContinued": false })),
            Way::Back => DONE,
        }
    }

    pub(crate) fn step(&mut self, step: Step, way: Way, depth: Depth) -> Answered {
        let statement = self.resting(step.thread_id)?.opened.statement;
        let unit = match step.granularity {
            Granularity::Statement => statement,
            Granularity::Line => Unit::Line,
            Granularity::Instruction => Unit::Step,
        };
        // Stepping out means out of a loop, whatever the granularity.
        let unit = if depth == Depth::Out { Unit::Line } else { unit };
        self.begin(self.thread(step.thread_id)?, Walk::Step(unit, way, depth));
        DONE
    }

    pub(crate) fn pause(&mut self, OfThread { thread_id }: OfThread) -> Answered {
        let thread = self.thread(thread_id)?;
        if !self.is_on_its_way(thread) && self.stage == Stage::Open {
            // Somebody may wait for the stop all the same.
            if self.held.get(thread).is_some_and(|held| held.stop.is_some() && !held.is_over) {
                self.tell_of_pause(thread);
            }
            return DONE;
        }
        let place = self.runs.iter().position(|run| run.thread == thread);
        if let Some(run) = place.and_then(|place| self.runs.remove(place)) {
            self.give_up(run);
        }
        if self.away.iter().any(|run| run.thread == thread)
            && let Some((_, live)) = self.held.get_mut(thread).and_then(Held::live)
        {
            // The stop is reported when it happens.
            live.pause();
        }
        DONE
    }

    /// Says once more that a controller stands still.
    fn tell_of_pause(&mut self, thread: usize) {
        self.tell(
            "stopped",
            json!({
                "reason": "pause",
                "description": "Paused",
                "text": "paused",
                "threadId": thread + 1,
                "allThreadsStopped": false,
                "hitBreakpointIds": [],
            }),
        );
    }

    /// Ends a run where it has got to.
    pub(crate) fn give_up(&mut self, run: Run) {
        let Some(held) = self.held.get_mut(run.thread) else { return };
        let stop = Stop { why: Reason::Cancelled, ..held.debugger().here() };
        self.stopped(run.thread, &run.walk, stop);
    }

    pub(crate) fn goto_targets(&mut self, lines: Lines) -> Answered {
        let line = self.line_in(lines.line);
        let found = u32::try_from(line).ok().filter(|line| *line > 0);
        let line = found.ok_or_else(|| Refusal(format!("there is no line {line}")))?;
        let mut told = Vec::new();
        let texts = self.texts(&lines.source);
        if texts.is_empty() {
            return Err(Refusal::new("no controller is given commands from there"));
        }
        for (thread, text) in texts {
            let held = self.resting(thread as i64 + 1)?;
            let (trigger, at) = held.at_line(text, line).map_err(Refusal::new)?;
            let whose = match self.held.len() {
                1 => String::new(),
                _ => format!(" of {}", self.held[thread].opened.name),
            };
            for (is_back, what) in
                [(true, "back to when it last began"), (false, "on to when it begins next")]
            {
                // The same target always has the same number.
                let target = (thread, trigger.clone(), is_back);
                let place = self.targets.iter().position(|known| *known == target);
                let place = place.unwrap_or_else(|| {
                    self.targets.push(target);
                    self.targets.len() - 1
                });
                told.push(json!({
                    "id": place + 1,
                    "label": format!("Line {at}{whose}: {what}"),
                    "line": self.line_out(at),
                }));
            }
        }
        answer(json!({ "targets": told }))
    }

    pub(crate) fn goto(&mut self, goto: Goto) -> Answered {
        self.resting(goto.thread_id)?;
        let place = goto.target_id.checked_sub(1);
        let target = place.and_then(|place| self.targets.get(place)).cloned();
        let thread = self.thread(goto.thread_id)?;
        let (_, trigger, is_back) = target.filter(|(own, ..)| *own == thread).ok_or_else(|| {
            Refusal(format!(
                "target {} no longer exists; gotoTargets has the present ones",
                goto.target_id
            ))
        })?;
        let way = if is_back { Way::Back } else { Way::Forward };
        self.begin(thread, Walk::To(trigger, way));
        DONE
    }

    /// Goes back to where a frame began.
    pub(crate) fn restart_frame(&mut self, OfFrame { frame_id }: OfFrame) -> Answered {
        let (thread, place) = self.frames.get(frame_id).copied().ok_or_else(|| {
            Refusal(format!("frame {frame_id} no longer exists; stackTrace has the present ones"))
        })?;
        let held = self.resting(thread as i64 + 1)?;
        let frames = held.frames();
        let Some(Placed { frame, line }) = frames.get(place) else {
            return Err(Refusal::new(
                "there is no such frame now; stackTrace has the present ones",
            ));
        };
        if frame.kind == FrameKind::Waits {
            return Err(Refusal::new("the host waits here, where this line began already"));
        }
        let (text, line) =
            (*line).ok_or_else(|| Refusal::new("there is no line here to go back to"))?;
        let (trigger, _) = held.at_line(text, line).map_err(Refusal::new)?;
        self.begin(thread, Walk::To(trigger, Way::Back));
        DONE
    }

    pub(crate) fn exception_info(&mut self, OfThread { thread_id }: OfThread) -> Answered {
        let held = self.resting(thread_id)?;
        let stop = held.stop.as_ref();
        let (code, why) = stop
            .and_then(|stop| error_in(&stop.outputs))
            .ok_or_else(|| Refusal::new("it has not stopped at an error reply"))?;
        answer(json!({
            "exceptionId": code,
            "description": why,
            "breakMode": "always",
            "details": { "message": why, "typeName": "error reply" },
        }))
    }
}

/// The last error reply among what came out: its text, and why.
fn error_in(outputs: &[Output]) -> Option<(String, String)> {
    outputs.iter().rev().find_map(|output| match output.event()? {
        Event::Answer { bytes, why: Some(why), .. } => {
            Some((String::from_utf8_lossy(bytes.trim_ascii()).into_owned(), why.to_string()))
        }
        _ => None,
    })
}

/// A sentence begins with a capital letter.
fn capital(text: &str) -> String {
    let mut chars = text.chars();
    let first = chars.next().map(|first| first.to_uppercase().to_string());
    first.unwrap_or_default() + chars.as_str()
}
