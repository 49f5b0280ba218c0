//! Identifying the controller at a port.

use vimc4_device::{Identity, Question, Until, said};

use crate::Model;

const VERSION: Question = Question { send: b"@0V\r", until: Until::Pause };
const OWNER: Question = Question { send: b"@0U\r", until: Until::Pause };

/// Asks for the version, and a controller that does not name its model for its owner's text.
pub(super) fn identify<E>(
    model: &Model,
    ask: &mut dyn FnMut(Question) -> Result<Vec<u8>, E>,
) -> Result<Identity, E> {
    let mut version = ask(VERSION)?;
    // Anything left over on the line is refused together with the first question.
    if matches!(version.as_slice(), [b'1'..=b'9']) {
        version = ask(VERSION)?;
    }
    if version.is_empty() {
        return Ok(Identity::Silent);
    }
    match of_version(model, &version) {
        // A controller of the later models has an owner's text.
        Identity::Unknown(said) => Ok(of_owner(model, &ask(OWNER)?, said)),
        known => Ok(known),
    }
}

/// The model in the text of `V`: its name, as a separate word.
fn of_version(model: &Model, answer: &[u8]) -> Identity {
    let said = said(answer);
    let words: Vec<String> = said
        .to_ascii_lowercase()
        .split(|c: char| !c.is_ascii_alphanumeric() && c != '-')
        .map(str::to_owned)
        .collect();
    let named = |name: &&&str| words.iter().any(|word| word == *name);
    match Model::names().iter().find(named) {
        None => Identity::Unknown(said),
        Some(name) if is_like(model, name) => Identity::Same(said),
        Some(name) => Identity::Other { what: (*name).to_owned(), said },
    }
}

/// Whether a model is the built-in one of that name; a model from a file only needs the same
/// commands.
fn is_like(model: &Model, name: &str) -> bool {
    let is_builtin = Model::names().contains(&model.name.as_str());
    if is_builtin { model.name == name } else { has_commands_of(model, name) }
}

/// Whether a model has the commands of the built-in one of that name.
fn has_commands_of(model: &Model, name: &str) -> bool {
    Model::builtin(name).is_some_and(|named| model.command_set == named.command_set)
}

/// What the answer to `U` shows: only the later models have an owner's text.
fn of_owner(model: &Model, answer: &[u8], said: String) -> Identity {
    let is_later = vimc4_device::said(answer).contains("UserInfo");
    let wants_later = has_commands_of(model, "imc-s8");
    match (is_later, wants_later) {
        (true, true) => Identity::Same(said),
        (false, false) => Identity::Unknown(said),
        (true, false) => Identity::Other { what: "an imc-m, imc-mp or imc-s8".to_owned(), said },
        // A controller that does not name its model may lack that text too.
        (false, true) if said.is_empty() => Identity::Unknown(said),
        (false, true) => Identity::Other { what: "an imc4 or imc4-m".to_owned(), said },
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    fn model(name: &str) -> Arc<Model> {
        Model::builtin(name).unwrap()
    }

    #[test]
    fn the_version_names_the_model() {
        for (name, text) in [
            ("imc4", &b"isel IMC4 (virtual)\r\nVersion 2.00\r\n0"[..]),
            ("imc4-m", b"isel IMC4-M\r\n0"),
            ("imc-s8", b"0isel iMC-S8 (virtual) V1.00\r\n"),
            ("imc-m", b"0isel iMC-M V2\r\n"),
        ] {
            assert!(matches!(of_version(&model(name), text), Identity::Same(_)), "{name}");
        }
        let mp = Identity::Other { what: "imc-mp".to_owned(), said: "isel iMC-MP".to_owned() };
        assert_eq!(of_version(&model("imc-m"), b"0isel iMC-MP\r\n"), mp);
        assert_eq!(
            of_version(&model("imc4"), b"isel IMC4-MAX\r\n0"),
            Identity::Unknown("isel IMC4-MAX".to_owned())
        );
    }

    #[test]
    fn who_names_nothing_is_unknown() {
        for answer in [&b"0"[..], b"\r\n0", b"0\r\n", b"0 \r\n"] {
            let unknown = Identity::Unknown(String::new());
            assert_eq!(of_version(&model("imc4"), answer), unknown, "{}", answer.escape_ascii());
            assert_eq!(of_owner(&model("imc-s8"), b"0", String::new()), unknown);
        }
        let user = b"0 UserInfo bench 7\r\n";
        assert!(matches!(of_owner(&model("imc4"), user, String::new()), Identity::Other { .. }));
    }

    #[test]
    fn the_owners_text_tells_the_families_apart() {
        let said = || "x".to_owned();
        let user = b"0 UserInfo bench 7\r\n";
        assert_eq!(of_owner(&model("imc-mp"), user, said()), Identity::Same(said()));
        assert_eq!(of_owner(&model("imc4"), b"5", said()), Identity::Unknown(said()));
        assert!(matches!(of_owner(&model("imc4"), user, said()), Identity::Other { .. }));
        assert!(matches!(of_owner(&model("imc-m"), b"5", said()), Identity::Other { .. }));
    }

    #[test]
    fn a_line_that_somebody_has_left_costs_a_question() {
        let mut answers = [&b"5"[..], b"isel IMC4\r\n0"].into_iter();
        let mut ask = |_: Question| answers.next().map(<[u8]>::to_vec).ok_or(());
        let found = identify(&model("imc4"), &mut ask);
        assert_eq!(found, Ok(Identity::Same("isel IMC4".to_owned())));
        let silent = identify(&model("imc4"), &mut |_| Ok::<_, ()>(Vec::new()));
        assert_eq!(silent, Ok(Identity::Silent));
    }
}
