//! Identifying the controller at a port.

use vimc4_device::{Identity, Question, Until, said};

use crate::Model;

/// A controller that is held by a stop or a status ignores everything else until it is released.
/// The waiting commands are discarded first, so that it continues with none.
const STATUS: Question =
    Question { send: b"!CC;!CI;!CB;!GO;OS;", until: Until::Whole(has_identity) };
/// A controller with a line-based language takes that for the beginning of a line. This ends the
/// line.
const END_OF_LINE: Question = Question { send: b"\r", until: Until::Pause };

/// Asks for version, date and identity.
pub(super) fn identify<E>(
    model: &Model,
    ask: &mut dyn FnMut(Question) -> Result<Vec<u8>, E>,
) -> Result<Identity, E> {
    let said = ask(STATUS)?;
    if !has_identity(&said) {
        ask(END_OF_LINE)?;
    }
    Ok(of_status(model, &said))
}

/// Whether a line of it is the answer to `OS`.
fn has_identity(answer: &[u8]) -> bool {
    let mut lines = answer.split_inclusive(|byte| *byte == b'\r');
    lines.any(|line| line.starts_with(b"S") && line.ends_with(b"\r"))
}

/// The contents of the answer to `OS`: version, date and an identity, which begins with 1 or 2.
fn of_status(model: &Model, answer: &[u8]) -> Identity {
    let said = said(answer);
    let Some(fields) = said.split([' ', '\r']).find_map(|line| line.strip_prefix('S')) else {
        return if answer.is_empty() { Identity::Silent } else { Identity::Unknown(said) };
    };
    let identity = fields.rsplit(',').next().unwrap_or_default();
    // Some write it in hexadecimal.
    let number = match identity.len() {
        6 => identity.parse().ok(),
        _ => u32::from_str_radix(identity, 16).ok(),
    };
    let name = match number.map(|number| number / 100_000) {
        Some(1) => "smcu",
        Some(2) => "motionsystem",
        _ => return Identity::Unknown(said),
    };
    match Model::builtin(name).is_some_and(|named| model.command_set == named.command_set) {
        true => Identity::Same(said),
        false => Identity::Other { what: name.to_owned(), said },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_identity_begins_with_1_or_2() {
        let of = |name, answer| of_status(&Model::builtin(name).unwrap(), answer);
        let smcu = b"S310,10696,100001\rC\r";
        assert!(matches!(of("smcu", smcu), Identity::Same(_)));
        let other =
            Identity::Other { what: "smcu".to_owned(), said: "S310,10696,100001".to_owned() };
        assert_eq!(of("motionsystem", smcu), other);
        assert!(matches!(of("motionsystem", b"S204,1,200001\r"), Identity::Same(_)));
        // 100001 and 200001 in hexadecimal.
        assert!(matches!(of("smcu", b"S136,29C8,186A1\r"), Identity::Same(_)));
        assert!(matches!(of("motionsystem", b"SCC,1,30D41\r"), Identity::Same(_)));
        assert_eq!(of("smcu", b""), Identity::Silent);
        assert_eq!(of("smcu", b"C\r"), Identity::Unknown(String::new()));
        assert!(matches!(of("smcu", b"?\r"), Identity::Unknown(_)));
    }

    #[test]
    fn a_line_that_may_have_been_begun_is_ended() {
        let sent = |answer: &[u8]| {
            let mut sent = Vec::new();
            let mut ask = |question: Question| {
                sent.push(question.send);
                Ok::<_, ()>(answer.to_vec())
            };
            identify(&Model::builtin("smcu").unwrap(), &mut ask).unwrap();
            sent.len()
        };
        assert_eq!(sent(b"S310,10696,100001\rC\r"), 1);
        assert_eq!(sent(b"5"), 2);
    }
}
