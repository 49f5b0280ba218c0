//! Any input gives something sensible and never a panic.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

use super::{axes, print};
use crate::{
    Addressed, Context, Dialect, Fractions, LineBuffer, Mode, PortMap, ReceivedLine, Reply,
    control, parse,
};

/// Any model at all, as long as it keeps the promise that a port to write takes 0.
#[derive(Debug)]
struct AnyPorts {
    reads: u16,
    logical: u16,
    limits: [Option<u16>; 4],
}

impl PortMap for AnyPorts {
    fn reads(&self, port: u16) -> bool {
        self.reads >> (port % 16) & 1 == 1
    }

    fn writes(&self, port: u16, value: u16) -> bool {
        self.limits[usize::from(port % 4)].is_some_and(|limit| value <= limit)
    }

    fn is_logical(&self, port: u16) -> bool {
        self.logical >> (port % 16) & 1 == 1
    }
}

fn ports() -> impl Strategy<Value = AnyPorts> {
    let limit = || any::<Option<u16>>();
    (any::<u16>(), any::<u16>(), [limit(), limit(), limit(), limit()])
        .prop_map(|(reads, logical, limits)| AnyPorts { reads, logical, limits })
}

/// Bytes of commands, so that some of the garbage nearly is one.
fn nearly_a_line() -> impl Strategy<Value = Vec<u8>> {
    let head = select(vec![
        "@0", "@0A", "@0a", "@0M", "@0m", "@0R", "@0n", "@0d", "@0b", "@0B", "@0y", "@0w", "@0Z",
        "@0I", "@0Id", "@0IF", "@0IE", "@0IA", "@0Ia", "@0IU", "@0IL", "@0D", "@0DS", "@0e", "@0f",
        "@0F", "@0g", "@0G", "@0j", "@0J", "@0S", "@0T", "@0z", "@1", "@", "0", "1", "2", "3", "5",
        "6", "7", "9", "d", "e", "f", "g", "j", "J", "m", "n", "N", "o", "p", "T", "w", "y", "z",
        "",
    ]);
    let field = select(vec![
        "0",
        "1",
        "-1",
        "7",
        "8",
        "15",
        "19",
        "33",
        "128",
        "255",
        "256",
        "900",
        "20000",
        "32767",
        "-32768",
        "65535",
        "8388607",
        "-8388608",
        "8388608",
        "99999999999999999999",
        "12.5",
        "-.5",
        "5.",
        "x",
        "",
        " ",
        "- 1",
        "1 2",
        "\u{e4}",
    ]);
    (head, vec(field, 0..=10)).prop_map(|(head, fields)| {
        let mut line = head.as_bytes().to_vec();
        line.extend(fields.join(",").into_bytes());
        line
    })
}

fn check(line: &[u8], ctx: &Context<'_>) -> Result<(), TestCaseError> {
    for dialect in Dialect::ALL {
        for mode in Mode::ALL {
            let refused = match mode {
                Mode::Direct => Reply::Syntax,
                Mode::Stored => Reply::NotStorable,
            };
            let frame = match parse(line, dialect, mode, 0) {
                Ok(Addressed::Frame(frame)) => frame,
                Ok(Addressed::OtherDevice) => continue,
                Err(fault) => {
                    prop_assert_eq!(fault.reply(), refused);
                    continue;
                }
            };
            for index in 0..=frame.field_count() {
                let _ = frame.number(index, ctx.fractions);
            }
            match frame.decode(ctx) {
                Ok(command) => {
                    prop_assert_eq!(command.op(mode), frame.op());
                    prop_assert!(!command.describe(ctx.axes).is_empty());
                    prop_assert_eq!(frame.check_count(ctx.axes), Ok(()));
                    // What was understood can be printed again.
                    let printed = print(&command, dialect, mode);
                    let ctx = Context { bit_base_one: false, ..ctx.clone() };
                    let again = super::read(&printed, dialect, mode, &ctx);
                    prop_assert_eq!(again, Ok(command), "{}", printed.escape_ascii());
                }
                Err(fault) => {
                    let reply = fault.reply();
                    // Without axes a command that needs them is refused earlier, with `4`.
                    prop_assert!(
                        frame.spec().replies.contains(&reply),
                        "{} answers {}",
                        line.escape_ascii(),
                        reply
                    );
                }
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_line_is_too_strange(
        line in prop_oneof![4 => nearly_a_line(), 1 => vec(any::<u8>(), 0..300)],
        bits in 0_u8..=15,
        slow in 0_u32..=1000,
        fast in any::<u32>(),
        truncate in any::<bool>(),
        ports in ports(),
        bit_base_one in any::<bool>(),
        any_bit_value in any::<bool>(),
        any_axes in any::<bool>(),
        two_is_xy in any::<bool>(),
        zero_at_rest in any::<bool>(),
        at in any::<Option<u32>>(),
    ) {
        let fractions = if truncate { Fractions::Truncate } else { Fractions::Reject };
        let ctx = Context {
            axes: axes(bits),
            speeds: slow..=fast,
            fractions,
            ports: &ports,
            bit_base_one,
            any_bit_value,
            any_axes,
            two_is_xy,
            zero_at_rest,
            line: at,
        };
        check(&line, &ctx)?;
    }

    #[test]
    fn no_stream_of_bytes_is_too_strange(
        bytes in vec(prop_oneof![any::<u8>(), select(b"@0A5,\r\n ".to_vec())], 0..2000)
    ) {
        let mut buffer = LineBuffer::default();
        for byte in bytes.into_iter().filter(|&byte| control(byte).is_none()) {
            match buffer.push(byte) {
                Some(ReceivedLine::Text(text)) => {
                    prop_assert!(text.len() <= crate::LINE_MAX);
                    prop_assert!(text.iter().any(|&byte| byte != b' '));
                    prop_assert!(!text.contains(&b'\r') && !text.contains(&b'\n'));
                    prop_assert!(buffer.is_empty());
                }
                Some(ReceivedLine::TooLong(_)) => prop_assert!(buffer.is_empty()),
                None => {}
            }
        }
    }
}
