//! Numbers in mm, beside those in µm.

use std::ops::Range;

use super::hover::{larger, thousandth};
use super::{Context, Here};
use crate::language::reference::Form;
use crate::language::{Instruction, Units, Value, lines, parse, token};

/// A hint after a word.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hint {
    /// Where it stands, in bytes from the beginning of the text.
    pub at: usize,
    /// What it says: `20 mm`.
    pub text: String,
}

/// The lengths, speeds and angles in the lines that touch a range of bytes, in mm, mm/s and
/// degrees. Zeros and faulty lines have no hints.
#[must_use]
pub fn hints(text: &str, within: Range<usize>, context: Context) -> Vec<Hint> {
    let mut hints = Vec::new();
    let mut units = Units::default();
    for line in lines(text).take_while(|line| line.offset <= within.end) {
        let Some(command) = parse(line.text, &mut |_, _| {}).command else { continue };
        match command.value {
            Instruction::End => break,
            Instruction::Units(new) => units = new,
            _ => {}
        }
        if line.offset + line.text.len() < within.start {
            continue;
        }
        if let Instruction::Limit(limits) = command.value {
            let pairs = limits.iter().enumerate().filter(|(axis, _)| !context.rotary.has(*axis));
            hints.extend(pairs.filter_map(|(_, limits)| *limits).map(|(low, high)| Hint {
                at: line.offset + high.span.end as usize,
                text: {
                    let [low, high] = [low, high].map(|limit| thousandth(units.in_um(limit.value)));
                    format!("{low} to {high} mm")
                },
            }));
            continue;
        }
        words(Here { offset: line.offset, line: line.text }, (units, context), &mut hints);
    }
    hints.sort_by_key(|hint| hint.at);
    hints
}

fn words(here: Here<'_>, site: (Units, Context), hints: &mut Vec<Hint>) {
    let Some(anatomy) = here.anatomy() else { return };
    let info = anatomy.info;
    let mut hint = |number: Option<&str>, end: u32, parameter| {
        let value = number.and_then(token::number).map(|number| number.value);
        let value = value.filter(|value| *value != Value::ZERO);
        let text = value.and_then(|value| larger(value, info, parameter, site));
        // Seconds are as easily read as milliseconds.
        let text = text.filter(|text| !text.ends_with(" s"));
        hints.extend(text.map(|text| Hint { at: here.offset + end as usize, text }));
    };
    if let (Form::Velocity | Form::RapidVelocity, [only]) = (info.form, info.parameters) {
        let behind = anatomy.behind_name(here.line);
        return hint(Some(behind.value), behind.span.end, only);
    }
    for (nth, word) in (0..).zip(&anatomy.words) {
        let mut known = info.words_at(nth).iter();
        let known = known.find(|known| known.name.eq_ignore_ascii_case(word.letters.value));
        if let Some(parameter) = known {
            hint(word.number, word.span.end, parameter);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::CONTEXT;
    use super::*;

    /// The text with its hints, each behind a `«`.
    fn hinted(text: &str, context: Context) -> String {
        let mut out = text.to_owned();
        for hint in hints(text, 0..text.len(), context).into_iter().rev() {
            out.insert_str(hint.at, &format!("«{}", hint.text));
        }
        out
    }

    #[test]
    fn lengths_are_told_in_mm() {
        for (line, expected) in [
            ("MOVEABS X20000 Y0 Z-12.5", "MOVEABS X20000«20 mm Y0 Z-12.5«-0.0125 mm"),
            ("movrel x5", "movrel x5"),
            ("MOVEREL A5400 ; A5400", "MOVEREL A5400«1.5° ; A5400"),
            ("CWABS I75000 J50000 X5", "CWABS I75000«75 mm J50000«50 mm X5«0.005 mm"),
            ("VEL 8000 ; fast", "VEL 8000«8 mm/s ; fast"),
            ("LIMIT X0,250000", "LIMIT X0,250000«0 to 250 mm"),
            ("WPREG1 X5000", "WPREG1 X5000«5 mm"),
            ("CYL A5000 Y", "CYL A5000«5 mm Y"),
            ("DRILLDEF C1 D3000 T500 V2000", "DRILLDEF C1 D3000«3 mm T500 V2000«2 mm/s"),
            ("SPINDLE ON RPM5000 TIME500", "SPINDLE ON RPM5000 TIME500"),
            ("PROGEND\nMOVEABS X5", "PROGEND\nMOVEABS X5"),
        ] {
            assert_eq!(hinted(line, CONTEXT), expected);
        }
    }

    #[test]
    fn inches_are_told_in_mm_too() {
        for (text, expected) in [
            (
                "INCH\nMOVEABS X1000 A5400\nMETRIC\nMOVEABS X1000",
                "INCH\nMOVEABS X1000«25.4 mm A5400«1.5°\nMETRIC\nMOVEABS X1000«1 mm",
            ),
            ("INCH\nVEL 500", "INCH\nVEL 500«12.7 mm/s"),
            ("INCH\nLIMIT X-1000,10000", "INCH\nLIMIT X-1000,10000«-25.4 to 254 mm"),
            ("INCH\nDRILLDEF D100 T500 V10", "INCH\nDRILLDEF D100«2.54 mm T500 V10«0.254 mm/s"),
        ] {
            assert_eq!(hinted(text, CONTEXT), expected);
        }
    }

    #[test]
    fn what_is_mm_already_needs_no_hint() {
        let mm = Context { drill_in_mm: true, ..CONTEXT };
        assert_eq!(hinted("DRILLDEF D3 V2000 P500", mm), "DRILLDEF D3 V2000«2 mm/s P500«0.5 mm");
    }

    #[test]
    fn only_the_lines_in_sight_have_hints() {
        let text = "MOVEABS X1000\nMOVEABS X2000\nMOVEABS X3000\n";
        let texts = |within| {
            hints(text, within, CONTEXT).into_iter().map(|hint| hint.text).collect::<Vec<_>>()
        };
        assert_eq!(texts(14..20), ["2 mm"]);
        assert_eq!(texts(0..text.len()).len(), 3);
    }
}
