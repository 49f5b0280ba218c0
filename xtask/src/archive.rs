//! Archives whose bytes depend on nothing but what is in them: tar with gzip, zip, and ar.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

use flate2::Compression;
use flate2::write::{DeflateEncoder, GzEncoder};
use rawzip::time::UtcDateTime;
use rawzip::{CompressionMethod, ZipArchiveWriter};
use tar::{EntryType, Header};

use crate::tool::Outcome;

/// A file of an archive.
#[derive(Clone)]
pub(crate) struct Entry {
    /// Its path in the archive, with `/`.
    pub(crate) path: String,
    pub(crate) bytes: Vec<u8>,
    /// Whether it is a program.
    is_program: bool,
}

impl Entry {
    pub(crate) fn file(path: impl Into<String>, bytes: impl Into<Vec<u8>>) -> Entry {
        Entry { path: path.into(), bytes: bytes.into(), is_program: false }
    }

    pub(crate) fn program(path: String, bytes: Vec<u8>) -> Entry {
        Entry { path, bytes, is_program: true }
    }

    fn mode(&self) -> u32 {
        if self.is_program { 0o755 } else { 0o644 }
    }

    /// The same under another name.
    pub(crate) fn named(&self, path: String) -> Entry {
        Entry { path, ..self.clone() }
    }
}

/// Compresses as `gzip -9n` does.
pub(crate) fn gz(bytes: &[u8]) -> Outcome<Vec<u8>> {
    let mut gz = GzEncoder::new(Vec::new(), Compression::best());
    gz.write_all(bytes).and_then(|()| gz.finish()).map_err(|error| error.to_string())
}

/// A tar archive (ustar) of files of root, sorted by path, each folder before what is in it.
pub(crate) fn tar_gz(entries: &[Entry], time: u64) -> Outcome<Vec<u8>> {
    let mut all: BTreeMap<&Path, Option<&Entry>> = BTreeMap::new();
    for entry in entries {
        let path = Path::new(&entry.path);
        all.extend(path.ancestors().skip(1).map(|folder| (folder, None)));
        all.insert(path, Some(entry));
    }
    let mut tar = tar::Builder::new(Vec::new());
    for (path, entry) in all {
        // What is named relative to the archive itself begins with these.
        if path == Path::new("") || path == Path::new(".") {
            continue;
        }
        let (name, kind, mode, bytes) = match entry {
            Some(entry) => {
                (entry.path.clone(), EntryType::Regular, entry.mode(), entry.bytes.as_slice())
            }
            None => (format!("{}/", path.display()), EntryType::Directory, 0o755, &[][..]),
        };
        let mut header = Header::new_ustar();
        // Not `set_path`, which takes the `./` away that Debian's packages have.
        let place = header.as_old_mut().name.get_mut(..name.len());
        place.ok_or(format!("{name} is too long a path"))?.copy_from_slice(name.as_bytes());
        header.set_entry_type(kind);
        header.set_mode(mode);
        header.set_mtime(time);
        header.set_uid(0);
        header.set_gid(0);
        header.set_size(bytes.len() as u64);
        let owner = header.set_username("root").and_then(|()| header.set_groupname("root"));
        header.set_cksum();
        owner.and_then(|()| tar.append(&header, bytes)).map_err(|error| error.to_string())?;
    }
    gz(&tar.into_inner().map_err(|error| error.to_string())?)
}

/// A time in seconds since 1970, as ISO 8601 has it.
pub(crate) fn moment(time: u64) -> String {
    UtcDateTime::from_unix(time.cast_signed()).to_string()
}

/// A zip archive of files in the order given.
pub(crate) fn zip(entries: &[Entry], time: u64) -> Outcome<Vec<u8>> {
    let time = UtcDateTime::from_unix(time.cast_signed());
    let mut zip = ZipArchiveWriter::new(Vec::new());
    for entry in entries {
        pack(&mut zip, entry, time).map_err(|error| format!("{}: {error}", entry.path))?;
    }
    zip.finish().map_err(|error| error.to_string())
}

fn pack(
    zip: &mut ZipArchiveWriter<Vec<u8>>,
    entry: &Entry,
    time: UtcDateTime,
) -> Result<(), rawzip::Error> {
    let file = zip.new_file(&entry.path).compression_method(CompressionMethod::DEFLATE);
    let file = file.unix_permissions(entry.mode()).last_modified(time);
    let (mut file, counting) = file.start()?;
    let mut writer = counting.wrap(DeflateEncoder::new(&mut file, Compression::best()));
    writer.write_all(&entry.bytes)?;
    let (deflate, sums) = writer.finish()?;
    deflate.finish()?;
    file.finish(sums)?;
    Ok(())
}

/// An ar archive, which is what a Debian package is: a line for each member, and its bytes.
pub(crate) fn ar(members: &[(&str, Vec<u8>)], time: u64) -> Vec<u8> {
    let mut ar = b"!<arch>\n".to_vec();
    for (name, bytes) in members {
        let size = bytes.len();
        ar.extend(format!("{name:<16}{time:<12}{:<6}{:<6}100644  {size:<10}`\n", 0, 0).bytes());
        ar.extend(bytes);
        ar.resize(ar.len().next_multiple_of(2), b'\n');
    }
    ar
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use super::*;
    use crate::tool::works;

    fn entries() -> Vec<Entry> {
        vec![
            Entry::program("a/b/run".to_owned(), b"#!/bin/sh\n".to_vec()),
            Entry::file("a/long", "many words ".repeat(5000)),
            Entry::file("a/b/c/empty", ""),
        ]
    }

    /// Unpacks it by a program of others, and compares.
    fn unpacks(name: &str, archive: &[u8], program: &str, arguments: &[&str]) {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(name), archive).unwrap();
        assert!(works(Command::new(program).args(arguments).current_dir(folder.path())));
        for entry in entries() {
            assert_eq!(std::fs::read(folder.path().join(entry.path)).unwrap(), entry.bytes);
        }
    }

    #[test]
    fn tar_unpacks_it() {
        let packed = tar_gz(&entries(), 1_700_000_000).unwrap();
        unpacks("a.tar.gz", &packed, "tar", &["-xzf", "a.tar.gz"]);
        assert_eq!(packed, tar_gz(&entries(), 1_700_000_000).unwrap());
    }

    #[test]
    fn python_unpacks_the_zip() {
        if !works(Command::new("python3").arg("--version")) {
            return;
        }
        let packed = zip(&entries(), 1_700_000_000).unwrap();
        assert_eq!(packed, zip(&entries(), 1_700_000_000).unwrap());
        unpacks("a.zip", &packed, "python3", &["-m", "zipfile", "-e", "a.zip", "."]);
    }

    #[test]
    fn a_time_is_written_as_iso_8601_has_it() {
        assert_eq!(moment(1_700_000_000), "2023-11-14T22:13:20Z");
    }

    #[test]
    fn members_of_an_ar_begin_at_even_places() {
        let packed = ar(&[("one", b"1".to_vec()), ("two", b"22".to_vec())], 7);
        let text = String::from_utf8(packed).unwrap();
        let one = "one             7           0     0     100644  1         `\n1\n";
        let two = "two             7           0     0     100644  2         `\n22";
        assert_eq!(text, format!("!<arch>\n{one}{two}"));
    }
}
