//! Whether a file is a job or a plot, by how it begins, and which models take it.

use vimc4_catalogue::{Family, Handling, Model, model, models};
use vimc4_ncp::language;

use crate::escapes::behind;
use crate::packed::packed;

/// Whether the first line that says something begins with the name of a command of job files.
#[must_use]
pub fn is_job(bytes: &[u8]) -> bool {
    let text = language::decode(bytes);
    let known = |text: &str| {
        let end = text.find(|c: char| !c.is_ascii_alphabetic() && c != '_');
        text.get(..end.unwrap_or(text.len()))
            .is_some_and(|it| language::reference::find(it).is_some())
    };
    first(&text).is_some_and(|line| {
        // The number of a line says nothing.
        let behind = line.strip_prefix(['N', 'n']).map(|rest| {
            rest.trim_start().trim_start_matches(|c: char| c.is_ascii_digit()).trim_start()
        });
        known(line) || behind.is_some_and(known)
    })
}

/// Refuses what is certainly no job: what is packed, a command list, and a plot. Anything else may be a job in
/// which something is wrong.
///
/// # Errors
///
/// What it is, and what can be done with it, as a sentence.
pub fn could_be_job(name: &str, bytes: &[u8]) -> Result<(), String> {
    if let Some(packed) = packed(bytes) {
        return Err(format!("{name} is packed with {packed}; unpack it first"));
    }
    let text = language::decode(bytes);
    if first(&text).is_some_and(|line| line.starts_with('@')) {
        return Err(format!("{name} is a command list and no job; `vimc4 run` carries it out"));
    }
    if is_plot(bytes) {
        return Err(format!(
            "{name} is a plot file and no job; `vimc4 run --model smcu` carries it out"
        ));
    }
    Ok(())
}

/// Whether a line is as those of a data field are: a digit or a letter, and numbers behind it.
pub(crate) fn is_stored(line: &str) -> bool {
    let mut characters = line.trim().chars();
    let code = characters.next().is_some_and(|code| code.is_ascii_alphanumeric());
    code && characters.all(|c| c.is_ascii_digit() || " \t,-".contains(c))
}

/// The word that a line begins with, which no line of a command list or a data field does: their codes are
/// one character each. It may be behind the number of a line, as in jobs.
pub(crate) fn word(line: &str) -> Option<&str> {
    let behind = line.strip_prefix(['N', 'n']).map(|rest| rest.trim_start_matches(' '));
    let behind = behind.filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
    let behind =
        behind.map(|rest| rest.trim_start_matches(|c: char| c.is_ascii_digit() || c == ' '));
    let line = behind.unwrap_or(line);
    let end = line.find(|c: char| !c.is_ascii_alphabetic() && c != '_').unwrap_or(line.len());
    line.get(..end).filter(|word| word.len() > 1)
}

/// What files for controllers of isel begin with.
pub(crate) const BEGINNINGS: &str = "a command list begins with a line such as @07, a data field with one \
                                     such as 71, a job with IMF_PBL";

/// Refuses a job and a command list for a controller that takes neither, and a plot for one that takes
/// no plots.
///
/// # Errors
///
/// What it is, and which models take it, as a sentence.
pub fn suits(name: &str, bytes: &[u8], handling: &Handling) -> Result<(), String> {
    let model = handling.model();
    if handling.takes_stream {
        let text = language::decode(bytes);
        let is_list = first(&text).is_some_and(|line| line.starts_with('@'));
        // One of the first lines of a plot may be nothing but numbers, but not all of them.
        let mut lines = said(&text).filter(|line| !is_comment(line.as_bytes())).peekable();
        let what = match is_job(bytes) {
            true => "job file",
            false if is_list => "command list",
            false if lines.peek().is_some() && lines.all(is_stored) => "data field",
            false => return Ok(()),
        };
        return Err(format!("{name} is a {what}, and {}", no_jobs(model)));
    }
    if is_plot(bytes) {
        return Err(format!("{name} is a plot file, and {}", no_plots(model)));
    }
    Ok(())
}

/// Whether the first line that says something begins as plot files do: with two capital letters
/// that are a command of HPGL, or with `!` and two.
pub(crate) fn is_plot(bytes: &[u8]) -> bool {
    const COMMANDS: [&str; 20] = [
        "IN", "PA", "PR", "PU", "PD", "SP", "VS", "OS", "OH", "IW", "IP", "SC", "AA", "AR", "CI",
        "LT", "DF", "EA", "ER", "CO",
    ];
    let text = language::decode(bytes);
    // To a plotter a semicolon is an end: what is a comment from there on may be all of a plot.
    let first = first(&text).or_else(|| said(&text).next()?.strip_prefix(';'));
    let first = first.unwrap_or_default();
    if let [b'!', one, other, ..] = first.as_bytes() {
        return one.is_ascii_uppercase() && other.is_ascii_uppercase();
    }
    COMMANDS.iter().filter_map(|name| first.strip_prefix(name)).any(|behind| {
        // The next command may follow at once, but a longer word is not a command.
        !behind.starts_with(|c: char| c.is_ascii_alphabetic())
            || COMMANDS.iter().any(|next| behind.starts_with(next))
    })
}

/// The first line that says something to a controller, from where it does. Comments do not, whichever
/// kind of file they are of.
pub(crate) fn first(text: &str) -> Option<&str> {
    said(text).find(|line| !is_comment(line.as_bytes()))
}

/// Whether a line is a comment, to one reader of files or another.
pub(crate) fn is_comment(line: &[u8]) -> bool {
    line.starts_with(b";") || line.starts_with(b"#") || line.starts_with(b"(")
}

/// The lines that are not blank, each from where it begins, without the escape sequences and the lines
/// of PJL that are for a printer around it.
fn said(text: &str) -> impl Iterator<Item = &str> {
    let lines = language::lines(text).map(|line| behind(line.text));
    let is_pjl = |line: &str| {
        let name = line.get(..4).is_some_and(|name| name.eq_ignore_ascii_case("@PJL"));
        name && !line.get(4..).is_some_and(|it| it.starts_with(|c: char| c.is_ascii_alphanumeric()))
    };
    lines.filter(move |line| !line.is_empty() && !is_pjl(line))
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
            "CO \"a board\";IN;PA1,2;",
            // What is for a printer.
            "\x1B%-1BIN;",
            "\x1B.I81;;17:\r\n\x1B.N;19:IN;",
            "\x1B.(;IN;PA1,2;\n3,4;",
            "\x1BE;IN;",
            "\x1BE\x1B&l1o2A\x1B%1B\x0CIN;",
            "\x1B%-12345X@PJL JOB NAME = \"x\"\r\n@PJL ENTER LANGUAGE=HPGL2\r\n\x1BE\x1B%0B\0IN;",
            "@PJL ENTER LANGUAGE=HPGL2\nIN;PU;PA0,0;\n",
            "@pjl\n; a board\n\nIN;",
            "@PJL\n;IN;",
            "\x1B[31mIN;PA1,2;",
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
            "\x1B",
            "\x1BE",
            "\x1B%-12345X",
            "\x1B%-12345X@PJL JOB\n@PJL EOJ\n\x1B%-12345X",
            "\x1BE hello world",
            "\x1B[31mhello\x1B[0m",
            "\x1B%-12345X@PJL ENTER LANGUAGE=POSTSCRIPT\n%!PS-Adobe-3.0\nshowpage",
            "@PJLIN;",
            "@PJL\n@07",
            "in;pu;pa0,0;",
        ] {
            assert!(!is_plot(other.as_bytes()), "{other:?}");
        }
        for before in ["\x1BE", "\x1B%1B", "\x1B.(", "\x1B%-12345X", "\x1B&l1O", "\x1B[31m"] {
            for other in ["@07\nIN;", "71\n9\n", "IMF_PBL_V1.0\nREF X"] {
                assert!(!is_plot(format!("{before}{other}").as_bytes()), "{before:?} {other:?}");
            }
            assert!(is_job(format!("{before}IMF_PBL_V1.0\nREF X").as_bytes()), "{before:?}");
        }
    }

    #[test]
    fn what_is_certainly_no_job_is_told_apart() {
        for (file, what) in [
            (&b"\x1F\x8B\x08"[..], "is packed with gzip"),
            (b"; a list\n@07\n", "is a command list"),
            (b"\xEF\xBB\xBFIN;PA1,2;", "is a plot file"),
        ] {
            let said = could_be_job("x", file).expect_err("it is no job");
            assert!(said.contains(what), "{said}");
        }
        for job in ["IMF_PBL_V1.0\nREF X", "", "movabs", "N1 ; @07", "INITTOOL 1"] {
            assert_eq!(could_be_job("x", job.as_bytes()), Ok(()), "{job:?}");
        }
    }

    #[test]
    fn what_is_nothing_of_all_that_is_refused_with_what_is_meant() {
        let handling = Handling::of(&model("imc-s8").expect("a built-in model"));
        let of = |file: &str| Script::of("typo.txt", file.as_bytes(), &handling);
        for (file, begins, meant) in [
            ("MOVABS X10\nMOVABS X20\n", "MOVABS", "perhaps MOVEABS is meant; "),
            ("N10 movabs X10", "movabs", "perhaps MOVEABS is meant; "),
            ("; of 1999\nhello world", "hello", ""),
        ] {
            assert_eq!(
                of(file).expect_err("it is none"),
                format!(
                    "typo.txt begins with {begins}, which no file for the imc-s8 does; {meant}{BEGINNINGS}"
                )
            );
        }
        for code in "0123567defgjJmnNTwyzop".chars() {
            for line in [
                format!("{code}"),
                format!("{code}5,-5"),
                format!("{code} 5;x"),
                format!("{code}@"),
            ] {
                assert!(of(&format!("{line}\n9\n")).is_ok(), "{line:?}");
            }
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
        let field = "; axes: 7\n71\n0 100,500,-5,500,0,900\ne20\n9\x1A\0\0";
        let refused_field = refused("field.txt", field, "smcu");
        assert!(
            refused_field.starts_with("field.txt is a data field, and the smcu does not speak"),
            "{refused_field}"
        );
        let smcu = Handling::of(&model("smcu").expect("a built-in model"));
        for plot in ["100,200;\nPU;", "71\nIN;PA1,2;", "PA5,5", "; nothing"] {
            assert_eq!(suits("board.plt", plot.as_bytes(), &smcu), Ok(()), "{plot:?}");
        }
        let list = refused("commands.txt", "; a list\n @07\n@0R7", "smcu");
        assert!(
            list.starts_with("commands.txt is a command list, and the smcu does not"),
            "{list}"
        );
    }
}
