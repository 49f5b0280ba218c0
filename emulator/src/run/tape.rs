//! The recording of a run in virtual time.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use vimc4::RecordingFile;
use vimc4_catalogue::{Machine, Model};
use vimc4_device::{Device, Names, Output, Time, TimedInput};
use vimc4_timeline::recording::{Entry, Given, What};

use crate::failure::Failure;

/// A file into which a run is recorded.
pub(crate) struct Tape {
    file: RecordingFile,
    by: Arc<str>,
    /// Up to when everything is in it.
    now: Time,
    /// Why it is not whole.
    failed: Arc<OnceLock<String>>,
}

impl Tape {
    /// Begins a recording in a file, which must not exist yet.
    pub(crate) fn new(path: &Path, model: &Model, machine: &Machine) -> Result<Tape, Failure> {
        let head = vimc4::recording_head(model, machine, "instant", "run");
        let failed = Arc::<OnceLock<String>>::default();
        let why = Arc::clone(&failed);
        let tell = move |error: &str| drop(why.set(error.to_owned()));
        let file = RecordingFile::create(path, head, None, Names::default(), Box::new(tell));
        let file = file.map_err(Failure::usage)?;
        Ok(Tape { file, by: Arc::from("run"), now: Time::ZERO, failed })
    }

    pub(super) fn begin(&mut self, device: &impl Device) {
        self.state(device);
    }

    /// Takes note of what has gone in and come out, in the order of its times.
    pub(super) fn note(
        &mut self,
        device: &impl Device,
        given: Vec<TimedInput>,
        outputs: &VecDeque<Output>,
    ) {
        let mut given = given.into_iter().peekable();
        for output in outputs {
            let Output::Bytes(at, bytes) = output else { continue };
            while let Some(given) = given.next_if(|given| given.at <= *at) {
                self.given(device, given);
            }
            self.file.add(&Entry::new(*at, What::Sent(bytes.clone())));
        }
        given.for_each(|given| self.given(device, given));
        self.now = device.now();
    }

    fn given(&self, device: &impl Device, TimedInput { at, input }: TimedInput) {
        let given = Given::of(&input, || Names::of(device));
        self.file.add(&Entry::new(at, What::Given { by: Arc::clone(&self.by), given }));
    }

    /// Ends it, and says why.
    ///
    /// # Errors
    ///
    /// If not everything could be written.
    pub(super) fn end(mut self, device: &impl Device, why: &str) -> Result<(), Failure> {
        self.state(device);
        self.file.add(&Entry::new(self.now, What::End(why.to_owned())));
        self.file.finish();
        self.failed.get().map_or(Ok(()), |failed| Err(Failure::usage(failed)))
    }

    /// A state as every recording has it: that of a controller at a line.
    fn state(&mut self, device: &impl Device) {
        self.now = device.now();
        let state = serde_json::to_value(device.state()).unwrap_or_default();
        self.file.add(&Entry::new(self.now, What::State { by: None, state }));
    }
}
