//! Which file a path leads to.

use std::fs;
use std::path::{Path, PathBuf};

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
