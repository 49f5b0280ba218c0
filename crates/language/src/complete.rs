//! Completion of a line that has been begun.

use vimc4_device::{Names, Signal};

use crate::fault::kinds;
use crate::panel::buttons;
use crate::verb::{Verb, row};

/// A way to continue a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Completion {
    /// The line with one more piece: a word, a name, or what of it was missing. If more is to
    /// follow, it ends in a blank.
    pub line: String,
    /// What it is, in a few words.
    pub about: String,
}

/// All ways to continue a line, in the order of the help. None if it is already wrong, or if
/// what follows cannot be listed, such as a time.
///
/// ```
/// use vimc4_device::{Names, Signal, SignalId};
/// use vimc4_language::complete;
///
/// let stop = Signal::button(SignalId(1), "stop", "STOP button");
/// let names = Names::new([], vec![stop]);
/// let lines = |begun| complete(begun, &names).into_iter().map(|way| way.line);
/// assert!(lines("p").eq(["press ", "power ", "position"]));
/// assert!(lines("press ").eq(["press stop"]));
/// assert!(lines("press start").eq([""; 0]));
/// ```
#[must_use]
pub fn complete(begun: &str, names: &Names) -> Vec<Completion> {
    let begun = begun.trim_start();
    let mut ways: Vec<Completion> = Vec::new();
    for (pieces, about) in lines(names) {
        let mut line = String::new();
        for (number, piece) in pieces.iter().enumerate() {
            line.push_str(piece);
            if line.len() > begun.len() || !begun.starts_with(&line) {
                let first = number == 0 && pieces.len() > 1;
                let fits = line.starts_with(begun) && line.len() > begun.len();
                if fits && !ways.iter().any(|way| way.line == line) {
                    let verb = Verb::all().find(|verb| line.trim_end() == verb.name());
                    let about = match verb.filter(|_| first) {
                        Some(verb) => verb.forms()[0].about.to_owned(),
                        None => about.clone(),
                    };
                    ways.push(Completion { line, about });
                }
                break;
            }
        }
    }
    ways
}

/// What can follow a line that has been begun, a line each: [`complete`] as
/// text.
#[must_use]
pub fn completions(begun: &str, names: &Names) -> String {
    let ways = complete(begun, names);
    if ways.is_empty() {
        return format!("nothing that could be listed follows `{}`", begun.trim());
    }
    let lines: Vec<_> = ways.iter().map(|way| row(&way.line, &way.about)).collect();
    lines.join("\n")
}

/// Every order of a verb that can be listed, without the verb: `limit x+ 1` of
/// [`Set`](Verb::Set).
#[must_use]
pub fn orders_of(verb: Verb, names: &Names) -> Vec<Completion> {
    let lines = lines_of(verb, names).into_iter();
    let orders = lines.map(|(pieces, about)| {
        let from = usize::from(verb != Verb::Turn);
        Completion { line: pieces.get(from..).unwrap_or_default().concat(), about }
    });
    orders.collect()
}

/// A line in pieces, with what it is about.
type Line = (Vec<String>, String);

fn line(verb: Verb, pieces: &[&str], about: &str) -> Line {
    let mut line = vec![format!("{verb} ")];
    line.extend(pieces.iter().map(|piece| (*piece).to_owned()));
    (line, about.to_owned())
}

/// Every line that can be listed.
fn lines(names: &Names) -> impl Iterator<Item = Line> {
    Verb::all().filter(|verb| verb.is_of(names)).flat_map(|verb| lines_of(verb, names))
}

/// Those of a verb.
fn lines_of(verb: Verb, names: &Names) -> Vec<Line> {
    const RULES: [(&str, &str); 7] = [
        ("end ", "rules end"),
        ("end all", "all rules end"),
        ("once ", "a rule that acts once"),
        ("when ", "a rule"),
        ("while ", "a rule"),
        ("at ", "a rule"),
        ("every ", "a rule"),
    ];
    let about = verb.forms()[0].about;
    let with = |(piece, about): (&str, &str)| line(verb, &[piece], about);
    let alone = || (vec![verb.name().to_owned()], about.to_owned());
    match verb {
        Verb::Press | Verb::Hold | Verb::Release => {
            let buttons = buttons(names).into_iter();
            buttons.map(|signal| with((&signal.name, &signal.about))).collect()
        }
        Verb::Turn | Verb::Input | Verb::Set => {
            names.signals().iter().flat_map(|signal| lines_of_signal(verb, signal)).collect()
        }
        Verb::Power => {
            [("off", "takes the power away"), ("on", "gives the power back")].map(with).to_vec()
        }
        Verb::Fault => {
            let ends = [("end ", "a fault ends"), ("end all", "all faults end")].map(with);
            kinds().map(|(kind, about)| with((&format!("{kind} "), about))).chain(ends).collect()
        }
        // What happens never lasts.
        Verb::While => {
            let happens = |line: &Line| {
                let begins = ["command", "answer", "line "];
                line.0
                    .get(1)
                    .is_some_and(|words| begins.iter().any(|begin| words.starts_with(begin)))
            };
            let lines = lines_of_conditions(verb, names);
            lines.filter(|line| !happens(line)).collect()
        }
        Verb::When => lines_of_conditions(verb, names).collect(),
        Verb::RunUntil => {
            let idle = std::iter::once(with(("idle", about)));
            idle.chain(lines_of_conditions(verb, names)).collect()
        }
        Verb::At | Verb::Every | Verb::Advance => vec![line(verb, &[], about)],
        Verb::Rule => RULES.map(with).to_vec(),
        Verb::Complete => Vec::new(),
        Verb::Help => {
            let verbs = Verb::all().filter(|verb| verb.is_of(names) && verb.is_named());
            let each = verbs.map(|verb| with((verb.name(), verb.forms()[0].about)));
            std::iter::once(alone()).chain(each).collect()
        }
        _ => vec![alone()],
    }
}

/// The lines that set a signal by a verb.
fn lines_of_signal(verb: Verb, signal: &Signal) -> Vec<Line> {
    let name = format!("{} ", signal.name);
    let about = &signal.about;
    match verb {
        Verb::Turn => {
            let positions = signal.positions.iter().flatten();
            positions
                .map(|position| (vec![name.clone(), position.clone()], about.clone()))
                .collect()
        }
        Verb::Input => {
            let bits = signal.bits.iter().map(|(port, bit)| format!("{port}.{bit} "));
            bits.flat_map(|bit| ["0", "1"].map(|level| line(verb, &[&bit, level], about))).collect()
        }
        _ => {
            let values = listed_values(signal).into_iter();
            values.map(|value| line(verb, &[&name, &value], about)).collect()
        }
    }
}

fn lines_of_conditions(verb: Verb, names: &Names) -> impl Iterator<Item = Line> {
    let conditions = conditions(names).into_iter();
    let conditions = conditions.map(move |(begin, about)| line(verb, &[&begin], about));
    let listed = listed_conditions(names).into_iter();
    conditions.chain(listed.map(move |(begin, word, about)| line(verb, &[begin, &word], about)))
}

/// The values of a signal; of a range, its ends.
fn listed_values(signal: &Signal) -> Vec<String> {
    match &signal.positions {
        Some(positions) => positions.to_vec(),
        None => [signal.values().start(), signal.values().end()].map(i32::to_string).to_vec(),
    }
}

/// How a condition can begin, and what it is then.
fn conditions(names: &Names) -> Vec<(String, &'static str)> {
    let axes = names.shown_axes();
    let mut begins: Vec<_> =
        axes.iter().map(|axis| (format!("{axis} "), "where an axis is, in steps")).collect();
    let limits = axes.iter().flat_map(|axis| ["-", "+"].map(|end| format!("limit {axis}{end}")));
    begins.extend(limits.map(|limit| (limit, "a limit switch is active")));
    let signals = names.signals().iter().map(|signal| format!("signal {} ", signal.name));
    begins.extend(signals.map(|signal| (signal, "a signal has a value, or changes")));
    let others = [
        ("outside ", "an axis is outside of limits"),
        ("port ", "a bit of a port has a level"),
        ("at ", "a time has come"),
        ("command ", "a command begins"),
        ("answered ", "a command is answered"),
        ("answer ", "an answer comes"),
        ("answer error", "an error is answered"),
        ("line ", "a line of the stored program begins"),
    ];
    let known = names.vocabulary();
    let has = |begin: &str| match begin {
        "port " => known.is_none_or(|known| !known.ports.is_empty()),
        "line " => known.is_none_or(|known| known.stores),
        _ => true,
    };
    let others = others.into_iter().filter(|(begin, _)| has(begin));
    begins.extend(others.map(|(begin, about)| (begin.to_owned(), about)));
    begins
}

/// What can follow the beginnings of a condition, where that can be listed.
fn listed_conditions(names: &Names) -> Vec<(&'static str, String, &'static str)> {
    let Some(known) = names.vocabulary() else { return Vec::new() };
    let bits = |port: &u16| {
        let port = *port;
        (0..8).map(move |bit| format!("{port} bit {bit} "))
    };
    let bits: Vec<_> = known.ports.iter().flat_map(bits).collect();
    let listed = [
        ("command ", &known.commands, "a command begins"),
        ("answered ", &known.commands, "a command is answered"),
        ("answer error ", &known.errors, "an error is answered"),
        ("port ", &bits, "a bit of a port has a level"),
    ];
    let lines = listed.into_iter();
    lines
        .flat_map(|(begin, words, about)| {
            words.iter().map(move |word| (begin, word.clone(), about))
        })
        .collect()
}
