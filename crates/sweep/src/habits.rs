//! What a host does after what it has heard.

use std::collections::BTreeMap;

use bytes::Bytes;
use vimc4_device::{Device, Harness, OwnedInput, TimedInput};

use crate::account::by_lines;
use crate::outcome::Exit;
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
    /// By the moment, which is all that was said and heard before, and what was heard since then.
    deeds: BTreeMap<(usize, Vec<u8>), Deed>,
    /// The number of the last moment; 0 is the beginning.
    last: usize,
}

/// What a host does.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Deed {
    /// It sends this, which leads to another moment.
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
        habits.follow(session, Vec::new()).is_some().then_some(habits)
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
        let mut moment = 0;
        for given in by_lines(given, session.ends()) {
            harness.run_to(given.at);
            if let OwnedInput::Bytes(bytes) = &given.input {
                let next = self.last + 1;
                let says = Deed::Says(bytes.clone(), next);
                match self.deeds.entry((moment, harness.take_bytes())).or_insert(says) {
                    Deed::Says(said, then) if said == bytes => moment = *then,
                    deed => {
                        *deed = Deed::Unclear;
                        return;
                    }
                }
                self.last = self.last.max(moment);
            }
            harness.play(&given);
        }
        if !rests(&mut harness) {
            return;
        }
        match self.deeds.entry((moment, harness.take_bytes())).or_insert(Deed::Ends(exit, 0)) {
            Deed::Ends(known, times) if *known == exit => *times = times.saturating_add(1),
            deed => *deed = Deed::Unclear,
        }
    }

    /// What the host will give, and how it will end, with the faults of a point; `None` if it has not been
    /// seen where they lead it. That it hangs has to have been seen twice: once it may just have been slow.
    #[must_use]
    pub fn foretell<D: Device + Clone>(
        &self,
        session: &Session<D>,
        number: u64,
    ) -> Option<(Vec<TimedInput>, Exit)> {
        let point = session.plan().point(number)?;
        self.follow(session, session.begin(&point))
    }

    fn follow<D: Device + Clone>(
        &self,
        session: &Session<D>,
        first: Vec<OwnedInput>,
    ) -> Option<(Vec<TimedInput>, Exit)> {
        let mut harness = Harness::new(session.device().clone()).keeping_given();
        for input in first {
            harness.input(input.as_input());
        }
        let mut moment = 0;
        // A host answers when the controller rests: it is slower.
        while rests(&mut harness) {
            match self.deeds.get(&(moment, harness.take_bytes()))? {
                Deed::Says(bytes, then) => {
                    harness.send(bytes);
                    moment = *then;
                }
                Deed::Unclear | Deed::Ends(Exit::Hung, ..=1) => return None,
                Deed::Ends(exit, _) => return Some((harness.take_given(), *exit)),
            }
        }
        None
    }
}

/// Lets everything happen that happens by itself, and says whether that comes to an end.
fn rests<D: Device>(harness: &mut Harness<D>) -> bool {
    (0..AFTERWARDS).any(|_| harness.step().is_none())
}
