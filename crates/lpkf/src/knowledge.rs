//! What tools must know of these controllers without speaking their language.
//!
//! Nothing in here has to do with how a controller works: it is a client's view of one.

mod abilities;
mod answers;
mod effects;
mod identity;
mod stream;

use std::sync::Arc;
use std::time::Duration;

use vimc4_device::{
    Ability, Effects, Erasing, Handling, Heard, Identity, MemoryError, Piece, Point, Question,
    Travel, Turn, Vocabulary,
};
use vimc4_plant::Machine;

use crate::controller::Controller;
use crate::language::{Dialect, Grammar, Reader, Status, forms, parse};
use crate::model::{Model, StatusDigits};

impl Model {
    /// A controller of this model on a machine, just switched on. It has no memory, so the image
    /// must be empty.
    ///
    /// # Errors
    ///
    /// If the image is not empty.
    pub fn switched_on(
        self: &Arc<Self>,
        machine: Arc<Machine>,
        image: &[u8],
    ) -> Result<Controller, MemoryError> {
        match image.is_empty() {
            true => Ok(Controller::new(Arc::clone(self), machine)),
            false => Err(MemoryError::NoMemory),
        }
    }
}

const SMCU_AXES: &[&str] = &["X", "Y", "Z"];
const MOTION_SYSTEM_AXES: &[&str] = &["X", "Y", "Z0", "Z1", "Z2", "Z3"];

impl vimc4_device::Model for Model {
    const FAMILY: &'static str = "lpkf";
    const MAKER: &'static str = "LPKF";
    const COMMAND_SETS: &'static [&'static str] = &["smcu", "motionsystem"];
    const AXES: &'static [&'static [&'static str]] = &[SMCU_AXES, MOTION_SYSTEM_AXES];
    const QUIRKS: &'static [(&'static str, &'static [&'static str])] = &[
        ("unknown_command", &["\"echo\"", "\"never\"", "\"always\""]),
        ("init_reply", &["\"Z\"", "\"C\""]),
        ("init_echo", &["\"on\"", "\"off\""]),
        ("after_status", &["\"wait\"", "\"refuse\"", "\"execute\""]),
        ("hard_clip_blank", &["false", "true"]),
        ("status_digits", &["\"hexadecimal\"", "\"decimal\""]),
        ("decimal_speed", &["\"micrometres\"", "\"metres\""]),
        ("bare_pairs", &["\"ignore\"", "\"repeat\""]),
        ("ta", &["\"move\"", "\"none\""]),
    ];

    /// The trackball moves an axis only because a command has opened it, so no signal moves
    /// anything.
    fn effects_of(sent: &[u8]) -> Effects {
        effects::of(sent)
    }

    /// What has begun continues to its end regardless of the line, so nothing need be known of it.
    fn travel_of(_command: &[u8]) -> Travel {
        Travel::Unknown
    }

    fn kind_of(answer: &[u8]) -> Option<String> {
        answers::kind_of(answer)
    }

    fn completes(answer: &[u8]) -> bool {
        matches!(answer.first(), Some(b'C' | b'E' | b'Z'))
    }

    fn refusal(answer: &[u8]) -> Option<String> {
        answers::refusal(answer)
    }

    fn is_own_answer(answer: &[u8]) -> bool {
        answers::is_status(answer)
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn title(&self) -> &str {
        &self.title
    }

    fn baud(&self) -> u32 {
        self.line.baud
    }

    fn axis_names(&self) -> &'static [&'static str] {
        match self.command_set {
            Dialect::Smcu => SMCU_AXES,
            Dialect::MotionSystem => MOTION_SYSTEM_AXES,
        }
    }

    fn has_handshake_lines(&self) -> bool {
        true
    }

    fn erasing_at_panel(&self) -> Result<&'static [(&'static str, i32)], &'static str> {
        Err("this model has no memory that could be erased")
    }

    fn has_commands_of(&self, other: &Model) -> bool {
        self.command_set == other.command_set
    }

    fn handling(&self) -> Handling {
        let right = "CR and ; do: printf 'PU;', or in socat crnl behind the address, as in \
                     ./vimc4.pty,rawer,crnl";
        Handling {
            ends: b"\r\n;",
            instead_of_line_feed: (!self.grammar().line_feed_ends).then_some((b"\r;", right)),
            // The `!` also completes any command that was begun.
            halt: b"!CC;!CB;",
            halting: "the commands that wait were taken away, but nothing on the line stops a command \
                      that runs: it goes on to its end, unless somebody presses the stop at the machine",
            stop: None,
            warning: "Ctrl-C ends this and takes away the commands that wait; one that runs goes on to \
                      its end: only a stop at the machine ends it before.",
            abandon: b"!CC;!CI;!CB;!GO;",
            // Closes what is open, discards what waits and lifts a stop; then `IN` is obeyed. What
            // is sent together with it may be lost.
            reset: b"!CC;!CI;!CB;!GO;IN;",
            // `IN` ends the echo mode on some machines. It also blocks the external stop, the only
            // way to stop a moving machine.
            ready: &["!CT1", "!ES1"],
            homing: Some("`PA0,0;`, or `!IS;` for a reference run"),
            boot: Duration::ZERO,
            running: Duration::from_secs(60),
            position: "!ON0",
            needs_axes: None,
            names: &["OS"],
            done: b"C\r",
            speeds: &[9_600, 4_800, 57_600],
            erase: &[],
            erasing: Erasing::Nothing,
            fill: &[],
            start: &[],
            takes_stream: true,
            volunteers: true,
        }
    }

    fn read_position(&self, answer: &[u8]) -> Option<Vec<i64>> {
        answers::read_position(answer)
    }

    fn hear(&self, sent: &[u8], answer: &[u8]) -> Heard {
        if answers::is_whole(sent, answer) { Heard::Whole } else { Heard::Waits }
    }

    /// Only the speed of an SMCU's X and Y is set, which is always one of linear axes; all others
    /// keep their power-on speed.
    fn moving(&self, by: Point, speed: u64) -> Vec<String> {
        let [x, y, rest @ ..] = by;
        let along = (2..).zip(rest).filter(|(_, way)| *way != 0);
        let plane = format!("PR{x},{y}");
        match self.command_set {
            Dialect::Smcu => {
                // Steps a second become µm a second with the resolution after power-on.
                let speed = u128::from(speed) * u128::from(self.defaults.resolution_pm) / 1_000_000;
                let speed = speed.clamp(10, u128::from(self.limits.speed_max));
                let z = along.map(|(_, way)| format!("!ZR{way}"));
                [format!("!VU{speed}"), plane].into_iter().chain(z).collect()
            }
            Dialect::MotionSystem => {
                let others = along.map(|(axis, way)| format!("!ZR{way},{axis}"));
                [plane].into_iter().chain(others).collect()
            }
        }
    }

    fn abilities(&self) -> Vec<Ability> {
        abilities::of(self)
    }

    fn turn(&self, command: &[u8]) -> Turn {
        // Bare numbers, and those of unknown commands, may be moves.
        match Reader::new(self.grammar()).understand(command) {
            Err(Status::UnknownCommand) => Turn::Unknown,
            Ok(command) if command.is_direct() => Turn::Overtakes,
            _ => Turn::InOrder,
        }
    }

    fn known_with(&self, command: &[u8]) -> Option<&'static str> {
        let unknown = |grammar: Grammar| parse(command, grammar) == Err(Status::UnknownCommand);
        let own = self.grammar();
        let others = [
            (Grammar { shapes: true, ..own }, "shapes = true under [language]"),
            (Grammar { reads_ports: true, ..own }, "read_port = true under [language]"),
            (Grammar { space_moves: true, ..own }, "ta = \"move\" under [quirks]"),
        ];
        let known = others.into_iter().find(|(other, _)| unknown(own) && !unknown(*other));
        known.map(|(_, value)| value)
    }

    fn vocabulary(&self) -> Option<Vocabulary> {
        let (grammar, set) = (self.grammar(), self.command_set);
        let decimal = self.quirks.status_digits == StatusDigits::Decimal;
        let known = forms().iter().filter(|form| grammar.knows(form));
        Some(Vocabulary {
            commands: known.map(|form| form.mnemonic.to_owned()).collect(),
            // Where numbers without letters are a move, a line may begin with one.
            spellings: match grammar.bare_pairs {
                true => "+-.0123456789".chars().map(String::from).collect(),
                false => Vec::new(),
            },
            errors: Status::ALL.iter().filter_map(|status| status.written(set, decimal)).collect(),
            ports: self.io.read.iter().copied().map(u16::from).collect(),
            stores: false,
        })
    }

    fn refusal_of(&self, command: &[u8], answer: &[u8]) -> Option<String> {
        answers::refusal_of(self, command, answer)
    }

    fn stream(&self, file: &[u8]) -> Vec<Piece> {
        stream::pieces(self, file)
    }

    fn identify<E>(
        &self,
        ask: &mut dyn FnMut(Question) -> Result<Vec<u8>, E>,
    ) -> Result<Identity, E> {
        identity::identify(self, ask)
    }
}

#[cfg(test)]
mod tests {
    use vimc4_device::Model as _;

    use super::*;

    fn builtin(name: &str) -> Arc<Model> {
        Model::builtin(name).unwrap()
    }

    #[test]
    fn some_commands_overtake_others_and_some_are_none() {
        let smcu = builtin("smcu");
        for (command, of) in [
            ("PA1,2", Turn::InOrder),
            ("PA1", Turn::InOrder),
            ("!GO", Turn::Overtakes),
            ("!ST", Turn::Overtakes),
            ("!RP", Turn::Unknown),
            ("SP1", Turn::Unknown),
            ("1,2", Turn::InOrder),
        ] {
            assert_eq!(smcu.turn(command.as_bytes()), of, "{command}");
        }
        assert_eq!(builtin("motionsystem").turn(b"!RP"), Turn::Overtakes);
        assert_eq!(smcu.known_with(b"CI5"), Some("shapes = true under [language]"));
        assert_eq!(smcu.known_with(b"!RD0"), Some("read_port = true under [language]"));
        for command in ["PA1,2", "SP1", "!RP"] {
            assert_eq!(smcu.known_with(command.as_bytes()), None, "{command}");
        }
    }

    #[test]
    fn the_way_back_is_made_of_relative_moves() {
        let smcu = builtin("smcu");
        assert_eq!(smcu.moving([5, -3, 0, 0, 0, 0], 1_000), ["!VU7937", "PR5,-3"]);
        assert_eq!(smcu.moving([0, 0, -9, 0, 0, 0], 1_000), ["!VU7937", "PR0,0", "!ZR-9"]);
        assert_eq!(
            builtin("motionsystem").moving([0, 0, 7, 0, -2, 0], 1),
            ["PR0,0", "!ZR7,2", "!ZR-2,4"]
        );
    }
}
