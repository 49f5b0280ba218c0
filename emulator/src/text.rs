//! Making foreign text safe to show.

use std::borrow::Cow;
use std::path::Path;

/// Foreign text, such as the name or a line of a file, made safe to show: control characters are
/// replaced by their pictures. Line ends stay, and so does the place of every line.
pub(crate) fn shown(text: &str) -> String {
    text.chars().map(picture).collect()
}

/// The same for what has to be one line.
pub(crate) fn shown_in_line(text: &str) -> String {
    text.chars().map(|c| if c == '\n' { '\u{240A}' } else { picture(c) }).collect()
}

/// What an answer refuses, as its bytes alone say it, with the reason in place of what they mean.
pub(crate) fn explained(refusal: String, why: Option<&str>) -> String {
    match (refusal.split_once(": "), why) {
        (Some((code, _)), Some(why)) => format!("{code}: {why}"),
        _ => refusal,
    }
}

/// The name of a file that is read, for people: `-` is standard input.
pub(crate) fn name(path: &Path) -> String {
    match path.to_str() {
        Some("-") => "standard input".to_owned(),
        _ => shown_in_line(&path.display().to_string()),
    }
}

/// At most this many characters of a text, and a sign that there are more.
pub(crate) fn shortened(text: &str, longest: usize) -> Cow<'_, str> {
    match text.char_indices().nth(longest) {
        Some((end, _)) => Cow::Owned(format!("{}…", text.get(..end).unwrap_or_default())),
        None => Cow::Borrowed(text),
    }
}

fn picture(c: char) -> char {
    match c {
        '\n' | '\t' => c,
        '\0'..='\x1F' => char::from_u32(0x2400 + u32::from(c)).unwrap_or('\u{FFFD}'),
        '\x7F' => '\u{2421}',
        // The second set of controls, and what makes text run backwards.
        '\u{80}'..='\u{9F}'
        | '\u{200E}'..='\u{200F}'
        | '\u{202A}'..='\u{202E}'
        | '\u{2066}'..='\u{2069}' => '\u{FFFD}',
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_a_terminal_obeys_is_shown() {
        assert_eq!(shown("a\x1B[2J\x07\tb\nc\x7F\u{9B}31m"), "a␛[2J␇\tb\nc␡\u{FFFD}31m");
        assert_eq!(shown_in_line("a\r\nb"), "a␍␊b");
        assert_eq!(shown("Fräser 3 µm, 漢字"), "Fräser 3 µm, 漢字");
    }
}
