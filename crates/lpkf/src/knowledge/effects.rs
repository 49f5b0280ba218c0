//! What a stream of commands may do.

use vimc4_device::Effects;

use crate::language::{Command, Dialect, Grammar, Item, Reader};

/// What sending these bytes may do.
pub(super) fn of(sent: &[u8]) -> Effects {
    let mut effects = Effects::default();
    let mut passed = Vec::new();
    for dialect in Dialect::ALL {
        // Pairs after a command, also an unknown one, may be taken for moves.
        let mut reader =
            Reader::new(Grammar { bare_pairs: true, unknown_pairs: true, ..dialect.into() });
        passed.clear();
        for byte in sent.iter().chain(b";") {
            reader.feed(*byte, |item| match item {
                Item::Command { command: Ok(command), .. } => add(&mut effects, &command),
                Item::Command { .. } | Item::TooLong => {}
                Item::Through(byte) => passed.push(byte),
            });
        }
    }
    if passed.is_empty() {
        return effects;
    }
    // What is connected there is unknown. And if the channel was not opened after all, or was
    // closed by a loss of power, these bytes are commands.
    effects.outputs = true;
    effects.and(of(&passed))
}

/// Adds the effects of one command. A refused command has none.
fn add(effects: &mut Effects, command: &Command) {
    let head = matches!(command, Command::PenDown | Command::PenUp);
    effects.moves |= head || command.moves();
    effects.reference |= command.seeks_switches();
    effects.outputs |= command.switches_outputs();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effects_follow_from_the_commands() {
        let of = |text: &str| super::of(text.as_bytes());
        assert_eq!(of("!ON0;OS;VS5000;!ST;IN;"), Effects::default());
        assert!(of("PA1,2").moves && of("PU").outputs && of("OH;").reference);
        assert!(of("!PH0,1\rX5\r;").moves && of("!MR1,1,1,1,1,1;").moves);
        assert!(of("!OC;!SV5\r!CC;").outputs && !of("!OC;!CC;").outputs);
        assert!(of("!OC;!SV5\rPA5,5").moves && !of("!OC;!SV5\r").moves);
        assert!(of("!EM1;!ZR5;").outputs && of("!ZR5;").moves);
        assert!(!of("!EM1;!WR1,2;").writes_flash);
    }
}
