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
    let script = Script::stream(bytes, handling).filter(|script| !script.lines.is_empty());
    let Some(script) = script else {
        return Err(Failure::usage(format!(
            "{name} holds no command; a plot file has some such as PA1000,2000;"
        )));
    };
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
        if piece.escape && !is_open {
            let what = format!(
                "the model {} does not know `{}`",
                handling.model().name(),
                escape(&piece.bytes)
            );
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

/// Whether a file begins as plot files do: with two capital letters that are a command of HPGL,
/// or with `!` and two.
pub(super) fn is_plot(bytes: &[u8]) -> bool {
    const BEGINNINGS: [&[u8]; 19] = [
        b"IN", b"PA", b"PR", b"PU", b"PD", b"SP", b"VS", b"OS", b"OH", b"IW", b"IP", b"SC", b"AA",
        b"AR", b"CI", b"LT", b"DF", b"EA", b"ER",
    ];
    let rest = bytes.trim_ascii_start();
    if let [b'!', one, other, ..] = rest {
        return one.is_ascii_uppercase() && other.is_ascii_uppercase();
    }
    let (name, behind) = rest.split_at(rest.len().min(2));
    let ends = match behind.first() {
        // The next command may follow at once, but a longer word is not a command.
        Some(byte) if byte.is_ascii_alphabetic() => {
            BEGINNINGS.iter().any(|next| behind.starts_with(next))
        }
        _ => true,
    };
    BEGINNINGS.contains(&name) && ends
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plot_files_are_told_from_the_others() {
        for plot in ["IN;PA1,2;", "\r\n!CT1;", "PU10,20;", "INPA5,5", "SP1;", "IN", "PA 5 6"] {
            assert!(is_plot(plot.as_bytes()), "{plot}");
        }
        for other in ["IMF_PBL", "INITTOOL", "PATH", "PLANE XY", "@07", "71", "; IN;", "", "REF X"]
        {
            assert!(!is_plot(other.as_bytes()), "{other}");
        }
    }

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
