//! What the controllers report when something is wrong: one list in two notations.
//!
//! Both models number their statuses alike. The SMCU has the first 22 and writes them in
//! hexadecimal; the MotionSystem has them all and adds 100.

use serde::{Deserialize, Serialize};

use super::command::Axis;
use super::dialect::Dialect;

/// An end of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// Towards and beyond zero.
    Negative,
    /// Away from zero.
    Positive,
}

macro_rules! statuses {
    ($($status:ident $code:literal $name:literal $meaning:literal;)*) => {
        /// A status of a controller, as the chapters on status messages list them.
        ///
        /// Every row is documented; which of them a model has is said there, too.
        #[derive(
            Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
        )]
        #[serde(rename_all = "kebab-case")]
        #[repr(u8)]
        pub enum Status {
            $(#[doc = concat!($code, ": ", $meaning, ".")] $status = $code,)*
        }

        impl Status {
            /// Every status, in the order of the codes, which have no gaps.
            pub const ALL: &'static [Self] = &[$(Self::$status),*];

            /// A short name that never changes: `no-such-axis`.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$status => $name,)* }
            }

            /// What it says, for people: a lower-case fragment.
            #[must_use]
            pub const fn meaning(self) -> &'static str {
                match self { $(Self::$status => $meaning,)* }
            }
        }
    };
}

statuses! {
    SerialChannelA 0 "serial-channel-a-not-ready" "serial channel A is not ready";
    SerialChannelB 1 "serial-channel-b-not-ready" "serial channel B is not ready";
    ProcessorRam2 2 "processor-ram-2-error" "error in block 2 of the processor's memory";
    ProcessorRam1 3 "processor-ram-1-error" "error in block 1 of the processor's memory";
    DataMemory 4 "data-memory-error" "error in the external data memory";
    ProgramMemory 5 "program-memory-error" "error in the external program memory";
    SingleCoordinate 6 "single-coordinate" "one coordinate of a pair is missing";
    MissingParameter 7 "missing-parameter" "a parameter is missing";
    WorkAreaLeft 8 "work-area-left" "work area left";
    LimitSwitch 9 "limit-switch" "limit switch hit";
    FastStop 10 "fast-stop" "external stop";
    SpeedTooHigh 11 "speed-too-high" "speed too high";
    SpeedTooLow 12 "speed-too-low" "speed too low";
    UnknownCommand 13 "unknown-command" "unknown command";
    ReceiverParity 14 "receiver-parity" "received a byte with wrong parity";
    ReceiverOverflow 15 "receiver-overflow" "received more than there was room for";
    ReceiverFraming 16 "receiver-framing" "received a byte without stop bit";
    AccelerationTooHigh 17 "acceleration-too-high" "acceleration too high";
    AccelerationTooLow 18 "acceleration-too-low" "acceleration too low";
    ResolutionTooLarge 19 "resolution-too-large" "resolution too large";
    ResolutionTooSmall 20 "resolution-too-small" "resolution too small";
    NoSuchAxis 21 "no-such-axis" "no such axis";
    SumError 22 "sum-error" "the sum of all error signals is set";
    NoSuchInterface 23 "no-such-interface" "no such interface";
    NoSuchIoModule 24 "no-such-io-module" "no such input and output module";
    RangeNegativeX 25 "range-negative-x-left" "X left its range in the negative direction";
    RangePositiveX 26 "range-positive-x-left" "X left its range in the positive direction";
    RangeNegativeY 27 "range-negative-y-left" "Y left its range in the negative direction";
    RangePositiveY 28 "range-positive-y-left" "Y left its range in the positive direction";
    RangeNegativeZ0 29 "range-negative-z0-left" "Z0 left its range in the negative direction";
    RangePositiveZ0 30 "range-positive-z0-left" "Z0 left its range in the positive direction";
    RangeNegativeZ1 31 "range-negative-z1-left" "Z1 left its range in the negative direction";
    RangePositiveZ1 32 "range-positive-z1-left" "Z1 left its range in the positive direction";
    RangeNegativeZ2 33 "range-negative-z2-left" "Z2 left its range in the negative direction";
    RangePositiveZ2 34 "range-positive-z2-left" "Z2 left its range in the positive direction";
    RangeNegativeZ3 35 "range-negative-z3-left" "Z3 left its range in the negative direction";
    RangePositiveZ3 36 "range-positive-z3-left" "Z3 left its range in the positive direction";
    LimitNegativeX 37 "limit-negative-x" "negative limit switch of X hit";
    LimitPositiveX 38 "limit-positive-x" "positive limit switch of X hit";
    LimitNegativeY 39 "limit-negative-y" "negative limit switch of Y hit";
    LimitPositiveY 40 "limit-positive-y" "positive limit switch of Y hit";
    LimitNegativeZ0 41 "limit-negative-z0" "negative limit switch of Z0 hit";
    LimitPositiveZ0 42 "limit-positive-z0" "positive limit switch of Z0 hit";
    LimitNegativeZ1 43 "limit-negative-z1" "negative limit switch of Z1 hit";
    LimitPositiveZ1 44 "limit-positive-z1" "positive limit switch of Z1 hit";
    LimitNegativeZ2 45 "limit-negative-z2" "negative limit switch of Z2 hit";
    LimitPositiveZ2 46 "limit-positive-z2" "positive limit switch of Z2 hit";
    LimitNegativeZ3 47 "limit-negative-z3" "negative limit switch of Z3 hit";
    LimitPositiveZ3 48 "limit-positive-z3" "positive limit switch of Z3 hit";
    PowerStageX 49 "power-stage-fault-x" "power stage of X failed";
    PowerStageY 50 "power-stage-fault-y" "power stage of Y failed";
    PowerStageZ0 51 "power-stage-fault-z0" "power stage of Z0 failed";
    PowerStageZ1 52 "power-stage-fault-z1" "power stage of Z1 failed";
    PowerStageZ2 53 "power-stage-fault-z2" "power stage of Z2 failed";
    PowerStageZ3 54 "power-stage-fault-z3" "power stage of Z3 failed";
    LimitFaultX 55 "limit-switch-fault-x" "limit switch of X failed";
    LimitFaultY 56 "limit-switch-fault-y" "limit switch of Y failed";
    LimitFaultZ0 57 "limit-switch-fault-z0" "limit switch of Z0 failed";
    LimitFaultZ1 58 "limit-switch-fault-z1" "limit switch of Z1 failed";
    LimitFaultZ2 59 "limit-switch-fault-z2" "limit switch of Z2 failed";
    LimitFaultZ3 60 "limit-switch-fault-z3" "limit switch of Z3 failed";
    LowAirPressure 61 "low-air-pressure" "air pressure too low";
    PowerStage 62 "power-stage-fault" "a power stage failed";
    LimitFault 63 "limit-switch-fault" "a limit switch failed";
    ReferencePointX 64 "reference-point-x" "reference point of X hit";
    ReferencePointY 65 "reference-point-y" "reference point of Y hit";
    ReferencePointZ0 66 "reference-point-z0" "reference point of Z0 hit";
    ReferencePointZ1 67 "reference-point-z1" "reference point of Z1 hit";
    ReferencePointZ2 68 "reference-point-z2" "reference point of Z2 hit";
    ReferencePointZ3 69 "reference-point-z3" "reference point of Z3 hit";
    ReferencePoint 70 "reference-point" "a reference point hit";
    MessageInterrupt0 71 "message-interrupt-0" "message interrupt 0";
    JoystickNotConnected 72 "joystick-not-connected" "the interface has no joystick";
    ReadTimeout 73 "read-timeout" "a command was begun and not ended in time";
    NoCounterAxis 74 "no-counter-axis" "no axis of the counter module is selected";
    ModuleLost 75 "module-lost" "a module no longer identifies itself";
    WrongAfterStop 76 "wrong-after-stop" "not allowed after a stop; !GO goes on";
    WrongAfterLimit 77 "wrong-after-limit" "not allowed after a limit switch; !GO goes on";
    WrongAfterSoftFrame 78 "wrong-after-soft-frame" "not allowed after leaving a range; !GO goes on";
    WrongAfterMessage 79 "wrong-after-message" "not allowed after a message interrupt; !GO goes on";
    MessageInterrupt1 80 "message-interrupt-1" "message interrupt 1";
    WrongAfterOpenInterface 81 "wrong-after-open-interface" "not allowed while the interface is open";
    TooManyVectorParameters 82 "too-many-vector-parameters" "a following vector has too many parameters";
    VectorBufferFull 83 "vector-buffer-full" "too many following vectors";
    ReferenceNotAllowed 84 "reference-not-allowed" "no reference run is allowed for this axis";
    CommandBufferFull 85 "command-buffer-full" "the command buffer is full, commands are lost";
}

/// The SMCU's codes are below this.
const SMCU_CODES: u8 = 22;

impl Status {
    /// Its number in the tables of the manual, 0 to 85.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The status of a number, if it is one.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }

    /// Whether a model has it.
    #[must_use]
    pub const fn known_to(self, model: Dialect) -> bool {
        match model {
            Dialect::Smcu => self.code() < SMCU_CODES,
            Dialect::MotionSystem => true,
        }
    }

    /// The evidence: documented, for both models.
    #[must_use]
    pub const fn evidence(self) -> &'static str {
        "D"
    }

    /// Where the manual lists it for a model, by the heading; `None` if the model lacks it.
    #[must_use]
    pub const fn source(self, model: Dialect) -> Option<&'static str> {
        match model {
            _ if !self.known_to(model) => None,
            Dialect::Smcu => Some("Statusmeldungen der SMCU"),
            Dialect::MotionSystem => Some("Statusmeldungen des MotionSystems"),
        }
    }

    /// Its form on the line, without CR: `E0F`, `E115`; `None` if the model lacks it.
    ///
    /// The manual gives the SMCU hexadecimal digits. `decimal` is the quirk of one that writes
    /// decimal ones, `E15`; the MotionSystem ignores it.
    #[must_use]
    pub fn written(self, model: Dialect, decimal: bool) -> Option<String> {
        let code = self.code();
        match model {
            _ if !self.known_to(model) => None,
            Dialect::Smcu if decimal => Some(format!("E{code:02}")),
            Dialect::Smcu => Some(format!("E{code:02X}")),
            Dialect::MotionSystem => Some(format!("E{}", 100 + u32::from(code))),
        }
    }

    /// An axis left its range.
    #[must_use]
    pub(crate) fn range_left(axis: Axis, side: Side) -> Self {
        Self::RangeNegativeX.at(2 * axis.index() + side as usize)
    }

    /// A limit switch was hit.
    #[must_use]
    pub(crate) fn limit_switch(axis: Axis, side: Side) -> Self {
        Self::LimitNegativeX.at(2 * axis.index() + side as usize)
    }

    /// Whether nothing can move with this fault: the sum of all errors, power stages, limit
    /// switches, air.
    #[must_use]
    pub(crate) const fn forbids_motion(self) -> bool {
        matches!(self.code(), 22 | 49..=63)
    }

    /// The status this many codes after this one. Those of the axes are consecutive.
    fn at(self, offset: usize) -> Self {
        Self::ALL.get(usize::from(self.code()) + offset).copied().unwrap_or(self)
    }
}
