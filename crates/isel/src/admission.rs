//! Whether a command may be executed. When several errors apply, the first of a fixed order
//! answers; this module is that order, from top to bottom.

use vimc4_isel_wire::{AxisSet, Bit, BitTest, Class, Command, Frame, Op};
use vimc4_motion::Point;

use crate::firmware::Firmware;
use crate::model::{CommandSet, LeaveSwitch, LimitLatch, RestingSpeed, StartAtRest, StoreOver};
use crate::program::Validity;
use crate::why::{Opened, Why};

impl Firmware {
    /// Reads a direct command and checks it against the state, up to the point where only its
    /// execution can still fail. The grammar (`5`) has been checked before.
    pub(crate) fn admit(&self, frame: &Frame<'_>) -> Result<Command, Why> {
        let state = &self.state;
        let spec = frame.spec();
        if spec.class == Class::Motion {
            self.check_plant()?;
        } else if let Some(write) = self.port_write(frame) {
            self.check_switching(write)?;
        }
        if spec.needs_axes && state.axes.is_empty() {
            return Err(Why::NoAxes);
        }
        frame.check_count(state.axes)?;
        self.check_data_field(frame.op())?;
        let command = frame.decode(&self.state.context(None))?;
        self.check_command(&command)?;
        Ok(command)
    }

    /// Everything about a command that depends on the state rather than on its text: the axes
    /// of the plane, limit switches, reference points. Lines of a program are checked with
    /// this when they run.
    pub(crate) fn check_command(&self, command: &Command) -> Result<(), Why> {
        let state = &self.state;
        let (first, second) = state.plane.axes();
        let third = state.plane.third();
        let in_plane = |axis: usize| axis == first || axis == second;
        match command {
            Command::Circle(arc) => {
                self.check_plane_axes(&[first, second])?;
                let way = |axis| i64::from(in_plane(axis) && arc.steps > 0);
                self.check_limits(way, true)?;
                self.check_freed()
            }
            Command::Helix(arc, steps) => {
                self.check_plane_axes(&[first, second, third])?;
                let way = |axis| match axis {
                    _ if in_plane(axis) => i64::from(arc.steps > 0),
                    _ if axis == third => i64::from(*steps),
                    _ => 0,
                };
                self.check_limits(way, true)?;
                self.check_freed()
            }
            Command::RelativeMove(_) | Command::MoveUntil { .. } | Command::AbsoluteMove(_) => {
                let way = self.plan_of(command).way();
                self.check_speeds(command, &way)?;
                self.check_limits(|axis| way[axis], false)?;
                self.check_freed()?;
                if matches!(command, Command::AbsoluteMove(_)) {
                    self.check_references(&way)?;
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// `9` for a power stage that is off, `H` for a cover that is open.
    pub(crate) fn check_plant(&self) -> Result<(), Why> {
        if !self.state.motors_on() {
            Err(Why::Stages(self.state.why_off()))
        } else if self.state.cover_forbids() {
            Err(Why::Cover(Opened::Already))
        } else {
            Ok(())
        }
    }

    /// What a line writes to which port, even if something else is wrong with it.
    fn port_write(&self, frame: &Frame<'_>) -> Option<BitTest> {
        if frame.op() != Op::WritePort {
            return None;
        }
        let fractions = self.state.model.quirks.fractional_numbers;
        let number = |index| frame.number(index, fractions);
        let port = u16::try_from(number(0)?).ok()?;
        let value = u8::try_from(number(1)?).ok()?;
        Some(BitTest { port, bit: Bit::Byte, value })
    }

    /// `G` for a program or a remainder that exists or is missing.
    fn check_data_field(&self, op: Op) -> Result<(), Why> {
        let state = &self.state;
        match op {
            Op::Store => {
                let replaces = state.model.quirks.store_over == StoreOver::Replace;
                if state.flash.program.is_some() && !replaces {
                    return Err(Why::ProgramStored);
                }
            }
            Op::Start => {
                let program = state.flash.program.as_ref();
                let valid = program.is_some_and(|program| program.validity == Validity::Valid);
                let stopped = state.remainder.is_some() || state.run.is_some();
                if !(stopped || self.starts_programs() && valid) {
                    return Err(Why::NothingToStart);
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn check_plane_axes(&self, axes: &[usize]) -> Result<(), Why> {
        let bits = axes.iter().fold(0, |bits, axis| bits | 1 << axis);
        let needed = AxisSet::from_bits(bits).unwrap_or(AxisSet::NONE);
        if self.state.axes.contains(needed) { Ok(()) } else { Err(Why::Plane(needed)) }
    }

    /// `D` for an axis, or a part of a move, that would go at speed 0. If speed 0 is allowed for an
    /// axis at rest, this can be checked only now.
    fn check_speeds(&self, command: &Command, way: &Point) -> Result<(), Why> {
        if self.state.model.quirks.resting_speed == RestingSpeed::Check {
            return Ok(());
        }
        let axes = self.state.axes.iter();
        let stuck = match command {
            Command::AbsoluteMove(pairs) => {
                axes.zip(pairs.as_slice()).any(|(axis, pair)| pair.speed == 0 && way[axis] != 0)
            }
            _ => false,
        };
        if stuck || self.plan_of(command).parts.iter().any(|(_, speed)| *speed == 0) {
            return Err(Why::AtRest);
        }
        Ok(())
    }

    /// `2` while a limit switch error is latched, and for an axis that is on an active
    /// limit switch. In test mode neither counts.
    pub(crate) fn check_limits(&self, way: impl Fn(usize) -> i64, turns: bool) -> Result<(), Why> {
        let state = &self.state;
        if state.test_mode {
            return Ok(());
        }
        if !state.latched.is_empty() && state.model.quirks.limit_latch == LimitLatch::Strict {
            return Err(Why::Latched(state.latched));
        }
        for axis in state.axes.iter() {
            let way = way(axis);
            let Some(end) = self.active_limit(axis).filter(|_| way != 0) else { continue };
            let leads_away = !turns && Self::leads_away(end, way);
            if state.model.quirks.leave_switch == LeaveSwitch::Refuse || !leads_away {
                return Err(Why::OnSwitch { axis: axis as u8, end, away: leads_away });
            }
        }
        Ok(())
    }

    /// `R` while an axis that has left its limit switch by `F` waits for a reference run
    /// (12 2.2.9). In test mode it does not.
    fn check_freed(&self) -> Result<(), Why> {
        match self.state.waits_for_reference() {
            true => Err(Why::Freed(self.state.freed)),
            false => Ok(()),
        }
    }

    /// `2` or `R` for an absolute move of an axis without a reference point. Axes that are already
    /// at their target do not count.
    fn check_references(&self, way: &Point) -> Result<(), Why> {
        let state = &self.state;
        let lost = |axis: &usize| way[*axis] != 0 && !state.referenced.has(*axis);
        let bits = state.axes.iter().filter(lost).fold(0, |bits, axis| bits | 1 << axis);
        match AxisSet::from_bits(bits).unwrap_or(AxisSet::NONE) {
            AxisSet::NONE => Ok(()),
            axes => Err(Why::NoReference(axes, state.model.quirks.unreferenced)),
        }
    }

    /// Whether `S` runs the stored program where nothing is stopped.
    pub(crate) fn starts_programs(&self) -> bool {
        let model = &self.state.model;
        model.command_set == CommandSet::ImcXx || model.quirks.start_at_rest == StartAtRest::Program
    }
}
