//! `vimc4 circle` from outside.

#![expect(clippy::unwrap_used, reason = "a test that cannot run the command has failed")]

use std::process::{Command, Output};

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::InTime;

fn circle(arguments: &str) -> Output {
    let words = arguments.split_whitespace();
    Command::new(env!("CARGO_BIN_EXE_vimc4")).arg("circle").args(words).output_in_time().unwrap()
}

/// What is printed to standard output when all is well.
fn commands(arguments: &str) -> Vec<String> {
    let output = circle(arguments);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{arguments}: {errors}");
    // What is said about the circle is a comment and nothing else.
    assert!(errors.lines().all(|line| line.starts_with("; ")), "{errors}");
    String::from_utf8(output.stdout).unwrap().lines().map(str::to_owned).collect()
}

/// Standard error when the arguments are wrong.
fn complaint(arguments: &str) -> String {
    let output = circle(arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments}");
    assert!(output.stdout.is_empty(), "{arguments}");
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn the_example_of_the_manual() {
    assert_eq!(
        commands("--radius 200 --from 135 --to 225 --ccw --speed 1500"),
        ["@0e0", "@0f-1", "@0y400,1500,119,-141,141,-1,-1"]
    );
}

#[test]
fn the_half_circles_of_the_manual() {
    // Four half circles of radius 400, each also a turn of angles further on.
    for (arguments, circle) in [
        ("--from 360 --to 180 --cw --speed 1000", "y1600,1000,-200,400,0,-1,-1"),
        ("--from 180 --to 0 --cw --speed 1000", "y1600,1000,-200,-400,0,1,1"),
        ("--from 0 --to 180 --ccw --speed 2000", "y1600,2000,-200,400,0,-1,1"),
        ("--from 180 --to 360 --ccw --speed 2000", "y1600,2000,-200,-400,0,1,-1"),
        ("--from 0 --to -180 --cw --speed 1000", "y1600,1000,-200,400,0,-1,-1"),
        ("--from -180 --to -360 --cw --speed 1000", "y1600,1000,-200,-400,0,1,1"),
        ("--from 360 --to 180 --speed 2000", "y1600,2000,-200,400,0,-1,1"),
        ("--from -180 --to 0 --speed 2000", "y1600,2000,-200,-400,0,1,-1"),
    ] {
        let direction = if arguments.contains("--cw") { "@0f0" } else { "@0f-1" };
        let commands = commands(&format!("--radius 400 {arguments}"));
        assert_eq!(commands, ["@0e0", direction, &format!("@0{circle}")], "{arguments}");
    }
}

#[test]
fn planes_devices_millimetres_and_helices() {
    assert_eq!(
        commands("-r 5 --steps-per-mm 80 --from 90 --to 0 --cw --plane yz --device 3"),
        ["@3e2", "@3f0", "@3y800,1000,200,0,400,1,-1"]
    );
    // Two turns, as the manual of 2012 has them.
    assert_eq!(
        commands("-r 2000 --from 180 --to 900 --speed 600 --rise 6000"),
        ["@0e0", "@0f-1", "@0w32000,600,-1000,-2000,0,1,-1,6000"]
    );
    assert_eq!(
        commands("-r 300 --plane xz --rise -50 --to 90"),
        ["@0e1", "@0f-1", "@0w600,1000,-150,300,0,-1,1,-50"]
    );
    let notes = String::from_utf8(circle("-r 300 --rise -50 --speed 30000").stderr).unwrap();
    assert!(notes.contains("imc-s8") && notes.contains("too high"), "{notes}");
}

#[test]
fn json_is_one_line() {
    let output = circle("-r 200 --from 135 --to 225 --json");
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.stderr.is_empty() && text.lines().count() == 1);
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(value["commands"][2], "@0y400,1000,119,-141,141,-1,-1");
    assert_eq!(value["steps"], 400);
    assert_eq!(value["end"], serde_json::json!([-141, -141]));
    assert!(value["end_error"].as_f64().unwrap() < 0.6);
    assert!(value["circle_error"].as_f64().unwrap() < 0.7);
}

#[test]
fn wrong_arguments_say_what_would_be_right() {
    for (arguments, right) in [
        ("", "--radius"),
        ("--radius -5", "a radius of -5 steps is not possible"),
        ("--radius 2.5mm", "write it without a unit, as in --radius 2.5 --steps-per-mm 80"),
        ("--radius 2inch", "a number is needed, as in 200 or 12.5"),
        ("-r 200 --from x", "a number is needed, as in 200 or 12.5"),
        ("-r 0.4", "from 1 to 8388607"),
        ("-r nan", "from 1 to 8388607"),
        ("-r inf", "from 1 to 8388607"),
        ("-r 9000000", "from 1 to 8388607"),
        ("-r 200 --to 0", "leave out --to"),
        ("-r 200 --to 0.05", "leave out --to"),
        ("-r 1048576", "several arcs"),
        ("-r 3 --steps-per-mm 0", "400 / 5 = 80"),
        ("-r 200 --from 1e30", "up to 1,000,000"),
        ("-r 200 --cw --ccw", "cannot be used with"),
        ("-r 200 --speed 5", "20..=40000"),
        ("-r 200 --device 10", "0..=9"),
        ("-r 200 --plane xx", "xy, xz, yz"),
        ("-r 200 --rise 1e9", "--rise"),
    ] {
        let complaint = complaint(arguments);
        assert!(complaint.contains(right), "{arguments}: {complaint}");
    }
}

/// What is said on standard error about a command, without the marks of comments.
fn explained(arguments: &[&str]) -> (String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vimc4"));
    let output = command.arg("circle").arg("--explain").args(arguments).output_in_time().unwrap();
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{errors}");
    (String::from_utf8(output.stdout).unwrap(), errors.replace("; ", ""))
}

#[test]
fn a_command_that_ends_off_its_circle_is_explained() {
    let (command, said) = explained(&["@0y800,400,7777,0,-400,-1,1"]);
    assert_eq!(command, "@0y800,400,200,0,-400,-1,1\n");
    assert!(said.contains("(0, -400) from the centre, radius 400.00"), "{said}");
    assert!(said.contains("D 200, Rx -1, Ry 1 would end on it"), "{said}");
    let (command, said) = explained(&["@0y400,1500,119,-141,141,-1,1"]);
    assert_eq!(command, "@0y400,1500,119,-141,141,-1,-1\n");
    assert!(said.contains("D 119, Rx -1, Ry -1 would end on it"), "{said}");
    // The sense of rotation that is meant, where the directions leave it open.
    let (command, _) = explained(&["@0y400,1500,119,-141,141,-1,1", "--cw"]);
    assert_eq!(command, "@0y400,1500,119,-141,141,1,1\n");
    let (command, said) = explained(&["@0y64000,4000,-800,800,0,-1,1"]);
    assert_eq!(command, "@0y64000,4000,-400,800,0,-1,1\n");
    assert!(said.contains("the arc is 10 turns long and ends 76 steps from its start"), "{said}");
    // A command that is right stays as it is, stored and as a helix, too.
    for right in ["@0y400,1500,119,-141,141,-1,-1", "w32000,600,-1000,-2000,0,1,-1,6000"] {
        let (command, said) = explained(&[right]);
        assert_eq!(command.trim_end(), right);
        assert!(said.contains("ends on the circle"), "{said}");
    }
    let (command, said) = explained(&["@0y10,300,0,0,0,1,1"]);
    assert!(command.is_empty() && said.contains("it starts at its centre"), "{command} {said}");
}

#[test]
fn an_explanation_has_a_picture_and_json() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arc.svg");
    let wrong = "@0y800,400,7777,0,-400,-1,1";
    let (json, said) = explained(&[wrong, "--json", "--plot", path.to_str().unwrap()]);
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(value["command"], "@0y800,400,200,0,-400,-1,1");
    assert_eq!((value["steps_off"].as_u64(), said.as_str()), (Some(18), ""), "{value}");
    let picture = std::fs::read_to_string(path).unwrap();
    assert!(picture.contains(&wrong[1..]), "{picture}");
}

#[test]
fn a_command_that_cannot_be_explained_says_why() {
    for (command, right) in [
        ("@0A5,300", "neither a circle"),
        ("@0y1,2,3", "it has 3 numbers, 7 are right"),
        ("@0w400,1500,119,-141,141,-1,-1", "8 are right"),
        ("@0y400,1500,119,-141,x,-1,-1", "\"x\" is not a number"),
        ("@0y400,1500,119,-141,141,0,-1", "1 or -1, not 0"),
        ("@0y-4,1500,119,-141,141,1,-1", "-4 steps are not possible"),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_vimc4"))
            .args(["circle", "--explain", command])
            .output_in_time()
            .unwrap();
        let errors = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{errors}");
        assert!(errors.contains(right), "{command}: {errors}");
    }
    assert!(complaint("--explain @0y8,9,0,5,5,1,1 --radius 5").contains("cannot be used with"));
    for option in ["--cw", "--ccw", "--plane xz"] {
        let said = complaint(&format!("--explain @0y800,400,7777,0,-400,-1,1 {option}"));
        assert!(said.contains("has no effect"), "{said}");
    }
}

#[test]
fn a_start_for_which_the_routine_of_the_manual_takes_the_wrong_quadrant_is_said() {
    for (arguments, directions) in [
        ("-r 400 --from 90 --to 180", Some("Rx -1, Ry 1")),
        ("-r 400 --from 270 --to 360", Some("Rx 1, Ry -1")),
        ("-r 400 --from 0.05 --to 90 --cw", Some("Rx 1, Ry -1")),
        ("-r 400 --from 0 --to 90", None),
        ("-r 400 --from 90 --to 0 --cw", None),
        ("-r 400 --from 135 --to 225", None),
    ] {
        let said = String::from_utf8(circle(arguments).stderr).unwrap();
        let warned = said.contains("takes the wrong quadrant");
        assert_eq!(warned, directions.is_some(), "{arguments}: {said}");
        assert!(directions.is_none_or(|directions| said.contains(directions)), "{said}");
    }
}
