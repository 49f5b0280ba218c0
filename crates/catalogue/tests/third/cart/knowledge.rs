//! What tools must know of a cart.

use std::time::Duration;

use vimc4_device::{
    Effects, Erasing, Handling, Heard, Identity, Point, Question, Travel, Until, said,
};

use super::Model;

/// What a cart says whose motion somebody has ended.
const STOPPED: &[u8] = b"stopped";

/// The number in an answer.
fn number(answer: &[u8]) -> Option<i64> {
    std::str::from_utf8(answer).ok()?.parse().ok()
}

impl vimc4_device::Model for Model {
    const FAMILY: &'static str = "cart";
    const MAKER: &'static str = "Cart & Sons";
    const COMMAND_SETS: &'static [&'static str] = &["rails"];
    const AXES: &'static [&'static [&'static str]] = &[&["X"]];
    const QUIRKS: &'static [(&'static str, &'static [&'static str])] =
        &[("squeaks", &["false", "true"])];

    fn effects_of(sent: &[u8]) -> Effects {
        let mut lines = sent.split(|byte| *byte == b'\r');
        Effects { moves: lines.any(|line| line.starts_with(b"m")), ..Effects::default() }
    }

    fn travel_of(command: &[u8]) -> Travel {
        match command.first() {
            Some(b'm') => Travel::Relative,
            Some(b'p') => Travel::Question,
            _ => Travel::None,
        }
    }

    fn kind_of(answer: &[u8]) -> Option<String> {
        Some(said(answer)).filter(|kind| !kind.is_empty())
    }

    fn completes(_answer: &[u8]) -> bool {
        true
    }

    fn refusal(answer: &[u8]) -> Option<String> {
        (answer == STOPPED).then(|| said(answer))
    }

    fn is_own_answer(answer: &[u8]) -> bool {
        answer == STOPPED
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn title(&self) -> &str {
        &self.title
    }

    fn baud(&self) -> u32 {
        self.baud
    }

    fn axis_names(&self) -> &'static [&'static str] {
        &["X"]
    }

    fn erasing_at_panel(&self) -> Result<&'static [(&'static str, i32)], &'static str> {
        Err("a cart has no panel")
    }

    fn has_commands_of(&self, other: &Model) -> bool {
        self.command_set == other.command_set
    }

    fn handling(&self) -> Handling {
        Handling {
            ends: b"\r",
            instead_of_line_feed: Some((b"\r", "CR does")),
            halt: b"",
            halting: "nothing on the line stops a cart",
            stop: None,
            warning: "Ctrl-C ends this; the cart goes on to its end.",
            abandon: b"",
            reset: b"",
            ready: &[],
            homing: Some("somebody who pushes it"),
            boot: Duration::ZERO,
            running: Duration::from_secs(60),
            position: "p",
            needs_axes: None,
            names: &[],
            done: b"0",
            speeds: &[9_600],
            erase: &[],
            erasing: Erasing::Nothing,
            fill: &[],
            start: &[],
            takes_stream: false,
            volunteers: false,
        }
    }

    fn read_position(&self, answer: &[u8]) -> Option<Vec<i64>> {
        number(answer).map(|place| vec![place])
    }

    fn hear(&self, _sent: &[u8], answer: &[u8]) -> Heard {
        match answer {
            b"" => Heard::Waits,
            STOPPED => Heard::Whole,
            _ if STOPPED.starts_with(answer) => Heard::Part,
            _ if number(answer).is_some() => Heard::Perhaps,
            _ => Heard::Strange,
        }
    }

    fn moving(&self, [x, ..]: Point, _speed: u64) -> Vec<String> {
        vec![format!("m{x}")]
    }

    /// It has no name, but only a cart answers `p` with a number.
    fn identify<E>(
        &self,
        ask: &mut dyn FnMut(Question) -> Result<Vec<u8>, E>,
    ) -> Result<Identity, E> {
        let answer = ask(Question { send: b"p\r", until: Until::Pause })?;
        Ok(match (number(&answer), said(&answer)) {
            (Some(_), said) => Identity::Same(said),
            (None, said) if said.is_empty() => Identity::Silent,
            (None, said) => Identity::Unknown(said),
        })
    }
}
