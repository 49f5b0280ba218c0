//! `vimc4 machines`

use crate::failure::Failure;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    show: Option<Show>,
}

#[derive(clap::Subcommand)]
enum Show {
    /// Print the profile of a machine as TOML, to start your own from
    Show {
        /// Its name
        name: String,
    },
}

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    match arguments.show {
        Some(Show::Show { name }) => print!("{}", vimc4::machine_profile(&name)?),
        None => {
            for name in vimc4::machines() {
                println!("{name:<12}{}", vimc4::machine(name)?.title);
            }
        }
    }
    Ok(())
}
