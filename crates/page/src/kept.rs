//! A controller that remembers all that was done to it.

use std::collections::VecDeque;

use bytes::Bytes;
use vimc4_catalogue::{Controller, Details, State};
use vimc4_debug::{Debugger, Wired};
use vimc4_device::{
    Activity, CommandNumber, Device, Event, Fact, Fault, FaultView, Input, Kinds, LineState,
    ModemLine, Output, OwnedInput, Point, RuleView, Running, Signal, SignalId, Stamp, Time, View,
    Warning,
};
use vimc4_timeline::{Act, History, Place};

/// A controller at its line with its history and a debugger on it, as a device: whatever is done to it is kept.
#[derive(Debug)]
pub(crate) struct Kept {
    pub(crate) debugger: Debugger,
    out: VecDeque<Output>,
    /// What commands meant when they came, until that is told: those behind them may change what they mean.
    meant: VecDeque<(CommandNumber, String)>,
    wanted: Kinds,
    /// What the controller got by the last thing that it did, if that was an input that was typed in the debugger.
    given: Option<OwnedInput>,
}

/// A controller at its line that remembers.
pub(crate) fn kept(line: Wired) -> Kept {
    let debugger = Debugger::over(History::new(line));
    let (out, meant) = (VecDeque::new(), VecDeque::new());
    Kept { debugger, out, meant, wanted: Kinds::ALL, given: None }
}

/// The input, or the byte of one, that the controller has just got from the debugger, if that is what it did.
pub(crate) fn given(kept: &mut Kept) -> Option<OwnedInput> {
    kept.given.take()
}

/// What a command meant when it came, if that has been kept for whoever tells of it.
pub(crate) fn meant(kept: &mut Kept, number: CommandNumber) -> Option<String> {
    let place = kept.meant.iter().position(|(own, _)| *own == number)?;
    kept.meant.drain(..=place).next_back().map(|(_, text)| text)
}

/// The controller itself.
pub(crate) fn bare(kept: &Kept) -> &Controller {
    kept.debugger.device()
}

impl Kept {
    pub(crate) fn line(&self) -> &Wired {
        self.debugger.line()
    }

    /// What has come out meanwhile.
    fn collect(&mut self) {
        let outputs: Vec<Output> = self.debugger.history_mut().drain().collect();
        for output in outputs {
            match &output {
                Output::Event(_, event) if !self.wanted.contain(event.kind()) => continue,
                Output::Event(
                    Stamp { command: Some(number), .. },
                    Event::Command { bytes, .. },
                ) => {
                    let meaning = self.line().explain(bytes);
                    self.meant.push_back((*number, meaning));
                }
                _ => {}
            }
            self.out.push_back(output);
        }
    }

    /// What did not fit of bytes that came together is one thing that has happened: a controller of isel says
    /// it after the last of them. The history gives them one by one, and so it is said of each.
    fn gather_lost(&mut self, from: usize) {
        let lost = |output: &Output| match output {
            Output::Event(_, Event::Warning(Warning::ReceiveOverflow { lost })) => Some(*lost),
            _ => None,
        };
        let all: u64 = self.out.range(from..).filter_map(lost).sum();
        if all < 2 || self.details().isel().is_none() {
            return;
        }
        let mut last = None;
        for output in self.out.split_off(from) {
            match output {
                Output::Event(stamp, _) if lost(&output).is_some() => last = Some(stamp),
                output => self.out.push_back(output),
            }
        }
        let warning = Event::Warning(Warning::ReceiveOverflow { lost: all });
        self.out.extend(last.map(|stamp| Output::Event(stamp, warning)));
    }

    /// Does the next thing that is due by then.
    fn act(&mut self, at: Time) -> Option<Act> {
        let mut done = None;
        self.debugger.history_mut().find_next(at, |_, act, _| {
            done = Some(act);
            true
        });
        self.collect();
        done
    }

    /// What the controller has just got.
    fn got(&self, act: Act) -> Option<OwnedInput> {
        match act {
            Act::Byte(byte) => Some(OwnedInput::Bytes(Bytes::copy_from_slice(&[byte]))),
            Act::Input => {
                let Place { branch, moment } = self.debugger.place();
                let number = moment.inputs.saturating_sub(1);
                let given = self.debugger.history().inputs(branch, number).next();
                given.map(|given| given.input)
            }
            Act::Cause => None,
        }
    }
}

impl Device for Kept {
    type State = LineState<State>;
    type Details = Details;

    /// What the debugger was told to give is due as well: whoever has this done has not given it.
    fn perform(&mut self, at: Time) -> bool {
        let act = self.act(at);
        self.given = act.and_then(|act| self.got(act));
        act.is_some()
    }

    fn accept(&mut self, input: Input<'_>, at: Time) {
        let history = self.debugger.history_mut();
        history.wait_until(at);
        history.give(input);
        if matches!(input, Input::Wake | Input::Bytes([])) {
            return self.collect();
        }
        let given = history.present().moment.inputs + 1;
        let at = at.max(history.now());
        let before = self.out.len();
        while self.debugger.place().moment.inputs < given && self.act(at).is_some() {}
        self.gather_lost(before);
    }

    fn poll_output(&mut self) -> Option<Output> {
        self.out.pop_front()
    }

    /// The history watches everything; what is not wanted goes no further.
    fn watch(&mut self, kinds: Kinds) -> Kinds {
        std::mem::replace(&mut self.wanted, kinds)
    }

    fn state(&self) -> LineState<State> {
        self.line().state()
    }

    /// The past stays: from here on there is another branch.
    fn restore(&mut self, state: LineState<State>) {
        self.out.clear();
        self.meant.clear();
        let history = self.debugger.history_mut();
        history.leave(history.present());
        history.put_back("put back", state);
    }

    fn now(&self) -> Time {
        self.debugger.now()
    }

    fn wake(&self) -> Option<Time> {
        self.debugger.history().next_act()
    }

    fn view(&self, at: Time) -> View<Details> {
        self.line().view(at)
    }

    fn activity(&self) -> Activity {
        self.line().activity()
    }

    fn details(&self) -> Details {
        self.line().details()
    }

    fn position(&self, at: Time) -> Point {
        self.line().position(at)
    }

    fn reach(&self) -> (Point, Point) {
        self.line().reach()
    }

    fn running(&self) -> Option<Running<'_>> {
        self.line().running()
    }

    fn signals(&self) -> Vec<Signal> {
        self.line().signals()
    }

    fn baud(&self) -> u32 {
        self.line().baud()
    }

    fn room(&self, handshake: bool) -> usize {
        self.line().room(handshake)
    }

    fn modem_line(&self) -> Option<(ModemLine, bool)> {
        self.line().modem_line()
    }

    fn flash_image(&self) -> Vec<u8> {
        self.line().flash_image()
    }

    fn explain(&self, command: &[u8]) -> String {
        self.line().explain(command)
    }

    fn is_urgent(&self, byte: u8) -> bool {
        self.line().is_urgent(byte)
    }

    fn why_without_effect(&self, signal: SignalId, value: i32) -> Option<&'static str> {
        self.line().why_without_effect(signal, value)
    }

    fn why_in_vain(&self, fault: &Fault) -> Option<&'static str> {
        self.line().why_in_vain(fault)
    }

    fn faults(&self) -> Vec<FaultView> {
        self.line().faults()
    }

    fn rules(&self) -> Vec<RuleView> {
        self.line().rules()
    }

    fn is_idle(&self) -> bool {
        self.line().is_idle()
    }

    fn first_time(&self, fact: &Fact, from: Time) -> Option<Time> {
        self.line().first_time(fact, from)
    }

    fn comes_round(&self, from: Time) -> Option<Time> {
        self.line().comes_round(from)
    }
}
