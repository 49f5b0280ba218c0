//! Ports, spindle and coolant.

use vimc4_motion::Turn;
use vimc4_plant::Output;

use super::sink::Sink;
use super::state::{Interpreter, Refusal};
use crate::job::action::{Action, OutputChange};
use crate::job::problem::Problem;
use crate::language::{Accessory, Span, SpindleWords, Value};

impl Interpreter<'_> {
    pub(super) fn output_port(&self, number: u8, span: Span) -> Result<u16, Refusal> {
        let unmapped = Problem::PortUnmapped { input: false, number };
        let port = self.target.setup.ports.output(number).ok_or((span, unmapped))?;
        self.writable(port, span)
    }

    pub(super) fn writable(&self, port: u16, span: Span) -> Result<u16, Refusal> {
        match self.target.controller.outputs.contains(&port) {
            true => Ok(port),
            false => Err((span, Problem::NoSuchPort { input: false, port })),
        }
    }

    pub(super) fn input_port(&self, number: u8, span: Span) -> Result<u16, Refusal> {
        let unmapped = Problem::PortUnmapped { input: true, number };
        let port = self.target.setup.ports.input(number).ok_or((span, unmapped))?;
        match self.target.controller.inputs.contains(&port) {
            true => Ok(port),
            false => Err((span, Problem::NoSuchPort { input: true, port })),
        }
    }

    pub(super) fn switch(
        &self,
        output: Output,
        on: bool,
        sink: &mut Sink<'_>,
    ) -> Result<(), Refusal> {
        let port = self.writable(output.port, sink.span)?;
        sink.push(Action::Output(OutputChange { port, bit: output.bit, value: on.into() }));
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
                    let port = self.writable(analogue.port, rpm.span)?;
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
