//! Whether a file is a job or a plot, by how it begins, and which models take it.

use vimc4_catalogue::{Family, Handling, Model, model, models};
use vimc4_ncp::language;

/// Whether the first line that says something begins with the name of a command of job files.
#[must_use]
pub fn is_job(bytes: &[u8]) -> bool {
    let text = language::decode(bytes);
    let mut names = language::lines(&text).filter_map(|line| {
        let line = line.text.trim_start_matches([' ', '\t']);
        // The number of a line says nothing.
        let behind = line.strip_prefix(['N', 'n']).map(|rest| {
            rest.trim_start().trim_start_matches(|c: char| c.is_ascii_digit()).trim_start()
        });
        let word = |text: &str| {
            let end = text.find(|c: char| !c.is_ascii_alphabetic() && c != '_');
            text[..end.unwrap_or(text.len())].to_owned()
        };
        let says_nothing = line.is_empty() || line.starts_with([';', '#', '(']);
        (!says_nothing).then(|| (word(line), behind.map(word)))
    });
    let known = |name: &str| language::reference::find(name).is_some();
    names.next().is_some_and(|(name, behind)| known(&name) || behind.is_some_and(|it| known(&it)))
}

/// Whether a file begins as plot files do: with two capital letters that are a command of HPGL,
/// with `!` and two, or with an escape sequence for the plotter.
#[must_use]
pub fn is_plot(bytes: &[u8]) -> bool {
    const BEGINNINGS: [&[u8]; 19] = [
        b"IN", b"PA", b"PR", b"PU", b"PD", b"SP", b"VS", b"OS", b"OH", b"IW", b"IP", b"SC", b"AA",
        b"AR", b"CI", b"LT", b"DF", b"EA", b"ER",
    ];
    let rest = bytes.trim_ascii_start();
    if rest.starts_with(b"\x1B.") {
        return true;
    }
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

/// Why this model takes no jobs, and which take them.
pub(crate) fn no_jobs(model: &Model) -> String {
    format!(
        "the {} does not speak isel's @-format; choose one of {}",
        model.name(),
        Family::Isel.models().join(", ")
    )
}

/// Why this model takes no plots, and which take them.
pub(crate) fn no_plots(own: &Model) -> String {
    let takes = |name: &&str| model(name).is_ok_and(|model| Handling::of(&model).takes_stream);
    let others: Vec<&str> = models().into_iter().filter(takes).collect();
    format!("the {} speaks isel's @-format; choose one of {}", own.name(), others.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Script;

    #[test]
    fn plot_files_are_told_from_the_others() {
        for plot in
            ["IN;PA1,2;", "\r\n!CT1;", "PU10,20;", "INPA5,5", "SP1;", "IN", "PA 5 6", "\x1B.(;IN;"]
        {
            assert!(is_plot(plot.as_bytes()), "{plot}");
        }
        for other in ["IMF_PBL", "INITTOOL", "PATH", "PLANE XY", "@07", "71", "; IN;", "", "REF X"]
        {
            assert!(!is_plot(other.as_bytes()), "{other}");
        }
    }

    #[test]
    fn what_is_for_other_controllers_is_refused_with_their_names() {
        let refused = |name: &str, file: &str, on: &str| {
            let handling = Handling::of(&model(on).expect("a built-in model"));
            Script::of(name, file.as_bytes(), &handling).expect_err("it is for another controller")
        };
        assert_eq!(
            refused("board.plt", "IN;PA1,2;", "imc4"),
            "board.plt is a plot file, and the imc4 speaks isel's @-format; choose one of smcu, motionsystem"
        );
        assert_eq!(
            refused("plate.ncp", "IMF_PBL_V1.0\nN1 MOVEABS X1;", "smcu"),
            "plate.ncp is a job file, and the smcu does not speak isel's @-format; choose one of imc4, \
             imc4-m, imc-m, imc-mp, imc-s8, c142"
        );
    }
}
