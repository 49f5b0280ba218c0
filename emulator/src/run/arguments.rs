//! What the command line says.

use std::path::PathBuf;
use std::time::Duration;

use super::world::World;
use crate::completions;
use crate::setup::Setup;
use crate::values::duration;

#[derive(clap::Args)]
#[command(
    long_about = "\
Run a command list, a stored program or a plot file in virtual time, as fast as possible

isel: a file whose first command begins with @ is a command list: its lines are sent one after the other,
each when the one before was answered. One whose lines begin with a digit or a single letter is a data
field, the lines of a program as they stand between @0i and 9: it is stored; the final 9 may be left out.

What was stored and not started is then started with the START button, which is pressed for 0.1 s.
With --press start@TIME it is pressed then, and not before. Blank lines, and lines that begin with
; or #, are ignored. Lines may end with LF, CR LF or CR.

A job file in the isel NC intermediate format is run as `vimc4 ncp run` does it, which has options of
its own.

LPKF: a file is a stream of commands, as it goes over the line. Each command is sent when the one
before was completed; in the mode without echo, as long as the buffer has room. Numbers that belong to
no command, such as pairs after PU and PD, mean nothing to most models: they are listed at the end,
with the value of the profile that would take them, and the exit code is 1. So are commands in
lower-case letters, which are none.

It ends with the last command or with the program; then the exit code is 0. An error reply ends it
with 1; with 1 it also ends if commands were for another controller. It ends with 3 after --for, after
--loops, or at once when nothing more can happen: a command that is never answered is such an end.",
    after_long_help = "\
Examples:
  vimc4 run examples/commands.txt --machine mill
  vimc4 run examples/program.txt --model imc4-m --loops 3
  vimc4 run examples/program.txt --input 0.3=1@2s --press stop@5s --press start@8s --for 1min
  vimc4 run examples/board.plt --model smcu --machine board-plotter
  vimc4 run examples/board.plt --model smcu --keep-going --ignore-numbers
  vimc4 run examples/commands.txt --machine mill --plot out.svg --as gcode out.nc
  (echo @07; vimc4 circle --radius 200) | vimc4 run -

Exit codes: 0 all was done, 1 an error reply, or something in a plot file that the controller would leave
out, 2 wrong usage, 3 the time or the rounds are over, or nothing more can happen, 130 it was
interrupted."
)]
pub(crate) struct Arguments {
    /// The file; `-` is standard input
    pub(super) file: PathBuf,
    #[command(flatten)]
    pub(super) setup: Setup,
    /// The axes a data field is stored with: 1, 3 or 7 for X, X+Y, X+Y+Z, and 8 more with A; by
    /// default those of its comment `; axes: N`, or 7
    #[arg(long, value_parser = axes, add = completions::words(&["1", "3", "7", "8", "9", "11", "15"]))]
    pub(super) axes: Option<u8>,
    /// How much virtual time may pass, such as 90s, 5min or 1h
    #[arg(long = "for", id = "for", value_name = "DURATION", default_value = "1h", value_parser = duration)]
    pub(super) time: Duration,
    /// Stop when the program has made N rounds: jumped back N times, without a count, to the
    /// earliest line it comes to again
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(super) loops: Option<u64>,
    #[command(flatten)]
    pub(super) world: World,
    /// Go on after commands that the controller does not know, in a plot file: they are left out and
    /// listed at the end
    #[arg(long)]
    pub(super) keep_going: bool,
    /// Ignore numbers that belong to no command in a plot file; without this the exit
    /// code is 1
    #[arg(long)]
    pub(super) ignore_numbers: bool,
    /// Print one line of JSON instead
    #[arg(long)]
    pub(super) json: bool,
    /// Say what the commands mean, and follow the program line by line
    #[arg(short, long)]
    pub(super) verbose: bool,
}

/// The number of a set of axes.
pub(crate) fn axes(text: &str) -> Result<u8, String> {
    match text.parse() {
        Ok(axes @ (1 | 3 | 7 | 8 | 9 | 11 | 15)) => Ok(axes),
        _ => Err("1, 3, 7, 8, 9, 11 and 15 are possible".to_owned()),
    }
}
