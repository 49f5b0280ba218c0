//! The command line of `vimc4 circle`.

use clap::ValueEnum;
use vimc4_picture::View;

use crate::drawing::Pictured;
use crate::failure::Failure;
use crate::output;

/// The largest number a command takes, of 24 bits with their sign.
pub(super) const MOST: u64 = (1 << 23) - 1;

#[derive(clap::Args)]
#[command(
    long_about = "\
Print the commands for a circle, a part of one, or a helix

Angles are in degrees, counted counterclockwise from the first axis of the plane. Without --to it
is a whole circle. An arc goes on in its sense of rotation until it comes to --to; for several
turns that is further away, as in --from 0 --to 720.

The commands go to standard output, and what they lead to goes to standard error, as comments.

With --explain a command is read instead: standard error says where it ends, and which parameters would
end on the circle. Standard output has the command with these parameters.",
    after_long_help = "\
Examples:
  vimc4 circle --radius 200 --from 135 --to 225 --speed 1500
  vimc4 circle --radius 12.5 --steps-per-mm 80 --cw > circle.txt
  vimc4 circle --radius 2000 --from 180 --to 900 --rise 6000   (a helix of two turns)
  (echo @07; vimc4 circle --radius 200) | vimc4 run -
  vimc4 circle --explain '@0y800,400,7777,0,-400,-1,1' --plot arc.svg

Exit codes: 0 printed, 2 there is no such circle, or wrong usage."
)]
pub(crate) struct Arguments {
    /// The radius, in steps or, with --steps-per-mm, in mm
    #[arg(
        long,
        short,
        allow_negative_numbers = true,
        value_parser = radius,
        required_unless_present = "explain",
        default_value_t = 0.0,
        hide_default_value = true
    )]
    pub(super) radius: f64,
    /// Say where a command `y` or `w` ends, and whether that is on its circle
    #[arg(
        long, value_name = "COMMAND",
        conflicts_with_all = ["radius", "from", "to", "speed", "rise", "device", "steps_per_mm"]
    )]
    pub(super) explain: Option<String>,
    /// How many steps 1 mm is, on both axes of the plane
    #[arg(long, value_name = "STEPS", allow_negative_numbers = true, value_parser = number)]
    pub(super) steps_per_mm: Option<f64>,
    /// The angle at which it begins, in degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true, value_parser = number)]
    pub(super) from: f64,
    /// The angle at which it ends, in degrees; a whole circle if there is none
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, value_parser = number)]
    pub(super) to: Option<f64>,
    /// Clockwise
    #[arg(long, conflicts_with = "ccw")]
    pub(super) cw: bool,
    /// Counterclockwise; this is the default
    #[arg(long)]
    pub(super) ccw: bool,
    /// The speed, in steps per second
    #[arg(
        long, value_name = "HZ", default_value_t = 1_000,
        value_parser = clap::value_parser!(u32).range(20..=40_000)
    )]
    pub(super) speed: u32,
    /// The plane
    #[arg(long, value_enum, default_value = "xy")]
    pub(super) plane: Plane,
    /// Steps of the third axis meanwhile, for a helix; imc-m, imc-mp and imc-s8 only
    #[arg(
        long, value_name = "STEPS", allow_negative_numbers = true,
        value_parser = clap::value_parser!(i64).range(-(1 << 23)..1 << 23)
    )]
    pub(super) rise: Option<i64>,
    /// The number of the controller
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u8).range(..=9))]
    pub(super) device: u8,
    /// Print one line of JSON instead
    #[arg(long)]
    pub(super) json: bool,
    #[command(flatten)]
    pub(super) pictured: Pictured,
}

fn radius(text: &str) -> Result<f64, String> {
    number(text).map_err(|wrong| match text.strip_suffix("mm").map(|mm| mm.trim().parse::<f64>()) {
        Some(Ok(mm)) => format!("write it without a unit, as in --radius {mm} --steps-per-mm 80"),
        _ => wrong,
    })
}

fn number(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| "a number is needed, as in 200 or 12.5".to_owned())
}

/// The plane of a circle.
#[derive(Clone, Copy, ValueEnum)]
pub(super) enum Plane {
    /// X and Y
    Xy,
    /// X and Z
    Xz,
    /// Y and Z
    Yz,
}

impl Plane {
    /// Its axes.
    pub(super) fn axes(self) -> (usize, usize) {
        match self {
            Plane::Xy => (0, 1),
            Plane::Xz => (0, 2),
            Plane::Yz => (1, 2),
        }
    }

    /// From where it is seen best.
    pub(super) fn view(self) -> View {
        match self {
            Plane::Xy => View::Top,
            Plane::Xz => View::Front,
            Plane::Yz => View::Side,
        }
    }
}

/// Prints lines to standard output.
pub(super) fn print(lines: &[String]) -> Result<(), Failure> {
    output::print(&(lines.join("\n") + "\n"))
}
