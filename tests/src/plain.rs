//! Whether messages are in words, and not as Rust prints its values for programmers.

/// The first part of a message that Rust's `{:?}` has written: a value with fields, a value in
/// brackets, a path, or a name of several words without blanks.
#[must_use]
pub fn debug_text(message: &str) -> Option<&str> {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let starts = message
        .char_indices()
        .filter(|(at, c)| c.is_ascii_uppercase() && !message[..*at].ends_with(is_part));
    starts.into_iter().find_map(|(at, _)| {
        let rest = &message[at..];
        let end = rest.find(|c: char| !is_part(c)).unwrap_or(rest.len());
        let (word, behind) = rest.split_at(end);
        let has_small = word.contains(|c: char| c.is_ascii_lowercase());
        let is_value = behind.starts_with(" { ") || behind.starts_with('(');
        let is_debug = word == "None" || has_small && (is_value || is_camel_case(word));
        is_debug.then_some(rest)
    })
}

/// `EndlessReference`, but not `WPREGnACT`.
fn is_camel_case(word: &str) -> bool {
    let is_case = |three: &[u8]| {
        three[0].is_ascii_lowercase()
            && three[1].is_ascii_uppercase()
            && three[2].is_ascii_lowercase()
    };
    word.as_bytes().windows(3).any(is_case)
}

#[cfg(test)]
mod tests {
    use super::debug_text;

    #[test]
    fn words_are_told_from_values() {
        for message in [
            "EndlessReference { axis: 3, name: \"A\" }",
            "the event was Some(3)",
            "it reads None",
            "the loss AtEnd",
        ] {
            assert!(debug_text(message).is_some(), "{message}");
        }
        for message in [
            "X+ at step 100",
            "no wire at A1.1; use [job.ports] A2 = 0",
            "an iMC-S8 (2012)",
            "Z (up)",
        ] {
            assert_eq!(debug_text(message), None, "{message}");
        }
    }
}
