//! Why a button at the panel did nothing.

use vimc4_plant::PlantSignal;

use crate::firmware::Firmware;
use crate::program::Validity;
use crate::why::{COVER_OPEN, Off, Why};

impl Firmware {
    /// Why a signal that has just taken a level changed nothing, where there is more to say than
    /// that it had it already.
    pub(crate) fn why_ignored(&self, signal: PlantSignal, level: bool) -> Option<&'static str> {
        if !level {
            return None;
        }
        let panel = self.state.plant.panel();
        match signal {
            PlantSignal::Start | PlantSignal::Stop | PlantSignal::On if !self.state.powered => {
                Some("the power is off")
            }
            PlantSignal::Start => Some(self.why_no_start()),
            PlantSignal::Stop => Some("nothing moves and no program runs"),
            PlantSignal::On if panel.emergency_stop => Some(Off::EmergencyStop.in_words()),
            PlantSignal::On if self.state.cover_forbids() => Some(COVER_OPEN),
            PlantSignal::On if !self.state.motors_on() => Some(self.state.why_off().in_words()),
            PlantSignal::On => Some("the stages are on already"),
            _ => None,
        }
    }

    fn why_no_start(&self) -> &'static str {
        if self.state.storing {
            return "a program is being stored";
        }
        if !self.state.is_at_rest() {
            return "the controller is busy";
        }
        if self.state.is_stop_held() {
            return "STOP is pressed";
        }
        match self.check_plant() {
            Err(Why::Cover(_)) => COVER_OPEN,
            Err(_) => self.state.why_off().in_words(),
            Ok(()) if self.state.remainder.is_some() => {
                "only the host can resume a stopped motion, with S (start_resumes_dnc)"
            }
            Ok(()) => match self.state.flash.program.as_ref().map(|program| program.validity) {
                Some(Validity::Valid) => "the stored program has ended at once",
                _ => self.nothing_to_start(),
            },
        }
    }
}
