//! Which field is wrong, and how: what the replies leave out.

use super::{axes, context, frame};
use crate::{AxisSet, Context, Dialect, Fault, Fractions, Mode, WrongAxes, WrongNumber, parse};

/// The fault of a line, direct if it begins with `@`, with X and Y configured.
fn fault(line: &str, ctx: &Context<'_>) -> Option<Fault> {
    let mode = if line.starts_with('@') { Mode::Direct } else { Mode::Stored };
    let line = line.as_bytes();
    match parse(line, Dialect::ImcXx, mode, 0) {
        Ok(_) => frame(line, Dialect::ImcXx, mode).unwrap().decode(ctx).err(),
        Err(fault) => Some(fault),
    }
}

fn number(field: u8, wrong: WrongNumber) -> Fault {
    Fault::Number { field, wrong }
}

#[test]
fn a_fault_names_the_first_field_that_is_wrong_and_what_would_be_right() {
    use WrongAxes as A;
    use WrongNumber as N;
    let ctx = Context { line: Some(2), ..context(axes(3)) };
    let long = N::Outside { low: -8_388_608, high: 8_388_607 };
    for (line, expected) in [
        ("x1", Fault::NotStorable),
        ("@", Fault::NoAddress),
        ("@0", Fault::NoCommand),
        ("@0Ix", Fault::NoCommand),
        ("@0DXX", Fault::NoCommand),
        ("@0A1,900", Fault::Count { right: 4, or: 4 }),
        ("@0d1,2,3", Fault::Count { right: 2, or: 4 }),
        ("@0A1,900,2x,900", number(2, N::Unreadable)),
        ("@0A1,900,,900", number(2, N::Unreadable)),
        ("@0A1,900,2.5,900", number(2, N::Fraction)),
        ("@0A1,9,8388608,900", number(2, long)),
        ("@0A1,900,2,9", Fault::Speed { field: 3, low: 20, high: 20_000 }),
        ("@0j19", Fault::Speed { field: 0, low: 20, high: 4_000 }),
        ("@0e3", number(0, N::Outside { low: 0, high: 2 })),
        ("@0f2", number(0, N::NoSign { zero: true })),
        ("@0y1,900,0,0,0,1,0", number(6, N::NoSign { zero: false })),
        ("@0w0,900,0,0,0,1,1,5", number(7, N::HelixWithoutArc)),
        ("@0ID16", number(0, N::Outside { low: 0, high: 15 })),
        ("@0b9", number(0, N::NotReadable)),
        ("@0B9,0", number(0, N::NotWritable)),
        ("@0B1,2", number(1, N::NotWritable)),
        ("p9,1,1", number(0, N::NotWritable)),
        ("p1,128,7", number(2, N::NotWritable)),
        ("p0,8,1", number(1, N::NoBit)),
        ("o0,1,2,1", number(2, N::Outside { low: 0, high: 1 })),
        ("o1,128,2,1", number(2, N::Outside { low: 0, high: 1 })),
        ("3 0,-3", number(1, N::BeforeProgram)),
        ("3 2,1", number(1, N::LoopAhead)),
        ("@05", Fault::Axes { field: 0, wrong: A::NoConfiguration }),
        ("@0R9", Fault::Axes { field: 0, wrong: A::NoSet }),
        ("@0R7", Fault::Axes { field: 0, wrong: A::NotConfigured(AxisSet::Z) }),
        ("@0F3", Fault::Axes { field: 0, wrong: A::NotSingle }),
        ("@0IU123456789012345678901234567890123", Fault::Text),
    ] {
        assert_eq!(fault(line, &ctx), Some(expected), "{line}");
    }
    let truncates = Context { fractions: Fractions::Truncate, ..ctx };
    assert_eq!(fault("@0A1,900,2.5,900", &truncates), None);
    assert_eq!(fault("@0A1,900,.5,900", &truncates), Some(number(2, N::Unreadable)));
}

#[test]
fn a_field_is_lent_as_it_was_sent() {
    let frame = frame(b"@0A 6000.0 ,,900", Dialect::Imc4, Mode::Direct).unwrap();
    assert_eq!(frame.field(0), Some(&b"6000.0"[..]));
    assert_eq!(frame.field(1), Some(&b""[..]));
    assert_eq!(frame.field(3), None);
}
