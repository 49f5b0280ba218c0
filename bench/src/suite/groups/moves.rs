//! What moves cost in virtual time, whatever their length.

use vimc4_isel::Controller;
use vimc4_plant::Machine;

use crate::suite::Bench;
use crate::suite::failure::{Failure, Outcome};
use crate::suite::numbers::{nanos, times};
use crate::suite::play::{bench as machine, controller, expect, play};
use crate::suite::report::{Figure, Section};
use crate::suite::stats::alternate;
use crate::suite::usage::processor_time;

/// How many moves are timed at once.
const BATCH: usize = 256;

/// A move of a single step of X and Y.
const SHORT_LINE: &str = "@0A1,10000,1,10000,0,900,0,900";

/// A line of 8,000,000 steps.
const LONG_LINE: &str = "@0A-8000000,10000,5000000,10000,0,900,0,900";

/// A single step of an arc.
const SHORT_ARC: &str = "@0y1,10000,-5,10,0,-1,-1";

/// 8,000,000 steps around a circle of radius 10: a hundred thousand turns.
const SMALL_ARC: &str = "@0y8000000,10000,-5,10,0,-1,-1";

/// 8,000,000 steps around a circle of radius 1,000,000: one turn.
const HUGE_ARC: &str = "@0y8000000,10000,-500000,1000000,0,-1,-1";

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let rounds = bench.either(51, 11);
    let mut section = Section::default();
    let free = machine()?;
    // Both the line and the huge arc run into this switch on their way.
    let mut barred = machine()?;
    barred.axes.x.negative_switch = Some(-1_500_000);

    let mut compare = |what: &str, than: Case<'_>, case: Case<'_>, most: f64| {
        let pair = alternate(rounds, || than.cost(), || case.cost())?;
        let ratio = pair.ratio();
        section.add(
            Figure::new(what, format!("{}, {}", nanos(pair.ours), times(ratio)))
                .baseline(nanos(pair.baseline))
                .target(format!("≤ {most} ×"), ratio <= most),
        );
        Outcome::Ok(())
    };
    let open = |line| Case { machine: &free, line, answer: b'0' };
    let shut = |line| Case { machine: &barred, line, answer: b'2' };
    compare("a line of 8,000,000 steps, and of one", open(SHORT_LINE), open(LONG_LINE), 2.0)?;
    compare("an arc of 8,000,000 steps, and of one", open(SHORT_ARC), open(HUGE_ARC), 2.0)?;
    compare(
        "an arc of 8,000,000 steps, of radius 1,000,000 and of 10",
        open(SMALL_ARC),
        open(HUGE_ARC),
        2.0,
    )?;
    compare("the line into a limit switch, and free", open(LONG_LINE), shut(LONG_LINE), 3.0)?;
    compare("the arc into a limit switch, and free", open(HUGE_ARC), shut(HUGE_ARC), 3.0)?;
    section.note(
        "Processor time from the command to its answer, wake-ups included; nobody watches. The \
         baseline is the second of the two.",
    );
    Ok(section)
}

/// A move that is timed.
#[derive(Clone, Copy)]
struct Case<'a> {
    machine: &'a Machine,
    line: &'a str,
    answer: u8,
}

impl Case<'_> {
    /// Nanoseconds of processor time for the move, each time from the same state.
    fn cost(self) -> Outcome<f64> {
        let mut first = controller(self.machine.clone())?;
        expect(&mut first, "@07", b'0')?;
        let mut controllers: Vec<Controller> = vec![first; BATCH];
        let line = format!("{}\r", self.line).into_bytes();
        let mut right = true;
        let spent = processor_time(|| {
            for controller in &mut controllers {
                right &= play(controller, &line).code == self.answer;
            }
        });
        if !right {
            let answer = char::from(self.answer);
            return Err(Failure::new(format!("`{}` is not answered {answer:?}", self.line)));
        }
        Ok(spent / BATCH as f64)
    }
}
