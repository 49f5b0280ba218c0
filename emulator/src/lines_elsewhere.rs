//! `vimc4 lines` where there are no pseudo-terminals.

use std::ffi::OsString;
use std::process::ExitCode;

use crate::failure::Failure;
use crate::typed_options::TypedOptions;

/// Whatever somebody has read of it elsewhere.
#[derive(clap::Args)]
#[command(disable_help_flag = true)]
pub(crate) struct Arguments {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    _words: Vec<OsString>,
}

pub(crate) fn run(_: Arguments, _: &TypedOptions) -> Result<ExitCode, Failure> {
    Err(Failure::usage(
        "`vimc4 lines` is for pseudo-terminals, which this system does not have; a serial port has \
         modem lines of its own (`vimc4 serve --serial COM7`), and so has one over the network \
         (`vimc4 serve --rfc2217 127.0.0.1:2217`)",
    ))
}
