//! `vimc4 completions`

use clap::CommandFactory;
use clap_complete::Shell;

use crate::failure::Failure;
use crate::output;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// For which shell
    shell: Shell,
}

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    let mut command = crate::Arguments::command();
    // It takes a writer that cannot fail.
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "vimc4", &mut script);
    output::print(&String::from_utf8_lossy(&script))
}
