//! What is of another type than what belongs there, in words that people know.

/// An error of serde in words that people know: what there is, and what belongs there. Any other error is as
/// it was. Where one of several names belongs they are taken from the error that an empty text gives there.
#[must_use]
pub fn in_words(error: &str, of_empty: impl FnOnce() -> String) -> String {
    if let Some(name) = error.strip_prefix("missing field ") {
        return format!("{name} is missing");
    }
    if let Some((found, names)) = unknown(error) {
        let found = match found {
            "" => "an empty text".to_owned(),
            found => format!("`{}`", shortened(found).escape_debug()),
        };
        return format!("{found} is none of {names}");
    }
    let length = |error: &str| {
        let (length, expected) =
            error.strip_prefix("invalid length ")?.split_once(", expected ")?;
        Some(match expected {
            "fewer elements in array" | "fewer elements in sequence" => {
                format!("there is a list of {length}, which is too long")
            }
            _ => {
                let found = if is_object(expected) { "" } else { &format!(" of {length}") };
                format!("there is a list{found} where {} belongs", wanted(expected))
            }
        })
    };
    if let Some(told) = length(error) {
        return told;
    }
    let parts = error.strip_prefix("invalid type: ").or(error.strip_prefix("invalid value: "));
    let Some((found, expected)) = parts.and_then(|parts| parts.rsplit_once(", expected ")) else {
        return error.to_owned();
    };
    if let Some((from, to)) = range(expected)
        && let Some(number) = too_large(found, from)
    {
        return format!(
            "the number {number} is too large; a whole number from {from} to {to} belongs there"
        );
    }
    let names = || Some(format!("one of {}", unknown(&of_empty())?.1));
    let wanted = match wanted(expected) {
        name if name == NAME => names().unwrap_or(name),
        other => other,
    };
    format!("there is {} where {wanted} belongs", found_in_words(found))
}

/// What belongs where there is an enumeration.
const NAME: &str = "a name";

/// The text that is none of an enumeration, and the names that are.
fn unknown(error: &str) -> Option<(&str, String)> {
    let (found, names) = error.strip_prefix("unknown variant `")?.rsplit_once("`, expected ")?;
    let names = names.strip_prefix("one of ").unwrap_or(names);
    Some((found, names.replace(" or ", ", ")))
}

/// So many characters of a text are shown.
const SHOWN: usize = 40;

fn shortened(text: &str) -> String {
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

fn found_in_words(found: &str) -> String {
    match found.split_once(' ') {
        Some(("integer", number)) => format!("the number {}", number.trim_matches('`')),
        Some(("floating", number)) => {
            format!("the number {}", number.trim_start_matches("point ").trim_matches('`'))
        }
        Some(("boolean", value)) => value.trim_matches('`').to_owned(),
        Some(("string", text)) if text.chars().count() > SHOWN => {
            format!("the text {}\"", shortened(text))
        }
        Some(("string", text)) => format!("the text {text}"),
        _ => match found {
            "sequence" => "a list".to_owned(),
            "map" => "an object".to_owned(),
            "unit variant" => "a name without its values".to_owned(),
            other => other.to_owned(),
        },
    }
}

/// The whole numbers of a type.
fn range(expected: &str) -> Option<(i128, i128)> {
    let (first, name) = match expected.strip_prefix("a nonzero ") {
        Some(name) => (1, name),
        None => (0, expected),
    };
    let bits = match name.get(1..)? {
        "size" => 64,
        bits @ ("8" | "16" | "32" | "64") => bits.parse().ok()?,
        _ => return None,
    };
    match name.get(..1)? {
        "u" => Some((first, (1 << bits) - 1)),
        "i" => Some((-(1 << (bits - 1)), (1 << (bits - 1)) - 1)),
        _ => None,
    }
}

/// A number that none of the types could hold, whose ends people rarely see.
fn too_large(found: &str, from: i128) -> Option<&str> {
    let number = found.strip_prefix("floating point ").or(found.strip_prefix("integer "))?;
    let number = number.trim_matches('`');
    let size: f64 = number.parse().ok()?;
    let is_large = size.abs() >= (1_u64 << 63) as f64;
    (is_large && (size > 0.0 || from < 0)).then_some(number)
}

fn is_object(expected: &str) -> bool {
    expected == "a map" || expected.starts_with("struct ")
}

fn wanted(expected: &str) -> String {
    let words = match expected {
        "a string" => "a text",
        "a boolean" => "true or false",
        "f32" | "f64" => "a number",
        "a sequence" => "a list",
        "string or map" | "map with a single key" | "unit" | "unit variant" => NAME,
        "newtype variant" | "tuple variant" | "struct variant" => "a name with its values",
        object if is_object(object) => "an object",
        list if list.starts_with("tuple struct ") => "a list",
        other => {
            let length = other.strip_prefix("an array of length ");
            return match (length.or(other.strip_prefix("a tuple of size ")), range(other)) {
                (Some(length), _) => format!("a list of {length}"),
                (None, Some((from, to))) => whole(from, to),
                (None, None) => other.to_owned(),
            };
        }
    };
    words.to_owned()
}

/// The ends of the largest types say nothing to people.
fn whole(from: i128, to: i128) -> String {
    match (from < 0, to < i128::from(i64::MAX)) {
        (true, false) => "a whole number".to_owned(),
        (false, false) => format!("a whole number from {from}"),
        (_, true) => format!("a whole number from {from} to {to}"),
    }
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroU64;

    use serde::Deserialize;
    use serde_json::{Value, json};

    use super::*;

    #[derive(Debug, Deserialize)]
    enum Way {
        Idle,
        #[expect(dead_code, reason = "only read")]
        Moving {
            to: i64,
        },
        Gone,
    }

    #[derive(Debug, Deserialize)]
    enum Two {
        Up,
        Down,
    }

    #[derive(Debug, Deserialize)]
    struct Pair {
        #[expect(dead_code, reason = "only read")]
        one: i64,
    }

    fn told<T: for<'d> Deserialize<'d>>(value: Value) -> String {
        let error = |value: Value| match T::deserialize(value) {
            Ok(_) => "nothing is wrong".to_owned(),
            Err(error) => error.to_string(),
        };
        in_words(&error(value), || error("".into()))
    }

    #[expect(clippy::too_many_lines, reason = "it is a table")]
    #[test]
    fn no_type_of_the_program_is_named() {
        let ways = "`Idle`, `Moving`, `Gone`";
        for (told, words) in [
            (
                told::<u8>(json!("abc")),
                "there is the text \"abc\" where a whole number from 0 to 255 belongs".to_owned(),
            ),
            (
                told::<u8>(json!(256)),
                "there is the number 256 where a whole number from 0 to 255 belongs".to_owned(),
            ),
            (
                told::<i16>(json!(-1.5)),
                "there is the number -1.5 where a whole number from -32768 to 32767 belongs"
                    .to_owned(),
            ),
            (
                told::<u64>(json!(-5)),
                "there is the number -5 where a whole number from 0 belongs".to_owned(),
            ),
            (
                told::<usize>(json!([])),
                "there is a list where a whole number from 0 belongs".to_owned(),
            ),
            (
                told::<NonZeroU64>(json!("x")),
                "there is the text \"x\" where a whole number from 1 belongs".to_owned(),
            ),
            (
                told::<NonZeroU64>(json!(0)),
                "there is the number 0 where a whole number from 1 belongs".to_owned(),
            ),
            (told::<i64>(json!(true)), "there is true where a whole number belongs".to_owned()),
            (
                told::<i64>(json!(-1e20)),
                format!(
                    "the number -1e+20 is too large; a whole number from {} to {} belongs there",
                    i64::MIN,
                    i64::MAX
                ),
            ),
            (
                told::<i64>(json!(u64::MAX)),
                format!(
                    "the number {} is too large; a whole number from {} to {} belongs there",
                    u64::MAX,
                    i64::MIN,
                    i64::MAX
                ),
            ),
            (
                told::<u8>(json!(1e20)),
                "the number 1e+20 is too large; a whole number from 0 to 255 belongs there"
                    .to_owned(),
            ),
            (told::<f64>(json!("x")), "there is the text \"x\" where a number belongs".to_owned()),
            (told::<Way>(json!(5)), format!("there is the number 5 where one of {ways} belongs")),
            (told::<Way>(json!({})), format!("there is an object where one of {ways} belongs")),
            (told::<Way>(json!("abc")), format!("`abc` is none of {ways}")),
            (told::<Way>(json!("")), format!("an empty text is none of {ways}")),
            (
                told::<Way>(json!("Moving")),
                "there is a name without its values where a name with its values belongs"
                    .to_owned(),
            ),
            (told::<Two>(json!("x")), "`x` is none of `Up`, `Down`".to_owned()),
            (told::<Pair>(json!([])), "there is a list where an object belongs".to_owned()),
            (
                told::<[i64; 2]>(json!([1])),
                "there is a list of 1 where a list of 2 belongs".to_owned(),
            ),
            (
                told::<[i64; 2]>(json!([1, 2, 3])),
                "there is a list of 3, which is too long".to_owned(),
            ),
        ] {
            assert_eq!(told, words);
        }
        assert_eq!(told::<Way>(json!("x".repeat(1_000))).matches('x').count(), SHOWN);
        assert_eq!(
            in_words("invalid type: integer `5`, expected string or map", String::new),
            "there is the number 5 where a name belongs"
        );
    }
}
