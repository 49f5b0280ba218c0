//! Which file a path leads to.

use std::fs;
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::text;

/// Refuses to write over what is read, or over what is written as well. Devices take both. `-` is read from
/// standard input, which may be a file.
pub(crate) fn none_twice<'a>(
    inputs: impl IntoIterator<Item = &'a Path>,
    outputs: impl IntoIterator<Item = &'a Path>,
) -> Result<(), Failure> {
    let read = |path: &'a Path| match path == Path::new("-") {
        true => Identity::of(Path::new("/dev/stdin")),
        false => Identity::of(path),
    };
    let mut named: Vec<Identity> = inputs.into_iter().map(read).collect();
    let is_file = |path: &&Path| fs::metadata(path).map_or(true, |found| found.is_file());
    for path in outputs.into_iter().filter(is_file) {
        let identity = Identity::of(path);
        if named.contains(&identity) {
            return Err(Failure::usage(format!(
                "{} is named twice, and would be overwritten; write into a file of another name",
                text::name(path)
            )));
        }
        named.push(identity);
    }
    Ok(())
}

/// The profile files among the names of a model and a machine: the other names are built in.
pub(crate) fn profile_files<'a>(
    model: Option<&'a str>,
    machine: Option<&'a str>,
) -> impl Iterator<Item = &'a Path> {
    let model = model.filter(|name| vimc4::model_profile(name).is_err());
    let machine = machine.filter(|name| vimc4::machine_profile(name).is_err());
    model.into_iter().chain(machine).map(Path::new)
}

/// Which file a path leads to, however it is written.
#[derive(PartialEq, Eq)]
pub(crate) enum Identity {
    /// The device and the number of a file that is there, which hard links share.
    #[cfg(unix)]
    Number(u64, u64),
    /// The whole path.
    Path(PathBuf),
}

impl Identity {
    pub(crate) fn of(path: &Path) -> Identity {
        #[cfg(unix)]
        if let Ok(metadata) = fs::metadata(path) {
            use std::os::unix::fs::MetadataExt;
            return Identity::Number(metadata.dev(), metadata.ino());
        }
        Identity::Path(fs::canonicalize(path).unwrap_or_else(|_| {
            // A file that is not there yet, in a folder that is.
            let folder = match path.parent() {
                Some(folder) if folder != Path::new("") => folder,
                _ => Path::new("."),
            };
            let folder = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
            folder.join(path.file_name().unwrap_or_default())
        }))
    }
}
