//! What commands mean, and which status refuses them.

use super::read;
use crate::language::Dialect::{MotionSystem, Smcu};
use crate::language::Status::{
    MissingParameter, NoSuchAxis, NoSuchInterface, NoSuchIoModule, SingleCoordinate,
    TooManyVectorParameters, UnknownCommand, VectorBufferFull,
};
use crate::language::{
    Axis, Command, Dialect, Mode, Number, Status, Trackball, Turn, VECTORS_MAX, Vector,
};

/// Why a model refuses this.
fn refused(model: Dialect, text: &str) -> Status {
    read(model, text).expect_err(text)
}

#[test]
fn samples_mean_what_they_say() {
    let centre = [2000, 2000];
    assert_eq!(
        read(Smcu, "AA2000,2000,90.000000;"),
        Ok(Command::ArcAbsolute { centre, angle: 90_000_000 })
    );
    assert_eq!(read(Smcu, "VS0.005000;"), Ok(Command::PenSpeed(Number { millionths: 5_000 })));
    assert_eq!(read(Smcu, "PA 1,2 3,4;"), Ok(Command::PlotAbsolute(vec![[1, 2], [3, 4]])));
    assert_eq!(read(Smcu, "!VZ 700;"), Ok(Command::ZSpeed(700)));
    assert_eq!(
        read(MotionSystem, "!VZ 700,5;"),
        Ok(Command::AxisSpeed { axis: Axis::Z3, speed: 700 })
    );
    assert_eq!(read(Smcu, "!TA 1,-2,3;"), Ok(Command::SpaceAbsolute([1, -2, 3])));
    assert_eq!(read(MotionSystem, "!TR 1,-2,3;"), Ok(Command::SpaceRelative([1, -2, 3])));
    assert_eq!(read(Smcu, "CI 50,5;"), Ok(Command::Circle(50)));
    assert_eq!(read(Smcu, "EA 5,6;"), Ok(Command::EdgeAbsolute([5, 6])));
    assert_eq!(read(Smcu, "ER 5,6;"), Ok(Command::EdgeRelative([5, 6])));
    assert_eq!(read(MotionSystem, "!VA 700,5;"), read(MotionSystem, "!VZ 700,5;"));
    assert_eq!(read(Smcu, "!VA 700;"), Err(UnknownCommand));
    assert_eq!(read(Smcu, "!WR 33,255;"), Ok(Command::WritePort { port: 0x21, data: 255 }));
}

#[test]
fn numbers_are_rounded_and_clipped() {
    assert_eq!(read(Smcu, "PA 1.5,-1.4;"), Ok(Command::PlotAbsolute(vec![[2, -1]])));
    assert_eq!(
        read(Smcu, "PA 4294967296,-4294967296;"),
        Ok(Command::PlotAbsolute(vec![[i32::MAX, i32::MIN]]))
    );
    assert_eq!(read(Smcu, "!TW -5;"), Ok(Command::Wait(0)));
    assert_eq!(read(Smcu, "!WR 1,65537;"), Ok(Command::WritePort { port: 1, data: 1 }));
    assert_eq!(read(Smcu, "!WR 1,-1;"), Ok(Command::WritePort { port: 1, data: 65_535 }));
}

#[test]
fn a_switch_is_off_at_0_only() {
    for (number, on) in [("0", false), ("1", true), ("2", true), ("-1", true), ("0.4", false)] {
        assert_eq!(read(Smcu, &format!("!CT {number};")), Ok(Command::Echo(on)));
        assert_eq!(read(Smcu, &format!("!EM {number};")), Ok(Command::Spindle(on)));
        assert_eq!(read(Smcu, &format!("!ES {number};")), Ok(Command::ExternalStop(on)));
        let mode = if on { Mode::Milling } else { Mode::Drilling };
        assert_eq!(read(Smcu, &format!("!CM {number};")), Ok(Command::SetMode(mode)));
    }
}

#[test]
fn coordinates_come_in_pairs() {
    for command in ["PA", "PR", "AA", "AR", "IW"] {
        for model in Dialect::ALL {
            assert_eq!(refused(model, &format!("{command};")), MissingParameter, "{command}");
            assert_eq!(refused(model, &format!("{command} 1;")), SingleCoordinate, "{command}");
        }
    }
    assert_eq!(refused(Smcu, "PA 1,2,3;"), SingleCoordinate);
    assert_eq!(refused(Smcu, "IW 1,2,3;"), SingleCoordinate);
    assert_eq!(refused(Smcu, "IW 1,2;"), MissingParameter);
    assert_eq!(refused(Smcu, "AA 1,2;"), MissingParameter);
    assert_eq!(refused(Smcu, "EA 1;"), SingleCoordinate);
    assert_eq!(refused(Smcu, "ER;"), MissingParameter);
}

#[test]
fn an_arc_is_a_turn_at_most() {
    for model in Dialect::ALL {
        for angle in ["360", "-360.000000", "359.999999"] {
            assert!(read(model, &format!("AA 1,2,{angle};")).is_ok(), "{angle}");
        }
        for angle in ["360.000001", "-361", "99999999999999"] {
            for command in ["AA", "AR"] {
                let text = format!("{command} 1,2,{angle};");
                assert_eq!(refused(model, &text), MissingParameter, "{angle}");
            }
        }
    }
}

#[test]
fn parameters_can_be_missing_and_superfluous() {
    for command in
        ["VS", "!VU", "!AS", "!RS", "!VZ", "!ZA", "!ZR", "!TD 1,2,3", "!WR 1", "!TA 1,2", "CI"]
    {
        assert_eq!(refused(Smcu, &format!("{command};")), MissingParameter, "{command}");
    }
    for command in ["!AS", "!RS", "!VZ", "!ZA", "!ZR", "!SR 1,2", "!MA 1,2,3,4,5", "!PH 1", "!OA"] {
        assert_eq!(refused(MotionSystem, &format!("{command};")), MissingParameter, "{command}");
    }
    assert_eq!(read(Smcu, "!TS 5,6,7;"), Ok(Command::SettlingTime(5)));
    assert_eq!(
        read(MotionSystem, "!ZA 5,0,9;"),
        Ok(Command::MoveAxisAbsolute { axis: Axis::X, to: 5 })
    );
}

#[test]
fn a_form_is_chosen_by_its_parameters_and_then_known_or_not() {
    for command in ["!AS 1,0", "!RS 1,0", "!VZ 1,0", "!ZA 1,0", "!ZR 1,0", "!VZ 1,0,7"] {
        assert_eq!(refused(Smcu, &format!("{command};")), UnknownCommand, "{command}");
        assert!(read(MotionSystem, &format!("{command};")).is_ok(), "{command}");
    }
    for command in ["!AS 1", "!RS 1", "!VZ 1", "!ZA 1", "!ZR 1"] {
        assert_eq!(refused(MotionSystem, &format!("{command};")), UnknownCommand, "{command}");
        assert!(read(Smcu, &format!("{command};")).is_ok(), "{command}");
    }
    for command in ["OH 1", "!IS 1", "!OC 2", "!CC 2", "!MA", "!RP", "!SR", "!PH", "!CS"] {
        assert_eq!(refused(Smcu, &format!("{command};")), UnknownCommand, "{command}");
    }
    for command in ["PD", "PU", "VS", "!VU 1", "!CM", "!FP", "!HP", "!TD", "!TM 1,2,3,4"] {
        assert_eq!(refused(MotionSystem, &format!("{command};")), UnknownCommand, "{command}");
    }
}

#[test]
fn an_axis_must_be_one() {
    for command in ["OH", "!IS", "!VZ 1,", "!AS 1,", "!RS 1,", "!SR 1,2,", "!ZA 1,", "!ZR 1,"] {
        assert!(read(MotionSystem, &format!("{command} 5;")).is_ok(), "{command}");
        for number in ["6", "-1", "99999999999"] {
            assert_eq!(refused(MotionSystem, &format!("{command} {number};")), NoSuchAxis);
        }
    }
    for (number, axis) in [(0, None), (1, Some(Axis::X)), (6, Some(Axis::Z3))] {
        let nominal = Command::NominalPosition(axis);
        assert_eq!(read(Smcu, &format!("!ON {number};")), Ok(nominal));
        let actual = |triggered| Ok(Command::ActualPosition { axis, triggered });
        assert_eq!(read(MotionSystem, &format!("!OA {number};")), actual(true));
        assert_eq!(read(MotionSystem, &format!("!OA {};", number + 100)), actual(false));
    }
    for command in ["!ON 7", "!ON -1", "!OA 7", "!OA 99", "!OA 107", "!OA -1"] {
        assert_eq!(refused(MotionSystem, &format!("{command};")), NoSuchAxis, "{command}");
    }
}

#[test]
fn what_does_not_exist_is_missing_on_the_smcu() {
    for (command, status) in [
        ("!OI 0", NoSuchInterface),
        ("!OI 4", NoSuchInterface),
        ("!WR 256,0", NoSuchIoModule),
        ("!WR -1,0", NoSuchIoModule),
    ] {
        assert_eq!(refused(MotionSystem, &format!("{command};")), status, "{command}");
        assert_eq!(refused(Smcu, &format!("{command};")), MissingParameter, "{command}");
    }
    assert_eq!(refused(MotionSystem, "!RD 256;"), NoSuchIoModule);
    assert_eq!(read(Smcu, "!OI 3;"), Ok(Command::OpenInterface(Trackball::Report)));
}

fn vectors(text: &str) -> Result<Vec<Vector>, Status> {
    match read(MotionSystem, text)? {
        Command::FollowVectors { axes: [Axis::X, Axis::Y], vectors } => Ok(vectors),
        other => panic!("{text:?} is {other:?}"),
    }
}

#[test]
fn records_have_six_letters() {
    let full =
        Vector { end: [1, -2], centre: [3, -4], speed_change: -5, turn: Turn::Counterclockwise };
    let half = Vector { end: [7, 0], ..Vector::default() };
    for text in [
        "!PH0,1\rX1Y-2I3J-4F-5O1\rX7\r;",
        "!PH 0,1\r\n X 1 Y -2 I 3 J -4 F -5 O 1 \r\n\r\n X 7 Y I J F O \r\n;",
        "!PH0,1\rO1F-5J-4I3Y-2X1\rX7;",
        "!PH0,1X1Y-2I3J-4F-5O9\rX7;",
    ] {
        assert_eq!(vectors(text), Ok(vec![full, half]), "{text:?}");
    }
    let clockwise = Vector { turn: Turn::Clockwise, ..Vector::default() };
    assert_eq!(vectors("!PH0,1\rO-1\r;"), Ok(vec![clockwise]));
}

#[test]
fn records_can_be_wrong() {
    for text in ["!PH0,1;", "!PH0,1\r;", "!PH0,1\r\r\n , \r;"] {
        assert_eq!(vectors(text), Err(MissingParameter), "{text:?}");
    }
    for record in ["X1X2", "X1,2", "5", "5X1", "Z1", "X1PA", "IN", "X1Y2I3J4F5O1X6"] {
        let text = format!("!PH0,1\rX1\r{record}\r;");
        assert_eq!(vectors(&text), Err(TooManyVectorParameters), "{text:?}");
    }
    let many = |count| format!("!PH0,1\r{};", "X1Y1\r".repeat(count));
    assert_eq!(vectors(&many(VECTORS_MAX)).unwrap().len(), VECTORS_MAX);
    assert_eq!(vectors(&many(VECTORS_MAX + 1)), Err(VectorBufferFull));
    for axes in ["0,6", "6,0", "1,1"] {
        assert_eq!(vectors(&format!("!PH{axes}\rX1;")), Err(NoSuchAxis), "{axes}");
    }
}

/// One input for each pair of checks that can both fail: the earlier one says what is answered.
#[test]
fn the_order_of_the_checks_is_fixed() {
    for (model, text, status) in [
        // The model has no such command, and parameters are missing.
        (Smcu, "!MA;", UnknownCommand),
        (Smcu, "!PH;", UnknownCommand),
        // Parameters are missing, although the only form with so many is another model's.
        (MotionSystem, "!AS;", MissingParameter),
        // The form is another model's, and the axis does not exist.
        (Smcu, "!VZ 1,9;", UnknownCommand),
        // Half a pair is missing, and so is the angle.
        (Smcu, "AA 1;", SingleCoordinate),
        // Parameters are missing, and one that is there does not exist.
        (MotionSystem, "!WR 256;", MissingParameter),
        (MotionSystem, "!PH 9;", MissingParameter),
        // The axes, and the records.
        (MotionSystem, "!PH 0,9\rQ1\r;", NoSuchAxis),
        (MotionSystem, "!PH 0,9;", NoSuchAxis),
    ] {
        assert_eq!(refused(model, text), status, "{text:?}");
    }
    let too_much_and_too_many = format!("!PH0,1\r{}Q1\r;", "X1\r".repeat(VECTORS_MAX + 1));
    assert_eq!(refused(MotionSystem, &too_much_and_too_many), TooManyVectorParameters);
}

#[test]
fn commands_are_told_in_words() {
    for (model, text, words) in [
        (Smcu, "PA 1000,2000;", "move to X 1,000 Y 2,000"),
        (Smcu, "PR 5,-6000,0,0;", "move by X +5 Y -6,000, X 0 Y 0"),
        (Smcu, "PA 1,1,2,2,3,3,4,4,5,5;", "move to X 1 Y 1, X 2 Y 2, X 3 Y 3, X 4 Y 4 and 1 more"),
        (Smcu, "AA2000,2000,-90.5;", "arc around X 2,000 Y 2,000, 90.5° clockwise"),
        (Smcu, "AR1,2,45;", "arc around X +1 Y +2 from here, 45° counter-clockwise"),
        (Smcu, "VS 5000;", "speed with the pen down 5,000 µm/s"),
        (Smcu, "VS0.005000;", "speed with the pen down 0.005 (m/s or µm/s)"),
        (Smcu, "CI1500;", "circle with the radius 1,500"),
        (Smcu, "EA10,-20;", "rectangle to X 10 Y -20"),
        (Smcu, "ER10,-20;", "rectangle by X +10 Y -20"),
        (Smcu, "!TA1,2,3;", "move to X 1 Y 2 Z 3"),
        (Smcu, "!TR1,2,-3;", "move by X +1 Y +2 Z -3"),
        (Smcu, "!VU40000;", "speed with the pen up 40,000 µm/s"),
        (Smcu, "!VZ 1000;", "speed of Z0 1,000 (µm/s or 0.1°/s)"),
        (Smcu, "!AS 800;", "acceleration of all axes 800 (mm/s² or mrad/s²)"),
        (MotionSystem, "!RS 7937.5,1;", "resolution of Y 7937.5 (nm or 0.001″)"),
        (MotionSystem, "!SR -5,90000,2;", "range of Z0 from -5 to 90,000"),
        (MotionSystem, "!MA 1,2,3,4,5,-6;", "move to X 1 Y 2 Z0 3 Z1 4 Z2 5 Z3 -6"),
        (MotionSystem, "!OA 3;", "read actual position of Z0 at the last trigger"),
        (MotionSystem, "!IS;", "reference run of all axes"),
        (Smcu, "!WR 33,1000;", "write 1,000 to bank 2 port 1"),
        (
            Smcu,
            "!TD 1,2,3000,4;",
            "times for drilling: 1 ms and 2 ms around lowering, 3,000 ms and 4 ms around lifting",
        ),
        (
            MotionSystem,
            "!PH 0,2\rX100Y-5\rX1I2J3F-40O-1\r;",
            "follow X +100 Z0 -5, X +1 Z0 0 clockwise around X +2 Z0 +3 speed -40 µm/s",
        ),
    ] {
        assert_eq!(read(model, text).expect(text).describe(), words);
    }
}
