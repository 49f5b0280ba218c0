//! What the controller reports of itself: positions, ports, diagnosis, texts.

use std::fmt::Write as _;

use vimc4_isel_wire::{AxisSet, Dialect, Reply};
use vimc4_plant::End;

use crate::answers::Answer;
use crate::axes::AXIS_NAMES;
use crate::firmware::Firmware;
use crate::model::{Place, PositionAxes};
use crate::wiring::{Output, Wire};

/// The axes whose positions are reported even if they are not configured.
const XYZ: AxisSet = AxisSet::X.union(AxisSet::Y).union(AxisSet::Z);

impl Firmware {
    /// `P`: `0` and six hexadecimal digits for each axis; four axes where A is configured,
    /// otherwise three, however many are configured. Older cards leave out those that are not.
    pub(crate) fn position_report(&self) -> Answer {
        let state = &self.state;
        let told = match state.model.quirks.position_axes {
            PositionAxes::Three => XYZ.union(state.axes),
            PositionAxes::Configured => state.axes,
        };
        let mut answer = Vec::with_capacity(1 + 6 * told.count());
        answer.push(Reply::Done.code());
        for axis in told.iter() {
            for digit in (0..6).rev() {
                answer.push(hex_digit((state.position[axis] >> (4 * digit)) as u8 & 15));
            }
        }
        answer.into()
    }

    /// `0` and a byte as two hexadecimal digits.
    pub(crate) fn hex_report(&self, byte: u8) -> Answer {
        vec![Reply::Done.code(), hex_digit(byte >> 4), hex_digit(byte & 15)].into()
    }

    /// `D`: a byte of diagnosis, if the model's profile has it.
    pub(crate) fn diagnosis_report(&self, code: [u8; 2]) -> Option<Answer> {
        let wires = self.state.model.diagnosis.get(std::str::from_utf8(&code).ok()?)?;
        Some(self.hex_report(self.value_of(wires)))
    }

    /// `H`: the operating elements, a line each; then the limit switches (99 2.2.16), or the
    /// inputs (05 2.2.16, 12 2.2.12).
    pub(crate) fn status_report(&self) -> Answer {
        let panel = self.state.plant.panel();
        let mut text = String::new();
        let mut line = |name: &str, value: &str| {
            let _ = write!(text, "{name:<16}{value}\r\n");
        };
        let pressed = |on| if on { "pressed" } else { "-" };
        line("Start button", pressed(panel.start));
        line("Stop button", pressed(panel.stop));
        line("On button", pressed(panel.on));
        line("Emergency stop", pressed(panel.emergency_stop));
        line("Key switch", if panel.automatic { "automatic" } else { "test" });
        line("Cover", if panel.cover_closed { "closed" } else { "open" });
        let on_off = |on| if on { "on" } else { "off" };
        line("Spindle", on_off(self.state.outputs.get(Output::SPINDLE)));
        line("Power stage", on_off(self.state.motors_on()));
        match self.has_limit_report() {
            true => self.input_lines(line),
            false => text.push_str(&self.limit_lines()),
        }
        text_answer(&text)
    }

    /// The inputs that some port of the model shows and that are not operating elements.
    fn input_lines(&self, mut line: impl FnMut(&str, &str)) {
        let ports = &self.state.model.ports;
        let is_shown = |wire: Wire| ports.read.values().flatten().any(|shown| *shown == wire);
        for (wire, name, on, off) in [
            (Wire::PowerOk, "Motor supply", "on", "off"),
            (Wire::Overtemperature, "Stages", "too hot", "-"),
            (Wire::Probe, "Probe", "touched", "-"),
        ] {
            if is_shown(wire) || wire == Wire::Probe && ports.probe.is_some() {
                line(name, if self.level(wire) { on } else { off });
            }
        }
        for number in (0..16).filter(|number| is_shown(Wire::Input(*number))) {
            let on = if self.level(Wire::Input(number)) { "on" } else { "-" };
            line(&format!("Input {}", number + 1), on);
        }
    }

    /// `h`: the limit switches, a line for each axis.
    pub(crate) fn limit_report(&self) -> Answer {
        text_answer(&self.limit_lines())
    }

    fn limit_lines(&self) -> String {
        let mut text = String::new();
        for (axis, name) in AXIS_NAMES.iter().enumerate() {
            let switch = |end| if self.limit_active(axis, end) { "active" } else { "-" };
            let (low, high) = (switch(End::Negative), switch(End::Positive));
            let _ = write!(text, "Limit switch {name}  neg {low:<8}pos {high}\r\n");
        }
        text
    }

    /// On the IMC4 the status includes the limit switches; later models have `h` for them.
    fn has_limit_report(&self) -> bool {
        self.state.model.command_set.dialect() != Dialect::Imc4
    }

    /// `V`: the version.
    pub(crate) fn version_report(&self) -> Answer {
        self.with_handshake(self.version_text().as_bytes())
    }

    /// The lines of the version.
    pub(crate) fn version_text(&self) -> String {
        self.state.model.texts.version.iter().map(|line| format!("{line}\r\n")).collect()
    }

    /// `U`: the user's text.
    pub(crate) fn user_report(&self) -> Answer {
        let text = self.state.settings.user_info.as_bytes();
        self.with_handshake(&[b"isel UserInfo: ", text, b"\r\n"].concat())
    }

    /// A text with the handshake where this model has it.
    fn with_handshake(&self, text: &[u8]) -> Answer {
        let done = [Reply::Done.code()];
        match self.state.model.quirks.version_handshake {
            Place::First => [&done, text].concat().into(),
            Place::Last => [text, &done].concat().into(),
        }
    }

    // --- ports ---
}

/// Text lines, then the handshake.
fn text_answer(text: &str) -> Answer {
    format!("{text}{}", char::from(Reply::Done.code())).into_bytes().into()
}

fn hex_digit(nibble: u8) -> u8 {
    b"0123456789ABCDEF"[usize::from(nibble & 15)]
}
