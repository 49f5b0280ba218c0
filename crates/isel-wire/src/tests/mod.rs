//! What the tests share: a model to decode for, and one call from a line to its meaning.

mod faults;
mod garbage;
mod receive;
mod round_trip;
mod rules;
mod tables;

use crate::{
    Addressed, AxisSet, Command, Context, Dialect, Fault, Fractions, Frame, Mode, PortMap, Reply,
    parse,
};

/// Ports in the manner of the imc4: 0 has eight bits, 1 to 3 are logical; 4 can only be written,
/// as on the imc4-m, and 5 reads eight bits but takes one, as number 2 of the iMC-xx does.
pub(crate) struct Ports;

impl PortMap for Ports {
    fn reads(&self, port: u16) -> bool {
        matches!(port, 0..=3 | 5 | 65_531)
    }

    fn writes(&self, port: u16, value: u16) -> bool {
        match port {
            0 | 4 | 65_529 => value <= 255,
            1..=3 | 5 => value <= 1,
            _ => false,
        }
    }

    fn is_logical(&self, port: u16) -> bool {
        matches!(port, 1..=3)
    }
}

/// The sets of axes a controller can have.
pub(crate) const CONFIGURATIONS: [u8; 7] = [1, 3, 7, 8, 9, 11, 15];

pub(crate) fn axes(bits: u8) -> AxisSet {
    AxisSet::from_bits(bits).unwrap()
}

pub(crate) fn context(axes: AxisSet) -> Context<'static> {
    Context {
        axes,
        speeds: 20..=20_000,
        fractions: Fractions::Reject,
        ports: &Ports,
        bit_base_one: false,
        any_bit_value: false,
        any_axes: false,
        two_is_xy: false,
        zero_at_rest: false,
        line: None,
    }
}

/// The frame of a line for device 0.
pub(crate) fn frame(line: &[u8], dialect: Dialect, mode: Mode) -> Result<Frame<'_>, Reply> {
    match parse(line, dialect, mode, 0).map_err(Fault::reply)? {
        Addressed::Frame(frame) => Ok(frame),
        Addressed::OtherDevice => panic!("{} is for another device", line.escape_ascii()),
    }
}

/// What a line for device 0 means.
pub(crate) fn read(
    line: &[u8],
    dialect: Dialect,
    mode: Mode,
    ctx: &Context<'_>,
) -> Result<Command, Reply> {
    frame(line, dialect, mode)?.decode(ctx).map_err(Fault::reply)
}

pub(crate) fn print(command: &Command, dialect: Dialect, mode: Mode) -> Vec<u8> {
    let mut line = Vec::new();
    command.print(dialect, mode, 0, &mut line);
    line
}
