//! Models of controllers: a model is data, not a fork of the code.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};
use vimc4_device::ModemLine;
use vimc4_isel_wire::{AxisSet, Context, Dialect, Fractions, Mode, Op, table};
use vimc4_plant::{ProfileError, profiles};

use crate::wiring::{Ports, Wire, spindle_of};

/// A model of controller. Every value that the manuals leave open is in here, so that the owner of
/// a real controller can correct it without touching code.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// Its name.
    pub name: String,
    /// What it is, in one line.
    pub title: String,
    /// Its commands.
    pub command_set: CommandSet,
    /// Its texts about itself.
    pub texts: Texts,
    /// The serial line.
    pub line: LineProfile,
    /// Ranges of values.
    pub limits: Limits,
    /// What holds after power-on.
    pub defaults: Defaults,
    /// How long things take.
    pub timing: Timing,
    /// The flash memory.
    pub flash: FlashProfile,
    /// Behaviour that differs from card to card or is not documented.
    pub quirks: Quirks,
    /// The ports.
    pub ports: Ports,
    /// The bytes of the diagnosis command by their two characters.
    pub diagnosis: BTreeMap<String, Vec<Wire>>,
}

/// The commands of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CommandSet {
    /// The IMC4 of 1999.
    Imc4,
    /// The IMC4-M of 2005.
    Imc4M,
    /// The iMC-M, iMC-MP and iMC-S8 of 2012.
    ImcXx,
    /// The interface cards before the IMC4. No manual is at hand; their commands are assumed to be
    /// those of the IMC4.
    C142,
}

impl CommandSet {
    /// The command set as the wire format knows it.
    #[must_use]
    pub fn dialect(self) -> Dialect {
        match self {
            CommandSet::Imc4 | CommandSet::C142 => Dialect::Imc4,
            CommandSet::Imc4M => Dialect::Imc4M,
            CommandSet::ImcXx => Dialect::ImcXx,
        }
    }
}

/// The texts of a controller about itself.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Texts {
    /// The lines of the version.
    pub version: Vec<String>,
}

/// The serial line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineProfile {
    /// Bits per second as set by jumper: 19200 or 9600.
    pub baud: u32,
    /// Bytes that wait while a command executes.
    pub receive_buffer: usize,
    /// The modem line that is on at the host while START is pressed: one pin of the serial connector
    /// carries the button (05 1.2, 6), and the cable decides where it arrives.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_line: Option<ModemLine>,
}

/// Ranges of values.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// The lowest speed in Hz.
    pub speed_min: u32,
    /// The highest speed in Hz.
    pub speed_max: u32,
    /// How deep loops may be nested.
    pub loop_depth: usize,
}

impl Limits {
    /// The speeds there are, in Hz.
    #[must_use]
    pub fn speeds(&self) -> RangeInclusive<u32> {
        self.speed_min..=self.speed_max
    }
}

/// What holds after power-on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Defaults {
    /// Reference speeds of X, Y, Z, A in Hz.
    pub reference_speed: [u32; 4],
    /// Start-stop frequency in Hz.
    pub start_stop: u32,
    /// Acceleration in Hz/ms.
    pub acceleration: u32,
}

/// How long things take.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Timing {
    /// Erasing the program by command, ms.
    pub erase_ms: u64,
    /// Erasing it by STOP and ON with the key on test, ms; absent where the panel cannot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub panel_erase_ms: Option<u64>,
    /// From a reset until commands are read again, ms.
    pub boot_ms: u64,
    /// The least time a line of a program takes, µs.
    pub line_us: u64,
}

/// The flash memory.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlashProfile {
    /// Bytes for the program.
    pub size: u32,
    /// Bytes a stored command takes.
    pub command_bytes: u32,
    /// Bytes each of its parameters takes.
    pub parameter_bytes: u32,
}

/// Behaviour that differs from card to card or is not documented.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quirks {
    /// Where the `0` of the version text stands.
    pub version_handshake: Place,
    /// What a stopped motion answers.
    pub stop_reply: StopReply,
    /// Numbers with a fraction.
    pub fractional_numbers: Fractions,
    /// Whether a limit switch error blocks further motion.
    pub limit_latch: LimitLatch,
    /// Whether halting without a ramp above the start-stop frequency loses steps.
    pub lost_steps: bool,
    /// Moves of an axis that is on an active limit switch.
    pub leave_switch: LeaveSwitch,
    /// What the number of a loop counts.
    pub loop_count: LoopCount,
    /// What the offset of a conditional branch counts from.
    pub cond_branch_base: BranchBase,
    /// The number of the lowest bit in the condition of a move, 0 or 1.
    pub cond_bit_base: u8,
    /// Whether START resumes a motion that was stopped in DNC mode.
    pub start_resumes_dnc: bool,
    /// What an absolute move of an axis without reference point answers.
    pub unreferenced: Unreferenced,
    /// How long STOP counts.
    pub stop_button: StopButton,
    /// What STOP and 253 do to a reference run of a program.
    pub stop_in_reference: StopInReference,
    /// What STOP and 253 leave of a move until a port event.
    pub stop_in_move_until: StopInMoveUntil,
    /// What is possible after an axis has left its limit switch by `F`.
    pub after_free: AfterFree,
    /// The axes whose longest way has the speed of a 3D move.
    #[serde(rename = "speed_3d")]
    pub speed_of_3d: SpeedOf3d,
    /// The values that a stored line may give a single bit of a port.
    pub bit_values: BitValues,
    /// Circles and helices that are stored while their axes are not set.
    pub stored_arcs: StoredArcs,
    /// What the bits of `IE` belong to where `Ie` swaps the switches of an axis.
    pub limit_bits: LimitBits,
    /// The sets of axes that `@0<n>` takes.
    pub axis_codes: AxisCodes,
    /// When a motion with a small letter answers.
    pub lower_case: LowerCase,
    /// The axes whose positions `P` tells.
    pub position_axes: PositionAxes,
    /// The speeds that are accepted for an axis that does not move.
    pub resting_speed: RestingSpeed,
    /// What `i` does to a program that is stored.
    pub store_over: StoreOver,
    /// What comes after the self-test.
    pub self_test_end: SelfTestEnd,
    /// What 254 answers.
    pub reset_reply: ControlReply,
    /// What 255 answers while nothing executes.
    pub break_reply: ControlReply,
    /// What `S` does while nothing is stopped, on the cards before the iMC-xx. These always run the
    /// stored program.
    #[serde(default)]
    pub start_at_rest: StartAtRest,
    /// What `9` answers while no data field is being stored.
    #[serde(default)]
    pub lone_end: LoneEnd,
    /// What `D` means.
    #[serde(default)]
    pub capital_d: CapitalD,
}

impl Quirks {
    /// Whether the offset of a conditional branch counts from the line after it.
    #[must_use]
    pub fn branches_from_next(&self) -> bool {
        self.cond_branch_base == BranchBase::Next
    }
}

/// First or last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Place {
    /// Before the text.
    First,
    /// After it.
    Last,
}

/// What a stopped motion answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum StopReply {
    /// `F` alone.
    F,
    /// `F`, and a `0` after it.
    F0,
}

/// Whether a limit switch error blocks further motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LimitLatch {
    /// Until axes are set or referenced.
    Strict,
    /// Old cards go on.
    Off,
}

/// Moves of an axis that is on an active limit switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LeaveSwitch {
    /// Answer `2`.
    Refuse,
    /// Work if they lead away from the switch.
    Away,
}

/// What the number of a loop counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LoopCount {
    /// How often the block runs in all.
    Total,
    /// How often it is repeated.
    Extra,
}

/// What the offset of a conditional branch counts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BranchBase {
    /// The line after it.
    Next,
    /// Its own line.
    Own,
}

/// What an absolute move of an axis without reference point answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unreferenced {
    /// The limit switch error, `2`.
    #[serde(rename = "2")]
    LimitSwitch,
    /// The reference error, `R`.
    R,
}

/// How long STOP counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StopButton {
    /// As long as it is held: no move makes a step meanwhile.
    Held,
    /// At the moment it is pressed.
    Pressed,
}

/// What STOP and 253 do to a reference run of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StopInReference {
    /// They end it, and the program halts.
    End,
    /// They count as the sought switch, as they do for `R`.
    Switch,
}

/// What STOP and 253 leave of a move until a port event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StopInMoveUntil {
    /// Its remainder, which `S` continues: the answer is `F`.
    Keep,
    /// Nothing: the answer is `0`.
    Forget,
}

/// What is possible after an axis has left its limit switch by `F`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AfterFree {
    /// A reference run; other motions answer `R`.
    Reference,
    /// Any motion.
    Any,
}

/// The axes whose longest way has the speed of a 3D move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SpeedOf3d {
    /// All of them.
    Longest,
    /// X, Y and Z; A follows.
    Xyz,
}

/// The values that a stored line may give a single bit of a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BitValues {
    /// Those of a byte: 0 clears the bit, any other sets it.
    Any,
    /// 0 and 1.
    Binary,
}

/// Circles and helices that are stored while their axes are not set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StoredArcs {
    /// They answer `3` if no plane of the configured axes could be theirs.
    Check,
    /// They are stored, and end the program when it reaches them.
    Accept,
}

/// What the bits of `IE` belong to where `Ie` swaps the switches of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LimitBits {
    /// The switch as it is wired: switch 1 is at the machine's negative end.
    Switch,
    /// The end that the switch stands for after they are swapped.
    End,
}

/// The sets of axes that `@0<n>` takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AxisCodes {
    /// X, X and Y, all three; A apart.
    Nested,
    /// Every set of X, Y and Z; A apart.
    Any,
    /// Likewise, but 2 is X and Y.
    Pair,
    /// As `Nested`, but X is set after power-on and reset, and stays set where a code is refused.
    Keep,
}

/// When a motion with a small letter answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LowerCase {
    /// After it has been executed, like one with a capital letter.
    After,
    /// As soon as it is read and found valid; its outcome is not reported.
    Before,
    /// Likewise, but an early end is reported when it happens.
    BeforeAndError,
}

/// The axes whose positions `P` tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PositionAxes {
    /// X, Y and Z, whatever is set, and A where it is.
    Three,
    /// Those that are set.
    Configured,
}

/// The speeds that are accepted for an axis that does not move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RestingSpeed {
    /// Those within the limits, as for any other.
    Check,
    /// 0 as well.
    Zero,
}

/// What `i` does to a program that is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StoreOver {
    /// It answers `G`: the program has to be erased first.
    Refuse,
    /// It is forgotten, and a new one begins.
    Replace,
}

/// What comes after the self-test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SelfTestEnd {
    /// An echo, until 254.
    Echo,
    /// Commands.
    Commands,
}

/// What a control byte that ends no command answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ControlReply {
    /// Nothing.
    #[serde(rename = "none")]
    Nothing,
    /// `0`.
    #[serde(rename = "0")]
    Done,
}

/// What `S` does while nothing is stopped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StartAtRest {
    /// It answers `G`.
    #[default]
    Refuse,
    /// It runs the stored program.
    Program,
}

/// What `9` answers while no data field is being stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LoneEnd {
    /// The syntax error, `5`.
    #[default]
    #[serde(rename = "5")]
    Syntax,
    /// `0`.
    #[serde(rename = "0")]
    Done,
    /// Nothing.
    #[serde(rename = "none")]
    Nothing,
}

/// What `D` means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CapitalD {
    /// A diagnosis.
    #[default]
    Diagnosis,
    /// The reference speeds, as `d` does.
    Speeds,
}

// The three iMC models share everything but their texts. The last has no manual.
profiles! { Model, Model::check, [
    "imc4" = include_str!("../models/imc4.toml"),
    "imc4-m" = include_str!("../models/imc4-m.toml"),
    "imc-m" = include_str!("../models/imc-m.toml"),
    "imc-mp" = include_str!("../models/imc-mp.toml"),
    "imc-s8" = include_str!("../models/imc-s8.toml"),
    "c142" = include_str!("../models/c142.toml"),
] }

impl Model {
    /// The stable mnemonic of a command; `?` for one that the model does not have.
    pub(crate) fn mnemonic(&self, mode: Mode, op: Op) -> &'static str {
        let specs = table(self.command_set.dialect(), mode);
        specs.iter().find(|spec| spec.op == op).map_or("?", |spec| spec.mnemonic)
    }

    /// The output port and the bit of it that switch the spindle, if there is one.
    #[must_use]
    pub fn spindle_bit(&self) -> Option<(u16, u8)> {
        spindle_of(&self.ports.write)
    }

    /// How a line is read while these axes are set; `line` is its place in the data field, from 0,
    /// if it is to be stored.
    pub(crate) fn context(&self, axes: AxisSet, line: Option<u32>) -> Context<'_> {
        let Quirks { fractional_numbers, cond_bit_base, bit_values, axis_codes, .. } = self.quirks;
        Context {
            axes,
            speeds: self.limits.speeds(),
            fractions: fractional_numbers,
            ports: &self.ports,
            bit_base_one: cond_bit_base == 1,
            any_bit_value: bit_values == BitValues::Any,
            any_axes: matches!(axis_codes, AxisCodes::Any | AxisCodes::Pair),
            two_is_xy: axis_codes == AxisCodes::Pair,
            zero_at_rest: self.quirks.resting_speed == RestingSpeed::Zero,
            line,
        }
    }

    fn check(&self, text: &str) -> Result<(), ProfileError> {
        match self.wrong_number().or_else(|| self.wrong_wiring()) {
            Some((table, key, message, help)) => {
                Err(ProfileError::about_key(text, table, &key, message, help))
            }
            None => Ok(()),
        }
    }

    /// The first number outside its range.
    fn wrong_number(&self) -> Option<WrongKey> {
        let LineProfile { baud, receive_buffer, .. } = self.line;
        let Limits { speed_min, speed_max, loop_depth } = self.limits;
        let Defaults { reference_speed, start_stop, acceleration } = self.defaults;
        let bit_base = self.quirks.cond_bit_base;
        let checks = [
            (
                matches!(baud, 9_600 | 19_200),
                ["line", "baud"],
                format!("the line cannot run at {baud} baud"),
                "use 19200 or 9600",
            ),
            (
                (1..=1 << 20).contains(&receive_buffer),
                ["line", "receive_buffer"],
                format!("a buffer of {receive_buffer} bytes cannot be"),
                "1024 is the built-in models' size",
            ),
            (
                (1..=speed_max).contains(&speed_min) && speed_max <= 1_000_000,
                ["limits", "speed_max"],
                format!("the speeds from {speed_min} to {speed_max} Hz are no range"),
                "1 Hz at least, 1000000 Hz at most, the lowest first",
            ),
            (
                loop_depth <= 1_000,
                ["limits", "loop_depth"],
                format!("{loop_depth} nested loops are too many"),
                "the manuals say 15 (IMC4, IMC4-M) or 7 (iMC-xx)",
            ),
            (
                reference_speed.iter().all(|speed| (speed_min..=speed_max).contains(speed)),
                ["defaults", "reference_speed"],
                "a default reference speed is outside the limits".into(),
                "four values within speed_min and speed_max",
            ),
            (
                (20..=4_000).contains(&start_stop),
                ["defaults", "start_stop"],
                format!("a start-stop frequency of {start_stop} Hz is outside its range"),
                "20 to 4000 Hz",
            ),
            (
                (1..=4_000).contains(&acceleration),
                ["defaults", "acceleration"],
                format!("an acceleration of {acceleration} Hz/ms is outside its range"),
                "1 to 4000 Hz/ms",
            ),
            (
                self.timing.line_us != 0,
                ["timing", "line_us"],
                "a line of a program that takes no time could run for ever in none".into(),
                "1000 is the built-in models' value, 1 is the least",
            ),
            (
                bit_base <= 1,
                ["quirks", "cond_bit_base"],
                format!("{bit_base} is not a lowest bit number"),
                "0 or 1",
            ),
        ];
        let (_, [table, key], message, help) = checks.into_iter().find(|(holds, ..)| !holds)?;
        Some((table, key.to_owned(), message, help))
    }

    /// The first wire that leads to a wrong place.
    fn wrong_wiring(&self) -> Option<WrongKey> {
        if self.ports.probe.is_some_and(|wire| !matches!(wire, Wire::Input(_))) {
            let message = "the tool length probe is wired to what is not a user input".into();
            let help = "`in1` to `in16`, or nothing where it has a wire of its own";
            return Some(("ports", "probe".to_owned(), message, help));
        }
        for (table, ports) in [("ports.read", &self.ports.read), ("ports.write", &self.ports.write)]
        {
            for (number, wires) in ports {
                if !matches!(wires.len(), 1 | 8) {
                    let message = format!("port {number} has {} wires", wires.len());
                    let help = "eight from bit 0 up, or one for a logical port";
                    return Some((table, number.to_string(), message, help));
                }
                let only_outputs = wires
                    .iter()
                    .all(|w| matches!(w, Wire::Output(_) | Wire::Inverted(_) | Wire::Reserved));
                if table == "ports.write" && !only_outputs {
                    let message =
                        format!("port {number} is written but has a wire that is not an output");
                    return Some((table, number.to_string(), message, "outputs and `-` only"));
                }
            }
        }
        let (code, _) =
            self.diagnosis.iter().find(|(code, wires)| code.len() != 2 || wires.len() != 8)?;
        let message = format!("the diagnosis `{code}` is not two characters with eight wires");
        Some(("diagnosis", code.clone(), message, "compare with a built-in model"))
    }
}

/// A value that cannot be: its table and key, what is wrong, and what would be right.
type WrongKey = (&'static str, String, String, &'static str);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_points_at_the_key() {
        let text =
            Model::builtin_toml("imc4").unwrap().replace("speed_max = 20000", "speed_max = 10");
        let error = Model::from_toml(&text).unwrap_err();
        assert_eq!(&text[error.span.unwrap()], "speed_max = 10");
        let text = Model::builtin_toml("imc4").unwrap().replace("\"start\"", "\"sart\"");
        assert!(Model::from_toml(&text).unwrap_err().message.contains("sart"));
    }
}
