//! The spindle of a job. STOP at the panel switches it off, and going on with the motion does not
//! switch it on again.

use std::time::Duration;

use vimc4_device::Travel;

use super::channel::{Attendant, Channel, Ending};
use crate::run::report::seconds;

/// How often it is switched on again before the job ends.
const TRIES: u32 = 3;

/// Why it is switched on again, for people.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RestartReason {
    /// The job goes on with a motion that was stopped.
    GoesOn,
    /// START at the panel has let the motion go on.
    Started,
    /// It was found off before a motion.
    Found,
}

/// What a job has done with the spindle.
#[derive(Default)]
pub(super) struct SpindleWatch {
    /// The command that has switched it on; `None` while the job has it off.
    on: Option<Vec<u8>>,
    /// How long the job waits behind that command.
    run_up: Duration,
    /// Whether that wait is what comes next.
    is_fresh: bool,
    /// What the controller shows of it while it is on.
    shown: Option<bool>,
    /// Whether the job has waited since, in which a STOP is not answered.
    has_waited: bool,
}

impl SpindleWatch {
    /// A command was carried out.
    pub(super) fn sent<L: Channel>(&mut self, sent: &[u8], link: &mut L) -> Result<(), L::Broken> {
        let travel = link.handling().model().family().travel_of(sent);
        match link.handling().spindle_after(sent) {
            Some(true) => {
                let run_up = self.on.as_ref().map_or(Duration::ZERO, |_| self.run_up);
                let (on, shown) = (Some(sent.to_vec()), link.spindle()?);
                *self = SpindleWatch { on, run_up, is_fresh: true, shown, has_waited: false };
            }
            Some(false) => *self = SpindleWatch::default(),
            // Its speed and its sense may be set behind it.
            None => self.is_fresh &= travel == Travel::None,
        }
        Ok(())
    }

    /// The job has waited: for so long, or for an input or a person.
    pub(super) fn waited(&mut self, time: Option<Duration>) {
        if let Some(time) = time.filter(|_| self.is_fresh) {
            self.run_up = time;
        }
        (self.is_fresh, self.has_waited) = (false, true);
    }

    /// Switches it on again if it is off before a motion.
    pub(super) fn check<L: Channel>(
        &mut self,
        line: u32,
        link: &mut L,
        attendant: &mut dyn Attendant,
    ) -> Result<Option<Ending>, L::Broken> {
        let has_waited = std::mem::take(&mut self.has_waited);
        if !has_waited || self.shown.is_none() || self.is_on(link)? {
            return Ok(None);
        }
        self.put_back(line, RestartReason::Found, link, attendant)
    }

    /// Whether the job has it on.
    pub(super) fn is_wanted(&self) -> bool {
        self.on.is_some()
    }

    /// Whether the controller shows that it is on, if the job has it on.
    pub(super) fn is_on<L: Channel>(&self, link: &mut L) -> Result<bool, L::Broken> {
        Ok(self.on.is_none() || self.shown.is_some() && link.spindle()? == self.shown)
    }

    /// Switches it on again, if the job has it on, and lets it run up.
    pub(super) fn put_back<L: Channel>(
        &self,
        line: u32,
        why: RestartReason,
        link: &mut L,
        attendant: &mut dyn Attendant,
    ) -> Result<Option<Ending>, L::Broken> {
        let Some(on) = &self.on else { return Ok(None) };
        let why = match why {
            RestartReason::GoesOn => "STOP at the panel switches the spindle off",
            RestartReason::Started => "START at the panel went on with the spindle off after STOP",
            RestartReason::Found => "STOP at the panel has switched the spindle off",
        };
        let wait = match self.run_up.is_zero() {
            true => String::new(),
            false => format!(", and runs up for {}", seconds(self.run_up)),
        };
        attendant.tell(&format!("line {line}: {why}; it is switched on again{wait}"));
        for _ in 0..TRIES {
            let answer = link.command(on)?;
            attendant.answered(line, on, &answer);
            if answer != link.handling().done {
                return Ok(Some(Ending::Refused { line, sent: on.clone(), answer }));
            }
            if !self.run_up.is_zero() {
                link.wait(self.run_up)?;
            }
            if self.shown.is_none() || self.is_on(link)? {
                return Ok(None);
            }
        }
        let why = "the spindle does not stay on".to_owned();
        Ok(Some(Ending::Impossible { line, why }))
    }
}
