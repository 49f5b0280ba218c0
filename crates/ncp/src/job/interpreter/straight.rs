//! Straight movements and speeds.

use super::sink::Sink;
use super::state::{Interpreter, Pace, Refusal};
use crate::geometry::{Delay, Fitted, Steps, Straight, StraightParameters};
use crate::job::place::{Place, Way, counters};
use crate::job::problem::{Problem, SetBy, Why};
use crate::language::{Units, Value};

/// The share of its time that a movement may lose before that is reported.
const MOST_LOST: f64 = 0.1;

impl Interpreter<'_> {
    /// A straight movement to a place, checked.
    pub(super) fn straight(
        &mut self,
        to: Place,
        pace: Pace,
        sink: &mut Sink<'_>,
    ) -> Result<StraightParameters, Refusal> {
        self.warn_of_unreferenced(&to, sink);
        let from = self.state.place;
        self.warn_of_surface(&from, &to, false, sink);
        let cylinder = self.state.cylinder;
        let counters = counters(&to, self.target, cylinder.as_ref());
        let checked = self.check(&to, &counters, sink.span);
        let parameters = self.parameters(&to, &counters, pace, sink);
        // The rest is read as if it had gone there, so that one error is reported once.
        (self.state.place, self.state.counters) = (to, counters);
        if parameters.by[3] != 0 && parameters.by[..3] != [0; 3] {
            self.warn_of_delay(
                Straight::new(parameters).delay(self.target.speeds()),
                Why::AWithOthers,
                sink,
            );
        }
        checked.map(|()| parameters)
    }

    /// Steps and speeds of a straight movement from where the tool is.
    pub(super) fn parameters(
        &mut self,
        to: &Place,
        counters: &Steps,
        pace: Pace,
        sink: &mut Sink<'_>,
    ) -> StraightParameters {
        let state = &self.state;
        let by: Steps = std::array::from_fn(|axis| counters[axis] - state.counters[axis]);
        let lowest = self.target.speeds().lowest;
        let apart = self.target.setup.apart;
        let is_rapid = pace == Pace::Rapid;
        if by == Steps::default() {
            return StraightParameters { by, speed: lowest, a_speed: lowest, is_rapid, apart };
        }
        let way = Way::between(&state.place, to, self.target, state.cylinder.as_ref());
        let turns = by[..3] == [0; 3] && self.state.cylinder.is_none();
        let velocity = match pace {
            Pace::Normal if turns => self.state.turning[0],
            Pace::Rapid if turns => self.state.turning[1],
            _ => self.velocity(pace),
        };
        let (linear, turning) = way.frequencies(velocity);
        // Together with other axes A moves a few steps at a time, as fast as possible.
        let (speed, a_speed) = match (by[..3] != [0; 3], by[3] != 0) {
            (true, false) => (self.fit(linear, pace, sink), lowest),
            (false, _) => (lowest, self.fit(turning, pace, sink)),
            (true, true) => {
                let (a_speed, _) = self.target.speeds().fit(turning);
                (self.fit(linear, pace, sink), a_speed)
            }
        };
        StraightParameters { by, speed, a_speed, is_rapid, apart }
    }

    /// Reports if a movement takes much longer because it is made in pieces.
    pub(super) fn warn_of_delay(&self, delay: Option<Delay>, why: Why, sink: &mut Sink<'_>) {
        let Some(delay) = delay.filter(|delay| delay.share() > MOST_LOST) else { return };
        let percent = libm::round(delay.share() * 100.0) as u32;
        sink.say(Problem::SlowPieces { percent, pieces: delay.pieces, why });
    }

    pub(super) fn velocity(&self, pace: Pace) -> Value {
        match pace {
            Pace::Normal => self.state.normal,
            Pace::Rapid => self.state.rapid,
            Pace::Drill => self.state.drill.speed,
        }
    }

    /// The speed that the controller is given for a frequency in Hz.
    pub(super) fn fit(&mut self, frequency: f64, pace: Pace, sink: &mut Sink<'_>) -> u32 {
        let (given, fitted) = self.target.speeds().fit(frequency);
        self.tell(fitted, frequency, pace, sink);
        given
    }

    /// Reports once for a speed, which needs a frequency in Hz, that it cannot be kept.
    pub(super) fn tell(&mut self, fitted: Fitted, frequency: f64, pace: Pace, sink: &mut Sink<'_>) {
        let speeds = self.target.speeds();
        let wanted = self.velocity(pace);
        let velocity = |given: u32| {
            Value::whole(libm::round(wanted.as_f64() * f64::from(given) / frequency) as i64)
        };
        let set_by = match pace {
            Pace::Normal => SetBy::Velocity,
            Pace::Rapid => SetBy::RapidVelocity,
            Pace::Drill => SetBy::Drill {
                in_mm: self.options.drill_in_mm,
                inch: self.state.units == Units::Inch,
            },
        };
        let told = &mut self.state.told[pace as usize];
        match fitted {
            Fitted::Capped if !told.capped => {
                told.capped = true;
                let asked = libm::round(frequency.max(0.0)) as u64;
                let (given, speed) = (speeds.highest, velocity(speeds.highest));
                sink.say(Problem::SpeedCapped { wanted, asked, given, speed, set_by });
            }
            Fitted::Raised if !told.raised => {
                told.raised = true;
                let asked = Value::thousandths(libm::round(frequency * 1_000.0).max(1.0) as i64);
                let (given, speed) = (speeds.lowest, velocity(speeds.lowest));
                sink.say(Problem::SpeedRaised { wanted, asked, given, speed, set_by });
            }
            _ => {}
        }
    }
}
