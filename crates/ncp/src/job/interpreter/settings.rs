//! Limits, cylinders, accelerations.

use vimc4_isel_wire::Dialect;

use super::sink::Sink;
use super::state::{Interpreter, Refusal};
use crate::job::action::Action;
use crate::job::place::Cylinder;
use crate::job::problem::Problem;
use crate::language::{Placed, Value, Word, Words};

impl Interpreter<'_> {
    pub(super) fn limit(&mut self, limits: &[Option<(Word, Word)>; 6]) -> Result<(), Refusal> {
        let lowest: Words = std::array::from_fn(|axis| limits[axis].map(|(lowest, _)| lowest));
        self.named(&lowest)?;
        for (limit, words) in self.state.limits.iter_mut().zip(limits) {
            if let Some((lowest, highest)) = words {
                *limit = Some((lowest.value, highest.value));
            }
        }
        Ok(())
    }

    pub(super) fn cylinder(
        &mut self,
        turning: Placed<usize>,
        radius: Word,
        linear: Option<Placed<usize>>,
        sink: &mut Sink<'_>,
    ) -> Result<(), Refusal> {
        if radius.value > Value::ZERO && radius.value < Value::whole(100) {
            sink.say_at(radius.span, Problem::MillimetreRadius(radius.value));
        }
        let Placed { value: axis, span } = turning;
        if !self.target.axes.has(axis) {
            return Err((span, Problem::NoSuchAxis(axis)));
        }
        if !self.target.rotary.has(axis) {
            return Err((span, Problem::NotRotary(axis)));
        }
        let replaced = match linear.filter(|_| radius.value > Value::ZERO) {
            Some(Placed { value, span }) if !self.target.axes.has(value) => {
                return Err((span, Problem::NoSuchAxis(value)));
            }
            Some(Placed { value, span }) if self.target.rotary.has(value) => {
                return Err((span, Problem::NotLinear(value)));
            }
            replaced => replaced.map(|linear| linear.value),
        };
        // The axes are where the cylinder before it has left them.
        if let Some(cylinder) = self.state.cylinder.take() {
            self.state.place = cylinder.unrolled(&self.state.place);
        }
        self.state.cylinder = replaced.map(|linear| Cylinder {
            turning: axis,
            linear,
            radius: radius.value,
            from: self.state.place[linear],
        });
        Ok(())
    }

    pub(super) fn acceleration(
        &mut self,
        words: &Words,
        sink: &mut Sink<'_>,
    ) -> Result<(), Refusal> {
        self.named(words)?;
        let least = words.iter().flatten().map(|word| word.value).min();
        let Some(least) = least else { return Ok(()) };
        if self.target.controller.dialect != Dialect::ImcXx {
            sink.say(Problem::AccelerationFixed);
            return Ok(());
        }
        let share =
            least.in_thousandths().unsigned_abs() * u64::from(self.target.setup.acceleration);
        let rounded = u32::try_from((share + 50_000) / 100_000).unwrap_or(u32::MAX);
        sink.push(Action::Acceleration(rounded.clamp(1, 4_000)));
        Ok(())
    }
}
