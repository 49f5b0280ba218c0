//! Ports, their bits and their values.

use std::ops::RangeInclusive;

use super::command::{Placed, PortBit, Span};
use super::problem::Problem;
use super::reader::Reader;
use super::reference::CommandInfo;
use super::token;
use super::value::Value;

/// The ports of each kind.
const PORTS: RangeInclusive<u8> = 1..=4;
/// The bits of a port.
const BITS: RangeInclusive<u8> = 1..=8;

impl<'t> Reader<'t, '_> {
    /// A port: `A` or `E`, and its number.
    pub(super) fn port(
        &mut self,
        info: &'static CommandInfo,
        name: Span,
        letter: char,
    ) -> Option<Placed<u8>> {
        if self.ends() {
            self.missing(info, name, "port");
            return None;
        }
        let start = Span { start: self.place(), end: self.place() };
        let written = self.take(token::letters);
        let right = written
            .is_some_and(|text| text.value.eq_ignore_ascii_case(letter.encode_utf8(&mut [0])));
        self.ends();
        if !right || !self.next_is(token::digits) {
            let text = Span { end: self.pass_over().end, ..start };
            self.say(text, Problem::NotAPort(letter));
            return None;
        }
        let value = self.count("the number of the port", PORTS)?;
        Some(Placed { value, span: self.since(start) })
    }

    /// A port, a point and a bit.
    pub(super) fn port_bit(
        &mut self,
        info: &'static CommandInfo,
        name: Span,
        letter: char,
    ) -> Option<Placed<PortBit>> {
        let port = self.port(info, name, letter)?;
        if self.take(token::point).is_none() || !self.next_is(token::digits) {
            self.say(self.since(port.span), Problem::MissingBit);
            return None;
        }
        let bit = self.count("the number of the bit", BITS)?;
        let value = PortBit { port: port.value, bit };
        Some(Placed { value, span: self.since(port.span) })
    }

    /// A small number without a sign.
    pub(super) fn count(&mut self, what: &'static str, allowed: RangeInclusive<u8>) -> Option<u8> {
        let digits = self.take(token::digits)?;
        let number = digits.value.parse().ok().filter(|number| allowed.contains(number));
        if number.is_none() {
            let bound = |bound: &u8| Value::whole(i64::from(*bound));
            let (least, most) = (bound(allowed.start()), bound(allowed.end()));
            self.say(digits.span, Problem::OutOfRange { what, least, most });
        }
        number
    }

    /// The value that a port or a bit is to have, behind an equals sign.
    pub(super) fn equal_to<T>(&mut self, port: Placed<T>, most: u8) -> Option<u8> {
        if self.take(token::equals).is_none() {
            self.say(port.span, Problem::MissingEquals);
            return None;
        }
        if self.ends() {
            self.say(self.since(port.span), Problem::MissingPortValue);
            return None;
        }
        let written = self.take(token::port_value);
        let Some(Placed { value: Some(value), span }) = written else {
            let span = written.map_or_else(|| self.pass_over(), |written| written.span);
            self.say(span, Problem::NotAPortValue(self.excerpt(span)));
            return None;
        };
        let value = u8::try_from(value).ok().filter(|value| *value <= most);
        if value.is_none() {
            let most = Value::whole(i64::from(most));
            self.say(span, Problem::OutOfRange { what: "the value", least: Value::ZERO, most });
        }
        value
    }
}
