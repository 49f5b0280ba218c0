//! `vimc4 models` and `vimc4 machines`

use std::fs;

use vimc4::Error;

use crate::completions;
use crate::failure::Failure;
use crate::output;

#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  vimc4 models
  vimc4 machines
  vimc4 models show imc-s8
  vimc4 machines show mill

Exit codes: 0 printed, 2 wrong usage.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    show: Option<Show>,
}

#[derive(clap::Subcommand)]
enum Show {
    /// Print a profile as TOML, to start your own from
    #[command(after_long_help = "\
Examples:
  vimc4 models show imc4 > my.toml
  vimc4 machines show mill > mine.toml
  vimc4 serve --model my.toml --machine mine.toml

Exit codes: 0 printed, 2 there is no such profile, or something in it is wrong.")]
    Show {
        /// Its name, or a profile file, which is checked first
        #[arg(value_name = "NAME|FILE", add = completions::profiles())]
        name: String,
    },
}

pub(crate) fn models(arguments: Arguments) -> Result<(), Failure> {
    let title = |name: &str| Ok(vimc4::model(name)?.title().to_owned());
    list_or_show(arguments, &vimc4::models(), title, vimc4::model_profile)
}

pub(crate) fn machines(arguments: Arguments) -> Result<(), Failure> {
    let title = |name: &str| Ok(vimc4::machine(name)?.title.clone());
    list_or_show(arguments, &vimc4::machines(), title, vimc4::machine_profile)
}

fn list_or_show(
    arguments: Arguments,
    names: &[&str],
    title: impl Fn(&str) -> Result<String, Error>,
    profile: impl Fn(&str) -> Result<&'static str, Error>,
) -> Result<(), Failure> {
    let text = match arguments.show {
        Some(Show::Show { name }) => match profile(&name) {
            Ok(text) => text.to_owned(),
            Err(_) => {
                // What is not a name is a file; whether it holds a profile is known from its title.
                title(&name)?;
                fs::read_to_string(&name).map_err(|error| {
                    Failure::usage(format!("cannot read {name}: {error}; is it still there?"))
                })?
            }
        },
        None => {
            let line = |name: &&str| Ok(format!("{name:<15}{}\n", title(name)?));
            names.iter().map(line).collect::<Result<String, Error>>()?
        }
    };
    output::print(&text)
}
