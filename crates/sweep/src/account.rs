//! What happened in a run.

use vimc4_device::{Activity, Device, Event, Harness, Input, Kinds, Motion, Output, OwnedInput};
use vimc4_device::{Point, Time, TimedInput};

/// What happened in a run of a session.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Account {
    /// What the host said and heard, in order. The first one has nothing said: what was heard before.
    pub exchanges: Vec<Exchange>,
    /// The commands that were executed, in order.
    pub commands: Vec<CommandPlace>,
    /// For each answer that was given, the exchange.
    pub answers: Vec<usize>,
    /// What moved, in order.
    pub motions: Vec<MotionPlace>,
    /// For each byte that went to the controller, in which exchange it was said and how many bytes had
    /// come to the host before.
    pub to_controller: Vec<(usize, u64)>,
    /// For each byte that came to the host, the byte and in which exchange it was heard.
    pub to_host: Vec<(u8, usize)>,
    /// The axes that moved, but for reference runs, before they were referenced, each with the exchange
    /// in which it did so first.
    pub unreferenced: Vec<(String, usize)>,
    /// How everything stood at the end.
    pub end: End,
}

/// A line of the host, and what it heard before it said the next one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Exchange {
    /// The line without its end, or a control code.
    pub said: Vec<u8>,
    /// What came to the host.
    pub heard: Vec<u8>,
    /// Why the answer is an error, if the controller knows.
    pub why: Option<String>,
}

/// A command that was executed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CommandPlace {
    /// The line.
    pub line: Vec<u8>,
    /// What people call it.
    pub means: String,
    /// The exchange.
    pub exchange: usize,
    /// How many bytes had come to the host when it began.
    pub heard: u64,
}

/// A motion.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MotionPlace {
    /// How many commands had begun when it did, at least 1.
    pub command: u64,
    /// The axis that moved farthest.
    pub axis: u8,
    /// What the controller calls it.
    pub name: String,
    /// Its counter at the beginning.
    pub from: i64,
    /// Its counter at the end.
    pub to: i64,
    /// How many bytes had come to the host when it began.
    pub heard: u64,
    /// Whether it belongs to a reference run.
    pub references: bool,
}

/// How everything stood at the end of a run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct End {
    /// The axes.
    pub axes: Vec<AxisEnd>,
    /// Whether there was power.
    pub powered: bool,
    /// Whether the controller still did something by itself.
    pub busy: bool,
}

/// How an axis stood.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AxisEnd {
    /// What the controller calls it.
    pub name: String,
    /// The step counter.
    pub position: i64,
    /// Where the carriage really was, in steps of the machine.
    pub carriage: i64,
    /// Whether the reference point was known.
    pub referenced: bool,
}

/// Plays inputs, and takes note of what happens.
#[derive(Clone, Debug)]
pub(crate) struct Witness<D> {
    pub(crate) harness: Harness<D>,
    pub(crate) account: Account,
    /// How many exchanges came before those of the account.
    pub(crate) before: usize,
    /// How many bytes have gone to the controller, come to the host, how many commands have begun and how
    /// many were answered so far.
    pub(crate) sent: u64,
    pub(crate) heard: u64,
    pub(crate) begun: u64,
    pub(crate) answered: u64,
    /// The beginning of a line.
    half: Vec<u8>,
    moving: Option<Moving>,
    /// Whether places are listed, or only what was said and heard.
    lists: bool,
}

/// A motion that is under way.
#[derive(Clone, Debug)]
struct Moving {
    origin: Point,
    command: u64,
    heard: u64,
    references: bool,
    /// The axes that are not referenced: their numbers and names.
    unreferenced: Vec<(u8, String)>,
}

impl<D: Device + Clone> Witness<D> {
    /// Takes note from now on.
    pub(crate) fn new(device: D, lists: bool) -> Witness<D> {
        let kinds = Kinds::COMMAND.and(Kinds::ANSWER).and(Kinds::MOTION);
        let account = Account { exchanges: vec![Exchange::default()], ..Account::default() };
        Witness {
            harness: Harness::new(device).watching(kinds),
            account,
            before: 0,
            sent: 0,
            heard: 0,
            begun: 0,
            answered: 0,
            half: Vec::new(),
            moving: None,
            lists,
        }
    }

    /// The same without the events of the device, which cost more than the bytes: it takes note of what is
    /// said and heard and of the end, but not of commands, motions or reasons.
    pub(crate) fn quiet(mut self) -> Witness<D> {
        self.harness = self.harness.watching(Kinds::NONE);
        self.moving = None;
        self
    }

    /// A copy that goes on from here and lists no places. Of what was said and heard it has only the last.
    pub(crate) fn branch(&self) -> Witness<D> {
        let exchanges: Vec<Exchange> = self.account.exchanges.last().cloned().into_iter().collect();
        let before = self.before + self.account.exchanges.len() - exchanges.len();
        Witness {
            harness: self.harness.clone(),
            account: Account { exchanges, ..Account::default() },
            before,
            half: self.half.clone(),
            moving: self.moving.clone(),
            lists: false,
            ..*self
        }
    }

    /// Whether the host is between two lines.
    pub(crate) fn is_between_lines(&self) -> bool {
        self.half.is_empty()
    }

    /// Gives an input at its time.
    pub(crate) fn give(&mut self, TimedInput { at, input }: &TimedInput, ends: &[u8]) {
        self.run_to(*at);
        if let OwnedInput::Bytes(bytes) = input {
            for byte in bytes {
                self.say(*byte, ends);
            }
        }
        self.harness.accept(input.as_input());
        self.take();
        let now = self.harness.now();
        self.run_to(now);
    }

    /// Lets time pass.
    pub(crate) fn run_to(&mut self, at: Time) {
        while self.harness.due().is_some_and(|due| due <= at) && self.harness.step().is_some() {
            self.take();
        }
        if self.harness.now() < at {
            self.harness.run_to(at);
            self.take();
        }
    }

    /// Lets everything happen that happens by itself, but no more than so many causes.
    pub(crate) fn run_on(&mut self, causes: u32) {
        for _ in 0..causes {
            if self.harness.step().is_none() {
                return;
            }
            self.take();
        }
    }

    fn say(&mut self, byte: u8, ends: &[u8]) {
        self.sent += 1;
        let is_end = ends.contains(&byte);
        let is_urgent = !is_end && self.harness.device().is_urgent(byte);
        if is_urgent {
            self.account.exchanges.push(Exchange { said: vec![byte], ..Exchange::default() });
        } else if is_end {
            let said = std::mem::take(&mut self.half);
            self.account.exchanges.push(Exchange { said, ..Exchange::default() });
        } else {
            self.half.push(byte);
        }
        if self.lists {
            let open = usize::from(!is_end && !is_urgent);
            let exchange = self.before + self.account.exchanges.len() - 1 + open;
            self.account.to_controller.push((exchange, self.heard));
        }
    }

    fn exchange(&self) -> usize {
        self.before + self.account.exchanges.len().saturating_sub(1)
    }

    fn take(&mut self) {
        while let Some(output) = self.harness.take_output() {
            match output {
                Output::Bytes(_, bytes) => {
                    self.heard += bytes.len() as u64;
                    if self.lists {
                        let exchange = self.exchange();
                        self.account.to_host.extend(bytes.iter().map(|byte| (*byte, exchange)));
                    }
                    if let Some(exchange) = self.account.exchanges.last_mut() {
                        exchange.heard.extend_from_slice(&bytes);
                    }
                }
                Output::Event(_, event) => self.see(&event),
                Output::Flash(..) => {}
            }
        }
    }

    fn see(&mut self, event: &Event) {
        match event {
            Event::Command { bytes, .. } => {
                self.begun += 1;
                if self.lists {
                    let means = self.harness.device().explain(bytes);
                    let line = bytes.to_vec();
                    let (exchange, heard) = (self.exchange(), self.heard);
                    self.account.commands.push(CommandPlace { line, means, exchange, heard });
                }
            }
            Event::Answer { why, .. } => {
                self.answered += 1;
                if self.lists {
                    self.account.answers.push(self.exchange());
                }
                if let (Some(exchange), Some(why)) = (self.account.exchanges.last_mut(), why) {
                    exchange.why.get_or_insert_with(|| why.to_string());
                }
            }
            Event::Motion(Motion::Begins { origin, .. }) => self.begins(*origin),
            Event::Motion(Motion::Ends { .. }) => self.ends(),
            _ => {}
        }
    }

    fn begins(&mut self, origin: Point) {
        self.ends();
        let device = self.harness.device();
        let references = matches!(
            device.activity(),
            Activity::ReferenceTowardsSwitch
                | Activity::ReferenceOutOfSwitch
                | Activity::ReferenceFreeSteps
                | Activity::LeavingLimitSwitch
                | Activity::SelfTest
        );
        let axes = match references {
            true => Vec::new(),
            false => {
                let view = device.view(device.now());
                // Without power nothing will move.
                if view.powered { view.axes } else { Vec::new() }
            }
        };
        let axes = axes.into_iter().filter(|axis| !axis.referenced);
        let unreferenced = axes.map(|axis| (axis.index, axis.name)).collect();
        let (command, heard) = (self.begun.max(1), self.heard);
        self.moving = Some(Moving { origin, command, heard, references, unreferenced });
    }

    /// The motion that was under way, if any, is over.
    fn ends(&mut self) {
        let Some(moving) = self.moving.take() else { return };
        let device = self.harness.device();
        let now = device.position(device.now());
        let moved = |axis: u8| {
            let at = |point: &Point| point.get(usize::from(axis)).copied().unwrap_or_default();
            (at(&moving.origin), at(&now))
        };
        let exchange = self.exchange();
        for (axis, name) in &moving.unreferenced {
            let (from, to) = moved(*axis);
            let known = self.account.unreferenced.iter().any(|(known, _)| known == name);
            if from != to && !known {
                self.account.unreferenced.push((name.clone(), exchange));
            }
        }
        if !self.lists {
            return;
        }
        let axes = device.view(device.now()).axes;
        let farthest = axes.into_iter().max_by_key(|axis| {
            let (from, to) = moved(axis.index);
            // Of equal ones the first.
            (from.abs_diff(to), u8::MAX - axis.index)
        });
        let Some(axis) = farthest else { return };
        let (from, to) = moved(axis.index);
        if from != to {
            let Moving { command, heard, references, .. } = moving;
            let (axis, name) = (axis.index, axis.name);
            let place = MotionPlace { command, axis, name, from, to, heard, references };
            self.account.motions.push(place);
        }
    }

    /// The account, as things stand.
    pub(crate) fn finish(mut self) -> (Account, usize) {
        self.ends();
        if !self.half.is_empty() {
            let said = std::mem::take(&mut self.half);
            self.account.exchanges.push(Exchange { said, ..Exchange::default() });
        }
        let device = self.harness.device();
        let view = device.view(device.now());
        let axes = view.axes.into_iter().map(|axis| AxisEnd {
            name: axis.name,
            position: axis.position,
            carriage: axis.carriage,
            referenced: axis.referenced,
        });
        self.account.end = End {
            axes: axes.collect(),
            powered: view.powered,
            busy: view.powered && device.running().is_some(),
        };
        (self.account, self.before)
    }
}

/// Inputs whose bytes end with their lines, each line an input of its own. Bytes that arrived at the same
/// time in pieces are one.
pub(crate) fn by_lines(inputs: &[TimedInput], ends: &[u8]) -> Vec<TimedInput> {
    let mut whole: Vec<(Time, OwnedInput, Vec<u8>)> = Vec::new();
    for TimedInput { at, input } in inputs {
        match (input, whole.last_mut()) {
            (OwnedInput::Wake, _) => {}
            (OwnedInput::Bytes(bytes), Some((before, OwnedInput::Bytes(_), all)))
                if before == at =>
            {
                all.extend_from_slice(bytes);
            }
            (OwnedInput::Bytes(bytes), _) => whole.push((*at, input.clone(), bytes.to_vec())),
            _ => whole.push((*at, input.clone(), Vec::new())),
        }
    }
    let mut lines = Vec::new();
    for (at, input, bytes) in whole {
        if bytes.is_empty() {
            lines.push(TimedInput { at, input });
            continue;
        }
        for line in bytes.split_inclusive(|byte| ends.contains(byte)) {
            lines.push(TimedInput { at, input: Input::Bytes(line).into() });
        }
    }
    lines
}
