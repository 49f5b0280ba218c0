//! `vimc4 dap`: a debug adapter for editors.

mod live;
pub(crate) mod open;
mod server;

use std::io::{self, BufReader, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use crate::failure::Failure;
pub(crate) use live::Served;
use server::End;

#[derive(clap::Args)]
#[command(
    long_about = "\
Debug programs, jobs and recordings in an editor: a debug adapter on standard input and output

It speaks the Debug Adapter Protocol. The editor says what to debug: a file of commands, a
stored program, a plot, a job, a recording, or a controller behind ports that host software drives, and the
model and machine it is for. To controllers that run already it attaches with `vimc4 serve --dap`.
Editors set breakpoints in the lines of the file, step forward and back, look at axes, switches and the whole state of the
controller, and change them. docs/debugging.md has the settings for editors.

It ends when its client does. With --port it waits at a port of this computer instead, and every client
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
        let listener = bind(port)?;
        crate::output::print(&format!("debug adapter at {}\n", address(&listener)?))?;
        listen(&listener, None, &|text| drop(writeln!(io::stderr(), "{text}")));
        return Ok(ExitCode::SUCCESS);
    }
    let input = BufReader::new(io::stdin());
    let end = server::serve(input, io::stdout().lock(), None, |_| {})
        .map_err(|error| Failure::midway(format!("cannot write to the editor: {error}")))?;
    Ok(match end {
        End::Disconnected => ExitCode::SUCCESS,
        End::Vanished => ExitCode::FAILURE,
    })
}

/// Listens for editors of this computer: whoever may connect may open files, so nobody from elsewhere
/// may.
pub(crate) fn bind(port: u16) -> Result<TcpListener, Failure> {
    TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(|error| {
        Failure::usage(format!(
            "cannot listen at 127.0.0.1:{port}: {error}; choose another port, or 0 for a free one"
        ))
    })
}

/// Where that is.
pub(crate) fn address(listener: &TcpListener) -> Result<SocketAddr, Failure> {
    listener.local_addr().map_err(Failure::midway)
}

/// Waits for clients, for ever. They may attach to controllers that run already. `say` is told of a client
/// that speaks another protocol.
pub(crate) fn listen(
    listener: &TcpListener,
    served: Option<&Served>,
    say: &(impl Fn(&str) + Clone + Send + 'static),
) {
    let clients = Arc::new(AtomicUsize::new(0));
    for stream in listener.incoming() {
        let Ok(stream) = stream else { continue };
        if clients.fetch_add(1, Ordering::SeqCst) >= MOST_CLIENTS {
            // It is closed, which says so.
            clients.fetch_sub(1, Ordering::SeqCst);
            continue;
        }
        let own = Arc::clone(&clients);
        let (served, say) = (served.cloned(), say.clone());
        let talk = move || {
            // A client that leaves has nobody to be told why.
            let _ = talk(stream, served, say);
            own.fetch_sub(1, Ordering::SeqCst);
        };
        if thread::Builder::new().name("session".to_owned()).spawn(talk).is_err() {
            clients.fetch_sub(1, Ordering::SeqCst);
        }
    }
}

fn talk(
    stream: TcpStream,
    served: Option<Served>,
    say: impl Fn(&str) + Send + 'static,
) -> io::Result<()> {
    stream.set_nodelay(true)?;
    let input = BufReader::new(stream.try_clone()?);
    let client = stream.peer_addr()?;
    let refused = move |why: &str| {
        say(&format!("debug adapter: closed the connection of {client}: {why}"));
    };
    let mut output = stream;
    server::serve(input, &mut output, served, refused)?;
    output.flush()?;
    // Its reader is let go, too.
    output.shutdown(std::net::Shutdown::Both)
}
