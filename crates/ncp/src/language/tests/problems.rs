//! What people are told of lines that are wrong.

use super::{message, read, told};
use crate::Severity;

#[test]
fn lines_that_are_no_command_are_told_as_a_whole() {
    assert_eq!(told("(Steps per circle: 64)"), [("bracket-comment", "(Steps per circle: 64)")]);
    assert_eq!(told("(Steps per circle: 64"), [("no-command", "(Steps per circle: 64")]);
    assert_eq!(told("N5 % 12  ; x"), [("no-command", "% 12")]);
    assert_eq!(told("5 MOVEABS X5"), [("no-command", "5 MOVEABS X5")]);
    assert_eq!(told("\u{b} "), [("no-command", "\u{b}")]);
    assert_eq!(told("größer"), [("unknown-command", "gr")]);
    assert_eq!(told("N12.5 WAIT 3"), [("no-command", ".5 WAIT 3")]);
}

#[test]
fn unknown_commands_are_told_with_the_nearest_known_one() {
    assert_eq!(told("N5 MOVABS X5 ; x"), [("unknown-command", "MOVABS")]);
    assert_eq!(told("G00 X5"), [("unknown-command", "G00")]);
    let (text, help) = message("MOVABS X5");
    assert_eq!(text, "unknown command `MOVABS`");
    assert_eq!(help, "perhaps MOVEABS is meant");
    assert_eq!(message("Werkzeug 5").1, "text that is not a command goes after `;`");
    assert_eq!(read("MOVABS X5 ; kept").0.comment, Some("kept"));
}

#[test]
fn everything_wrong_with_a_line_is_told() {
    assert_eq!(
        told("MOVEABS X Y5 Q7 Y6 Z1-2 FOO 12 ,"),
        [
            ("missing-value", "X"),
            ("unknown-word", "Q7"),
            ("given-twice", "Y6"),
            ("not-a-number", "1-2"),
            ("unknown-word", "FOO 12"),
            ("unexpected-text", ","),
        ]
    );
    assert_eq!(
        told("DRILLDEF C4 C1.5 T-1 V0 Q"),
        [
            ("value-out-of-range", "4"),
            ("not-whole", "1.5"),
            ("value-out-of-range", "-1"),
            ("value-out-of-range", "0"),
            ("unknown-word", "Q"),
        ]
    );
    assert_eq!(
        told("SPINDLE ON OFF CCW CW TIME"),
        [("missing-value", "TIME"), ("contradiction", "OFF"), ("contradiction", "CW"),]
    );
    assert_eq!(told("REF XQY X"), [("unknown-axis", "Q"), ("given-twice", "X")]);
}

#[test]
fn words_are_checked() {
    assert_eq!(told("DRILL X1 Z2"), [("unknown-word", "Z2")]);
    assert_eq!(told("MOVEABS XY100"), [("unknown-word", "XY100")]);
    assert_eq!(told("MOVEABS X5 100"), [("stray-number", "100")]);
    assert_eq!(told("MOVEABS X12,5"), [("unexpected-text", ","), ("stray-number", "5")]);
    assert_eq!(
        told("MOVEABS X=5"),
        [("missing-value", "X"), ("unexpected-text", "="), ("stray-number", "5"),]
    );
    assert_eq!(told("MOVEABS X5 ü"), [("unexpected-text", "ü")]);
    assert_eq!(message("MOVEABS X5 Q6").0, "MOVEABS takes no `Q`");
    assert_eq!(message("MOVEABS X5 Q6").1, "it is written MOVEABS [Xn] [Yn] [Zn] [An]");
    assert_eq!(message("MOVEABS X5 X6").0, "X is given twice");
    assert_eq!(message("MOVEABS X").1, "write a number after X");
}

#[test]
fn numbers_are_checked() {
    for (written, code) in [
        ("--5", "not-a-number"),
        ("1.2.3", "not-a-number"),
        ("-", "not-a-number"),
        (".", "not-a-number"),
        ("1000000000.001", "too-large"),
        ("-1000000001", "too-large"),
        ("99999999999999999999999999", "too-large"),
    ] {
        assert_eq!(told(&format!("MOVEABS X{written}")), [(code, written)], "{written}");
    }
    assert_eq!(told("VEL"), [("missing-value", "VEL")]);
    assert_eq!(told("VEL fast ; x"), [("not-a-number", "fast")]);
    assert_eq!(told("VEL 0"), [("value-out-of-range", "0")]);
    assert_eq!(told("FASTVEL -5"), [("value-out-of-range", "-5")]);
    assert_eq!(told("FASTVEL 50 00"), [("surplus-text", "00")]);
    assert_eq!(told("WAIT -1"), [("value-out-of-range", "-1")]);
    assert_eq!(told("WAIT 2s"), [("surplus-text", "s")]);
    assert_eq!(told("GETTOOL 2.5"), [("not-whole", "2.5")]);
    assert_eq!(told("GETTOOL -1"), [("value-out-of-range", "-1")]);
    assert_eq!(
        told("ACCEL X4.9 Y101"),
        [("value-out-of-range", "4.9"), ("value-out-of-range", "101")]
    );
    assert_eq!(told("SPINDLE RPM-1"), [("value-out-of-range", "-1")]);
    assert_eq!(message("ACCEL X101").1, "from 5 to 100");
    assert_eq!(told("N18446744073709551616 WPZERO"), [("too-large", "N18446744073709551616")]);
}

#[test]
fn warnings_leave_the_command() {
    for (line, code, at) in [
        ("MOVEABS X1.2345", "rounded", "1.2345"),
        ("MOVEABS", "nothing-named", "MOVEABS"),
        ("WPZEROABS ; x", "nothing-named", "WPZEROABS"),
        ("LIMIT", "nothing-named", "LIMIT"),
        ("ACCEL", "nothing-named", "ACCEL"),
        ("DRILLDEF", "nothing-named", "DRILLDEF"),
        ("WPREG1", "nothing-named", "WPREG"),
    ] {
        assert_eq!(told(line), [(code, at)]);
        let (read, problems) = read(line);
        assert_eq!(problems[0].1.severity(), Severity::Warning, "{line}");
        assert!(read.command.is_some(), "{line}");
    }
    assert_eq!(told("MOVEABS X1.2340"), []);
}

#[test]
fn commands_need_what_they_cannot_do_without() {
    for (line, lacks) in [
        ("REF", "REF has no axis"),
        ("PLANE", "PLANE has no plane"),
        ("CWABS X5", "CWABS has no centre, I or J"),
        ("SETPORT", "SETPORT has no port"),
        ("WAITBIT ; x", "WAITBIT has no port"),
        ("WPREG", "WPREG has no register"),
        ("WPREG X5", "WPREG has no register"),
        ("SPINDLE", "SPINDLE has no ON or OFF"),
        ("COOLANT", "COOLANT has no ON or OFF"),
        ("CYL", "CYL has no axis"),
        ("CYL 5000", "CYL has no axis"),
        ("CYL A5000", "CYL has no linear axis to replace"),
    ] {
        let (text, help) = message(line);
        assert_eq!(text, lacks);
        assert!(help.starts_with("it is written "), "{line}: {help}");
        let name = line.split(' ').next().unwrap_or_default();
        assert_eq!(told(line), [("missing-word", name)]);
    }
    assert_eq!(message("WPREG").1, "it is written WPREGn [Xn] [Yn] [Zn] [An] | WPREGnACT");
}

#[test]
fn nothing_stands_behind_a_command() {
    assert_eq!(told("WPZERO now ; x"), [("surplus-text", "now")]);
    assert_eq!(told("HALT turn it"), [("surplus-text", "turn it")]);
    assert_eq!(told("WPREG1ACT X5"), [("surplus-text", "X5")]);
    assert_eq!(told("PLANE X Y"), [("unknown-plane", "X")]);
    assert_eq!(told("PLANE XY Z"), [("surplus-text", "Z")]);
    assert_eq!(told("SETPORT A1=5 A2=6"), [("surplus-text", "A2=6")]);
    assert_eq!(told("RESBIT A1.4=1"), [("surplus-text", "=1")]);
    assert_eq!(told("CYL A5000 Y Z"), [("surplus-text", "Z")]);
    assert_eq!(message("WPZERO now").0, "WPZERO takes nothing more");
}

#[test]
fn ports_are_checked() {
    for (line, code, at) in [
        ("SETPORT E1=5", "not-a-port", "E1=5"),
        ("SETPORT 1=5", "not-a-port", "1=5"),
        ("SETPORT A=5", "not-a-port", "A=5"),
        ("WAITPORT A1==5", "not-a-port", "A1==5"),
        ("SETPORT A0=5", "value-out-of-range", "0"),
        ("SETPORT A5=5", "value-out-of-range", "5"),
        ("SETPORT A300=5", "value-out-of-range", "300"),
        ("SETPORT A1", "missing-equals", "A1"),
        ("SETPORT A1 5", "missing-equals", "A1"),
        ("SETPORT A1=", "missing-port-value", "A1="),
        ("SETPORT A1=256", "value-out-of-range", "256"),
        ("SETPORT A1=99999999999", "value-out-of-range", "99999999999"),
        ("SETPORT A1=F2", "not-a-port-value", "F2"),
        ("SETPORT A1=12B", "not-a-port-value", "12B"),
        ("SETPORT A1=H", "not-a-port-value", "H"),
        ("SETPORT A1=-5", "not-a-port-value", "-5"),
        ("SETBIT A1", "missing-bit", "A1"),
        ("SETBIT A1.", "missing-bit", "A1."),
        ("SETBIT A1.0", "value-out-of-range", "0"),
        ("SETBIT A1.9", "value-out-of-range", "9"),
        ("SETBIT A1.4=2", "value-out-of-range", "2"),
        ("WAITBIT E1.4", "missing-equals", "E1.4"),
        ("WAITBIT E1.4==2", "value-out-of-range", "2"),
        ("WPREG0 X5", "value-out-of-range", "0"),
        ("WPREG9ACT", "value-out-of-range", "9"),
    ] {
        assert_eq!(told(line), [(code, at)], "{line}");
    }
    assert_eq!(message("SETPORT E1=5").0, "this is not an output port");
    assert_eq!(message("WAITPORT A1==5").0, "this is not an input port");
    assert_eq!(message("SETPORT A5=5").0, "the number of the port is out of range");
    assert_eq!(message("SETPORT A5=5").1, "from 1 to 4");
}

#[test]
fn limits_and_cylinders_are_checked() {
    assert_eq!(told("LIMIT X5"), [("missing-upper-limit", "X5")]);
    assert_eq!(told("LIMIT X5 Y1,2"), [("missing-upper-limit", "X5")]);
    assert_eq!(told("LIMIT X5,"), [("missing-value", "X")]);
    assert_eq!(told("LIMIT X5,4"), [("limits-reversed", "X5,4")]);
    assert_eq!(told("LIMIT X1.2.3,4 Q"), [("not-a-number", "1.2.3"), ("unknown-word", "Q")]);
    assert_eq!(told("CYL A-1 Y"), [("value-out-of-range", "-1")]);
    assert_eq!(told("CYL A"), [("missing-value", "A")]);
    assert_eq!(told("CYL Q5 Y"), [("unknown-axis", "Q")]);
    assert_eq!(told("CYL A5 B"), [("not-linear", "B")]);
    assert_eq!(told("CYL X5 X"), [("given-twice", "X")]);
}
