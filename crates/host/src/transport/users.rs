//! Which programs have a terminal open, as Linux tells.

use std::fs;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// A program that has a terminal open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct User {
    /// The number of the process.
    pub process: u32,
    /// What the process is called, fifteen characters at most.
    pub name: String,
    /// How many descriptors of the terminal it has.
    pub(super) descriptors: usize,
    /// Of how many of them it can read.
    pub(super) readers: usize,
    /// It has the near end of this pseudo-terminal as well: it is what answers there.
    pub serves: bool,
}

/// The programs that have a terminal open.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Users {
    /// Those that could be seen.
    pub seen: Vec<User>,
    /// No process refused to be looked at. Without that there may be more, of other people.
    pub all_looked_at: bool,
}

impl Users {
    /// Looks through the open files of all processes, which takes some milliseconds.
    ///
    /// # Errors
    ///
    /// If there is no such terminal.
    pub fn of(terminal: &Path) -> io::Result<Users> {
        let file = fs::metadata(terminal)?;
        Ok(Users::of_file((file.dev(), file.ino()), index(terminal)))
    }

    /// The one that answers at this pseudo-terminal.
    #[must_use]
    pub fn server(&self) -> Option<&User> {
        self.seen.iter().find(|user| user.serves)
    }

    /// The same by device and inode.
    pub(super) fn of_file(wanted: (u64, u64), index: Option<u32>) -> Users {
        let mut users = Users { seen: Vec::new(), all_looked_at: cfg!(target_os = "linux") };
        let Ok(processes) = fs::read_dir("/proc") else {
            users.all_looked_at = false;
            return users;
        };
        for process in processes.flatten() {
            let Some(number) = process.file_name().to_str().and_then(|name| name.parse().ok())
            else {
                continue;
            };
            let files = match fs::read_dir(process.path().join("fd")) {
                Ok(files) => files,
                Err(error) if error.kind() == io::ErrorKind::PermissionDenied => {
                    users.all_looked_at = false;
                    continue;
                }
                // It has ended meanwhile.
                Err(_) => continue,
            };
            let (mut descriptors, mut readers, mut near) = (0, 0, false);
            for file in files.flatten() {
                let path = file.path();
                let about_it = || process.path().join("fdinfo").join(file.file_name());
                if let Ok(about) = fs::metadata(&path)
                    && (about.dev(), about.ino()) == wanted
                {
                    descriptors += 1;
                    readers += usize::from(can_be_read(&about_it()));
                } else if index.is_some() && !near && is_near_end(&path) {
                    near = index_of_near_end(&about_it()) == index;
                }
            }
            if descriptors > 0 {
                let name = fs::read_to_string(process.path().join("comm")).unwrap_or_default();
                let name = name.trim_end().to_owned();
                users.seen.push(User { process: number, name, descriptors, readers, serves: near });
            }
        }
        users
    }
}

/// The number in `/dev/pts/3`.
fn index(terminal: &Path) -> Option<u32> {
    let path = fs::canonicalize(terminal).ok()?;
    path.strip_prefix("/dev/pts").ok()?.to_str()?.parse().ok()
}

fn is_near_end(file: &Path) -> bool {
    fs::read_link(file).is_ok_and(|to| to.ends_with("ptmx"))
}

/// Whether the system says of an open file that it was opened for more than writing.
fn can_be_read(about: &Path) -> bool {
    let about = fs::read_to_string(about).unwrap_or_default();
    let flags = about.lines().find_map(|line| line.strip_prefix("flags:"));
    // The lowest bits of an octal number; 1 is for writing only.
    flags.is_some_and(|flags| !flags.trim().ends_with(['1', '5']))
}

/// What the system says of an open near end: `tty-index:` and its number.
fn index_of_near_end(about: &Path) -> Option<u32> {
    let about = fs::read_to_string(about).ok()?;
    about.lines().find_map(|line| line.strip_prefix("tty-index:"))?.trim().parse().ok()
}
