//! Whether a file is a job or a plot, by how it begins, and which models take it.

use vimc4_catalogue::{Family, Handling, Model, model, models};
use vimc4_ncp::language;

/// Whether the first line that says something begins with the name of a command of job files.
#[must_use]
pub fn is_job(bytes: &[u8]) -> bool {
    let text = language::decode(bytes);
    let known = |text: &str| {
        let end = text.find(|c: char| !c.is_ascii_alphabetic() && c != '_');
        text.get(..end.unwrap_or(text.len()))
            .is_some_and(|it| language::reference::find(it).is_some())
    };
    telling(&text).next().is_some_and(|line| {
        // The number of a line says nothing.
        let behind = line.strip_prefix(['N', 'n']).map(|rest| {
            rest.trim_start().trim_start_matches(|c: char| c.is_ascii_digit()).trim_start()
        });
        known(line) || behind.is_some_and(known)
    })
}

/// Refuses a job for a controller that takes no jobs, and a plot for one that takes no plots.
///
/// # Errors
///
/// What it is, and which models take it, as a sentence.
pub fn suits(name: &str, bytes: &[u8], handling: &Handling) -> Result<(), String> {
    let model = handling.model();
    if handling.takes_stream && is_job(bytes) {
        return Err(format!("{name} is a job file, and {}", no_jobs(model)));
    }
    if !handling.takes_stream && is_plot(bytes) {
        return Err(format!("{name} is a plot file, and {}", no_plots(model)));
    }
    Ok(())
}

/// Whether the first line that says something begins as plot files do: with two capital letters
/// that are a command of HPGL, with `!` and two, or with an escape sequence for the plotter or its printer.
fn is_plot(bytes: &[u8]) -> bool {
    const BEGINNINGS: [&str; 19] = [
        "IN", "PA", "PR", "PU", "PD", "SP", "VS", "OS", "OH", "IW", "IP", "SC", "AA", "AR", "CI",
        "LT", "DF", "EA", "ER",
    ];
    let text = language::decode(bytes);
    // To a plotter a semicolon is an end: what is a comment from there on may be all of a plot.
    let first = telling(&text).next().or_else(|| begun(&text).strip_prefix(';'));
    let first = first.unwrap_or_default();
    if first.starts_with('\x1B') {
        return true;
    }
    if let [b'!', one, other, ..] = first.as_bytes() {
        return one.is_ascii_uppercase() && other.is_ascii_uppercase();
    }
    BEGINNINGS.iter().filter_map(|name| first.strip_prefix(name)).any(|behind| {
        // The next command may follow at once, but a longer word is not a command.
        !behind.starts_with(|c: char| c.is_ascii_alphabetic())
            || BEGINNINGS.iter().any(|next| behind.starts_with(next))
    })
}

/// The lines that say something, each from where it does. Comments do not, whichever kind of file
/// they are of.
fn telling(text: &str) -> impl Iterator<Item = &str> {
    let lines = language::lines(text).map(|line| begun(line.text));
    lines.filter(|line| !line.is_empty() && !line.starts_with([';', '#', '(']))
}

/// A text from its first character that no reader passes over: blanks and controls begin no command,
/// and NULs fill plots up; but ESC is for the plotter.
fn begun(text: &str) -> &str {
    text.trim_start_matches(|c: char| c == ' ' || c.is_ascii_control() && c != '\x1B')
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
fn no_plots(own: &Model) -> String {
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
        for plot in [
            "IN;PA1,2;",
            "\r\n!CT1;",
            "PU10,20;",
            "INPA5,5",
            "SP1;",
            "IN",
            "PA 5 6",
            "\x1B.(;IN;",
            "\x1BE\x1B%0BIN;PA1,2;",
            // What stands before the first command of a plot.
            "\u{FEFF}IN;PA1,2;",
            "\u{FEFF}; a board\r\nIN;PA1,2;",
            "# a board\n\n \t; of 1999\nIN;",
            "(a board)\rPU;",
            ";IN;PA1,2;",
            "\0\0\nIN;",
        ] {
            assert!(is_plot(plot.as_bytes()), "{plot:?}");
        }
        assert!(is_plot(b"; Gr\xFC\xDFe\nIN;"));
        for other in [
            "IMF_PBL",
            "INITTOOL",
            "PATH",
            "PLANE XY",
            "@07",
            "71",
            "; IN;",
            "",
            "REF X",
            ";IN;\n@07",
            "; IN;\n71\n9",
            "# PA1,2;\nIMF_PBL\nREF X",
            ";PA\n0 100,500\n9",
            "\u{FEFF}@07",
            "\u{FEFF}",
        ] {
            assert!(!is_plot(other.as_bytes()), "{other:?}");
        }
    }

    #[test]
    fn what_is_for_other_controllers_is_refused_with_their_names() {
        let refused = |name: &str, file: &str, on: &str| {
            let handling = Handling::of(&model(on).expect("a built-in model"));
            Script::of(name, file.as_bytes(), &handling).expect_err("it is for another controller")
        };
        for plot in ["IN;PA1,2;", "\u{FEFF}; a board\nIN;PA1,2;"] {
            assert_eq!(
                refused("board.plt", plot, "imc4"),
                "board.plt is a plot file, and the imc4 speaks isel's @-format; choose one of smcu, motionsystem"
            );
        }
        assert_eq!(
            refused("plate.ncp", "IMF_PBL_V1.0\nN1 MOVEABS X1;", "smcu"),
            "plate.ncp is a job file, and the smcu does not speak isel's @-format; choose one of imc4, \
             imc4-m, imc-m, imc-mp, imc-s8, c142"
        );
    }
}
