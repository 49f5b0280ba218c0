//! What it costs that a controller makes some movements in pieces: the table of docs/ncp.md.

use vimc4_ncp::geometry::Delay;
use vimc4_ncp::job::{Options, Target, delays};
use vimc4_tests::jobs;

/// Movements that no controller, or not every one, makes at once. Up is away from the work-piece.
const MOVEMENTS: [(&str, &str); 7] = [
    ("helix, radius 10 mm, 0.5 mm down, 10 mm/s", "VEL 10000\nCWHLXREL I-10000 Z-500"),
    ("helix, radius 10 mm, 0.5 mm down, 50 mm/s", "VEL 50000\nCWHLXREL I-10000 Z-500"),
    ("helix, radius 10 mm, 5 mm down, 50 mm/s", "VEL 50000\nCWHLXREL I-10000 Z-5000"),
    ("circle in XZ, radius 10 mm, 20 mm/s", "VEL 20000\nPLANE XZ\nCWREL I-10000"),
    ("100 mm and 10° of A, 20 mm/s", "VEL 20000\nMOVEREL X100000 A36000"),
    ("100 mm and 0.5° of A, 20 mm/s", "VEL 20000\nMOVEREL X100000 A1800"),
    ("100 mm and 0.5° of A, 3 mm/s", "VEL 3000\nMOVEREL X100000 A1800"),
];

fn main() -> Result<(), String> {
    println!("| movement | machine | model | pieces | takes | could take | lost |");
    println!("|---|---|---|--:|--:|--:|--:|");
    for (what, movement) in MOVEMENTS {
        for machine in ["bench", "mill-4axis", "stage", "traverse"] {
            let machine = vimc4::machine(machine).map_err(|error| error.to_string())?;
            for model in ["imc4", "imc-s8"] {
                let model = vimc4::model(model).map_err(|error| error.to_string())?;
                let target = jobs::target(&model, &machine)?;
                let cost = cost(movement, &target).map_or_else(
                    || "1 | | | none".to_owned(),
                    |delay| {
                        let Delay { pieces, takes, could_take } = delay;
                        let lost = delay.share() * 100.0;
                        format!("{pieces} | {takes:.2} s | {could_take:.2} s | {lost:.0} %")
                    },
                );
                println!("| {what} | {} | {} | {cost} |", machine.name, model.name());
            }
        }
    }
    Ok(())
}

/// What the last movement costs, in the middle of the machine's travel.
fn cost(movement: &str, target: &Target) -> Option<Delay> {
    let z = if target.travel[2].1 == Some(0) { -50_000 } else { 50_000 };
    let text = format!("IMF_PBL_V1.0\nREF XYZA\nMOVEABS X100000 Y100000 Z{z}\n{movement}\n");
    let last = text.lines().count() as u32;
    let mut found = None;
    delays(&text, target, Options::default(), &mut |line, delay| {
        found = Some(delay).filter(|_| line == last);
    });
    found
}
