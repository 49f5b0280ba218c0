//! What comes of something that is done to a device.

use vimc4_device::{Device, Fault, FaultStage, Faulting, Input, Mishap, Ruling, SignalId, Time};

/// The outcome of an action.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Something has changed, or was sent.
    Something,
    /// The device is as it was.
    Nothing {
        /// Why, as far as that is known.
        why: Option<&'static str>,
    },
}

impl Effect {
    /// What has come of inputs, by which a device has become another one, or has said something, or not.
    pub fn of<D: Device>(device: &D, inputs: &[Input<'_>], at: Time, has_changed: bool) -> Effect {
        let in_vain = match inputs {
            [Input::Fault(Faulting::Begin(_, fault))] if has_changed => device.why_in_vain(fault),
            _ => None,
        };
        match has_changed {
            true if in_vain.is_some() => Effect::Nothing { why: in_vain },
            true => Effect::Something,
            false => Effect::Nothing { why: why_without_effect(device, inputs, at) },
        }
    }
}

/// Why there is not one fault more than [`MOST_FAULTS`](vimc4_device::MOST_FAULTS).
pub const NO_MORE_FAULTS: &str =
    "no more than 1,000 faults at once; end those that are no longer needed";

/// Why there are not more rules than [`MOST_RULES`](vimc4_device::MOST_RULES).
pub const NO_MORE_RULES: &str =
    "no more than 1,000 rules at once; end those that are no longer needed";

/// Why inputs have changed nothing.
pub fn why_without_effect<D: Device>(
    device: &D,
    inputs: &[Input<'_>],
    at: Time,
) -> Option<&'static str> {
    // Nothing has changed, so what is so now was so before.
    let is_so = |id: SignalId, value: i32| {
        let signals = device.view(at).signals;
        signals.iter().any(|signal| signal.id == id && signal.value == Some(value))
    };
    let already = "it was so already";
    let faults = device.faults();
    let holds = |what: &dyn Fn(&Mishap) -> bool| {
        faults.iter().any(|view| match &view.fault {
            Fault::Machine(fault) => view.stage == FaultStage::Strikes && what(&fault.mishap),
            _ => false,
        })
    };
    let held = "a fault holds it; `faults` says which";
    match inputs {
        [Input::Signal(set, _)]
            if holds(&|it| matches!(it, Mishap::Hold { signal, .. } if signal == set)) =>
        {
            Some(held)
        }
        [Input::Power(_)] if holds(&|it| matches!(it, Mishap::Power)) => Some(held),
        [Input::Signal(signal, value)] if is_so(*signal, *value) => Some(already),
        [Input::Fault(Faulting::Begin(number, _))]
            if faults.iter().all(|view| view.number != *number) =>
        {
            Some(NO_MORE_FAULTS)
        }
        [Input::Rule(Ruling::Begin(..))] => Some(NO_MORE_RULES),
        [Input::Fault(Faulting::End(_))] => Some("there is no such fault"),
        [Input::Fault(Faulting::EndAll)] => Some("nothing is wrong"),
        [Input::Rule(Ruling::End(_))] => Some("there is no such rule"),
        [Input::Rule(Ruling::EndAll)] => Some("there are no rules"),
        [Input::Rule(Ruling::EndAll), ..] => Some("there are no rules, and nothing is wrong"),
        // Of several things each may have undone the one before: the first reason that there is.
        _ => inputs
            .iter()
            .find_map(|input| match input {
                Input::Signal(signal, value) => device.why_without_effect(*signal, *value),
                _ => None,
            })
            .or((inputs.len() == 1).then_some(already)),
    }
}
