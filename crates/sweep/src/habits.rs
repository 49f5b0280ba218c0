//! What a host does after what it has heard.

use std::collections::BTreeMap;

use bytes::Bytes;
use vimc4_device::{Device, Harness, OwnedInput, TimedInput};

use crate::account::by_lines;
use crate::outcome::Exit;
use crate::plan::Point;
use crate::session::{AFTERWARDS, Session};

/// Nothing is learned from a run with more inputs than this: a host that polls for ever would fill the
/// memory.
const LONGEST: usize = 10_000;

/// What a host has done so far, after what it has heard: enough to say what it will do where it hears the
/// same again.
///
/// A host that can be swept always does the same, so a run in which it would hear what it has heard before
/// need not be made. Many faults look the same to a host: a byte that is lost, garbled or comes twice
/// spoils a command, and is answered as one.
#[derive(Clone, Debug, Default)]
pub struct Habits {
    /// By the moment, which is the number of what was said last, and what was heard since then.
    deeds: BTreeMap<Moment, Deed>,
    /// The last of the numbers; 0 is the beginning.
    last: usize,
    /// Whether it has done different things after hearing the same.
    unsteady: bool,
}

/// What is known of the run of a host.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Foretold {
    /// What it gives, and how it ends.
    Known(Vec<TimedInput>, Exit),
    /// It comes to a moment in which it was not seen before. A run that comes to the same may tell.
    Unknown(Moment),
    /// It comes to a moment in which it does now this and now that.
    Unclear,
}

/// A moment in the run of a host: all that was said and heard.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Moment(usize, Vec<u8>);

/// What a host does.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Deed {
    /// It sends this, which has a number.
    Says(Bytes, usize),
    /// It ends. So often that was seen.
    Ends(Exit, u32),
    /// Now this and now that.
    Unclear,
}

impl Habits {
    /// Learns from a run without a fault, and says nothing of a host that does not wait for its answers:
    /// what it hears before it says more is a matter of luck.
    pub fn new<D: Device + Clone>(
        session: &Session<D>,
        given: &[TimedInput],
        exit: Exit,
    ) -> Option<Habits> {
        let mut habits = Habits::default();
        habits.learn(session, given, exit);
        matches!(habits.follow(session, Vec::new()), Foretold::Known(..)).then_some(habits)
    }

    /// Learns from a run in which a host has given this and has ended so.
    pub fn learn<D: Device + Clone>(
        &mut self,
        session: &Session<D>,
        given: &[TimedInput],
        exit: Exit,
    ) {
        if given.len() > LONGEST {
            return;
        }
        let mut harness = Harness::new(session.device().clone());
        let mut number = 0;
        for given in by_lines(given, session.ends()) {
            harness.run_to(given.at);
            if let OwnedInput::Bytes(bytes) = &given.input {
                let next = self.last + 1;
                let says = Deed::Says(bytes.clone(), next);
                match self.deeds.entry(Moment(number, harness.take_bytes())).or_insert(says) {
                    Deed::Says(said, then) if said == bytes => number = *then,
                    deed => {
                        *deed = Deed::Unclear;
                        self.unsteady = true;
                        return;
                    }
                }
                self.last = self.last.max(number);
            }
            harness.play(&given);
        }
        if !rests(&mut harness) {
            return;
        }
        match self.deeds.entry(Moment(number, harness.take_bytes())).or_insert(Deed::Ends(exit, 0))
        {
            Deed::Ends(known, times) if *known == exit => *times = times.saturating_add(1),
            deed => {
                *deed = Deed::Unclear;
                self.unsteady = true;
            }
        }
    }

    /// Whether the host was seen to do now this and now that after it had heard the same.
    #[must_use]
    pub fn are_unsteady(&self) -> bool {
        self.unsteady
    }

    /// What the host will do with the faults of a point. That it hangs has to have been seen twice: once it
    /// may just have been slow.
    #[must_use]
    pub fn foretell<D: Device + Clone>(&self, session: &Session<D>, point: &Point) -> Foretold {
        self.follow(session, session.begin(point))
    }

    fn follow<D: Device + Clone>(&self, session: &Session<D>, first: Vec<OwnedInput>) -> Foretold {
        let mut harness = Harness::new(session.device().clone()).keeping_given();
        for input in first {
            harness.input(input.as_input());
        }
        let mut number = 0;
        // A host answers when the controller rests: it is slower.
        while rests(&mut harness) {
            let moment = Moment(number, harness.take_bytes());
            match self.deeds.get(&moment) {
                Some(Deed::Says(bytes, then)) => {
                    harness.send(bytes);
                    number = *then;
                }
                None | Some(Deed::Ends(Exit::Hung, ..=1)) => return Foretold::Unknown(moment),
                Some(Deed::Ends(exit, _)) => return Foretold::Known(harness.take_given(), *exit),
                Some(Deed::Unclear) => break,
            }
        }
        Foretold::Unclear
    }
}

/// Lets everything happen that happens by itself, and says whether that comes to an end.
fn rests<D: Device>(harness: &mut Harness<D>) -> bool {
    (0..AFTERWARDS).any(|_| harness.step().is_none())
}
