//! A session and its faults.

use vimc4_device::{Device, FaultNumber, Faulting, MAX_CAUSES, OwnedInput, Time, TimedInput};

use crate::account::{Account, Exchange, Witness, by_lines};
use crate::key::key;
use crate::outcome::{Exit, Outcome, Verdict, part, whereabouts};
use crate::plan::{Base, Choice, Harm, Mode, Plan, Point};
use crate::results::{Case, key_of};
use crate::subject::{Profile, Subject, in_order};

/// So many causes may follow the last input; an endless program goes on for ever.
pub(crate) const AFTERWARDS: u32 = 100_000;

/// So many snapshots are kept at most.
const SNAPSHOTS: usize = 2_000;

/// The numbers of faults begin here, so that they are none of those that the session itself has.
const NUMBERS: u32 = 901;

/// A device in its first state, the inputs that it gets, and what happens then.
///
/// Where the inputs are recorded, [`run_point`](Session::run_point) plays them with a fault, from the last
/// snapshot before it. Where a host decides what is sent, somebody runs the host with the faults of
/// [`begin`](Session::begin), and [`judge`](Session::judge) says what came of it.
#[derive(Clone, Debug)]
pub struct Session<D> {
    start: D,
    inputs: Vec<TimedInput>,
    end: Time,
    ends: Vec<u8>,
    clean: Account,
    choice: Choice,
    plan: Plan,
    snapshots: Vec<Snapshot<D>>,
}

/// How things stand before an input.
#[derive(Clone, Debug)]
struct Snapshot<D> {
    witness: Witness<D>,
    next: usize,
}

/// What came of a fault, with what shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The number of the point.
    pub point: u64,
    /// What came of it.
    pub outcome: Outcome,
    /// How many lines a recording of it has, about.
    pub size: u64,
}

impl<D: Device + Clone> Session<D> {
    /// A session without a fault. `ends` are the bytes that end a line of the host. What is given after
    /// `end` is part of it as well.
    pub fn new(device: D, inputs: &[TimedInput], end: Time, ends: &[u8], choice: &Choice) -> Self {
        let inputs = by_lines(inputs, ends);
        let mut witness = Witness::new(device.clone(), true);
        let mut snapshots = Vec::new();
        let every = if choice.live { usize::MAX } else { inputs.len() / SNAPSHOTS + 1 };
        for (next, input) in inputs.iter().enumerate() {
            if next % every == 0 && witness.is_between_lines() {
                snapshots.push(Snapshot { witness: witness.branch(), next });
            }
            witness.give(input, ends);
        }
        witness.run_to(end);
        witness.run_on(AFTERWARDS);
        let (clean, _) = witness.finish();
        let plan = Plan::new(&clean, &device, choice);
        let (ends, choice) = (ends.to_vec(), choice.clone());
        Session { start: device, inputs, end, ends, clean, choice, plan, snapshots }
    }

    /// What happens without a fault.
    #[must_use]
    pub fn clean(&self) -> &Account {
        &self.clean
    }

    /// All points.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The device in its first state.
    #[must_use]
    pub fn device(&self) -> &D {
        &self.start
    }

    /// The bytes that end a line of the host.
    pub(crate) fn ends(&self) -> &[u8] {
        &self.ends
    }

    /// What is swept, for people and for everybody who puts results together. `of` is the command line of the
    /// host, the name of the recording or of the function.
    #[must_use]
    pub fn subject(&self, of: String, model: Profile, machine: Profile) -> Subject {
        Subject {
            of,
            model,
            machine,
            harms: in_order(&Harm::ALL, &self.choice.harms),
            modes: in_order(&Mode::ALL, &self.choice.modes),
            fingerprint: self.fingerprint(),
            points: self.plan.len(),
        }
    }

    /// Equal for sessions in which the same is said and heard, and the machine ends in the same place. When a
    /// running host says it is a matter of luck; when a recorded one does is part of the recording.
    fn fingerprint(&self) -> String {
        let mut text = String::new();
        for exchange in &self.clean.exchanges {
            text += &format!("\n{:?} {:?}", exchange.said, exchange.heard);
        }
        text += &format!("\n{:?}", self.clean.end);
        if !self.choice.live {
            text += &format!("\n{:?}", self.inputs);
        }
        key(text.as_bytes())
    }

    /// In what another run of the same host without a fault differs first, in words; None if a sweep can
    /// build on it.
    #[must_use]
    pub fn difference(&self, again: &Session<D>) -> Option<String> {
        let (one, two) = (&self.clean, &again.clean);
        let shown = |said: Option<&Exchange>| match said {
            Some(exchange) => format!("it sent `{}`", vimc4_device::escape(&exchange.said)),
            None => "it sent nothing more".to_owned(),
        };
        let said = |exchange: Option<&Exchange>| exchange.map(|exchange| exchange.said.clone());
        for number in 0..one.exchanges.len().max(two.exchanges.len()) {
            let (first, then) = (one.exchanges.get(number), two.exchanges.get(number));
            if said(first) != said(then) {
                return Some(format!("first {}, then {}", shown(first), shown(then)));
            }
            if let (Some(first), Some(then)) = (first, then)
                && first.heard != then.heard
            {
                let [said, first, then] = [&first.said, &first.heard, &then.heard]
                    .map(|bytes| vimc4_device::escape(bytes).to_string());
                return Some(format!("after `{said}` it heard first `{first}`, then `{then}`"));
            }
        }
        (one.end != two.end).then(|| "the machine ended elsewhere".to_owned())
    }

    /// The inputs that begin the faults of a point, to be given first.
    #[must_use]
    pub fn begin(&self, point: &Point) -> Vec<OwnedInput> {
        numbered(self.plan.faults(&self.clean, point))
    }

    /// Plays the recorded inputs with the faults of a point.
    #[must_use]
    pub fn run_point(&self, number: u64) -> Option<Found> {
        let point = self.plan.point(number)?;
        let (seen, before) = self.play(&point);
        let outcome = part(&self.clean, &seen, before, Exit::Played).outcome;
        let heard = self.clean.exchanges.get(..before).unwrap_or_default();
        let answers = heard.iter().chain(&seen.exchanges).filter(|it| !it.heard.is_empty()).count();
        let size = self.inputs.len() + answers + self.begin(&point).len() + 4;
        Some(Found { point: number, outcome, size: size as u64 })
    }

    /// A recorded session with the faults of a point: all inputs from the beginning on.
    #[must_use]
    pub fn with_faults(&self, point: &Point) -> Vec<TimedInput> {
        let at = self.start.now();
        let faults = self.begin(point).into_iter().map(|input| TimedInput { at, input });
        faults.chain(self.inputs.iter().cloned()).collect()
    }

    /// The case of a recorded session, for people.
    #[must_use]
    pub fn case(&self, number: u64, size: u64) -> Option<Case> {
        let point = self.plan.point(number)?;
        let (seen, before) = self.play(&point);
        Some(self.told(&point, &seen, before, Exit::Played, size))
    }

    /// What came of the faults of a point with a host that has given these inputs, and ended so.
    #[must_use]
    pub fn judge(&self, number: u64, inputs: &[TimedInput], exit: Exit) -> Option<(Found, Case)> {
        let point = self.plan.point(number)?;
        let inputs = by_lines(inputs, &self.ends);
        let mut witness = Witness::new(self.start.clone(), false);
        for input in &inputs {
            witness.give(input, &self.ends);
        }
        witness.run_on(AFTERWARDS);
        let (seen, before) = witness.finish();
        let answers = seen.exchanges.iter().filter(|exchange| !exchange.heard.is_empty()).count();
        let size = (inputs.len() + answers + 4) as u64;
        let case = self.told(&point, &seen, before, exit, size);
        let outcome = part(&self.clean, &seen, before, exit).outcome;
        Some((Found { point: number, outcome, size }, case))
    }

    fn told(&self, point: &Point, seen: &Account, before: usize, exit: Exit, size: u64) -> Case {
        let parting = part(&self.clean, seen, before, exit);
        let heard = parting.cue.and_then(|cue| seen.exchanges.get(cue));
        let why = heard.and_then(|heard| heard.why.clone());
        let late = point.harm == Harm::Delayed;
        let mut should = parting.outcome.should(why.as_deref(), late);
        let moved = seen.unreferenced.iter().map(|(axis, _)| axis.as_str()).collect::<Vec<_>>();
        let is_moved = parting.outcome.verdicts.contains(&Verdict::MovedUnreferenced);
        let line = seen
            .unreferenced
            .first()
            .filter(|_| is_moved)
            .and_then(|(_, exchange)| seen.exchanges.get(exchange.saturating_sub(before)));
        if let (Some(should), Some(line)) = (&mut should, line) {
            let line = crate::plan::shown(&line.said);
            *should += &format!(" ({} moved with {line})", moved.join(", "));
        }
        Case {
            outcome: key_of(&parting.outcome),
            point: point.number,
            size,
            broken: self.plan.describe(&self.clean, point),
            machine: whereabouts(&self.clean.end, &seen.end),
            should,
        }
    }

    fn play(&self, point: &Point) -> (Account, usize) {
        let mut witness = self.nearest(point);
        let base = base(&witness.witness);
        let faults = numbered(self.plan.faults_from(&self.clean, point, base));
        let now = witness.witness.harness.now();
        for input in faults {
            witness.witness.give(&TimedInput { at: now, input }, &self.ends);
        }
        for input in self.inputs.get(witness.next..).unwrap_or_default() {
            witness.witness.give(input, &self.ends);
        }
        witness.witness.run_to(self.end);
        witness.witness.run_on(AFTERWARDS.min(MAX_CAUSES));
        witness.witness.finish()
    }

    /// The last snapshot before a point.
    fn nearest(&self, point: &Point) -> Snapshot<D> {
        let is_before = |snapshot: &Snapshot<D>| {
            let base = base(&snapshot.witness);
            self.plan.is_after(&self.clean, point, base)
        };
        let place = self.snapshots.partition_point(is_before);
        match place.checked_sub(1).and_then(|place| self.snapshots.get(place)) {
            Some(snapshot) => {
                Snapshot { witness: snapshot.witness.branch().quiet(), next: snapshot.next }
            }
            None => Snapshot { witness: Witness::new(self.start.clone(), false).quiet(), next: 0 },
        }
    }
}

fn base<D>(witness: &Witness<D>) -> Base {
    let Witness { sent, heard, begun, answered, .. } = *witness;
    Base { sent, heard, begun, answered }
}

fn numbered(faults: Vec<vimc4_device::Fault>) -> Vec<OwnedInput> {
    let begin =
        |(number, fault)| OwnedInput::Fault(Faulting::Begin(FaultNumber(NUMBERS + number), fault));
    (0..).zip(faults).map(begin).collect()
}
