//! Replies with data leave in one write when the line is not paced.

use vimc4_device::{Device, Input, Output, Time};
use vimc4_isel::{Controller, Model};
use vimc4_plant::Machine;

#[test]
fn position_port_and_diagnosis_leave_in_one_write() {
    for name in Model::names() {
        let model = Model::builtin(name).expect("a built-in model");
        let machine = Machine::builtin("bench").expect("a built-in machine");
        let mut controller = Controller::new(model, machine, &[]).expect("a controller");
        for (line, length) in [("@0P\r", 19), ("@0b1\r", 3), ("@0DS0\r", 3)] {
            controller.handle(Input::Bytes(line.as_bytes()), Time::ZERO);
            let mut writes = Vec::new();
            loop {
                match controller.poll_output() {
                    Output::Bytes(_, bytes) => writes.push(bytes.len()),
                    Output::Wake(_) => break,
                    _ => {}
                }
            }
            assert_eq!(writes, [length], "{name}: {line:?}");
        }
    }
}
