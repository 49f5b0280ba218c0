//! The control API of `vimc4 serve`.

mod debugger;

use std::io::ErrorKind;
use std::net::ToSocketAddrs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use vimc4::Emulator;
use vimc4_api::{Open, Place, Server, ServerError, Token};

use crate::failure::Failure;

/// Where the token may stand instead of in a file.
const TOKEN: &str = "VIMC4_HTTP_TOKEN";

/// Where `--web` listens.
const HERE: &str = "127.0.0.1:0";

#[derive(clap::Args)]
// Other structures of options have the same name, and clap would make a group of each.
#[group(skip)]
pub(crate) struct Arguments {
    /// Let programs and browsers see and steer the controllers over HTTP at this address, as docs/api.md
    /// says; port 0 is a free one. Other computers need a token
    #[arg(long, value_name = "ADDR", add = crate::completions::words(&["127.0.0.1:8080", "127.0.0.1:0"]))]
    http: Option<String>,
    /// The same for the browser of this computer: at 127.0.0.1, with a free port unless --http says one
    #[arg(long)]
    web: bool,
    /// Let in only who has the token in this file, or in the environment variable VIMC4_HTTP_TOKEN: at least 16
    /// letters, digits or signs. The file counts where both are given
    #[arg(long, value_name = "FILE")]
    http_token: Option<PathBuf>,
}

/// The address at which the API will listen, if it is wanted: one that is not to be had is found before
/// anything is started.
impl Arguments {
    /// Whether requests are answered.
    pub(crate) fn is_meant(&self) -> bool {
        self.http.is_some() || self.web
    }

    /// The file of the token, if there is one.
    pub(crate) fn token_file(&self) -> Option<&Path> {
        self.http_token.as_deref()
    }
}

pub(crate) fn place(arguments: &Arguments) -> Result<Option<Place>, Failure> {
    let address = match (&arguments.http, arguments.web) {
        (Some(address), _) => address,
        (None, true) => HERE,
        (None, false) if arguments.http_token.is_some() => {
            return Err(Failure::usage("--http-token is for --http; give that, or --web, too"));
        }
        (None, false) => return Ok(None),
    };
    if address.to_socket_addrs().is_err_and(|error| error.kind() == ErrorKind::InvalidInput) {
        let port = address.trim_start_matches(':').parse().unwrap_or(8_080_u16);
        return Err(Failure::usage(format!(
            "`{address}` is no address; write HOST:PORT, as in 127.0.0.1:{port}"
        )));
    }
    let token = token(arguments.http_token.as_deref())?;
    Place::take(address, token).map(Some).map_err(Failure::usage)
}

fn token(file: Option<&Path>) -> Result<Option<Token>, Failure> {
    let text = match (file, std::env::var(TOKEN)) {
        (Some(file), _) => std::fs::read_to_string(file).map_err(|error| {
            Failure::usage(format!(
                "cannot read the token in {}: {error}; name a file that has nothing else in it",
                file.display()
            ))
        })?,
        (None, Ok(text)) => text,
        (None, Err(_)) => return Ok(None),
    };
    Token::new(&text)
        .map(Some)
        .map_err(|right| Failure::usage(format!("the token is unfit; {right}")))
}

/// Serves the controllers there. They can be debugged if nobody else does, and the line is a plain one.
pub(crate) async fn start(
    place: Place,
    emulators: &[Emulator],
    can_debug: bool,
) -> Result<Server, Failure> {
    let debugger = can_debug.then(|| Arc::new(debugger::open) as Open);
    let server = Server::start(place, emulators, debugger).await;
    server.map_err(|error: ServerError| Failure::midway(error))
}
