//! `vimc4 ncp lsp`: a language server for job files, on standard input and output.
//!
//! A separate thread reads, so that all changes are known before a file is checked again.

mod document;
mod messages;
mod parent;
mod server;
mod show;

use std::io::{self, BufWriter, Write};
use std::process::ExitCode;
use std::sync::mpsc::{self, Receiver, Sender, TryRecvError};
use std::thread;

use vimc4_dap::framing::Decoder;

use crate::completions;
use crate::failure::Failure;
use crate::job::source::{JobOptions, Site};

use messages::{Incoming, LARGEST, Outgoing};
use server::Server;

#[derive(clap::Args)]
#[command(
    long_about = "\
Help editors with job files: a language server on standard input and output

It tells what `vimc4 ncp check` tells, as you type, and fixes what has only one fix; it
explains commands and their words, shows lengths in mm, offers what fits, formats and colours, folds
and lists the parts of a job, and finds where registers and tools are set and used.

It ends when its client does: with its input, and on Linux also with the process that started
it.",
    after_long_help = "\
Examples:
  Helix, languages.toml:
    [language-server.vimc4]
    command = \"vimc4\"
    args = [\"ncp\", \"lsp\", \"--machine\", \"mill\"]
  Neovim:
    vim.lsp.start({ name = \"vimc4\", cmd = { \"vimc4\", \"ncp\", \"lsp\" } })

Exit codes: 0 the client said shutdown before it said exit, 1 it did not, 2 wrong usage."
)]
pub(crate) struct Arguments {
    /// The model of controller: a name from `vimc4 models`, or a profile file
    #[arg(long, value_name = "NAME|FILE", default_value = "imc4", add = completions::models())]
    model: String,
    /// The machine: a name from `vimc4 machines`, or a profile file
    #[arg(long, value_name = "NAME|FILE", default_value = "bench", add = completions::machines())]
    machine: String,
    #[command(flatten)]
    options: JobOptions,
}

/// Serves until the client says `exit` or is gone; the exit code is 0 if it said `shutdown`.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let mut site = Site::new(&arguments.model, &arguments.machine)?;
    arguments.options.zeros.set(&mut site)?;
    let mut server = Server::new(site.target, arguments.options.reading, parent::guard);
    let (sender, incoming) = mpsc::channel();
    thread::spawn(move || read(&sender));
    let mut out = BufWriter::new(io::stdout().lock());
    let asked_for = serve(&mut server, &incoming, &mut out)
        .map_err(|error| Failure::midway(format!("cannot write to the editor: {error}")))?;
    Ok(if asked_for { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Reads until the end of the input; an error is an end, too.
fn read(sender: &Sender<Incoming>) {
    let mut input = io::stdin().lock();
    let mut decoder = Decoder::new(LARGEST);
    while let Ok(Some(message)) = messages::read(&mut input, &mut decoder) {
        if sender.send(message).is_err() {
            return;
        }
    }
}

/// Answers messages, and checks changed files while there are none. Says whether the end was
/// asked for.
fn serve(
    server: &mut Server,
    incoming: &Receiver<Incoming>,
    out: &mut impl Write,
) -> io::Result<bool> {
    loop {
        let message = match incoming.try_recv() {
            Ok(message) => Some(message),
            Err(TryRecvError::Disconnected) => None,
            Err(TryRecvError::Empty) => {
                if let Some(diagnostics) = server.check_next() {
                    diagnostics.write(out)?;
                    continue;
                }
                incoming.recv().ok()
            }
        };
        let Some(message) = message.filter(|message| !message.is_exit()) else {
            return Ok(server.is_shut_down());
        };
        let answers: Vec<Outgoing> = server.receive(message);
        answers.iter().try_for_each(|answer| answer.write(out))?;
    }
}
