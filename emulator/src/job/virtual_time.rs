//! A job on a virtual controller, in virtual time.

use std::collections::BTreeMap;
use std::time::Duration;

use vimc4_catalogue::Handling;
use vimc4_device::{Device, Heard, Time, Travel, Warning};
use vimc4_ncp::job::InputTest;

use super::channel::Channel;
use super::perform::refusal;
use super::unit::{RUN_UP, UNIT, passed, passes_later};
use crate::run::driver::{Driver, Halt, News};
use crate::text::explained;

/// A virtual controller that a job is carried out on.
pub(crate) struct Virtual {
    pub(crate) driver: Driver,
    /// What it warned of, and when.
    pub(crate) warnings: Vec<(Time, Warning)>,
    /// Commands that were sent.
    pub(crate) commands: u64,
    /// Characters to and from it.
    pub(crate) characters: u64,
    /// Everything that was done, if that is kept.
    pub(crate) did: Vec<Did>,
    last: Vec<u8>,
    /// Why the last answer is an error, if it is one.
    why: Option<Box<str>>,
    /// How many warnings had come when the last command was sent.
    warned: usize,
    keeps_times: bool,
    /// The line that is under way.
    pub(crate) line: u32,
    /// When each line began, if times are kept.
    pub(crate) lines: Vec<(u32, Duration)>,
    handling: Handling,
    /// The tools that lines of a job ask for, which a picture shows.
    pub(crate) tools: BTreeMap<u32, u32>,
    /// The wait of the line, and what the port read last.
    pub(crate) polled: Option<(InputTest, u8)>,
}

/// Something that was done.
pub(crate) struct Did {
    /// The line of the file that has asked for it.
    pub(crate) line: u32,
    /// When it was done, in ms.
    pub(crate) millis: u32,
    /// What was sent last for it.
    pub(crate) sent: Vec<u8>,
}

impl Virtual {
    pub(crate) fn new(driver: Driver, handling: Handling, keeps_times: bool) -> Virtual {
        Virtual {
            driver,
            warnings: Vec::new(),
            commands: 0,
            characters: 0,
            did: Vec::new(),
            last: Vec::new(),
            why: None,
            warned: 0,
            keeps_times,
            line: 0,
            lines: Vec::new(),
            handling,
            tools: BTreeMap::new(),
            polled: None,
        }
    }

    /// The time since it was switched on.
    pub(crate) fn elapsed(&self) -> Duration {
        self.driver.now() - Time::ZERO
    }

    /// What the last answer refuses, and why, for people.
    pub(crate) fn refusal(&self, sent: &[u8], answer: &[u8]) -> String {
        explained(refusal(&self.handling, sent, answer), self.why.as_deref())
    }

    /// Takes what was answered by now.
    fn answer(&mut self) -> Vec<u8> {
        let mut all = Vec::new();
        while let Some((at, news)) = self.driver.news.pop_front() {
            match news {
                News::Answer(bytes, why) => {
                    self.characters += bytes.len() as u64;
                    all.extend(bytes);
                    self.why = why;
                }
                News::Sent(bytes) => {
                    self.characters += bytes.len() as u64;
                    all.extend(bytes);
                }
                News::Warning(warning) => self.warnings.push((at, warning)),
                News::Begun(_) | News::Ignored(_) | News::Line(_) | News::Told(_) => {}
            }
        }
        all
    }

    /// Sends a line.
    fn send(&mut self, line: &[u8]) {
        self.commands += 1;
        self.warned = self.warnings.len();
        self.characters += line.len() as u64;
        if self.keeps_times {
            self.last = line.to_vec();
        }
        let travel = self.handling.model().family().travel_of(line);
        self.driver.meter.references = matches!(travel, Travel::Reference(_));
        self.driver.send(line);
    }
}

impl Channel for Virtual {
    type Broken = Halt;

    fn command(&mut self, line: &[u8]) -> Result<Vec<u8>, Halt> {
        self.send(line);
        let mut answer = Vec::new();
        loop {
            answer.extend(self.answer());
            if !matches!(self.handling.hear(line, &answer), Heard::Waits | Heard::Part) {
                return Ok(answer);
            }
            // What is not for this controller gets no answer.
            if self.driver.device().is_idle() {
                return Ok(answer);
            }
            self.driver.advance()?;
        }
    }

    fn pass(&mut self, line: &[u8]) -> Result<Vec<u8>, Halt> {
        self.send(line);
        let mut said = Vec::new();
        let begun = self.driver.now();
        loop {
            self.driver.pass(UNIT)?;
            said.extend(self.answer());
            let waited = self.driver.now() - begun;
            if !passes_later(line) || passed(&said) || waited > RUN_UP {
                return Ok(said);
            }
        }
    }

    fn handling(&self) -> &Handling {
        &self.handling
    }

    fn wait(&mut self, time: Duration) -> Result<(), Halt> {
        self.driver.pass(time)
    }

    /// Only a signal that is still to come, or its effects, can change something.
    fn rest(&mut self, _longest: Duration) -> Result<Vec<u8>, Halt> {
        match (self.driver.device().is_idle(), self.driver.next_signal()) {
            (false, _) => self.driver.advance()?,
            (true, Some(at)) => self.driver.pass(at - self.driver.now())?,
            (true, None) => return Err(Halt::Waiting),
        }
        Ok(self.answer())
    }

    fn reference_is_false(&mut self) -> bool {
        let said = self.warnings.iter().skip(self.warned);
        said.into_iter().any(|(_, warning)| matches!(warning, Warning::FalseReference { .. }))
    }

    /// It is seen without asking.
    fn spindle(&mut self) -> Result<Option<bool>, Halt> {
        let view = self.driver.device().view(self.driver.now());
        Ok(self.handling.spindle_shown().and_then(|(port, bit)| {
            let shown = view.ports.iter().find(|shown| shown.input && shown.port == port)?;
            Some(shown.value >> bit & 1 == 1)
        }))
    }

    fn polled(&mut self, test: InputTest, read: u8) {
        self.polled = Some((test, read));
    }

    fn begins(&mut self, line: u32, is_rapid: bool) {
        self.polled = None;
        let is_new = std::mem::replace(&mut self.line, line) != line;
        let now = self.driver.now();
        if let Some(drawing) = self.driver.drawing.as_mut() {
            drawing.is_rapid = is_rapid;
            if let Some(number) = self.tools.get(&line).filter(|_| is_new) {
                drawing.plot.tool(now, format!("tool {number} is put in, line {line}"));
            }
        }
        if self.keeps_times && self.lines.last().is_none_or(|(last, _)| *last != line) {
            self.lines.push((line, self.elapsed()));
        }
    }

    fn done(&mut self) {
        let millis = u32::try_from(self.elapsed().as_millis()).unwrap_or(u32::MAX);
        if self.keeps_times {
            let sent = std::mem::take(&mut self.last);
            self.did.push(Did { line: self.line, millis, sent });
        }
    }
}
