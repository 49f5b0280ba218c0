//! `vimc4 dap`: a debug adapter for editors.

mod open;
mod server;

use std::io::{self, BufReader, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use crate::failure::Failure;
use server::End;

#[derive(clap::Args)]
#[command(
    long_about = "\
Debug programs, jobs and recordings in an editor: a debug adapter on standard input and output

It speaks the Debug Adapter Protocol. What is debugged is said by the editor: a file of commands, a
stored program, a plot, a job or a recording, and the model and machine it is for. Editors set
breakpoints in the lines of the file, step forward and back, look at axes, switches and the whole state of the
controller, and change them. docs/debugging.md has the settings for editors.

It ends with its client. With --port it waits at a port of this computer instead, and every client
that connects has a session of its own.",
    after_long_help = "\
Examples:
  vimc4 dap --port 4711
  Neovim, with nvim-dap:
    dap.adapters.vimc4 = { type = \"executable\", command = \"vimc4\", args = { \"dap\" } }

Exit codes: 0 the client said disconnect, 1 it left without, 2 wrong usage."
)]
pub(crate) struct Arguments {
    /// Wait for clients at this port of this computer; 0 picks a free one and prints it
    #[arg(long, value_name = "PORT")]
    port: Option<u16>,
}

/// So many clients have a session at once.
const MOST_CLIENTS: usize = 16;

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    if let Some(port) = arguments.port {
        return listen(port);
    }
    let input = BufReader::new(io::stdin());
    let end = server::serve(input, io::stdout().lock())
        .map_err(|error| Failure::midway(format!("cannot write to the editor: {error}")))?;
    Ok(match end {
        End::Disconnected => ExitCode::SUCCESS,
        End::Vanished => ExitCode::FAILURE,
    })
}

/// Waits for clients, for ever.
fn listen(port: u16) -> Result<ExitCode, Failure> {
    // Whoever may connect may open files, so nobody from elsewhere may.
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(|error| {
        Failure::usage(format!(
            "cannot listen at 127.0.0.1:{port}: {error}; choose another port, or 0 for a free one"
        ))
    })?;
    let address = listener.local_addr().map_err(Failure::midway)?;
    crate::output::print(&format!("debug adapter at {address}\n"))?;
    let clients = Arc::new(AtomicUsize::new(0));
    for stream in listener.incoming() {
        let Ok(stream) = stream else { continue };
        if clients.fetch_add(1, Ordering::SeqCst) >= MOST_CLIENTS {
            // It is closed, which says so.
            clients.fetch_sub(1, Ordering::SeqCst);
            continue;
        }
        let own = Arc::clone(&clients);
        let talk = move || {
            // A client that leaves has nobody to be told why.
            let _ = talk(stream);
            own.fetch_sub(1, Ordering::SeqCst);
        };
        if thread::Builder::new().name("session".to_owned()).spawn(talk).is_err() {
            clients.fetch_sub(1, Ordering::SeqCst);
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn talk(stream: TcpStream) -> io::Result<()> {
    stream.set_nodelay(true)?;
    let input = BufReader::new(stream.try_clone()?);
    let mut output = stream;
    server::serve(input, &mut output)?;
    output.flush()?;
    // Its reader is let go, too.
    output.shutdown(std::net::Shutdown::Both)
}
