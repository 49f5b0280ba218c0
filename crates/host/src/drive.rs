//! Time passes for a device.

use std::collections::VecDeque;
use std::fmt;
use std::time::{Duration, Instant};

use vimc4_device::{Condition, Device, Foresight, Input, Kinds, OwnedInput, Time};
use vimc4_session::Pace;

use crate::Clock;
use crate::ControlError;
use crate::Step;
use crate::journey::{Progress, Ticket, Wish};
use crate::rig::Rig;
use crate::travel::{Destination, Travel};
use crate::{Deed, News, Source};

/// How many deadlines are performed before the line is looked at again.
const BATCH: u32 = 10_000;

/// How long that may take.
const BATCH_TIME: Duration = Duration::from_millis(5);

/// How many causes are looked ahead for a caller that waits while time runs by itself, without
/// holding up the line. A condition not decided by then is waited for.
const FORESIGHT: u32 = 1_000;

/// A device in its rig, and how its time passes: as its clock says, or as somebody sends it.
pub(crate) struct Drive<D: Device> {
    pub(crate) rig: Rig<D>,
    pace: Pace,
    /// The moment at which its wall time begins.
    origin: Instant,
    journey: Option<Travel<D>>,
    /// The journeys that begin when that has ended.
    later: VecDeque<(Source, Destination, Ticket)>,
}

impl<D: Device + Clone> Drive<D> {
    pub(crate) fn new(device: D, clock: Clock) -> Drive<D> {
        let (rig, pace) = (Rig::new(device), Pace::new(clock));
        Drive { rig, pace, origin: Instant::now(), journey: None, later: VecDeque::new() }
    }

    /// Time begins.
    pub(crate) fn start(&mut self) {
        self.pace.start(self.origin.elapsed(), self.rig.device.now());
    }

    // --- the present ---

    /// The model time at this moment.
    pub(crate) fn present(&self) -> Time {
        let now = self.rig.device.now();
        // While the device is behind or paused, its own time is the present one.
        if self.pace.is_behind() || self.rig.is_paused() {
            return now;
        }
        self.clock_time().map_or(now, |at| at.max(now))
    }

    /// What the clock shows at this moment, if it runs by itself.
    fn clock_time(&self) -> Option<Time> {
        // A clock that does not run need not be read.
        if self.pace.runs() { self.pace.time_at(self.origin.elapsed()) } else { None }
    }

    /// The time at which something happens now; what is due before has been done.
    pub(crate) fn catch_up_to_present(&mut self) -> Time {
        let at = self.present();
        if self.is_due(at) && !self.rig.is_paused() {
            self.catch_up_to(at);
            return self.present().min(at);
        }
        at
    }

    /// Performs what is due by now. Returns whether that did not come to an end.
    pub(crate) fn catch_up(&mut self) -> bool {
        match self.clock_time() {
            Some(present) if !self.rig.is_paused() => self.catch_up_to(present),
            _ => false,
        }
    }

    fn catch_up_to(&mut self, present: Time) -> bool {
        let (_, arrived) = self.run_to(present, BATCH);
        let done = arrived || self.rig.is_paused();
        if done {
            self.pace.caught_up();
        } else {
            self.pace.fell_behind(self.origin.elapsed(), self.rig.device.now());
        }
        !done
    }

    /// Whether what arrives has to wait: time is on its way, or catches up. What arrives in between
    /// arrives when that has ended, in a pause, or when time has been on its way for long.
    pub(crate) fn is_away(&self) -> bool {
        self.pace.is_behind() || self.journey.as_ref().is_some_and(Travel::is_undisturbed)
    }

    /// The moment on the wall at which something is to be done next.
    pub(crate) fn next_moment(&self) -> Option<Instant> {
        if !self.pace.runs() || self.rig.is_paused() {
            return None;
        }
        self.origin.checked_add(self.pace.wall_of(self.next_look()?)?)
    }

    // --- how it passes ---

    /// Lets time pass as far as the clock says. Returns whether more is to be done at once.
    pub(crate) fn move_time(&mut self) -> bool {
        if self.rig.is_paused() {
            self.hold_up_journey();
            return false;
        }
        if self.is_held_up() {
            return false;
        }
        if self.journey.is_none()
            && let Some((by, destination, ticket)) = self.later.pop_front()
        {
            let now = self.rig.device.now();
            self.journey = Some(Travel::begin(by, ticket, now, destination));
        }
        if let Some(mut travel) = self.journey.take() {
            let Some(end) = self.travel(&mut travel) else {
                let busy = !travel.paused;
                self.journey = Some(travel);
                return busy;
            };
            let Travel { by, ticket, began, .. } = travel;
            let now = self.rig.device.now();
            if end.is_ok() || now > began {
                self.rig.input(Input::Wake, now, Some(&by));
            }
            ticket.end(end);
            if self.rig.is_paused() {
                return false;
            }
            if !self.later.is_empty() {
                return true;
            }
        }
        if self.pace.runs() {
            // A device that has nothing to do yet need not be told that time passes. To look at
            // the clock would cost more than to see that nothing will be due at all.
            return self.has_deadline()
                && self.clock_time().is_some_and(|now| self.is_due(now))
                && self.catch_up();
        }
        self.pace.jumps() && self.rig.next_deadline().is_some()
    }

    /// Time jumps, where the clock says so: nothing is readable.
    pub(crate) fn jump(&mut self) {
        if self.pace.jumps() && self.journey.is_none() && !self.rig.is_paused() {
            let began = Instant::now();
            for _ in 0..BATCH {
                if self.rig.next_deadline().is_none() {
                    return;
                }
                let Some(due) = self.next_look() else { return };
                self.rig.step(due);
                let is_over = began.elapsed() >= BATCH_TIME;
                if is_over || self.rig.has_to_stop() || self.is_held_up() {
                    return;
                }
            }
        }
    }

    /// Performs causes one by one until `target`, so many and for a few milliseconds at most.
    /// Returns how many, and whether it arrived.
    fn run_to(&mut self, target: Time, most: u32) -> (u32, bool) {
        let began = Instant::now();
        for causes in 0..most {
            match self.next_look() {
                Some(due) if due <= target => self.rig.step(due),
                _ => {
                    if self.rig.device.now() < target {
                        self.rig.step(target);
                    }
                    return (causes, true);
                }
            }
            let is_over = began.elapsed() >= BATCH_TIME;
            if is_over || self.rig.has_to_stop() || self.is_held_up() {
                return (causes + 1, false);
            }
        }
        (most, false)
    }

    /// Whether time that jumps has to wait for a sink.
    fn is_held_up(&mut self) -> bool {
        !self.pace.runs() && self.rig.sinks.are_full()
    }

    /// Whether something is to be done by then, or the device is behind its clock.
    fn is_due(&self, at: Time) -> bool {
        self.pace.is_behind() || self.next_look().is_some_and(|due| due <= at)
    }

    /// Whether anything will be due at all.
    fn has_deadline(&self) -> bool {
        self.pace.is_behind() || self.next_look().is_some()
    }

    /// When something is due, or a sink wants to know that time has passed. Time that jumps from
    /// one thing to the next does not move for the latter alone.
    fn next_look(&self) -> Option<Time> {
        self.rig.next_deadline().into_iter().chain(self.rig.sinks.due()).min()
    }

    // --- where it is sent ---

    /// Lets time pass until the destination is reached, and then replies.
    pub(crate) fn set_out(&mut self, by: Source, destination: Destination, ticket: Ticket) {
        let now = self.rig.device.now();
        ticket.tell(Progress { now, ..Progress::default() });
        match &self.journey {
            Some(travel) if travel.paused => {
                return ticket.end(Err(ControlError::Unsupported(
                    "time is on its way already, and paused; resume or cancel that journey first",
                )));
            }
            Some(_) => return self.later.push_back((by, destination, ticket)),
            None => {}
        }
        if self.rig.is_paused() && !self.pace.runs() {
            return ticket.end(Err(ControlError::Paused));
        }
        match destination {
            destination if !self.pace.runs() => {
                self.journey = Some(Travel::begin(by, ticket, now, destination));
            }
            Destination::Until(condition) => self.wait_for(condition, ticket),
            Destination::After(_) => ticket.end(Err(ControlError::RunsByItself)),
        }
    }

    /// A caller waits for a condition while time runs by itself.
    fn wait_for(&mut self, condition: Condition, ticket: Ticket) {
        let Rig { device, waiters, .. } = &mut self.rig;
        // What comes from outside can happen at any time.
        let by_itself = !condition.has_happenings();
        if by_itself && device.foresee(&condition, FORESIGHT) == Foresight::Never {
            return ticket.end(Err(ControlError::Never));
        }
        waiters.add(device, condition, ticket);
        self.rig.watch_kinds();
        // It may have been given up before it began.
        self.give_up_waiting();
    }

    /// Answers the callers that do not want to wait any longer.
    pub(crate) fn give_up_waiting(&mut self) {
        let at = self.rig.device.now();
        let later = std::mem::take(&mut self.later).into_iter();
        let (given_up, later): (Vec<_>, Vec<_>) =
            later.partition(|(.., ticket)| ticket.wish() == Wish::Cancel);
        self.later = later.into();
        for (.., ticket) in given_up {
            ticket.end(Err(ControlError::Cancelled { at }));
        }
        self.rig.give_up_waiting();
    }

    /// Goes on with a journey for a few milliseconds at most. Returns how it ends, if it does.
    fn travel(&mut self, travel: &mut Travel<D>) -> Option<Result<Time, ControlError>> {
        travel.paused = false;
        match travel.ticket.wish() {
            Wish::Cancel => {
                return Some(Err(ControlError::Cancelled { at: self.rig.device.now() }));
            }
            Wish::Pause => travel.paused = true,
            Wish::Go | Wish::Unaided => match travel.foresee(&self.rig.device, self.rig.inputs) {
                Foresight::Never => return Some(Err(ControlError::Never)),
                Foresight::Open => {
                    if let Some(until) = travel.looked_to() {
                        return Some(Err(ControlError::Unforeseen { until }));
                    }
                }
                Foresight::At(to) => {
                    let (causes, arrived) = self.run_to(to, travel.stage(BATCH));
                    if arrived {
                        return Some(Ok(to));
                    }
                    travel.came(causes);
                }
            },
        }
        travel.tell(self.rig.device.now());
        None
    }

    // --- a pause ---

    /// Pauses time, unless it is paused, at what it is now.
    pub(crate) fn pause(&mut self, by: Source) -> Time {
        if !self.rig.is_paused() {
            let at = self.catch_up_to_present();
            self.rig.pass_time(at);
        }
        if !self.rig.is_paused() {
            self.rig.pause(by);
        }
        self.pace.caught_up();
        self.rig.device.now()
    }

    pub(crate) fn clock(&self) -> Clock {
        self.pace.clock()
    }

    /// From now on time runs as fast as this clock. Only one that runs by itself can take the place
    /// of another: whoever awaits a time has been told whether it comes by itself.
    pub(crate) fn set_clock(&mut self, clock: Clock) -> Result<(), ControlError> {
        if clock.rate().is_none() || !self.pace.runs() {
            return Err(ControlError::Unsupported(
                "only a clock that runs by itself can change its speed, as from real to 8x; \
                 any other is chosen when the controller is started",
            ));
        }
        if !self.rig.is_paused() {
            let at = self.catch_up_to_present();
            self.rig.pass_time(at);
        }
        self.pace = Pace::new(clock);
        self.pace.start(self.origin.elapsed(), self.rig.device.now());
        Ok(())
    }

    /// Time goes on from where it is: what has passed on the wall is not made up for.
    pub(crate) fn resume(&mut self, by: &Source) -> Result<Time, ControlError> {
        if !self.rig.is_paused() {
            return Err(ControlError::NotPaused);
        }
        self.rig.resume(by);
        let now = self.rig.device.now();
        self.pace.start(self.origin.elapsed(), now);
        Ok(now)
    }

    /// Does one thing while time is paused.
    pub(crate) fn step(&mut self) -> Result<Step, ControlError> {
        if !self.rig.is_paused() {
            return Err(ControlError::NotPaused);
        }
        Ok(self.rig.perform_one())
    }

    /// Lets time pass while it is paused, as far as nothing is due.
    pub(crate) fn wait_until(&mut self, at: Time) -> Result<Time, ControlError> {
        if !self.rig.is_paused() {
            return Err(ControlError::NotPaused);
        }
        self.rig.wait_until(at);
        Ok(self.rig.device.now())
    }

    /// Gives an input. While time is paused, what it leads to is left to steps.
    pub(crate) fn give(&mut self, input: OwnedInput, by: Source) {
        let at = self.catch_up_to_present();
        if self.rig.is_paused() {
            return self.rig.give(input.as_input(), Some(&by));
        }
        self.rig.input(input.as_input(), at, Some(&by));
        self.rig.disappoint();
    }

    /// A journey goes no further while time is paused, but can be given up.
    fn hold_up_journey(&mut self) {
        self.pace.caught_up();
        let Some(mut travel) = self.journey.take() else { return };
        let now = self.rig.device.now();
        if travel.ticket.wish() == Wish::Cancel {
            return travel.ticket.end(Err(ControlError::Cancelled { at: now }));
        }
        if !travel.paused {
            travel.paused = true;
            travel.tell(now);
        }
        self.journey = Some(travel);
    }

    // --- another state ---

    /// Continues from another state. A paused one stays so.
    pub(crate) fn restore(&mut self, by: &Source, state: D::State) {
        let at = self.catch_up_to_present();
        if !self.rig.is_paused() {
            self.rig.pass_time(at);
        }
        if self.rig.is_wanted(Kinds::COMMAND) {
            self.rig.tell_news(at, News::Deed { by: by.clone(), deed: Deed::Restore });
        }
        self.rig.tell_unheard(at);
        if let Some(travel) = self.journey.take() {
            // Its destination belongs to another time.
            travel.ticket.end(Err(ControlError::Cancelled { at }));
        }
        self.rig.restore(by, state);
        if self.rig.is_paused() {
            return;
        }
        let now = self.rig.device.now();
        self.pace.start(self.origin.elapsed(), now);
        self.rig.pass_time(now);
        self.rig.disappoint();
    }
}

impl<D: Device + fmt::Debug> fmt::Debug for Drive<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Drive { rig, pace, .. } = self;
        f.debug_struct("Drive")
            .field("device", &rig.device)
            .field("pace", pace)
            .finish_non_exhaustive()
    }
}
