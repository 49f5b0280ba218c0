//! Wiring: which wire is behind which bit of which port.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use vimc4_isel_wire as wire;
use vimc4_plant::PlantSignal;

/// What a bit of a port shows or drives. The names are those of the profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Wire {
    /// Nothing; reads 0, keeps its value when written.
    Reserved,
    /// STOP is pressed.
    Stop,
    /// START is pressed.
    Start,
    /// ON is pressed.
    On,
    /// The emergency stop is pressed.
    EmergencyStop,
    /// The emergency circuit is closed.
    EmergencyCircuit,
    /// The cover is closed.
    Cover,
    /// The cover is closed and the key is at automatic.
    CoverAutomatic,
    /// The cover is closed, or the key is at test.
    CoverSetup,
    /// The key is at automatic.
    Key,
    /// The motor supply is good.
    PowerOk,
    /// The power stages are too hot.
    Overtemperature,
    /// The tool length probe is touched.
    Probe,
    /// The motors have current: the power stage is on and enabled.
    Motors,
    /// A user input, from 0.
    Input(u8),
    /// The raw level of a limit switch: axis, and 0 for switch 1, 1 for switch 2.
    SwitchLevel(u8, u8),
    /// A limit switch as the controller sees it: axis, and 0 for negative, 1 for positive.
    Limit(u8, u8),
    /// Whether an axis is configured.
    Configured(u8),
    /// Whether an axis is declared rotary.
    Rotary(u8),
    /// An output by number, see [`Output`].
    Output(Output),
    /// An output whose bit has the inverse sense: 0 is on.
    Inverted(Output),
}

/// An output line, by its place in the output register.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Output(u8);

impl Output {
    /// Enables the power stages.
    pub const STAGE: Output = Output(0);
    /// The firmware runs.
    pub const SOFTWARE_OK: Output = Output(1);
    /// The spindle.
    pub const SPINDLE: Output = Output(2);
    /// The brake has current and is open.
    pub const BRAKE: Output = Output(3);
    /// The cover may be opened.
    pub const COVER_ENABLE: Output = Output(4);
    const FIRST_USER: u8 = 16;
    const NAMED: [(&'static str, Output); 10] = [
        ("stage", Output::STAGE),
        ("software-ok", Output::SOFTWARE_OK),
        ("spindle", Output::SPINDLE),
        ("brake", Output::BRAKE),
        ("cover-enable", Output::COVER_ENABLE),
        ("stage-reset", Output(5)),
        ("current-reduction", Output(6)),
        ("lamp-stop", Output(7)),
        ("lamp-start", Output(8)),
        ("lamp-error", Output(9)),
    ];
    /// Numbered groups of outputs: name, first place, how many.
    const GROUPS: [(&'static str, u8, u8); 3] =
        [("out", Self::FIRST_USER, 16), ("analogue", 32, 8), ("extension", 40, 8)];
}

/// The register behind all outputs: one bit for each [`Output`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Outputs(u64);

impl Outputs {
    /// Whether an output is on.
    #[must_use]
    pub fn get(self, output: Output) -> bool {
        self.0 >> output.0 & 1 == 1
    }

    /// Switches an output.
    pub fn set(&mut self, output: Output, on: bool) {
        let bit = 1 << output.0;
        self.0 = if on { self.0 | bit } else { self.0 & !bit };
    }

    /// The byte of a port that is written.
    #[must_use]
    pub fn value_of(self, wires: &[Wire]) -> u8 {
        wires.iter().enumerate().fold(0, |value, (bit, wire)| match wire {
            Wire::Output(output) => value | u8::from(self.get(*output)) << bit,
            Wire::Inverted(output) => value | u8::from(!self.get(*output)) << bit,
            _ => value,
        })
    }
}

const AXIS_LETTERS: &str = "xyza";

impl TryFrom<String> for Wire {
    type Error = String;

    fn try_from(name: String) -> Result<Wire, String> {
        const PLAIN: [(&str, Wire); 14] = [
            ("-", Wire::Reserved),
            ("stop", Wire::Stop),
            ("start", Wire::Start),
            ("on", Wire::On),
            ("estop", Wire::EmergencyStop),
            ("estop-circuit", Wire::EmergencyCircuit),
            ("cover", Wire::Cover),
            ("cover-automatic", Wire::CoverAutomatic),
            ("cover-setup", Wire::CoverSetup),
            ("key", Wire::Key),
            ("power-ok", Wire::PowerOk),
            ("overtemperature", Wire::Overtemperature),
            ("probe", Wire::Probe),
            ("motors", Wire::Motors),
        ];
        if let Some((_, wire)) = PLAIN.iter().find(|(n, _)| *n == name) {
            return Ok(*wire);
        }
        if let Some(inverted) = name.strip_prefix('!') {
            return match Wire::try_from(inverted.to_owned())? {
                Wire::Output(output) => Ok(Wire::Inverted(output)),
                _ => Err(format!("`{name}` is not a wire: only outputs have an inverse sense")),
            };
        }
        if let Some((_, output)) = Output::NAMED.iter().find(|(n, _)| *n == name) {
            return Ok(Wire::Output(*output));
        }
        let digits = name.trim_start_matches(|c: char| !c.is_ascii_digit());
        let stem = &name[..name.len() - digits.len()];
        let number = digits.parse::<u8>().ok();
        let axis = |text: &str| AXIS_LETTERS.find(text).map(|i| i as u8);
        match (stem, number) {
            ("in", Some(n @ 1..=16)) => return Ok(Wire::Input(n - 1)),
            ("x" | "y" | "z" | "a", Some(n @ 1..=2)) => {
                if let Some(axis) = axis(stem) {
                    return Ok(Wire::SwitchLevel(axis, n - 1));
                }
            }
            (group, Some(n)) => {
                if let Some((_, first, count)) = Output::GROUPS.iter().find(|(g, _, _)| *g == group)
                    && (1..=*count).contains(&n)
                {
                    return Ok(Wire::Output(Output(first + n - 1)));
                }
            }
            (_, None) => {
                for (suffix, make) in [
                    ("-", (|a| Wire::Limit(a, 0)) as fn(u8) -> Wire),
                    ("+", |a| Wire::Limit(a, 1)),
                    (" configured", Wire::Configured),
                    (" rotary", Wire::Rotary),
                ] {
                    if let Some(axis) =
                        name.strip_suffix(suffix).filter(|t| t.len() == 1).and_then(axis)
                    {
                        return Ok(make(axis));
                    }
                }
            }
        }
        Err(format!(
            "`{name}` is not a wire: see the port maps of the built-in models for the names"
        ))
    }
}

impl From<Wire> for String {
    fn from(wire: Wire) -> String {
        let letter = |axis: u8| &AXIS_LETTERS[usize::from(axis)..=usize::from(axis)];
        match wire {
            Wire::Reserved => "-".into(),
            Wire::Stop => "stop".into(),
            Wire::Start => "start".into(),
            Wire::On => "on".into(),
            Wire::EmergencyStop => "estop".into(),
            Wire::EmergencyCircuit => "estop-circuit".into(),
            Wire::Cover => "cover".into(),
            Wire::CoverAutomatic => "cover-automatic".into(),
            Wire::CoverSetup => "cover-setup".into(),
            Wire::Key => "key".into(),
            Wire::PowerOk => "power-ok".into(),
            Wire::Overtemperature => "overtemperature".into(),
            Wire::Probe => "probe".into(),
            Wire::Motors => "motors".into(),
            Wire::Input(n) => format!("in{}", n + 1),
            Wire::SwitchLevel(axis, n) => format!("{}{}", letter(axis), n + 1),
            Wire::Limit(axis, 0) => format!("{}-", letter(axis)),
            Wire::Limit(axis, _) => format!("{}+", letter(axis)),
            Wire::Configured(axis) => format!("{} configured", letter(axis)),
            Wire::Rotary(axis) => format!("{} rotary", letter(axis)),
            Wire::Inverted(output) => format!("!{}", String::from(Wire::Output(output))),
            Wire::Output(output) => {
                if let Some((name, _)) = Output::NAMED.iter().find(|(_, o)| *o == output) {
                    return (*name).into();
                }
                let group = Output::GROUPS
                    .iter()
                    .find(|(_, first, count)| (*first..first + count).contains(&output.0));
                group.map_or_else(String::new, |(g, first, _)| {
                    format!("{g}{}", output.0 - first + 1)
                })
            }
        }
    }
}

impl Wire {
    /// The level of a wire of the panel while nobody touches it; `None` for other wires.
    fn panel_level(self) -> Option<bool> {
        match self {
            Wire::EmergencyCircuit
            | Wire::Cover
            | Wire::CoverAutomatic
            | Wire::CoverSetup
            | Wire::Key
            | Wire::PowerOk => Some(true),
            Wire::Stop | Wire::Start | Wire::On | Wire::EmergencyStop | Wire::Overtemperature => {
                Some(false)
            }
            _ => None,
        }
    }

    /// The signal of the plant that alone drives this wire, if there is one.
    #[must_use]
    pub fn signal(self) -> Option<PlantSignal> {
        Some(match self {
            Wire::Stop => PlantSignal::Stop,
            Wire::Start => PlantSignal::Start,
            Wire::On => PlantSignal::On,
            Wire::EmergencyStop => PlantSignal::EmergencyStop,
            Wire::Cover => PlantSignal::Cover,
            Wire::Key => PlantSignal::Key,
            Wire::PowerOk => PlantSignal::PowerOk,
            Wire::Overtemperature => PlantSignal::Overtemperature,
            Wire::Probe => PlantSignal::Probe,
            Wire::Input(n) => PlantSignal::Input(n),
            Wire::SwitchLevel(axis, n) => {
                let end =
                    if n == 0 { vimc4_plant::End::Negative } else { vimc4_plant::End::Positive };
                PlantSignal::Limit(usize::from(axis), end)
            }
            _ => return None,
        })
    }
}

/// The ports of a model: for each number its wires from bit 0 up. A port of one wire is a
/// logical port: it has the values 0 and 1, and any bit number means its one bit.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ports {
    /// The user input that the tool length probe is wired to, if it has no wire of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub probe: Option<Wire>,
    /// What can be read.
    #[serde(with = "by_number")]
    pub read: BTreeMap<u16, Vec<Wire>>,
    /// What can be written.
    #[serde(with = "by_number")]
    pub write: BTreeMap<u16, Vec<Wire>>,
    /// Other numbers for readable ports.
    #[serde(default, with = "by_number")]
    pub read_alias: BTreeMap<u16, u16>,
    /// Other numbers for writable ports.
    #[serde(default, with = "by_number")]
    pub write_alias: BTreeMap<u16, u16>,
}

impl Ports {
    /// The numbers of all ports that can be read.
    pub fn inputs(&self) -> impl Iterator<Item = u16> {
        self.read.keys().chain(self.read_alias.keys()).copied()
    }

    /// The numbers of all ports that can be written.
    pub fn outputs(&self) -> impl Iterator<Item = u16> {
        self.write.keys().chain(self.write_alias.keys()).copied()
    }

    /// The wires of a readable port.
    #[must_use]
    pub fn readable(&self, port: u16) -> Option<&[Wire]> {
        let port = self.read_alias.get(&port).unwrap_or(&port);
        self.read.get(port).map(Vec::as_slice)
    }

    /// The wires of a writable port.
    #[must_use]
    pub fn writable(&self, port: u16) -> Option<&[Wire]> {
        let port = self.write_alias.get(&port).unwrap_or(&port);
        self.write.get(port).map(Vec::as_slice)
    }
}

/// The bits of a readable port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InputBits {
    /// The bits with a wire; the others read 0.
    pub wired: u8,
    /// The bits that can change while nobody touches the panel.
    pub free: u8,
    /// What the bits of the panel read while nobody touches it.
    pub rest: u8,
}

impl Ports {
    /// The bits of a readable port.
    #[must_use]
    pub fn input_bits(&self, port: u16) -> Option<InputBits> {
        let wires = self.readable(port)?;
        let wired = bits(wires, |wire| wire != Wire::Reserved);
        let free = bits(wires, |wire| wire != Wire::Reserved && wire.panel_level().is_none());
        let rest = bits(wires, |wire| wire.panel_level() == Some(true));
        Some(InputBits { wired, free, rest })
    }

    /// The bits of a writable port that have a wire, and whether it is a logical port.
    #[must_use]
    pub fn output_bits(&self, port: u16) -> Option<(u8, bool)> {
        let wires = self.writable(port)?;
        let wired = bits(wires, |wire| matches!(wire, Wire::Output(_) | Wire::Inverted(_)));
        Some((wired, wires.len() == 1))
    }
}

/// The port and the bit of it that are wired to the spindle, if one is.
pub(crate) fn spindle_of(ports: &BTreeMap<u16, Vec<Wire>>) -> Option<(u16, u8)> {
    ports.iter().find_map(|(port, wires)| {
        let mut bits = (0..).zip(wires);
        let spindle = bits.find(|(_, wire)| **wire == Wire::Output(Output::SPINDLE));
        spindle.map(|(bit, _)| (*port, bit))
    })
}

/// The bits whose wires fit.
fn bits(wires: &[Wire], fits: impl Fn(Wire) -> bool) -> u8 {
    wires.iter().enumerate().fold(0, |bits, (bit, wire)| bits | u8::from(fits(*wire)) << bit)
}

impl wire::PortMap for Ports {
    fn reads(&self, port: u16) -> bool {
        self.readable(port).is_some()
    }

    fn writes(&self, port: u16, value: u16) -> bool {
        self.writable(port)
            .is_some_and(|wires| if wires.len() == 1 { value <= 1 } else { value <= 255 })
    }

    fn is_logical(&self, port: u16) -> bool {
        let wires = self.readable(port).or_else(|| self.writable(port));
        wires.is_some_and(|wires| wires.len() == 1)
    }
}

/// TOML keys are text; port numbers are not.
mod by_number {
    use std::collections::BTreeMap;

    use serde::de::{DeserializeOwned, Error};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<V: Serialize, S: Serializer>(
        map: &BTreeMap<u16, V>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_map(map.iter().map(|(number, value)| (number.to_string(), value)))
    }

    pub(super) fn deserialize<'de, V: DeserializeOwned, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<BTreeMap<u16, V>, D::Error> {
        let map = BTreeMap::<String, V>::deserialize(deserializer)?;
        map.into_iter()
            .map(|(key, value)| match key.parse() {
                Ok(number) => Ok((number, value)),
                Err(_) => {
                    Err(D::Error::custom(format!("`{key}` is not a port number, 0 to 65535")))
                }
            })
            .collect()
    }
}
