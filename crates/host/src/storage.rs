//! What a device stores, on its way into a file.

use bytes::Bytes;
use vimc4_device::{Device, FlashChange};

use crate::LineEvent;
use crate::flash::{FlashFile, FlashFileError, unix_lines};

/// The file of a device's flash memory, if it has one, and whether it can still be relied on.
#[derive(Debug, Default)]
pub(crate) struct Storage {
    file: Option<FlashFile>,
    failure: Option<FlashFileError>,
}

impl Storage {
    /// Keeps the memory of a device in a file. `image` is what the file held when it was opened;
    /// where the device reads it differently, the file follows. Returns what is to be told of that.
    pub(crate) fn open<D: Device>(
        device: &D,
        mut file: FlashFile,
        image: &[u8],
    ) -> Result<(Storage, Option<LineEvent>), FlashFileError> {
        let present = device.flash_image();
        let mut mended = None;
        if present != image {
            // A new file is not worth a word.
            if !image.is_empty() {
                let (what, file) = (difference(image, &present), file.path().display().to_string());
                mended = Some(LineEvent::FlashMended { file, what });
            }
            file.apply(&FlashChange::Replace(Bytes::from(present)))?;
            file.sync()?;
        }
        Ok((Storage { file: Some(file), failure: None }, mended))
    }

    /// Whether what is stored outlives the device.
    pub(crate) fn is_kept(&self) -> bool {
        self.file.is_some()
    }

    /// Whether something could not be stored.
    pub(crate) fn has_failed(&self) -> bool {
        self.failure.is_some()
    }

    /// Why something could not be stored, once.
    pub(crate) fn take_failure(&mut self) -> Option<FlashFileError> {
        self.failure.take()
    }

    pub(crate) fn store(&mut self, change: &FlashChange) {
        if let Some(file) = &mut self.file
            && let Err(error) = file.apply(change)
        {
            self.failure.get_or_insert(error);
        }
    }

    /// What has been stored is on disk afterwards.
    pub(crate) fn secure(&mut self) {
        if let Some(file) = &mut self.file
            && let Err(error) = file.sync()
        {
            self.failure.get_or_insert(error);
        }
    }
}

/// How a file of flash memory differed from what the device has made of it, for people.
fn difference(held: &[u8], present: &[u8]) -> String {
    let torn = held.strip_prefix(present).map_or(0, <[u8]>::len);
    match torn {
        _ if unix_lines(held).as_ref() == present => {
            "had the line ends of Windows, and has its own again".to_owned()
        }
        0 => "was not as the controller writes it, and is now".to_owned(),
        1 => "the last byte was half a record, which counts as not written".to_owned(),
        torn => format!("{torn} bytes at its end were half a record, which counts as not written"),
    }
}
