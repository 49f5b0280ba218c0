//! A port that is simulated: the player of a real one, played with a model, in virtual time.
//!
//! What fails here cannot be played through a real port either, and what a model with another
//! value of its profile gives here is what a controller with that value gives there.

use vimc4_device::{Device, Event, Input, Kinds, Output, Point, Time};

use crate::player::{Miss, Next, Player, PortStep, Timing};
use crate::travel::Travel;

/// How much happens in a rehearsal before it counts as one that never ends.
const MOST_WAKES: u32 = 1_000_000;

/// What a rehearsal has shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rehearsed {
    /// When each expected reply was complete: step of the session, ns on the stopwatch.
    pub times: Vec<(usize, u64)>,
    /// How much farther the axes are in the end, from where they began, than the counters say.
    pub offset: Point,
}

/// Plays the steps on a device. The port holds up everything that is sent for `delay`
/// nanoseconds, and then the player for as long.
///
/// # Errors
///
/// What a player at a port would see instead of what must come.
pub fn rehearse<D: Device>(
    device: D,
    steps: &[PortStep],
    timing: Timing,
    delay: u64,
) -> Result<Rehearsed, Miss> {
    play(device, steps, timing, delay, false)
}

/// Like [`rehearse`], with a port that keeps back what the device has no room for.
///
/// # Errors
///
/// What a player at a port would see instead of what must come.
pub fn rehearse_with_handshake<D: Device>(
    device: D,
    steps: &[PortStep],
    timing: Timing,
    delay: u64,
) -> Result<Rehearsed, Miss> {
    play(device, steps, timing, delay, true)
}

fn play<D: Device>(
    mut device: D,
    steps: &[PortStep],
    timing: Timing,
    delay: u64,
    handshake: bool,
) -> Result<Rehearsed, Miss> {
    device.watch(Kinds::MOTION);
    let mut travel = Travel::default();
    let mut player = Player::new(steps, timing);
    let mut now = device.now();
    let mut wakes = 0;
    let mut kept_back = Vec::new();
    handle(&mut device, &mut player, &mut travel, Input::Wake, now);
    loop {
        match player.next(now) {
            Next::Send(bytes) => {
                now = now.after_nanos(delay);
                kept_back.extend_from_slice(bytes);
                pass(&mut device, &mut player, &mut travel, &mut kept_back, handshake, now);
                player.sent(now);
                now = now.after_nanos(delay);
                handle(&mut device, &mut player, &mut travel, Input::Wake, now);
            }
            Next::Wait(until) => {
                wakes += 1;
                // A model that never comes to rest is not waited for event by event.
                let due = device.wake().filter(|due| *due <= until && wakes <= MOST_WAKES);
                now = due.unwrap_or(until);
                handle(&mut device, &mut player, &mut travel, Input::Wake, now);
                pass(&mut device, &mut player, &mut travel, &mut kept_back, handshake, now);
            }
            Next::Over => {
                let place = travel.place(now);
                let counters = counters(&device);
                let offset = std::array::from_fn(|axis| place[axis] - counters[axis]);
                return player.outcome().map(|times| Rehearsed { times, offset });
            }
        }
    }
}

/// Hands the device what is kept back for it, as far as it has room.
fn pass<D: Device>(
    device: &mut D,
    player: &mut Player<'_>,
    travel: &mut Travel,
    kept_back: &mut Vec<u8>,
    handshake: bool,
    now: Time,
) {
    while !kept_back.is_empty() {
        let room = if handshake { device.room(true) } else { usize::MAX };
        let taken: Vec<u8> = kept_back.drain(..room.min(kept_back.len())).collect();
        if taken.is_empty() {
            return;
        }
        handle(device, player, travel, Input::Bytes(&taken), now);
    }
}

fn handle<D: Device>(
    device: &mut D,
    player: &mut Player<'_>,
    travel: &mut Travel,
    input: Input<'_>,
    now: Time,
) {
    device.handle(input, now);
    loop {
        match device.poll_output() {
            Output::Bytes(at, bytes) => player.received(&bytes, at),
            Output::Event(at, Event::Motion(motion)) => travel.watch(at, &motion),
            Output::Flash(..) | Output::Event(..) => {}
            Output::Wake(_) => return,
        }
    }
}

/// The step counters.
pub fn counters(device: &impl Device) -> Point {
    let mut counters = Point::default();
    for axis in device.view(device.now()).axes {
        let place = vimc4::axis(&axis.name).and_then(|n| counters.get_mut(usize::from(n)));
        place.into_iter().for_each(|place| *place = axis.position);
    }
    counters
}

/// Sends lines to a device one after the other, each when it has come to rest, and says what
/// each answered.
pub fn converse<D: Device>(device: &mut D, lines: &[&str]) -> Vec<Vec<u8>> {
    lines.iter().map(|line| send(device, format!("{line}\r").as_bytes())).collect()
}

/// Sends bytes to a device and says what it answers until it has come to rest.
pub fn send<D: Device>(device: &mut D, bytes: &[u8]) -> Vec<u8> {
    device.watch(Kinds::NONE);
    let mut answer = Vec::new();
    let mut input = Input::Bytes(bytes);
    let mut now = device.now();
    for _ in 0..MOST_WAKES {
        device.handle(input, now);
        input = Input::Wake;
        let wake = loop {
            match device.poll_output() {
                Output::Bytes(_, bytes) => answer.extend_from_slice(&bytes),
                Output::Flash(..) | Output::Event(..) => {}
                Output::Wake(wake) => break wake,
            }
        };
        match wake {
            Some(due) => now = due,
            None => break,
        }
    }
    answer
}
