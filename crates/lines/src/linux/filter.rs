//! The filter that the kernel runs before every system call of the program: which calls the kernel
//! asks about. Here it is data; [`sys`](super::sys) hands it to the kernel.
//!
//! Everything but `ioctl` is allowed by its number alone. The kernel notices that and remembers it,
//! so those calls cost nothing.

use super::request::{Layout, REQUESTS};

/// One instruction of the kernel's classic BPF.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Instruction {
    pub(crate) code: u16,
    /// Instructions to skip if the comparison holds.
    pub(crate) yes: u8,
    /// And if it does not.
    pub(crate) no: u8,
    pub(crate) value: u32,
}

/// Loads the 32-bit word at an offset of `struct seccomp_data`.
const LOAD: u16 = 0x20;
/// Compares it with a constant.
const JUMP_IF_EQUAL: u16 = 0x15;
/// Ends with a verdict.
const RETURN: u16 = 0x06;

/// The offsets in `struct seccomp_data`. A request is the low half of its argument: the kernel
/// looks at no more of it either. (Every architecture served is little-endian.)
const NUMBER: u32 = 0;
const ARCHITECTURE: u32 = 4;
const REQUEST: u32 = 24;

/// The kernel carries the call out.
pub(crate) const ALLOW: u32 = 0x7FFF_0000;
/// The kernel asks the supervisor.
pub(crate) const ASK: u32 = 0x7FC0_0000;

/// A way into the kernel: the architecture as audit names it, the number of `ioctl`, the layout.
type Entry = (u32, u32, Layout);

/// All ways into the kernels that are served; each kernel has two or three of them. x32 shares its
/// architecture with x86-64 and has a bit of its own in the number.
const ENTRIES: [Entry; 5] = [
    (0xC000_003E, 16, Layout::Wide),
    (0xC000_003E, 0x4000_0000 | 514, Layout::Narrow),
    (0x4000_0003, 54, Layout::Narrow),
    (0xC000_00B7, 29, Layout::Wide),
    (0x4000_0028, 54, Layout::Narrow),
];

/// The layout of a program that made a call in this way, if the filter asks about it.
pub(crate) fn layout(architecture: u32, number: u32) -> Option<Layout> {
    let this = |(a, n, _): &&Entry| (*a, *n) == (architecture, number);
    ENTRIES.iter().find(this).map(|entry| entry.2)
}

/// The filter.
pub(crate) fn program() -> Vec<Instruction> {
    let load = |value| Instruction { code: LOAD, yes: 0, no: 0, value };
    let verdict = |value| Instruction { code: RETURN, yes: 0, no: 0, value };
    let skip_if = |value, yes, no| Instruction { code: JUMP_IF_EQUAL, yes, no, value };
    // Built from its end, because jumps only lead forward.
    let asked = u8::try_from(REQUESTS.len()).unwrap_or_default();
    let mut end = vec![load(REQUEST)];
    end.extend(REQUESTS.iter().zip((1..=asked).rev()).map(|(&r, left)| skip_if(r, left, 0)));
    end.extend([verdict(ALLOW), verdict(ASK)]);
    // Each entry is three instructions that look at the architecture and the number.
    let mut program = Vec::new();
    for (left, &(architecture, number, _)) in (0_u8..).zip(ENTRIES.iter().rev()) {
        // To the end: the entries that follow and the verdict between.
        let to_end = left * 4 + 1;
        program.splice(
            0..0,
            [
                load(ARCHITECTURE),
                skip_if(architecture, 0, 2),
                load(NUMBER),
                skip_if(number, to_end, 0),
            ],
        );
    }
    program.push(verdict(ALLOW));
    program.extend(end);
    program
}

#[cfg(test)]
mod tests {
    use super::super::request::number::{TIOCMGET, TIOCSSERIAL};
    use super::*;

    /// What the kernel would do with a call.
    fn verdict(architecture: u32, number: u32, arguments: [u64; 6]) -> u32 {
        let mut data = [number.to_le_bytes(), architecture.to_le_bytes(), [0; 4], [0; 4]].concat();
        data.extend(arguments.iter().flat_map(|argument| argument.to_le_bytes()));
        let program = program();
        let (mut at, mut accumulator) = (0, 0);
        loop {
            let Instruction { code, yes, no, value } = program[at];
            at += 1;
            match code {
                LOAD => {
                    let from = value as usize;
                    accumulator = u32::from_le_bytes(data[from..from + 4].try_into().unwrap());
                }
                JUMP_IF_EQUAL => at += usize::from(if accumulator == value { yes } else { no }),
                RETURN => return value,
                other => panic!("{other:#x}"),
            }
        }
    }

    const X86_64: u32 = 0xC000_003E;
    const I386: u32 = 0x4000_0003;
    const AARCH64: u32 = 0xC000_00B7;
    const ARM: u32 = 0x4000_0028;

    #[test]
    fn every_request_of_every_kind_of_program_is_asked_about() {
        for (architecture, number, _) in ENTRIES {
            for request in REQUESTS {
                let asked = |second: u64| verdict(architecture, number, [3, second, 0, 0, 0, 0]);
                assert_eq!(asked(u64::from(request)), ASK, "{architecture:x} {number} {request:x}");
                // The kernel takes no notice of the upper half.
                assert_eq!(asked(u64::from(request) | 0xFFFF_FFFF_0000_0000), ASK);
            }
        }
    }

    #[test]
    fn nothing_else_is() {
        let tiocmget = u64::from(TIOCMGET);
        for (architecture, ioctl) in [(X86_64, 16), (I386, 54), (AARCH64, 29), (ARM, 54)] {
            for number in (0..600).filter(|number| *number != ioctl) {
                assert_eq!(verdict(architecture, number, [tiocmget; 6]), ALLOW);
            }
            for request in (0..0x6000).filter(|request| !REQUESTS.contains(request)) {
                let arguments = [tiocmget, u64::from(request), tiocmget, 0, 0, 0];
                assert_eq!(verdict(architecture, ioctl, arguments), ALLOW, "{request:x}");
            }
        }
        // The number of one architecture means another call in the next.
        let elsewhere = [(X86_64, 54), (X86_64, 29), (X86_64, 514), (I386, 16), (AARCH64, 54)];
        for (architecture, number) in elsewhere {
            assert_eq!(verdict(architecture, number, [3, tiocmget, 0, 0, 0, 0]), ALLOW);
        }
        // An unknown architecture.
        assert_eq!(verdict(0x1234, 16, [3, tiocmget, 0, 0, 0, 0]), ALLOW);
        assert_eq!(verdict(X86_64, 0x4000_0000 | 16, [3, tiocmget, 0, 0, 0, 0]), ALLOW);
    }

    #[test]
    fn the_layout_is_that_of_the_program() {
        let narrow = |architecture, number| layout(architecture, number) == Some(Layout::Narrow);
        assert!(narrow(I386, 54) && narrow(ARM, 54) && narrow(X86_64, 0x4000_0202));
        assert_eq!(layout(X86_64, 16), Some(Layout::Wide));
        assert_eq!(layout(AARCH64, 29), Some(Layout::Wide));
        assert_eq!(layout(X86_64, 54), None);
    }

    #[test]
    fn the_kernel_can_tell_by_the_number_alone_that_a_call_is_none_of_ours() {
        // Only what comes after the entries looks at arguments.
        let program = program();
        let first = program.iter().position(|i| i.code == LOAD && i.value == REQUEST).unwrap();
        assert_eq!(program[first - 1].value, ALLOW);
        assert_eq!(first, ENTRIES.len() * 4 + 1);
        assert_eq!(u64::from(TIOCSSERIAL), 0x541F);
    }
}
