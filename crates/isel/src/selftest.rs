//! The self-test: version, every axis out and back, the ASCII characters, and an echo that only a
//! reset ends (99 2.2.20). Older cards go back to commands instead.

use vimc4_motion::Path;

use crate::activity::{Activity, Plan, Purpose};
use crate::axes::{AXES, along};
use crate::firmware::Firmware;
use crate::model::{CommandSet, SelfTestEnd};
use crate::outcome::Outcome;

/// How far each axis moves out and back: one turn of a motor in half-steps.
const STEPS: i64 = 400;

impl Firmware {
    /// Begins the self-test. It moves the axes even if they are not configured, because none is
    /// when it is begun at the panel.
    pub(crate) fn begin_self_test(&mut self) -> Outcome {
        self.send(self.version_text().into());
        let mut parts = std::collections::VecDeque::new();
        for axis in 0..AXES {
            for way in [STEPS, -STEPS] {
                parts.push_back((Path::Line(along(axis, way)), self.state.speeds[axis]));
            }
        }
        self.begin_plan(Purpose::SelfTest, Plan { parts, until: None })
    }

    /// The axes have moved: the characters, then what comes after them.
    pub(crate) fn self_test_ended(&mut self) {
        let mut text: Vec<u8> = (b' '..=b'~').collect();
        text.extend_from_slice(b"\r\n");
        self.send(text.into());
        self.state.activity = match self.state.model.quirks.self_test_end {
            SelfTestEnd::Echo => Activity::Echo,
            SelfTestEnd::Commands => Activity::Idle,
        };
    }

    /// The controller has been switched on: START, still held, begins the self-test (99 2.2.20).
    pub(crate) fn powered_up(&mut self) -> Outcome {
        let start = self.state.plant.panel().start;
        if start && self.has_self_test() && self.check_plant().is_ok() {
            return self.begin_self_test();
        }
        Outcome::Nothing
    }

    pub(crate) fn has_self_test(&self) -> bool {
        self.state.model.command_set != CommandSet::ImcXx
    }
}
