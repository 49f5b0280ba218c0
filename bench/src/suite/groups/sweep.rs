//! A sweep over a recorded session: every fault that can strike it, one after the other.

use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Instant;

use vimc4_device::{Input, Line, Time, TimedInput};
use vimc4_sweep::{Choice, Session};

use crate::suite::Bench;
use crate::suite::failure::{Doing, Outcome};
use crate::suite::report::{Figure, Section};
use crate::suite::stats::Sample;

/// So many points a second are wanted, with two threads.
const WANTED: f64 = 20_000.0;

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let model = vimc4_catalogue::model("imc4").doing("find the model imc4")?;
    let machine = vimc4_catalogue::machine("mill").doing("find the machine mill")?;
    let device = vimc4_catalogue::bare(&model, &machine, &[]).doing("make a controller")?;
    let (mut inputs, mut sent) = (Vec::new(), 0);
    let mut at = Time::ZERO;
    for line in ["@07\r", "@0R7\r"]
        .into_iter()
        .chain(["@0A80,900,40,900,0,900,0,900\r", "@0P\r"].into_iter().cycle())
    {
        if sent >= 200 {
            break;
        }
        sent += line.len();
        inputs.push(TimedInput { at, input: Input::Bytes(line.as_bytes()).into() });
        at = at + std::time::Duration::from_secs(10);
    }
    let session = Session::new(Line::ideal(device), &inputs, at, b"\r", &Choice::default());
    let points = session.plan().len();
    let mut section = Section::default();
    for (threads, wanted) in [(1, None), (2, Some(WANTED))] {
        let mut rates = Sample::default();
        for _ in 0..bench.either(5, 1) {
            let next = AtomicU64::new(0);
            let began = Instant::now();
            thread::scope(|scope| {
                for _ in 0..threads {
                    scope.spawn(|| {
                        while let Some(found) =
                            session.run_point(next.fetch_add(1, Ordering::Relaxed))
                        {
                            std::hint::black_box(found);
                        }
                    });
                }
            });
            rates.add(points as f64 / began.elapsed().as_secs_f64());
        }
        let rate = rates.median();
        let what =
            format!("points a second, {threads} thread{}", if threads == 1 { "" } else { "s" });
        let figure = Figure::new(&what, format!("{rate:.0}"));
        section.add(match wanted {
            Some(wanted) => figure.target(format!("≥ {wanted:.0}"), rate >= wanted),
            None => figure,
        });
    }
    section.note(format!(
        "A recorded session of {sent} bytes to an IMC4 on the machine mill has {points} points: each \
         byte, command, quarter of a motion and answer with everything that can go wrong there. Each \
         is played from the last snapshot before it to the end."
    ));
    Ok(section)
}
