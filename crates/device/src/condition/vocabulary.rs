//! What can happen at a device, as conditions name it.

/// What can happen at the devices of a model. It tells a mistyped word from something that may
/// still come.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Vocabulary {
    /// The mnemonics of its commands, as events have them: `@A`, `PA`, `!IS/1`.
    pub commands: Vec<String>,
    /// Further beginnings of command lines: `@a`.
    pub spellings: Vec<String>,
    /// The answers that are errors, without their end: `2`, `E09`.
    pub errors: Vec<String>,
    /// The ports that it has.
    pub ports: Vec<u16>,
    /// Whether it stores programs.
    pub stores: bool,
}

/// How many words of a longer list are shown.
const SHOWN: usize = 24;

impl Vocabulary {
    /// Whether the line of a command can begin so, or a command has this mnemonic. A number after
    /// the sign that begins a line, as in `@0A`, is the number of the device.
    #[must_use]
    pub fn has_command(&self, like: &str) -> bool {
        let mut rest: String = like.chars().filter(|c| !c.is_whitespace()).collect();
        if let Some(line) = rest.strip_prefix('@') {
            rest = format!("@{}", line.trim_start_matches(|c: char| c.is_ascii_digit()));
        }
        // Numbers follow a mnemonic; another letter makes it another command.
        let is_of = |known: &String| {
            let behind = rest.strip_prefix(letters(known));
            behind.is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_alphabetic()))
        };
        let begins = |known: &String| known.starts_with(&rest) || is_of(known);
        like == UNKNOWN || self.commands.iter().chain(&self.spellings).any(begins)
    }

    /// Whether a command has this mnemonic.
    #[must_use]
    pub fn has_mnemonic(&self, like: &str) -> bool {
        like == UNKNOWN || self.commands.iter().any(|known| is_mnemonic(known, like))
    }

    /// Whether an answer is this error, or one with this code.
    #[must_use]
    pub fn has_error(&self, code: &str) -> bool {
        self.errors.iter().any(|known| is_error(known.as_bytes(), code.as_bytes()))
    }

    /// The mnemonics, for people.
    #[must_use]
    pub fn commands_in_words(&self) -> String {
        in_words(&self.commands)
    }

    /// The errors, for people.
    #[must_use]
    pub fn errors_in_words(&self) -> String {
        in_words(&self.errors)
    }

    /// The ports, for people.
    #[must_use]
    pub fn ports_in_words(&self) -> String {
        let ports: Vec<String> = self.ports.iter().map(u16::to_string).collect();
        if ports.is_empty() { "none".to_owned() } else { in_words(&ports) }
    }
}

/// The mnemonic of a line that no command matches.
const UNKNOWN: &str = "?";

/// A mnemonic without the suffix for the form of the command.
fn letters(mnemonic: &str) -> &str {
    mnemonic.split_once('/').map_or(mnemonic, |(letters, _)| letters)
}

/// Whether a mnemonic is this one, or this and the number of its form.
///
/// ```
/// use vimc4_device::is_mnemonic;
///
/// assert!(is_mnemonic("!IS/1", "!IS") && is_mnemonic("!IS/1", "!IS/1"));
/// assert!(!is_mnemonic("!IS/1", "!IS/0"));
/// ```
#[must_use]
pub fn is_mnemonic(mnemonic: &str, wanted: &str) -> bool {
    mnemonic == wanted || letters(mnemonic) == wanted
}

fn in_words(list: &[String]) -> String {
    match list {
        [first @ .., last] if list.len() > SHOWN => {
            format!("{} … {last}", first.iter().take(SHOWN).cloned().collect::<Vec<_>>().join(", "))
        }
        list => list.join(", "),
    }
}

/// Whether an answer is this text, or has this code after its letter, ignoring leading zeros: `E09`
/// matches `E09`, `09` and `9`.
pub(super) fn is_error(answer: &[u8], code: &[u8]) -> bool {
    let number = |code: &[u8]| {
        let zeros = code.iter().take_while(|byte| **byte == b'0').count();
        code.get(zeros.min(code.len().saturating_sub(1))..).unwrap_or_default().to_vec()
    };
    let behind = answer.get(1..).unwrap_or_default();
    answer == code
        || !behind.is_empty()
            && !code.is_empty()
            && number(behind).eq_ignore_ascii_case(&number(code))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn a_command_is_known_by_its_beginning() {
        let isel = Vocabulary {
            commands: words("@axes @A @ID 0 m"),
            spellings: words("@a"),
            ..Vocabulary::default()
        };
        for like in
            ["@A", "@0A", "@0A5000,900", "@0 A 5", "@", "@07", "@I", "@0ID5", "@0a", "0300", "?"]
        {
            assert!(isel.has_command(like), "{like}");
        }
        for like in ["@Z", "@0Z", "A", "a", "M", "PA"] {
            assert!(!isel.has_command(like), "{like}");
        }
        assert!(is_mnemonic("!IS/1", "!IS") && is_mnemonic("!IS/1", "!IS/1"));
        assert!(!is_mnemonic("!IS/1", "!IS/0") && !is_mnemonic("!IS/1", "!I"));
        assert!(isel.has_mnemonic("@A") && isel.has_mnemonic("?") && !isel.has_mnemonic("@0A"));
        let lpkf = Vocabulary { commands: words("PA !IS/0 !IS/1"), ..Vocabulary::default() };
        for like in ["PA", "PA5,5", "P", "!", "!IS", "!IS5", "!IS/1"] {
            assert!(lpkf.has_command(like), "{like}");
        }
        for like in ["PB", "pa", "!XX", "@A"] {
            assert!(!lpkf.has_command(like), "{like}");
        }
    }

    #[test]
    fn an_error_is_known_by_its_number() {
        for code in ["E09", "09", "9"] {
            assert!(is_error(b"E09", code.as_bytes()), "{code}");
        }
        for code in ["", "0", "90", "E9", "e09", "19"] {
            assert!(!is_error(b"E09", code.as_bytes()), "{code}");
        }
        assert!(is_error(b"E0A", b"a") && is_error(b"E00", b"0") && is_error(b"E138", b"138"));
        assert!(is_error(b"2", b"2") && !is_error(b"2", b"02") && !is_error(b"2", b""));
        assert!(is_error(b"F", b"F") && !is_error(b"F", b"f"));
    }

    #[test]
    fn a_long_list_is_cut() {
        let many: Vec<String> = (0..50).map(|number| number.to_string()).collect();
        assert!(in_words(&many).ends_with("22, 23 … 49"), "{}", in_words(&many));
        assert_eq!(in_words(&words("1 2")), "1, 2");
    }
}
