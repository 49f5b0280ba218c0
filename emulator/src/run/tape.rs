//! The recording of a run in virtual time.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use vimc4::RecordingFile;
use vimc4_catalogue::{Machine, Model};
use vimc4_device::{Device, Names, Output, TimedInput};
use vimc4_timeline::recording::{Entry, Given, What};

use crate::failure::Failure;

/// A file into which a run is recorded.
pub(crate) struct Tape {
    file: RecordingFile,
    by: Arc<str>,
}

impl Tape {
    /// Begins a recording in a file, which must not exist yet.
    pub(crate) fn new(path: &Path, model: &Model, machine: &Machine) -> Result<Tape, Failure> {
        let head = vimc4::recording_head(model, machine, "instant", "run");
        let tell = |error: &str| drop(writeln!(io::stderr(), "{error}"));
        let file = RecordingFile::create(path, head, None, Names::default(), Box::new(tell));
        Ok(Tape { file: file.map_err(Failure::usage)?, by: Arc::from("run") })
    }

    pub(super) fn begin(&self, device: &impl Device) {
        self.state(device);
    }

    /// Takes note of what has gone in and come out, in the order of its times.
    pub(super) fn note(
        &self,
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
    }

    fn given(&self, device: &impl Device, TimedInput { at, input }: TimedInput) {
        let given = Given::of(&input, || Names::of(device));
        self.file.add(&Entry::new(at, What::Given { by: Arc::clone(&self.by), given }));
    }

    pub(super) fn end(self, device: &impl Device) {
        self.state(device);
        self.file.add(&Entry::new(device.now(), What::End("the run has ended".to_owned())));
        self.file.finish();
    }

    /// A state as every recording has it: that of a controller at a line.
    fn state(&self, device: &impl Device) {
        let state = serde_json::to_value(device.state()).unwrap_or_default();
        self.file.add(&Entry::new(device.now(), What::State { by: None, state }));
    }
}
