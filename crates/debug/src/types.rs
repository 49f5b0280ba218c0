//! What is of another type than what belongs there, in words that people know.

/// An error of serde in words that people know: what there is, and what belongs there. Any other error is as
/// it was.
#[must_use]
pub fn in_words(error: &str) -> String {
    if let Some(name) = error.strip_prefix("missing field ") {
        return format!("{name} is missing");
    }
    let parts = error.strip_prefix("invalid type: ").or(error.strip_prefix("invalid value: "));
    match parts.and_then(|parts| parts.rsplit_once(", expected ")) {
        Some((found, expected)) => {
            format!("there is {} where {} belongs", found_in_words(found), wanted(expected))
        }
        None => error.to_owned(),
    }
}

/// So many characters of a text are shown.
const SHOWN: usize = 40;

fn found_in_words(found: &str) -> String {
    match found.split_once(' ') {
        Some(("integer", number)) => format!("the number {}", number.trim_matches('`')),
        Some(("floating", number)) => {
            format!("the number {}", number.trim_start_matches("point ").trim_matches('`'))
        }
        Some(("boolean", value)) => value.trim_matches('`').to_owned(),
        Some(("string", text)) if text.chars().count() > SHOWN => {
            let shown: String = text.chars().take(SHOWN).collect();
            format!("the text {shown}…\"")
        }
        Some(("string", text)) => format!("the text {text}"),
        _ => match found {
            "sequence" => "a list".to_owned(),
            "map" => "an object".to_owned(),
            other => other.to_owned(),
        },
    }
}

fn wanted(expected: &str) -> String {
    let words = match expected {
        "a string" => "a text",
        "a boolean" => "true or false",
        "i64" => "a whole number",
        "usize" | "u64" | "u32" => "a whole number from 0",
        "a sequence" => "a list",
        object if object == "a map" || object.starts_with("struct ") => "an object",
        other => match other.strip_prefix("an array of length ") {
            Some(length) => return format!("a list of {length}"),
            None => other,
        },
    };
    words.to_owned()
}
