//! The contract of a device: watching changes nothing, extra wake-ups change nothing, splitting
//! the input changes nothing, and a snapshot continues anywhere.

use vimc4_device::{Device, Input, Kinds, SignalId, Time};

use super::{Random, Record, drain, run_to};

/// Something that happens at a time.
#[derive(Clone, Debug)]
pub(crate) enum Act {
    Bytes(Vec<u8>),
    Signal(SignalId, i32),
    Power(bool),
}

fn perform(device: &mut impl Device, record: &mut Record, at: Time, act: &Act) {
    run_to(device, record, at);
    match act {
        Act::Bytes(bytes) => device.handle(Input::Bytes(bytes), at),
        Act::Signal(id, value) => device.handle(Input::Signal(*id, *value), at),
        Act::Power(on) => device.handle(Input::Power(*on), at),
    }
    drain(device, record);
}

/// Lets these things happen to a device that nobody watches, in several ways that must come to
/// the same; returns it as it is three seconds later.
pub(crate) fn hold<D: Device + Clone>(blind: D, acts: &[(Time, Act)], random: &mut Random) -> D {
    let end = acts.last().map_or(Time::ZERO, |(at, _)| at.after_nanos(3_000_000_000));

    // As it is: nobody watches, woken when it asks.
    let mut plain = blind.clone();
    let mut record = Record::default();
    let mut snapshots = Vec::new();
    let mut heard = Vec::new();
    for (at, act) in acts {
        perform(&mut plain, &mut record, *at, act);
        snapshots.push(plain.state().clone());
        heard.push(record.said.len());
    }
    run_to(&mut plain, &mut record, end);
    plain.handle(Input::Wake, end);
    drain(&mut plain, &mut record);

    // Everything watched, every step enumerated, woken at random, input in single bytes.
    let mut watched = blind.clone();
    watched.watch(Kinds::ALL);
    let mut again = Record::default();
    let mut now = Time::ZERO;
    for (at, act) in acts {
        for _ in 0..random.range(0, 3) {
            let early = now.after_nanos(random.next() % (at.nanos_since(now) + 1));
            run_to(&mut watched, &mut again, early);
            watched.handle(Input::Wake, early);
            let view = watched.view(early);
            assert!(view.at >= early);
            now = early;
        }
        now = *at;
        match act {
            Act::Bytes(bytes) => {
                for byte in bytes {
                    perform(&mut watched, &mut again, *at, &Act::Bytes(vec![*byte]));
                }
            }
            other => perform(&mut watched, &mut again, *at, other),
        }
    }
    run_to(&mut watched, &mut again, end);
    watched.handle(Input::Wake, end);
    drain(&mut watched, &mut again);
    same_said(&again.said, &record.said);
    assert_eq!(again.flash, record.flash, "flash changes differ");
    assert!(watched.state() == plain.state(), "states differ");

    // From a snapshot anywhere the rest is the same.
    let place = random.range(0, acts.len() as i64 - 1) as usize;
    let mut resumed = blind;
    resumed.restore(snapshots[place].clone());
    let mut rest = Record::default();
    for (at, act) in &acts[place + 1..] {
        perform(&mut resumed, &mut rest, *at, act);
    }
    run_to(&mut resumed, &mut rest, end);
    resumed.handle(Input::Wake, end);
    drain(&mut resumed, &mut rest);
    same_said(&rest.said, &record.said[heard[place]..]);
    assert!(resumed.state() == plain.state(), "states differ after a snapshot");
    resumed
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
