//! The sample program of the 1999 manual, appendix D2.2, which is not ours to hand out. Who has
//! the manual stores it in a file and names that file in `VIMC4_SAMPLE_1999`.

use std::path::Path;
use std::{env, fs};

use vimc4::Family;
use vimc4_conform::fixtures;
use vimc4_conform::format;
use vimc4_conform::play::{Drive, play};
use vimc4_conform::script;
use vimc4_conform::workshop::Workshop;

/// A session around the program: every line is stored with a `0`; in the middle of its delays
/// the machine is where the pseudo-code of the manual has it, if loops count as they do there; and
/// it goes round for an hour.
const SESSION: &str = "\
models = \"isel\"
evidence = \"D+A\"
source = \"99 D2.1, D2.2; assumed: the same on the later models\"

[[session]]
name = \"sample-1999\"
title = \"The sample program of the 1999 manual runs for ever\"
quirks = { loop_count = \"total\" }
script = '''
press start
wait 21.5s
position 0 0 0
wait 2.5s
position 1500 1500 -200
wait 18.1s
position 2400 2400 -2000
wait 22.7s
position 0 0 0
silent 60min
! 255
silent 10s
> @0P -> 0...
'''
";

#[test]
#[ignore = "needs the manual's program: VIMC4_SAMPLE_1999=FILE, with --ignored"]
fn the_sample_of_the_manual_is_stored_and_runs() {
    let path = env::var_os("VIMC4_SAMPLE_1999").expect("VIMC4_SAMPLE_1999 is set");
    let program = fs::read_to_string(&path).expect("VIMC4_SAMPLE_1999 names a file");
    let mut sessions =
        format::parse("program", Path::new("sample-1999.toml"), SESSION, &fixtures::programs())
            .unwrap_or_else(|error| panic!("{error}"));
    let session = &mut sessions[0];
    let stored = script::store(&program).expect("lines of a program");
    let stored = stored.into_iter().map(|(text, action)| script::Step { line: 0, text, action });
    session.steps.splice(0..0, stored);
    for model in Family::Isel.models() {
        let workshop = Workshop::new(session, model).expect("profiles that can be");
        for drive in [Drive::Smooth, Drive::Rough] {
            play(session, drive, |flash| workshop.build(flash))
                .unwrap_or_else(|failure| panic!("{model}: {failure}"));
        }
    }
}
