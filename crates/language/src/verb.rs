//! The verbs of orders, each with its words and what it does: one table.
//!
//! From it come the orders that people type while a controller runs, their help and their completion,
//! what a schedule or a script does at the panel, and the names of the methods that do the same.

use std::fmt;

use vimc4_device::{Names, Signal};

use crate::Lexer;

/// What people can tell a controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Verb {
    /// Presses a button and releases it at the same instant, unless it latches.
    Press,
    /// Presses a button and keeps it pressed.
    Hold,
    /// Releases what is held.
    Release,
    /// Puts a switch into a position. Its word is the name of the switch.
    Turn,
    /// Sets a bit of an input port.
    Input,
    /// Sets any signal.
    Set,
    /// Erases the stored program as a person does at the panel.
    Erase,
    /// The mains switch.
    Power,
    /// Something goes wrong, or does no more.
    Fault,
    /// Something is done whenever something happens or becomes so.
    When,
    /// Something is done as long as something is so.
    While,
    /// Something is done after a time.
    At,
    /// Something is done again and again.
    Every,
    /// A rule with a name, or so often; or rules end.
    Rule,
    /// Rules and faults end.
    Reset,
    /// Moves time forward by a span.
    Advance,
    /// Lets time pass until a condition holds.
    RunUntil,
    /// Gives up pending advances of time.
    Cancel,
    /// Says where the axes are.
    Position,
    /// Says what can be set.
    Signals,
    /// Says what is wrong.
    Faults,
    /// Says which rules there are.
    Rules,
    /// Says what can be told.
    Help,
    /// Says what can follow what has been typed.
    Complete,
    /// Ends.
    Quit,
}

/// What a verb is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Sort {
    /// Something is done to the device.
    Deed,
    /// Time passes.
    Time,
    /// Something about the device is asked.
    Question,
    /// It belongs to the place where it is typed.
    Prompt,
}

/// A form that a verb is typed in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Form {
    /// What follows its name: words in capitals stand for something, others for themselves.
    pub arguments: &'static str,
    /// What it does, as a help text has it.
    pub about: &'static str,
    /// The method of the library that does the same, if there is one.
    pub method: Option<&'static str>,
}

/// A row of the table.
pub(crate) struct Row {
    pub(crate) verb: Verb,
    sort: Sort,
    /// What is typed first.
    name: &'static str,
    forms: &'static [Form],
}

/// What is done by a method, too.
const fn form(arguments: &'static str, method: &'static str, about: &'static str) -> Form {
    Form { arguments, about, method: Some(method) }
}

/// What is only typed.
const fn typed(arguments: &'static str, about: &'static str) -> Form {
    Form { arguments, about, method: None }
}

/// In the order of the help.
pub(crate) const TABLE: [Row; 25] = [
    Row {
        verb: Verb::Press,
        sort: Sort::Deed,
        name: "press",
        forms: &[form("BUTTON", "press", "press and release at once")],
    },
    Row {
        verb: Verb::Hold,
        sort: Sort::Deed,
        name: "hold",
        forms: &[form("BUTTON", "hold", "press and keep pressed")],
    },
    Row {
        verb: Verb::Release,
        sort: Sort::Deed,
        name: "release",
        forms: &[form("BUTTON", "release", "release what is held")],
    },
    Row {
        verb: Verb::Turn,
        sort: Sort::Deed,
        name: "SWITCH",
        forms: &[form("POSITION", "turn", "put a switch into a position")],
    },
    Row {
        verb: Verb::Input,
        sort: Sort::Deed,
        name: "input",
        forms: &[form("PORT.BIT 0|1", "input", "set a bit of an input port")],
    },
    Row {
        verb: Verb::Set,
        sort: Sort::Deed,
        name: "set",
        forms: &[form("SIGNAL VALUE", "set_signal", "set any signal; `signals` lists them")],
    },
    Row {
        verb: Verb::Erase,
        sort: Sort::Deed,
        name: "erase",
        forms: &[form("", "erase", "erase the stored program, as a person does at the panel")],
    },
    Row {
        verb: Verb::Power,
        sort: Sort::Deed,
        name: "power",
        forms: &[form("off|on", "power", "the mains switch")],
    },
    Row {
        verb: Verb::Fault,
        sort: Sort::Deed,
        name: "fault",
        forms: &[
            form(
                "FAULT",
                "fault",
                "something goes wrong, as in `fault drop to-host once`, `fault cut both for 200ms`; \
                 `help fault` has all",
            ),
            form("end NUMBER|all", "end_fault", "a fault ends, or all do"),
        ],
    },
    Row {
        verb: Verb::When,
        sort: Sort::Deed,
        name: "when",
        forms: &[form(
            "CONDITION: ORDER",
            "scenario",
            "do something whenever something happens or becomes so, as in \
             `when answer error: press stop`; `help when` has all",
        )],
    },
    Row {
        verb: Verb::While,
        sort: Sort::Deed,
        name: "while",
        forms: &[form("CONDITION: ORDER", "scenario", "the same as long as something is so")],
    },
    Row {
        verb: Verb::At,
        sort: Sort::Deed,
        name: "at",
        forms: &[form(
            "TIME: ORDER",
            "scenario",
            "the same after a time, as in `at 2s: power off for 100ms`",
        )],
    },
    Row {
        verb: Verb::Every,
        sort: Sort::Deed,
        name: "every",
        forms: &[form("TIME: ORDER", "scenario", "the same again and again")],
    },
    Row {
        verb: Verb::Rule,
        sort: Sort::Deed,
        name: "rule",
        forms: &[
            form("NAME [once] …", "scenario", "the same with a name, or so often"),
            form("end NUMBER|all", "end_scenario", "rules end, and what they hold is set back"),
        ],
    },
    Row {
        verb: Verb::Reset,
        sort: Sort::Deed,
        name: "reset",
        forms: &[form("", "reset", "all rules and all faults end")],
    },
    Row {
        verb: Verb::Advance,
        sort: Sort::Time,
        name: "advance",
        forms: &[form(
            "TIME",
            "advance",
            "move time forward, as in `advance 250ms` (manual or instant clock)",
        )],
    },
    Row {
        verb: Verb::RunUntil,
        sort: Sort::Time,
        name: "run until",
        forms: &[
            form("idle", "run_until_idle", "let time pass until nothing moves"),
            form(
                "AXIS STEPS",
                "run_until",
                "let time pass until the axis is there, as in `run until x 2500`",
            ),
            form(
                "CONDITION",
                "run_until",
                "let time pass until a condition holds: z < -5000, port 2 bit 0 on, limit x+, \
                 command @A, answer error 2, line 12; several are joined by and, or",
            ),
        ],
    },
    Row {
        verb: Verb::Cancel,
        sort: Sort::Prompt,
        name: "cancel",
        forms: &[form("", "cancel_all", "give up every `advance` and `run until` so far")],
    },
    Row {
        verb: Verb::Position,
        sort: Sort::Question,
        name: "position",
        forms: &[form("", "position", "where the axes are")],
    },
    Row {
        verb: Verb::Signals,
        sort: Sort::Question,
        name: "signals",
        forms: &[form("", "signals", "what can be pressed, turned and set")],
    },
    Row {
        verb: Verb::Faults,
        sort: Sort::Question,
        name: "faults",
        forms: &[form("", "faults", "the faults there are, and how often each has struck")],
    },
    Row {
        verb: Verb::Rules,
        sort: Sort::Question,
        name: "rules",
        forms: &[form("", "rules", "the rules there are, and how often each has acted")],
    },
    Row {
        verb: Verb::Help,
        sort: Sort::Prompt,
        name: "help",
        forms: &[
            typed("", "this list"),
            typed("ORDER", "all that there is to say of an order, as in `help run until`"),
        ],
    },
    Row {
        verb: Verb::Complete,
        sort: Sort::Prompt,
        name: "LINE",
        forms: &[typed("?", "what can follow, as in `press ?` or `set limit x+ ?`")],
    },
    Row {
        verb: Verb::Quit,
        sort: Sort::Prompt,
        name: "quit",
        forms: &[form(
            "",
            "stop",
            "end, as soon as everything ordered is answered; a second one ends at once",
        )],
    },
];

impl Verb {
    /// All of them, in the order of the help.
    pub fn all() -> impl Iterator<Item = Verb> {
        TABLE.iter().map(|row| row.verb)
    }

    fn row(self) -> &'static Row {
        // A verb missing from the table could not be found; a test makes sure that all are there.
        TABLE.iter().find(|row| row.verb == self).unwrap_or(&TABLE[0])
    }

    /// The word, or the two, that it begins with. [`Turn`](Verb::Turn) begins with the name of a
    /// switch, and [`Complete`](Verb::Complete) with anything.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// What it is about.
    #[must_use]
    pub fn sort(self) -> Sort {
        self.row().sort
    }

    /// The forms that it is typed in, at least one.
    #[must_use]
    pub fn forms(self) -> &'static [Form] {
        self.row().forms
    }

    /// One of its forms, with its name: `run until AXIS STEPS`.
    #[must_use]
    pub fn typed(self, form: &Form) -> String {
        match (self, form.arguments) {
            (_, "") => self.name().to_owned(),
            (Verb::Complete, arguments) => format!("{}{arguments}", self.name()),
            (_, arguments) => format!("{} {arguments}", self.name()),
        }
    }

    /// Reads the verb that is next. Those that have no name of their own are not found.
    pub(crate) fn read(lexer: &mut Lexer<'_>) -> Option<Verb> {
        TABLE.iter().filter(|row| row.verb.is_named()).find_map(|row| {
            let mut rest = *lexer;
            row.name.split(' ').all(|word| rest.chunk() == Some(word)).then(|| {
                *lexer = rest;
                row.verb
            })
        })
    }

    /// Whether a device with these names has what the verb is about: no erasing where the panel cannot
    /// erase, no switches where there are none.
    #[must_use]
    pub fn is_of(self, names: &Names) -> bool {
        let any = |fits: fn(&Signal) -> bool| names.signals().iter().any(fits);
        match self {
            Verb::Press | Verb::Hold | Verb::Release => any(Signal::can_be_pressed),
            Verb::Turn => any(|signal| signal.positions.is_some()),
            Verb::Input => any(|signal| !signal.bits.is_empty()),
            Verb::Set | Verb::Signals => !names.signals().is_empty(),
            Verb::Erase => names.can_erase(),
            _ => true,
        }
    }

    /// Whether it begins or ends rules.
    pub(crate) fn is_of_rules(self) -> bool {
        matches!(self, Verb::When | Verb::While | Verb::At | Verb::Every | Verb::Rule)
    }

    /// Whether it has a name of its own.
    pub(crate) fn is_named(self) -> bool {
        !matches!(self, Verb::Turn | Verb::Complete)
    }
}

impl fmt::Display for Verb {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The column in which what is said about an order begins.
const COLUMN: usize = 22;

/// An order and what it is about, as a line.
pub(crate) fn row(order: &str, about: &str) -> String {
    // Even a long order is separated by blanks from its description.
    let gap = if order.trim_end().len() < COLUMN { "" } else { "  " };
    format!("{order:<COLUMN$}{gap}{about}").trim_end().to_owned()
}
