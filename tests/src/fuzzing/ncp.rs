//! Job files of the isel NC intermediate format: read, checked, cut into commands, compiled.

use std::sync::{Arc, LazyLock};

use vimc4_isel_wire::{Addressed, Command, Context, Fault, Fractions, Mode, Pairs, Plane, parse};
use vimc4_ncp::geometry::Motion;
use vimc4_ncp::job::{Job, Options, Step, Target, check, compile};
use vimc4_ncp::language::{decode, lines};
use vimc4_ncp::{Diagnostic, Severity};
use vimc4_plant::Machine;

use crate::jobs;

/// So many commands of a job are looked at: a movement can take millions.
const MOST: usize = 3_000;

/// The models and the machines there are, each with the job's view of both.
static SITES: LazyLock<Vec<(Arc<vimc4_isel::Model>, Target)>> = LazyLock::new(|| {
    let models = ["imc4", "imc4-m", "imc-s8"].into_iter().filter_map(vimc4_isel::Model::builtin);
    let sites = models.flat_map(|model| {
        let machines = ["bench", "mill", "mill-4axis", "board-plotter"];
        let machines = machines.into_iter().filter_map(Machine::builtin);
        machines.filter_map(move |machine| {
            let target = jobs::target(&vimc4::Model::Isel(Arc::clone(&model)), &machine).ok()?;
            Some((Arc::clone(&model), target))
        })
    });
    sites.collect()
});

/// The first byte says for which controller and machine, and how; the rest is the file.
pub fn ncp(data: &[u8]) {
    let Some((&how, file)) = data.split_first() else { return };
    let Some((model, target)) = SITES.get(usize::from(how & 15) % SITES.len()) else { return };
    let options =
        Options { no_reference: how & 16 != 0, drill_in_mm: how & 32 != 0, leave_out_tools: false };
    let text = decode(file);
    let said = said(&text, target, options);
    run(&text, model, target, options);
    // What cannot be stored is left out or ends it; what is stored is what a controller takes.
    if let Some(field) = compile(&text, target, options, &mut |_| {}) {
        assert!(field.bytes <= target.controller.memory && field.text.ends_with("9\n"));
        for line in field.text.lines() {
            assert!(decoded(line.as_bytes(), Mode::Stored, model, target).is_ok(), "{line}");
        }
    }
    assert_eq!(said, said_again(&text, target, options));
}

/// Everything that is said about a file, which must point into it.
fn said(text: &str, target: &Target, options: Options) -> Vec<Diagnostic> {
    let lines: Vec<&str> = lines(text).map(|line| line.text).collect();
    let said = said_again(text, target, options);
    for diagnostic in &said {
        let line = lines.get(diagnostic.line as usize - 1).copied().unwrap_or_default();
        assert!(line.get(diagnostic.span.range()).is_some(), "{diagnostic:?} in {line:?}");
        assert!(
            !diagnostic.problem.to_string().is_empty() && !diagnostic.problem.code().is_empty()
        );
        assert_ne!(diagnostic.problem.help().as_deref(), Some(""));
    }
    said
}

fn said_again(text: &str, target: &Target, options: Options) -> Vec<Diagnostic> {
    let mut said = Vec::new();
    let summary = check(text, target, options, &mut |diagnostic| said.push(diagnostic));
    let errors = said.iter().filter(|said| said.problem.severity() == Severity::Error).count();
    assert_eq!(summary.errors, errors as u64);
    said
}

/// The commands must be such as the controller takes, and lead where the job says.
fn run(text: &str, model: &vimc4_isel::Model, target: &Target, options: Options) {
    let mut job = Job::new(text, target, options);
    let mut at = [0; 4];
    let mut plane = Plane::Xy;
    for _ in 0..MOST {
        let Some(order) = job.next(&mut |_| {}) else {
            assert!(job.has_failed() || job.counters() == at, "{at:?} {:?}", job.counters());
            return;
        };
        if let Some(mut line) = order.step.line(target.controller.dialect) {
            line.pop();
            let read = decoded(&line, Mode::Direct, model, target);
            assert_eq!(read, Ok(order.step.command().unwrap_or(Command::End)), "{order:?}");
        }
        if let Step::Send(Command::Plane(chosen)) = order.step {
            plane = chosen;
        }
        follow(&order.step, plane, target, &mut at);
    }
}

/// Where a step leads.
fn follow(step: &Step, plane: Plane, target: &Target, at: &mut [i64; 4]) {
    let Step::Send(command) = step else { return };
    let path = match command {
        Command::Reference(axes) => return axes.iter().for_each(|axis| at[axis] = 0),
        Command::RelativeMove(pairs) => {
            return target.axes.iter().zip(Pairs::as_slice(pairs)).for_each(|(axis, pair)| {
                at[axis] += i64::from(pair.steps);
            });
        }
        Command::Circle(arc) => Motion::Arc(plane, *arc).path(),
        Command::Helix(arc, third) => Motion::Helix(plane, *arc, *third).path(),
        _ => return,
    };
    for (at, way) in at.iter_mut().zip(path.at(path.length())) {
        *at += way;
    }
}

/// What a controller reads in a line.
fn decoded(
    line: &[u8],
    mode: Mode,
    model: &vimc4_isel::Model,
    target: &Target,
) -> Result<Command, Fault> {
    let context = Context {
        axes: target.axes,
        speeds: target.controller.speeds.clone(),
        fractions: Fractions::Reject,
        ports: &model.ports,
        bit_base_one: false,
        any_bit_value: false,
        any_axes: false,
        two_is_xy: false,
        zero_at_rest: false,
        line: None,
    };
    match parse(line, target.controller.dialect, mode, 0)? {
        Addressed::Frame(frame) => frame.decode(&context),
        Addressed::OtherDevice => Err(Fault::NoAddress),
    }
}
