//! `vimc4 completions`, and what completes the values of options.
//!
//! The shell asks this program at each Tab, so that names are always those of the program that it
//! will run, and a signal one of the model that was typed.

use std::env;
use std::ffi::OsStr;
use std::path::Path;

use clap_complete::Shell;
use clap_complete::engine::{
    ArgValueCandidates, ArgValueCompleter, CompletionCandidate, PathCompleter, ValueCompleter,
};
use clap_complete::env::{CompleteEnv, Shells};
use vimc4_catalogue::Controller;
use vimc4_device::{Device, Signal, SignalKind};

use crate::failure::Failure;
use crate::output;

/// By this the shell's script says that it asks, and for which shell.
const ASKS: &str = "VIMC4_COMPLETE";

#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  vimc4 completions bash

A shell completes commands, options, the names of models, machines and signals, and files if this
stands in its settings:
  ~/.bashrc                    source <(vimc4 completions bash)
  ~/.zshrc, behind compinit    source <(vimc4 completions zsh)
  ~/.config/fish/config.fish   vimc4 completions fish | source

The shell asks the vimc4 that is on the PATH.

Exit codes: 0 printed, 2 wrong usage.")]
pub(crate) struct Arguments {
    /// For which shell
    shell: Shell,
}

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    let shell = arguments.shell.to_string();
    let mut script = Vec::new();
    let written = Shells::builtins().completer(&shell).map(|completer| {
        completer.write_registration(ASKS, "vimc4", "vimc4", "vimc4", &mut script)
    });
    match written {
        Some(Ok(())) => output::print(&String::from_utf8_lossy(&script)),
        Some(Err(error)) => Err(Failure::midway(format!("cannot write the script: {error}"))),
        None => Err(Failure::usage(format!("there is no script for {shell}; take bash or zsh"))),
    }
}

/// Answers a shell that asks, and ends. Otherwise nothing happens.
pub(crate) fn answer(command: fn() -> clap::Command) {
    CompleteEnv::with_factory(command).var(ASKS).complete();
}

// --- the values of options ---

/// The names of models, and profile files.
pub(crate) fn models() -> ArgValueCompleter {
    ArgValueCompleter::new(|current: &OsStr| {
        let title = |name: &str| vimc4::model(name).map(|model| model.title().to_owned()).ok();
        named(current, &vimc4_catalogue::models(), title)
    })
}

/// The names of machines, and profile files.
pub(crate) fn machines() -> ArgValueCompleter {
    ArgValueCompleter::new(|current: &OsStr| {
        let title = |name: &str| vimc4::machine(name).map(|machine| machine.title.clone()).ok();
        named(current, &vimc4::machines(), title)
    })
}

/// What `show` shows: machines behind `machines`, else models.
pub(crate) fn profiles() -> ArgValueCompleter {
    ArgValueCompleter::new(|current: &OsStr| match env::args_os().any(|word| word == "machines") {
        true => machines().complete(current),
        false => models().complete(current),
    })
}

/// Some of the words that an option takes.
pub(crate) fn words(words: &'static [&'static str]) -> ArgValueCandidates {
    ArgValueCandidates::new(|| words.iter().map(CompletionCandidate::new).collect())
}

/// The buttons of the model that was typed.
pub(crate) fn buttons() -> ArgValueCompleter {
    signals(|signal| match signal.kind {
        SignalKind::Button => vec![signal.name.clone()],
        _ => Vec::new(),
    })
}

/// What `--input` takes for the model that was typed: bits of the input ports with both levels, and
/// switches by name with their positions.
pub(crate) fn inputs() -> ArgValueCompleter {
    signals(|signal| match (signal.name.strip_prefix("input "), &signal.positions) {
        (Some(bit), _) => vec![format!("{bit}=0"), format!("{bit}=1")],
        (None, Some(positions)) => {
            positions.iter().map(|position| format!("{}={position}", signal.name)).collect()
        }
        (None, None) => Vec::new(),
    })
}

fn signals(values: fn(&Signal) -> Vec<String>) -> ArgValueCompleter {
    ArgValueCompleter::new(move |current: &OsStr| {
        let typed = current.to_string_lossy();
        let mut candidates = Vec::new();
        for signal in of_model(&typed_model()) {
            let fits = values(&signal).into_iter().filter(|value| value.starts_with(&*typed));
            let help = signal.about;
            let candidate = |value| CompletionCandidate::new(value).help(Some(help.clone().into()));
            candidates.extend(fits.map(candidate));
        }
        candidates
    })
}

/// The signals of a model; none if there is no such model.
fn of_model(name: &str) -> Vec<Signal> {
    let (Ok(model), Ok(machine)) = (vimc4::model(name), vimc4::machine("bench")) else {
        return Vec::new();
    };
    Controller::new(&model, machine, b"").map(|device| device.signals()).unwrap_or_default()
}

/// The model on the command line that is being typed.
fn typed_model() -> String {
    let mut words = env::args_os().map(|word| word.to_string_lossy().into_owned());
    while let Some(word) = words.next() {
        let value = match word.strip_prefix("--model") {
            Some("") => words.next(),
            Some(rest) => rest.strip_prefix('=').map(str::to_owned),
            None => None,
        };
        if let Some(value) = value {
            return value;
        }
    }
    "imc4".to_owned()
}

fn named(
    current: &OsStr,
    names: &[&str],
    title: impl Fn(&str) -> Option<String>,
) -> Vec<CompletionCandidate> {
    let typed = current.to_string_lossy();
    let fit = names.iter().filter(|name| name.starts_with(&*typed));
    let candidate = |name: &&str| CompletionCandidate::new(*name).help(title(name).map(Into::into));
    let is_profile = |path: &Path| path.extension().is_some_and(|extension| extension == "toml");
    let files = PathCompleter::any().filter(move |path| is_profile(path)).complete(current);
    fit.map(candidate).chain(files).collect()
}
