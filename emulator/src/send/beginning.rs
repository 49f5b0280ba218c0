//! What is reported and settled before a job begins: where it is resumed, and the state there.

use std::fmt::Write;

use vimc4_catalogue::{Machine, Model};
use vimc4_device::Point;
use vimc4_ncp::job::{Job, NoResumption, Options, Resumption, Target, Zero};
use vimc4_ncp::language::{Instruction, Units, lines, parse};

/// A job that is resumed at a line on a controller with the counters `here`, and what to report
/// about it.
pub(super) fn resumed<'t>(
    text: &'t str,
    target: &'t Target,
    options: Options,
    line: u32,
    here: Point,
    found: Option<Zero>,
) -> Result<(Job<'t>, Resumption), NoResumption> {
    let [x, y, z, a, ..] = here;
    Job::resume(text, target, options, line, [x, y, z, a], found)
}

/// Whether the operator has found the work-piece zero before a line.
pub(super) fn is_taught(text: &str, line: u32) -> bool {
    let before = lines(text).take_while(|before| before.number < line);
    let commands = before.filter_map(|line| parse(line.text, &mut |_, _| {}).command);
    commands.map(|command| command.value).any(|command| command == Instruction::Teach)
}

/// Whether a line asks for reference runs.
pub(super) fn is_reference(text: &str, number: u32) -> bool {
    let command = lines(text).find(|line| line.number == number);
    let command = command.and_then(|line| parse(line.text, &mut |_, _| {}).command);
    command.is_some_and(|command| matches!(command.value, Instruction::Reference(_)))
}

/// The command that brings back the unit which the file has behind a line, if what was typed there has
/// changed it.
pub(super) fn unit_to_restore(text: &str, line: u32, typed: &[&str]) -> Option<&'static str> {
    let unit = |text: &str| match parse(text, &mut |_, _| {}).command.map(|command| command.value) {
        Some(Instruction::Units(units)) => Some(units),
        _ => None,
    };
    let before = lines(text).take_while(|before| before.number <= line);
    let own = before.filter_map(|line| unit(line.text)).last().unwrap_or_default();
    let last = typed.iter().filter_map(|typed| unit(typed)).next_back()?;
    (last != own).then_some(match own {
        Units::Metric => "METRIC",
        Units::Inch => "INCH",
    })
}

/// What is done before a job goes on with a line, for people.
pub(super) fn describe(resumption: &Resumption, model: &Model, machine: &Machine) -> String {
    let Resumption { line, standing, referenced, tool, outputs, highest, .. } = resumption;
    let mut text = format!("The job goes on with line {line}. What holds there:\n");
    let names = model.axis_names();
    let places = |values: &[vimc4_ncp::language::Value; 4]| {
        let axes = (0..4).filter(|axis| machine.fits(*axis));
        let shown = axes.map(|axis| {
            let (number, unit) = match machine.measures()[axis].name {
                "mm" => (values[axis].as_f64() / 1_000.0, "mm"),
                other => (values[axis].as_f64() / 3_600.0, other),
            };
            format!("{} {number:.3} {unit}", names[axis])
        });
        shown.collect::<Vec<_>>().join(", ")
    };
    // Writing to a string does not fail.
    let mut say = |what: std::fmt::Arguments<'_>| {
        let _ = writeln!(text, "  {what}");
    };
    say(format_args!("work-piece zero {}", places(&standing.zero)));
    say(format_args!(
        "VEL {} mm/s, FASTVEL {} mm/s, plane {}",
        standing.normal.as_f64() / 1_000.0,
        standing.rapid.as_f64() / 1_000.0,
        format!("{:?}", standing.plane).to_uppercase()
    ));
    for output in outputs {
        match output.bit {
            Some(bit) => say(format_args!("port {} bit {bit} is {}", output.port, output.value)),
            None => say(format_args!("port {} is {}", output.port, output.value)),
        }
    }
    if let Some(number) = tool {
        say(format_args!("tool {number} is in, which is asked for first"));
    }
    if !resumption.has_begun {
        say(format_args!("nothing has moved before that line"));
        return text;
    }
    // In the order in which they run.
    let order = [2, 1, 0, 3].into_iter().filter(|&axis| referenced.has(axis));
    let axes = order.map(|axis| names[axis]).collect::<Vec<_>>();
    match axes.is_empty() {
        true => say(format_args!("no reference run: the counters of the controller are believed")),
        false => say(format_args!("reference runs come first: {}", axes.join(", "))),
    }
    let unit = machine.measures()[2];
    say(format_args!(
        "then Z goes to {:.3} {}, the other axes go across, and Z goes down to {}",
        *highest as f64 * unit.per_step,
        unit.name,
        places(&standing.place)
    ));
    text
}
