//! What the command line says.

use std::io::IsTerminal;
use std::path::PathBuf;

use vimc4_device::AXES;

use crate::completions;
use crate::here::here;
use crate::values::duration;

#[derive(clap::Args)]
#[command(
    long_about = concat!("\
Play the fixture sessions against any port, including real hardware, and report what differs

Each session is a conversation: what is sent, and what a controller must answer, from its manual
or from the field. PORT is a serial port (", here!("/dev/ttyUSB0, COM3), the link of a pseudo-terminal
(./vimc4.pty)", "COM3)"), " or TCP (127.0.0.1:4004, tcp:HOST:PORT). No other program may use it meanwhile.

The controller is reset before each session: it forgets its settings and reference points, and
a program that runs ends. Without --allow nothing moves, no output is switched, and nothing is
written to the flash memory. What differs is reported with the quirk or value of the profile that
would explain it."),
    after_long_help = concat!("\
Exit codes: 0 all sessions passed, 1 something differs, 2 it could not be played, or not to its end.

Examples:
  vimc4 conform ", here!("./vimc4.pty", "COM7"), "
  vimc4 conform ", here!("/dev/ttyUSB0", "COM3"), " --model imc-s8 --baud 9600
  vimc4 conform 127.0.0.1:4004 line/ errors/ --verbose
  vimc4 conform --list --allow moves --envelope 5000,5000,0..2000
  vimc4 conform COM3 --allow moves,reference,outputs,flash --envelope 20000,20000,0..5000")
)]
pub(crate) struct Arguments {
    /// The port; not needed with --list, and may be left out then
    #[arg(add = completions::ports())]
    pub(super) port: Option<String>,
    /// Only sessions with one of these in their name, as in stop/ or axes/zero/wraps
    #[arg(value_name = "SESSION")]
    pub(super) filters: Vec<String>,
    /// The model of controller: a name from `vimc4 models`, or a profile file
    #[arg(long, value_name = "NAME|FILE", default_value = "imc4", add = completions::models())]
    pub(super) model: String,
    /// The speed of a serial port, by default the model's; if nothing answers, other
    /// speeds that such controllers are set to are tried
    #[arg(long, value_name = "RATE")]
    pub(super) baud: Option<u32>,
    /// What may happen at the machine: moves (within --envelope), reference (runs to the
    /// reference switches, however far), outputs (spindle, brake, motor currents, what is
    /// connected), flash (the stored program is erased, saved settings become the factory's)
    #[arg(long, value_name = "WHAT", value_enum, value_delimiter = ',')]
    pub(super) allow: Vec<Allow>,
    /// How far the axes may go from where they are, in steps: X,Y,Z and more axes in their
    /// order, each a number for both directions or LOWEST..HIGHEST
    #[arg(long, value_name = "X,Y,Z", value_parser = envelope, allow_hyphen_values = true)]
    pub(super) envelope: Option<Envelope>,
    /// Do not ask before anything that was allowed
    #[arg(long)]
    pub(super) yes: bool,
    /// Leave out sessions that take longer, such as 30s or 5min
    #[arg(long, value_name = "DURATION", default_value = "1min", value_parser = nanos)]
    pub(super) longest: u64,
    /// How much earlier or later than written an answer may come; never less than a hundredth
    #[arg(long, value_name = "DURATION", default_value = "50ms", value_parser = nanos)]
    pub(super) tolerance: u64,
    /// Sessions of your own: TOML files in this folder or in folders in it, with the programs
    /// that they store in a folder `programs` in it
    #[arg(long, value_name = "FOLDER")]
    pub(super) sessions: Option<PathBuf>,
    /// Say which sessions would be played, and why the others not; needs no port
    #[arg(long)]
    pub(super) list: bool,
    /// Print one JSON object instead
    #[arg(long)]
    pub(super) json: bool,
    /// Name the sessions that pass too, and show every byte
    #[arg(short, long)]
    pub(super) verbose: bool,
}

/// What a person can allow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Allow {
    Moves,
    Reference,
    Outputs,
    Flash,
}

/// Lowest and highest place of each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Envelope(pub(super) [(i64, i64); AXES]);

// --- the values of options ---

/// A span of time in nanoseconds.
fn nanos(text: &str) -> Result<u64, String> {
    Ok(duration(text)?.as_nanos() as u64)
}

fn envelope(text: &str) -> Result<Envelope, String> {
    let help = "two to six axes are needed, as in 5000,5000,0..2000";
    let mut ways = [(0, 0); AXES];
    let parts: Vec<&str> = text.split(',').collect();
    if !(2..=AXES).contains(&parts.len()) {
        return Err(help.to_owned());
    }
    for (way, part) in ways.iter_mut().zip(parts) {
        let number = |text: &str| text.trim().parse::<i64>().map_err(|_| help.to_owned());
        *way = match part.split_once("..") {
            Some((low, high)) => (number(low)?, number(high)?),
            None => {
                let both = number(part)?;
                (-both, both)
            }
        };
        // Where an axis is now is always part of it.
        if way.0 > 0 || way.1 < 0 {
            return Err(format!("{part} leaves out where the axis is, which is 0; {help}"));
        }
    }
    Ok(Envelope(ways))
}

/// Whether somebody watches who would like to see progress.
pub(super) fn watched(arguments: &Arguments) -> bool {
    std::io::stderr().is_terminal() && !arguments.verbose
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn envelopes() {
        let ways = |text| {
            envelope(text).map(|Envelope(ways)| ways.map(|(low, high)| format!("{low}..{high}")))
        };
        let all = |ways: [&str; AXES]| Ok(ways.map(str::to_owned));
        let still = "0..0";
        assert_eq!(ways("5,10"), all(["-5..5", "-10..10", still, still, still, still]));
        assert_eq!(ways("5,10,0..7"), all(["-5..5", "-10..10", "0..7", still, still, still]));
        let six = all([still, still, "-300..0", "-20..20", "-1..1", "-2..2"]);
        assert_eq!(ways("0,0,-300..0,20,1,2"), six);
        for wrong in ["5", "x,5,5", "5,5,3..7", "-5,5,5", "1,2,3,4,5,6,7", "5,5,7..-7"] {
            assert!(envelope(wrong).is_err(), "{wrong}");
        }
    }
}
