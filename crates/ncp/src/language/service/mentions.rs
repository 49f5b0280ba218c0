//! Where registers and tools are set, and where they are used.

use std::ops::Range;

use super::{Anatomy, Here};
use crate::language::reference::Form;
use crate::language::{Instruction, lines, parse, token};

/// Something that has a number in a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Thing {
    /// A register for a work-piece zero.
    Register(u32),
    Tool(u32),
}

/// A place that mentions it.
struct Mention {
    thing: Thing,
    /// In bytes from the beginning of the text.
    range: Range<usize>,
    /// Whether it defines the thing.
    defines: bool,
}

/// Where the register or the tool at a place is set: for a register the lines that store into it,
/// for a tool its TOOLDEF. Those before the place, if there are any; all places are in bytes from
/// the beginning of the text.
#[must_use]
pub fn definitions(text: &str, offset: usize) -> Vec<Range<usize>> {
    let Some((thing, at)) = asked(text, offset) else { return Vec::new() };
    let (before, after): (Vec<_>, Vec<_>) = mentions(text)
        .filter(|mention| mention.thing == thing && mention.defines)
        .map(|mention| mention.range)
        .partition(|range| range.start <= at);
    if before.is_empty() { after } else { before }
}

/// Every place that mentions the register or the tool at a place; `with_definitions` includes its
/// definitions.
#[must_use]
pub fn references(text: &str, offset: usize, with_definitions: bool) -> Vec<Range<usize>> {
    let Some((thing, _)) = asked(text, offset) else { return Vec::new() };
    let wanted =
        |mention: &Mention| mention.thing == thing && (with_definitions || !mention.defines);
    mentions(text).filter(wanted).map(|mention| mention.range).collect()
}

/// The thing at the place, and where its mention begins.
fn asked(text: &str, offset: usize) -> Option<(Thing, usize)> {
    let (here, _) = Here::at(text, offset);
    let mention = mention(here)?;
    let touches = mention.range.start <= offset && offset <= mention.range.end;
    touches.then_some((mention.thing, mention.range.start))
}

fn mentions(text: &str) -> impl Iterator<Item = Mention> + '_ {
    let mut ended = false;
    lines(text)
        .map_while(move |line| {
            if ended {
                return None;
            }
            let command = parse(line.text, &mut |_, _| {}).command;
            ended = command.is_some_and(|command| command.value == Instruction::End);
            Some(mention(Here { offset: line.offset, line: line.text }))
        })
        .flatten()
}

/// The thing that a line mentions.
fn mention(here: Here<'_>) -> Option<Mention> {
    let Anatomy { info, name, words, .. } = here.anatomy()?;
    let behind = here.line.get(name.end as usize..)?;
    let digits = behind.trim_start();
    let length = digits.bytes().take_while(u8::is_ascii_digit).count();
    let end = here.line.len() - digits.len() + length;
    let number = || digits.get(..length)?.parse().ok();
    let (thing, end, defines) = match info.form {
        Form::Register => {
            let recalls =
                |word: &super::LooseWord<'_>| word.letters.value.eq_ignore_ascii_case("ACT");
            match words.first().filter(|word| recalls(word)) {
                Some(act) => (Thing::Register(number()?), act.span.end as usize, false),
                None => (Thing::Register(number()?), end, true),
            }
        }
        Form::Tool => (Thing::Tool(number()?), end, false),
        Form::ToolDefinition => {
            let mut words = words.iter();
            let word = words.find(|word| word.letters.value.eq_ignore_ascii_case("T"))?;
            let number = token::number(word.number?)?.value.in_thousandths() / 1_000;
            (Thing::Tool(u32::try_from(number).ok()?), word.span.end as usize, true)
        }
        _ => return None,
    };
    let range = here.offset + name.start as usize..here.offset + end;
    Some(Mention { thing, range, defines })
}

#[cfg(test)]
mod tests {
    use super::*;

    const JOB: &str = "\
WPREG1 X5
WPREG2 X6
WPREG1 Y7
wpreg 1 act ; here
WPREG1 Z8
WPREG2ACT
TOOLDEF L5 T3 R1
GETTOOL 3
GETTOOL 4
GETTOOL 3
PROGEND
GETTOOL 3
";

    fn at(what: &str) -> usize {
        JOB.find(what).expect("it is there")
    }

    fn shown(ranges: Vec<Range<usize>>) -> Vec<String> {
        let line = |at: usize| JOB[..at].matches('\n').count() + 1;
        ranges.into_iter().map(|range| format!("{} {}", line(range.start), &JOB[range])).collect()
    }

    #[test]
    fn a_register_is_set_by_the_lines_before() {
        assert_eq!(shown(definitions(JOB, at("wpreg 1 act"))), ["1 WPREG1", "3 WPREG1"]);
        assert_eq!(shown(definitions(JOB, at("wpreg 1 act") + 11)), ["1 WPREG1", "3 WPREG1"]);
        assert_eq!(shown(definitions(JOB, at("WPREG2ACT"))), ["2 WPREG2"]);
        let later = "WPREG1ACT\nWPREG1 X5\n";
        assert_eq!(definitions(later, 3).first(), Some(&(10..16)));
    }

    #[test]
    fn a_tool_is_what_its_tooldef_says() {
        assert_eq!(shown(definitions(JOB, at("GETTOOL 3"))), ["7 TOOLDEF L5 T3"]);
        assert_eq!(definitions(JOB, at("GETTOOL 4")), []);
    }

    #[test]
    fn references_are_found_up_to_the_end_of_the_job() {
        let tool = at("GETTOOL 3") + 4;
        assert_eq!(shown(references(JOB, tool, false)), ["8 GETTOOL 3", "10 GETTOOL 3"]);
        assert_eq!(references(JOB, tool, true).len(), 3);
        assert_eq!(references(JOB, at("WPREG1 X5"), true).len(), 4);
        assert_eq!(shown(references(JOB, 0, false)), ["4 wpreg 1 act"]);
    }

    #[test]
    fn elsewhere_there_is_nothing() {
        assert_eq!(references(JOB, at("; here") + 3, true), []);
        assert_eq!(references(JOB, at(" X5") + 2, true), []);
        assert_eq!(definitions("", 0), []);
        assert_eq!(definitions("WPREG X5", 2), []);
        assert_eq!(references(JOB, 5_000, true), []);
    }
}
