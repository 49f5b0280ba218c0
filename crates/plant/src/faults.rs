//! What is wrong with a machine: its present faults, and contacts that bounce.

use serde::{Deserialize, Serialize};
use vimc4_device::{FaultNumber, Mishap, SignalId, SwitchSays, Time};

use crate::machine::is_default;
use crate::{End, PlantSignal};

/// The present faults.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Faults {
    /// In the order in which they began.
    #[serde(default, skip_serializing_if = "is_default")]
    list: Vec<Present>,
    /// Contacts that bounce now.
    #[serde(default, skip_serializing_if = "is_default")]
    pub(crate) bouncing: Vec<Bouncing>,
}

/// A present fault.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Present {
    number: FaultNumber,
    mishap: Mishap,
    /// What it replaced: the last value set for a signal that it holds, whether there was power, or
    /// the former state of a bouncing contact.
    instead: i32,
}

/// A contact that bounces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Bouncing {
    pub(crate) signal: SignalId,
    /// How many times it will still change.
    pub(crate) left: u16,
    pub(crate) next: Time,
    /// Nanoseconds from one change to the next.
    pub(crate) period: u64,
    /// Whether it differs from its settled state.
    pub(crate) astray: bool,
}

impl Faults {
    pub(crate) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    pub(crate) fn begin(&mut self, number: FaultNumber, mishap: Mishap, instead: i32) {
        // If another fault already holds it, the value from before that fault counts.
        let alike = self.list.iter().find(|fault| are_alike(&fault.mishap, &mishap));
        let instead = alike.map_or(instead, |fault| fault.instead);
        self.list.push(Present { number, mishap, instead });
    }

    /// Ends a fault. Returns what it was, and what it gives back; if another fault still holds
    /// that, the value passes to the other.
    pub(crate) fn end(&mut self, number: FaultNumber) -> Option<(Mishap, i32)> {
        let place = self.list.iter().position(|fault| fault.number == number)?;
        let Present { mishap, instead, .. } = self.list.remove(place);
        if let Mishap::Bounce { signal, .. } = mishap {
            self.bouncing.retain(|contact| contact.signal != signal);
        }
        let alike = self.mishaps().filter(|other| are_alike(other, &mishap)).last();
        let back = match alike {
            Some(Mishap::Hold { value, .. }) => *value,
            Some(Mishap::Power) => 0,
            _ => instead,
        };
        Some((mishap, back))
    }

    pub(crate) fn numbers(&self) -> Vec<FaultNumber> {
        self.list.iter().map(|fault| fault.number).collect()
    }

    fn mishaps(&self) -> impl Iterator<Item = &Mishap> {
        self.list.iter().map(|fault| &fault.mishap)
    }

    // --- effects ---

    pub(crate) fn are_swapped(&self, axis: usize) -> bool {
        self.mishaps()
            .any(|mishap| matches!(mishap, Mishap::Swapped(of) if usize::from(*of) == axis))
    }

    /// What a limit switch reports instead of the truth: the latest fault counts.
    pub(crate) fn switch_says(&self, axis: usize, end: End) -> Option<SwitchSays> {
        let says = self.mishaps().filter_map(|mishap| match mishap {
            Mishap::Switch { axis: of, positive, says }
                if usize::from(*of) == axis && *positive == (end == End::Positive) =>
            {
                Some(*says)
            }
            _ => None,
        });
        says.filter(|says| !matches!(says, SwitchSays::Late(_))).last()
    }

    /// By how much a limit switch lets go later.
    pub(crate) fn late(&self, axis: usize, end: End) -> i64 {
        let late = self.mishaps().filter_map(|mishap| match mishap {
            Mishap::Switch { axis: of, positive, says: SwitchSays::Late(steps) }
                if usize::from(*of) == axis && *positive == (end == End::Positive) =>
            {
                Some(i64::from(*steps))
            }
            _ => None,
        });
        late.sum()
    }

    pub(crate) fn backlash(&self, axis: usize) -> i64 {
        let steps = self.mishaps().filter_map(|mishap| match mishap {
            Mishap::Backlash { axis: of, steps } if usize::from(*of) == axis => {
                Some(i64::from(*steps))
            }
            _ => None,
        });
        steps.sum()
    }

    /// The extra load of an axis, Hz/ms.
    pub(crate) fn load(&self, axis: usize) -> u32 {
        self.mishaps().fold(0, |sum, mishap| match mishap {
            Mishap::Load { axis: of, pull } if usize::from(*of) == axis => pull.saturating_add(sum),
            _ => sum,
        })
    }

    /// The fault that blocks the motor of an axis.
    pub(crate) fn jam(&self, axis: usize) -> Option<FaultNumber> {
        self.last(|mishap| matches!(mishap, Mishap::Jam(of) if usize::from(*of) == axis))
    }

    /// The fault that loads the motor of an axis, if nothing blocks it.
    pub(crate) fn stalls(&self, axis: usize) -> Option<FaultNumber> {
        let loads = |mishap: &Mishap| matches!(mishap, Mishap::Load { axis: of, .. } if usize::from(*of) == axis);
        self.last(loads).filter(|_| self.jam(axis).is_none())
    }

    fn last(&self, is_it: impl Fn(&Mishap) -> bool) -> Option<FaultNumber> {
        self.list.iter().rev().find(|fault| is_it(&fault.mishap)).map(|fault| fault.number)
    }

    // --- held signals ---

    /// Whether a fault holds a signal; the value it was set to is then remembered.
    pub(crate) fn withholds(&mut self, signal: SignalId, value: i32) -> bool {
        self.remember(&Mishap::Hold { signal, value }, value)
    }

    /// Whether a fault keeps the mains off; the position they were switched to is then remembered.
    pub(crate) fn withholds_power(&mut self, on: bool) -> bool {
        self.remember(&Mishap::Power, on.into())
    }

    fn remember(&mut self, like: &Mishap, value: i32) -> bool {
        let mut any = false;
        for fault in self.list.iter_mut().filter(|fault| are_alike(&fault.mishap, like)) {
            (fault.instead, any) = (value, true);
        }
        any
    }

    // --- bouncing contacts ---

    /// The contacts that bounce when they change, and the state of each at the last look.
    pub(crate) fn bouncers(&self) -> impl Iterator<Item = (PlantSignal, bool)> {
        self.list.iter().filter_map(|fault| match fault.mishap {
            Mishap::Bounce { signal, .. } => {
                Some((PlantSignal::from_id(signal)?, fault.instead != 0))
            }
            _ => None,
        })
    }

    /// Whether a contact now differs from its settled state.
    pub(crate) fn is_astray(&self, signal: PlantSignal) -> bool {
        let id = signal.id();
        self.bouncing.iter().any(|contact| contact.signal == id && contact.astray)
    }

    /// The present state of a contact is part of its bouncing.
    pub(crate) fn was(&mut self, signal: PlantSignal, level: bool) {
        let id = signal.id();
        for fault in &mut self.list {
            if matches!(fault.mishap, Mishap::Bounce { signal, .. } if signal == id) {
                fault.instead = level.into();
            }
        }
    }

    /// A contact has changed and begins to bounce. Returns the faults that cause it.
    pub(crate) fn contact(&mut self, signal: PlantSignal, is: bool, now: Time) -> Vec<FaultNumber> {
        let id = signal.id();
        let mut by = Vec::new();
        for fault in &mut self.list {
            let Mishap::Bounce { signal: of, times, period } = fault.mishap else { continue };
            if of != id || (fault.instead != 0) == is {
                continue;
            }
            fault.instead = is.into();
            by.push(fault.number);
            let period = u64::try_from(period.as_nanos()).unwrap_or(u64::MAX).max(1);
            self.bouncing.retain(|contact| contact.signal != id);
            self.bouncing.push(Bouncing {
                signal: id,
                left: 2 * u16::from(times),
                next: now.after_nanos(period),
                period,
                astray: false,
            });
        }
        by
    }

    /// Changes the contact whose next change is due now, and returns it.
    pub(crate) fn bounce(&mut self, now: Time) -> Option<PlantSignal> {
        let due = self.bouncing.iter_mut().find(|contact| contact.next <= now)?;
        due.astray = !due.astray;
        due.left -= 1;
        due.next = due.next.after_nanos(due.period);
        let signal = PlantSignal::from_id(due.signal);
        self.bouncing.retain(|contact| contact.left > 0);
        signal
    }
}

/// Whether two faults hold the same thing.
fn are_alike(one: &Mishap, other: &Mishap) -> bool {
    match (one, other) {
        (Mishap::Hold { signal: one, .. }, Mishap::Hold { signal: other, .. }) => one == other,
        (Mishap::Power, Mishap::Power) => true,
        _ => false,
    }
}
