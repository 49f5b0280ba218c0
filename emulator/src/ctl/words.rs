//! The words of `vimc4 ctl` that are no orders.

use super::client::{Trouble, part};

/// A word, and what may follow it.
pub(crate) struct Word {
    pub(crate) name: &'static str,
    /// What follows, in capitals if it stands for something, and what comes of it.
    pub(crate) forms: &'static [(&'static str, &'static str)],
}

/// All of them, in the order of the help.
pub(crate) const WORDS: &[Word] = &[
    Word { name: "controllers", forms: &[("", "the controllers that run, and where")] },
    Word { name: "view", forms: &[("", "what is seen of a controller now")] },
    Word {
        name: "watch",
        forms: &[("", "what happens, as it happens; --kinds, --after and --count say what of it")],
    },
    Word {
        name: "send",
        forms: &[(
            "TEXT",
            r"bytes to the controller, as in `send '@07\r'`; \r, \n, \t, \\ and \xFD stand for bytes",
        )],
    },
    Word {
        name: "clock",
        forms: &[
            ("", "the time, how it passes, and whether it is paused"),
            ("pause", "time stands still"),
            ("resume", "time goes on"),
            ("step", "do the next thing only, while time is paused"),
            ("CLOCK", "time passes so: real, or a factor such as 8x"),
        ],
    },
];

/// What the API says of its requests, and what is typed instead.
const REQUESTS: &[(&str, &str)] = &[
    ("GET the orders, which lists them", "`vimc4 ctl help` lists them"),
    ("POST to clock/pause", "give `clock pause`"),
    ("POST to clock/resume", "give `clock resume`"),
    ("or to clock/step", "or `clock step`"),
    ("POST a line such as `step 250ms` to the debugger", "step it in `vimc4 console --connect`"),
];

/// Why the server has refused something, for those who type.
pub(crate) fn typed(mut trouble: Trouble) -> Trouble {
    if let Trouble::Refused(problem) = &mut trouble {
        let remedy = part(problem, "remedy").to_owned();
        let typed =
            |remedy: String, (request, typed): &(&str, &str)| remedy.replace(request, typed);
        problem["remedy"] = REQUESTS.iter().fold(remedy, typed).into();
    }
    trouble
}

impl Word {
    /// Its forms as a list for people.
    fn listed(&self) -> String {
        let lines = self.forms.iter().map(|(form, about)| {
            let typed = format!("{} {form}", self.name);
            format!("{typed:<21} {about}\n")
        });
        lines.collect()
    }
}

/// The words as a list for people.
pub(crate) fn listed() -> String {
    WORDS.iter().map(Word::listed).collect()
}

/// What there is to be known of a word.
pub(crate) fn help_on(name: &str) -> Option<String> {
    WORDS.iter().find(|word| word.name == name).map(Word::listed)
}

/// What the command is about.
pub(crate) fn about() -> String {
    let words: String = listed().lines().map(|line| format!("  {line}\n")).collect();
    format!(
        "See and steer controllers that are served elsewhere\n\nThe controllers are those of a `vimc4 \
         serve --http` that runs, on this computer or another. Give its address with --url, or set \
         VIMC4_URL.\nAn order is one of those that `vimc4 serve` takes on standard input: `vimc4 ctl help` \
         lists them, and `help ORDER` says more. Besides there are:\n\n{words}\nOrders that let time \
         pass end when it is there; Ctrl-C gives them up."
    )
}
