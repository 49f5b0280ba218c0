//! A stream of commands, fed to a controller as fast as it takes them.

use std::collections::VecDeque;

use vimc4::Time;
use vimc4::device::Device;

use super::driver::{Halt, News};
use super::report::{Answer, End, Why};
use super::script::Line;
use super::{Outside, Session};

/// The host's side of the line.
struct Feed<'l> {
    /// What is still to be sent.
    lines: std::slice::Iter<'l, Line>,
    /// The commands that were sent and have not begun.
    waiting: VecDeque<&'l Line>,
    /// The command that began last, unless what became of it was told.
    running: Option<Command<'l>>,
    /// Whether every command says when it was completed, so that the next one waits for that.
    echo: bool,
}

/// A command that has begun.
struct Command<'l> {
    line: &'l Line,
    at: Time,
    meaning: String,
    answer: Vec<u8>,
}

impl<'l> Feed<'l> {
    /// The next piece, if it may be sent to a controller with room for so many bytes.
    fn next(&mut self, room: usize) -> Option<&'l Line> {
        let may = match self.echo {
            true => self.waiting.is_empty() && self.running.is_none(),
            // What is longer than the room there ever is goes nevertheless.
            false => self.waiting.is_empty() || self.lines.as_slice().first()?.length() <= room,
        };
        if may { self.lines.next() } else { None }
    }
}

impl<D: Device> Session<D> {
    /// Sends the pieces, each when the one before was completed, or as long as there is room.
    pub(super) fn stream(&mut self, lines: &[Line], outside: &Outside) -> Result<End, End> {
        self.begin(outside);
        let mut feed =
            Feed { lines: lines.iter(), waiting: VecDeque::new(), running: None, echo: true };
        loop {
            while let Some(line) = feed.next(self.driver.device().room(true)) {
                if line.command {
                    feed.waiting.push_back(line);
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
            if idle && feed.waiting.is_empty() {
                // Whoever has not answered until now does not.
                if let Some(command) = feed.running.take() {
                    feed.echo = false;
                    self.told(command);
                }
                if feed.lines.as_slice().is_empty() {
                    return Ok(End::of(Why::Done, "every command was carried out"));
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

    /// Takes in what has happened.
    fn hear(&mut self, feed: &mut Feed<'_>) -> Result<(), End> {
        while let Some((at, news)) = self.driver.news.pop_front() {
            match news {
                News::Begun(bytes) => {
                    // Some commands overtake others.
                    let is_it = |line: &&Line| line.bytes.trim_ascii_end() == bytes;
                    let place = feed.waiting.iter().position(is_it).unwrap_or(0);
                    let Some(line) = feed.waiting.remove(place) else { continue };
                    if let Some(command) = feed.running.take() {
                        self.told(command);
                    }
                    let meaning = self.driver.device().explain(&line.bytes);
                    feed.running = Some(Command { line, at, meaning, answer: Vec::new() });
                }
                News::Answer(answer) => {
                    let completes = self.family.completes(&answer);
                    let refusal = self.family.refusal(&answer);
                    match &mut feed.running {
                        Some(command) => command.answer.extend_from_slice(&answer),
                        None => self.report.sent(at, &answer),
                    }
                    if let Some(refusal) = refusal {
                        let line = feed.running.as_ref().map(|command| command.line);
                        let place = line.map(|line| self.report.place(line));
                        let text = match place {
                            Some(place) => format!("{place} was answered {refusal}"),
                            None => format!("it said {refusal}"),
                        };
                        feed.running.take().into_iter().for_each(|command| self.told(command));
                        let line = line.and_then(|line| line.number);
                        return Err(End { line, ..End::of(Why::Error, text) });
                    }
                    if completes && let Some(command) = feed.running.take() {
                        feed.echo = answer.starts_with(b"C");
                        self.told(command);
                    }
                }
                news => self.tell(at, news),
            }
        }
        Ok(())
    }

    /// Says what became of a command.
    fn told(&mut self, command: Command<'_>) {
        let Command { line, at, meaning, answer } = command;
        let answer = (!answer.is_empty()).then_some(answer.as_slice());
        let took = self.driver.now() - at;
        self.report.answer(Answer { line, answer, at, took, meaning });
    }

    /// Why nothing goes on.
    fn stuck(&mut self, halt: Halt, feed: &mut Feed<'_>) -> End {
        let line = match (&feed.running, feed.waiting.front()) {
            (Some(command), _) => Some(command.line),
            (None, waiting) => waiting.copied(),
        };
        let activity = self.driver.device().view(self.driver.now()).activity;
        let place = line.map_or_else(|| "the file".to_owned(), |line| self.report.place(line));
        let (why, text) = match halt {
            Halt::Time => (Why::Time, format!("the time of --for is over, in {place}")),
            Halt::Rounds | Halt::Waiting | Halt::Idling => {
                (Why::Waits, format!("{place}: {activity}, and nothing will change that"))
            }
        };
        End { line: line.and_then(|line| line.number), ..End::of(why, text) }
    }
}
