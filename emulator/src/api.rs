//! The control API of `vimc4 serve`.

use std::path::{Path, PathBuf};

use std::sync::Arc;

use serde_json::Value;
use vimc4::{Control, Emulator};
use vimc4_api::{Debugging, Open, Place, Server, ServerError, Token};
use vimc4_device::Device;

use crate::console::session::{Cancel, Outcome, Session, Wrong};
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
    /// Let in only who has the token in this file, or in the environment variable VIMC4_HTTP_TOKEN
    #[arg(long, value_name = "FILE")]
    http_token: Option<PathBuf>,
}

/// The address at which the API will listen, if it is wanted: one that is not to be had is found before
/// anything is started.
pub(crate) fn place(arguments: &Arguments) -> Result<Option<Place>, Failure> {
    let address = match (&arguments.http, arguments.web) {
        (Some(address), _) => address,
        (None, true) => HERE,
        (None, false) if arguments.http_token.is_some() => {
            return Err(Failure::usage("--http-token is for --http; give that, or --web, too"));
        }
        (None, false) => return Ok(None),
    };
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
    let debugger = can_debug.then(|| Arc::new(open) as Open);
    let server = Server::start(place, emulators, debugger).await;
    server.map_err(|error: ServerError| Failure::midway(error))
}

// --- the debugger ---

/// A session of the console whose lines come by requests.
struct Console {
    session: Session,
    is_over: bool,
}

fn open(control: &Control) -> Result<(Box<dyn Debugging>, vimc4_api::Cancel), String> {
    let cancel = Cancel::default();
    let session = Session::beside(control, "the API", cancel.clone()).map_err(|Wrong(why)| why)?;
    Ok((Box::new(Console { session, is_over: false }), Arc::new(move || cancel.wish())))
}

impl Debugging for Console {
    fn carry_out(&mut self, line: &str) -> Result<String, String> {
        match self.session.carry_out_once(line) {
            Ok(Outcome::Said(said)) => Ok(said),
            Ok(Outcome::Quit) => {
                self.is_over = true;
                Ok(String::new())
            }
            Ok(Outcome::Screen | Outcome::Picture(..) | Outcome::Source(_)) => {
                Err(format!("`{line}` is for a terminal; `vimc4 console` has one"))
            }
            Err(Wrong(wrong)) => Err(wrong),
        }
    }

    fn view(&self) -> Value {
        let (debugger, at) = (&self.session.debugger, self.session.debugger.now());
        serde_json::to_value(debugger.device().view(at)).unwrap_or_default()
    }

    fn is_over(&self) -> bool {
        self.is_over
    }
}
