//! `vimc4 completions`, and what completes the values of options.
//!
//! The shell asks this program at each Tab, so that names are always those of the program that it
//! will run, and a signal one of the model that was typed.

use std::collections::BTreeSet;
use std::env;
use std::ffi::OsStr;
use std::path::Path;

use clap_complete::Shell;
use clap_complete::engine::{
    ArgValueCandidates, ArgValueCompleter, CompletionCandidate, PathCompleter, ValueCompleter,
};
use clap_complete::env::{CompleteEnv, Shells};
use vimc4_catalogue::Controller;
use vimc4_device::{Device, Names, Signal};
use vimc4_language::{Verb, orders_of};

use crate::failure::Failure;
use crate::here::here;
use crate::output;
use crate::places::LISTENS;

/// The variable by which the shell's script asks, and for which shell.
const ASKS: &str = "VIMC4_COMPLETE";

/// What bash runs at each Tab. It differs from the script of `clap_complete`, because bash ends
/// words at `=`, `:` and `@`: the pieces are joined again before the question, and the part before
/// the last piece is removed from each answer. No value here is the name of a host, which bash
/// would offer after `@`.
const BASH: &str = r#"
_vimc4() {
    local IFS=$'\013' words=() count=0 i piece rest=${COMP_LINE:0:COMP_POINT} next word before answer
    for ((i = 0; i <= COMP_CWORD; i++)); do
        next=${rest#"${rest%%[![:blank:]]*}"}
        piece=${COMP_WORDS[i]}
        if ((i == COMP_CWORD)); then
            piece=$next
        fi
        if ((i > 0)) && [[ $next == "$rest" ]]; then
            words[count - 1]+=$piece
        else
            words[count++]=$piece
        fi
        rest=${next#"$piece"}
    done
    word=${words[count - 1]}
    before=${word%"$2"}
    for ((i = 0; i < count; i++)); do
        words[i]=${words[i]//[\"\'\\]/}
    done
    if compopt +o nospace 2> /dev/null && [[ $word == *@* ]]; then
        compopt +o bashdefault
    fi
    COMPREPLY=()
    for answer in $(_CLAP_IFS="$IFS" _CLAP_COMPLETE_INDEX=$((count - 1)) ASKS=bash vimc4 -- "${words[@]}"); do
        if [[ $word != [\"\']* ]]; then
            printf -v answer %q "$answer"
        fi
        COMPREPLY+=("${answer#"$before"}")
    done
    if [[ ${COMPREPLY-} == *[=/:] ]]; then
        compopt -o nospace 2> /dev/null
    fi
}
complete -o bashdefault -o nosort -F _vimc4 vimc4 2> /dev/null ||
    complete -o nospace -o bashdefault -F _vimc4 vimc4
"#;

/// What zsh does with its script. From a folder of `$fpath` it reads it at the first Tab, as the function of
/// the file's name, of which it then awaits an answer; otherwise the script is to tell it of the function.
const ZSH: &str = r#"if [[ "$funcstack[1]" == _vimc4 ]]; then
    _clap_dynamic_completer_vimc4 "$@"
else
    compdef _clap_dynamic_completer_vimc4 vimc4
fi"#;

/// How the script of `clap_complete` for zsh ends, which expects to be read beforehand.
const ZSH_BEFOREHAND: &str = "compdef _clap_dynamic_completer_vimc4 vimc4";

#[derive(clap::Args)]
#[command(after_long_help = here!("\
Examples:
  vimc4 completions bash

With this line in its settings a shell completes commands, options, the names of models, machines and
signals, programs and files:
  ~/.bashrc                    source <(vimc4 completions bash)
  ~/.zshrc, behind compinit    source <(vimc4 completions zsh)
  ~/.config/fish/config.fish   vimc4 completions fish | source

It asks the vimc4 on the PATH.

Exit codes: 0 printed, 2 wrong usage.", "\
Examples:
  vimc4 completions powershell

With this line in its profile ($PROFILE) PowerShell completes commands, options, the names of models,
machines and signals, serial ports and files:
  vimc4 completions powershell | Out-String | Invoke-Expression

It asks the vimc4 on the PATH.

Exit codes: 0 printed, 2 wrong usage."))]
pub(crate) struct Arguments {
    /// For which shell
    shell: Shell,
}

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    if arguments.shell == Shell::Bash {
        return output::print(&BASH.replace("ASKS", ASKS));
    }
    let shell = arguments.shell.to_string();
    let mut script = Vec::new();
    let written = Shells::builtins().completer(&shell).map(|completer| {
        completer.write_registration(ASKS, "vimc4", "vimc4", "vimc4", &mut script)
    });
    match written {
        Some(Ok(())) => {
            let script = String::from_utf8_lossy(&script);
            output::print(&script.replace(ZSH_BEFOREHAND, ZSH))
        }
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

/// Every value of every quirk, of all families: only the recording names its family.
pub(crate) fn quirks() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let models = vimc4_catalogue::models().into_iter();
        let models = models.filter_map(|name| vimc4::model(name).ok());
        let quirks = models.flat_map(|model| vimc4_catalogue::quirks(&model).iter());
        let values = quirks.flat_map(|(quirk, values)| {
            values.iter().map(move |value| format!("{quirk}={}", value.trim_matches('"')))
        });
        let values: BTreeSet<String> = values.collect();
        values.into_iter().map(CompletionCandidate::new).collect()
    })
}

/// What can be pressed on the model that was typed.
pub(crate) fn buttons() -> ArgValueCompleter {
    orders(&[Verb::Press], |words| words.to_owned())
}

/// What `--input` takes for the model that was typed: bits of the input ports with both levels, and
/// everything else by name with its positions; of numbers the smallest and the largest.
pub(crate) fn inputs() -> ArgValueCompleter {
    orders(&[Verb::Input, Verb::Set], |words| match words.rsplit_once(' ') {
        Some((name, value)) => format!("{name}={value}"),
        None => words.to_owned(),
    })
}

/// Where a controller may be: the links and devices that are files, the serial ports where they are
/// none, and the address at which `serve` listens unless it is told another.
pub(crate) fn ports() -> ArgValueCompleter {
    ArgValueCompleter::new(|current: &OsStr| {
        let typed = current.to_string_lossy();
        let addresses = [LISTENS.to_owned(), format!("tcp:{LISTENS}")];
        let places = named_ports().into_iter().chain(addresses);
        let fit = places.filter(|place| place.starts_with(&*typed));
        let files = PathCompleter::any().complete(current);
        fit.map(CompletionCandidate::new).chain(files).collect()
    })
}

/// The serial ports that are no files.
#[cfg(windows)]
fn named_ports() -> Vec<String> {
    let ports = serialport::available_ports().unwrap_or_default();
    ports.into_iter().map(|port| port.port_name).collect()
}

#[cfg(not(windows))]
fn named_ports() -> Vec<String> {
    Vec::new()
}

/// A program and its arguments: what is on the PATH first, then files.
#[cfg(unix)]
#[derive(Clone)]
pub(crate) struct Program;

#[cfg(unix)]
impl ValueCompleter for Program {
    fn complete(&self, current: &OsStr) -> Vec<CompletionCandidate> {
        self.complete_at(0, current)
    }

    fn complete_at(&self, place: usize, current: &OsStr) -> Vec<CompletionCandidate> {
        let files = PathCompleter::any().complete(current);
        match place {
            0 => on_path(&current.to_string_lossy()).chain(files).collect(),
            _ => files,
        }
    }
}

/// The programs whose names begin with the typed text, if there is any: all would be thousands.
#[cfg(unix)]
fn on_path(typed: &str) -> impl Iterator<Item = CompletionCandidate> {
    let folders = env::var_os("PATH").filter(|_| !typed.is_empty()).unwrap_or_default();
    let files = env::split_paths(&folders).filter_map(|folder| folder.read_dir().ok()).flatten();
    let named = files.flatten().filter_map(|file| {
        let name = file.file_name().into_string().ok()?;
        (name.starts_with(typed) && is_program(&file.path())).then_some(name)
    });
    named.collect::<BTreeSet<String>>().into_iter().map(CompletionCandidate::new)
}

#[cfg(unix)]
fn is_program(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;

    path.metadata().is_ok_and(|file| file.is_file() && file.permissions().mode() & 0o111 != 0)
}

/// The orders of these verbs for the model that was typed, in the form that an option takes them.
fn orders(verbs: &'static [Verb], form: fn(&str) -> String) -> ArgValueCompleter {
    ArgValueCompleter::new(move |current: &OsStr| {
        let typed = current.to_string_lossy();
        let names = Names::new([], of_model(&typed_model()));
        let mut candidates = Vec::new();
        for verb in verbs {
            for way in orders_of(*verb, &names) {
                let value = form(&way.line);
                if value.starts_with(&*typed) {
                    candidates.push(CompletionCandidate::new(value).help(Some(way.about.into())));
                }
            }
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
