//! Requests that act on the device, and what happens on its line.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::Duration;

use vimc4_device::{
    Damage, Deed, Device, Fault, FaultNumber, Faulting, Input, Kinds, LineFault, OwnedInput,
    Ruling, Scenario, ScenarioNumber, Time, Way, When,
};

use crate::session::Session;
use crate::{ControlError, Effect, LineEvent, NO_MORE_FAULTS, NO_MORE_RULES, Source};

/// Requests.
impl<D: Device> Session<D> {
    /// Performs an operator action.
    pub fn act(&mut self, wall: Duration, by: &Source, deed: Deed) -> Result<Effect, ControlError> {
        let inputs = deed.inputs(&self.device().signals())?;
        let inputs: Vec<_> = inputs.iter().map(OwnedInput::as_input).collect();
        let at = self.present(wall);
        Ok(self.engine.act(by, deed, &inputs, at))
    }

    /// A fault begins. Returns its number.
    pub fn inject_fault(
        &mut self,
        wall: Duration,
        by: &Source,
        fault: Fault,
    ) -> Result<FaultNumber, ControlError> {
        let faulting = Faulting::Begin(FaultNumber::NEXT, fault);
        let effect = self.act(wall, by, Deed::Fault(Box::new(faulting)))?;
        if effect == (Effect::Nothing { why: Some(NO_MORE_FAULTS) }) {
            return Err(ControlError::Unsupported(NO_MORE_FAULTS));
        }
        // The latest fault has the highest number.
        let numbers = self.device().faults().into_iter().map(|view| view.number);
        let numbers = numbers.filter(|number| *number != FaultNumber::TERMINAL);
        Ok(numbers.max().unwrap_or_default())
    }

    /// The rules of a scenario begin. Returns its number.
    pub fn begin_scenario(
        &mut self,
        wall: Duration,
        by: &Source,
        scenario: Scenario,
    ) -> Result<ScenarioNumber, ControlError> {
        if scenario.rules.is_empty() {
            return Ok(ScenarioNumber::NEXT);
        }
        let ruling = Ruling::Begin(ScenarioNumber::NEXT, scenario);
        let effect = self.give_all(wall, by, &[Input::Rule(&ruling)]);
        if effect == (Effect::Nothing { why: Some(NO_MORE_RULES) }) {
            return Err(ControlError::Unsupported(NO_MORE_RULES));
        }
        // The latest scenario has the highest number.
        let numbers = self.device().rules().into_iter().map(|view| view.id.scenario);
        Ok(numbers.max().unwrap_or_default())
    }

    /// A scenario ends, or all do.
    pub fn end_scenarios(
        &mut self,
        wall: Duration,
        by: &Source,
        number: Option<ScenarioNumber>,
    ) -> Effect {
        let ruling = number.map_or(Ruling::EndAll, Ruling::End);
        self.give_all(wall, by, &[Input::Rule(&ruling)])
    }

    /// All scenarios and faults end.
    pub fn reset(&mut self, wall: Duration, by: &Source) -> Effect {
        let inputs = [Input::Rule(&Ruling::EndAll), Input::Fault(&Faulting::EndAll)];
        self.give_all(wall, by, &inputs)
    }

    /// Gives the device inputs whose effect it reports itself.
    pub fn give_all(&mut self, wall: Duration, by: &Source, inputs: &[Input<'_>]) -> Effect {
        let at = self.present(wall);
        self.engine.give_all(by, inputs, at)
    }

    /// Gives the device an input. While time is paused, its consequences are left to steps.
    pub fn give(&mut self, wall: Duration, by: &Source, input: Input<'_>) {
        let at = self.present(wall);
        if self.is_paused() {
            return self.engine.give(input, Some(by));
        }
        self.engine.input(input, at, Some(by));
        self.engine.fail_unreachable_waiters();
    }

    /// Continues from another state, whose time becomes the present. A pause remains.
    pub fn restore(&mut self, wall: Duration, by: &Source, state: D::State) {
        let at = self.present(wall);
        if !self.is_paused() {
            self.engine.pass_time(at);
        }
        if self.engine.is_wanted(Kinds::COMMAND) {
            self.report(at, LineEvent::Deed { by: by.clone(), deed: Deed::Restore });
        }
        self.engine.report_dropped_bytes(at);
        self.continue_from(wall, by, at, state);
    }

    /// Reports an event of the line.
    pub fn report(&mut self, at: Time, news: LineEvent) {
        self.engine.report_news(at, news);
    }

    /// The device ends, as if its power were switched off. [`cut_off`](Session::cut_off) follows, when
    /// recordings of the inputs have been closed.
    pub fn end(&mut self, at: Time) {
        self.engine.release();
        self.engine.report_dropped_bytes(at);
        self.report(at, LineEvent::Ends);
        self.engine.settle();
    }

    /// Has the device report what its end cuts short.
    pub fn cut_off(&mut self, at: Time) {
        if self.engine.is_wanted(Kinds::ANSWER) {
            // The device can report half a line, if it has it.
            if let Some(partial) = self.clients.held_back() {
                self.engine.input(Input::Bytes(&partial), at, None);
            }
            self.engine.input(Input::Power(false), at, None);
        }
    }
}

/// What happens on the line.
impl<D: Device> Session<D> {
    /// Bytes arrive on a transport, from a client with this baud rate if that is known and counts.
    pub fn handle_bytes(
        &mut self,
        wall: Duration,
        transport: &Arc<str>,
        client_baud: Option<u32>,
        bytes: &[u8],
    ) {
        let at = self.present(wall);
        self.sync_baud(transport, at, client_baud);
        if self.clients.are_several()
            && self.engine.wants.is_some()
            && let Some(news) = self.clients.speaks(transport)
        {
            self.report(at, news);
        }
        self.take_bytes(transport, bytes, at);
        if let Some(right) = self.clients.wrong_line_end(bytes) {
            let transport = Arc::clone(transport);
            self.report(at, LineEvent::LineFeed { transport, right: right.into() });
        }
        self.engine.fail_unreachable_waiters();
    }

    /// Bytes arrive from a source that is no client of a transport.
    pub fn send_bytes(&mut self, wall: Duration, by: &Source, bytes: &[u8]) {
        let at = self.present(wall);
        self.engine.send_bytes(bytes, at, || by.clone());
        self.engine.fail_unreachable_waiters();
    }

    /// A transport reports an event: a client comes or goes, for example.
    pub fn handle_news(
        &mut self,
        wall: Duration,
        transport: &Arc<str>,
        client_baud: Option<u32>,
        news: LineEvent,
    ) {
        let at = self.present(wall);
        let news = match news {
            LineEvent::WrongSpeed { transport, client, line, .. } => {
                let noise = self.has_physics;
                LineEvent::WrongSpeed { transport, client, line, noise }
            }
            news => news,
        };
        match news {
            LineEvent::Closed { observes: false, .. } => self.sync_baud(transport, at, None),
            LineEvent::Opened { observes: false, .. } | LineEvent::WrongSpeed { .. } => {
                self.sync_baud(transport, at, client_baud);
            }
            _ => {}
        }
        let partial = self.clients.open_or_close(&news);
        // A client that opens the line reads what it will find, and of one that closes it what it left.
        let opens = matches!(news, LineEvent::Opened { .. });
        let (first, second) = if opens { (partial, Some(news)) } else { (Some(news), partial) };
        for news in first.into_iter().chain(second) {
            self.report(at, news);
        }
    }

    /// If the line has its physics, the baud rate of the client counts, where it is another one than
    /// that of the device.
    fn sync_baud(&mut self, transport: &Arc<str>, at: Time, client_baud: Option<u32>) {
        if !self.has_physics {
            return;
        }
        let speed = client_baud.filter(|baud| *baud != self.device().baud());
        let faults = self.device().faults();
        let known = faults.into_iter().find(|view| view.number == FaultNumber::TERMINAL);
        let known = known.and_then(|view| match view.fault.of_line()?.damage {
            Damage::Speed(speed) => Some(speed),
            _ => None,
        });
        let faulting = match speed {
            speed if speed == known => return,
            Some(speed) => {
                let fault = LineFault::new(Damage::Speed(speed), Way::Both, When::ALWAYS);
                Faulting::Begin(FaultNumber::TERMINAL, fault.into())
            }
            None => Faulting::End(FaultNumber::TERMINAL),
        };
        let by = self.clients.source(transport);
        match self.is_paused() {
            true => self.engine.hold_back(Input::Fault(&faulting), Some(&by)),
            false => self.engine.input(Input::Fault(&faulting), at, Some(&by)),
        }
    }

    /// Passes on bytes, and reports a partial line of another client that they continue.
    fn take_bytes(&mut self, transport: &Arc<str>, bytes: &[u8], at: Time) {
        let Session { engine, clients, .. } = self;
        let half_line =
            |half, spoils| LineEvent::HalfLine { transport: Arc::clone(transport), half, spoils };
        if !clients.track_lines() {
            return engine.send_bytes(bytes, at, || clients.source(transport));
        }
        let by = clients.source_of_partial(transport, bytes);
        if let Some(by) = &by
            && let Some(half) = clients.continued_partial(by)
        {
            engine.report_news(at, half_line(half, true));
        }
        match clients.take(bytes, by) {
            Cow::Borrowed(bytes) => engine.send_bytes(bytes, at, || clients.source(transport)),
            Cow::Owned(bytes) if bytes.is_empty() => {}
            Cow::Owned(bytes) => engine.send_bytes(&bytes, at, || clients.source(transport)),
        }
        if let Some(half) = clients.late_partial() {
            engine.report_news(at, half_line(half, false));
        }
    }
}
