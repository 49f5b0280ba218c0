//! What a shell offers for `vimc4 ctl`: it asks the server that is meant, if that answers at once.

use std::env;
use std::ffi::OsStr;
use std::path::PathBuf;
use std::time::Duration;

use clap_complete::engine::{ArgValueCandidates, ArgValueCompleter, CompletionCandidate};
use serde_json::Value;

use super::client::{Client, part};
use super::words::WORDS;

/// So long somebody who has pressed Tab waits.
const PATIENCE: Duration = Duration::from_secs(1);

/// Which word a shell asks about, unless it is the last.
const PLACE: &str = "_CLAP_COMPLETE_INDEX";

/// The command line that is being typed, as far as the word that is asked about.
#[derive(Default)]
struct Typed {
    url: Option<String>,
    token: Option<PathBuf>,
    controller: Option<usize>,
    /// The words that are no options.
    words: Vec<String>,
}

fn typed() -> Typed {
    /// The options that are no values of others.
    const FLAGS: [&str; 1] = ["--json"];
    let mut typed = Typed::default();
    // Behind the first `--` is what is typed, with the name of the program.
    let all: Vec<_> = env::args_os().skip_while(|word| word != "--").skip(1).collect();
    let place = env::var(PLACE).ok().and_then(|place| place.parse().ok());
    let place: usize = place.unwrap_or(all.len().saturating_sub(1));
    let words = all.iter().take(place).skip(2);
    let mut words = words.map(|word| word.to_string_lossy().into_owned());
    while let Some(word) = words.next() {
        let Some(option) = word.strip_prefix("--").filter(|_| !FLAGS.contains(&word.as_str()))
        else {
            typed.words.extend((!word.starts_with("--")).then_some(word));
            continue;
        };
        let (name, value) = match option.split_once('=') {
            Some((name, value)) => (name, Some(value.to_owned())),
            None => (option, words.next()),
        };
        match (name, value) {
            ("url" | "connect", value) => typed.url = value,
            ("token", value) => typed.token = value.map(PathBuf::from),
            ("controller", value) => typed.controller = value.and_then(|value| value.parse().ok()),
            _ => {}
        }
    }
    typed
}

impl Typed {
    fn client(&self) -> Option<Client> {
        let client = Client::at(self.url.as_deref(), self.token.as_deref()).ok()?;
        Some(client.hurried(PATIENCE))
    }
}

/// The numbers of the controllers that run.
pub(crate) fn controllers() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let all = typed().client().and_then(|client| client.get("/controllers", &[]).ok());
        let all = all.as_ref().and_then(Value::as_array).into_iter().flatten();
        let candidate = |one: &Value| {
            let about = format!("{} on {}", part(one, "model"), part(one, "machine"));
            CompletionCandidate::new(one["number"].to_string()).help(Some(about.into()))
        };
        all.map(candidate).collect()
    })
}

/// The kinds of entries.
pub(crate) fn kinds() -> ArgValueCandidates {
    let candidate = |(kind, about): &(&str, &'static str)| {
        CompletionCandidate::new(*kind).help(Some((*about).into()))
    };
    ArgValueCandidates::new(move || vimc4_api::KINDS.iter().map(candidate).collect())
}

/// The words of `ctl`, and the orders of the controller that is meant.
pub(crate) fn orders() -> ArgValueCompleter {
    ArgValueCompleter::new(|current: &OsStr| {
        let (typed, current) = (typed(), current.to_string_lossy());
        let before: String = typed.words.iter().map(|word| format!("{word} ")).collect();
        let line = format!("{before}{current}");
        let own = WORDS.iter().flat_map(|word| {
            word.forms
                .iter()
                .map(|(form, about)| (format!("{} {form}", word.name), (*about).to_owned()))
        });
        let mut ways: Vec<(String, String)> = own.collect();
        if let Some(client) = typed.client()
            && let Ok(number) = client.controller(typed.controller)
            && let Ok(all) =
                client.get(&format!("/controllers/{number}/completions"), &[("line", &line)])
        {
            let all = all.as_array().into_iter().flatten();
            ways.extend(
                all.map(|way| (part(way, "line").to_owned(), part(way, "about").to_owned())),
            );
        }
        let mut candidates: Vec<CompletionCandidate> = Vec::new();
        for (way, about) in ways {
            let next = way.strip_prefix(&before).and_then(|rest| rest.split(' ').next());
            let Some(next) = next.filter(|next| next.starts_with(&*current)) else { continue };
            let stands_for_something =
                next.is_empty() || next.chars().any(|c| c.is_ascii_uppercase());
            if !stands_for_something && !candidates.iter().any(|known| known.get_value() == next) {
                candidates.push(CompletionCandidate::new(next).help(Some(about.into())));
            }
        }
        candidates
    })
}
