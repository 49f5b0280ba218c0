//! What moves cost in virtual time, whatever their length.

use vimc4_device::Device;
use vimc4_plant::Machine;

use crate::suite::Bench;
use crate::suite::failure::{Failure, Outcome};
use crate::suite::numbers::{nanos, times};
use crate::suite::play::{bench as machine, board, controller, expect, play};
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

/// A line of 8,000,000 steps of an SMCU.
const LONG_MOVE: &str = "PR-8000000,5000000;";

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let rounds = bench.either(51, 11);
    let mut section = Section::default();
    let free = machine()?;
    // Both the line and the huge arc run into this switch on their way.
    let mut barred = machine()?;
    barred.axes.x.negative_switch = Some(-1_500_000);

    let mut compare = |what: &str, than: Cost<'_>, case: Cost<'_>, most: f64| {
        let pair = alternate(rounds, than, case)?;
        let ratio = pair.ratio();
        section.add(
            Figure::new(what, format!("{}, {}", nanos(pair.ours), times(ratio)))
                .baseline(nanos(pair.baseline))
                .target(format!("≤ {most} ×"), ratio <= most),
        );
        Outcome::Ok(())
    };
    let open = |line| isel(&free, line, b'0');
    let shut = |line| isel(&barred, line, b'2');
    let mut short = || open(SHORT_LINE);
    let mut long = || open(LONG_LINE);
    compare("a line of 8,000,000 steps, and of one", &mut short, &mut long, 2.0)?;
    let (mut short, mut huge) = (|| open(SHORT_ARC), || open(HUGE_ARC));
    compare("an arc of 8,000,000 steps, and of one", &mut short, &mut huge, 2.0)?;
    let mut small = || open(SMALL_ARC);
    let what = "an arc of 8,000,000 steps, of radius 1,000,000 and of 10";
    compare(what, &mut small, &mut huge, 2.0)?;
    let mut barred_line = || shut(LONG_LINE);
    compare("the line into a limit switch, and free", &mut long, &mut barred_line, 3.0)?;
    let mut barred_arc = || shut(HUGE_ARC);
    compare("the arc into a limit switch, and free", &mut huge, &mut barred_arc, 3.0)?;

    let open = |line| lpkf(&free, line, b'C');
    let mut short = || open("PR1,1;");
    let mut long = || open(LONG_MOVE);
    compare("an SMCU: a line of 8,000,000 steps, and of one", &mut short, &mut long, 2.0)?;
    let mut quarter = || open("AR-1000000,0,90;");
    let mut turn = || open("AR-1000000,0,360;");
    compare("an SMCU: a turn of radius 1,000,000, and a quarter", &mut quarter, &mut turn, 4.0)?;
    let mut barred_line = || lpkf(&barred, LONG_MOVE, b'E');
    compare("an SMCU: the line into a limit switch, and free", &mut long, &mut barred_line, 3.0)?;
    section.note(
        "Processor time from the command to its answer, wake-ups included; nobody watches. The \
         baseline is the second of the two.",
    );
    Ok(section)
}

/// What measures one move.
type Cost<'a> = &'a mut dyn FnMut() -> Outcome<f64>;

/// Nanoseconds of processor time for a move of an IMC4, each time from the same state.
fn isel(machine: &Machine, line: &str, answer: u8) -> Outcome<f64> {
    let mut first = controller(machine.clone())?;
    expect(&mut first, "@07", b'0')?;
    cost(&first, line, answer)
}

/// The same for an SMCU.
fn lpkf(machine: &Machine, line: &str, answer: u8) -> Outcome<f64> {
    cost(&board(machine.clone())?, line, answer)
}

/// Nanoseconds of processor time for a line, in a batch of copies of one controller.
fn cost<D: Device + Clone>(first: &D, line: &str, answer: u8) -> Outcome<f64> {
    let mut controllers: Vec<D> = vec![first.clone(); BATCH];
    let bytes = format!("{line}\r").into_bytes();
    let mut right = true;
    let spent = processor_time(|| {
        for controller in &mut controllers {
            right &= play(controller, &bytes).code == answer;
        }
    });
    if !right {
        let answer = char::from(answer);
        return Err(Failure::new(format!("`{line}` is not answered {answer:?}")));
    }
    Ok(spent / BATCH as f64)
}
