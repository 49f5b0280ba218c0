//! What is done to a device and is not a command, and what comes of it.

use std::borrow::Cow;

use vimc4_device::{Device, Input, Kinds, Time};

use crate::drive::Drive;
use crate::rig::Rig;
use crate::{Deed, Effect, News, Source};

/// Performs a deed on the device, and tells its source whether it has had any effect.
pub(crate) fn act<D: Device + Clone>(
    drive: &mut Drive<D>,
    by: &Source,
    deed: Deed,
    inputs: &[Input<'_>],
) -> Effect {
    let at = drive.catch_up_to_present();
    let rig = &mut drive.rig;
    rig.pass_time(at);
    let told = rig.is_wanted(Kinds::COMMAND);
    if told {
        rig.tell_news(at, News::Deed { by: by.clone(), deed: deed.clone() });
    }
    let effect = effect(rig, by, inputs, at);
    if told && let Effect::Nothing { why } = effect {
        let by = by.clone();
        rig.tell_news(at, News::NoEffect { by, deed, why: why.map(Cow::Borrowed) });
    }
    effect
}

/// Gives the device inputs that are no deed: it tells of their effect itself.
pub(crate) fn give<D: Device + Clone>(
    drive: &mut Drive<D>,
    by: &Source,
    inputs: &[Input<'_>],
) -> Effect {
    let at = drive.catch_up_to_present();
    drive.rig.pass_time(at);
    effect(&mut drive.rig, by, inputs, at)
}

fn effect<D: Device>(rig: &mut Rig<D>, by: &Source, inputs: &[Input<'_>], at: Time) -> Effect {
    let changed = changes(rig, by, inputs, at);
    rig.disappoint();
    Effect::of(&rig.device, inputs, at, changed)
}

/// Something happens to the device, of which all that is due by then has been done. Returns
/// whether the device is another one than before, or has said or stored something.
fn changes<D: Device>(rig: &mut Rig<D>, by: &Source, inputs: &[Input<'_>], at: Time) -> bool {
    let (before, said) = (rig.device.state(), rig.said);
    let was_paused = rig.is_paused();
    for input in inputs {
        if rig.is_paused() && !was_paused {
            rig.hold_back(*input, Some(by));
        } else {
            rig.input(*input, at, Some(by));
        }
    }
    rig.said != said || rig.device.state() != before
}

/// Bytes reach the device. The sender of those that act at once is reported.
pub(crate) fn send<D: Device>(
    rig: &mut Rig<D>,
    bytes: &[u8],
    at: Time,
    source: impl FnOnce() -> Source,
) {
    let urgent =
        rig.is_wanted(Kinds::COMMAND) && bytes.iter().any(|byte| rig.device.is_urgent(*byte));
    // Finding out their sender takes some time.
    let by = (rig.sinks.wants().inputs || urgent).then(source);
    if rig.is_paused() {
        return rig.give(Input::Bytes(bytes), by.as_ref());
    }
    let Some(by) = by.as_ref().filter(|_| urgent) else {
        return rig.input(Input::Bytes(bytes), at, by.as_ref());
    };
    let mut rest = bytes;
    while let Some(place) = rest.iter().position(|byte| rig.device.is_urgent(*byte)) {
        let (before, after) = rest.split_at(place);
        if !before.is_empty() {
            rig.input(Input::Bytes(before), at, Some(by));
        }
        if rig.is_paused() {
            return rig.hold_back(Input::Bytes(after), Some(by));
        }
        let (first, after) = after.split_at(1);
        let deed = Deed::Byte(first.first().copied().unwrap_or_default());
        rig.pass_time(at);
        rig.tell_news(at, News::Deed { by: by.clone(), deed: deed.clone() });
        // A device may answer such a byte although nothing comes of it.
        let before = rig.device.state();
        rig.input(Input::Bytes(first), at, Some(by));
        if rig.device.state() == before {
            let why = if rig.is_off() {
                "the power is off"
            } else {
                "there is nothing that it could end"
            };
            rig.tell_news(at, News::NoEffect { by: by.clone(), deed, why: Some(why.into()) });
        }
        rest = after;
    }
    if rig.is_paused() {
        rig.hold_back(Input::Bytes(rest), Some(by));
    } else if !rest.is_empty() {
        rig.input(Input::Bytes(rest), at, Some(by));
    }
}
