//! The default places of a controller behind ports, and those of each of several.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::output::must_be_file;
use crate::streams::{is_file, is_null};

/// The default address at which it listens.
pub(crate) const LISTENS: &str = "127.0.0.1:4004";

/// The default link to a pseudo-terminal.
pub(crate) const PTY: &str = "./vimc4.pty";

/// The link that is wanted by `--pty` and `--replace`. Where there are no pseudo-terminals, only a user who
/// asks for one is told.
pub(crate) fn link(pty: Option<&Path>, replace: bool) -> Option<PathBuf> {
    let link = pty.or_else(|| (cfg!(unix) || replace).then_some(Path::new(PTY)))?;
    (link != Path::new("none")).then(|| link.to_owned())
}

/// `flash.bin` becomes `flash-2.bin` for the second of several.
pub(crate) fn numbered(path: &Path, number: Option<u16>) -> PathBuf {
    let (Some(number), Some(stem)) = (number, path.file_stem()) else { return path.to_owned() };
    let mut name = OsString::from(stem);
    name.push(format!("-{number}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// The number that is put into the name of a file of which each of several controllers has its own. All of
/// them have the same place where everything is lost.
///
/// # Errors
///
/// If it is no file, of which there cannot be several.
pub(crate) fn in_name(path: &Path, number: Option<u16>) -> Result<Option<u16>, Failure> {
    if number.is_some() && !is_file(path) && !is_null(path) {
        return Err(Failure::usage(format!(
            "{} is one stream, and each of several controllers needs a file of its own; name a file, to \
             which the number of each is added: of out.csv the second has out-2.csv",
            path.display()
        )));
    }
    Ok(number.filter(|_| !is_null(path)))
}

/// The file of the memory that keeps, of which each of several controllers has its own.
///
/// # Errors
///
/// If it is no file.
pub(crate) fn of_flash(path: &Path, number: Option<u16>) -> Result<PathBuf, Failure> {
    must_be_file(path, "what is kept is read at the beginning and written over")?;
    Ok(numbered(path, number))
}

/// The address with a port that is `more` higher; port 0 stays, it means any.
pub(crate) fn counted_up(address: &str, more: u16) -> Result<String, Failure> {
    let split = address.rsplit_once(':').and_then(|(host, port)| Some((host, port.parse().ok()?)));
    let Some((host, port)) = split else { return Ok(address.to_owned()) };
    match port {
        0 => Ok(address.to_owned()),
        port => {
            u16::checked_add(port, more).map(|port| format!("{host}:{port}")).ok_or_else(|| {
                Failure::usage(format!(
                    "there are not enough ports above {port}; choose a lower one, or port 0"
                ))
            })
        }
    }
}
