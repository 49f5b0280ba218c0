//! Why a button at the panel did nothing, and what a control code does now.

use vimc4_isel_wire::Control;
use vimc4_plant::PlantSignal;

use crate::activity::{Activity, Phase, PortCondition, Purpose};
use crate::axes::AXIS_NAMES;
use crate::firmware::Firmware;
use crate::model::{StopInMoveUntil, StopInReference};
use crate::program::Validity;
use crate::why::{COVER_OPEN, Off, Why};

impl Firmware {
    /// Why a signal that has just taken a level changed nothing, if the reason is not merely that
    /// it already had that level.
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

    /// What a control code does to the present activity.
    pub(crate) fn control_in_words(&self, control: Control) -> String {
        let quirks = &self.state.model.quirks;
        let forgets = quirks.stop_in_move_until == StopInMoveUntil::Forget;
        match (control, &self.state.activity) {
            (Control::Stop, Activity::Referencing(run)) => {
                let axis = AXIS_NAMES.get(run.axis).copied().unwrap_or("?");
                match (run.job, quirks.stop_in_reference) {
                    (Purpose::Program, StopInReference::End) => format!(
                        "stop: the reference run of the program ends, {axis} has no reference \
                         point (stop_in_reference)"
                    ),
                    _ if run.phase == Phase::Free => {
                        format!("stop: the reference run goes on, {axis} has left its switch")
                    }
                    _ if !run.whole => {
                        format!("stop: {axis} stops, and counts as off its limit switch")
                    }
                    (Purpose::Program, StopInReference::Switch) => format!(
                        "stop: taken for the switch of {axis}, the reference run goes on \
                         (stop_in_reference)"
                    ),
                    _ => format!("stop: taken for the switch of {axis}, the reference run goes on"),
                }
            }
            (Control::Break, Activity::Referencing(_)) => {
                "break: the reference run ends at once".to_owned()
            }
            (Control::Stop, Activity::Moving(moving))
                if forgets
                    && matches!(moving.job, Purpose::Command(_))
                    && matches!(moving.plan.until, Some(PortCondition::Mask(_))) =>
            {
                "stop: what moves brakes, and the rest of it is forgotten (stop_in_move_until)"
                    .to_owned()
            }
            _ => control.meaning().to_owned(),
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
