//! The names of axes and signals, and conditions written with them.

use std::fmt;
use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

use super::{Condition, Vocabulary};
use crate::{AXES, Device, Signal, SignalId};

/// The words with a meaning of their own where a text could stand.
const RESERVED: [&str; 6] = ["and", "or", "then", "while", "until", "error"];

/// The names that conditions use for the axes and the signals of a device.
///
/// ```
/// # mod cart { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cart/mod.rs")); }
/// # use cart::Cart;
/// use vimc4_device::{Condition, Harness, Names, Time};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
///
/// let mut cart = Harness::new(Cart::default());
/// let names = Names::of(cart.device());
/// cart.send(b"m100\r");
/// let stop = Condition::SignalChanges { signal: Cart::STOP, to: None };
/// let far = Condition::AxisAbove { axis: 0, position: 30 };
/// let later = Condition::All(vec![far, Condition::At(Time::from_millis(50))]);
/// let condition = Condition::Any(vec![later, stop]);
/// assert_eq!(cart.run_until(&condition), Some(Time::from_millis(50)));
/// assert_eq!(names.write(&condition).to_string(), "x > 30 and at 0.05s or signal stop changes");
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Names {
    axes: Vec<(u8, String)>,
    signals: Vec<Signal>,
    can_erase: bool,
    has_any_bit: bool,
    vocabulary: Option<Vocabulary>,
    scales: [Option<Scale>; AXES],
}

/// How far a step of an axis goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Scale {
    /// This many steps …
    pub steps: u32,
    /// … make this many units.
    pub units: u32,
    /// What is counted.
    pub unit: LengthUnit,
}

/// The unit of an axis's travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LengthUnit {
    /// Micrometres; people write `mm`.
    Micrometre,
    /// Degrees, of a turning table; people write `°` or `deg`.
    Degree,
}

/// Without names, signals are numbers, and the first axes are called as nearly everywhere: `x = 5`,
/// `axis4 = 5`, `signal 3 changes`.
static NUMBERS: LazyLock<Names> = LazyLock::new(|| {
    let axes = [(0, "X"), (1, "Y"), (2, "Z"), (3, "A")];
    Names::new(axes.map(|(axis, name)| (axis, name.to_owned())), Vec::new())
});

impl Names {
    /// These axes, each with its index (0 for X), and these signals. An axis may have several
    /// names: it is shown by the first, and understood by all.
    #[must_use]
    pub fn new(axes: impl IntoIterator<Item = (u8, String)>, signals: Vec<Signal>) -> Names {
        Names { axes: axes.into_iter().collect(), signals, ..Names::default() }
    }

    /// Sets whether the device's panel can erase the stored program.
    #[must_use]
    pub fn with_erasing(self, can_erase: bool) -> Names {
        Names { can_erase, ..self }
    }

    /// The names for an unknown device: signals are numbers.
    #[must_use]
    pub fn numbered() -> &'static Names {
        &NUMBERS
    }

    /// Those of a device.
    pub fn of<D: Device>(device: &D) -> Names {
        let axes = device.view(device.now()).axes;
        Names::new(axes.into_iter().map(|axis| (axis.index, axis.name)), device.signals())
    }

    /// Names for devices wired in any way, so that any bit of any port may be an input: for text
    /// that is read before its device is known.
    #[must_use]
    pub fn with_any_bit(self) -> Names {
        Names { has_any_bit: true, ..self }
    }

    /// Whether any bit of any port may be an input.
    #[must_use]
    pub fn has_any_bit(&self) -> bool {
        self.has_any_bit
    }

    /// The signals.
    #[must_use]
    pub fn signals(&self) -> &[Signal] {
        &self.signals
    }

    /// Whether the panel can erase the stored program.
    #[must_use]
    pub fn can_erase(&self) -> bool {
        self.can_erase
    }

    /// Adds the device's commands, errors and ports: text about anything that can never happen
    /// there is then an error.
    #[must_use]
    pub fn with_vocabulary(self, vocabulary: Option<Vocabulary>) -> Names {
        Names { vocabulary, ..self }
    }

    /// The device's commands, errors and ports, if they are known.
    #[must_use]
    pub fn vocabulary(&self) -> Option<&Vocabulary> {
        self.vocabulary.as_ref()
    }

    /// Adds how far a step of each axis goes, so that positions can be in `mm` or `°`.
    #[must_use]
    pub fn with_scales(self, scales: [Option<Scale>; AXES]) -> Names {
        Names { scales, ..self }
    }

    /// How far a step of an axis goes, if that is known.
    #[must_use]
    pub fn scale(&self, axis: u8) -> Option<Scale> {
        *self.scales.get(usize::from(axis))?
    }

    /// Whether a command has this mnemonic: `@A`, and not `@0A5000`.
    ///
    /// # Errors
    ///
    /// If the model has no such command; with the mnemonics of those it has.
    pub fn mnemonic(&self, like: &str) -> Result<(), String> {
        if self.knows(like, Vocabulary::has_mnemonic) {
            return Ok(());
        }
        Err(self.vocabulary.as_ref().map(Vocabulary::commands_in_words).unwrap_or_default())
    }

    /// Shows a condition with these names.
    #[must_use]
    pub fn write<'a>(&'a self, condition: &'a Condition) -> Named<'a> {
        Named { names: self, condition }
    }

    /// Whether a text means something to the device, as far as that is known.
    fn knows(&self, text: &str, is_known: impl Fn(&Vocabulary, &str) -> bool) -> bool {
        self.vocabulary.as_ref().is_none_or(|known| is_known(known, text))
    }

    /// An axis by its name, or by its index.
    #[must_use]
    pub fn axis(&self, name: &str) -> Option<u8> {
        let mut axes = self.axes.iter();
        let named = axes.find(|(_, known)| known.eq_ignore_ascii_case(name));
        named.map(|(axis, _)| *axis).or_else(|| {
            let index = name.strip_prefix("axis")?.parse().ok()?;
            (usize::from(index) < AXES).then_some(index)
        })
    }

    /// The names that the axes are shown by, in small letters, in their order.
    #[must_use]
    pub fn shown_axes(&self) -> Vec<String> {
        let mut axes: Vec<u8> = self.axes.iter().map(|(axis, _)| *axis).collect();
        axes.sort_unstable();
        axes.dedup();
        // Names of the second group may equal names of the first.
        let mut names: Vec<String> = Vec::new();
        for name in axes.into_iter().map(|axis| self.axis_name(axis)) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    // --- writing ---

    /// Whether there is such an axis, 0 for X.
    #[must_use]
    pub fn has_axis(&self, axis: u8) -> bool {
        self.axes.iter().any(|(known, _)| *known == axis)
    }

    /// What an axis is called, in small letters.
    #[must_use]
    pub fn axis_name(&self, axis: u8) -> String {
        let named = self.axes.iter().find(|(index, _)| *index == axis);
        named.map_or_else(|| format!("axis{axis}"), |(_, name)| name.to_lowercase())
    }

    /// The signal of this number, if there is one.
    #[must_use]
    pub fn signal_named(&self, id: SignalId) -> Option<&Signal> {
        self.signals.iter().find(|signal| signal.id == id)
    }

    pub(crate) fn signal_name(&self, id: SignalId) -> String {
        self.signal_named(id).map_or_else(|| id.0.to_string(), |signal| signal.name.clone())
    }

    fn value_name(&self, id: SignalId, value: i32) -> String {
        let positions = self.signal_named(id).and_then(|signal| signal.positions.as_ref());
        let place = usize::try_from(value).ok();
        let name = positions.and_then(|names| names.get(place?));
        name.map_or_else(|| value.to_string(), Clone::clone)
    }
}

/// With numbers for signals; [`Names::write`] has their names.
impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", NUMBERS.write(self))
    }
}

/// A condition with the names of a device: [`Names::write`].
#[derive(Clone, Copy, Debug)]
pub struct Named<'a> {
    names: &'a Names,
    condition: &'a Condition,
}

impl fmt::Display for Named<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Named { names, condition } = *self;
        match *condition {
            Condition::AxisAt { axis, position } => {
                write!(f, "{} = {position}", names.axis_name(axis))
            }
            Condition::AxisBelow { axis, position } => {
                write!(f, "{} < {position}", names.axis_name(axis))
            }
            Condition::AxisAbove { axis, position } => {
                write!(f, "{} > {position}", names.axis_name(axis))
            }
            Condition::Outside { ref low, ref high } => {
                f.write_str("outside")?;
                let limits = || (0..).zip(low.iter().zip(high));
                let open = |limits: &(u8, (&i64, &i64))| limits.1 == (&i64::MIN, &i64::MAX);
                let all_open = limits().all(|limits| open(&limits));
                for (axis, (low, high)) in limits() {
                    if open(&(axis, (low, high))) && !(all_open && axis == 0) {
                        continue;
                    }
                    write!(f, " {} ", names.axis_name(axis))?;
                    if *low != i64::MIN {
                        write!(f, "{low}")?;
                    }
                    f.write_str("..")?;
                    if *high != i64::MAX {
                        write!(f, "{high}")?;
                    }
                }
                Ok(())
            }
            Condition::PortBit { port, bit, level } => {
                write!(f, "port {port} bit {bit} {}", if level { "on" } else { "off" })
            }
            Condition::Limit { axis, positive, active } => {
                let end = if positive { '+' } else { '-' };
                write!(f, "limit {}{end}{}", names.axis_name(axis), if active { "" } else { " off" })
            }
            Condition::SignalIs { signal, value } => {
                write!(f, "signal {} is ", names.signal_name(signal))?;
                f.write_str(&names.value_name(signal, value))
            }
            Condition::Idle => f.write_str("idle"),
            Condition::At(time) => {
                let nanos = time.as_nanos();
                let text = format!("{}.{:09}", nanos / 1_000_000_000, nanos % 1_000_000_000);
                write!(f, "at {}s", text.trim_end_matches('0').trim_end_matches('.'))
            }
            Condition::Command { ref like } => {
                let known = |text: &str| names.knows(text, Vocabulary::has_command);
                happening(f, "command", like.as_deref(), known)
            }
            Condition::Answered { ref like } => {
                let known = |text: &str| names.knows(text, Vocabulary::has_mnemonic);
                happening(f, "answered", like.as_deref(), known)
            }
            Condition::Answer { ref text } => happening(f, "answer", Some(text), |_| true),
            Condition::Error { ref code } => {
                let known = |text: &str| names.knows(text, Vocabulary::has_error);
                happening(f, "answer error", code.as_deref(), known)
            }
            Condition::Line { line: None } => f.write_str("line"),
            Condition::Line { line: Some(line) } => write!(f, "line {line}"),
            Condition::SignalChanges { signal, to } => {
                write!(f, "signal {} changes", names.signal_name(signal))?;
                match to {
                    Some(value) => write!(f, " to {}", names.value_name(signal, value)),
                    None => Ok(()),
                }
            }
            Condition::All(ref parts) if parts.is_empty() => f.write_str("always"),
            Condition::Any(ref parts) if parts.is_empty() => f.write_str("never"),
            Condition::All(ref parts) => self.list(f, parts, " and ", |part| {
                matches!(part, Condition::All(parts) | Condition::Any(parts) if parts.len() > 1)
            }),
            Condition::Any(ref parts) => self.list(f, parts, " or ", |part| {
                matches!(part, Condition::Any(parts) if parts.len() > 1)
            }),
        }
    }
}

impl Named<'_> {
    fn list(
        &self,
        f: &mut fmt::Formatter<'_>,
        parts: &[Condition],
        between: &str,
        bracketed: impl Fn(&Condition) -> bool,
    ) -> fmt::Result {
        for (place, part) in parts.iter().enumerate() {
            if place > 0 {
                f.write_str(between)?;
            }
            let part_text = self.names.write(part);
            match parts.len() > 1 && bracketed(part) {
                true => write!(f, "({part_text})")?,
                false => write!(f, "{part_text}")?,
            }
        }
        Ok(())
    }
}

/// A happening, and the text that selects it.
fn happening(
    f: &mut fmt::Formatter<'_>,
    what: &str,
    text: Option<&str>,
    is_known: impl Fn(&str) -> bool,
) -> fmt::Result {
    f.write_str(what)?;
    let Some(text) = text else { return Ok(()) };
    let bare = is_known(text)
        && !text.is_empty()
        && text.chars().all(|c| c.is_ascii_graphic() && !matches!(c, '(' | ')' | '<' | '>' | '=' | '"'))
        && !text.ends_with(':')
        // It parts orders.
        && !text.contains(';')
        && !RESERVED.iter().any(|word| word.eq_ignore_ascii_case(text));
    if bare {
        return write!(f, " {text}");
    }
    f.write_str(" \"")?;
    for c in text.chars() {
        match c {
            '"' | '\\' => write!(f, "\\{c}")?,
            c if c.is_control() => write!(f, "\\u{{{:x}}}", u32::from(c))?,
            c => write!(f, "{c}")?,
        }
    }
    f.write_str("\"")
}
