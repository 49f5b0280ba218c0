//! Waveforms in files, as `--vcd`, `--fst`, `--csv` and `--perfetto` ask for them.

use std::collections::VecDeque;
use std::fs::{File, OpenOptions};
use std::io::{self, IsTerminal, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use indicatif::ProgressBar;
use vimc4_catalogue::{Details, Model};
use vimc4_device::{Device, Input, Kinds, Output, Time, View};
use vimc4_wave::{Analyser, Csv, Drives, Fst, Pacing, Paper, Sheet, Trace, Vcd, layout};

use crate::failure::Failure;
use crate::output;
use crate::places::{in_name, numbered};
use crate::streams::{is_file, is_null};
use crate::text::shown_in_line;

/// Of each option by itself: that of a whole struct would stay for the options that follow.
const HEADING: &str = "Waveforms";

/// What is to be drawn, and where.
#[derive(Clone, clap::Args)]
pub(crate) struct Drawn {
    /// Draw steps, directions, switches, ports, the bits on the line and the state over time into a value
    /// change dump, which GTKWave and Surfer show. What it replaces is gone
    #[arg(help_heading = HEADING, long, value_name = "OUT")]
    vcd: Option<PathBuf>,
    /// The same in the compressed format of GTKWave, which Surfer reads too
    #[arg(help_heading = HEADING, long, value_name = "OUT")]
    fst: Option<PathBuf>,
    /// A table of the same: seconds,signal,value, with a row for each change
    #[arg(help_heading = HEADING, long, value_name = "OUT")]
    csv: Option<PathBuf>,
    /// States, commands, answers, motions and lines of a program as a trace, which ui.perfetto.dev shows
    #[arg(help_heading = HEADING, long, value_name = "OUT")]
    perfetto: Option<PathBuf>,
}

/// The files, opened before anything begins.
pub(crate) struct Sheets {
    sheets: Vec<Box<dyn Sheet>>,
    files: Vec<Page>,
    /// The waveforms beside which stands what a viewer shows first.
    waveforms: Vec<PathBuf>,
    /// How often something was written to any of the files.
    writes: Arc<AtomicU64>,
}

/// A device that is being drawn.
pub(crate) struct Waves {
    analyser: Analyser,
    files: Vec<Page>,
    model: Model,
}

impl Drawn {
    /// The files that are named.
    pub(crate) fn files(&self) -> impl Iterator<Item = &Path> {
        let Drawn { vcd, fst, csv, perfetto } = self;
        [vcd, fst, csv, perfetto].into_iter().flatten().map(PathBuf::as_path)
    }

    /// Opens the files that are asked for; those of the second of several controllers are called
    /// `out-2.vcd`.
    ///
    /// # Errors
    ///
    /// If one cannot be written.
    pub(crate) fn open(&self, number: Option<u16>) -> Result<Option<Sheets>, Failure> {
        if self.files().next().is_none() {
            return Ok(None);
        }
        let named = |path: &Option<PathBuf>| {
            let named = |path: &Path| Ok::<_, Failure>(numbered(path, in_name(path, number)?));
            path.as_deref().map(named).transpose()
        };
        let Drawn { vcd, fst, csv, perfetto } = self;
        let (vcd, fst, csv, perfetto) = (named(vcd)?, named(fst)?, named(csv)?, named(perfetto)?);
        if let Some(path) = fst.as_ref().filter(|path| !is_null(path)) {
            output::must_be_file(path, "the beginning of this format is written last")?;
        }
        let waveforms = [&vcd, &fst].into_iter().flatten().cloned().collect();
        let writes = Arc::default();
        let mut sheets = Sheets { sheets: Vec::new(), files: Vec::new(), waveforms, writes };
        if let Some(path) = vcd {
            let page = sheets.page(path)?;
            sheets.sheets.push(Box::new(Vcd::new(page)));
        }
        if let Some(path) = fst {
            let page = sheets.page(path)?;
            sheets.sheets.push(Box::new(Fst::new(page)));
        }
        if let Some(path) = csv {
            let page = sheets.page(path)?;
            sheets.sheets.push(Box::new(Csv::new(page)));
        }
        if let Some(path) = perfetto {
            let page = sheets.page(path)?;
            sheets.sheets.push(Box::new(Trace::new(page)));
        }
        Ok(Some(sheets))
    }
}

impl Sheets {
    fn page(&mut self, path: PathBuf) -> Result<Page, Failure> {
        let page = Page::new(path, Arc::clone(&self.writes))?;
        self.files.push(page.clone());
        Ok(page)
    }

    /// How often something was written to any of the files: while that grows, they are not stuck.
    pub(crate) fn writes(&self) -> Arc<AtomicU64> {
        Arc::clone(&self.writes)
    }

    /// The names of the files.
    pub(crate) fn names(&self) -> Vec<String> {
        let name = |page: &Page| shown_in_line(&page.lock().path.display().to_string());
        self.files.iter().map(name).collect()
    }

    /// Begins to draw a controller of a model, as it is now.
    pub(crate) fn begin<D: Device<Details = Details>>(
        self,
        device: &D,
        model: &Model,
        pacing: Pacing,
    ) -> Result<Waves, Failure> {
        let analyser = Analyser::new(device, pacing, drives(model), self.sheets);
        for path in &self.waveforms {
            let whole = std::path::absolute(path).unwrap_or_else(|_| path.clone());
            let scene = analyser.scene();
            beside(path, "gtkw", &layout::gtkwave(scene, &whole.display().to_string()))?;
            beside(path, "sucl", &layout::surfer(scene))?;
        }
        Ok(Waves { analyser, files: self.files, model: model.clone() })
    }
}

/// Writes a file beside another, unless there is one: then it is somebody's own.
fn beside(path: &Path, ending: &str, text: &str) -> Result<(), Failure> {
    // What is drawn into a pipe or to standard output has nothing beside it.
    if !is_file(path) {
        return Ok(());
    }
    let path = path.with_extension(ending);
    let file = OpenOptions::new().write(true).create_new(true).open(&path);
    match file.and_then(|mut file| file.write_all(text.as_bytes())) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => {
            Err(Failure::usage(format!("cannot write {}: {error}", path.display())))
        }
        _ => Ok(()),
    }
}

impl Waves {
    pub(crate) const KINDS: Kinds = Analyser::KINDS;

    /// Something went into the device.
    pub(crate) fn given(&mut self, at: Time, input: Input<'_>) {
        self.analyser.given(at, input);
    }

    /// The device has been put into another state by somebody.
    pub(crate) fn restored<D: Device<Details = Details>>(&mut self, device: &D, by: &str) {
        self.analyser.restored(device, by, drives(&self.model));
    }

    /// What came out, and the device now.
    pub(crate) fn see<D: Device<Details = Details>>(
        &mut self,
        device: &D,
        outputs: &VecDeque<Output>,
    ) {
        for output in outputs {
            match output {
                Output::Bytes(at, bytes) => self.analyser.sent(*at, bytes),
                Output::Event(stamp, event) => self.analyser.see(stamp.at, event),
                Output::Flash(..) => {}
            }
        }
        self.analyser.look(device, drives(&self.model));
    }

    /// Writes everything that has been drawn, and calls `say` for each file that can no longer be
    /// written, once. Returns whether no file is left.
    pub(crate) fn flush(&mut self, say: &mut dyn FnMut(&str)) -> bool {
        self.analyser.flush();
        // Each of them.
        self.files.iter().map(|page| page.tell(say)).fold(true, |all, has_failed| all & has_failed)
    }

    /// Draws the rest, up to this time.
    ///
    /// # Errors
    ///
    /// If not everything could be written.
    pub(crate) fn finish(self, at: Time) -> Result<(), Failure> {
        self.analyser.finish(at);
        // Each of them, whatever becomes of the others.
        self.files.iter().map(Page::finish).fold(Ok(()), Result::and)
    }
}

fn drives(model: &Model) -> impl Fn(&View<Details>) -> Drives {
    move |view| {
        let [motors, spindle] = model.drives(view);
        Drives { motors, spindle }
    }
}

/// A file that is drawn on.
#[derive(Clone)]
struct Page(Arc<Mutex<Written>>);

struct Written {
    path: PathBuf,
    file: File,
    /// Whether places in it can be named: a pipe has none.
    has_offsets: bool,
    size: u64,
    writes: Arc<AtomicU64>,
    is_failure_told: bool,
    outcome: io::Result<()>,
    began: Instant,
    bar: Option<ProgressBar>,
}

/// What is drawn sooner shows no progress.
const SHOWN_AFTER: Duration = Duration::from_millis(500);

impl Page {
    fn new(path: PathBuf, writes: Arc<AtomicU64>) -> Result<Page, Failure> {
        let file = output::create(&path)?;
        let written = Written {
            has_offsets: is_file(&path),
            path,
            file,
            size: 0,
            writes,
            is_failure_told: false,
            outcome: Ok(()),
            began: Instant::now(),
            bar: None,
        };
        Ok(Page(Arc::new(Mutex::new(written))))
    }

    /// Says, once, that it can no longer be written. Returns whether that is so.
    fn tell(&self, say: &mut dyn FnMut(&str)) -> bool {
        let mut written = self.lock();
        let Err(error) = &written.outcome else { return false };
        if !written.is_failure_told && !output::has_no_reader(&written.path, error) {
            say(&format!(
                "cannot write {}: {error}; it ends there, and the controllers go on",
                written.path.display()
            ));
        }
        written.is_failure_told = true;
        true
    }

    fn lock(&self) -> MutexGuard<'_, Written> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn finish(&self) -> Result<(), Failure> {
        let mut written = self.lock();
        if let Some(bar) = written.bar.take() {
            bar.finish_and_clear();
        }
        let outcome = std::mem::replace(&mut written.outcome, Ok(()));
        output::written_to(&written.path, outcome)
    }
}

impl Written {
    fn write_at(&mut self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(offset))?;
        self.file.write_all(bytes)?;
        self.file.seek(SeekFrom::Start(self.size)).map(drop)
    }

    /// Shows how far it has come to somebody who waits for it.
    fn show(&mut self) {
        if self.bar.is_none() {
            if self.began.elapsed() < SHOWN_AFTER || !io::stderr().is_terminal() {
                return;
            }
            self.bar = Some(ProgressBar::new_spinner());
        }
        if let Some(bar) = &self.bar {
            bar.set_message(format!("{}: {} MB", self.path.display(), self.size / 1_000_000));
            bar.tick();
        }
    }
}

impl Paper for Page {
    fn put(&mut self, bytes: &[u8]) {
        let mut written = self.lock();
        if written.outcome.is_ok() {
            written.outcome = written.file.write_all(bytes);
            written.size += bytes.len() as u64;
            written.writes.fetch_add(1, Ordering::Relaxed);
            written.show();
        }
    }

    fn put_at(&mut self, offset: u64, bytes: &[u8]) {
        let mut written = self.lock();
        if written.outcome.is_ok() && written.has_offsets {
            written.outcome = written.write_at(offset, bytes);
        }
    }
}
