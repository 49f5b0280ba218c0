//! Commands from lines: parsing, decoding, printing.

use std::sync::{Arc, OnceLock};

use vimc4_isel::Model;
use vimc4_isel_wire::{
    Addressed, AxisSet, Command, Context, Dialect, Fault, Fractions, Frame, Mode, Reply, parse,
    table,
};

/// A line is answered with a reply that its command can have, or becomes a command that prints
/// as a line that becomes the same command.
///
/// The first byte says which dialect and mode, the second which axes, the third everything else
/// a line must be known in; what remains are lines with CR between them.
pub fn parser(data: &[u8]) {
    let [language, axes, habits, lines @ ..] = data else { return };
    let dialect = Dialect::ALL[usize::from(language >> 1) % Dialect::ALL.len()];
    let mode = Mode::ALL[usize::from(language & 1)];
    let device = habits >> 4 & 1;
    let model = model_of(dialect);
    let context = Context {
        axes: AxisSet::from_bits(axes & 15).unwrap_or_default(),
        speeds: model.limits.speeds(),
        fractions: if habits & 1 == 0 { Fractions::Reject } else { Fractions::Truncate },
        ports: &model.ports,
        bit_base_one: habits & 2 != 0,
        any_bit_value: habits & 32 != 0,
        any_axes: habits & 64 != 0,
        two_is_xy: habits & 128 != 0,
        zero_at_rest: habits & 128 != 0,
        line: (habits & 4 != 0).then_some(u32::from(axes >> 4)),
    };
    for line in lines.split(|&byte| byte == b'\r') {
        check_line(line, &context, dialect, mode, device, habits & 8 != 0);
    }
}

fn check_line(
    line: &[u8],
    context: &Context<'_>,
    dialect: Dialect,
    mode: Mode,
    device: u8,
    write_down: bool,
) {
    let frame = match parse(line, dialect, mode, device) {
        Ok(Addressed::Frame(frame)) => frame,
        Ok(Addressed::OtherDevice) => return assert_eq!(mode, Mode::Direct),
        Err(fault) => {
            let right = match mode {
                Mode::Direct => Reply::Syntax,
                Mode::Stored => Reply::NotStorable,
            };
            return assert_eq!(fault.reply(), right);
        }
    };
    check_frame(&frame, line, dialect, mode);
    match frame.decode(context) {
        Err(fault) => {
            let reply = fault.reply();
            let known = frame.spec().replies.contains(&reply);
            assert!(known, "{} answers {reply}", frame.spec().mnemonic);
        }
        Ok(command) => {
            assert_eq!(frame.check_count(context.axes), Ok(()));
            check_command(&command, context, dialect, mode, device);
            // Writing it down costs more than everything else together.
            if write_down {
                let kept = serde_json::to_string(&command).unwrap_or_default();
                assert_eq!(serde_json::from_str::<Command>(&kept).ok(), Some(command), "{kept}");
            }
        }
    }
}

fn check_frame(frame: &Frame<'_>, line: &[u8], dialect: Dialect, mode: Mode) {
    let spec = frame.spec();
    assert!(table(dialect, mode).contains(spec), "{} is in no table", spec.mnemonic);
    assert_eq!(frame.op(), spec.op);
    assert!(frame.field_count() <= line.len());
    let read = |index| frame.number(index, Fractions::Truncate);
    assert_eq!(read(frame.field_count()), None, "a field behind the last");
    for index in 0..frame.field_count().min(10) {
        let whole = frame.number(index, Fractions::Reject);
        assert!(whole.is_none() || whole == read(index), "a number with two values");
    }
}

/// What is printed means the same, and is printed the same again.
fn check_command(
    command: &Command,
    context: &Context<'_>,
    dialect: Dialect,
    mode: Mode,
    device: u8,
) {
    assert!(!command.describe(context.axes).is_empty());
    // The printer counts bits from 0.
    let context = Context { bit_base_one: false, ..context.clone() };
    let mut printed = Vec::new();
    command.print(dialect, mode, device, &mut printed);
    let text = printed.escape_ascii();
    let again = match parse(&printed, dialect, mode, device) {
        Ok(Addressed::Frame(frame)) => frame.decode(&context),
        Ok(Addressed::OtherDevice) => Err(Fault::NoAddress),
        Err(fault) => Err(fault),
    };
    assert_eq!(again.as_ref(), Ok(command), "printed as {text}");
    let mut twice = Vec::new();
    command.print(dialect, mode, device, &mut twice);
    assert_eq!(twice, printed);
}

/// A built-in model that speaks a dialect.
fn model_of(dialect: Dialect) -> &'static Model {
    static MODELS: OnceLock<Vec<Arc<Model>>> = OnceLock::new();
    let models =
        MODELS.get_or_init(|| Model::names().into_iter().filter_map(Model::builtin).collect());
    let model = models.iter().find(|model| model.command_set.dialect() == dialect);
    model.unwrap_or(&models[0])
}
