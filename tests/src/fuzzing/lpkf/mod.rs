//! The LPKF controllers.

mod answers;
mod language;
mod setups;

pub use language::language;
pub(super) use setups::inputs;

use std::ops::Range;

use serde_json::Value;
use vimc4_device::Device;
use vimc4_lpkf::Controller;
use vimc4_lpkf::language::COMMAND_MAX;

use super::operations::Setup;
use super::twins::{Family, twins};
use setups::model;

/// The longest command that the unit on the second channel reads.
const UNIT_COMMAND_MAX: usize = 64;

/// An LPKF controller and its twin get the operations that some bytes stand for.
///
/// # Panics
///
/// If something does not hold.
pub fn lpkf(data: &[u8]) {
    twins::<Controller>(data);
}

impl Family for Controller {
    type Conversation = answers::Conversation;

    const COUNTERS: Range<i64> = -(1 << 31)..1 << 31;

    /// It stores nothing, so that there is nothing in the image.
    fn open(setup: Setup, image: &[u8]) -> Controller {
        assert!(image.is_empty(), "something was stored");
        Controller::new(model(setup), setup.machine())
    }

    fn check_memory(&self, state: &Value) {
        let list = |path: &str| state.pointer(path).and_then(Value::as_array);
        let length = |path: &str| list(path).map_or(0, Vec::len);
        let most = self.model().buffer.bytes;
        let bytes = state.pointer("/buffer/bytes").and_then(Value::as_u64).unwrap_or(0);
        assert!(bytes <= most as u64, "{bytes} bytes wait");
        let sizes = list("/buffer/waiting").into_iter().flatten().map(size);
        assert_eq!(sizes.clone().sum::<usize>() as u64, bytes, "what waits is counted wrongly");
        assert!(sizes.min() != Some(0), "something waits that takes no room");
        assert!(length("/reader/raw") <= COMMAND_MAX, "a command");
        assert!(length("/unit/line") <= UNIT_COMMAND_MAX, "a command for the unit");
        // A pair takes four bytes at least, and every move may have a rest behind it.
        assert!(length("/job/stages") <= COMMAND_MAX / 2, "stages");
        assert!(length("/broken/stages") <= COMMAND_MAX / 2, "stages that are left");
        // A sender that heeds the handshake loses nothing, unless something has been broken off. What is
        // carried out as soon as it is whole needs no room.
        let is_null = |path: &str| matches!(state.pointer(path), Some(Value::Null));
        if !is_null("/stopped") {
            return;
        }
        let begun = match bytes == 0 && is_null("/job") && is_null("/ball/open") {
            true => 0,
            false => length("/reader/raw"),
        };
        let left = most.saturating_sub(bytes as usize + begun);
        assert!(self.room(true) <= left, "CTS comes too late");
    }
}

/// How many bytes of the buffer something takes that waits.
fn size(entry: &Value) -> usize {
    let bytes = entry.pointer("/Command/raw").or(entry.pointer("/Through"));
    bytes.and_then(Value::as_array).map_or(0, Vec::len)
}
