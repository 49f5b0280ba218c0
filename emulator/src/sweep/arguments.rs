//! What the command line of `vimc4 sweep` says.

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

use vimc4::sweep::{Choice, Harm, Mode, Shard};

use crate::completions;
use crate::here::here;
use crate::values::duration;

#[derive(clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    long_about = concat!("\
Try every fault on host software or a recorded session, and report what comes of it

With a host command, behind `--`: it runs once without a fault, and must succeed. From this run every
byte each way, every command, every quarter of a motion and every answer is counted. Then it runs once for
each of them and each thing that can go wrong there: bytes that are lost, garbled, late or come twice,
STOP, the emergency stop, a limit switch, a power failure. Each goes wrong once (transient), for good
(persistent), and once with a second fault behind it (compound). The controller is a new one in each run, and its
time passes whenever nobody is busy. The command finds it in ", here!("VIMC4_PORT, a serial port, or VIMC4_TCP,
HOST:PORT, and wherever {port} or {tcp} stands in its arguments.", "VIMC4_TCP,
HOST:PORT, and wherever {tcp} stands in its arguments."), "

Where the host would hear what it has heard in another run, it is not run again: it does the same. Runs in \
which the host does the same are one outcome. Of each the smallest case is kept as a recording, which
`vimc4 replay` and `vimc4 console` open.

With a recorded session the inputs are what they are, and what differs are the answers and where the machine ends
up."),
    after_long_help = concat!("\
Examples:
  vimc4 sweep examples/limit.jsonl --out limit
  vimc4 sweep -- python3 -m unittest discover examples/sweep
  vimc4 sweep --model imc-s8 --machine mill -- ./driver --port ", here!("{port}", "{tcp}"), "
  vimc4 sweep --shard 3/16 --out part-3 -- pytest tests
  vimc4 sweep merge part-1 part-2 part-3 --out whole

docs/sweep.md explains the report.

Exit codes: 0 nothing is wrong with the host, 1 something is: it hangs, crashes, moves before a
reference run, or reports success with the machine elsewhere; 2 wrong usage, or it fails without a fault.")
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(super) other: Option<Other>,
    /// A recorded session instead of a host command
    #[arg(value_name = "SESSION", required_unless_present = "command", conflicts_with = "command")]
    pub(super) session: Option<PathBuf>,
    /// The host command
    #[arg(value_name = "COMMAND", last = true)]
    pub(super) command: Vec<OsString>,
    /// The model for the host command: a name from `vimc4 models`, or a profile file
    #[arg(long, value_name = "NAME|FILE", default_value = "imc4", conflicts_with = "session", add = completions::models())]
    pub(super) model: String,
    /// Its machine: a name from `vimc4 machines`, or a profile file
    #[arg(long, value_name = "NAME|FILE", default_value = "mill", conflicts_with = "session", add = completions::machines())]
    pub(super) machine: String,
    /// How many runs at the same time; by default four for each processor with a host command, not counting
    /// those that seem to wait, and one with a recorded session
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub(super) jobs: Option<u16>,
    /// Do only a part of the points, as in 3/16: every sixteenth, from the third on
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    pub(super) shard: Shard,
    /// Go on with what was begun in the folder
    #[arg(long)]
    pub(super) resume: bool,
    /// The folder for the results
    #[arg(long, value_name = "DIR", default_value = "sweep-results")]
    pub(super) out: PathBuf,
    /// How long a run of the host may take; by default twenty times as long as without a fault, at least
    /// 2s, and longer while all are slow
    #[arg(long, value_name = "TIME", value_parser = duration, conflicts_with = "session")]
    pub(super) limit: Option<Duration>,
    /// Run the host for every point, also where it hears what it has heard in another run
    #[arg(long, conflicts_with = "session")]
    pub(super) run_all: bool,
    /// What goes wrong; misread and lost-steps only if they are named, since no answer tells a host of them
    #[arg(long, value_name = "HARM", value_delimiter = ',', value_parser = harm_names())]
    pub(super) only: Vec<String>,
    /// How it goes wrong
    #[arg(long, value_name = "MODE", value_delimiter = ',', value_parser = mode_names())]
    pub(super) modes: Vec<String>,
    /// Print one JSON object instead of the report
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(clap::Subcommand)]
pub(super) enum Other {
    /// Put the results of several shards together, and report
    #[command(after_long_help = "\
Examples:
  vimc4 sweep merge part-1 part-2 --out whole

Exit codes: 0 nothing is wrong with the host, 1 something is, 2 wrong usage, or points are missing.")]
    Merge {
        /// The folders
        #[arg(value_name = "DIR", required = true)]
        folders: Vec<PathBuf>,
        /// The folder for all results
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Print one JSON object instead of the report
        #[arg(long)]
        json: bool,
    },
    /// Ends what is left of the hosts when its standard input ends
    #[cfg(unix)]
    #[command(hide = true)]
    Guard {
        /// What the hosts have in their environment
        mark: String,
    },
}

fn harm_names() -> clap::builder::PossibleValuesParser {
    Harm::ALL.map(|(_, name)| name).into()
}

fn mode_names() -> clap::builder::PossibleValuesParser {
    Mode::ALL.map(|(_, name)| name).into()
}

impl Arguments {
    pub(super) fn choice(&self, live: bool) -> Choice {
        let usual = Choice::default();
        let harms = Harm::ALL.into_iter().filter(|(_, name)| self.only.iter().any(|it| it == name));
        let modes =
            Mode::ALL.into_iter().filter(|(_, name)| self.modes.iter().any(|it| it == name));
        let (harms, modes): (Vec<Harm>, Vec<Mode>) =
            (harms.map(|(harm, _)| harm).collect(), modes.map(|(mode, _)| mode).collect());
        Choice {
            harms: if harms.is_empty() { usual.harms } else { harms },
            modes: if modes.is_empty() { usual.modes } else { modes },
            live,
        }
    }

    pub(super) fn jobs(&self, each: usize) -> usize {
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        self.jobs.map_or(processors * each, usize::from)
    }
}
