//! Replies with data leave in one write when the line is not paced.

use vimc4::Family;
use vimc4::device::{Harness, Output};

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
            let controller = vimc4::bare(&model, &machine, &[]).expect("a controller");
            let mut controller = Harness::new(controller);
            for (line, lengths) in replies {
                controller.send(line.as_bytes());
                let writes: Vec<usize> = controller
                    .drain()
                    .filter_map(|output| match output {
                        Output::Bytes(_, bytes) => Some(bytes.len()),
                        Output::Flash(..) | Output::Event(..) => None,
                    })
                    .collect();
                assert_eq!(writes, *lengths, "{name}: {line:?}");
            }
        }
    }
}
