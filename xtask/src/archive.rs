//! Archives whose bytes depend on nothing but what is in them: tar with gzip, zip, and ar.

use std::io::Write as _;

use flate2::write::{DeflateEncoder, GzEncoder};
use flate2::{Compression, Crc};

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

    /// The same in a folder.
    pub(crate) fn below(&self, folder: &str) -> Entry {
        Entry { path: format!("{folder}/{}", self.path), ..self.clone() }
    }
}

/// Compresses as `gzip -9n` does.
pub(crate) fn gz(bytes: &[u8]) -> Outcome<Vec<u8>> {
    let mut gz = GzEncoder::new(Vec::new(), Compression::best());
    gz.write_all(bytes).and_then(|()| gz.finish()).map_err(|error| error.to_string())
}

/// A tar archive (ustar) of files of root, sorted by path, each folder before what is in it.
pub(crate) fn tar_gz(entries: &[Entry], time: u64) -> Outcome<Vec<u8>> {
    let mut entries: Vec<&Entry> = entries.iter().collect();
    entries.sort_by(|a, b| a.path.cmp(&b.path));
    let mut tar = Vec::new();
    let mut folder = String::new();
    for entry in entries {
        let within = entry.path.rfind('/').map_or(0, |end| end + 1);
        for end in (0..within).filter(|end| entry.path.as_bytes().get(*end) == Some(&b'/')) {
            let parent = entry.path.get(..=end).unwrap_or_default();
            if parent != "./" && !folder.starts_with(parent) {
                tar.extend(header(parent, 0, 0o755, b'5', time)?);
            }
        }
        folder = entry.path.get(..within).unwrap_or_default().to_owned();
        let mode = if entry.is_program { 0o755 } else { 0o644 };
        tar.extend(header(&entry.path, entry.bytes.len(), mode, b'0', time)?);
        tar.extend(&entry.bytes);
        tar.resize(tar.len().next_multiple_of(512), 0);
    }
    tar.resize(tar.len() + 1024, 0);
    gz(&tar)
}

/// The header of a file (`0`) or folder (`5`) in a tar archive.
fn header(path: &str, size: usize, mode: u32, kind: u8, time: u64) -> Outcome<[u8; 512]> {
    let mut header = [0; 512];
    let mut put = |at: usize, text: &[u8]| {
        for (place, byte) in header.iter_mut().skip(at).zip(text) {
            *place = *byte;
        }
    };
    if path.len() > 100 {
        return Err(format!("{path} is too long for a tar archive; 100 bytes fit"));
    }
    put(0, path.as_bytes());
    put(100, format!("{mode:07o}\0{:07o}\0{:07o}\0{size:011o}\0{time:011o}\0", 0, 0).as_bytes());
    // While it is summed up the sum itself is blanks.
    put(148, b"        ");
    put(156, &[kind]);
    put(257, b"ustar\x0000root");
    put(297, b"root");
    let sum: u32 = header.iter().map(|byte| u32::from(*byte)).sum();
    for (place, byte) in header.iter_mut().skip(148).zip(format!("{sum:06o}\0 ").bytes()) {
        *place = byte;
    }
    Ok(header)
}

/// A zip archive. Its times, which have no time zone, are all the first that there is.
pub(crate) fn zip(entries: &[Entry]) -> Outcome<Vec<u8>> {
    let (mut zip, mut directory) = (Vec::new(), Vec::new());
    let too_big = |_| "a zip archive of this kind holds up to 4 GB".to_owned();
    for entry in entries {
        let mut deflate = DeflateEncoder::new(Vec::new(), Compression::best());
        let packed = deflate.write_all(&entry.bytes).and_then(|()| deflate.finish());
        let packed = packed.map_err(|error| error.to_string())?;
        let mut crc = Crc::new();
        crc.update(&entry.bytes);
        let start = u32::try_from(zip.len()).map_err(too_big)?;
        // Version 2.0, names in UTF-8, deflate, midnight, 1 January 1980.
        let mut common = Vec::new();
        for word in [20_u16, 0x0800, 8, 0, 0x21] {
            common.extend(word.to_le_bytes());
        }
        let sizes = [packed.len(), entry.bytes.len()].map(u32::try_from);
        let [small, large] = sizes;
        for word in [crc.sum(), small.map_err(too_big)?, large.map_err(too_big)?] {
            common.extend(word.to_le_bytes());
        }
        common.extend(u16::try_from(entry.path.len()).map_err(too_big)?.to_le_bytes());
        common.extend([0, 0]);
        zip.extend(b"PK\x03\x04");
        zip.extend(&common);
        zip.extend(entry.path.as_bytes());
        zip.extend(packed);
        directory.extend(b"PK\x01\x02\x14\0");
        directory.extend(common);
        directory.extend([0; 10]);
        directory.extend(start.to_le_bytes());
        directory.extend(entry.path.as_bytes());
    }
    let count = u16::try_from(entries.len()).map_err(too_big)?.to_le_bytes();
    let start = u32::try_from(zip.len()).map_err(too_big)?;
    let size = u32::try_from(directory.len()).map_err(too_big)?;
    zip.extend(directory);
    zip.extend(b"PK\x05\x06\0\0\0\0");
    zip.extend(count);
    zip.extend(count);
    zip.extend(size.to_le_bytes());
    zip.extend(start.to_le_bytes());
    zip.extend([0, 0]);
    Ok(zip)
}

/// An ar archive, which is what a Debian package is.
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
        let packed = zip(&entries()).unwrap();
        unpacks("a.zip", &packed, "python3", &["-m", "zipfile", "-e", "a.zip", "."]);
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
