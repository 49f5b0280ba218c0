//! Which attributes of a configuration mean something where they stand. What belongs to something else than
//! what is debugged is refused, and of what is no attribute the user is told.

use strsim::osa_distance;

use crate::message::Refusal;
use crate::open::{ATTRIBUTES, Configuration, NO_LIST};

/// What is debugged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Program,
    Recording,
    Ports,
    Running,
}

/// What the attributes belong to that do not belong to everything.
const BELONGS: [(&str, &[Kind]); 11] = [
    ("model", &[Kind::Program, Kind::Ports]),
    ("machine", &[Kind::Program, Kind::Ports]),
    ("pty", &[Kind::Ports]),
    ("tcp", &[Kind::Ports]),
    ("serial", &[Kind::Ports]),
    ("time", &[Kind::Ports]),
    ("flash", &[Kind::Ports]),
    ("quirks", &[Kind::Program, Kind::Ports]),
    ("jobOptions", &[Kind::Program]),
    ("endAtEnd", &[Kind::Program, Kind::Recording]),
    ("keepGoing", &[Kind::Program]),
];

/// What chooses what is debugged.
const CHOOSING: [(&str, Kind); 3] =
    [("program", Kind::Program), ("recording", Kind::Recording), ("serve", Kind::Ports)];

/// What cannot be attached to.
pub(crate) const ATTACH_TAKES: &str = "attach takes a recording, or the controllers that run already, and no program; launch \
     opens a program";

/// Those of a whole session, however many controllers it has.
const OF_THE_SESSION: [&str; 3] = ["stopOnEntry", "endAtEnd", "noDebug"];

/// What an entry of a list has none of.
const OF_LISTS: &str = "controllers";

/// Two controllers cannot share it.
const OF_ONE: &str = "serial";

/// The attributes that Visual Studio Code has itself; more begin with two underscores.
const OF_THE_EDITOR: [&str; 14] = [
    "type",
    "request",
    "console",
    "debugServer",
    "internalConsoleOptions",
    "linux",
    "osx",
    "postDebugTask",
    "preLaunchTask",
    "presentation",
    "preRestartTask",
    "serverReadyAction",
    "suppressMultipleSessionWarning",
    "windows",
];

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Kind::Program => "a program",
            Kind::Recording => "a recording",
            Kind::Ports => "a controller behind ports",
            Kind::Running => "a controller that runs already",
        }
    }

    /// Why an attribute means nothing for it, if it does not, and what would be right.
    fn refuses(self, attribute: &str) -> Option<String> {
        let (_, owners) = BELONGS.iter().find(|(own, _)| *own == attribute)?;
        if owners.contains(&self) {
            return None;
        }
        Some(match (self, attribute) {
            (Kind::Recording, "model" | "machine" | "quirks") => {
                "a recording has its own model, machine and quirks; `vimc4 replay` plays it into others"
                    .to_owned()
            }
            (Kind::Running, "model" | "machine" | "quirks" | "time") => {
                "a controller that runs already has its own model, machine, time and quirks; leave them \
                 out, or say them where it is started"
                    .to_owned()
            }
            _ => {
                let owners: Vec<&str> = owners.iter().map(|owner| owner.name()).collect();
                let owners = owners.join(" or ");
                let own = self.name();
                format!("`{attribute}` belongs to {owners} and means nothing for {own}; leave it out")
            }
        })
    }
}

/// The attribute of these that a name is nearly, or in which an option of this name stands, as its description has
/// it. Dashes and capitals make no difference.
fn meant(name: &str, names: &[&'static str]) -> Option<&'static str> {
    let plain = |name: &str| name.replace('-', "").to_lowercase();
    let name = plain(name);
    let near = |known: &str| osa_distance(&name, &plain(known));
    let (distance, known) = names.iter().map(|known| (near(known), *known)).min()?;
    let names_option = |about: &str| {
        let mut words = about.split(|c: char| c != '-' && !c.is_ascii_alphabetic());
        words.any(|word| word.starts_with("--") && plain(word) == name)
    };
    let of_option = ATTRIBUTES.iter().find(|(.., about)| names_option(about));
    match distance * 3 <= known.len() {
        true => Some(known),
        false => of_option.map(|(known, ..)| *known),
    }
}

/// Where attributes stand: beside what, and whether within or above a list of controllers.
pub(crate) struct Standing {
    /// What is debugged there; nothing, where that is not clear.
    kinds: Vec<Kind>,
    is_entry: bool,
    is_list: bool,
    /// Whether it is to be attached to.
    is_attached: bool,
}

impl Standing {
    /// All attributes that an entry has, or a configuration itself, whose name is the editor's.
    fn names(&self) -> Vec<&'static str> {
        let name = self.is_entry.then_some("name");
        ATTRIBUTES.iter().map(|(name, ..)| *name).chain(name).collect()
    }

    /// Why an attribute would not be taken there if it were added, if it would not.
    fn would_refuse(&self, attribute: &str) -> Option<String> {
        if self.is_entry && attribute == OF_LISTS {
            return Some(NO_LIST.to_owned());
        }
        let Some((_, chosen)) = CHOOSING.iter().find(|(own, _)| *own == attribute) else {
            return self.refuses(attribute);
        };
        if self.is_attached && *chosen != Kind::Recording {
            return Some(ATTACH_TAKES.to_owned());
        }
        let is_other = |kind: &Kind| *kind != Kind::Running && kind != chosen;
        let is_chosen = !self.kinds.is_empty() && self.kinds.iter().all(is_other);
        is_chosen.then(|| {
            let names = CHOOSING.map(|(name, _)| format!("`{name}`")).join(", ");
            format!("of {names} only one is said, and another is")
        })
    }

    /// Why an attribute means nothing there, if it does not. Above a list it belongs to one of its
    /// controllers at least.
    pub(crate) fn refuses(&self, attribute: &str) -> Option<String> {
        if self.is_entry && OF_THE_SESSION.contains(&attribute) {
            return Some(format!(
                "`{attribute}` is of the whole session; it stands beside `controllers`"
            ));
        }
        if self.is_list && attribute == OF_ONE {
            return Some(format!(
                "`{attribute}` is of one controller; it stands in an entry of `controllers`"
            ));
        }
        let each: Option<Vec<String>> =
            self.kinds.iter().map(|kind| kind.refuses(attribute)).collect();
        each.and_then(|each| each.into_iter().next())
    }
}

impl Configuration {
    /// What is debugged, if one thing is named.
    fn kind(&self, attaches: bool) -> Option<Kind> {
        match (&self.program, &self.recording, self.serve) {
            (Some(_), None, false) => Some(Kind::Program),
            (None, Some(_), false) => Some(Kind::Recording),
            (None, None, true) => Some(Kind::Ports),
            (None, None, false) if attaches => Some(Kind::Running),
            _ => None,
        }
    }

    /// The configuration itself, and each of its list, with where its attributes stand.
    pub(crate) fn standings(&self, attaches: bool) -> Vec<(&Configuration, Standing)> {
        let each = self.each();
        let kinds = each.iter().map(|each| each.kind(attaches));
        let kinds: Vec<Vec<Kind>> = kinds.map(|kind| kind.into_iter().collect()).collect();
        // Where it is not clear of one it may belong to that one.
        let is_clear = kinds.iter().all(|kinds| !kinds.is_empty());
        let all = if is_clear { kinds.concat() } else { Vec::new() };
        let is_list = !self.controllers.is_empty();
        let whole =
            (self, Standing { kinds: all, is_entry: false, is_list, is_attached: attaches });
        let within = self.controllers.iter().zip(kinds);
        let within = within.map(|(own, kinds)| {
            (own, Standing { kinds, is_entry: true, is_list: false, is_attached: attaches })
        });
        std::iter::once(whole).chain(within).collect()
    }

    /// What to tell the user of its attributes that mean nothing, each with what is perhaps meant.
    pub(crate) fn unknown(&self, attaches: bool) -> Vec<String> {
        let standings = self.standings(attaches).into_iter();
        let told = standings.flat_map(|(own, standing)| {
            let names = own.others.keys().map(String::as_str);
            let names = names.filter(|name| !name.starts_with("__"));
            let names = names.filter(|name| !OF_THE_EDITOR.contains(name));
            let told = names.map(move |name| {
                let known = standing.names();
                let meant = meant(name, &known);
                let right = match meant.map(|meant| (meant, standing.would_refuse(meant))) {
                    Some((meant, None)) => format!("perhaps `{meant}` is meant"),
                    Some((meant, Some(why))) => format!("nor would `{meant}`: {why}"),
                    None => {
                        let known = known.into_iter();
                        let known: Vec<&str> =
                            known.filter(|known| standing.would_refuse(known).is_none()).collect();
                        format!("there are {}", known.join(", "))
                    }
                };
                format!("the attribute `{}` means nothing here; {right}", name.escape_debug())
            });
            told.collect::<Vec<String>>()
        });
        told.collect()
    }

    /// Refuses attributes that mean nothing where they stand, or are empty.
    pub(crate) fn check(&self, attaches: bool) -> Result<(), Refusal> {
        for (number, (own, standing)) in self.standings(attaches).into_iter().enumerate() {
            let refused = own.said().into_iter().find_map(|attribute| standing.refuses(attribute));
            let empty = || {
                let name = own.empty().find(|name| *name != "name" || standing.is_entry)?;
                Some(format!("`{name}` is empty; give it a value, or leave it out"))
            };
            if let Some(why) = refused.or_else(empty) {
                let refusal = Refusal(why);
                return Err(if number == 0 { refusal } else { own.refuses(number, refusal) });
            }
        }
        Ok(())
    }

    /// The attributes that are an empty text.
    fn empty(&self) -> impl Iterator<Item = &'static str> {
        let texts = [
            ("program", &self.program),
            ("recording", &self.recording),
            ("model", &self.model),
            ("machine", &self.machine),
            ("pty", &self.pty),
            ("tcp", &self.tcp),
            ("serial", &self.serial),
            ("time", &self.time),
            ("flash", &self.flash),
            ("name", &self.name),
            ("cwd", &self.cwd),
        ];
        let empty = texts.into_iter().filter(|(_, text)| text.as_deref() == Some(""));
        empty.map(|(name, _)| name)
    }

    /// The attributes that say something, of those that do not belong everywhere.
    fn said(&self) -> Vec<&'static str> {
        let said = [
            ("model", self.model.is_some()),
            ("machine", self.machine.is_some()),
            ("pty", self.pty.is_some()),
            ("tcp", self.tcp.is_some()),
            ("serial", self.serial.is_some()),
            ("time", self.time.is_some()),
            ("flash", self.flash.is_some()),
            ("quirks", !self.quirks.is_empty()),
            ("jobOptions", self.job_options.as_ref().is_some_and(|options| !options.is_empty())),
            ("stopOnEntry", self.stop_on_entry),
            ("endAtEnd", self.end_at_end),
            ("keepGoing", self.keep_going == Some(true)),
            ("noDebug", self.no_debug),
        ];
        said.into_iter().filter(|(_, is_said)| *is_said).map(|(name, _)| name).collect()
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    /// A value for each attribute that says something.
    fn saying(attribute: &str) -> Value {
        let kind =
            ATTRIBUTES.iter().find(|(name, ..)| *name == attribute).map(|(_, kind, _)| *kind);
        match kind.expect(attribute) {
            "boolean" => true.into(),
            "object" => json!({ "x": 1 }),
            "array" => json!(["--no-ref"]),
            _ => "x".into(),
        }
    }

    fn check(configuration: Value, attaches: bool) -> Result<(), String> {
        let read: Configuration = serde_json::from_value(configuration).expect("attributes");
        read.check(attaches).map_err(|refusal| refusal.0)
    }

    #[test]
    fn every_attribute_belongs_where_the_table_says() {
        let choosing = ["program", "recording", "serve", "cwd", "controllers"];
        let attributes = ATTRIBUTES.map(|(name, ..)| name);
        for (name, ..) in BELONGS {
            assert!(attributes.contains(&name), "{name}");
        }
        for (kind, base, attaches) in [
            (Kind::Program, json!({ "program": "a" }), false),
            (Kind::Recording, json!({ "recording": "a" }), false),
            (Kind::Recording, json!({ "recording": "a" }), true),
            (Kind::Ports, json!({ "serve": true }), false),
            (Kind::Running, json!({}), true),
        ] {
            for name in attributes.into_iter().filter(|name| !choosing.contains(name)) {
                let owners = BELONGS.iter().find(|(own, _)| *own == name);
                let belongs = owners.is_none_or(|(_, owners)| owners.contains(&kind));
                let mut said = base.clone();
                said[name] = saying(name);
                let checked = check(said.clone(), attaches);
                assert_eq!(checked.is_ok(), belongs, "{said}: {checked:?}");
                // Nothing is said by a default.
                said[name] = match said[name] {
                    Value::Bool(_) => false.into(),
                    Value::Array(_) => json!([]),
                    Value::Object(_) => json!({}),
                    _ => Value::Null,
                };
                assert_eq!(check(said, attaches), Ok(()));
                let own_place = !OF_THE_SESSION.contains(&name);
                let mut entry = base.clone();
                entry[name] = saying(name);
                entry["name"] = "b".into();
                let within = check(json!({ "controllers": [base, entry] }), attaches);
                assert_eq!(within.is_ok(), belongs && own_place, "{name}: {within:?}");
            }
        }
    }

    #[test]
    fn beside_a_list_stands_what_belongs_to_one_of_it() {
        let several = json!([{ "program": "a" }, { "recording": "b" }, { "serve": true }]);
        for (name, _) in BELONGS {
            let mut whole = json!({ "controllers": several });
            whole[name] = saying(name);
            assert_eq!(check(whole, false).is_ok(), name != OF_ONE, "{name}");
        }
        let whole = json!({ "keepGoing": true, "controllers": [{ "recording": "b" }] });
        let words =
            "`keepGoing` belongs to a program and means nothing for a recording; leave it out";
        assert_eq!(check(whole, false), Err(words.to_owned()));
        let own = json!({ "controllers": [{ "program": "a", "name": "c", "time": "8x" }] });
        let words = "controller c: `time` belongs to a controller behind ports and means nothing for a \
            program; leave it out";
        assert_eq!(check(own, false), Err(words.to_owned()));
    }

    #[test]
    fn what_means_nothing_is_told_with_what_is_perhaps_meant() {
        let told = |configuration: Value| -> Vec<String> {
            let read: Configuration = serde_json::from_value(configuration).expect("attributes");
            read.unknown(false)
        };
        let mut all =
            json!({ "type": "vimc4", "request": "launch", "name": "it", "quirks": { "x": 1 } });
        for of_editor in OF_THE_EDITOR.iter().chain(&["__sessionId", "__configurationTarget"]) {
            all[*of_editor] = json!({});
        }
        assert_eq!(told(all), <[&str; 0]>::default());
        let perhaps = |name: &str, meant: &str| {
            format!("the attribute `{name}` means nothing here; perhaps `{meant}` is meant")
        };
        for (name, meant) in [
            ("zero", "jobOptions"),
            ("--zero", "jobOptions"),
            ("wpreg", "jobOptions"),
            ("noRef", "jobOptions"),
            ("no-ref", "jobOptions"),
            ("lenient", "jobOptions"),
            ("drilldefUnit", "jobOptions"),
            ("drilldef-unit", "jobOptions"),
            ("keep-going", "keepGoing"),
            ("stopAtEntry", "stopOnEntry"),
            ("joboptions", "jobOptions"),
            ("porgram", "program"),
        ] {
            let mut configuration = json!({ "type": "vimc4", "program": "a.ncp" });
            configuration[name] = true.into();
            assert_eq!(told(configuration), [perhaps(name, meant)]);
        }
        for name in ["", "--"] {
            let told = told(json!({ name: 1 }));
            assert!(told[0].contains("here; there are program, recording"), "{told:?}");
        }
        let controls = told(json!({ "\u{1b}[2J\n": 1 }));
        assert!(
            controls[0].starts_with("the attribute `\\u{1b}[2J\\n` means nothing"),
            "{controls:?}"
        );
        let list = json!({ "controllers": [{ "name": "a", "machin": "mill" }] });
        assert_eq!(told(list), [perhaps("machin", "machine")]);
        let told = told(json!({ "foo": 1 }));
        assert!(told[0].ends_with("there are program, recording, model, machine, serve, pty, tcp, serial, \
            time, flash, quirks, jobOptions, cwd, stopOnEntry, endAtEnd, keepGoing, noDebug, controllers"), "{told:?}");
    }

    #[test]
    fn what_would_be_refused_is_not_suggested() {
        let told = |configuration: Value| -> Vec<String> {
            let read: Configuration = serde_json::from_value(configuration).expect("attributes");
            read.unknown(true)
        };
        let own = "nor would `machine`: a controller that runs already has its own model";
        for attached in [
            json!({ "machin": "mill" }),
            json!({ "controllers": [{ "name": "1", "machin": "mill" }] }),
        ] {
            let told = told(attached);
            assert!(told[0].starts_with("the attribute `machin` means nothing here; "), "{told:?}");
            assert!(told[0].contains(own), "{told:?}");
        }
        let told = told(json!({ "foo": 1 }));
        let fitting = "there are recording, cwd, stopOnEntry, noDebug, controllers";
        assert!(told[0].ends_with(fitting), "{told:?}");
    }

    #[test]
    fn what_is_suggested_would_be_taken_where_it_stands() {
        let told = |configuration: Value| -> String {
            let read: Configuration = serde_json::from_value(configuration).expect("attributes");
            read.unknown(false).concat()
        };
        let one = "of `program`, `recording`, `serve` only one is said, and another is";
        for (configuration, words) in [
            (json!({ "record": "b" }), "perhaps `recording` is meant"),
            (json!({ "program": "a", "recordin": "b" }), &*format!("nor would `recording`: {one}")),
            (json!({ "program": "a", "serv": true }), &*format!("nor would `serve`: {one}")),
            (
                json!({ "controllers": [{ "program": "a", "controller": [] }] }),
                &*format!("nor would `controllers`: {NO_LIST}"),
            ),
            (json!({ "controllers": [{ "program": "a", "nam": "b" }] }), "perhaps `name` is meant"),
            (
                json!({ "controllers": [{ "program": "a", "zzz": 1 }] }),
                "there are program, model, machine, quirks, jobOptions, cwd, keepGoing, name",
            ),
            (
                json!({ "recording": "a", "zzz": 1 }),
                "there are recording, cwd, stopOnEntry, endAtEnd, noDebug, controllers",
            ),
        ] {
            let told = told(configuration.clone());
            assert!(told.ends_with(&format!("means nothing here; {words}")), "{told}");
        }
    }

    #[test]
    fn what_is_empty_is_told_as_such() {
        for name in [
            "program",
            "recording",
            "model",
            "machine",
            "pty",
            "tcp",
            "serial",
            "time",
            "flash",
            "cwd",
            "name",
        ] {
            let base = match name {
                "program" | "recording" => json!({}),
                "model" | "machine" => json!({ "program": "a" }),
                _ => json!({ "serve": true }),
            };
            let words = format!("`{name}` is empty; give it a value, or leave it out");
            let mut empty = base;
            empty[name] = "".into();
            let entry = check(json!({ "controllers": [empty] }), false);
            assert!(entry.expect_err(name).ends_with(&words), "{name}");
            // A configuration is called as the editor likes.
            let own = if name == "name" { Ok(()) } else { Err(words) };
            assert_eq!(check(empty, false), own);
        }
    }
}
