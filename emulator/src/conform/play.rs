//! Plays one session after the other, and keeps track of where the axes are and what the memory
//! holds.

use std::time::Duration;

use vimc4_conform::choice::{Allowed, Chooser, Plan, Row};
use vimc4_conform::explain::{Candidate, explain};
use vimc4_conform::player::Timing;
use vimc4_conform::travel::Travel;
use vimc4_device::Point;

use super::chosen::Choice;
use super::client::{Client, ClientError};
use super::report::{ConformReport, Outcome};
use crate::port::Port;

/// How long erasing may take.
const ERASING: Duration = Duration::from_secs(30);
/// How long a motion that failed may take to brake.
const BRAKING: Duration = Duration::from_millis(500);
/// How often a controller in an unknown state is asked where it is.
const TRIES: usize = 5;

/// Plays sessions at a port.
pub(super) struct Conductor<'a> {
    client: Client,
    chooser: &'a Chooser,
    candidates: Vec<Candidate>,
    timing: Timing,
    allowed: Allowed,
    /// Whether the memory is known to be erased.
    erased: bool,
    /// Whether the memory holds what a session left.
    used: bool,
    /// Whether the axes are known to be where they were in the beginning.
    home: bool,
}

impl<'a> Conductor<'a> {
    pub(super) fn new(
        client: Client,
        chooser: &'a Chooser,
        candidates: Vec<Candidate>,
        timing: Timing,
        allowed: Allowed,
    ) -> Conductor<'a> {
        let (erased, used, home) = (false, false, true);
        Conductor { client, chooser, candidates, timing, allowed, erased, used, home }
    }

    pub(super) fn port(&self) -> &Port {
        self.client.port()
    }

    pub(super) fn client(&self) -> &Client {
        &self.client
    }

    /// Halts motions, as far as the line can.
    pub(super) fn halt(&mut self) {
        self.client.halt();
    }

    /// Plays them all. An error comes with the session that was being played.
    pub(super) fn play(
        &mut self,
        choices: &[Choice<'_>],
        report: &mut ConformReport,
    ) -> Result<(), (ClientError, Option<String>)> {
        let other = self.client.find().map_err(|error| (error, None))?;
        if let Some(speed) = other {
            report.note(&format!("it answers at {speed} baud; going on at that speed"));
        }
        for Choice { session, plan } in choices {
            match plan {
                Ok(plan) => {
                    let outcome = self.session(plan);
                    let outcome = outcome.map_err(|error| (error, Some(session.id.clone())))?;
                    report.played(session, plan, &outcome);
                }
                Err(reason) => {
                    let (general, detail) = (reason.in_general(), reason.to_string());
                    report.not_played(session, reason.key(), &general, &detail);
                }
            }
        }
        self.leave().map_err(|error| (error, Some("the last reset".to_owned())))
    }

    fn session(&mut self, plan: &Plan) -> Result<Outcome, ClientError> {
        for row in &plan.rows {
            if plan.moves && !self.home {
                return Ok(Outcome::Skipped("where the axes are is not known any more"));
            }
            self.client.reset()?;
            if row.fresh && !self.erased && !self.erase()? {
                return Ok(Outcome::Skipped("the memory could not be erased"));
            }
            self.erased &= !row.writes;
            self.used |= row.writes;
            if let Err(miss) = self.client.play(row)? {
                if plan.moves {
                    self.client.abandon(BRAKING)?;
                    let place = self.place(row, miss.step)?;
                    self.back(place, row)?;
                }
                let causes = explain(&self.candidates, &row.steps, self.timing, &miss);
                return Ok(Outcome::Failed(miss, causes));
            }
            if !row.travel.is_nothing() {
                // After a stop on the way, the position differs from the model's.
                let last = row.offsets.last().map_or(0, |(step, _)| *step);
                let place = self.place(row, last)?.unwrap_or(row.end);
                self.back(Some(place), row)?;
            }
        }
        Ok(Outcome::Passed)
    }

    /// Erases the memory of a controller that has just been reset; says whether it could.
    fn erase(&mut self) -> Result<bool, ClientError> {
        self.erased = self.client.obeys(self.chooser.erase(), ERASING)?;
        self.used &= !self.erased;
        self.client.reset()?;
        Ok(self.erased)
    }

    /// Where the axes are after a step of a session, seen from where they were before the row;
    /// `None` if the controller does not say.
    fn place(&mut self, row: &Row, step: usize) -> Result<Option<Point>, ClientError> {
        let mut ways = row.travel.low.iter().zip(&row.travel.high);
        let axes = ways.rposition(|way| way != (&0, &0)).map_or(0, |last| last + 1);
        for _ in 0..TRIES {
            let Some(places) = self.client.places()? else { continue };
            if places.len() < axes {
                return Ok(None);
            }
            let offset = row.offsets.iter().rev().find(|(at, _)| *at <= step);
            let offset = offset.map_or(Point::default(), |(_, offset)| *offset);
            let place = |axis: usize| places.get(axis).copied().unwrap_or_default() + offset[axis];
            return Ok(Some(std::array::from_fn(place)));
        }
        Ok(None)
    }

    /// Brings the axes back from where they are to where they were.
    fn back(&mut self, place: Option<Point>, row: &Row) -> Result<(), ClientError> {
        let Some(place) = place else {
            self.home = false;
            return Ok(());
        };
        let mut way = Travel::default();
        way.low = place.map(|steps| steps.min(0));
        way.high = place.map(|steps| steps.max(0));
        if way.is_nothing() {
            return Ok(());
        }
        self.client.reset()?;
        // No session can have led outside the envelope.
        self.home = self.allowed.contains(&way)
            && self.client.go(place.map(|steps| -steps), row.travel.top.max(20))?;
        Ok(())
    }

    /// Leaves the controller as after power-on, and no program of a session in it.
    fn leave(&mut self) -> Result<(), ClientError> {
        self.client.reset()?;
        if self.used && !self.chooser.erase().is_empty() {
            self.erase()?;
        }
        Ok(())
    }
}
