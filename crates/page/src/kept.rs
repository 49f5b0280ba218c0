//! A controller that remembers all that was done to it.

use std::collections::VecDeque;

use vimc4_catalogue::{Controller, Details, State};
use vimc4_debug::{Debugger, Wired};
use vimc4_device::{
    Activity, Device, Fact, Fault, FaultView, Input, Kinds, LineState, Output, Point, RuleView,
    Running, Signal, SignalId, Time, View,
};

/// A controller at its line with its history and a debugger on it, as a device: whatever is done to it is kept.
#[derive(Debug)]
pub(crate) struct Kept {
    pub(crate) debugger: Debugger,
    out: VecDeque<Output>,
    wanted: Kinds,
}

/// A controller that remembers.
pub(crate) fn kept(controller: Controller) -> Kept {
    let debugger = Debugger::new(controller);
    Kept { debugger, out: VecDeque::new(), wanted: Kinds::ALL }
}

/// The controller itself.
pub(crate) fn bare(kept: &Kept) -> &Controller {
    kept.debugger.device()
}

impl Kept {
    fn line(&self) -> &Wired {
        self.debugger.line()
    }

    /// What has come out meanwhile.
    fn collect(&mut self) {
        let outputs = self.debugger.history_mut().drain();
        let wanted = self.wanted;
        self.out.extend(outputs.filter(|output| match output {
            Output::Event(_, event) => wanted.contain(event.kind()),
            _ => true,
        }));
    }

    /// Does the next thing that is due by then.
    fn act(&mut self, at: Time) -> bool {
        let has_acted = self.debugger.history_mut().find_next(at, |_, _, _| true);
        self.collect();
        has_acted
    }
}

impl Device for Kept {
    type State = LineState<State>;
    type Details = Details;

    fn perform(&mut self, at: Time) -> bool {
        self.act(at)
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
        while self.debugger.place().moment.inputs < given && self.act(at) {}
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
        self.debugger.history_mut().put_back("put back", state);
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
