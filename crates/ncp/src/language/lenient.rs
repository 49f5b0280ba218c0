//! What may be left out of a file that is not fully readable: only what the tool's way does not
//! depend on.

use strsim::levenshtein;

use super::reference;
use super::text::{TextLine, lines};
use super::token;

/// Whether a line with an unknown command cannot have been one that moves something or that later
/// lines depend on. It has no coordinates, it has more than one word, and its name does not
/// resemble that of such a command, even cut off or half wrong.
pub(super) fn is_no_motion(line: &str) -> bool {
    let name = token::name(line).map_or("", |(_, name)| name).to_ascii_uppercase();
    let rest = line.get(name.len()..).unwrap_or_default();
    let matters = reference::COMMANDS.iter().filter(|info| !info.is_accessory());
    let mut names = matters.map(|info| info.name).filter(|name| *name != reference::MARK);
    // A shorter line, or one without arguments, may be the rest of anything.
    let mut others = rest.split(|c: char| !c.is_ascii_alphabetic()).filter(|word| word.len() > 1);
    let says_more = others.clone().next().is_some();
    let standard = others.any(|word| is_like(&word.to_ascii_uppercase(), "STANDARD"));
    let is_text = name.len() >= SHORTEST && says_more && !standard;
    let hides_another = hides_a_command(rest);
    is_text && !hides_another && !has_coordinates(rest) && !names.any(|known| is_like(&name, known))
}

/// Whether the rest of a line, up to the comment, has a word that is or begins with the name of a
/// command, nearly does, or is a coordinate of X, Y or Z. Comments in brackets do not count; a
/// bracket that is not closed begins no comment.
pub(super) fn hides_a_command(rest: &str) -> bool {
    let code = token::code(rest).map_or("", |(_, code)| code);
    let is_name = |word: &str| word.len() >= SHORTEST && glued_or_near(word);
    let mut rest = code;
    loop {
        let (outside, inside) = match rest.split_once('(') {
            Some((outside, inside)) if inside.contains(')') => (outside, Some(inside)),
            _ => (rest, None),
        };
        let mut words = outside.split(|c: char| !c.is_ascii_alphabetic() && c != '_');
        if words.any(|word| is_name(&word.to_ascii_uppercase()) || is_short_name(word))
            || has_linear_coordinates(outside)
        {
            return true;
        }
        match inside.and_then(|inside| inside.split_once(')')) {
            Some((_, behind)) => rest = behind,
            None => return false,
        }
    }
}

/// The first word that is the name of a command, in text that is not read as a command, and its
/// place.
pub(super) fn command_in(text: &str) -> Option<(usize, &'static str)> {
    let code = token::code(text).map_or("", |(_, code)| code);
    let words = code.split(|c: char| !c.is_ascii_alphabetic() && c != '_');
    let of = |word: &str| {
        let mut names = reference::COMMANDS.iter().map(|info| info.name);
        names.find(|name| name.eq_ignore_ascii_case(word))
    };
    // Every word ends before one byte that is not a letter.
    let mut at = 0;
    words.into_iter().find_map(|word| {
        let start = at;
        at += word.len();
        at += code.get(at..)?.chars().next().map_or(0, char::len_utf8);
        of(word).map(|name| (start, name))
    })
}

/// Whether a word begins with the name of a command or is written nearly as one.
fn glued_or_near(word: &str) -> bool {
    let mut names = reference::COMMANDS.iter().map(|info| info.name);
    names.any(|known| word.starts_with(known) || levenshtein(word, known) * 3 <= known.len())
}

/// Whether a word is the name of a command of few letters: REF, VEL, CYL.
fn is_short_name(word: &str) -> bool {
    reference::COMMANDS.iter().any(|info| info.name.eq_ignore_ascii_case(word))
}

/// Whether X, Y or Z stands before a number.
fn has_linear_coordinates(text: &str) -> bool {
    let mut letters = text.split(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.'));
    // What follows the last number stands before none.
    letters.next_back();
    letters.any(|before| {
        let word = before.trim_end_matches(token::is_blank);
        let word = word.rsplit(|c: char| !c.is_ascii_alphabetic()).next().unwrap_or_default();
        ["X", "Y", "Z"].iter().any(|axis| word.eq_ignore_ascii_case(axis))
    })
}

/// The length of the shortest word that is taken for one.
const SHORTEST: usize = 4;

/// Whether a word names axes and nothing else, as behind REF and PLANE.
fn is_axes(word: &str) -> bool {
    word.bytes().all(|letter| matches!(letter.to_ascii_uppercase(), b'X'..=b'Z' | b'A'..=b'C'))
}

/// Whether axes are named, or there is a number after a coordinate letter or by itself: that may be
/// a coordinate that has lost its letter.
fn has_coordinates(text: &str) -> bool {
    if text.split(|c: char| !c.is_ascii_alphabetic()).any(|word| !word.is_empty() && is_axes(word))
    {
        return true;
    }
    let mut before = ' ';
    text.chars().any(|character| {
        let number = character.is_ascii_digit() || matches!(character, '+' | '-' | '.');
        let letter = matches!(before.to_ascii_uppercase(), 'X' | 'Y' | 'Z' | 'A'..='C' | 'I'..='K');
        let stands = before == ' ' || before == '\t';
        before = character;
        number && (letter || stands)
    })
}

fn is_like(name: &str, known: &str) -> bool {
    // What follows the name may have lost its blank.
    let beginning = name.get(..known.len()).unwrap_or(name);
    levenshtein(beginning, known) * 3 <= known.len()
        || known.starts_with(name)
        || known.ends_with(name)
        || name.contains(known)
        || levenshtein(name, known) * 3 <= known.len() * 2
}

/// How many lines are examined to tell one language from another.
const LOOK: usize = 200;

/// The first line of G-code in a text that is that: it begins as G-code does, and no line near the
/// beginning is a command of a job.
///
/// A line of G-code has several words of a letter and one number each, or one such as G21 or M3. No
/// data field, command list or plot file has such a line, for their numbers stand behind one letter
/// and are parted by commas.
#[must_use]
pub fn g_code(text: &str) -> Option<TextLine<'_>> {
    let mut first = None;
    for line in lines(text).take(LOOK) {
        let code = line.text.trim_start();
        let code = token::line_number(code).map_or(code, |(rest, _)| rest.trim_start());
        if token::name(code).is_ok_and(|(_, name)| reference::find(name).is_some()) {
            return None;
        }
        if first.is_some() {
            continue;
        }
        // What is in brackets, or behind a semicolon, is a comment.
        let code = line.text.split([';', '(']).next().unwrap_or_default().trim();
        if code.is_empty() || code.starts_with(['%', '#', 'O', 'o']) {
            continue;
        }
        // A line that begins differently is in another language.
        let words = words(code)?;
        let words =
            words.strip_prefix(&['N']).or_else(|| words.strip_prefix(&['n'])).unwrap_or(&words);
        match words {
            [] => {}
            [_, _, ..] | ['G' | 'M'] => first = Some(line),
            // Some controllers store such lines too.
            ['g' | 'm' | 'T' | 't' | 'S' | 's' | 'F' | 'f'] => {}
            [_] => return None,
        }
    }
    first
}

/// The letters of words of a letter and a number each, if there is nothing else.
fn words(code: &str) -> Option<Vec<char>> {
    let mut rest = code;
    let mut letters = Vec::new();
    while let Some(letter) = rest.chars().next() {
        let number = rest.get(1..).filter(|_| letter.is_ascii_alphabetic())?.trim_start();
        let digits = number.strip_prefix(['-', '+']).unwrap_or(number);
        let end = digits.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(digits.len());
        if !digits.get(..end)?.contains(|c: char| c.is_ascii_digit()) {
            return None;
        }
        letters.push(letter);
        rest = digits.get(end..)?.trim_start();
    }
    Some(letters)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_may_move_is_not_left_out() {
        for line in [
            "MOVABS X5",
            "M",
            "OVEABS",
            "ABS X5",
            "WP",
            "ZERO",
            "RF XYZ",
            "VLE 500",
            "FOO X5",
            "CY",
            "FOO 5",
            "WPZEROX",
            "PLAEN XY",
            "ETTOOL 5",
            "AIRBLAST ON WPZERO",
            "",
        ] {
            assert!(!is_no_motion(line), "{line}");
        }
        for line in ["TOOLCHANGERLIGHT ON", "MESSAGE done", "SUCTION OFF", "AIRBLAST ON"] {
            assert!(is_no_motion(line), "{line}");
        }
    }

    #[test]
    fn commands_are_seen_behind_others() {
        for rest in [
            " ON MOVEABS X10000",
            " ON (x) MOVEREL X5000",
            " OFF fastabsZ0",
            " ON MOVABS",
            " ON REF XYZ",
            " ON (not closed MOVEABS",
            "(one) WPZERO (two)",
            " ON Z-500",
            " ON X 5",
        ] {
            assert!(hides_a_command(rest), "{rest}");
        }
        for rest in ["", " ON", " ON 5 ; MOVEABS X5", " ON (MOVEABS X5)", " A1=256", " TIME x"] {
            assert!(!hides_a_command(rest), "{rest}");
        }
    }

    #[test]
    fn g_code_is_told_from_the_rest() {
        let found = |text| g_code(text).map(|line| line.number);
        for (text, line) in [
            ("G21\nG0 X5\n", 1),
            ("%\nO1000\n(a part)\nN10 G21 G90\nG0 X5\n", 4),
            ("T1 M6\n", 1),
            ("(a part)\nT1M6\nG0X5.5Y-3\n", 2),
            ("g0 x5\n", 1),
            ("T1\nM6\n", 2),
            ("; a part\nS12000 M3\n", 2),
            ("X5 Y5 F100\n", 1),
        ] {
            assert_eq!(found(text), Some(line), "{text}");
        }
        for text in [
            "",
            "%\n",
            "71\n9\n",
            "; axes: 7\n0 5,900,5,900,0,400,0,400\n",
            "p0,1,1\n9\n",
            "m480,16000,0,21\n",
            "m5,5,5,5\nG0\n",
            "@07\n@0A5,900\n",
            "IN;PU;PA1000,1000;\n",
            "PU;\n",
            "z7\n",
            "T5\n71\n9\n",
            "g1\n71\n9\n",
            "REF XYZ\nG0 X5\n",
            "N1 REF XYZ\nG0 X5\n",
            "IMF_PBL\nG00 X5\n",
            "G00 X5\nMOVEABS X5\n",
            "GETTOOL 1\n",
            "MOVEABS X5\n",
            "MOVABS X1\n",
        ] {
            assert_eq!(found(text), None, "{text}");
        }
    }
}
