//! A stable name for a PTY.

use std::fs;
use std::io;
use std::os::unix::fs::{MetadataExt, symlink};
use std::path::{Path, PathBuf, absolute};

use thiserror::Error;

use super::users::Users;

/// A symbolic link to a PTY, removed when dropped if it is still ours.
#[derive(Debug)]
pub struct PtyLink {
    path: PathBuf,
    target: PathBuf,
}

/// Why a link cannot be made.
#[derive(Debug, Error)]
pub enum LinkError {
    /// The name belongs to something else.
    #[error(
        "{path} exists and is no link to a PTY; remove it or choose another name for the link",
        path = .0.display()
    )]
    Occupied(PathBuf),
    /// An emulator that is still running has the name.
    #[error(
        "{path} belongs to {holder}, which is still running; end it, choose another name for the \
         link, or take this one over (--replace)",
        path = .path.display()
    )]
    Held {
        /// The link.
        path: PathBuf,
        /// The emulator that has it.
        holder: String,
    },
    /// The operating system does not let us.
    #[error(
        "cannot make the link {path}: {source}; choose a name in a folder that exists and can be \
         written to",
        path = .path.display()
    )]
    Failed {
        /// The link.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
}

impl PtyLink {
    /// Whether [`create`](PtyLink::create) would be allowed to use the name: it is free, or a link
    /// that leads nowhere or to a PTY at which nobody answers. With `replace` it may be one of a
    /// running emulator as well.
    ///
    /// A number of a PTY is given out again when its owner has gone. So a link that is left of an
    /// emulator that was killed may lead to somebody's terminal window, or to another emulator. The
    /// PTY is younger than the link then, and what tells an emulator is that it holds both ends.
    pub fn check(path: &Path, replace: bool) -> Result<(), LinkError> {
        match fs::symlink_metadata(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            Err(source) => Err(LinkError::Failed { path: path.to_owned(), source }),
            Ok(found) if !found.is_symlink() => Err(LinkError::Occupied(path.to_owned())),
            Ok(link) => {
                let target = fs::read_link(path)
                    .map_err(|source| LinkError::Failed { path: path.to_owned(), source })?;
                let dangling =
                    fs::metadata(path).is_err_and(|error| error.kind() == io::ErrorKind::NotFound);
                if !dangling && !target.starts_with("/dev/pts") {
                    return Err(LinkError::Occupied(path.to_owned()));
                }
                match holder(&target, &link) {
                    Some(holder) if !replace => {
                        Err(LinkError::Held { path: path.to_owned(), holder })
                    }
                    _ => Ok(()),
                }
            }
        }
    }

    /// Makes the link, or moves it here from a PTY that is gone. At any moment the name leads to
    /// the old link or the new one, never to none.
    pub fn create(path: &Path, target: &Path, replace: bool) -> Result<PtyLink, LinkError> {
        // A link of an emulator that was killed may lead to our own terminal, which has got the
        // same number.
        let ours_already = fs::read_link(path).is_ok_and(|old| old == target);
        PtyLink::check(path, replace || ours_already)?;
        let failed = |source| LinkError::Failed { path: path.to_owned(), source };
        // The link must be found again when the working directory has changed.
        let path = absolute(path).map_err(failed)?;
        let name = path.file_name().ok_or_else(|| failed(io::ErrorKind::InvalidInput.into()))?;
        let mut fresh = std::ffi::OsString::from(".");
        fresh.push(name);
        fresh.push(format!(".{}.new", std::process::id()));
        let fresh = path.with_file_name(fresh);
        let _ = fs::remove_file(&fresh);
        symlink(target, &fresh).map_err(failed)?;
        if let Err(source) = fs::rename(&fresh, &path) {
            let _ = fs::remove_file(&fresh);
            return Err(failed(source));
        }
        Ok(PtyLink { target: target.to_owned(), path })
    }

    /// The name, absolute.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// The program that answers at a PTY, in words.
fn holder(target: &Path, link: &fs::Metadata) -> Option<String> {
    let made = fs::metadata(target).ok()?;
    if (made.ctime(), made.ctime_nsec()) > (link.mtime(), link.mtime_nsec()) {
        return None;
    }
    let users = Users::of(target).ok()?;
    if let Some(user) = users.server() {
        return Some(match user.process == std::process::id() {
            true => "another controller of this program".to_owned(),
            false => format!("{} (process {})", user.name, user.process),
        });
    }
    // A PTY of somebody else exists as long as somebody holds its near end, whom we may not see.
    let owner = made.uid();
    let other = !users.all_looked_at && owner != rustix::process::geteuid().as_raw();
    other.then(|| format!("a program of another user (number {owner})"))
}

impl Drop for PtyLink {
    fn drop(&mut self) {
        // Another emulator may have taken the name over.
        if fs::read_link(&self.path).is_ok_and(|target| target == self.target) {
            let _ = fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use serialport::{SerialPort, TTYPort};

    use super::*;

    #[test]
    fn a_link_replaces_only_what_was_a_link_to_a_pty() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("vimc4.pty");
        // Free, dangling, into /dev/pts: allowed.
        drop(PtyLink::create(&path, Path::new("/dev/pts/99990"), false).unwrap());
        assert!(!path.is_symlink());
        symlink("/nowhere/at/all", &path).unwrap();
        let first = PtyLink::create(&path, Path::new("/dev/pts/99990"), false).unwrap();
        let second = PtyLink::create(&path, Path::new("/dev/pts/99991"), false).unwrap();
        assert_eq!(fs::read_link(&path).unwrap(), Path::new("/dev/pts/99991"));
        // The first one has lost the name and must not take it away from the second.
        drop(first);
        assert!(path.is_symlink());
        drop(second);
        assert!(!path.is_symlink());
        // A file, a folder, a link to a file: somebody's own.
        fs::write(&path, "precious").unwrap();
        let refused = PtyLink::create(&path, Path::new("/dev/pts/99990"), false).unwrap_err();
        assert!(matches!(refused, LinkError::Occupied(_)), "{refused}");
        let other = folder.path().join("other");
        symlink(&path, &other).unwrap();
        assert!(PtyLink::create(&other, Path::new("/dev/pts/99990"), false).is_err());
        assert!(PtyLink::create(folder.path(), Path::new("/dev/pts/99990"), false).is_err());
        assert_eq!(fs::read(&path).unwrap(), b"precious");
        // One that was left behind leads to the very terminal that is to be named.
        let (near, far) = TTYPort::pair().unwrap();
        let target = PathBuf::from(far.name().unwrap());
        let left = folder.path().join("left.pty");
        symlink(&target, &left).unwrap();
        assert!(matches!(PtyLink::check(&left, false), Err(LinkError::Held { .. })));
        drop(PtyLink::create(&left, &target, false).unwrap());
        drop((near, far));
        // A folder that is not there.
        let nowhere = folder.path().join("none").join("link");
        let failed = PtyLink::create(&nowhere, Path::new("/dev/pts/99990"), false).unwrap_err();
        assert!(matches!(failed, LinkError::Failed { .. }), "{failed}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
