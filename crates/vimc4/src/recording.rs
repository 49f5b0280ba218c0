//! The file into which a running controller is recorded.
//!
//! Everything that has happened is handed to the operating system before the answer to it leaves:
//! the task that runs the controller writes it itself, once for each answer. A separate thread
//! would have to be waited for just the same, and would cost more than the writing. So nothing that
//! a client has seen is lost when the program is killed, and where the disk is slower than the
//! line, the controller waits for the disk.
//!
//! For the same reason a recording that is to be compressed stays plain text while it grows, and is
//! compressed when it is finished.

use std::cell::Cell;
use std::fmt;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::Value;
use thiserror::Error;
use vimc4_catalogue::{Machine, Model};
use vimc4_device::{Names, OwnedInput, Time};
use vimc4_host::{EventFilter, LineEvent, Report, Sink, Source};
use vimc4_journal::expect::Failure;
use vimc4_timeline::recording::{Entry, Given, Head, LineSort, VERSION, What};

/// Why a recording cannot be started.
#[derive(Debug, Error)]
#[error("cannot write the recording {path}: {source}; {help}", path = .path.display())]
pub struct RecordingError {
    /// The file.
    pub path: PathBuf,
    /// What the operating system says.
    pub source: io::Error,
    /// What would be right.
    pub help: &'static str,
}

/// Called with a message for people when a recording can no longer be written.
pub type OnError = Box<dyn FnMut(&str) + Send>;

/// How a file is compressed, by the end of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Packing {
    None,
    Gzip,
    Zstd,
}

/// A recording that is being written.
#[derive(Clone)]
pub struct RecordingFile(Arc<Mutex<Sheet>>);

/// The file that is written, and what is still to be written to it.
struct Sheet {
    /// The name that was asked for.
    name: PathBuf,
    packing: Packing,
    /// What is written on now; `None` once nothing more can be.
    file: Option<Paper>,
    /// What is written, where it is not a file.
    memory: Vec<u8>,
    path: PathBuf,
    /// Its name once it is compressed.
    packed: PathBuf,
    head: Head,
    /// The approximate maximum size of a file in bytes.
    size: u64,
    written: u64,
    lines: Vec<u8>,
    /// What the axes and signals of the controller are called.
    names: Names,
    /// The last source of an action, in words.
    by: Option<(Source, Arc<str>)>,
    /// The controller is led cause by cause.
    led: bool,
    /// When the controller has last told something.
    told: Time,
    /// Clients that have come and gone since, by a clock that can be ahead of the controller's time.
    news: Vec<(Time, Value)>,
    /// The controller has told its end.
    ends: bool,
    /// Why it is to end.
    cut: Option<String>,
    tell: OnError,
    packers: Vec<JoinHandle<()>>,
    /// Every file so far, by its final name.
    files: Vec<PathBuf>,
}

/// What a recording is written on.
enum Paper {
    File(File),
    /// The memory of this program, up to so many bytes.
    Memory(u64),
}

/// What a recording says of the controller.
pub(crate) struct About<'a> {
    pub(crate) model: &'a Model,
    pub(crate) machine: &'a Machine,
    pub(crate) clock: String,
    pub(crate) paced: bool,
    pub(crate) controller: String,
}

/// Where a recording is written, and how.
pub(crate) struct Order {
    pub(crate) path: PathBuf,
    pub(crate) size: Option<u64>,
    pub(crate) from: String,
    pub(crate) tell: OnError,
}

/// The head of a recording that this program writes.
///
/// `from` names the recording program, and `clock` says how time passes there.
#[must_use]
pub fn recording_head(model: &Model, machine: &Machine, clock: &str, from: &str) -> Head {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).ok();
    // Profiles can always be written.
    Head {
        recording: VERSION,
        program: concat!("vimc4 ", env!("CARGO_PKG_VERSION")).to_owned(),
        family: model.family().name().to_owned(),
        model: serde_json::to_value(model).unwrap_or_default(),
        machine: serde_json::to_value(machine).unwrap_or_default(),
        clock: clock.to_owned(),
        line: LineSort::Ideal,
        seed: None,
        from: from.to_owned(),
        controller: String::new(),
        part: 1,
        began: now.map(|now| now.as_secs()),
    }
}

impl RecordingFile {
    /// Starts a recording. An existing file is left as it is.
    pub(crate) fn begin(
        order: Order,
        about: &About<'_>,
        names: Names,
    ) -> Result<RecordingFile, RecordingError> {
        let mut head = recording_head(about.model, about.machine, &about.clock, &order.from);
        head.line = if about.paced { LineSort::Paced } else { LineSort::Ideal };
        head.controller.clone_from(&about.controller);
        RecordingFile::create(&order.path, head, order.size, names, order.tell)
    }

    /// Starts a recording with this head. An existing file is left as it is. With a `size` in
    /// bytes, a new file is started when one grows beyond it. `tell` is called with a message if
    /// the recording can no longer be written.
    ///
    /// # Errors
    ///
    /// If the file already exists or cannot be created.
    pub fn create(
        path: &Path,
        head: Head,
        size: Option<u64>,
        names: Names,
        tell: OnError,
    ) -> Result<RecordingFile, RecordingError> {
        let mut sheet = Sheet::new(path, head, size.unwrap_or(u64::MAX), names, tell);
        sheet.open()?;
        Ok(RecordingFile(Arc::new(Mutex::new(sheet))))
    }

    /// Tells whether a recording could be started there, and leaves nothing.
    ///
    /// # Errors
    ///
    /// Those of [`create`](RecordingFile::create).
    pub fn try_out(path: &Path) -> Result<(), RecordingError> {
        let (_, plain) = Packing::of(path).begin(path)?;
        fs::remove_file(&plain).map_err(|error| cannot_write(&plain, error))
    }

    /// Starts a recording in the memory of this program, which ends with its last whole line when it
    /// has so many bytes.
    pub(crate) fn in_memory(head: Head, most: u64, names: Names) -> RecordingFile {
        let mut sheet = Sheet::new(Path::new(""), head, u64::MAX, names, Box::new(|_: &str| {}));
        sheet.file = Some(Paper::Memory(most));
        sheet.head.put(&mut sheet.lines);
        sheet.write();
        RecordingFile(Arc::new(Mutex::new(sheet)))
    }

    /// What is recorded so far, in whole lines: how many bytes, and what reads them while it goes on.
    /// Of a recording in several files it is the last one, which plays by itself.
    ///
    /// # Errors
    ///
    /// If the file is not there any more.
    pub fn so_far(&self) -> io::Result<(u64, Box<dyn Read + Send>)> {
        let sheet = self.sheet();
        let length = sheet.written;
        if sheet.name.as_os_str().is_empty() {
            return Ok((length, Box::new(Memory { of: self.clone(), at: 0 }.take(length))));
        }
        let file = File::open(&sheet.path)?;
        Ok((length, Box::new(file.take(length))))
    }

    /// What is written is whole at any time, so a panic elsewhere is no reason to stop.
    fn sheet(&self) -> MutexGuard<'_, Sheet> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a line, which has been handed to the operating system when this returns.
    pub fn add(&self, entry: &Entry) {
        let mut sheet = self.sheet();
        entry.put(&mut sheet.lines);
        sheet.write();
    }

    /// The size of the current file in bytes.
    #[must_use]
    pub fn written(&self) -> u64 {
        self.sheet().written
    }

    /// Continues in the next file, which begins with the controller's present state, as this one
    /// ends with it.
    pub fn turn(&self, at: Time, state: &Value) {
        let mut sheet = self.sheet();
        if sheet.file.is_some() {
            sheet.turn(at, state);
        }
    }

    /// Ends it because an expectation is not met, once everything that happens at this instant has
    /// been reported: a mark says what was expected.
    pub fn cut(&self, failure: &Failure) {
        let mut sheet = self.sheet();
        let mark = format!("expected {}, but {}", failure.expected, failure.but);
        sheet.cut.get_or_insert(mark);
    }

    /// Whether lines can still be added.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.sheet().file.is_some()
    }

    /// Ends it with what has been told so far, although the controller may go on. One that has ended
    /// stays as it is.
    pub fn end_here(&self) {
        let mut sheet = self.sheet();
        let at = sheet.told;
        sheet.put_news(at);
        sheet.put(at, What::End("no more was to be recorded".to_owned()));
        sheet.write();
        sheet.file = None;
    }

    /// Closes it, and compresses it if its name says so. Returns every file of it.
    pub fn finish(&self) -> Vec<PathBuf> {
        let packers = self.sheet().close();
        for packer in packers {
            // A panic in it has been printed already.
            let _ = packer.join();
        }
        self.sheet().files.clone()
    }

    /// Closes it and removes every file of it.
    pub fn discard(&self) {
        self.sheet().packing = Packing::None;
        for file in self.finish() {
            let _ = fs::remove_file(file);
        }
    }
}

impl fmt::Debug for RecordingFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RecordingFile").field("name", &self.sheet().name).finish_non_exhaustive()
    }
}

/// Reads what is recorded in memory.
struct Memory {
    of: RecordingFile,
    at: usize,
}

impl Read for Memory {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.of.sheet().memory.get(self.at..).unwrap_or_default().read(buffer)?;
        self.at += read;
        Ok(read)
    }
}

impl Sheet {
    fn new(path: &Path, head: Head, size: u64, names: Names, tell: OnError) -> Sheet {
        Sheet {
            name: path.to_owned(),
            packing: Packing::of(path),
            file: None,
            memory: Vec::new(),
            path: PathBuf::new(),
            packed: PathBuf::new(),
            head,
            size,
            written: 0,
            lines: Vec::new(),
            names,
            by: None,
            led: false,
            told: Time::ZERO,
            news: Vec::new(),
            ends: false,
            cut: None,
            tell,
            packers: Vec::new(),
            files: Vec::new(),
        }
    }

    /// Starts the file of the current part.
    fn open(&mut self) -> Result<(), RecordingError> {
        let packed = part(&self.name, self.head.part);
        let (file, plain) = self.packing.begin(&packed)?;
        self.file = Some(Paper::File(file));
        self.written = 0;
        self.files.push(plain.clone());
        self.path = plain;
        self.packed = packed;
        self.head.put(&mut self.lines);
        self.write();
        Ok(())
    }

    fn put(&mut self, at: Time, what: What) {
        if self.file.is_some() {
            Entry::new(at, what).put(&mut self.lines);
        }
    }

    /// Lines are in order: what was told at a time that the controller has not come to is told at its.
    fn put_news(&mut self, until: Time) {
        for (at, news) in std::mem::take(&mut self.news) {
            self.put(at.min(until), What::News(news));
        }
    }

    /// Hands pending lines to the operating system. If it does not accept them, the recording ends
    /// with its last whole line.
    fn write(&mut self) {
        let whole = self.written.saturating_add(self.lines.len() as u64);
        let written = match &mut self.file {
            None => return self.lines.clear(),
            Some(Paper::File(file)) => file.write_all(&self.lines),
            Some(Paper::Memory(most)) if whole > *most => Err(io::ErrorKind::StorageFull.into()),
            Some(Paper::Memory(_)) => {
                self.memory.extend_from_slice(&self.lines);
                Ok(())
            }
        };
        match written {
            Ok(()) => self.written = whole,
            Err(error) => {
                // Half a line would be left out by its reader anyway.
                if let Some(Paper::File(file)) = self.file.take() {
                    let _ = file.set_len(self.written);
                }
                let path = self.path.display();
                (self.tell)(&format!(
                    "cannot go on with the recording {path}: {error}; it is whole up to here, and \
                     everything else goes on"
                ));
            }
        }
        self.lines.clear();
    }

    /// Continues in the next file, which can be played on its own.
    fn turn(&mut self, at: Time, state: &Value) {
        self.put(at, What::State { by: None, state: state.clone() });
        self.head.part += 1;
        let next = part(&self.name, self.head.part);
        let name = next.file_name().unwrap_or_default().to_string_lossy().into_owned();
        self.put(at, What::End(format!("it goes on in {name}")));
        self.write();
        if self.file.is_none() {
            return;
        }
        self.pack();
        match self.open() {
            Ok(()) => {
                self.put(at, What::State { by: None, state: state.clone() });
                if self.led {
                    self.put(at, What::Stands(Some(0)));
                }
            }
            Err(error) => (self.tell)(&error.to_string()),
        }
        self.write();
    }

    /// Closes the current file and has it compressed.
    fn pack(&mut self) {
        self.file = None;
        let (plain, packed, packing) = (self.path.clone(), self.packed.clone(), self.packing);
        if packing == Packing::None {
            return;
        }
        let Some(last) = self.files.last_mut().filter(|last| **last == plain) else { return };
        last.clone_from(&packed);
        let pack = move || {
            if let Err(error) = packing.pack(&plain, &packed) {
                let _ = writeln!(
                    io::stderr(),
                    "cannot compress the recording {}: {error}; it is as it was",
                    plain.display()
                );
            }
        };
        match thread::Builder::new().name("recording".to_owned()).spawn(pack.clone()) {
            Ok(packer) => self.packers.push(packer),
            Err(_) => pack(),
        }
    }

    fn close(&mut self) -> Vec<JoinHandle<()>> {
        if self.file.is_some() {
            self.write();
        }
        if !self.path.as_os_str().is_empty() {
            self.pack();
            self.path = PathBuf::new();
        }
        std::mem::take(&mut self.packers)
    }

    fn by(&mut self, source: &Source) -> Arc<str> {
        if let Some((known, by)) = &self.by
            && known == source
        {
            return Arc::clone(by);
        }
        let by: Arc<str> = Arc::from(source.to_string());
        self.by = Some((source.clone(), Arc::clone(&by)));
        by
    }

    fn report(&mut self, report: &Report) {
        use vimc4_host::ReportKind;
        let at = report.at;
        if !matches!(report.what, ReportKind::News(_)) {
            self.told = at;
            self.put_news(at);
        }
        match &report.what {
            ReportKind::Input { by, input } => {
                let by = self.by(by);
                if self.file.is_none() {
                    return;
                }
                // Every command comes by here.
                if let OwnedInput::Bytes(bytes) = input {
                    return Entry::put_given_bytes(&mut self.lines, at, bytes, &by);
                }
                let given = Given::of(input, || self.names.clone());
                self.put(at, What::Given { by, given });
            }
            ReportKind::Sent { bytes } => {
                if self.file.is_some() {
                    Entry::put_sent(&mut self.lines, at, bytes);
                }
                // It leaves when this returns.
                self.write();
            }
            ReportKind::State { by, state } => {
                let by = by.as_ref().map(|by| self.by(by));
                self.put(at, What::State { by, state: state.clone() });
                self.write();
            }
            ReportKind::Stands { causes } => {
                self.led = true;
                self.put(at, What::Stands(*causes));
            }
            ReportKind::Goes => {
                self.led = false;
                self.put(at, What::Goes);
            }
            ReportKind::News(LineEvent::Ends) => self.ends = true,
            // What was done follows, with who has done it.
            ReportKind::News(LineEvent::Deed { .. } | LineEvent::NoEffect { .. }) => {}
            ReportKind::News(news) => {
                // News can always be written.
                self.news.push((at, serde_json::to_value(news).unwrap_or_default()));
            }
            _ => {}
        }
    }

    fn settled(&mut self, at: Time, state: &dyn Fn() -> Value) {
        self.put_news(at);
        let cut = self.cut.take().filter(|_| self.file.is_some());
        if self.ends || cut.is_some() {
            self.put(at, What::State { by: None, state: state() });
            let why = match cut {
                Some(mark) => {
                    self.put(at, What::Mark(mark));
                    "an expectation was not met"
                }
                None => "the controller has ended",
            };
            self.put(at, What::End(why.to_owned()));
            self.write();
            self.file = None;
        } else if !self.lines.is_empty() {
            self.write();
        }
        if self.written >= self.size && self.file.is_some() {
            self.turn(at, &state());
        }
    }
}

/// The sink that writes.
#[derive(Debug)]
pub(crate) struct Recorder(pub(crate) RecordingFile);

impl Sink for Recorder {
    fn wants(&self) -> EventFilter {
        EventFilter { inputs: true, sent: true, ..EventFilter::default() }
    }

    fn report(&mut self, report: &Report, _explain: &dyn Fn(&[u8]) -> String) {
        self.0.sheet().report(report);
    }

    fn settled(&mut self, at: Time, state: &dyn Fn() -> Value) {
        self.0.sheet().settled(at, state);
    }

    fn has_enough(&self) -> bool {
        !self.0.is_open()
    }
}

/// `name.jsonl` is followed by `name.2.jsonl`, `name.jsonl.gz` by `name.2.jsonl.gz`.
fn part(name: &Path, number: u32) -> PathBuf {
    if number == 1 {
        return name.to_owned();
    }
    let file = name.file_name().unwrap_or_default().to_string_lossy().into_owned();
    // A name that begins with a point has no ending.
    let dot = file.char_indices().skip(1).find(|(_, c)| *c == '.').map_or(file.len(), |(at, _)| at);
    let (stem, rest) = file.split_at(dot);
    name.with_file_name(format!("{stem}.{number}{rest}"))
}

impl Packing {
    fn of(path: &Path) -> Packing {
        match path.extension() {
            Some(end) if end.eq_ignore_ascii_case("gz") => Packing::Gzip,
            Some(end) if end.eq_ignore_ascii_case("zst") => Packing::Zstd,
            _ => Packing::None,
        }
    }

    /// A new file of this name, and its name while it is plain text.
    fn begin(self, packed: &Path) -> Result<(File, PathBuf), RecordingError> {
        let plain = self.plain(packed);
        if plain != packed && packed.exists() {
            return Err(cannot_write(packed, io::Error::from(io::ErrorKind::AlreadyExists)));
        }
        let file = OpenOptions::new().append(true).create_new(true).open(&plain);
        Ok((file.map_err(|error| cannot_write(&plain, error))?, plain))
    }

    /// The name of a file while it is plain text.
    fn plain(self, packed: &Path) -> PathBuf {
        match self {
            Packing::None => packed.to_owned(),
            Packing::Gzip | Packing::Zstd => packed.with_extension(""),
        }
    }

    /// Compresses a file, and removes it once all of it is in the compressed one.
    fn pack(self, plain: &Path, packed: &Path) -> io::Result<()> {
        let from = BufReader::with_capacity(1 << 16, File::open(plain)?);
        let to = OpenOptions::new().write(true).create_new(true).open(packed)?;
        let done = self.compress(from, &to).and_then(|()| to.sync_all());
        match done {
            Ok(()) => fs::remove_file(plain),
            Err(error) => {
                let _ = fs::remove_file(packed);
                Err(error)
            }
        }
    }

    fn compress(self, mut from: impl Read, mut to: &File) -> io::Result<()> {
        match self {
            Packing::None => io::copy(&mut from, &mut to).map(drop),
            Packing::Gzip => {
                let mut packer = flate2::write::GzEncoder::new(to, flate2::Compression::default());
                io::copy(&mut from, &mut packer)?;
                packer.finish().map(drop)
            }
            Packing::Zstd => {
                let mut to = io::BufWriter::with_capacity(1 << 16, to);
                let level = ruzstd::encoding::CompressionLevel::Fastest;
                ruzstd::encoding::compress(from, &mut to, level);
                to.flush()
            }
        }
    }
}

/// Writes the text of a recording into a new file, compressed if its name says so.
///
/// # Errors
///
/// If the file already exists or cannot be written.
pub fn pack(path: &Path, text: &[u8]) -> Result<(), RecordingError> {
    let file = OpenOptions::new().write(true).create_new(true).open(path);
    let file = file.map_err(|error| cannot_write(path, error))?;
    let written = Packing::of(path).compress(text, &file);
    written.map_err(|error| {
        // Half of it is of no use to anybody.
        let _ = fs::remove_file(path);
        cannot_write(path, error)
    })
}

/// The text of a recording, compressed or not, as its first bytes say.
///
/// # Errors
///
/// If the file cannot be read, or its compressed data are broken.
pub fn unpack(bytes: Vec<u8>) -> io::Result<Vec<u8>> {
    let mut text = Vec::new();
    unpacking(&*bytes)?.read_to_end(&mut text)?;
    Ok(text)
}

/// Reads the text of a recording, compressed or not, as its first bytes say. Truncated compressed
/// data give everything up to their end, and then an error of the kind `UnexpectedEof`; damaged
/// data give one of the kind `InvalidData`.
///
/// # Errors
///
/// If the source cannot be read, or its compressed data are broken from the beginning.
pub fn unpacking<'a>(mut source: impl Read + 'a) -> io::Result<Box<dyn Read + 'a>> {
    let mut first = Vec::new();
    source.by_ref().take(MAGIC).read_to_end(&mut first)?;
    let packing = match &first[..] {
        [0x1F, 0x8B, ..] => Packing::Gzip,
        [0x28, 0xB5, 0x2F, 0xFD] => Packing::Zstd,
        _ => Packing::None,
    };
    let over = Rc::new(Cell::new(false));
    let source = Watched { from: io::Cursor::new(first).chain(source), over: Rc::clone(&over) };
    let text: Box<dyn Read + 'a> = match packing {
        Packing::None => return Ok(Box::new(source)),
        Packing::Gzip => Box::new(flate2::read::MultiGzDecoder::new(source)),
        Packing::Zstd => {
            let decoder = ruzstd::decoding::StreamingDecoder::new(source);
            Box::new(decoder.map_err(|_| broken(over.get()))?)
        }
    };
    Ok(Box::new(Unpacking { text, packing, over }))
}

/// The number of bytes that tell how a file is compressed.
const MAGIC: u64 = 4;

/// A source that tells whether it has reached its end.
struct Watched<R> {
    from: R,
    over: Rc<Cell<bool>>,
}

impl<R: Read> Read for Watched<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.from.read(buffer)?;
        if read == 0 && !buffer.is_empty() {
            self.over.set(true);
        }
        Ok(read)
    }
}

/// The unpacked data.
struct Unpacking<'a> {
    text: Box<dyn Read + 'a>,
    packing: Packing,
    over: Rc<Cell<bool>>,
}

impl Read for Unpacking<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.text.read(buffer).map_err(|error| {
            broken(match self.packing {
                Packing::Zstd => self.over.get(),
                _ => error.kind() == io::ErrorKind::UnexpectedEof,
            })
        })
    }
}

fn broken(off: bool) -> io::Error {
    match off {
        true => io::Error::new(io::ErrorKind::UnexpectedEof, "it is compressed and broken off"),
        false => io::Error::new(io::ErrorKind::InvalidData, "what is compressed in it is damaged"),
    }
}

fn cannot_write(path: &Path, source: io::Error) -> RecordingError {
    let help = match source.kind() {
        io::ErrorKind::AlreadyExists => "no recording is overwritten: name another file",
        _ => "name a file in a folder that can be written to",
    };
    RecordingError { path: path.to_owned(), source, help }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_their_number_before_the_ending() {
        let name = |name: &str, number| part(Path::new(name), number).display().to_string();
        assert_eq!(name("a/rec.jsonl", 1), "a/rec.jsonl");
        assert_eq!(name("a.b/rec.jsonl", 2), "a.b/rec.2.jsonl");
        assert_eq!(name("rec.jsonl.gz", 12), "rec.12.jsonl.gz");
        assert_eq!(name("rec", 2), "rec.2");
        assert_eq!(name(".rec", 2), ".rec.2");
    }

    #[test]
    fn what_is_compressed_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let plain = folder.path().join("rec.jsonl");
        let text = "{\"at\":1,\"in\":\"@0P\\r\"}\n".repeat(20_000);
        for packing in [Packing::Gzip, Packing::Zstd] {
            fs::write(&plain, &text).unwrap();
            let ending = if packing == Packing::Gzip { "jsonl.GZ" } else { "jsonl.zst" };
            let packed = plain.with_extension(ending);
            assert_eq!(Packing::of(&packed), packing);
            assert_eq!(packing.plain(&packed), plain);
            packing.pack(&plain, &packed).unwrap();
            assert!(!plain.exists());
            let bytes = fs::read(&packed).unwrap();
            assert!(bytes.len() < text.len() / 20, "{}", bytes.len());
            assert_eq!(unpack(bytes).unwrap(), text.as_bytes());
        }
        assert_eq!(unpack(text.clone().into_bytes()).unwrap(), text.as_bytes());
    }
}
