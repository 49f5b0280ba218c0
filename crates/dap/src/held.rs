//! One controller: going through its history, and finding the place in its texts.

use vimc4_debug::{
    DebugError, Debugger, Depth, Frame, FrameKind, Reason, Stop, Trigger, Unit, Way,
};
use vimc4_device::{Condition, Event, Time};
use vimc4_timeline::{Place, Progress};

use crate::live::Until;
use crate::message::Refusal;
use crate::open::Opened;

/// A controller that is debugged.
pub(crate) struct Held {
    pub(crate) opened: Opened,
    /// Where and why it has stopped last.
    pub(crate) stop: Option<Stop>,
    /// The place of its last stop with everything done.
    pub(crate) end: Option<Place>,
    /// The stop at the last line, if that was over, or waits, as soon as it had begun: then the stop
    /// after it is at the same moment, and a step back from there leads to that line.
    pub(crate) last_line: Option<Stop>,
    /// It has ended and is not continued.
    pub(crate) is_over: bool,
    /// How many lines of its source the client knows of.
    pub(crate) listed: usize,
}

/// A way through the history.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Walk {
    /// To the first line.
    Entry,
    /// To a breakpoint.
    Go(Way),
    /// The same, but no longer than until then.
    Until(Time),
    /// By one of these.
    Step(Unit, Way, Depth),
    /// To where a condition holds, ignoring breakpoints on the way.
    To(Trigger, Way),
}

/// A text that has lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Text {
    /// What the commands come from.
    Source,
    /// The stored program.
    Program,
}

/// What is in progress, and where its line is.
pub(crate) struct Placed {
    pub(crate) frame: Frame,
    pub(crate) line: Option<(Text, u32)>,
}

impl Held {
    pub(crate) fn new(opened: Opened) -> Held {
        let listed = opened.debugger.source().map_or(0, |source| source.lines.len());
        Held { opened, stop: None, end: None, last_line: None, is_over: false, listed }
    }

    pub(crate) fn debugger(&mut self) -> &mut Debugger {
        &mut self.opened.debugger
    }

    /// Goes that way, and returns the stop; `None` if the controller runs by itself now.
    pub(crate) fn walk(
        &mut self,
        walk: &Walk,
        progress: &mut Progress<'_>,
    ) -> Result<Option<Stop>, Refusal> {
        let Opened { debugger, live, statement, .. } = &mut self.opened;
        if let Walk::Step(unit @ (Unit::Line | Unit::Command), Way::Back, _) = *walk
            && let Some(stop) = self.last_line.take()
            && stop.place == debugger.place()
        {
            return Ok(Some(Stop { why: Reason::Step(unit), ..stop }));
        }
        let Some(live) = live else { return Ok(Some(go(debugger, walk, *statement, progress))) };
        match walk {
            Walk::Entry => return Ok(Some(debugger.here())),
            Walk::Go(Way::Forward) => return live.let_go(debugger, Until::Paused, progress),
            Walk::Until(at) => return live.let_go(debugger, Until::Time(*at), progress),
            Walk::Go(Way::Back) | Walk::Step(..) | Walk::To(..) => {}
        }
        let is_ahead = walk.way() == Way::Forward;
        let mut stop = None;
        let arrived =
            live.during(debugger, is_ahead, true, progress, &mut |debugger, progress| {
                stop = Some(go(debugger, walk, *statement, progress));
            })?;
        let stop = match stop.filter(|_| arrived) {
            Some(stop) => stop,
            None => Stop { why: Reason::Cancelled, ..debugger.here() },
        };
        let is_step = matches!(walk, Walk::Step(..)) && is_ahead && stop.why == Reason::Rest;
        if is_step && live.elsewhere(debugger).is_none() {
            // What comes next is up to the connected clients.
            return live.let_go(debugger, Until::Command, progress);
        }
        Ok(Some(stop))
    }

    /// Why something is possible only for a controller that runs by itself.
    pub(crate) fn live(&mut self) -> Option<(&mut Debugger, &mut dyn crate::live::Live)> {
        let Opened { debugger, live, .. } = &mut self.opened;
        Some((debugger, live.as_deref_mut()?))
    }

    /// Does something with the debugger that may also apply to the controller if that runs by
    /// itself. Says whether it was completed.
    pub(crate) fn during(
        &mut self,
        goes_forward: bool,
        is_meant: bool,
        progress: &mut Progress<'_>,
        deed: &mut dyn FnMut(&mut Debugger, &mut Progress<'_>),
    ) -> Result<bool, Refusal> {
        let Opened { debugger, live, .. } = &mut self.opened;
        match live {
            Some(live) => live.during(debugger, goes_forward, is_meant, progress, deed),
            None => {
                deed(debugger, progress);
                Ok(true)
            }
        }
    }

    /// What is in progress, innermost first; never empty.
    pub(crate) fn frames(&mut self) -> Vec<Placed> {
        let mut frames = self.opened.debugger.frames();
        self.begin_with_what_has_just_begun(&mut frames);
        let is_in_program = frames.iter().any(|frame| frame.kind == FrameKind::Line);
        let stored = &self.opened.stored;
        let placed = frames.into_iter().map(|frame| {
            let line = match (frame.kind, frame.line) {
                (FrameKind::Line | FrameKind::Loop { .. }, Some(line)) => {
                    let place = (line as usize).checked_sub(1);
                    let of_file = place.and_then(|place| stored.get(place)).copied();
                    Some(of_file.map_or((Text::Program, line), |line| (Text::Source, line)))
                }
                (_, line) => line.map(|line| (Text::Source, line)),
            };
            Placed { frame, line }
        });
        // A program that a button has started belongs to no command, although one was the last.
        let is_shown = |placed: &Placed| {
            let is_command = matches!(placed.frame.kind, FrameKind::Command(_));
            !(is_in_program && is_command && placed.line.is_none())
        };
        placed.filter(is_shown).collect()
    }

    /// A line that is done as soon as it begins, such as a loop's, stays the present one while we
    /// stand there, although the controller already has the next.
    fn begin_with_what_has_just_begun(&mut self, frames: &mut [Frame]) {
        let debugger = &self.opened.debugger;
        let stop = self.stop.as_ref().filter(|stop| stop.place == debugger.place());
        let begun = stop.and_then(|stop| {
            stop.outputs.iter().rev().find_map(|output| match output.event()? {
                Event::Line { line, .. } => Some(*line),
                _ => None,
            })
        });
        let frame = frames.first_mut().filter(|frame| frame.kind == FrameKind::Line);
        if let (Some(line), Some(frame)) = (begun, frame)
            && frame.line != Some(line)
        {
            let listing = debugger.program();
            let listed = listing.and_then(|listing| {
                listing.lines.into_iter().find(|listed| listed.number == u64::from(line))
            });
            frame.name = listed.map_or_else(String::new, |listed| listed.text);
            frame.line = Some(line);
        }
    }

    /// What to wait for at a line of a text, or at the first line after it at which something
    /// happens; and that line.
    pub(crate) fn at_line(&self, text: Text, line: u32) -> Result<(Trigger, u32), DebugError> {
        let of_program = |number| Trigger::Condition(Condition::Line { line: Some(number) });
        if text == Text::Program {
            return Ok((of_program(line), line));
        }
        let stored = (1_u32..).zip(&self.opened.stored).filter(|(_, of)| **of >= line);
        let stored = stored.min_by_key(|(_, of)| **of).map(|(number, of)| (number, *of));
        let source = self.opened.debugger.source();
        let sent = source.and_then(|_| self.opened.debugger.line_that_does(line));
        match (stored, sent) {
            // A line of a program is meant as it is executed, not as it is stored.
            (Some((number, of)), sent) if sent.is_none_or(|sent| of <= sent) => {
                Ok((of_program(number), of))
            }
            _ => {
                let trigger = self.opened.debugger.line_trigger(line)?;
                Ok((trigger, sent.unwrap_or(line)))
            }
        }
    }
}

impl Walk {
    /// Which way it goes.
    pub(crate) fn way(&self) -> Way {
        match self {
            Walk::Entry | Walk::Until(_) => Way::Forward,
            Walk::Go(way) | Walk::Step(_, way, _) | Walk::To(_, way) => *way,
        }
    }
}

/// Goes that way, and says where that has led.
fn go(debugger: &mut Debugger, walk: &Walk, statement: Unit, progress: &mut Progress<'_>) -> Stop {
    match walk {
        Walk::Entry => debugger.step(statement, Way::Forward, Depth::Into, 1, progress),
        Walk::Go(way) => debugger.go(*way, None, progress),
        Walk::Until(at) => debugger.go(Way::Forward, Some(*at), progress),
        Walk::Step(unit, way, depth) => debugger.step(*unit, *way, *depth, 1, progress),
        Walk::To(trigger, way) => debugger.find(trigger.clone(), *way, progress),
    }
}
