//! What it costs that controllers make some movements in pieces, as a table.

use vimc4_ncp::geometry::Delay;
use vimc4_tests::jobs;
use vimc4_tests::pieces::{MACHINES, MOVEMENTS, cost, job};

fn main() -> Result<(), String> {
    println!("| movement | machine | model | pieces | takes | could take | lost |");
    println!("|---|---|---|--:|--:|--:|--:|");
    for (what, movement) in MOVEMENTS {
        for machine in MACHINES {
            let machine = vimc4::machine(machine).map_err(|error| error.to_string())?;
            for model in ["imc4", "imc-s8"] {
                let model = vimc4::model(model).map_err(|error| error.to_string())?;
                let target = jobs::target(&model, &machine)?;
                let cost = cost(&job(movement, &target), &target).map_or_else(
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
