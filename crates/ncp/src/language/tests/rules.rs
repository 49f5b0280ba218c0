//! How lines are read.

use super::{command, read};
use crate::language::{Frame, Instruction, Placed, Rate, Span, Value, reference};

/// The command that a line prints as, if it is right.
fn printed(line: &str) -> String {
    command(line).to_string()
}

#[track_caller]
fn same(lines: &[&str], expected: &str) {
    for line in lines {
        assert_eq!(printed(line), expected, "{line}");
    }
}

#[test]
fn case_blanks_zeros_and_signs_do_not_matter() {
    same(
        &[
            "MOVEABS X-2500 Y5000",
            "moveabs x-2500 y5000",
            "MoveAbs\tX-02500\t Y005000\t",
            "  MOVEABS X -2500 Y +5000",
            "MOVEABS X-2500Y5000",
            "MOVEABS Y5000.000 X-2500.",
        ],
        "MOVEABS X-2500 Y5000",
    );
    assert_eq!(printed("MOVEREL X.5 Y-0.001 Z1.25"), "MOVEREL X0.5 Y-0.001 Z1.25");
}

#[test]
fn lines_have_a_number_a_command_and_a_comment_or_none_of_them() {
    let parts = |line: &'static str| {
        let (line, problems) = read(line);
        assert!(problems.is_empty(), "{problems:?}");
        (line.number, line.command.map(|command| command.value.to_string()), line.comment)
    };
    let wait = || Some("WAIT 5".to_owned());
    assert_eq!(parts(""), (None, None, None));
    assert_eq!(parts(" \t "), (None, None, None));
    assert_eq!(parts(";"), (None, None, Some("")));
    assert_eq!(parts("  ;  a ; b  "), (None, None, Some("a ; b")));
    assert_eq!(parts("N000013"), (Some(13), None, None));
    assert_eq!(parts("N3 ; 3RECTS.NCP"), (Some(3), None, Some("3RECTS.NCP")));
    assert_eq!(parts("n 12 WAIT 5"), (Some(12), wait(), None));
    assert_eq!(parts("N12WAIT5;x"), (Some(12), wait(), Some("x")));
    assert_eq!(parts("WAIT 5 ;größer"), (None, wait(), Some("größer")));
    assert_eq!(parts("N18446744073709551615"), (Some(u64::MAX), None, None));
}

#[test]
fn places_are_those_in_the_line() {
    let (line, _) = read("N12 MOVEABS X-5  y +7.5 ; x");
    let Some(Placed { value: Instruction::Move(Frame::Absolute, Rate::Normal, words), span }) =
        line.command
    else {
        panic!("a move");
    };
    assert_eq!(span, Span { start: 4, end: 23 });
    let word = |value, start, end| Some(Placed { value, span: Span { start, end } });
    assert_eq!(words[0], word(Value::whole(-5), 12, 15));
    assert_eq!(words[1], word(Value::thousandths(7_500), 17, 23));
    assert_eq!(words[2..], [None; 4]);

    let (line, _) = read("CYL A 5000 Y ");
    let Some(Placed { value: Instruction::Cylinder(turning, radius, linear), span }) = line.command
    else {
        panic!("a cylinder");
    };
    assert_eq!(span, Span { start: 0, end: 12 });
    assert_eq!((turning.value, turning.span), (3, Span { start: 4, end: 5 }));
    assert_eq!((radius.value, radius.span), (Value::whole(5000), Span { start: 4, end: 10 }));
    assert_eq!(linear, Some(Placed { value: 1, span: Span { start: 11, end: 12 } }));

    let (line, _) = read("LIMIT Y-1 , 20");
    let Some(Placed { value: Instruction::Limit(limits), .. }) = line.command else {
        panic!("limits")
    };
    let (low, high) = limits[1].expect("Y has limits");
    assert_eq!((low.span, high.span), (Span { start: 6, end: 9 }, Span { start: 12, end: 14 }));
}

#[test]
fn moves_have_a_frame_and_a_rate() {
    same(&["moveabs z5 a-3600"], "MOVEABS Z5 A-3600");
    same(&["MOVEREL Y69625"], "MOVEREL Y69625");
    same(&["FASTABS X0 B1 C2"], "FASTABS X0 B1 C2");
    same(&["FASTREL Z5000"], "FASTREL Z5000");
    assert!(matches!(command("FASTREL Z1"), Instruction::Move(Frame::Relative, Rate::Rapid, _)));
}

#[test]
fn arcs_have_their_centre_before_or_behind_their_end() {
    same(&["CWABS I75000 J50000 X1 Z2", "CWABS X1 Z2 I75000 J50000"], "CWABS I75000 J50000 X1 Z2");
    same(&["CCWREL J-5 X1", "ccwrel x1 j-5"], "CCWREL J-5 X1");
    same(&["CWHLXABS I1 Z5"], "CWHLXABS I1 Z5");
    same(&["CCWHLXREL Z5 I1"], "CCWHLXREL I1 Z5");
    for name in ["CCWABS", "CWREL", "CWHLXREL", "CCWHLXABS"] {
        same(&[&format!("{name} I1 J2")], &format!("{name} I1 J2"));
    }
}

#[test]
fn planes_are_pairs_in_any_order() {
    same(&["PLANE XY", "plane yx", "PLANE  Xy"], "PLANE XY");
    same(&["PLANE XZ", "PLANE ZX"], "PLANE XZ");
    same(&["PLANE YZ", "PLANE ZY"], "PLANE YZ");
}

#[test]
fn reference_runs_keep_the_order_of_their_groups() {
    assert_eq!(command("REF X YZA"), Instruction::Reference([0b0001, 0b1110, 0, 0, 0, 0]));
    assert_eq!(command("ref zyx"), Instruction::Reference([0b0111, 0, 0, 0, 0, 0]));
    assert_eq!(command("REF C B A Z Y X"), Instruction::Reference([32, 16, 8, 4, 2, 1]));
    same(&["REF Z  YX ; all"], "REF Z XY");
}

#[test]
fn limits_are_pairs() {
    let all = "LIMIT X-100,5000 Y0,3000";
    same(&[all, "LIMIT Y0,3000 X-100 , 5000", "limit x -100 ,+5000y0,3000"], all);
    same(&["LIMIT A5,5"], "LIMIT A5,5");
}

#[test]
fn numbers_without_a_letter_need_no_blank() {
    same(&["VEL 5000", "VEL5000", "vel\t05000.0"], "VEL 5000");
    same(&["FASTVEL 0.001"], "FASTVEL 0.001");
    same(&["WAIT 0", "WAIT0"], "WAIT 0");
    same(&["GETTOOL 3", "GETTOOL3", "GETTOOL 03.0"], "GETTOOL 3");
}

#[test]
fn zeros_are_set_kept_and_taken() {
    same(&["WPZERO"], "WPZERO");
    same(&["WPCLEAR"], "WPCLEAR");
    same(&["WPTEACH"], "WPTEACH");
    same(&["WPZEROABS X5 Z-5"], "WPZEROABS X5 Z-5");
    same(&["WPREG1 X5", "WPREG 1 X5", "WPREG1X5", "wpreg01 x5"], "WPREG1 X5");
    same(&["WPREG8ACT", "WPREG 8 ACT", "WPREG8 act"], "WPREG8ACT");
    same(&["WPREG3 A5 C6"], "WPREG3 A5 C6");
}

#[test]
fn ports_have_values_in_three_bases() {
    for (written, value) in [
        ("100101B", 37),
        ("00100101b", 37),
        ("00000000011111111B", 255),
        ("42D", 42),
        ("042", 42),
        ("255", 255),
        ("F2H", 0xF2),
        ("0f2h", 0xF2),
        ("1BH", 0x1B),
        ("1DH", 0x1D),
        ("10B", 2),
        ("10D", 10),
        ("10H", 16),
        ("10", 10),
        ("0", 0),
    ] {
        assert_eq!(
            command(&format!("SETPORT A2={written}")),
            Instruction::SetPort(2, value),
            "{written}"
        );
        let line = format!("WAITPORT E4 == {written} ; x");
        assert_eq!(command(&line), Instruction::WaitPort(4, value), "{written}");
    }
    same(&["setport a 1 = 7", "SETPORT A1==7", "SETPORT A1= =7"], "SETPORT A1=7D");
}

#[test]
fn bits_have_a_port_and_a_number() {
    same(&["SETBIT A1.4", "SETBIT A 1 . 4", "setbit a1.4=1"], "SETBIT A1.4");
    same(&["RESBIT A4.8", "SETBIT A4.8=0"], "RESBIT A4.8");
    same(&["WAITBIT E1.4==1", "WAITBIT E1.4 = 1", "WAITBIT E1.4=1B"], "WAITBIT E1.4==1");
    same(&["WAITBIT E2.1==0"], "WAITBIT E2.1==0");
}

#[test]
fn drill_cycles_take_all_their_words() {
    let all = "DRILLDEF C2 P2000 D20000 T1000 V10000 F7000 O5000 I1000 R1500 L1200 S3000";
    same(&[all], all);
    same(&["DRILLDEF S3000 C1"], "DRILLDEF C1 S3000");
    same(&["DRILL X10000 Y30000"], "DRILL X10000 Y30000");
    same(&["DRILL Y5"], "DRILL Y5");
    same(&["DRILL"], "DRILL");
}

#[test]
fn cylinders_turn_an_axis_and_replace_another() {
    same(&["CYL A5000 Y", "cyl a5000y", "CYL A 5000 y ; x"], "CYL A5000 Y");
    same(&["CYL A0"], "CYL A0");
    same(&["CYL A0 X"], "CYL A0 X");
}

#[test]
fn spindles_take_words_in_any_order() {
    same(&["SPINDLE ON"], "SPINDLE ON");
    same(&["SPINDLE OFF"], "SPINDLE OFF");
    let all = "SPINDLE ON CW RPM24000 TIME5000";
    same(&[all, "SPINDLE CW RPM 24000 TIME 5000", "spindle time5000 rpm24000 cw on"], all);
    same(&["SPINDLE CCW"], "SPINDLE ON CCW");
    same(&["SPINDLE ON TIME2000", "SPINDLE TIME 2000"], "SPINDLE ON TIME2000");
    same(&["COOLANT ON"], "COOLANT ON");
    same(&["COOLANT off"], "COOLANT OFF");
}

#[test]
fn the_rest_takes_what_it_takes() {
    same(&["ACCEL X5 Y100 A50.0"], "ACCEL X5 Y100 A50");
    same(&["TOOLDEF T1 L40000 R1500", "TOOLDEF"], "TOOLDEF");
    for name in ["PATH", "PATHEND", "HALT", "INITTOOL", "PROGEND"] {
        same(&[name, &name.to_lowercase()], name);
    }
}

#[test]
fn what_follows_marks_and_types_is_free() {
    for line in ["IMF_PBL_V1.0 - HPREMOTE V1.32 - PP FILE", "N000001 imf_pblxyz ; ä", "IMF_PBL"] {
        assert_eq!(command(line), Instruction::Mark, "{line}");
        assert_eq!(read(line).0.comment, None, "{line}");
    }
    same(&["TYPE 3 = (x) ; y", "type"], "TYPE");
    let (line, problems) = read("PROGEND of the job ; done");
    assert!(problems.is_empty());
    assert_eq!(
        (line.command.map(|end| end.value), line.comment),
        (Some(Instruction::End), Some("done"))
    );
}

#[test]
fn the_job_of_the_manual_is_right() {
    const JOB: &str = "\
N000001 IMF_PBL_V1.0 - HPREMOTE V1.32 - PP FILE
N000003 ; 3RECTS.NCP Fri Mar 01 12:04:29 1996
N000005 VEL 5000
N000006 FASTVEL 50000
N000007 MOVEABS Z-3000
N000010 FASTABS X53375 Y0 Z-3000
N000013 MOVEREL Y69625
N000015 MOVEREL Y-69625
N000039 PROGEND";
    for (line, number) in JOB.lines().zip([1, 3, 5, 6, 7, 10, 13, 15, 39]) {
        let (line, problems) = read(line);
        assert!(problems.is_empty(), "{problems:?}");
        assert_eq!(line.number, Some(number));
        assert_eq!(line.command.is_some(), number != 3);
    }
}

/// A blank that is left out makes an error, or nothing different: no line has two readings. REF is
/// the exception that the manual makes, where a blank ends a group of axes.
#[test]
fn a_missing_blank_never_means_something_else() {
    let mut without = 0;
    let longer = [
        "N3 MOVEABS X 1660 Y -5.5 Z +7",
        "SPINDLE ON CW RPM 12000 TIME 10",
        "DRILLDEF C 1 D 3000 V 2000 L 1000 S 5000",
        "LIMIT X 0 , 100 Y 0 , 100",
        "SETBIT A1 . 4 = 1",
        "WAITPORT E1 == 10B",
        "WPREG 1 ACT",
        "WPREG 1 X 5 A 6",
        "COOLANT 2 ON",
        "CYL A 5000 Y",
    ];
    let examples = reference::COMMANDS.iter().map(|info| info.example);
    for line in examples.chain(longer).filter(|line| !line.starts_with("REF")) {
        let whole = command(line).to_string();
        for (at, _) in line.match_indices(' ') {
            let shorter = format!("{}{}", &line[..at], &line[at + 1..]);
            let (read, problems) = read(&shorter);
            if let Some(read) = read.command.filter(|_| problems.is_empty()) {
                assert_eq!(read.value.to_string(), whole, "{shorter}");
                without += 1;
            }
        }
    }
    assert!(without > 50, "only {without} lines can do without a blank");
}
