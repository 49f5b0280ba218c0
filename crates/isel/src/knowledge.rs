//! What tools must know of these controllers without speaking their language.
//!
//! Nothing in here has to do with how a controller works: it is a client's view of one.

mod abilities;
mod answers;
mod effects;
mod identity;

use std::sync::Arc;
use std::time::Duration;

use vimc4_device::{
    Ability, Effects, Erasing, Handling, Heard, Identity, MemoryError, Point, Question,
    StartButton, Stop, Travel, Vocabulary,
};
use vimc4_isel_wire::{Control, Mode, Op, Reply, spec, table};
use vimc4_plant::Machine;

use crate::axes::AXIS_NAMES;
use crate::wiring::spindle_of;
use crate::{Controller, FlashError, Model};

/// A control code ends what was begun or does not belong to it.
const ENDS: &[u8] = &[b'\r', Control::Stop.byte(), Control::Reset.byte(), Control::Break.byte()];
const STOP: &[u8] = &[Control::Stop.byte()];
const RESET: &[u8] = &[Control::Reset.byte()];
const BREAK: &[u8] = &[Control::Break.byte()];
/// 255 ends a reference run without a reference; where a controller ignores 255, 253 halts the
/// axis.
const END_OF_REFERENCE: &[u8] = &[Control::Break.byte(), Control::Stop.byte()];

/// A program and settings that differ from the factory's.
const FILL: &[&str] = &[
    "@07",
    "@0i",
    "040,400,40,400,0,400,0,400",
    "9",
    "@0Ij500",
    "@0IJ20",
    "@0Id700,700,700,700",
    "@0IF3,3,3,3",
    "@0IUthe owner's",
    "@0IW",
];

impl Model {
    /// A controller of this model on a machine, just switched on, with this image in its memory.
    ///
    /// # Errors
    ///
    /// If the image is not one of this model's.
    pub fn switched_on(
        self: &Arc<Self>,
        machine: Arc<Machine>,
        image: &[u8],
    ) -> Result<Controller, MemoryError> {
        let wrong = |FlashError { line, message }| MemoryError::Line { line, message };
        Controller::new(Arc::clone(self), machine, image).map_err(wrong)
    }

    fn erasing(&self) -> Erasing {
        let has_command = spec(self.command_set.dialect(), Mode::Direct, Op::Erase).is_some();
        match (has_command, self.timing.panel_erase_ms) {
            (true, _) => Erasing::Command("@0k"),
            (false, Some(_)) => Erasing::Panel(
                "press and release the emergency stop, turn the key to test, hold STOP, press ON, release STOP, wait 20 s until it is erased, and press ON",
            ),
            (false, None) => Erasing::Nothing,
        }
    }
}

impl vimc4_device::Model for Model {
    const FAMILY: &'static str = "isel";
    const MAKER: &'static str = "isel";
    const COMMAND_SETS: &'static [&'static str] = &["imc4", "imc4-m", "imc-xx", "c142"];
    const AXES: &'static [&'static [&'static str]] = &[&AXIS_NAMES];
    const QUIRKS: &'static [(&'static str, &'static [&'static str])] = &[
        ("version_handshake", &["\"first\"", "\"last\""]),
        ("stop_reply", &["\"F\"", "\"F0\""]),
        ("fractional_numbers", &["\"reject\"", "\"truncate\""]),
        ("limit_latch", &["\"strict\"", "\"off\""]),
        ("lost_steps", &["false", "true"]),
        ("leave_switch", &["\"refuse\"", "\"away\""]),
        ("loop_count", &["\"total\"", "\"extra\""]),
        ("cond_branch_base", &["\"next\"", "\"own\""]),
        ("cond_bit_base", &["0", "1"]),
        ("start_resumes_dnc", &["false", "true"]),
        ("unreferenced", &["\"2\"", "\"R\""]),
        ("stop_button", &["\"held\"", "\"pressed\""]),
        ("stop_in_reference", &["\"end\"", "\"switch\""]),
        ("stop_in_move_until", &["\"keep\"", "\"forget\""]),
        ("after_free", &["\"reference\"", "\"any\""]),
        ("speed_3d", &["\"longest\"", "\"xyz\""]),
        ("bit_values", &["\"any\"", "\"binary\""]),
        ("stored_arcs", &["\"check\"", "\"accept\""]),
        ("limit_bits", &["\"switch\"", "\"end\""]),
        ("axis_codes", &["\"nested\"", "\"any\"", "\"pair\"", "\"keep\""]),
        ("lower_case", &["\"after\"", "\"before\"", "\"before-and-error\""]),
        ("position_axes", &["\"three\"", "\"configured\""]),
        ("resting_speed", &["\"check\"", "\"zero\""]),
        ("store_over", &["\"refuse\"", "\"replace\""]),
        ("self_test_end", &["\"echo\"", "\"commands\""]),
        ("reset_reply", &["\"none\"", "\"0\""]),
        ("break_reply", &["\"none\"", "\"0\""]),
        ("start_at_rest", &["\"refuse\"", "\"program\""]),
        ("lone_end", &["\"5\"", "\"0\"", "\"none\""]),
        ("capital_d", &["\"diagnosis\"", "\"speeds\""]),
    ];

    fn effects_of(sent: &[u8]) -> Effects {
        effects::of(sent)
    }

    fn effects_of_signal(name: &str) -> Effects {
        effects::of_signal(name)
    }

    fn travel_of(command: &[u8]) -> Travel {
        effects::travel_of(command)
    }

    /// A text reply ends with its code, every other begins with it.
    fn kind_of(answer: &[u8]) -> Option<String> {
        let code = if answer.ends_with(b"\r\n0") { b'0' } else { *answer.first()? };
        Some(char::from(code).to_string())
    }

    fn completes(_answer: &[u8]) -> bool {
        true
    }

    fn refusal(answer: &[u8]) -> Option<String> {
        answers::refusal(answer)
    }

    /// Other families end what they say with CR.
    fn is_own_answer(answer: &[u8]) -> bool {
        matches!(answer, [code] if Reply::from_code(*code).is_some())
    }

    /// After an emergency stop or a loss of power they count from 0.
    fn resets_counters(answer: &[u8]) -> bool {
        answer == [Reply::Plant.code()]
    }

    /// A motion was halted without a ramp, or an axis had no reference point before (99 4; 12 5).
    fn distrusts_counters(answer: &[u8]) -> bool {
        answer == [Reply::LimitSwitch.code()]
    }

    /// It has lost its axes or its reference.
    fn has_forgotten(answer: &[u8]) -> bool {
        [Reply::NoAxes, Reply::Reference].iter().any(|reply| answer == [reply.code()])
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
        &AXIS_NAMES
    }

    /// The emergency stop is pressed and released; with the key on test, STOP is held while ON is
    /// pressed.
    fn erasing_at_panel(&self) -> Result<&'static [(&'static str, i32)], &'static str> {
        if self.timing.panel_erase_ms.is_some() {
            return Ok(&[
                ("estop", 1),
                ("estop", 0),
                ("key", 0),
                ("stop", 1),
                ("on", 1),
                ("on", 0),
                ("stop", 0),
            ]);
        }
        Err(match self.erasing() {
            Erasing::Command(_) => {
                "the panel of this model does not erase; send the command @0k instead"
            }
            _ => "the panel of this model does not erase, and neither does a command",
        })
    }

    fn panel_erase_ms(&self) -> Option<u64> {
        self.timing.panel_erase_ms
    }

    fn has_commands_of(&self, other: &Model) -> bool {
        self.command_set == other.command_set
    }

    fn handling(&self) -> Handling {
        let start = match self.quirks.start_resumes_dnc {
            true => StartButton::Resumes,
            // Then it is a bit for hosts to read (99 2.2.12).
            false => StartButton::IsSeen { question: "@0DS0", bit: 1 },
        };
        Handling {
            ends: ENDS,
            instead_of_line_feed: Some((
                ENDS,
                "CR does: printf '@07\\r', or in socat crnl behind the address, as in \
                 ./vimc4.pty,rawer,crnl",
            )),
            halt: STOP,
            halting: "253 was sent, so that a motion brakes along its ramp: 254 or switching off \
                      makes the controller forget the rest of it",
            stop: Some(Stop {
                motion: STOP,
                reference: END_OF_REFERENCE,
                name: "253",
                resume: "@0S",
                start,
            }),
            warning: "Ctrl-C halts a motion along its ramp and ends this.",
            abandon: BREAK,
            reset: RESET,
            ready: &[],
            homing: None,
            boot: Duration::from_millis(self.timing.boot_ms),
            running: Duration::ZERO,
            position: "@0P",
            needs_axes: Some("@0n0"),
            names: &["@0V", "@0?", "@0U"],
            done: b"0",
            speeds: &[19_200, 9_600, 38_400],
            erase: &["@0k", "@0IX", "@0IW"],
            erasing: self.erasing(),
            fill: FILL,
            start: &["@07", "@0S"],
            takes_stream: false,
            volunteers: false,
        }
    }

    fn vocabulary(&self) -> Option<Vocabulary> {
        let dialect = self.command_set.dialect();
        let modes = [Mode::Direct, Mode::Stored].into_iter();
        let specs = modes.flat_map(|mode| table(dialect, mode));
        Some(Vocabulary {
            commands: specs.map(|spec| spec.mnemonic.to_owned()).collect(),
            // These letters may be small ones too.
            spellings: ["@a", "@r", "@s", "@m", "@?"].map(str::to_owned).to_vec(),
            errors: Reply::ALL
                .iter()
                .filter(|reply| **reply != Reply::Done)
                .map(|reply| char::from(reply.code()).to_string())
                .collect(),
            ports: self.ports.read.keys().chain(self.ports.read_alias.keys()).copied().collect(),
            stores: true,
        })
    }

    fn abilities(&self) -> Vec<Ability> {
        abilities::of(self)
    }

    fn refusal_of(&self, command: &[u8], answer: &[u8]) -> Option<String> {
        answers::refusal_of(self, command, answer)
    }

    fn spindle_after(&self, command: &[u8]) -> Option<bool> {
        effects::spindle_after(self, command)
    }

    fn spindle_shown(&self) -> Option<(u16, u8)> {
        spindle_of(&self.ports.read)
    }

    fn read_position(&self, answer: &[u8]) -> Option<Vec<i64>> {
        answers::read_position(self, answer)
    }

    fn names_axes(&self, places: usize) -> bool {
        places >= 3
    }

    fn hear(&self, sent: &[u8], answer: &[u8]) -> Heard {
        answers::hear(self, sent, answer)
    }

    fn moving(&self, by: Point, speed: u64) -> Vec<String> {
        let [x, y, z, a, ..] = by;
        let mut lines = vec!["@07".to_owned()];
        if a != 0 {
            lines.push("@08".to_owned());
        }
        // With three axes the fourth way is the second of Z, and nothing.
        lines.push(format!("@0A{x},{speed},{y},{speed},{z},{speed},{a},{speed}"));
        lines
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

    #[test]
    fn a_command_that_erases_is_named_where_there_is_one() {
        for name in Model::names() {
            let model = Model::builtin(name).unwrap();
            let erasing = model.handling().erasing;
            match name {
                "imc4" => assert!(matches!(erasing, Erasing::Panel(_))),
                "c142" => assert_eq!(erasing, Erasing::Nothing),
                _ => assert_eq!(erasing, Erasing::Command("@0k"), "{name}"),
            }
            let hands = model.erasing_at_panel();
            assert_eq!(hands.is_ok(), name == "imc4", "{name}");
            let sends = hands.is_err_and(|why| why.contains("@0k"));
            assert_eq!(sends, erasing == Erasing::Command("@0k"), "{name}");
        }
    }
}
