//! The rules of every command, as tables of lines: what a line means, written the way the
//! printer writes it, or what it is answered with.

use super::{axes, context, frame, print, read};
use crate::Dialect::{Imc4, Imc4M, ImcXx};
use crate::Mode::{Direct, Stored};
use crate::Reply::{Axis, Count, NotStorable, Number, Speed, Syntax};
use crate::{
    Addressed, AxisSet, Command, Context, Dialect, Fault, Fractions, Mode, Pair, Pairs, Reply,
    parse,
};

type Expected = Result<&'static str, Reply>;

fn check_in(dialect: Dialect, mode: Mode, ctx: &Context<'_>, lines: &[(&str, Expected)]) {
    for (line, expected) in lines {
        let meaning = read(line.as_bytes(), dialect, mode, ctx)
            .map(|command| print(&command, dialect, mode).escape_ascii().to_string());
        let expected = expected.map(str::to_owned);
        assert_eq!(meaning, expected, "{line:?}, {dialect:?}, axes {}", ctx.axes);
    }
}

fn check(dialect: Dialect, mode: Mode, bits: u8, lines: &[(&str, Expected)]) {
    check_in(dialect, mode, &context(axes(bits)), lines);
}

#[test]
fn a_direct_line_begins_with_at_and_a_device_number() {
    let address = |line: &'static str| match parse(line.as_bytes(), Imc4, Direct, 0) {
        Ok(Addressed::Frame(_)) => Ok(true),
        Ok(Addressed::OtherDevice) => Ok(false),
        Err(reply) => Err(reply),
    };
    for (line, expected) in [
        ("@0P", Ok(true)),
        (" @ 0 P ", Ok(true)),
        ("@1P", Ok(false)),
        ("@9", Ok(false)),
        ("@1 no such thing", Ok(false)),
        ("@", Err(Syntax)),
        ("@P", Err(Syntax)),
        ("@-0P", Err(Syntax)),
        ("0P", Err(Syntax)),
        ("P", Err(Syntax)),
        ("@@0P", Err(Syntax)),
        ("x@0P", Err(Syntax)),
        ("@0", Err(Syntax)),
        ("@0 ", Err(Syntax)),
        ("@0x", Err(Syntax)),
        ("@0,", Err(Syntax)),
        ("@0@0P", Err(Syntax)),
    ] {
        assert_eq!(address(line).map_err(Fault::reply), expected, "{line:?}");
    }
    assert!(matches!(parse(b"@3P", ImcXx, Direct, 3), Ok(Addressed::Frame(_))));
    assert!(matches!(parse(b"@0P", ImcXx, Direct, 3), Ok(Addressed::OtherDevice)));
}

#[test]
fn a_stored_line_begins_with_its_code() {
    check(
        Imc4,
        Stored,
        1,
        &[
            ("05000,900", Ok("05000,900")),
            (" 0 5000 , 900 ", Ok("05000,900")),
            (" @0A5000,900", Err(NotStorable)),
            ("@1P", Err(NotStorable)),
            ("A5000,900", Err(NotStorable)),
            ("M5000,900", Err(NotStorable)),
            (",", Err(NotStorable)),
            ("-05000,900", Err(NotStorable)),
        ],
    );
    // Lines that only the iMC-xx stores, and lines that no model stores.
    for line in ["133", "233,-10", "60,128,1", "d900", "g1", "j300", "J100", "N1", "T1"] {
        assert_eq!(frame(line.as_bytes(), Imc4, Stored).unwrap_err(), NotStorable, "{line}");
        assert_eq!(frame(line.as_bytes(), Imc4M, Stored).unwrap_err(), NotStorable, "{line}");
        assert!(frame(line.as_bytes(), ImcXx, Stored).is_ok(), "{line}");
    }
    for line in ["D", "G1", "F1", "E1", "O0,0,1,1", "P0,0,1", "W", "Y", "Z0", "S", "i", "R7"] {
        assert_eq!(frame(line.as_bytes(), ImcXx, Stored).unwrap_err(), NotStorable, "{line}");
    }
}

#[test]
fn letters_have_the_case_the_manual_gives() {
    // Letter; then for imc4, imc4-m and iMC-xx the mnemonic it stands for.
    for (letter, mnemonics) in [
        ('A', ["@A", "@A", "@A"]),
        ('a', ["@A", "@A", "@A"]),
        ('b', ["@b", "@b", "@b"]),
        ('B', ["@B", "@B", "@B"]),
        ('d', ["@d", "@d", "@d"]),
        ('e', ["@e", "@e", "@e"]),
        ('E', ["", "", ""]),
        ('f', ["@f", "@f", "@f"]),
        ('F', ["", "", "@F"]),
        ('g', ["", "", "@g"]),
        ('G', ["", "", "@G"]),
        ('h', ["", "@h", "@h"]),
        ('H', ["@H", "@H", "@H"]),
        ('i', ["@i", "@i", "@i"]),
        ('j', ["", "", "@j"]),
        ('J', ["", "", "@J"]),
        ('k', ["", "@k", "@k"]),
        ('K', ["", "", ""]),
        ('m', ["", "", "@M"]),
        ('M', ["@M", "@M", "@M"]),
        ('n', ["@n", "@n", "@n"]),
        ('N', ["", "", "@N"]),
        ('p', ["", "", ""]),
        ('P', ["@P", "@P", "@P"]),
        ('r', ["@R", "@R", "@R"]),
        ('R', ["@R", "@R", "@R"]),
        ('s', ["@S", "@S", "@S"]),
        ('S', ["@S", "@S", "@S"]),
        ('t', ["", "", ""]),
        ('T', ["@T", "@T", "@T"]),
        ('u', ["", "", ""]),
        ('U', ["", "", "@U"]),
        ('v', ["", "", ""]),
        ('V', ["@V", "@V", "@V"]),
        ('w', ["", "", "@w"]),
        ('y', ["@y", "@y", "@y"]),
        ('Y', ["", "", ""]),
        ('z', ["@z", "@z", "@z"]),
        ('Z', ["", "@Z", "@Z"]),
        ('?', ["@?", "@?", "@V"]),
    ] {
        for (dialect, mnemonic) in Dialect::ALL.into_iter().zip(mnemonics) {
            let line = format!("@0{letter}");
            let known = frame(line.as_bytes(), dialect, Direct).map(|f| f.spec().mnemonic);
            let expected = if mnemonic.is_empty() { Err(Syntax) } else { Ok(mnemonic) };
            assert_eq!(known, expected, "{line}, {dialect:?}");
        }
    }
    for (code, mnemonics) in [
        ('D', ["@ID", "@ID", "@ID"]),
        ('R', ["@IR", "@IR", "@IR"]),
        ('S', ["@IS", "@IS", ""]),
        ('L', ["", "@IL", "@IL"]),
        ('d', ["", "", "@Id"]),
        ('r', ["", "", ""]),
        ('w', ["", "", ""]),
        ('W', ["", "", "@IW"]),
    ] {
        for (dialect, mnemonic) in Dialect::ALL.into_iter().zip(mnemonics) {
            let line = format!("@0I{code}");
            let known = frame(line.as_bytes(), dialect, Direct).map(|f| f.spec().mnemonic);
            let expected = if mnemonic.is_empty() { Err(Syntax) } else { Ok(mnemonic) };
            assert_eq!(known, expected, "{line}, {dialect:?}");
        }
    }
}

#[test]
fn init_codes_are_those_of_the_dialect() {
    for (dialect, codes) in [(Imc4, "DRS"), (Imc4M, "DRLS"), (ImcXx, "dFJjOEeDRTAaHNCULWX")] {
        for code in 0..=u8::MAX {
            let known = frame(&[b'@', b'0', b'I', code, b'1'], dialect, Direct).is_ok();
            // A blank is skipped, and `1` is no code.
            assert_eq!(known, codes.as_bytes().contains(&code), "{code}, {dialect:?}");
        }
        assert_eq!(frame(b"@0I", dialect, Direct).unwrap_err(), Syntax);
    }
}

#[test]
fn the_number_of_axes_stands_in_the_place_of_the_letter() {
    check(
        Imc4,
        Direct,
        0,
        &[
            ("@0 7 ", Ok("@07")),
            ("@0+7", Ok("@07")),
            ("@007", Ok("@07")),
            ("@016", Err(Axis)),
            ("@0-1", Err(Axis)),
            ("@0257", Err(Axis)),
            ("@0123456789012345678901234567890", Err(Axis)),
            ("@03x", Err(Number)),
            ("@0-", Err(Number)),
            ("@07.0", Err(Number)),
            ("@03,1", Err(Count)),
            ("@03,", Err(Count)),
            ("@03x,1", Err(Count)),
        ],
    );
}

/// What a direct line's number of fields is worth.
fn counted(line: &str, dialect: Dialect, axes: AxisSet) -> Result<(), Reply> {
    let frame = frame(line.as_bytes(), dialect, Direct).unwrap();
    frame.check_count(axes).map_err(Fault::reply)
}

#[test]
fn a_move_has_one_pair_for_each_axis_but_two_for_z() {
    for (bits, pairs) in [(1, 1), (3, 2), (7, 4), (15, 4), (8, 1), (9, 2), (11, 3)] {
        for letter in ["@0A", "@0M"] {
            for count in 0..=9 {
                let line = format!("{letter}{}", vec!["5"; count].join(","));
                let counted = counted(&line, Imc4, axes(bits));
                let expected = if count == 2 * pairs { Ok(()) } else { Err(Count) };
                assert_eq!(counted, expected, "{line}, axes {}", axes(bits));
            }
        }
    }
    assert_eq!(counted("@0A", Imc4, AxisSet::NONE), Err(Count));
    check(
        Imc4,
        Direct,
        7,
        &[
            ("@0A30,800,10,900,4,90,-4,30", Ok("@0A30,800,10,900,4,90,-4,30")),
            ("@0A 30 , 800, 10,900,4,90,-4,30 ", Ok("@0A30,800,10,900,4,90,-4,30")),
            ("@0a-0,800,+10,900,4,90,0,30", Ok("@0A0,800,10,900,4,90,0,30")),
            ("@0M30,800,10,900,4,90,7,30", Ok("@0M30,800,10,900,4,90,7,30")),
            // Steps are 24 bits.
            (
                "@0A8388607,800,-8388608,900,4,90,-4,30",
                Ok("@0A8388607,800,-8388608,900,4,90,-4,30"),
            ),
            ("@0A8388608,800,10,900,4,90,-4,30", Err(Number)),
            ("@0A30,800,-8388609,900,4,90,-4,30", Err(Number)),
            ("@0A30,800,10,8388608,4,90,-4,30", Err(Number)),
            // Every speed counts, also of an axis that does not move, also the second of Z.
            ("@0A30,20,10,20000,4,90,-4,30", Ok("@0A30,20,10,20000,4,90,-4,30")),
            ("@0A30,19,10,900,4,90,-4,30", Err(Speed)),
            ("@0A30,800,0,20001,4,90,-4,30", Err(Speed)),
            ("@0A30,800,0,0,4,90,-4,30", Err(Speed)),
            ("@0A30,800,0,-900,4,90,-4,30", Err(Speed)),
            ("@0M30,800,10,900,4,90,0,0", Err(Speed)),
        ],
    );
    check(
        Imc4,
        Stored,
        3,
        &[
            ("050,900,20,9000", Ok("050,900,20,9000")),
            ("m50,900,20,9000", Ok("m50,900,20,9000")),
            ("050,900", Err(Count)),
            ("m50,900,20,1", Err(Speed)),
        ],
    );
}

#[test]
fn the_count_comes_before_numbers_and_numbers_before_speeds() {
    check(
        Imc4,
        Direct,
        3,
        &[
            ("@0A5x0", Err(Count)),
            ("@0A5x,900,0,900", Err(Number)),
            ("@0A5,1,x,900", Err(Number)),
            ("@0A5,1,0,99999999", Err(Number)),
            ("@0A5,1,0,900", Err(Speed)),
            ("@0A,,,", Err(Number)),
            ("@0A5,900,0,", Err(Number)),
            ("@0A", Err(Count)),
            ("@0A5 0,900,0,900", Err(Number)),
            ("@0y1,1,x,0,0,1,1", Err(Number)),
            ("@0y1,1,0,0,0,1,2", Err(Number)),
        ],
    );
    check(
        ImcXx,
        Direct,
        3,
        &[
            ("@0Z9,1,1,1,5,5", Err(Number)),
            ("@0Z0,1,1,1,5,99999999", Err(Number)),
            ("@0Z0,1,1,1,5,5", Err(Speed)),
            ("@0Id1,1,1,x", Err(Number)),
            ("@0Id1,1,1,99999999", Err(Number)),
        ],
    );
}

#[test]
fn fractions_are_a_quirk() {
    let mut ctx = context(AxisSet::X);
    check_in(ImcXx, Direct, &ctx, &[("@0A12.7,900", Err(Number))]);
    ctx.fractions = Fractions::Truncate;
    check_in(
        ImcXx,
        Direct,
        &ctx,
        &[
            ("@0A12.7,900", Ok("@0A12,900")),
            ("@0A-0.5,900.9", Ok("@0A0,900")),
            ("@0A5.,900", Ok("@0A5,900")),
            ("@0A.5,900", Err(Number)),
            ("@0A12.7.1,900", Err(Number)),
            ("@0A8388607.9,900", Ok("@0A8388607,900")),
        ],
    );
}

#[test]
fn a_goes_alone_on_reference_runs_and_zeros() {
    for letter in ["@0R", "@0n", "@0N"] {
        let reads = |bits: u8, number: &str| {
            let line = format!("{letter}{number}");
            let command = read(line.as_bytes(), ImcXx, Direct, &context(axes(bits)))?;
            match command {
                Command::Reference(axes)
                | Command::Zero(axes)
                | Command::SimulateReference(axes) => Ok(axes.bits()),
                _ => panic!("{line} is {command:?}"),
            }
        };
        for number in 1..=8 {
            assert_eq!(reads(15, &number.to_string()), Ok(number));
        }
        for number in ["0", "9", "11", "15", "16", "-1", "99999999"] {
            assert_eq!(reads(15, number), Err(Axis), "{letter}{number}");
        }
        assert_eq!(reads(7, "8"), Err(Axis));
        assert_eq!(reads(7, "7"), Ok(7));
        assert_eq!(reads(3, "7"), Err(Axis));
        assert_eq!(reads(3, "2"), Ok(2));
        assert_eq!(reads(8, "1"), Err(Axis));
        assert_eq!(reads(15, "x"), Err(Number));
        assert_eq!(reads(15, ""), Err(Count));
        assert_eq!(reads(15, "7,8"), Err(Count));
    }
    check(Imc4, Stored, 7, &[("7 5", Ok("75")), ("715", Err(Axis)), ("n4", Ok("n4"))]);
    check(ImcXx, Direct, 15, &[("@0F4", Ok("@0F4"))]);
    check(ImcXx, Direct, 3, &[("@0F4", Err(Axis)), ("@0F2", Ok("@0F2"))]);
}

#[test]
fn reference_speeds_are_as_many_as_axes_or_four() {
    check(
        Imc4,
        Direct,
        3,
        &[
            ("@0d2400,3000", Ok("@0d2400,3000")),
            // Of four, those for axes that are not configured may be anything, and mean nothing.
            ("@0d2400,3000,0,-5", Ok("@0d2400,3000,0,0")),
            ("@0d2400,3000,99999999,500", Ok("@0d2400,3000,0,0")),
            ("@0d2400,3000,x,500", Err(Number)),
            ("@0d2400,1,500,500", Err(Speed)),
            ("@0d99999999,1,500,500", Err(Number)),
            ("@0d2400", Err(Count)),
            ("@0d2400,3000,500", Err(Count)),
            ("@0d2400,3000,500,500,500", Err(Count)),
        ],
    );
    check(
        Imc4,
        Direct,
        9,
        &[
            ("@0d2400,3000", Ok("@0d2400,3000")),
            ("@0d2400,0,0,3000", Ok("@0d2400,0,0,3000")),
            ("@0d2400,0,0,0", Err(Speed)),
        ],
    );
    check(
        ImcXx,
        Stored,
        1,
        &[
            ("d2500,0,0,0", Ok("d2500,0,0,0")),
            ("d2500", Ok("d2500")),
            ("d1", Err(Speed)),
            ("d2500,2500", Err(Count)),
        ],
    );
    check(
        ImcXx,
        Direct,
        1,
        &[
            ("@0Id1000,900,500,900", Ok("@0Id1000,900,500,900")),
            ("@0Id1000", Err(Count)),
            ("@0Id1000,900,500,1", Err(Speed)),
            ("@0Id1000,900,500,", Err(Number)),
        ],
    );
}

#[test]
fn reference_speeds_find_their_axis() {
    let xa = axes(9);
    let speeds = |line: &str| match read(line.as_bytes(), Imc4, Direct, &context(xa)).unwrap() {
        Command::ReferenceSpeeds(speeds) => [0, 1, 2, 3].map(|axis| speeds.of(axis, xa)),
        other => panic!("{other:?}"),
    };
    assert_eq!(speeds("@0d100,400"), [Some(100), None, None, Some(400)]);
    assert_eq!(speeds("@0d100,200,300,400"), [Some(100), None, None, Some(400)]);
}

#[test]
fn settings_have_ranges() {
    check(
        ImcXx,
        Direct,
        0,
        &[
            ("@0G9", Ok("@0G9")),
            ("@0j99999999", Err(Number)),
            ("@0IF20,50,50,8388607", Ok("@0IF20,50,50,8388607")),
            ("@0IF20,50,50,8388608", Err(Number)),
            ("@0IF20,50,50,-1", Err(Number)),
        ],
    );
}

#[test]
fn the_text_of_iu_is_taken_as_it_is() {
    check(
        ImcXx,
        Direct,
        0,
        &[
            ("@0IU two words, and a comma ", Ok("@0IU two words, and a comma ")),
            ("@0 I UABC", Ok("@0IUABC")),
            ("@0IU12345678901234567890123456789012 ", Err(Number)),
        ],
    );
}

#[test]
fn a_diagnosis_has_exactly_two_characters() {
    for (dialect, codes) in [
        (Imc4, &["Rp", "Rn", "P0", "P1", "O0", "S0"][..]),
        (Imc4M, &["Rp", "Rn", "P0", "P1", "P2", "O0", "O1", "S0", "H0", "SL"]),
        (ImcXx, &["Rp", "Rn", "S0"]),
    ] {
        for first in b'!'..=b'~' {
            for second in b'!'..=b'~' {
                let line = [b'@', b'0', b'D', first, second];
                let code = str::from_utf8(&line[3..]).unwrap();
                let expected = codes.contains(&code);
                let meaning = read(&line, dialect, Direct, &context(AxisSet::NONE));
                let diagnosis = Command::Diagnosis([first, second]);
                assert_eq!(meaning, if expected { Ok(diagnosis) } else { Err(Syntax) });
            }
        }
    }
    check(
        Imc4,
        Direct,
        0,
        &[("@0D Rp ", Ok("@0DRp")), ("@0DR p", Err(Syntax)), ("@0DRp,1", Err(Syntax))],
    );
}

#[test]
fn ports_are_those_of_the_model() {
    check(
        Imc4,
        Direct,
        0,
        &[("@0b65536", Err(Number)), ("@0B65529,7", Ok("@0B65529,7")), ("@0B1", Err(Count))],
    );
    check(
        ImcXx,
        Direct,
        0,
        &[
            ("@0IA4,1,1", Err(Number)),
            ("@0IN0,3,-1", Err(Number)),
            ("@0IN0,3", Err(Count)),
            ("@0Ia4,1,255", Ok("@0Ia4,1,255")),
            ("@0Ia65531,1,1", Err(Number)),
        ],
    );
}

#[test]
fn circles() {
    check(
        ImcXx,
        Direct,
        3,
        &[
            ("@0y400,1500,119,-141,141,-1,-1", Ok("@0y400,1500,119,-141,141,-1,-1")),
            ("@0y0,1500,0,0,0,1,1", Ok("@0y0,1500,0,0,0,1,1")),
            ("@0y-1,1500,0,0,0,1,1", Err(Number)),
            ("@0y8388608,1500,0,0,0,1,1", Err(Number)),
            ("@0y1,1500,8388608,0,0,1,1", Err(Number)),
            ("@0y1,1500,0,0,0,0,1", Err(Number)),
            ("@0y1,1500,0,0,0,1,-2", Err(Number)),
            ("@0y1,19,0,0,0,1,1", Err(Speed)),
            ("@0y1,1500,0,0,0,1", Err(Count)),
            ("@0w32000,600,-1000,-2000,0,1,-1,6000", Ok("@0w32000,600,-1000,-2000,0,1,-1,6000")),
            ("@0w0,600,0,0,0,1,1,0", Ok("@0w0,600,0,0,0,1,1,0")),
            ("@0w0,600,0,0,0,1,1,5", Err(Number)),
            ("@0w0,1,0,0,0,1,1,5", Err(Number)),
            ("@0w1,600,0,0,0,1,1,8388608", Err(Number)),
            ("@0w1,600,0,0,0,1,1", Err(Count)),
        ],
    );
}

#[test]
fn moves_until_a_port_have_one_way_for_each_axis() {
    check(
        ImcXx,
        Direct,
        15,
        &[
            ("@0Z0,4,4,600,0,0,3000,0", Ok("@0Z0,4,4,600,0,0,3000,0")),
            ("@0Z0,4,4,600,0,0,3000", Err(Count)),
        ],
    );
    check(
        Imc4M,
        Direct,
        3,
        &[
            ("@0Z5,255,0,600,10,-20", Ok("@0Z5,255,0,600,10,-20")),
            ("@0Z5,255,0,600,10,-20,0", Err(Count)),
            ("@0Z4,4,4,600,0,0", Err(Number)),
            ("@0Z0,256,4,600,0,0", Err(Number)),
            ("@0Z0,4,-1,600,0,0", Err(Number)),
            ("@0Z0,4,4,600,8388608,0", Err(Number)),
            ("@0Z0,4,4,19,0,0", Err(Speed)),
        ],
    );
}

#[test]
fn loops_go_back_and_branches_go_anywhere() {
    check(
        Imc4,
        Stored,
        1,
        &[
            ("3 25,-1", Ok("325,-1")),
            ("36,-5", Ok("36,-5")),
            ("332767,-32768", Ok("332767,-32768")),
            ("35,-32769", Err(Number)),
            ("3 0,5", Ok("30,5")),
            ("30,-5", Ok("30,-5")),
            ("30,-32768", Ok("30,-32768")),
            ("30", Err(Count)),
        ],
    );
}

#[test]
fn no_jump_leads_before_the_data_field() {
    let at = |line| Context { line: Some(line), ..context(AxisSet::X) };
    check_in(
        ImcXx,
        Stored,
        &at(3),
        &[
            ("30,-3", Ok("30,-3")),
            ("30,-4", Err(Number)),
            ("30,32767", Ok("30,32767")),
            ("35,-3", Ok("35,-3")),
            ("35,-4", Err(Number)),
            // `o` and `2` count from the line after them.
            ("o0,0,1,-4", Ok("o0,0,1,-4")),
            ("o0,0,1,-5", Err(Number)),
            ("233,-4", Ok("233,-4")),
            ("233,-5", Err(Number)),
        ],
    );
    check_in(
        ImcXx,
        Stored,
        &at(0),
        &[("35,-1", Err(Number)), ("30,0", Ok("30,0")), ("o0,128,1,-1", Ok("o0,128,1,-1"))],
    );
}

#[test]
fn characters_and_delays() {
    check(
        ImcXx,
        Stored,
        1,
        &[
            ("1!", Err(Number)),
            ("233,-10", Ok("233,-10")),
            ("232,-10", Err(Number)),
            ("233,-32769", Err(Number)),
            ("550", Ok("550")),
            ("50", Ok("50")),
            ("58388607", Ok("58388607")),
            ("58388608", Err(Number)),
            ("9 ", Ok("9")),
            ("91", Err(Count)),
        ],
    );
}

#[test]
fn bits_of_ports() {
    check(
        Imc4,
        Stored,
        1,
        &[
            ("p0,128,1", Ok("p0,128,1")),
            ("p0,128,255", Ok("p0,128,255")),
            ("p0,128,256", Err(Number)),
            ("p0,0,1", Ok("p0,0,1")),
            ("p0,7,0", Ok("p0,7,0")),
            ("p0,8,0", Err(Number)),
            ("p0,127,0", Err(Number)),
            ("p0,-1,0", Err(Number)),
            ("p0,0,2", Err(Number)),
            ("p9,0,1", Err(Number)),
            ("p65531,0,1", Err(Number)),
            ("p4,3,1", Ok("p4,3,1")),
            // Logical ports take any bit as their one; the sample program of 1999 does.
            ("p2,1,1", Ok("p2,1,1")),
            ("p2,128,1", Ok("p2,128,1")),
            ("p2,128,2", Err(Number)),
            ("p2,8,1", Err(Number)),
            ("p5,128,2", Err(Number)),
            ("o0,128,1,-1", Ok("o0,128,1,-1")),
            ("o0,128,255,3", Ok("o0,128,255,3")),
            ("o0,128,256,3", Err(Number)),
            ("o0,0,1,3", Ok("o0,0,1,3")),
            ("o0,0,2,3", Err(Number)),
            ("o2,5,1,-1", Ok("o2,5,1,-1")),
            ("o2,128,1,-1", Ok("o2,128,1,-1")),
            ("o2,128,2,-1", Err(Number)),
            // This one reads eight bits, though it takes only one.
            ("o5,128,226,-1", Ok("o5,128,226,-1")),
            ("o4,0,1,-1", Err(Number)),
            ("o0,0,1,-32768", Ok("o0,0,1,-32768")),
            ("o0,0,1,32768", Err(Number)),
            ("o0,0,1", Err(Count)),
        ],
    );
}

#[test]
fn the_condition_of_the_next_move_is_on_port_0() {
    let mut ctx = context(AxisSet::X);
    check_in(
        ImcXx,
        Stored,
        &ctx,
        &[
            ("60,0,1", Ok("60,0,1")),
            ("60,7,0", Ok("60,7,0")),
            ("60,8,0", Err(Number)),
            ("60,1,2", Err(Number)),
            ("61,1,0", Err(Number)),
            ("60,1", Err(Count)),
        ],
    );
    ctx.bit_base_one = true;
    // The printer counts from 0.
    check_in(
        ImcXx,
        Stored,
        &ctx,
        &[("60,0,0", Err(Number)), ("60,9,0", Err(Number)), ("60,128,255", Ok("60,128,255"))],
    );
}

#[test]
fn queries_have_no_parameters() {
    for letter in ["P", "H", "V", "S", "i", "?", "k", "h"] {
        for (tail, expected) in [("", Ok(())), (" ", Ok(())), ("1", Err(Count)), (",", Err(Count))]
        {
            let line = format!("@0{letter}{tail}");
            let counted = counted(&line, Imc4M, AxisSet::X);
            assert_eq!(counted, expected, "{line:?}");
        }
    }
}

#[test]
fn a_field_can_be_read_ahead() {
    let number = |line: &'static [u8], index| {
        frame(line, Imc4, Direct).unwrap().number(index, Fractions::Reject)
    };
    assert_eq!(number(b"@0B2, 1", 0), Some(2));
    assert_eq!(number(b"@0B2, 1", 1), Some(1));
    assert_eq!(number(b"@0B2, 1", 2), None);
    assert_eq!(number(b"@0Bx,1", 0), None);
    assert_eq!(number(b"@0Bx,1", 1), Some(1));
    assert_eq!(number(b"@0B", 0), None);
    assert_eq!(number(b"@0B99999999999,1", 0), Some(99_999_999_999));
    assert_eq!(frame(b"@0B1,2,,", Imc4, Direct).unwrap().field_count(), 4);
    assert_eq!(frame(b"@0B  ", Imc4, Direct).unwrap().field_count(), 0);
}

#[test]
fn commands_in_words() {
    let all = |bits, line: &str| {
        let ctx = context(axes(bits));
        let (dialect, mode) = if line.starts_with('@') { (ImcXx, Direct) } else { (ImcXx, Stored) };
        read(line.as_bytes(), dialect, mode, &ctx).unwrap().describe(axes(bits))
    };
    for (bits, line, words) in [
        (1, "@0A5000,900", "relative move X +5,000 steps at 900 Hz"),
        (
            7,
            "030,800,-1000000,900,4,90,-4,3000",
            "relative move X +30 steps at 800 Hz, Y -1,000,000 steps at 900 Hz, \
             Z +4 steps at 90 Hz, Z -4 steps at 3,000 Hz",
        ),
        (
            7,
            "@0A30,800,0,900,0,90,0,3000",
            "relative move X +30 steps at 800 Hz, Y 0 steps at 900 Hz, Z 0 steps at 90 Hz",
        ),
        (9, "@0A0,800,24000,900", "relative move X 0 steps at 800 Hz, A +24,000 steps at 900 Hz"),
        (
            7,
            "@0M30,800,10,900,-4,90,0,30",
            "absolute move X to 30 at 800 Hz, Y to 10 at 900 Hz, Z to -4 at 90 Hz",
        ),
        (9, "@0d100,0,0,2000", "set reference speeds X 100 Hz, A 2,000 Hz"),
        (3, "@0R3", "reference run X+Y"),
        (1, "@0DRp", "diagnosis Rp"),
        (1, "@0f1", "set circles clockwise"),
        (
            3,
            "@0y400,1500,119,-141,141,-1,-1",
            "circle of 400 steps at 1,500 Hz from -141 141, D 119, Rx -1, Ry -1",
        ),
        (
            15,
            "@0Z0,4,4,600,0,0,3000,0",
            "relative move X 0 steps, Y 0 steps, Z +3,000 steps, A 0 steps at 600 Hz \
             until port 0 is 4 (mask 4)",
        ),
        (1, "325,-1", "repeat the last 1 lines, count 25"),
        (1, "30,5", "jump by +5"),
        (1, "o0,0,1,-1", "if port 0 bit 0 = 1 jump by -1"),
        (1, "p2,128,1", "set port 2 to 1"),
        (1, "133", "send '!'"),
        (1, "2126,3", "wait for a character, if '~' jump by +3"),
        (1, "512345", "wait 1,234.5 s"),
        (1, "60,1,0", "next move until port 0 bit 1 = 0"),
        (1, "@0IUa \"b\"", "set user info \"a \\\"b\\\"\""),
        (1, "@0IE57343", "set limit switches 0xdfff"),
    ] {
        assert_eq!(all(bits, line), words, "{line}");
    }
    // With axes that do not fit there are still words.
    let pairs = Pairs::new(&[Pair { steps: 1, speed: 2 }; 3]).unwrap();
    let words = Command::RelativeMove(pairs).describe(AxisSet::X);
    assert!(words.contains("? +1 steps at 2 Hz"), "{words}");
}
