//! Non-volatile memory in a file.

use std::borrow::Cow;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;
use vimc4_device::FlashChange;

/// No flash memory is as large as this.
const LARGEST: u64 = 64 * 1024 * 1024;

/// A file that holds the image of a device's flash memory, locked for this process.
///
/// Changes are [applied](FlashFile::apply) as the device hands them out and
/// [made durable](FlashFile::sync) before the bytes that follow them are sent, so that what was
/// answered `0` is on disk. The format is the device's own; that includes a last record torn by
/// a crash, which the device drops when it reads the image.
#[derive(Debug)]
pub struct FlashFile {
    path: PathBuf,
    file: File,
    /// How much of the file is whole.
    length: u64,
    dirty: bool,
}

/// Why a flash file cannot be used.
#[derive(Debug, Error)]
pub enum FlashFileError {
    /// Another process has it.
    #[error(
        "flash file {path} is in use by another emulator; give each one a file of its own",
        path = .0.display()
    )]
    InUse(PathBuf),
    /// It cannot be opened, created or read.
    #[error(
        "cannot open flash file {path}: {source}; name a file in a folder that can be written to",
        path = .path.display()
    )]
    Open {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// It is not a file that could hold a flash memory.
    #[error(
        "{path} is not a flash file, it is {what}; name a regular file, or one that does not exist yet",
        path = .path.display()
    )]
    NoFile {
        /// The path.
        path: PathBuf,
        /// What it is instead.
        what: &'static str,
    },
    /// It could not be written.
    #[error(
        "cannot write flash file {path}: {source}; what was not stored was not confirmed",
        path = .path.display()
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
}

impl FlashFile {
    /// Opens or creates the file and reads the image. An empty file is an empty memory.
    pub fn open(path: impl Into<PathBuf>) -> Result<(FlashFile, Vec<u8>), FlashFileError> {
        let path = path.into();
        let failed = |source| FlashFileError::Open { path: path.clone(), source };
        let unfit = |what| FlashFileError::NoFile { path: path.clone(), what };
        let mut file = loop {
            let file = OpenOptions::new()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .open(&path)
                .map_err(failed)?;
            // Reading a device or a pipe to its end may never come to one.
            let about = file.metadata().map_err(failed)?;
            if !about.is_file() {
                return Err(unfit("a device, a pipe or a folder"));
            }
            if about.len() > LARGEST {
                return Err(unfit("too large"));
            }
            lock(&file, &path)?;
            // Another emulator may have replaced the file between the two calls; what we hold
            // is then no longer what the name stands for.
            if is_at(&file, &path).map_err(failed)? {
                break file;
            }
        };
        let mut image = Vec::new();
        file.read_to_end(&mut image).map_err(failed)?;
        let length = u64::try_from(image.len()).unwrap_or(u64::MAX);
        // Behind a symbolic link the file is replaced, not the link.
        let path = fs::canonicalize(&path).map_err(failed)?;
        // A process that was killed may have left a part of a new image. The lock keeps it from being
        // the one of a living process.
        #[cfg(unix)]
        let _ = fs::remove_file(unfinished(&path));
        Ok((FlashFile { path, file, length, dirty: false }, image))
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a change. It is durable after the next [`sync`](FlashFile::sync).
    pub fn apply(&mut self, change: &FlashChange) -> Result<(), FlashFileError> {
        let done = match change {
            FlashChange::Append(bytes) => self.append(bytes),
            FlashChange::Replace(bytes) => self.replace(bytes),
        };
        done.map_err(|source| self.failed(source))
    }

    /// Makes everything that was applied durable. Without changes it costs nothing.
    pub fn sync(&mut self) -> Result<(), FlashFileError> {
        if self.dirty {
            self.file.sync_data().map_err(|source| self.failed(source))?;
            self.dirty = false;
        }
        Ok(())
    }

    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(self.length))?;
        if let Err(error) = self.file.write_all(bytes) {
            // A full disk may have taken a part: cut it off, so that the file stays whole.
            // Should that fail too, the device drops the torn record when it reads the image.
            let _ = self.file.set_len(self.length);
            return Err(error);
        }
        self.length += u64::try_from(bytes.len()).unwrap_or(u64::MAX);
        self.dirty = true;
        Ok(())
    }

    /// Puts a new file in the place of the old one, so that a crash leaves either the old or
    /// the new image.
    #[cfg(unix)]
    fn replace(&mut self, bytes: &[u8]) -> io::Result<()> {
        let fresh = unfinished(&self.path);
        let written = self.write_fresh(&fresh, bytes);
        if written.is_err() {
            let _ = fs::remove_file(&fresh);
        }
        self.file = written?;
        self.length = u64::try_from(bytes.len()).unwrap_or(u64::MAX);
        self.dirty = false;
        Ok(())
    }

    /// Writes the new image over the old one: another file cannot take the place of one that is open.
    /// The lock keeps everybody from reading a half, but a crash of the computer may leave one.
    #[cfg(not(unix))]
    fn replace(&mut self, bytes: &[u8]) -> io::Result<()> {
        let length = u64::try_from(bytes.len()).unwrap_or(u64::MAX);
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(bytes)?;
        self.file.set_len(length)?;
        self.file.sync_all()?;
        self.length = length;
        self.dirty = false;
        Ok(())
    }

    #[cfg(unix)]
    fn write_fresh(&self, fresh: &Path, bytes: &[u8]) -> io::Result<File> {
        let mut file =
            OpenOptions::new().read(true).write(true).create(true).truncate(true).open(fresh)?;
        // The new file is locked before it gets the name, so the name is never free.
        try_lock(&file)?;
        file.set_permissions(self.file.metadata()?.permissions())?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(fresh, &self.path)?;
        sync_folder(&self.path)?;
        Ok(file)
    }

    fn failed(&self, source: io::Error) -> FlashFileError {
        FlashFileError::Write { path: self.path.clone(), source }
    }
}

/// The file that becomes the new image. It always has the same name, which the lock on the flash file
/// keeps other processes away from.
#[cfg(unix)]
fn unfinished(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".vimc4-new");
    path.with_file_name(name)
}

/// An image as the device has written it, in a file that a program took for a text of Windows: git
/// does so on the way to a working folder.
#[must_use]
pub fn unix_lines(image: &[u8]) -> Cow<'_, [u8]> {
    let ends = |end: &[u8]| image.windows(end.len()).filter(|bytes| *bytes == end).count();
    if image.is_empty() || ends(b"\n") == 0 || ends(b"\n") != ends(b"\r\n") {
        return Cow::Borrowed(image);
    }
    let mut lines = Vec::with_capacity(image.len());
    for line in image.split_inclusive(|&byte| byte == b'\n') {
        match line.strip_suffix(b"\r\n") {
            Some(line) => {
                lines.extend_from_slice(line);
                lines.push(b'\n');
            }
            None => lines.extend_from_slice(line),
        }
    }
    Cow::Owned(lines)
}

fn lock(file: &File, path: &Path) -> Result<(), FlashFileError> {
    try_lock(file).map_err(|error| match error {
        TryLockError::WouldBlock => FlashFileError::InUse(path.to_owned()),
        TryLockError::Error(source) => FlashFileError::Open { path: path.to_owned(), source },
    })
}

/// Locks a file. A file system without locks is no reason to refuse it.
fn try_lock(file: &File) -> Result<(), TryLockError> {
    match file.try_lock() {
        Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => Ok(()),
        locked => locked,
    }
}

/// Whether a file that was opened is still the one at a path: another may have been put in its place.
///
/// # Errors
///
/// If the operating system does not tell.
#[cfg(unix)]
pub fn is_at(file: &File, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let here = file.metadata()?;
    match fs::metadata(path) {
        Ok(there) => Ok((here.dev(), here.ino()) == (there.dev(), there.ino())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Whether a file that was opened is still the one at a path: an open file stays there here.
///
/// # Errors
///
/// None.
#[cfg(not(unix))]
pub fn is_at(_: &File, _: &Path) -> io::Result<bool> {
    Ok(true)
}

/// A renamed file is durable only when its folder is.
#[cfg(unix)]
fn sync_folder(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    File::open(folder.unwrap_or(Path::new(".")))?.sync_all()
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;

    fn append(bytes: &'static [u8]) -> FlashChange {
        FlashChange::Append(Bytes::from_static(bytes))
    }

    fn replace(bytes: &'static [u8]) -> FlashChange {
        FlashChange::Replace(Bytes::from_static(bytes))
    }

    #[test]
    fn what_was_written_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flash.bin");
        let (mut flash, image) = FlashFile::open(&path).unwrap();
        assert!(image.is_empty());
        flash.apply(&append(b"one\n")).unwrap();
        flash.apply(&append(b"two\n")).unwrap();
        flash.sync().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"one\ntwo\n");
        flash.apply(&replace(b"new\n")).unwrap();
        flash.apply(&append(b"three\n")).unwrap();
        flash.sync().unwrap();
        drop(flash);
        let (_, image) = FlashFile::open(&path).unwrap();
        assert_eq!(image, b"new\nthree\n");
        // Nothing is left beside it.
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn what_a_killed_process_left_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flash.bin");
        let unfinished = folder.path().join("flash.bin.vimc4-new");
        let (flash, _) = FlashFile::open(&path).unwrap();
        fs::write(&unfinished, "half").unwrap();
        // It may belong to the process that holds the file.
        assert!(FlashFile::open(&path).is_err());
        assert!(unfinished.exists());
        drop(flash);
        let (_flash, image) = FlashFile::open(&path).unwrap();
        assert!(image.is_empty() && !unfinished.exists());
    }

    #[test]
    fn two_emulators_never_share_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flash.bin");
        let (mut flash, _) = FlashFile::open(&path).unwrap();
        assert!(matches!(FlashFile::open(&path), Err(FlashFileError::InUse(_))));
        // The lock moves to the file that replaces it.
        flash.apply(&replace(b"new\n")).unwrap();
        assert!(matches!(FlashFile::open(&path), Err(FlashFileError::InUse(_))));
        drop(flash);
        assert!(FlashFile::open(&path).is_ok());
    }

    #[test]
    fn what_cannot_be_opened_says_so() {
        let folder = tempfile::tempdir().unwrap();
        let error = FlashFile::open(folder.path().join("none").join("flash.bin")).unwrap_err();
        assert!(error.to_string().contains("cannot open flash file"), "{error}");
        let error = FlashFile::open(folder.path()).unwrap_err();
        assert!(matches!(error, FlashFileError::Open { .. }));
        let error = FlashFile::open("/dev/zero").unwrap_err();
        assert!(matches!(error, FlashFileError::NoFile { .. }));
    }

    #[test]
    fn what_cannot_be_written_says_so_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sub").join("flash.bin");
        fs::create_dir(folder.path().join("sub")).unwrap();
        let (mut flash, _) = FlashFile::open(&path).unwrap();
        fs::remove_dir_all(folder.path().join("sub")).unwrap();
        let error = flash.apply(&replace(b"new\n")).unwrap_err();
        assert!(matches!(error, FlashFileError::Write { .. }), "{error}");
    }
}
