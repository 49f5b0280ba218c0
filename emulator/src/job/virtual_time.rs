//! A job on a virtual controller, in virtual time.

use std::time::Duration;

use vimc4::device::{Controller, Device};
use vimc4::{Time, Warning};

use super::perform::Link;
use crate::run::driver::{Driver, Halt, News};

/// A virtual controller that a job is carried out on.
pub(crate) struct Virtual {
    pub(crate) driver: Driver<Controller>,
    /// What it warned of, and when.
    pub(crate) warnings: Vec<(Time, Warning)>,
    /// Commands that were sent.
    pub(crate) commands: u64,
    /// Characters to and from it.
    pub(crate) characters: u64,
    /// When each thing was done, in ms, if somebody wants to know.
    pub(crate) times: Vec<u32>,
    keeps_times: bool,
    /// The line that is under way.
    pub(crate) line: u32,
}

impl Virtual {
    pub(crate) fn new(driver: Driver<Controller>, keeps_times: bool) -> Virtual {
        Virtual {
            driver,
            warnings: Vec::new(),
            commands: 0,
            characters: 0,
            times: Vec::new(),
            keeps_times,
            line: 0,
        }
    }

    /// The time since it was switched on.
    pub(crate) fn elapsed(&self) -> Duration {
        self.driver.now() - Time::ZERO
    }

    /// Takes the answer, if there is one by now.
    fn answer(&mut self) -> Option<Vec<u8>> {
        while let Some((at, news)) = self.driver.news.pop_front() {
            match news {
                News::Answer(answer) => {
                    self.characters += answer.len() as u64;
                    return Some(answer);
                }
                News::Warning(warning) => self.warnings.push((at, warning)),
                News::Begun(_) | News::Sent(_) | News::Line(_) => {}
            }
        }
        None
    }
}

impl Link for Virtual {
    type Broken = Halt;

    fn command(&mut self, line: &[u8]) -> Result<Vec<u8>, Halt> {
        self.commands += 1;
        self.characters += line.len() as u64;
        self.driver.meter.references = line.starts_with(b"@0R");
        self.driver.send(line);
        loop {
            if let Some(answer) = self.answer() {
                return Ok(answer);
            }
            // What is not for this controller gets no answer.
            if self.driver.device().is_idle() {
                return Ok(Vec::new());
            }
            self.driver.advance()?;
        }
    }

    fn wait(&mut self, time: Duration) -> Result<(), Halt> {
        self.driver.pass(time)
    }

    /// Only a signal that is still to come can change something.
    fn rest(&mut self, _longest: Duration) -> Result<(), Halt> {
        match self.driver.next_signal() {
            Some(at) => self.driver.pass(at - self.driver.now()),
            None => Err(Halt::Waiting),
        }
    }

    fn begins(&mut self, line: u32) {
        self.line = line;
    }

    fn done(&mut self) {
        let millis = u32::try_from(self.elapsed().as_millis()).unwrap_or(u32::MAX);
        if self.keeps_times {
            self.times.push(millis);
        }
    }
}
