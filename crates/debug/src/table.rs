//! The commands of the console: one table, from which help, completion and the manual come. Orders
//! of the panel are in the table of [`Verb`](vimc4_language::Verb)s, and typed as everywhere else.

use std::fmt;

/// What a command of the console is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Going forward and back.
    Going,
    /// Where to stop.
    Breakpoints,
    /// Looking.
    Looking,
    /// Asking why.
    Asking,
    /// Doing something to the controller.
    Doing,
    /// The history itself.
    History,
    /// The console itself.
    Console,
}

impl Group {
    /// All, in the order of the help.
    pub const ALL: [Group; 7] = [
        Group::Going,
        Group::Breakpoints,
        Group::Looking,
        Group::Asking,
        Group::Doing,
        Group::History,
        Group::Console,
    ];
}

impl fmt::Display for Group {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Group::Going => "Forward and back",
            Group::Breakpoints => "Where to stop",
            Group::Looking => "Looking",
            Group::Asking => "Asking",
            Group::Doing => "Doing something to the controller",
            Group::History => "The history",
            Group::Console => "The console",
        })
    }
}

/// What can follow a command, for completion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Follows {
    /// Nothing, or something that cannot be listed.
    Nothing,
    /// What a step is.
    Unit,
    /// A condition.
    Condition,
    /// What a breakpoint waits for.
    Trigger,
    /// A field of what can be seen.
    Field,
    /// The number of a breakpoint.
    Breakpoint,
    /// A place of the history.
    Place,
    /// The name of a bookmark.
    Mark,
    /// The name of a branch.
    Branch,
    /// One of these words.
    Words(&'static [&'static str]),
    /// A command of the console.
    Directive,
}

/// A command of the console.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Directive {
    /// Its name.
    pub name: &'static str,
    /// Its short form, if it has one.
    pub short: Option<&'static str>,
    /// Its arguments, in the usual notation: `[COUNT] [UNIT]`.
    pub arguments: &'static str,
    /// What it does, in one line.
    pub about: &'static str,
    /// Further details, in sentences; may be empty.
    pub more: &'static str,
    /// An example of it.
    pub example: &'static str,
    /// Its group in the help.
    pub group: Group,
    /// What can follow it.
    pub follows: Follows,
}

impl Directive {
    /// The one of a name or short form.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Directive> {
        TABLE.iter().find(|directive| {
            directive.name.eq_ignore_ascii_case(name)
                || directive.short.is_some_and(|short| short.eq_ignore_ascii_case(name))
        })
    }

    /// Whether it goes forward, so that other input for the controller matters.
    #[must_use]
    pub fn goes_forward(&self) -> bool {
        matches!(self.name, "step" | "over" | "out" | "next" | "goto")
    }

    /// How it is typed: `step [COUNT] [UNIT]`.
    #[must_use]
    pub fn usage(&self) -> String {
        match self.arguments {
            "" => self.name.to_owned(),
            arguments => format!("{} {arguments}", self.name),
        }
    }
}

/// What a step can be; a test holds it to [`Unit::NAMED`](crate::Unit::NAMED).
const UNITS: &str = "UNIT is cause, byte, event, command, line, loop, segment or step, or a span of \
    time such as 10ms; by default the one used last.";

/// All commands, in the order of the help.
pub static TABLE: &[Directive] = &[
    // --- going ---
    Directive {
        name: "step",
        short: Some("s"),
        arguments: "[COUNT] [UNIT|over|out]",
        about: "go on by a command, or by a line of a stored program, or by COUNT of a unit",
        more: UNITS,
        example: "step 3 segments",
        group: Group::Going,
        follows: Follows::Unit,
    },
    Directive {
        name: "back",
        short: Some("b"),
        arguments: "[COUNT] [UNIT|over|out]",
        about: "go back by a command, or by COUNT of a unit",
        more: UNITS,
        example: "back 10 steps",
        group: Group::Going,
        follows: Follows::Unit,
    },
    Directive {
        name: "over",
        short: Some("o"),
        arguments: "[COUNT]",
        about: "go on by a line, and over the loops that it opens",
        more: "`back over` does the same backwards.",
        example: "over",
        group: Group::Going,
        follows: Follows::Nothing,
    },
    Directive {
        name: "out",
        short: Some("u"),
        arguments: "",
        about: "go on until the innermost open loop is left or, if none is open, the program or the list of commands",
        more: "`back out` goes back to before it was entered.",
        example: "out",
        group: Group::Going,
        follows: Follows::Nothing,
    },
    Directive {
        name: "continue",
        short: Some("c"),
        arguments: "[TIME]",
        about: "go on to the next breakpoint, or until nothing more happens",
        more: "With a TIME, for so long at most.",
        example: "continue 2s",
        group: Group::Going,
        follows: Follows::Nothing,
    },
    Directive {
        name: "reverse",
        short: Some("r"),
        arguments: "",
        about: "go back to the last breakpoint, or to the beginning",
        more: "",
        example: "reverse",
        group: Group::Going,
        follows: Follows::Nothing,
    },
    Directive {
        name: "next",
        short: Some("n"),
        arguments: "CONDITION",
        about: "go on to where this becomes true",
        more: "It is computed from the motions and not stepped through, so it is found at its exact instant. \
               If it is true already, it is found where it becomes true again. Where it never becomes \
               true nothing has happened.",
        example: "next z < -5000",
        group: Group::Going,
        follows: Follows::Condition,
    },
    Directive {
        name: "last",
        short: Some("l"),
        arguments: "CONDITION",
        about: "go back to where this last became true",
        more: "",
        example: "last answer error 2",
        group: Group::Going,
        follows: Follows::Condition,
    },
    Directive {
        name: "goto",
        short: Some("g"),
        arguments: "PLACE",
        about: "go to a place of the history",
        more: "PLACE is a time such as 1.5s, +10ms or -10ms from here, `command 12`, `line 7` of the \
               file, `difference 1`, `start`, `end`, or the name of a bookmark or branch (to its end). What a file \
               has not sent by then is sent on the way. A time beyond the end leads to where nothing \
               more happens by itself; `step 1s` lets time pass there.",
        example: "goto command 12",
        group: Group::Going,
        follows: Follows::Place,
    },
    // --- breakpoints ---
    Directive {
        name: "break",
        short: Some("br"),
        arguments: "WHAT [if EXPRESSION] [hit N|from N|every N] [log TEXT]",
        about: "stop when this becomes true, forward or back",
        more: "WHAT is a condition such as `command @A`, `z < -5000`, `outside x 0..100000`, `limit \
               x+`, `signal stop changes`, `answer error 2` or `line 12`; an expression such as \
               `x.speed > 900000000` (speeds are in µHz, a millionth of a step per second), evaluated whenever \
               something happens and 32 times in each motion, so that what is true only for \
               a moment may be missed; or `change FIELD`. Hits are counted from the beginning of the history, so `hit 5` is the same place forward and back. With `log` it does not stop but notes TEXT, with the values of expressions in braces.",
        example: "break command @A if x > 1000",
        group: Group::Breakpoints,
        follows: Follows::Trigger,
    },
    Directive {
        name: "breakpoints",
        short: Some("bl"),
        arguments: "",
        about: "list breakpoints, and how often each has come up to here",
        more: "",
        example: "breakpoints",
        group: Group::Breakpoints,
        follows: Follows::Nothing,
    },
    Directive {
        name: "delete",
        short: Some("d"),
        arguments: "NUMBER|all",
        about: "take a breakpoint away",
        more: "",
        example: "delete 2",
        group: Group::Breakpoints,
        follows: Follows::Breakpoint,
    },
    Directive {
        name: "enable",
        short: None,
        arguments: "NUMBER|all",
        about: "use a breakpoint again",
        more: "",
        example: "enable 2",
        group: Group::Breakpoints,
        follows: Follows::Breakpoint,
    },
    Directive {
        name: "disable",
        short: None,
        arguments: "NUMBER|all",
        about: "ignore a breakpoint for now",
        more: "",
        example: "disable 2",
        group: Group::Breakpoints,
        follows: Follows::Breakpoint,
    },
    Directive {
        name: "trace",
        short: Some("t"),
        arguments: "WHAT [if EXPRESSION] [log TEXT]",
        about: "list every time this was true, in all that is recorded",
        more: "WHAT is as for `break`. The present stays where it is.",
        example: "trace command @A log x is {x}",
        group: Group::Breakpoints,
        follows: Follows::Trigger,
    },
    // --- looking ---
    Directive {
        name: "where",
        short: Some("w"),
        arguments: "",
        about: "the present moment, what the controller does, and where the axes are",
        more: "",
        example: "where",
        group: Group::Looking,
        follows: Follows::Nothing,
    },
    Directive {
        name: "print",
        short: Some("p"),
        arguments: "[EXPRESSION]",
        about: "show a value, a group of values, or everything",
        more: "Fields are names with dots between them: `x`, `x.speed`, `signals.stop`, `ports.in0`, \
               `ports.out2`, `details`, `state`. Expressions know + - * / %, < <= = != >= >, and, or, not.",
        example: "print x.speed / 1000000",
        group: Group::Looking,
        follows: Follows::Field,
    },
    Directive {
        name: "watch",
        short: None,
        arguments: "[EXPRESSION]",
        about: "show a value at every stop; without EXPRESSION, show them all",
        more: "",
        example: "watch z.position",
        group: Group::Looking,
        follows: Follows::Field,
    },
    Directive {
        name: "unwatch",
        short: None,
        arguments: "NUMBER",
        about: "watch a value no longer",
        more: "",
        example: "unwatch 1",
        group: Group::Looking,
        follows: Follows::Nothing,
    },
    Directive {
        name: "list",
        short: Some("ls"),
        arguments: "[file|program|commands]",
        about: "show the lines around the present one, with what they mean",
        more: "Those of the file that the commands come from, of the stored program, or the \
               commands as they were executed; without a word, the first of these that exists.",
        example: "list program",
        group: Group::Looking,
        follows: Follows::Words(&["file", "program", "commands"]),
    },
    Directive {
        name: "frames",
        short: Some("f"),
        arguments: "",
        about: "show what is being executed, from inside to outside: line, open loops, command",
        more: "",
        example: "frames",
        group: Group::Looking,
        follows: Follows::Nothing,
    },
    Directive {
        name: "motion",
        short: Some("m"),
        arguments: "",
        about: "show the running motion: steps, speed, ramp, difference register",
        more: "",
        example: "motion",
        group: Group::Looking,
        follows: Follows::Nothing,
    },
    Directive {
        name: "timers",
        short: None,
        arguments: "",
        about: "show what will happen by itself, and when",
        more: "",
        example: "timers",
        group: Group::Looking,
        follows: Follows::Nothing,
    },
    Directive {
        name: "queue",
        short: Some("q"),
        arguments: "",
        about: "show what has been received and waits",
        more: "",
        example: "queue",
        group: Group::Looking,
        follows: Follows::Nothing,
    },
    Directive {
        name: "flash",
        short: None,
        arguments: "",
        about: "show what the flash memory holds",
        more: "",
        example: "flash",
        group: Group::Looking,
        follows: Follows::Nothing,
    },
    Directive {
        name: "digest",
        short: None,
        arguments: "",
        about: "show a number that stands for the whole state: equal states have equal ones",
        more: "It is the same in every face of the debugger, so two of them can be compared.",
        example: "digest",
        group: Group::Looking,
        follows: Follows::Nothing,
    },
    // --- asking ---
    Directive {
        name: "why",
        short: Some("y"),
        arguments: "[answer|error|stop|switch|signal|port|motion|fault|rule]",
        about: "what led to this, back to the byte, the button, the rule or the fault",
        more: "Without a word, it explains what happened last.",
        example: "why answer",
        group: Group::Asking,
        follows: Follows::Words(&[
            "answer", "error", "stop", "switch", "signal", "port", "motion", "fault", "rule",
        ]),
    },
    Directive {
        name: "who",
        short: None,
        arguments: "[changed] FIELD",
        about: "go to where a field was changed last, and say by what",
        more: "",
        example: "who x",
        group: Group::Asking,
        follows: Follows::Field,
    },
    Directive {
        name: "what",
        short: None,
        arguments: "if quirk NAME = VALUE|model NAME|machine NAME|send TEXT|DEED",
        about: "show what would happen if this were so from here on",
        more: "DEED is something done at the panel, such as `press stop`. A branch begins here with this change \
               and gets the same inputs; with another model, machine or quirk it begins \
               before the command that is being executed. It shows where the two first differ and goes \
               there, if they do.",
        example: "what if machine mill",
        group: Group::Asking,
        follows: Follows::Words(&["if"]),
    },
    Directive {
        name: "assert",
        short: None,
        arguments: "CONDITION|EXPRESSION",
        about: "an error unless this is true now: for scripts",
        more: "",
        example: "assert x = 1000 and not z.referenced",
        group: Group::Asking,
        follows: Follows::Field,
    },
    // --- doing ---
    Directive {
        name: "send",
        short: None,
        arguments: "TEXT",
        about: "send a line, with its end; in the past that begins a branch",
        more: "\\r, \\n, \\t, \\\\ and \\xFD stand for bytes. `sendraw` adds no end.",
        example: "send @0A1000,900",
        group: Group::Doing,
        follows: Follows::Nothing,
    },
    Directive {
        name: "sendraw",
        short: None,
        arguments: "TEXT",
        about: "send bytes as they are",
        more: "",
        example: "sendraw \\xFD",
        group: Group::Doing,
        follows: Follows::Nothing,
    },
    Directive {
        name: "put",
        short: None,
        arguments: "FIELD = VALUE",
        about: "put another value into a field of the state; that begins a branch",
        more: "What can be put is the position of an axis and everything in `state`.",
        example: "put x = 500",
        group: Group::Doing,
        follows: Follows::Field,
    },
    // --- history ---
    Directive {
        name: "mark",
        short: Some("k"),
        arguments: "NAME",
        about: "give this moment a name",
        more: "",
        example: "mark before",
        group: Group::History,
        follows: Follows::Mark,
    },
    Directive {
        name: "marks",
        short: None,
        arguments: "",
        about: "list the moments with a name",
        more: "",
        example: "marks",
        group: Group::History,
        follows: Follows::Nothing,
    },
    Directive {
        name: "unmark",
        short: None,
        arguments: "NAME",
        about: "forget a name",
        more: "",
        example: "unmark before",
        group: Group::History,
        follows: Follows::Mark,
    },
    Directive {
        name: "branches",
        short: None,
        arguments: "",
        about: "list the branches, and where each begins",
        more: "",
        example: "branches",
        group: Group::History,
        follows: Follows::Nothing,
    },
    Directive {
        name: "rename",
        short: None,
        arguments: "NAME",
        about: "give the present branch another name",
        more: "",
        example: "rename stopped earlier",
        group: Group::History,
        follows: Follows::Nothing,
    },
    Directive {
        name: "differences",
        short: None,
        arguments: "",
        about: "list where the emulation differs from the recording",
        more: "`goto difference 2` goes to one of them.",
        example: "differences",
        group: Group::History,
        follows: Follows::Nothing,
    },
    Directive {
        name: "replies",
        short: None,
        arguments: "recorded|emulated",
        about: "where the two differ, show the recorded or the emulated replies",
        more: "Emulated replies are shown unless you say otherwise.",
        example: "replies recorded",
        group: Group::History,
        follows: Follows::Words(&["recorded", "emulated"]),
    },
    Directive {
        name: "usage",
        short: None,
        arguments: "",
        about: "show how much history is kept, and how much memory it takes",
        more: "",
        example: "usage",
        group: Group::History,
        follows: Follows::Nothing,
    },
    // --- console ---
    Directive {
        name: "help",
        short: Some("h"),
        arguments: "[COMMAND]",
        about: "list the commands, or explain one",
        more: "",
        example: "help break",
        group: Group::Console,
        follows: Follows::Directive,
    },
    Directive {
        name: "quit",
        short: Some("x"),
        arguments: "",
        about: "end",
        more: "",
        example: "quit",
        group: Group::Console,
        follows: Follows::Nothing,
    },
];
