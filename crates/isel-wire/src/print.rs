//! The printer: the exact inverse of splitting and decoding.

use crate::command::{ArcArgs, Bit, BitTest, Command, Direction, Init, Plane, PortTest};
use crate::decode::WHOLE_BYTE;
use crate::dialect::{Dialect, Mode};
use crate::table;

impl Command {
    /// Appends the line that means this command, without its CR.
    ///
    /// What is printed decodes to an equal command, given a context that allows it; bits of
    /// command `6` are counted from 0. Where there are several ways to write a command, the
    /// manuals' own is taken: upper-case letters, no blanks, no signs but minus.
    ///
    /// `device` is the number of the controller, 0 to 9; stored lines have none. If the dialect
    /// does not know the command in this mode, nothing is appended.
    pub fn print(&self, dialect: Dialect, mode: Mode, device: u8, out: &mut Vec<u8>) {
        let Some(spec) = table::spec(dialect, mode, self.op(mode)) else { return };
        let mut line = Printer { out, fields: 0 };
        match mode {
            Mode::Direct => {
                line.out.extend([b'@', b'0' + device % 10]);
                // The number of axes stands where other commands have their letter.
                if !matches!(self, Self::SetAxes(_)) {
                    line.text(spec.mnemonic.trim_start_matches('@').as_bytes());
                }
            }
            Mode::Stored => line.text(spec.mnemonic.as_bytes()),
        }
        line.command(self);
    }
}

/// Appends fields and puts commas between them.
struct Printer<'a> {
    out: &'a mut Vec<u8>,
    fields: usize,
}

impl Printer<'_> {
    fn text(&mut self, text: &[u8]) {
        self.out.extend_from_slice(text);
    }

    fn field(&mut self, number: impl Into<i64>) {
        if self.fields > 0 {
            self.out.push(b',');
        }
        self.fields += 1;
        let number = number.into();
        if number < 0 {
            self.out.push(b'-');
        }
        // Twenty digits are enough for every u64. They come out last digit first.
        let (mut digits, mut at, mut left) = ([0; 20], 20, number.unsigned_abs());
        loop {
            at -= 1;
            digits[at] = b'0' + u8::try_from(left % 10).unwrap_or_default();
            left /= 10;
            if left == 0 {
                break;
            }
        }
        self.text(&digits[at..]);
    }

    fn command(&mut self, command: &Command) {
        match command {
            Command::SetAxes(axes)
            | Command::Free(axes)
            | Command::Zero(axes)
            | Command::SimulateReference(axes)
            | Command::Reference(axes) => self.field(axes.bits()),
            Command::RelativeMove(pairs) | Command::AbsoluteMove(pairs) => {
                for pair in pairs.as_slice() {
                    self.field(pair.steps);
                    self.field(pair.speed);
                }
            }
            Command::ReadPort(port) => self.field(*port),
            Command::WritePort { port, value } => {
                self.field(*port);
                self.field(*value);
            }
            Command::ReferenceSpeeds(speeds) => {
                for speed in speeds.as_slice() {
                    self.field(*speed);
                }
            }
            Command::Diagnosis(code) => self.text(code),
            Command::Plane(plane) => self.field(match plane {
                Plane::Xy => 0,
                Plane::Xz => 1,
                Plane::Yz => 2,
            }),
            Command::Direction(direction) => self.field(match direction {
                Direction::Clockwise => 0,
                Direction::Counterclockwise => -1,
            }),
            Command::Brake(on) | Command::TestMode(on) | Command::Interpolation3d(on) => {
                self.field(*on);
            }
            Command::DeviceNumber(number) => self.field(*number),
            Command::Init(init) => self.init(init),
            Command::StartStop(number) | Command::Acceleration(number) => self.field(*number),
            Command::Helix(arc, third) => {
                self.arc(arc);
                self.field(*third);
            }
            Command::Circle(arc) => self.arc(arc),
            Command::MoveUntil { test, speed, steps, count } => {
                self.port_test(test);
                self.field(*speed);
                for steps in steps.iter().take(usize::from(*count)) {
                    self.field(*steps);
                }
            }
            Command::SendSync(character) => self.field(*character),
            Command::AwaitSync { character, offset } => {
                self.field(*character);
                self.field(*offset);
            }
            Command::Loop { count, offset } => {
                self.field(*count);
                self.field(*offset);
            }
            Command::Branch { offset } => {
                self.field(0);
                self.field(*offset);
            }
            Command::Delay { tenths } => self.field(*tenths),
            Command::Until(test) | Command::SetPort(test) => self.bit_test(test),
            Command::BranchIf { test, offset } => {
                self.bit_test(test);
                self.field(*offset);
            }
            Command::LimitStatus
            | Command::Status
            | Command::Store
            | Command::Erase
            | Command::Position
            | Command::Start
            | Command::UserInfo
            | Command::Version
            | Command::SelfTest
            | Command::End => {}
        }
    }

    fn init(&mut self, init: &Init) {
        match init {
            Init::Directions(axes)
            | Init::References(axes)
            | Init::RotaryL(axes)
            | Init::SwapLimits(axes)
            | Init::AxisTypes(axes) => self.field(axes.bits()),
            Init::HardwareStatus(status) => self.field(*status),
            Init::DefaultSpeeds(speeds) => {
                for speed in speeds {
                    self.field(*speed);
                }
            }
            Init::FreeSteps(steps) => {
                for steps in steps {
                    self.field(*steps);
                }
            }
            Init::DefaultAcceleration(number) | Init::DefaultStartStop(number) => {
                self.field(*number);
            }
            Init::IoOnly(on) | Init::Baud9600(on) => self.field(*on),
            Init::Limits(bits) => self.field(*bits),
            Init::Abort(test)
            | Init::ErrorSignal(test)
            | Init::Cover(test)
            | Init::Emergency(test) => self.port_test(test),
            Init::UserInfo(text) => self.text(text.as_bytes()),
            Init::Load | Init::Write | Init::Factory => {}
        }
    }

    fn arc(&mut self, arc: &ArcArgs) {
        self.field(arc.steps);
        self.field(arc.speed);
        self.field(arc.d);
        self.field(arc.x);
        self.field(arc.y);
        self.field(arc.rx);
        self.field(arc.ry);
    }

    fn port_test(&mut self, test: &PortTest) {
        self.field(test.port);
        self.field(test.mask);
        self.field(test.value);
    }

    fn bit_test(&mut self, test: &BitTest) {
        self.field(test.port);
        self.field(match test.bit {
            Bit::One(bit) => bit,
            Bit::Byte => WHOLE_BYTE,
        });
        self.field(test.value);
    }
}
