//! The requests that are answered, and what their arguments look like in a program's memory.

use crate::state::{Counts, Settings};

/// `ioctl` requests, the same numbers on every architecture that is served.
pub(crate) mod number {
    pub(crate) const TIOCMGET: u32 = 0x5415;
    pub(crate) const TIOCMBIS: u32 = 0x5416;
    pub(crate) const TIOCMBIC: u32 = 0x5417;
    pub(crate) const TIOCMSET: u32 = 0x5418;
    pub(crate) const TIOCGSERIAL: u32 = 0x541E;
    pub(crate) const TIOCSSERIAL: u32 = 0x541F;
    pub(crate) const TIOCSERGETLSR: u32 = 0x5459;
    pub(crate) const TIOCMIWAIT: u32 = 0x545C;
    pub(crate) const TIOCGICOUNT: u32 = 0x545D;
}

/// All of them: the filter asks about these and about nothing else.
pub(crate) const REQUESTS: [u32; 9] = {
    use number::*;
    [
        TIOCMGET,
        TIOCMBIS,
        TIOCMBIC,
        TIOCMSET,
        TIOCGSERIAL,
        TIOCSSERIAL,
        TIOCSERGETLSR,
        TIOCMIWAIT,
        TIOCGICOUNT,
    ]
};

/// How a program's structures are laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Layout {
    /// Pointers of 64 bits.
    Wide,
    /// Pointers of 32 bits.
    Narrow,
}

/// An integer, as it lies in memory.
pub(crate) const INTEGER: usize = 4;

/// `struct serial_icounter_struct`: twenty integers in every layout. Characters and their errors
/// are not counted, because only the program sees them.
pub(crate) fn counters(counts: Counts) -> [u8; 80] {
    let mut bytes = [0; 80];
    for (at, count) in [(0, counts.cts), (4, counts.dsr), (8, counts.ri), (12, counts.dcd)] {
        put(&mut bytes, at, &count.to_le_bytes());
    }
    bytes
}

/// `struct serial_struct`. The chip is said to be the usual one, a 16550A, because programs look
/// whether there is one at all.
pub(crate) fn settings(settings: Settings, layout: Layout) -> Vec<u8> {
    const PORT_16550A: u32 = 4;
    const FIFO: u32 = 16;
    let mut bytes = vec![0; settings_size(layout)];
    for (at, value) in [
        (0, PORT_16550A),
        (16, settings.flags),
        (20, FIFO),
        (24, settings.custom_divisor),
        (28, settings.baud_base),
    ] {
        put(&mut bytes, at, &value.to_le_bytes());
    }
    put(&mut bytes, 32, &settings.close_delay.to_le_bytes());
    put(&mut bytes, 40, &settings.closing_wait.to_le_bytes());
    bytes
}

/// What a program has set in a `struct serial_struct` of either layout: they agree up to the
/// first pointer, and everything that counts is before it.
pub(crate) fn read_settings(bytes: &[u8]) -> Option<Settings> {
    let long = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    let short = |at: usize| Some(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?));
    Some(Settings {
        flags: long(16)?,
        custom_divisor: long(24)?,
        baud_base: long(28)?,
        close_delay: short(32)?,
        closing_wait: short(40)?,
    })
}

pub(crate) fn settings_size(layout: Layout) -> usize {
    match layout {
        Layout::Wide => 72,
        Layout::Narrow => 60,
    }
}

fn put(bytes: &mut [u8], at: usize, value: &[u8]) {
    for (to, from) in bytes.iter_mut().skip(at).zip(value) {
        *to = *from;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_survive_both_layouts() {
        let wanted = Settings {
            flags: 0x2000,
            baud_base: 921_600,
            custom_divisor: 48,
            close_delay: 7,
            closing_wait: 65_535,
        };
        for layout in [Layout::Wide, Layout::Narrow] {
            let bytes = settings(wanted, layout);
            assert_eq!(bytes.len(), settings_size(layout));
            assert_eq!(read_settings(&bytes), Some(wanted));
        }
        assert_eq!(read_settings(&[0; 41]), None);
    }

    #[test]
    fn counters_are_where_the_kernel_has_them() {
        let bytes = counters(Counts { cts: 1, dsr: 2, ri: 3, dcd: 4 });
        let at = |n: usize| bytes[n * 4];
        assert_eq!([at(0), at(1), at(2), at(3)], [1, 2, 3, 4]);
    }
}
