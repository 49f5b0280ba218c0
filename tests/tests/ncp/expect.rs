//! What is expected, and how it differs from what is there.

/// Says where two lists of lines differ.
pub(crate) fn same(what: &str, expected: &[String], found: &[String]) -> Result<(), String> {
    if expected == found { Ok(()) } else { Err(difference(what, expected, found)) }
}

/// Says where lines do not fit their patterns. `...` stands for any text; alone on a line, for any
/// lines, also none.
pub(crate) fn fits(what: &str, patterns: &[String], found: &[String]) -> Result<(), String> {
    if lines_fit(patterns, found) { Ok(()) } else { Err(difference(what, patterns, found)) }
}

fn difference(what: &str, expected: &[String], found: &[String]) -> String {
    const SHOWN: usize = 60;
    let list = |lines: &[String]| {
        let more = if lines.len() > SHOWN { "\n    and more" } else { "" };
        let lines: String = lines.iter().take(SHOWN).map(|line| format!("\n    {line}")).collect();
        lines + more
    };
    format!("{what}, expected{}\n  but found{}", list(expected), list(found))
}

fn lines_fit(patterns: &[String], lines: &[String]) -> bool {
    match (patterns.split_first(), lines.split_first()) {
        (None, None) => true,
        (Some((first, rest)), _) if first == "..." => {
            (0..=lines.len()).any(|skipped| lines_fit(rest, &lines[skipped..]))
        }
        (Some((first, patterns)), Some((line, lines))) => {
            line_fits(first, line) && lines_fit(patterns, lines)
        }
        _ => false,
    }
}

fn line_fits(pattern: &str, line: &str) -> bool {
    match pattern.split_once("...") {
        None => pattern == line,
        Some((before, after)) => line.strip_prefix(before).is_some_and(|rest| {
            let ends = (0..=rest.len()).filter(|end| rest.is_char_boundary(*end));
            ends.into_iter().any(|end| line_fits(after, &rest[end..]))
        }),
    }
}
