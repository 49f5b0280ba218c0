//! Who the controller at the port is. Asking moves nothing.

use vimc4_catalogue::{Family, Handling, Model};
use vimc4_device::escape;

use super::wire::Wire;
use crate::port::PortError;

/// What a controller says of itself, held against the model that a job is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Identity {
    /// It is that model, or at least has its commands.
    Same(String),
    /// What it says names no model that is known here.
    Unknown(String),
    /// It is another.
    Other {
        /// What it is.
        what: String,
        /// How it has said so.
        said: String,
    },
    /// It is none that such a job could be for.
    Foreign {
        /// What it is.
        what: &'static str,
        /// How it has said so.
        said: String,
    },
    /// It says nothing.
    Silent,
}

/// Asks the controller.
pub(super) fn identify(link: &mut Wire, handling: &Handling) -> Result<Identity, PortError> {
    match handling.model() {
        Model::Lpkf(_) => {
            // One that a stop or a status holds hears nothing else before it is let go; what was
            // to come is taken away first, so that it goes on with nothing.
            let said = link.ask("!CC;!CI;!CB;!GO;OS", Some(has_identity))?;
            let identity = of_lpkf(handling.model(), &said);
            // One of isel's takes it for the beginning of a line, and the next question for its end.
            if !has_identity(&said) {
                link.end_line()?;
            }
            Ok(identity)
        }
        _ => {
            let mut version = link.ask("@0V", None)?;
            // What somebody has left on the line is refused together with the first question.
            if matches!(version.as_slice(), [b'1'..=b'9']) {
                version = link.ask("@0V", None)?;
            }
            if version.is_empty() {
                return Ok(Identity::Silent);
            }
            if is_status_of_lpkf(&version) {
                let what = "an LPKF controller";
                return Ok(Identity::Foreign { what, said: shown(&version) });
            }
            match of_version(handling.model(), &version) {
                // A controller of the later family has a text of its owner.
                Identity::Unknown(said) => {
                    let user = link.ask("@0U", None)?;
                    Ok(of_user_text(handling.model(), &user, said))
                }
                known => Ok(known),
            }
        }
    }
}

impl Identity {
    /// Whether it says of itself that it is no machine.
    pub(super) fn is_virtual(&self) -> bool {
        match self {
            Identity::Same(said)
            | Identity::Unknown(said)
            | Identity::Other { said, .. }
            | Identity::Foreign { said, .. } => said.contains("(virtual)"),
            Identity::Silent => false,
        }
    }
}

/// Whether all of it is what one of LPKF's says to what it does not know: lines with `E` and a
/// number, or with `C` alone.
fn is_status_of_lpkf(answer: &[u8]) -> bool {
    let Some(lines) = answer.strip_suffix(b"\r") else { return false };
    let is_status = |line: &[u8]| {
        line == b"C"
            || line.strip_prefix(b"E").is_some_and(|number| {
                matches!(number.len(), 1..=4) && number.iter().all(u8::is_ascii_hexdigit)
            })
    };
    lines.split(|byte| *byte == b'\r').all(is_status)
}

/// What the text of `V` says: the name of a model, as a word of it.
fn of_version(model: &Model, answer: &[u8]) -> Identity {
    let said = shown(answer);
    let words: Vec<String> = said
        .to_ascii_lowercase()
        .split(|c: char| !c.is_ascii_alphanumeric() && c != '-')
        .map(str::to_owned)
        .collect();
    let named = |name: &&&str| words.iter().any(|word| word == *name);
    let names = Family::Isel.models();
    match names.iter().find(named) {
        None => Identity::Unknown(said),
        Some(name) if is_like(model, name) => Identity::Same(said),
        Some(name) => Identity::Other { what: (*name).to_owned(), said },
    }
}

/// Whether a model is the built-in one of that name; one from a file must only have its commands.
fn is_like(model: &Model, name: &str) -> bool {
    let is_builtin = model.family().models().contains(&model.name());
    if is_builtin { model.name() == name } else { has_commands_of(model, name) }
}

/// Whether a model has the commands of the built-in one of that name.
pub(super) fn has_commands_of(model: &Model, name: &str) -> bool {
    match (model, vimc4::model(name)) {
        (Model::Isel(own), Ok(Model::Isel(named))) => own.command_set == named.command_set,
        (Model::Lpkf(own), Ok(Model::Lpkf(named))) => own.command_set == named.command_set,
        _ => false,
    }
}

/// What the answer to `U` says: only the later family has a text of its owner.
fn of_user_text(model: &Model, answer: &[u8], said: String) -> Identity {
    let is_later = shown(answer).contains("UserInfo");
    let wants_later = has_commands_of(model, "imc-s8");
    match (is_later, wants_later) {
        (true, true) => Identity::Same(said),
        (false, false) => Identity::Unknown(said),
        (true, false) => Identity::Other { what: "an imc-m, imc-mp or imc-s8".to_owned(), said },
        // One that does not name itself may lack that text too.
        (false, true) if said.is_empty() => Identity::Unknown(said),
        (false, true) => Identity::Other { what: "an imc4 or imc4-m".to_owned(), said },
    }
}

/// Whether a line of it is the answer to `OS`.
fn has_identity(answer: &[u8]) -> bool {
    let mut lines = answer.split_inclusive(|byte| *byte == b'\r');
    lines.any(|line| line.starts_with(b"S") && line.ends_with(b"\r"))
}

/// What the answer to `OS` says: version, date and an identity, which begins with 1 or 2.
fn of_lpkf(model: &Model, answer: &[u8]) -> Identity {
    let said = shown(answer);
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
    match has_commands_of(model, name) {
        true => Identity::Same(said),
        false => Identity::Other { what: name.to_owned(), said },
    }
}

/// What a controller says of itself, for people: a clause.
pub(super) fn says(said: &str) -> String {
    match said.is_empty() {
        true => "it answers without naming itself".to_owned(),
        false => format!("it says `{said}`"),
    }
}

/// So many characters are shown of what a controller says of itself.
const SHOWN: usize = 120;

/// An answer in one line, without the codes and line ends around it, and no longer than a line.
pub(super) fn shown(answer: &[u8]) -> String {
    let text = answer.split(|byte| matches!(byte, b'\r' | b'\n'));
    let lines = text.filter(|line| !line.is_empty() && *line != b"0" && *line != b"C");
    let text: Vec<String> = lines.map(|line| escape(line).to_string()).collect();
    let text = text.join(" ");
    let text = text.trim_start_matches('0').trim();
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{} ...", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model(name: &str) -> Model {
        vimc4::model(name).expect("a built-in model")
    }

    fn other(what: &str, said: &str) -> Identity {
        Identity::Other { what: what.to_owned(), said: said.to_owned() }
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
        let mp = b"0isel iMC-MP\r\n";
        assert_eq!(of_version(&model("imc-m"), mp), other("imc-mp", "isel iMC-MP"));
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
            assert_eq!(of_user_text(&model("imc-s8"), b"0", String::new()), unknown);
        }
        assert_eq!(of_lpkf(&model("smcu"), b"C\r"), Identity::Unknown(String::new()));
        let user = b"0 UserInfo bench 7\r\n";
        assert!(matches!(
            of_user_text(&model("imc4"), user, String::new()),
            Identity::Other { .. }
        ));
        assert_eq!(says(""), "it answers without naming itself");
        assert_eq!(says("isel"), "it says `isel`");
    }

    #[test]
    fn a_status_of_lpkf_is_none_of_isel() {
        for status in [&b"E0D\r"[..], b"E13\r", b"C\rE0D\r", b"E0D\rE0D\r"] {
            assert!(is_status_of_lpkf(status));
        }
        for other in [&b"0"[..], b"5", b"E0D", b"isel IMC4\r\n0", b"E\r", b"EMC4\r", b"\r"] {
            assert!(!is_status_of_lpkf(other), "{}", other.escape_ascii());
        }
    }

    #[test]
    fn a_long_text_is_shown_in_part() {
        let said = shown(&[b'x'; 4_000]);
        assert!(said.len() < 200 && said.ends_with(" ..."), "{said}");
    }

    #[test]
    fn the_owners_text_tells_the_families_apart() {
        let said = || "x".to_owned();
        let user = b"0 UserInfo bench 7\r\n";
        assert_eq!(of_user_text(&model("imc-mp"), user, said()), Identity::Same(said()));
        assert_eq!(of_user_text(&model("imc4"), b"5", said()), Identity::Unknown(said()));
        assert!(matches!(of_user_text(&model("imc4"), user, said()), Identity::Other { .. }));
        assert!(matches!(of_user_text(&model("imc-m"), b"5", said()), Identity::Other { .. }));
    }

    #[test]
    fn the_identity_begins_with_1_or_2() {
        let smcu = b"S310,10696,100001\rC\r";
        assert!(matches!(of_lpkf(&model("smcu"), smcu), Identity::Same(_)));
        assert_eq!(of_lpkf(&model("motionsystem"), smcu), other("smcu", "S310,10696,100001"));
        assert!(matches!(of_lpkf(&model("motionsystem"), b"S204,1,200001\r"), Identity::Same(_)));
        // 100001 and 200001 in hexadecimal.
        assert!(matches!(of_lpkf(&model("smcu"), b"S136,29C8,186A1\r"), Identity::Same(_)));
        assert!(matches!(of_lpkf(&model("motionsystem"), b"SCC,1,30D41\r"), Identity::Same(_)));
        assert_eq!(of_lpkf(&model("smcu"), b""), Identity::Silent);
        assert!(matches!(of_lpkf(&model("smcu"), b"?\r"), Identity::Unknown(_)));
    }
}
