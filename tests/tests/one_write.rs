//! Replies with data leave in one write when the line is not paced.

use vimc4::device::{Device, Input, Output};
use vimc4::{Family, Time};

#[test]
fn replies_leave_whole() {
    for family in Family::ALL {
        let replies: &[(&str, &[usize])] = match family {
            // Position, port and diagnosis. Some give the position of configured axes only.
            Family::Isel => {
                &[("@07\r", &[1]), ("@0P\r", &[19]), ("@0b1\r", &[3]), ("@0DS0\r", &[3])]
            }
            // Position, and that it was given: each line is a reply.
            Family::Lpkf => &[("!ON1;", &[3, 2])],
        };
        for name in family.models() {
            let model = vimc4::model(name).expect("a built-in model");
            let machine = vimc4::machine("bench").expect("a built-in machine");
            let mut controller = vimc4::bare(&model, &machine, &[]).expect("a controller");
            for (line, lengths) in replies {
                controller.handle(Input::Bytes(line.as_bytes()), Time::ZERO);
                let mut writes = Vec::new();
                loop {
                    match controller.poll_output() {
                        Output::Bytes(_, bytes) => writes.push(bytes.len()),
                        Output::Wake(_) => break,
                        _ => {}
                    }
                }
                assert_eq!(writes, *lengths, "{name}: {line:?}");
            }
        }
    }
}
