//! The meaning of a command or a word.

use std::fmt::Write;
use std::ops::Range;

use super::{Context, Here, LooseWord};
use crate::language::reference::{CommandInfo, Form, Parameter, SPEED, Source, WAY};
use crate::language::{Instruction, Placed, PortBit, Units, Value, lines, parse, token};

/// The explanation of a place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hover {
    /// What it is about, in bytes from the beginning of the text.
    pub range: Range<usize>,
    /// The explanation, in Markdown.
    pub markdown: String,
}

/// The meaning of the command or of the word at a place, in bytes from the beginning of the text.
#[must_use]
pub fn hover(text: &str, offset: usize, context: Context) -> Option<Hover> {
    let (here, place) = Here::at(text, offset);
    let anatomy = here.anatomy()?;
    let units = units_at(text, here.offset);
    if anatomy.name.range().contains(&place) {
        let range = here.in_text(anatomy.name);
        return Some(Hover { range, markdown: command(anatomy.info, units, context) });
    }
    let behind = anatomy.behind_name(here.line);
    if behind.span.range().contains(&place)
        && let Some(markdown) = whole(anatomy.info, behind, here.line, (units, context))
    {
        return Some(Hover { range: here.in_text(behind.span), markdown });
    }
    let mut words = (0..).zip(&anatomy.words);
    let (nth, word) = words.find(|(_, word)| word.span.range().contains(&place))?;
    if anatomy.info.form == Form::Reference {
        let markdown = group(anatomy.info, word.letters.value, context)?;
        return Some(Hover { range: here.in_text(word.span), markdown });
    }
    let mut parameters = anatomy.info.words_at(nth).iter();
    let parameter =
        parameters.find(|parameter| parameter.name.eq_ignore_ascii_case(word.letters.value))?;
    let markdown = explain(anatomy.info, parameter, word, (units, context));
    Some(Hover { range: here.in_text(word.span), markdown })
}

/// The unit of lengths at the beginning of a line: that of the last METRIC or INCH before it.
pub(super) fn units_at(text: &str, offset: usize) -> Units {
    let before = lines(text).take_while(|line| line.offset < offset);
    let units = before.filter_map(|line| {
        match parse(line.text, &mut |_, _| {}).command.map(|command| command.value) {
            Some(Instruction::Units(units)) => Some(units),
            _ => None,
        }
    });
    units.last().unwrap_or_default()
}

/// A command with all the words that mean something on the machine.
pub(super) fn command(info: &CommandInfo, units: Units, context: Context) -> String {
    let mut text = format!("```ncp\n{}\n```\n\n{}\n", context.pattern(info), info.meaning);
    let words = info.parameters.iter().filter(|parameter| context.has(info, parameter));
    for (place, parameter) in words.enumerate() {
        let gap = if place == 0 { "\n" } else { "" };
        // Writing to a string does not fail.
        let _ = writeln!(text, "{gap}- {}", meaning(info, parameter, units, context));
    }
    let _ = write!(text, "\nFor example `{}`", info.example);
    if info.source == Source::Field {
        text.push_str("\n\nFiles have it; the manual does not.");
    }
    text
}

/// A word, its meaning and its unit.
pub(super) fn meaning(
    info: &CommandInfo,
    parameter: &Parameter,
    units: Units,
    context: Context,
) -> String {
    let Parameter { name, meaning, value } = parameter;
    let name = if name.is_empty() { String::new() } else { format!("`{name}`: ") };
    match value.and_then(|_| unit(info, parameter, units, context)) {
        Some(unit) => format!("{name}{meaning}, in {unit}"),
        None => format!("{name}{meaning}"),
    }
}

/// The unit of a word; `None` if it counts nothing.
fn unit(
    info: &CommandInfo,
    parameter: &Parameter,
    units: Units,
    context: Context,
) -> Option<&'static str> {
    let unit = parameter.value?.unit;
    let unit = match info.axis(parameter) {
        _ if unit.is_empty() => return None,
        _ if is_drilled_in_mm(info, parameter, context) => "mm",
        Some(axis) if unit == WAY && context.rotary.has(axis) => "arc seconds",
        // The centre of an arc is a place of linear axes.
        Some(_) | None if unit == WAY => "µm",
        _ if unit == SPEED && context.rotary.is_empty() => "µm/s",
        _ => unit,
    };
    // The lengths of tools are not used.
    let counts = info.form != Form::ToolDefinition;
    Some(match unit {
        "µm" if units == Units::Inch && counts => INCHES,
        "µm/s" if units == Units::Inch => "thousandths of an inch/s",
        SPEED if units == Units::Inch => INCHES_A_SECOND,
        unit => unit,
    })
}

/// Lengths behind INCH.
const INCHES: &str = "thousandths of an inch";
/// Speeds behind INCH, on a machine with axes that turn.
const INCHES_A_SECOND: &str = "thousandths of an inch/s, of rotary axes alone arc seconds/s";

/// Whether DRILLDEF has mm here: the reference plane and the speed keep their units.
fn is_drilled_in_mm(info: &CommandInfo, parameter: &Parameter, context: Context) -> bool {
    let lengths = ["D", "F", "O", "I", "R", "L", "S"];
    context.drill_in_mm && info.form == Form::DrillDefinition && lengths.contains(&parameter.name)
}

/// The meaning of all that stands behind a name, where it is no list of words: a value, or a port.
fn whole(
    info: &CommandInfo,
    behind: Placed<&str>,
    line: &str,
    site: (Units, Context),
) -> Option<String> {
    if let [only] = info.parameters
        && only.name.is_empty()
    {
        let (number, letters) = (Some(behind.value), Placed { value: "", span: behind.span });
        let word = LooseWord { letters, number, upto: None, span: behind.span };
        return Some(explain(info, only, &word, site));
    }
    Some(match parse(line, &mut |_, _| {}).command?.value {
        Instruction::SetPort(port, value) => {
            format!("Output port {port} gets the value {value}, in binary {value:08b}")
        }
        Instruction::SetBit(PortBit { port, bit }, level) => {
            format!("Bit {bit} of output port {port} becomes {}", u8::from(level))
        }
        Instruction::WaitBit(PortBit { port, bit }, level) => {
            format!("Until bit {bit} of input port {port} is {}", u8::from(level))
        }
        Instruction::WaitPort(port, value) => {
            format!("Until input port {port} has the value {value}, in binary {value:08b}")
        }
        _ => return None,
    })
}

/// The axes of a group of a reference run; nothing if there is none of the machine.
fn group(info: &CommandInfo, letters: &str, context: Context) -> Option<String> {
    let letters = letters.to_ascii_uppercase();
    let named = info.parameters.iter().filter(|axis| letters.contains(axis.name));
    let named = named.filter(|axis| context.has(info, axis));
    let axes: Vec<String> =
        named.map(|axis| format!("`{}`: {}", axis.name, axis.meaning)).collect();
    (!axes.is_empty()).then(|| axes.join("\n\n"))
}

/// The meaning of a word, what its number is in larger units, and what it may be.
fn explain(
    info: &CommandInfo,
    parameter: &Parameter,
    word: &LooseWord<'_>,
    (units, context): (Units, Context),
) -> String {
    let mut text = meaning(info, parameter, units, context);
    let Some(allowed) = parameter.value else { return text };
    let values = word.number.into_iter().chain(word.upto).filter_map(token::number);
    let larger = |number: token::Exact| larger(number.value, info, parameter, (units, context));
    let larger: Vec<String> = values.filter_map(larger).collect();
    if !larger.is_empty() {
        let _ = write!(text, "\n\n{}", larger.join(" to "));
    }
    if allowed.whole {
        let _ = write!(text, "\n\nFrom {} to {}", allowed.least, allowed.most);
    }
    text
}

/// A number in convenient units.
pub(super) fn larger(
    value: Value,
    info: &CommandInfo,
    parameter: &Parameter,
    (units, context): (Units, Context),
) -> Option<String> {
    let thousandth = |unit: &str| format!("{} {unit}", thousandth(value));
    let metric = |unit: &str| format!("{} {unit}", self::thousandth(units.in_um(value)));
    match unit(info, parameter, units, context)? {
        "arc seconds" => Some(format!("{}°", libm::round(value.as_f64() / 0.36) / 10_000.0)),
        INCHES => Some(metric("mm")),
        unit if unit.starts_with(INCHES) => Some(metric("mm/s")),
        unit if unit.starts_with("µm/s") => Some(thousandth("mm/s")),
        "µm" => Some(thousandth("mm")),
        "ms" => Some(thousandth("s")),
        _ => None,
    }
}

/// A thousandth of a number, exactly.
pub(super) fn thousandth(value: Value) -> String {
    let (whole, rest) = (value.in_thousandths() / 1_000_000, value.in_thousandths() % 1_000_000);
    let sign = if value < Value::ZERO { "-" } else { "" };
    let (whole, rest) = (whole.unsigned_abs(), rest.unsigned_abs());
    let text = format!("{sign}{whole}.{rest:06}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::super::tests::CONTEXT;
    use super::*;
    use crate::language::reference::COMMANDS;
    use vimc4_isel_wire::AxisSet;

    /// What is shown at the `|`, which is no part of the text: on what, and the first line.
    fn shown(text: &str) -> Option<(String, String)> {
        let offset = text.find('|').expect("a cursor");
        let text = text.replacen('|', "", 1);
        let hover = hover(&text, offset, CONTEXT)?;
        Some((text[hover.range].to_owned(), hover.markdown))
    }

    #[test]
    fn commands_are_explained() {
        let (on, markdown) = shown("REF X\r\nN5 mo|veabs X5 ; x\r\n").expect("a command");
        assert_eq!(on, "moveabs");
        assert!(markdown.starts_with(
            "```ncp\nMOVEABS [Xn] [Yn] [Zn] [An]\n```\n\nMoves in a straight line to a place"
        ));
        assert!(markdown.contains(" rests.\n\n- `X`: where X goes, in µm\n"));
        assert!(markdown.contains("\n- `A`: where the fourth axis goes, in arc seconds\n"));
        assert!(!markdown.contains("`B`"), "the machine has no B");
        assert!(markdown.ends_with("\nFor example `MOVEABS X20000 Y15000 Z-5000`"));
        let (_, markdown) = shown("|TYPE 3").expect("a command");
        assert!(markdown.ends_with("the manual does not."));
    }

    #[test]
    fn words_are_explained_with_their_value() {
        let at = |text| shown(text).expect("a word");
        assert_eq!(
            at("N5 MOVEABS Y|-2500 X5"),
            ("Y-2500".to_owned(), "`Y`: where Y goes, in µm\n\n-2.5 mm".to_owned())
        );
        assert!(at("MOVEREL a| 5400").1.ends_with("\n\n1.5°"));
        assert!(at("DRILLDEF V|1500").1.ends_with("\n\n1.5 mm/s"));
        assert!(at("DRILLDEF T|1500").1.ends_with("\n\n1.5 s"));
        assert_eq!(at("ACCEL X|50").1, "`X`: acceleration of X, in %\n\nFrom 5 to 100");
        assert_eq!(at("SPINDLE CW O|N").1, "`ON`: the spindle runs");
        assert_eq!(at("MOVEABS |X").0, "X");
        assert!(at("CYL |A5000 Y").1.starts_with("`A`: radius"));
        assert!(at("CYL A5000 |Y").1.starts_with("`Y`: goes around"));
    }

    #[test]
    fn what_is_no_list_of_words_is_explained() {
        let at = |text| shown(text).expect("an explanation");
        let vel = at("N5 VEL 50|00 ; fast");
        assert_eq!(vel.0, "5000");
        assert!(vel.1.starts_with("the speed along the way, in ") && vel.1.ends_with("\n\n5 mm/s"));
        assert_eq!(at("WAIT |2000"), ("2000".to_owned(), "how long, in ms\n\n2 s".to_owned()));
        assert!(at("GETTOOL |3").1.starts_with("number of the tool"));
        assert_eq!(
            at("LIMIT Y0,5 X0,25|0000"),
            (
                "X0,250000".to_owned(),
                "`X`: lowest and highest machine coordinate of X, in µm\n\n0 mm to 250 mm"
                    .to_owned()
            )
        );
        let set = "Output port 1 gets the value 37, in binary 00100101";
        assert_eq!(at("SETPORT A1|=100101B"), ("A1=100101B".to_owned(), set.to_owned()));
        assert_eq!(at("resbit |A1.4").1, "Bit 4 of output port 1 becomes 0");
        assert_eq!(at("WAITBIT E2.4==|1").1, "Until bit 4 of input port 2 is 1");
        assert!(at("WAITPORT E1==|5").1.starts_with("Until input port 1 has the value 5"));
        let group = "`X`: the X axis\n\n`Z`: the Z axis";
        assert_eq!(at("REF Y x|Z"), ("xZ".to_owned(), group.to_owned()));
        assert!(at("WPREG1 A|CT").1.starts_with("`ACT`: "));
    }

    #[test]
    fn behind_inch_lengths_are_inches() {
        let at = |text| shown(text).expect("a word").1;
        let inches = "thousandths of an inch";
        assert_eq!(
            at("INCH\nMOVEABS X|1000"),
            format!("`X`: where X goes, in {inches}\n\n25.4 mm")
        );
        assert_eq!(at("METRIC\r\nMOVEABS X|1000"), "`X`: where X goes, in µm\n\n1 mm");
        let back = "INCH\nMETRIC\nMOVEABS X|1000\nINCH\n";
        assert_eq!(at(back), "`X`: where X goes, in µm\n\n1 mm");
        assert!(at("INCH\nMOVEREL A|5400").ends_with("in arc seconds\n\n1.5°"));
        assert!(at("INCH\nDRILLDEF V|100").ends_with("in thousandths of an inch/s\n\n2.54 mm/s"));
        assert!(at("INCH\nV|EL 100").contains("in thousandths of an inch/s, of rotary axes alone"));
        assert!(at("INCH\n|MOVEABS X5").contains(&format!("where X goes, in {inches}\n")));
        let mm = Context { drill_in_mm: true, ..CONTEXT };
        let drill = |at| hover("INCH\nDRILLDEF D5 P5", at, mm).expect("a word").markdown;
        assert!(drill(14).contains("in mm") && drill(17).contains(inches), "{}", drill(17));
    }

    #[test]
    fn thousandths_are_exact() {
        for (value, text) in
            [(0, "0"), (-1, "-0.000001"), (69_625_000, "69.625"), (-2_500_000_000, "-2500")]
        {
            assert_eq!(thousandth(Value::thousandths(value)), text);
        }
    }

    #[test]
    fn a_machine_lists_its_own_axes() {
        let axes = |bits| AxisSet::from_bits(bits).expect("axes");
        let flat = Context { axes: axes(0b0011), rotary: AxisSet::NONE, drill_in_mm: true };
        let markdown = |text| hover(text, 0, flat).expect("a command").markdown;
        assert!(markdown("MOVEABS X5").starts_with("```ncp\nMOVEABS [Xn] [Yn]\n```"));
        assert_eq!(markdown("MOVEABS X5").matches("\n- ").count(), 2);
        assert!(markdown("LIMIT X0,5").starts_with("```ncp\nLIMIT [Xn,n] [Yn,n]\n```"));
        assert!(markdown("VEL 5").contains("in µm/s\n"));
        // The cycle of a drill is not an axis, and its lengths may be mm.
        let drill = markdown("DRILLDEF C1");
        assert!(drill.contains("[Cn] [Pn]") && drill.contains("- `C`: cycle"));
        assert!(drill.contains("below the reference plane, in mm\n"));
        assert!(drill.contains("speed of drilling, in µm/s\n"));
    }

    #[test]
    fn elsewhere_there_is_nothing() {
        for text in [
            "|",
            "MOVEABS| X5",
            "MOVEABS X5 ; |X5",
            "MOVEABS Q|5",
            "MOV|ABS X5",
            "SETPORT |X1=5",
            "(|x)",
        ] {
            assert_eq!(shown(text), None, "{text}");
        }
        assert_eq!(hover("HALT", 500, CONTEXT), None);
    }

    #[test]
    fn every_command_is_explained() {
        for info in COMMANDS {
            let hover = hover(info.example, 0, CONTEXT).expect("an explanation");
            assert!(hover.markdown.contains(info.meaning));
        }
    }
}
