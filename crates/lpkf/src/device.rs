//! The controller as a device.

use vimc4_device::{
    AXES, Activity, Device, Fact, Fault, Input, Kinds, Output, Point, Running, Signal, SignalId,
    Time, View,
};

use crate::controller::Controller;
use crate::language::{Axis, remarks, why_refused};
use crate::state::State;
use crate::view::Details;

impl Device for Controller {
    type State = State;
    type Details = Details;

    fn perform(&mut self, at: Time) -> bool {
        self.perform_cause(at)
    }

    fn accept(&mut self, input: Input<'_>, at: Time) {
        self.state.now = at.max(self.state.now);
        match input {
            Input::Bytes(bytes) => self.receive(bytes),
            Input::Signal(id, value) => self.signal(id, value),
            Input::Power(on) => self.power(on),
            Input::Fault(faulting) => self.fault(faulting),
            Input::Rule(_) | Input::Wake => {}
        }
    }

    fn poll_output(&mut self) -> Option<Output> {
        self.out.poll()
    }

    fn watch(&mut self, kinds: Kinds) -> Kinds {
        self.out.watch(kinds)
    }

    fn state(&self) -> State {
        self.state.clone()
    }

    fn restore(&mut self, state: State) {
        self.state = state;
        self.out.clear();
        if self.state.plant.is_without_next_switch() {
            self.state.expect_switch();
        }
    }

    fn now(&self) -> Time {
        self.state.now
    }

    fn wake(&self) -> Option<Time> {
        self.state.next_cause().map(|(due, _)| due)
    }

    fn view(&self, at: Time) -> View<Details> {
        self.state.picture(at)
    }

    fn activity(&self) -> Activity {
        self.state.shown_activity()
    }

    fn details(&self) -> Details {
        self.state.own_details()
    }

    fn position(&self, at: Time) -> Point {
        let mut position = [0; AXES];
        let running = self.state.running();
        for index in self.state.fitted().map(Axis::index) {
            let offset = running.map_or(0, |running| running.offset(index, at.max(self.state.now)));
            position[index] = self.state.position[index] + offset;
        }
        position
    }

    fn reach(&self) -> (Point, Point) {
        let here = self.state.position;
        let Some(Running { segment, .. }) = self.state.running() else { return (here, here) };
        let (low, high) = segment.path.extent(segment.profile.steps());
        let moved = |way: Point| std::array::from_fn(|axis| here[axis].saturating_add(way[axis]));
        (moved(low), moved(high))
    }

    fn running(&self) -> Option<Running<'_>> {
        self.state.running()
    }

    fn signals(&self) -> Vec<Signal> {
        self.state.list_signals()
    }

    fn baud(&self) -> u32 {
        self.state.model.line.baud
    }

    fn room(&self, handshake: bool) -> usize {
        if handshake { self.state.room_before_high_water() } else { usize::MAX }
    }

    /// It stores nothing.
    fn flash_image(&self) -> Vec<u8> {
        Vec::new()
    }

    fn explain(&self, command: &[u8]) -> String {
        match self.state.reader.understand(command) {
            Ok(known) => known.describe() + &remarks(command, self.state.model.grammar()),
            Err(status) => why_refused(command, self.state.model.grammar(), status),
        }
    }

    fn why_without_effect(&self, signal: SignalId, value: i32) -> Option<&'static str> {
        self.state.why_ignored(signal, value)
    }

    fn why_in_vain(&self, fault: &Fault) -> Option<&'static str> {
        self.state.plant.why_in_vain(fault)
    }

    fn is_idle(&self) -> bool {
        self.state.rests()
    }

    fn first_time(&self, fact: &Fact, from: Time) -> Option<Time> {
        self.state.forecast(fact, from)
    }
}
