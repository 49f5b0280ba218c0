//! What job files see of a machine: speeds, ports, spindle and coolant.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

/// How job files, such as those of the isel NC intermediate format, are run on a machine. Every
/// value is the default where the file says nothing.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct JobSetup {
    /// The speed of a normal movement in µm/s.
    pub velocity: u32,
    /// The speed of a rapid movement in µm/s.
    pub rapid_velocity: u32,
    /// The greatest acceleration in Hz/ms, which is 100 %.
    pub acceleration: u32,
    /// How many steps A may deviate from moving together with the other axes, which it cannot: 1 to
    /// 1,000. The larger, the fewer pieces a move is made in.
    pub apart: u32,
    /// Which end of Z is up, away from the work-piece.
    pub up: Up,
    /// The ports of the controller behind the names of the file.
    pub ports: JobPorts,
    /// How the spindle is switched, by port 2 with every model of isel; absent if the controller
    /// does not switch it.
    pub spindle: Option<Spindle>,
    /// How the coolant pump is switched; absent if the controller does not switch it.
    pub coolant: Option<Output>,
    /// How everything else is switched; the controller does not switch what is absent.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub accessories: BTreeMap<Accessory, Output>,
    /// Where the work-piece zero is before a job says anything.
    #[serde(skip_serializing_if = "JobZero::is_empty")]
    pub zero: JobZero,
    /// What the registers for work-piece zeros hold before a job fills them.
    #[serde(skip_serializing_if = "JobRegisters::is_empty")]
    pub registers: JobRegisters,
}

impl Default for JobSetup {
    fn default() -> JobSetup {
        JobSetup {
            velocity: 10_000,
            rapid_velocity: 30_000,
            acceleration: 100,
            apart: 1,
            up: Up::Positive,
            ports: JobPorts::default(),
            spindle: None,
            coolant: None,
            accessories: BTreeMap::new(),
            zero: JobZero::default(),
            registers: JobRegisters::default(),
        }
    }
}

impl JobSetup {
    /// The output that switches an accessory, if one does.
    #[must_use]
    pub fn accessory(&self, accessory: Accessory) -> Option<Output> {
        let own = self.coolant.filter(|_| accessory == Accessory::Coolant);
        own.or_else(|| self.accessories.get(&accessory).copied())
    }
}

/// What a job switches on and off besides the spindle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Accessory {
    /// `COOLANT`.
    Coolant,
    /// `COOLANT2`.
    Coolant2,
    /// `COOLANT3`.
    Coolant3,
    /// `COOLANT4`.
    Coolant4,
    /// `WPCLAMP`: the clamp of the work-piece.
    Wpclamp,
    /// `PUMP`.
    Pump,
    /// `LAMP`.
    Lamp,
    /// `POPTION1`.
    Poption1,
    /// `POPTION2`.
    Poption2,
    /// `POPTION3`.
    Poption3,
    /// `POPTION4`.
    Poption4,
}

impl Accessory {
    /// All of them.
    pub const ALL: [Accessory; 11] = [
        Accessory::Coolant,
        Accessory::Coolant2,
        Accessory::Coolant3,
        Accessory::Coolant4,
        Accessory::Wpclamp,
        Accessory::Pump,
        Accessory::Lamp,
        Accessory::Poption1,
        Accessory::Poption2,
        Accessory::Poption3,
        Accessory::Poption4,
    ];
}

/// Its name in job files.
impl fmt::Display for Accessory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Accessory::Coolant => "COOLANT",
            Accessory::Coolant2 => "COOLANT2",
            Accessory::Coolant3 => "COOLANT3",
            Accessory::Coolant4 => "COOLANT4",
            Accessory::Wpclamp => "WPCLAMP",
            Accessory::Pump => "PUMP",
            Accessory::Lamp => "LAMP",
            Accessory::Poption1 => "POPTION1",
            Accessory::Poption2 => "POPTION2",
            Accessory::Poption3 => "POPTION3",
            Accessory::Poption4 => "POPTION4",
        })
    }
}

/// A work-piece zero in machine coordinates: µm from the reference point, arc seconds where an axis
/// turns. An axis that is not named has the machine's zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct JobZero {
    /// In X.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x: Option<i32>,
    /// In Y.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y: Option<i32>,
    /// In Z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub z: Option<i32>,
    /// In A.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub a: Option<i32>,
}

impl JobZero {
    /// Whether it names no axis.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        [self.x, self.y, self.z, self.a].iter().all(Option::is_none)
    }
}

/// The registers 1 to 8 for work-piece zeros.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct JobRegisters {
    #[serde(skip_serializing_if = "JobZero::is_empty", rename = "1")]
    r1: JobZero,
    #[serde(skip_serializing_if = "JobZero::is_empty", rename = "2")]
    r2: JobZero,
    #[serde(skip_serializing_if = "JobZero::is_empty", rename = "3")]
    r3: JobZero,
    #[serde(skip_serializing_if = "JobZero::is_empty", rename = "4")]
    r4: JobZero,
    #[serde(skip_serializing_if = "JobZero::is_empty", rename = "5")]
    r5: JobZero,
    #[serde(skip_serializing_if = "JobZero::is_empty", rename = "6")]
    r6: JobZero,
    #[serde(skip_serializing_if = "JobZero::is_empty", rename = "7")]
    r7: JobZero,
    #[serde(skip_serializing_if = "JobZero::is_empty", rename = "8")]
    r8: JobZero,
}

impl JobRegisters {
    /// What each of them holds, the first first.
    #[must_use]
    pub fn each(&self) -> [&JobZero; 8] {
        [&self.r1, &self.r2, &self.r3, &self.r4, &self.r5, &self.r6, &self.r7, &self.r8]
    }

    /// Whether all are empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.each().iter().all(|zero| zero.is_empty())
    }
}

/// Where up is on Z.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Up {
    /// Greater coordinates are farther from the work-piece.
    Positive,
    /// Greater coordinates are deeper in it.
    Negative,
}

/// The ports of the controller behind the logical ports of a job file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct JobPorts {
    /// The input ports E1 to E4.
    #[serde(skip_serializing_if = "Option::is_none", rename = "E1")]
    e1: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none", rename = "E2")]
    e2: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none", rename = "E3")]
    e3: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none", rename = "E4")]
    e4: Option<u16>,
    /// The output ports A1 to A4.
    #[serde(skip_serializing_if = "Option::is_none", rename = "A1")]
    a1: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none", rename = "A2")]
    a2: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none", rename = "A3")]
    a3: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none", rename = "A4")]
    a4: Option<u16>,
}

impl JobPorts {
    /// The port of the controller that the input port E`number` is, 1 to 4.
    #[must_use]
    pub fn input(&self, number: u8) -> Option<u16> {
        [self.e1, self.e2, self.e3, self.e4].get(usize::from(number).checked_sub(1)?).copied()?
    }

    /// The port of the controller that the output port A`number` is, 1 to 4.
    #[must_use]
    pub fn output(&self, number: u8) -> Option<u16> {
        [self.a1, self.a2, self.a3, self.a4].get(usize::from(number).checked_sub(1)?).copied()?
    }
}

/// An output that is 1 for on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// The port of the controller.
    pub port: u16,
    /// The bit of the port, 0 to 7; absent if the port is a single bit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bit: Option<u8>,
}

/// How the spindle is switched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spindle {
    /// The output that lets it turn.
    pub on: Output,
    /// The output that makes it turn counterclockwise, if it can.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counterclockwise: Option<Output>,
    /// The analogue output that sets its speed, if it can.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub analogue: Option<Analogue>,
}

/// An analogue output: 255 is its maximum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Analogue {
    /// The port of the controller.
    pub port: u16,
    /// How fast the spindle turns at 255, in turns a minute.
    pub full_rpm: u32,
}
