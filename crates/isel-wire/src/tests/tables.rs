//! The tables: that they are well formed, and that their replies are right.

use std::collections::BTreeSet;

use super::round_trip::commands;
use super::{CONFIGURATIONS, axes, context, frame, print};
use crate::{Class, Dialect, Fault, Mode, Op, Reply, spec, table};
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::TestRunner;

fn modes() -> impl Iterator<Item = (Dialect, Mode)> {
    Dialect::ALL.into_iter().flat_map(|dialect| Mode::ALL.map(|mode| (dialect, mode)))
}

#[test]
fn the_mnemonics_are_these() {
    let names = |dialect, mode| {
        table(dialect, mode).iter().map(|spec| spec.mnemonic).collect::<Vec<_>>().join(" ")
    };
    use Dialect::{Imc4, Imc4M, ImcXx};
    use Mode::{Direct, Stored};
    assert_eq!(
        names(Imc4, Direct),
        "@axes @A @b @B @d @D @e @f @H @i @ID @IR @IS @M @n @P @R @S @T @V @y @z @?"
    );
    assert_eq!(
        names(Imc4M, Direct),
        "@axes @A @b @B @d @D @e @f @h @H @i @ID @IL @IR @IS @k @M @n @P @R @S @T @V @y @z @Z @?"
    );
    assert_eq!(
        names(ImcXx, Direct),
        "@axes @A @b @B @d @D @e @f @F @g @G @h @H @i \
         @IA @Ia @IC @Id @ID @Ie @IE @IF @IH @Ij @IJ @IL @IN @IO @IR @IT @IU @IW @IX \
         @j @J @k @M @n @N @P @R @S @T @U @V @w @y @z @Z"
    );
    assert_eq!(names(Imc4, Stored), "0 e f m n 7 y z 3 5 9 o p");
    assert_eq!(names(Imc4M, Stored), names(Imc4, Stored));
    assert_eq!(names(ImcXx, Stored), "0 d e f g j J m n N 7 T w y z 1 2 3 5 6 9 o p");
}

#[test]
fn every_row_is_complete_and_unique() {
    for (dialect, mode) in modes() {
        let rows = table(dialect, mode);
        assert_eq!(rows.iter().map(|row| row.op).collect::<BTreeSet<_>>().len(), rows.len());
        assert_eq!(rows.iter().map(|row| row.mnemonic).collect::<BTreeSet<_>>().len(), rows.len());
        for row in rows {
            let name = row.mnemonic;
            assert_eq!(spec(dialect, mode, row.op), Some(row));
            assert_eq!(name.starts_with('@'), mode == Mode::Direct, "{name}");
            assert!(row.sections.starts_with(['2', '3', '4']), "{name}");
            assert!(row.title.starts_with(|c: char| c.is_ascii_lowercase() || c == '3'), "{name}");
            assert!(row.replies.is_sorted_by(|a, b| a < b), "{name}: {:?}", row.replies);
            // Only the self-test never comes to an end.
            assert_eq!(row.replies.contains(&Reply::Done), row.op != Op::SelfTest, "{name}");
            assert_eq!(row.replies.contains(&Reply::NoAxes), row.needs_axes, "{name}");
            assert_eq!(row.replies.contains(&Reply::MemoryFull), mode == Mode::Stored, "{name}");
            assert!(!row.replies.contains(&Reply::NotStorable), "{name}");
            if mode == Mode::Direct && row.class == Class::Motion {
                assert!(row.replies.contains(&Reply::Plant), "{name}");
                assert!(row.replies.contains(&Reply::Cover), "{name}");
            }
        }
    }
}

#[test]
fn replies_have_their_codes() {
    let codes: String = Reply::ALL.iter().map(|reply| char::from(reply.code())).collect();
    assert_eq!(codes, "0123456789DFGHR");
    for code in 0..=u8::MAX {
        assert_eq!(
            Reply::from_code(code).map(Reply::code),
            Some(code).filter(|code| { codes.as_bytes().contains(code) })
        );
    }
    assert_eq!(Reply::Count.to_string(), "7 (wrong number of parameters)");
}

/// Takes correct lines of every command apart, puts wrong fields in every place, and collects
/// what they are answered with: it must be exactly what the table says, as far as decoding
/// decides it.
#[test]
fn decoding_gives_the_replies_of_the_table_and_no_others() {
    let decided = [Reply::Done, Reply::Number, Reply::Axis, Reply::Count, Reply::Speed];
    let mut runner = TestRunner::deterministic();
    for (dialect, mode) in modes() {
        for row in table(dialect, mode) {
            let mut seen = BTreeSet::new();
            for bits in CONFIGURATIONS {
                let ctx = context(axes(bits));
                let strategy = commands(row.op, dialect, axes(bits));
                for _ in 0..8 {
                    let command = strategy.new_tree(&mut runner).unwrap().current();
                    let line =
                        String::from_utf8_lossy(&print(&command, dialect, mode)).into_owned();
                    // `@0` and a letter or two; the number of axes has none, nor have stored
                    // lines an address.
                    let head = match (mode, row.op) {
                        (Mode::Direct, Op::SetAxes) => 2,
                        (Mode::Direct, _) => 1 + row.mnemonic.len(),
                        (Mode::Stored, _) => row.mnemonic.len(),
                    };
                    for line in variants(&line, head) {
                        // A wrong code of a diagnosis has no frame.
                        let Ok(frame) = frame(line.as_bytes(), dialect, mode) else { continue };
                        assert_eq!(frame.op(), row.op, "{line}");
                        seen.insert(frame.decode(&ctx).map_or_else(Fault::reply, |_| Reply::Done));
                    }
                }
            }
            let mut expected: BTreeSet<_> =
                row.replies.iter().copied().filter(|reply| decided.contains(reply)).collect();
            match row.op {
                // Whether its plane is configured, only the controller knows; nor does decoding
                // know how a program ends.
                Op::Circle | Op::Helix | Op::Start => {
                    expected.remove(&Reply::Axis);
                }
                // Its text is complete, but the test never is.
                Op::SelfTest => {
                    expected.insert(Reply::Done);
                }
                _ => {}
            }
            assert_eq!(seen, expected, "{} of {dialect:?}, {mode:?}", row.mnemonic);
        }
    }
}

/// The line itself, with fields more, and with every field replaced by something else.
fn variants(line: &str, head: usize) -> Vec<String> {
    let (head, fields) = line.split_at(head);
    let fields: Vec<_> = fields.split(',').collect();
    let long_text = "x".repeat(33);
    let mut lines = vec![line.to_owned(), format!("{line},1"), format!("{line}1,1")];
    for wrong in ["1x", "0", "1", "8", "16", "19", "-99999999", &long_text] {
        for place in 0..fields.len() {
            let mut changed = fields.clone();
            changed[place] = wrong;
            lines.push(format!("{head}{}", changed.join(",")));
        }
    }
    lines
}
