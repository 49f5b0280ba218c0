//! A stream of commands, fed to a controller as fast as it takes them.

use std::collections::VecDeque;

use vimc4_catalogue::Turn;
use vimc4_device::{Activity, Device, Time};

use super::driver::{Halt, News};
use super::report::{Answer, Answered, ESCAPE, End, LOWER_CASE, Left, Why};
use super::session::Session;
use super::world::Outside;
use vimc4_script::ScriptLine;

/// The host's side of the line.
struct Feed<'l> {
    /// What is still to be sent.
    lines: std::slice::Iter<'l, ScriptLine>,
    /// The commands that were sent and have not begun.
    waiting: VecDeque<&'l ScriptLine>,
    /// The command that began last, unless what became of it was told.
    running: Option<SentCommand<'l>>,
    /// Likewise a command that has overtaken others or is unknown. It takes no time.
    aside: Option<SentCommand<'l>>,
    /// Whether the next command waits until the one before says that it was completed.
    echo: bool,
}

/// A command that has begun.
struct SentCommand<'l> {
    line: &'l ScriptLine,
    at: Time,
    turn: Turn,
    meaning: String,
    answer: Answered,
}

impl<'l> Feed<'l> {
    /// The next piece, if it may be sent to a controller with room for this many bytes.
    fn next(&mut self, room: usize) -> Option<&'l ScriptLine> {
        let begun = self.running.is_some() || self.aside.is_some();
        let may = match self.echo {
            true => self.waiting.is_empty() && !begun,
            // A piece longer than the whole buffer is sent nevertheless.
            false => self.waiting.is_empty() || self.lines.as_slice().first()?.length() <= room,
        };
        if may { self.lines.next() } else { None }
    }

    /// Which of the commands that wait was sent like this. Some overtake others.
    fn begins(&mut self, bytes: &[u8]) -> Option<&'l ScriptLine> {
        let place = self.waiting.iter().position(|line| line.bytes.trim_ascii_end() == bytes)?;
        self.waiting.remove(place)
    }
}

impl Session {
    /// Sends the pieces, each when the one before was completed, or as long as there is room.
    pub(super) fn stream(&mut self, lines: &[ScriptLine], outside: &Outside) -> Result<End, End> {
        self.wait_until_ready();
        self.begin(outside);
        let mut feed = Feed {
            lines: lines.iter(),
            waiting: VecDeque::new(),
            running: None,
            aside: None,
            echo: self.echoes(),
        };
        loop {
            while let Some(line) = feed.next(self.driver.device().room(true)) {
                if line.command {
                    feed.waiting.push_back(line);
                }
                if line.escape.is_some() && !line.command {
                    self.report.left(Left::Escape, line);
                } else if line.lower_case {
                    self.report.left(Left::LowerCase, line);
                } else if line.numbers > 0 {
                    self.report.left(Left::Numbers, line);
                }
                self.driver.send(&line.whole());
                self.hear(&mut feed)?;
            }
            let idle = self.driver.device().is_idle();
            if idle && !feed.waiting.is_empty() && feed.echo {
                // It waits for something that comes later in the file, or from outside.
                feed.echo = false;
                continue;
            }
            if idle && !feed.waiting.is_empty() && self.is_at_rest() {
                // Nothing holds them up, and still they do not begin: `!CB` or `IN` took them away.
                for line in feed.waiting.drain(..) {
                    self.report.left(Left::TakenAway, line);
                }
            }
            if idle && feed.waiting.is_empty() {
                // A command that has not been answered by now will not be.
                let now = self.driver.now();
                let begun = [feed.aside.take(), feed.running.take()];
                begun.into_iter().flatten().for_each(|command| self.told(command, now));
                feed.echo = self.echoes();
                if feed.lines.as_slice().is_empty() {
                    return Ok(self.report.carried_out());
                }
                continue;
            }
            let advanced = self.driver.advance();
            self.hear(&mut feed)?;
            if let Err(halt) = advanced {
                return Err(self.stuck(halt, &mut feed));
            }
            self.report.progress(self.driver.now());
        }
    }

    /// Lets a machine that homes by itself do so before time counts.
    fn wait_until_ready(&mut self) {
        self.driver.meter.references = true;
        while !self.driver.device().is_idle() && self.driver.advance().is_ok() {}
        self.driver.meter.references = false;
    }

    /// Whether the controller would begin any command.
    fn is_at_rest(&self) -> bool {
        self.driver.device().activity() == Activity::Idle
    }

    /// Takes in what has happened.
    fn hear(&mut self, feed: &mut Feed<'_>) -> Result<(), End> {
        while let Some((at, news)) = self.driver.news.pop_front() {
            match news {
                News::Begun(bytes) => {
                    // A command that is repeated begins without having been sent again.
                    let Some(line) = feed.begins(&bytes) else { continue };
                    if let Some(command) = feed.aside.take() {
                        self.told(command, at);
                    }
                    let turn = self.handling.turn(&line.bytes);
                    let meaning = self.driver.device().explain(&line.bytes);
                    let command =
                        SentCommand { line, at, turn, meaning, answer: Answered::default() };
                    match turn {
                        Turn::InOrder => {
                            let before = feed.running.replace(command);
                            before.into_iter().for_each(|before| self.told(before, at));
                        }
                        Turn::Overtakes | Turn::Unknown => feed.aside = Some(command),
                    }
                }
                News::Answer(bytes, why) => {
                    self.answered(feed, at, Answered { bytes, why, ..Answered::default() })?
                }
                news => self.tell(at, news),
            }
        }
        Ok(())
    }

    /// Something was answered: by the command that has just overtaken the others, or by the one
    /// that runs.
    fn answered(&mut self, feed: &mut Feed<'_>, at: Time, answered: Answered) -> Result<(), End> {
        let answer = answered.bytes.as_slice();
        let over = |command: &mut SentCommand<'_>| command.at != at;
        if feed.running.is_some()
            && let Some(command) = feed.aside.take_if(over)
        {
            self.told(command, at);
        }
        let slot = if feed.aside.is_some() { &mut feed.aside } else { &mut feed.running };
        let completes = self.handling.model().family().completes(answer);
        match slot {
            Some(command) => {
                command.answer.bytes.extend_from_slice(answer);
                command.answer.why = command.answer.why.take().or(answered.why.clone());
            }
            None => self.report.sent(at, answer, answered.why.as_deref()),
        }
        let (line, turn) = match slot {
            Some(command) => (Some(command.line), command.turn),
            None => (None, Turn::InOrder),
        };
        let sent = line.map_or(&b""[..], |line| line.bytes.as_slice());
        let refusal = self.handling.refusal(sent, answer);
        let is_over = completes || refusal.is_some();
        let command = if is_over { slot.take() } else { None };
        command.into_iter().for_each(|command| self.told(command, at));
        if let Some(refusal) = refusal.map(|refusal| answered.explain(refusal)) {
            if turn == Turn::Unknown && self.report.keeps_going() {
                return Ok(());
            }
            let mut help = Vec::new();
            if turn == Turn::Unknown {
                let known = line.and_then(|line| self.handling.known_with(&line.bytes));
                help.extend(known.map(|value| format!("a profile with {value} knows it")));
                if line.is_some_and(|line| line.escape.is_some()) {
                    help.push(ESCAPE.to_owned());
                }
                if let [b'!', b'a'..=b'z', ..] = sent {
                    help.push(LOWER_CASE.to_owned());
                }
                help.push("--keep-going leaves out what the controller does not know".to_owned());
            }
            return Err(self.report.refused(line, &refusal, help));
        }
        if completes && line.is_some() {
            // `IN` says that it is done whether or not commands after it will.
            feed.echo = self.echoes();
        }
        Ok(())
    }

    /// Whether the controller says when a command is completed.
    fn echoes(&self) -> bool {
        self.driver.echoes()
    }

    /// Says what became of a command.
    fn told(&mut self, command: SentCommand<'_>, now: Time) {
        let SentCommand { line, at, turn, meaning, answer } = command;
        if turn == Turn::Unknown {
            self.report.left(Left::Command, line);
        }
        // What overtakes others takes no time, whenever it is told; unless it was waited for.
        let took = match (turn, answer.bytes.is_empty()) {
            (Turn::Overtakes | Turn::Unknown, true) => std::time::Duration::ZERO,
            _ => now - at,
        };
        let answer = (!answer.bytes.is_empty()).then_some(&answer);
        let why = answer.and_then(|answer| answer.why.as_deref());
        self.report.answer(Answer { line, answer, why, at, took, ran: took, meaning });
    }

    /// Why nothing goes on.
    fn stuck(&mut self, halt: Halt, feed: &mut Feed<'_>) -> End {
        let line = match (&feed.running, feed.waiting.front()) {
            (Some(command), _) => Some(command.line),
            (None, waiting) => waiting.copied(),
        };
        let activity = self.driver.device().activity();
        let place = line.map_or_else(|| "the file".to_owned(), |line| self.report.place(line));
        let (why, text) = match halt {
            Halt::Time => (Why::Time, format!("the time of --for is over, in {place}")),
            Halt::Interrupted => (Why::Interrupted, format!("it was interrupted, in {place}")),
            Halt::Rounds | Halt::Waiting | Halt::Idling => {
                (Why::Waits, format!("{place}: {activity}, and nothing will change that"))
            }
        };
        let help = match activity {
            Activity::Stopped => {
                vec!["`!GO;` lets commands go on after `!ST;`: put it behind it".to_owned()]
            }
            Activity::Trackball => {
                vec!["`!CI;` closes the trackball: put it behind `!OI`".to_owned()]
            }
            _ => Vec::new(),
        };
        End { line: line.and_then(|line| line.number), help, ..End::of(why, text) }
    }
}
