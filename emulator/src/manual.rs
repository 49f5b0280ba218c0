//! `vimc4 man`: the help of every command as manual pages.

use std::fs;
use std::path::{Path, PathBuf};

use clap::builder::Resettable;
use clap::{Command, ValueHint};
use clap_mangen::Man;

use crate::failure::Failure;
use crate::output;

#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  vimc4 man man1

Where they are found by `man vimc4` and `man vimc4-serve`, if ~/.local/bin is on the PATH:
  vimc4 man ~/.local/share/man/man1

Exit codes: 0 written, 1 not all were written, 2 wrong usage.")]
pub(crate) struct Arguments {
    /// The folder, which is made if it is not there
    #[arg(value_name = "FOLDER", value_hint = ValueHint::DirPath)]
    folder: PathBuf,
}

pub(crate) fn run(arguments: &Arguments, command: Command) -> Result<(), Failure> {
    let folder = &arguments.folder;
    fs::create_dir_all(folder).map_err(|error| {
        let folder = folder.display();
        Failure::usage(format!("cannot make the folder {folder}: {error}; name another"))
    })?;
    // A page is the same for every system.
    let mut command = command.disable_help_subcommand(true).long_version(Resettable::Reset);
    command.build();
    let count = write(&command, folder)?;
    output::print(&format!("{count} pages in {}\n", folder.display()))
}

/// Writes the page of a command and of all below it, and counts them.
fn write(command: &Command, folder: &Path) -> Result<usize, Failure> {
    let page = Man::new(command.clone()).manual("virtual IMC4");
    let mut roff = Vec::new();
    let written = page.render(&mut roff).and_then(|()| {
        // A terminal of ASCII has no such dots, and man would leave them out. A line that begins with one
        // would be an order.
        let roff = String::from_utf8_lossy(&roff).replace('…', "\\&...");
        fs::write(folder.join(page.get_filename()), roff)
    });
    written.map_err(|error| {
        let name = page.get_filename();
        Failure::midway(format!("cannot write {name}: {error}; make room, and write all again"))
    })?;
    let mut shown = command.get_subcommands().filter(|below| !below.is_hide_set());
    shown.try_fold(1, |count, below| Ok(count + write(below, folder)?))
}
