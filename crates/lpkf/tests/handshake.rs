//! How much a host that heeds CTS may send.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::sync::Arc;

use vimc4_device::{Device, Input, Time};
use vimc4_lpkf::{Buffer, Controller, Model};
use vimc4_plant::{Machine, PlantSignal};

/// The room of a controller with a buffer of 64 bytes and a high-water mark of 48 that has got
/// these bytes, and then, perhaps, a stop.
fn room(bytes: &str, stop: bool) -> usize {
    let mut model = Model::builtin("smcu").expect("built in");
    Arc::make_mut(&mut model).buffer = Buffer { bytes: 64, high_water: 48 };
    let machine = Machine::builtin("bench").expect("built in");
    let mut controller = Controller::new(model, machine);
    controller.handle(Input::Bytes(bytes.as_bytes()), Time::ZERO);
    if stop {
        controller.handle(Input::Signal(PlantSignal::Stop.id(), 1), Time::ZERO);
    }
    controller.room(true)
}

#[test]
fn a_host_waits_only_where_something_else_will_make_room() {
    assert_eq!(room("", false), 48);
    assert_eq!(room("PA9000,0;PR0,1;", false), 43, "what waits takes its bytes");
    assert_eq!(room(&format!("PA9000,0;PR{},1;", "0".repeat(46)), false), 0);
    // A single command may be longer than all that, and is taken in as large pieces as any.
    assert_eq!(room(&format!("PA{}", "0".repeat(60)), false), 48);
    // What makes room may have to come from the host itself.
    assert_eq!(room("!ST;PR0,1;", false), 59);
    assert_eq!(room("!ES1;PA9000,0;PR0,1;", false), 43);
    assert_eq!(room("!ES1;PR0,1;", true), usize::MAX);
}
