//! Ports, spindle and coolant.

use vimc4_motion::Turn;
use vimc4_plant::Output;

use super::sink::Sink;
use super::state::{Interpreter, Refusal};
use crate::job::action::{Action, InputTest, OutputChange};
use crate::job::problem::{PortName, PortNames, Problem};
use crate::job::target::{Direction, InputPort, OutputPort};
use crate::language::{Accessory, Span, SpindleWords, Value};

/// The port is mapped to nothing.
fn unmapped(port: PortName) -> Problem {
    Problem::PortsUnmapped { ports: PortNames::of(port), lines: 1 }
}

impl Interpreter<'_> {
    /// SETPORT, SETBIT, RESBIT: `bit` is from 1, and `value` is 0 or 1 for it.
    pub(super) fn set_output(
        &mut self,
        number: u8,
        bit: Option<u8>,
        value: u8,
        sink: &mut Sink<'_>,
    ) -> Result<(), Refusal> {
        let name = PortName { direction: Direction::Output, number };
        let mapped = self.target.setup.ports.output(number);
        let port = mapped.ok_or((sink.span, unmapped(name)))?;
        let OutputPort { wired, is_single } = self.writable(port, sink.span)?;
        let bit = bit.map(|bit| bit.saturating_sub(1));
        let needed = bit.map_or(value, |bit| 1 << bit);
        self.want_wires(name, port, needed, wired, is_single, sink)?;
        sink.push(Action::Output(OutputChange { port, bit, value }));
        Ok(())
    }

    /// WAITPORT, WAITBIT: `bit` is from 1, and `value` is 0 or 1 for it.
    pub(super) fn await_input(
        &mut self,
        number: u8,
        bit: Option<u8>,
        value: u8,
        sink: &mut Sink<'_>,
    ) -> Result<(), Refusal> {
        let direction = Direction::Input;
        let name = PortName { direction, number };
        let mapped = self.target.setup.ports.input(number);
        let port = mapped.ok_or((sink.span, unmapped(name)))?;
        let known = self.target.controller.inputs.get(&port).copied();
        let no_port = (sink.span, Problem::NoSuchPort { input: true, port });
        let InputPort { wired, free, rest } = known.ok_or(no_port)?;
        let bit = bit.map(|bit| bit.saturating_sub(1));
        match bit {
            // Without a wire it reads 0.
            Some(bit) if value == 1 => {
                self.want_wires(name, port, 1 << bit, wired, false, sink)?;
            }
            None if (value ^ rest) & !free != 0 => {
                sink.say(Problem::WaitUnreachable { port: name, value, rest, free });
            }
            _ => {}
        }
        sink.push(Action::Await(InputTest { port, bit, value }));
        Ok(())
    }

    /// Reports the bits that a line needs and that have no wire, each once.
    fn want_wires(
        &mut self,
        port: PortName,
        of_controller: u16,
        needed: u8,
        wired: u8,
        is_refused: bool,
        sink: &mut Sink<'_>,
    ) -> Result<(), Refusal> {
        let missing = needed & !wired;
        let problem = Problem::NoWire { port, bits: missing, wired, is_refused };
        if missing != 0 && is_refused {
            return Err((sink.span, problem));
        }
        if self.is_news(port.direction, of_controller, missing) {
            sink.say(problem);
        }
        Ok(())
    }

    /// Whether bits without a wire have not all been reported; they are from now on.
    fn is_news(&mut self, direction: Direction, port: u16, bits: u8) -> bool {
        let told = self.state.told_of_wires.entry((direction, port)).or_default();
        let before = *told;
        *told |= bits;
        *told != before
    }

    fn writable(&self, port: u16, span: Span) -> Result<OutputPort, Refusal> {
        let known = self.target.controller.outputs.get(&port).copied();
        known.ok_or((span, Problem::NoSuchPort { input: false, port }))
    }

    /// Switches an output that the machine's profile names.
    fn switch(&mut self, output: Output, on: bool, sink: &mut Sink<'_>) -> Result<(), Refusal> {
        let Output { port, bit } = output;
        let wired = self.writable(port, sink.span)?.wired;
        let needed = 1 << bit.unwrap_or(0);
        if needed & wired == 0 && self.is_news(Direction::Output, port, needed) {
            sink.say(Problem::NoWireBehind { port, bit: bit.unwrap_or(0) });
        }
        sink.push(Action::Output(OutputChange { port, bit, value: on.into() }));
        Ok(())
    }

    pub(super) fn spindle(
        &mut self,
        words: &SpindleWords,
        sink: &mut Sink<'_>,
    ) -> Result<(), Refusal> {
        let Some(spindle) = self.target.setup.spindle else {
            self.say_of_spindle(0, sink.span, Problem::NoSpindle, sink);
            return Ok(());
        };
        if let (Some(turn), false) = (words.turn, words.off) {
            let reverse = turn.value == Turn::Counterclockwise;
            match spindle.counterclockwise {
                Some(output) => self.switch(output, reverse, sink)?,
                // It always turns in the same direction.
                None if reverse => {
                    self.say_of_spindle(1, turn.span, Problem::NoSpindleDirection, sink);
                }
                None => {}
            }
        }
        if let (Some(rpm), false) = (words.rpm, words.off) {
            match spindle.analogue {
                None => self.say_of_spindle(2, rpm.span, Problem::NoSpindleSpeed, sink),
                Some(analogue) => {
                    let port = analogue.port;
                    self.writable(port, rpm.span)?;
                    let full = Value::whole(analogue.full_rpm.into());
                    if rpm.value > full {
                        sink.say_at(rpm.span, Problem::SpindleCapped(analogue.full_rpm));
                    }
                    let share = rpm.value.clamp(Value::ZERO, full).as_f64() / full.as_f64();
                    let value = libm::round(share * 255.0) as u8;
                    sink.push(Action::Output(OutputChange { port, bit: None, value }));
                }
            }
        }
        self.switch(spindle.on, !words.off, sink)?;
        words.time.into_iter().for_each(|time| sink.dwell(time));
        Ok(())
    }

    pub(super) fn accessory(
        &mut self,
        accessory: Accessory,
        on: bool,
        sink: &mut Sink<'_>,
    ) -> Result<(), Refusal> {
        let Some(output) = self.target.setup.accessory(accessory) else {
            let state = &mut self.state;
            state.unconnected.insert(accessory);
            state.first_unconnected.get_or_insert((state.line, sink.span));
            return Ok(());
        };
        self.switch(output, on, sink)
    }

    /// Reports something about the spindle, once.
    fn say_of_spindle(&mut self, what: usize, span: Span, problem: Problem, sink: &mut Sink<'_>) {
        if let Some(told) = self.state.told_of_spindle.get_mut(what).filter(|told| !**told) {
            *told = true;
            sink.say_at(span, problem);
        }
    }
}
