//! The contract of a device: watching changes nothing, extra wake-ups change nothing, splitting
//! the input changes nothing, performing single causes changes nothing, and a snapshot continues
//! anywhere.

use vimc4_device::{Device, FlashChange, Harness, Input, Kinds, Line, Output, SignalId, Time};

use super::{Random, said};

/// Something that happens at a time.
#[derive(Clone, Debug)]
pub(crate) enum Act {
    Bytes(Vec<u8>),
    Signal(SignalId, i32),
    Power(bool),
}

impl Act {
    pub(crate) fn input(&self) -> Input<'_> {
        match self {
            Act::Bytes(bytes) => Input::Bytes(bytes),
            Act::Signal(id, value) => Input::Signal(*id, *value),
            Act::Power(on) => Input::Power(*on),
        }
    }
}

/// Lets these things happen to a device that nobody watches, in several ways that must come to
/// the same; returns it as it is three seconds later.
pub(crate) fn hold<D: Device + Clone>(blind: D, acts: &[(Time, Act)], random: &mut Random) -> D {
    let end = acts.last().map_or(Time::ZERO, |(at, _)| at.after_nanos(3_000_000_000));

    // As it is: nobody watches, woken when it asks.
    let mut plain = Harness::new(blind.clone());
    let mut snapshots = Vec::new();
    let mut heard = Vec::new();
    for (at, act) in acts {
        plain.run_to(*at);
        plain.input(act.input());
        snapshots.push(plain.device().state());
        heard.push(said(&plain).len());
    }
    plain.run_to(end);

    // Everything watched, every step enumerated, woken at random, input in single bytes.
    let mut watched = Harness::new(blind.clone()).watching(Kinds::ALL);
    for (at, act) in acts {
        for _ in 0..random.range(0, 3) {
            let now = watched.now();
            watched.run_to(now.after_nanos(random.next() % (at.nanos_since(now) + 1)));
            let view = watched.device().view(watched.now());
            assert!(view.at >= watched.now());
        }
        watched.run_to(*at);
        match act {
            Act::Bytes(bytes) => bytes.iter().for_each(|byte| watched.send(&[*byte])),
            other => watched.input(other.input()),
        }
    }
    watched.run_to(end);
    same_said(&said(&watched), &said(&plain));
    assert!(flash(&watched).eq(flash(&plain)), "flash changes differ");
    assert!(watched.device().state() == plain.device().state(), "states differ");

    // Cause by cause, and each can be looked at; at a paced line too.
    cause_by_cause(&blind, acts, end, random);
    if random.one_in(4) {
        cause_by_cause(&Line::paced(blind.clone()), acts, end, random);
    }

    // From a snapshot anywhere the rest is the same.
    let place = random.range(0, acts.len() as i64 - 1) as usize;
    let mut resumed = Harness::new(blind);
    resumed.restore(snapshots[place].clone());
    for (at, act) in &acts[place + 1..] {
        resumed.run_to(*at);
        resumed.input(act.input());
    }
    resumed.run_to(end);
    same_said(&said(&resumed), &said(&plain)[heard[place]..]);
    let (resumed, plain) = (resumed.into_device(), plain.into_device());
    assert!(resumed.state() == plain.state(), "states differ after a snapshot");
    resumed
}

/// Lets these things happen to a device as a whole, and cause by cause with snapshots between them.
fn cause_by_cause<D: Device + Clone>(
    device: &D,
    acts: &[(Time, Act)],
    end: Time,
    random: &mut Random,
) {
    let mut whole = Harness::new(device.clone()).watching(Kinds::ALL);
    let mut single = whole.clone();
    for (at, act) in acts {
        whole.run_to(*at);
        whole.input(act.input());
        single.plan(*at, act.input());
    }
    whole.run_to(end);
    while single.due().is_some_and(|due| due <= end) {
        let (before, due) = (single.now(), single.due());
        let now = single.step();
        assert!(now >= Some(before) && now >= due, "{due:?} came at {now:?} after {before:?}");
        if random.one_in(20) {
            let state = single.device().state();
            assert_eq!(single.device().view(single.now()).at, single.now());
            single.restore(state);
        }
    }
    single.run_to(end);
    assert!(single.outputs().len() == whole.outputs().len(), "more or less comes out");
    for (one, other) in single.outputs().iter().zip(whole.outputs()) {
        assert_eq!(one, other);
    }
    assert!(single.device().state() == whole.device().state(), "states differ");
}

/// What a device has written, and when.
fn flash<D: Device>(harness: &Harness<D>) -> impl Iterator<Item = (Time, &FlashChange)> {
    harness.outputs().iter().filter_map(|output| match output {
        Output::Flash(at, change) => Some((*at, change)),
        Output::Bytes(..) | Output::Event(..) => None,
    })
}

/// Says where two conversations part.
fn same_said(one: &[(Time, u8)], other: &[(Time, u8)]) {
    let Some(at) = (0..one.len().max(other.len())).find(|&at| one.get(at) != other.get(at)) else {
        return;
    };
    let show = |said: &[(Time, u8)]| {
        let around = &said[at.saturating_sub(20).min(said.len())..(at + 20).min(said.len())];
        let bytes: Vec<u8> = around.iter().map(|(_, byte)| *byte).collect();
        format!("{:?} at {:?}", bytes.escape_ascii().to_string(), said.get(at).map(|(at, _)| *at))
    };
    assert_eq!(show(one), show(other), "byte {at} differs");
}
