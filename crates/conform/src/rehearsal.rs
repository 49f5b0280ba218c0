//! A port that is simulated: the player of a real one, played with a model, in virtual time.
//!
//! A session that fails here cannot be played through a real port either, and a model with another
//! profile value gives here what a controller with that value gives there.

use std::collections::VecDeque;

use vimc4_device::{Device, Event, Harness, Kinds, MAX_CAUSES, Output, Point, Time};

use crate::player::{Miss, Next, Player, PortStep, Timing};
use crate::travel::Travel;

/// What a rehearsal has shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rehearsed {
    /// When each expected reply was complete: step of the session, ns on the stopwatch.
    pub times: Vec<(usize, u64)>,
    /// How much farther the axes are from their beginning, in the end, than the counters say.
    pub offset: Point,
}

/// How late a port is, ns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Delays {
    /// The player is held up before what it sends has left, and for as long after that.
    pub player: u64,
    /// The delays of sent bytes, in turn: they arrive closer together, or farther apart, than they
    /// were sent.
    pub way: [u64; 2],
}

impl Delays {
    /// A port that holds up the player only.
    #[must_use]
    pub fn of_player(player: u64) -> Delays {
        Delays { player, way: [0, 0] }
    }
}

/// Plays the steps on a device.
///
/// # Errors
///
/// What a player at a port would see instead of what must come.
pub fn rehearse<D: Device>(
    device: D,
    steps: &[PortStep],
    timing: Timing,
    delays: Delays,
) -> Result<Rehearsed, Miss> {
    play(device, steps, timing, delays, false)
}

/// Like [`rehearse`], with a port that keeps back what the device has no room for.
///
/// # Errors
///
/// What a player at a port would see instead of what must come.
pub(crate) fn rehearse_with_handshake<D: Device>(
    device: D,
    steps: &[PortStep],
    timing: Timing,
    delays: Delays,
) -> Result<Rehearsed, Miss> {
    play(device, steps, timing, delays, true)
}

fn play<D: Device>(
    device: D,
    steps: &[PortStep],
    timing: Timing,
    delays: Delays,
    handshake: bool,
) -> Result<Rehearsed, Miss> {
    let mut port = Port {
        harness: Harness::new(device).watching(Kinds::MOTION),
        player: Player::new(steps, timing),
        travel: Travel::default(),
        on_its_way: VecDeque::new(),
        kept_back: Vec::new(),
        handshake,
    };
    port.run_to(port.harness.now());
    let mut turns = delays.way.into_iter().cycle();
    let mut wakes = 0;
    loop {
        let now = port.harness.now();
        match port.player.next(now) {
            Next::Send(bytes) => {
                let sent = now.after_nanos(delays.player);
                port.on_its_way.push_back((sent.after_nanos(turns.next().unwrap_or(0)), bytes));
                port.run_to(sent);
                port.player.sent(sent);
                port.run_to(sent.after_nanos(delays.player));
            }
            Next::Wait(until) => {
                wakes += 1;
                // A model that never comes to rest is not followed event by event.
                let due = port.harness.due().filter(|due| *due <= until && wakes <= MAX_CAUSES);
                let arrives = port.on_its_way.front().map_or(until, |(at, _)| until.min(*at));
                port.run_to(due.map_or(arrives, |due| due.min(arrives)));
            }
            Next::Over => {
                let place = port.travel.place(now);
                let counters = counters(port.harness.device());
                let offset = std::array::from_fn(|axis| place[axis] - counters[axis]);
                return port.player.outcome().map(|times| Rehearsed { times, offset });
            }
        }
    }
}

/// A device at a port, and the player that uses it.
struct Port<'s, D> {
    harness: Harness<D>,
    player: Player<'s>,
    travel: Travel,
    /// What has been sent, with the times of its arrival.
    on_its_way: VecDeque<(Time, &'s [u8])>,
    /// What has arrived but does not fit into the device yet.
    kept_back: Vec<u8>,
    handshake: bool,
}

impl<D: Device> Port<'_, D> {
    /// Lets time pass, with what arrives meanwhile, and then hands the device what is kept back for
    /// it, as far as it has room.
    fn run_to(&mut self, at: Time) {
        while let Some(&(arrives, bytes)) = self.on_its_way.front().filter(|(due, _)| *due <= at) {
            self.on_its_way.pop_front();
            self.harness.run_to(arrives);
            self.kept_back.extend_from_slice(bytes);
            self.hand_over();
        }
        self.harness.run_to(at);
        self.hand_over();
    }

    fn hand_over(&mut self) {
        while !self.kept_back.is_empty() {
            let room = if self.handshake { self.harness.device().room(true) } else { usize::MAX };
            if room == 0 {
                break;
            }
            let taken: Vec<u8> = self.kept_back.drain(..room.min(self.kept_back.len())).collect();
            self.harness.send(&taken);
        }
        for output in self.harness.drain() {
            match output {
                Output::Bytes(at, bytes) => self.player.received(&bytes, at),
                Output::Event(stamp, Event::Motion(motion)) => self.travel.watch(stamp.at, &motion),
                Output::Flash(..) | Output::Event(..) => {}
            }
        }
    }
}

/// The step counters.
pub fn counters(device: &impl Device) -> Point {
    let mut counters = Point::default();
    for axis in device.view(device.now()).axes {
        let place = counters.get_mut(usize::from(axis.index));
        place.into_iter().for_each(|place| *place = axis.position);
    }
    counters
}

/// Sends lines one after the other, each when the device has come to rest, and says what each
/// answered.
pub fn converse<D: Device>(harness: &mut Harness<D>, lines: &[&str]) -> Vec<Vec<u8>> {
    lines.iter().map(|line| ask(harness, format!("{line}\r").as_bytes())).collect()
}

/// Sends bytes and returns what is answered until the device comes to rest or proves not to.
pub fn ask<D: Device>(harness: &mut Harness<D>, bytes: &[u8]) -> Vec<u8> {
    harness.ask(bytes).unwrap_or_else(|_endless| harness.take_bytes())
}
