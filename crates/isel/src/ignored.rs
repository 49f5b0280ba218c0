//! Why a button at the panel did nothing.

use vimc4_plant::PlantSignal;

use crate::Controller;
use crate::why::Why;

impl Controller {
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
            PlantSignal::On if panel.emergency_stop => Some("the emergency stop is pressed"),
            PlantSignal::On if self.state.cover_forbids() => Some("the cover is open"),
            PlantSignal::On => Some("the power stages are on"),
            _ => None,
        }
    }

    fn why_no_start(&self) -> &'static str {
        if self.state.storing {
            return "a program is being stored";
        }
        if !self.is_at_rest() {
            return "something runs";
        }
        if self.is_stop_held() {
            return "STOP is pressed";
        }
        match self.check_plant() {
            Err(Why::Cover(_)) => "the cover is open",
            Err(_) => "the power stages are off",
            Ok(()) if self.state.remainder.is_some() => {
                "the host goes on with a stopped motion, by S"
            }
            Ok(()) => "no program is stored that can run, and nothing was stopped",
        }
    }
}
