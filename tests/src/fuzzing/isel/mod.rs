//! The isel controllers.

mod answers;
mod flash;
mod lexer;
mod parser;
mod setups;

pub use flash::flash;
pub use lexer::lexer;
pub use parser::parser;
pub(super) use setups::inputs;

use std::ops::Range;

use serde_json::Value;
use vimc4_isel::Controller;
use vimc4_isel_wire::{LINE_MAX, control};

use super::operations::Setup;
use super::twins::{Family, twins};
use setups::model;

/// An isel controller and its twin get the operations that some bytes stand for.
///
/// # Panics
///
/// If something does not hold.
pub fn controller(data: &[u8]) {
    twins::<Controller>(data);
}

impl Family for Controller {
    type Conversation = answers::Conversation;

    const COUNTERS: Range<i64> = -(1 << 23)..1 << 23;

    fn open(setup: Setup, image: &[u8]) -> Controller {
        Controller::new(model(setup), setup.machine(), image)
            .unwrap_or_else(|error| unreachable!("{error}: {}", image.escape_ascii()))
    }

    fn acts_at_once(byte: u8) -> bool {
        control(byte).is_some()
    }

    fn counted(position: i64) -> i64 {
        (position << 40) >> 40
    }

    fn check_memory(&self, state: &Value) {
        let number = |path: &str| state.pointer(path).and_then(Value::as_u64);
        let length = |path: &str| state.pointer(path).and_then(Value::as_array).map_or(0, Vec::len);
        let model = self.model();
        assert!(length("/receiver/waiting") <= model.line.receive_buffer, "waiting bytes");
        assert!(length("/receiver/line/bytes") <= LINE_MAX, "a line");
        assert!(length("/run/loops") <= model.limits.loop_depth, "loops");
        let size = number("/flash/program/size").unwrap_or(0);
        assert!(size <= u64::from(model.flash.size), "a program of {size} bytes");
        let lines = length("/flash/program/lines") as u64;
        assert!(
            lines * u64::from(model.flash.command_bytes) <= size,
            "{lines} lines, {size} bytes"
        );
    }
}
