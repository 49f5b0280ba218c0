//! Plot files: streams of HPGL commands, sent one by one as every other job.

use vimc4_catalogue::Handling;
use vimc4_device::escape;

use crate::failure::Failure;
use crate::job::perform::{Piece, Work};
use crate::run::report::ESCAPE;
use vimc4_script::Script;

/// The commands of a plot file as they are sent. Those that say whether commands are acknowledged,
/// and whether the stop at the machine counts, are left out: both are needed here.
pub(super) fn work(
    name: &str,
    bytes: &[u8],
    text: &str,
    handling: &Handling,
) -> Result<Work<'static>, Failure> {
    let script = Script::of(name, bytes, handling).map_err(Failure::usage)?;
    // What makes a controller say when a command is completed, and heed the stop at the machine;
    // `IN` ends both.
    let ready = |line| {
        let ready = handling.ready.iter().map(|ready| format!("{ready};").into_bytes());
        ready.map(move |bytes| Piece { line, bytes, is_command: true })
    };
    let mut pieces: Vec<Piece> = ready(0).collect();
    let mut is_open = false;
    for piece in &script.lines {
        let line = piece.number.and_then(|number| u32::try_from(number).ok()).unwrap_or_default();
        let bytes = piece.whole();
        let command = bytes.trim_ascii_start();
        if let Some(sequence) = piece.escape.as_ref().filter(|_| !is_open) {
            let model = handling.model().name();
            let what = format!("the model {model} does not know `{sequence}`");
            return Err(Failure::at_line(
                format!("{what}; {ESCAPE}; nothing was sent"),
                name,
                text,
                line,
            ));
        }
        if !piece.command && !is_open {
            let shown = escape(&piece.bytes);
            let model = handling.model().name();
            let what = match piece.lower_case {
                true => format!(
                    "`{shown}` is in lower-case letters, which are no commands, and the model \
                     {model} ignores it; write PA, not pa"
                ),
                false => format!(
                    "`{shown}` belongs to no command, and the model {model} ignores it; a profile \
                     with bare_pairs = \"repeat\" takes pairs behind PU and PD as moves"
                ),
            };
            return Err(Failure::at_line(what, name, text, line));
        }
        if piece.command && [&b"!CT"[..], b"!ES"].iter().any(|left| command.starts_with(left)) {
            continue;
        }
        if piece.command {
            is_open = command.starts_with(b"!OC") || is_open && !command.starts_with(b"!CC");
        }
        let begins_anew = piece.command && command.starts_with(b"IN");
        pieces.push(Piece { line, is_command: piece.command, bytes });
        if begins_anew {
            is_open = false;
            pieces.extend(ready(line));
        }
    }
    Ok(Work::Plot(pieces.into_iter()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_piece_is_completed() {
        let handling = Handling::of(&vimc4::model("smcu").expect("a built-in model"));
        let text = "!CT0;PA1,2;\nIN;!OC;!SV5\r!CC;!ES0;PD;";
        let work = work("x", text.as_bytes(), text, &handling).expect("a plot");
        let Work::Plot(pieces) = work else { panic!("it is a plot") };
        let shown: Vec<String> =
            pieces.map(|piece| format!("{} {}", piece.line, escape(&piece.bytes))).collect();
        assert_eq!(
            shown,
            [
                "0 !CT1;",
                "0 !ES1;",
                "1 PA1,2;",
                "2 IN;",
                "2 !CT1;",
                "2 !ES1;",
                "2 !OC;",
                "2 !SV5\\r",
                "3 !CC;",
                "3 PD;"
            ]
        );
        for stray in ["IN;\nPD 10,20;", "in;pa10,20;"] {
            assert!(super::work("x", stray.as_bytes(), stray, &handling).is_err(), "{stray}");
        }
    }
}
