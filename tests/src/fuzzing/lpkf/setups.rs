//! The models that setups are about, and a little of everything for them.

use std::sync::Arc;

use vimc4_device::Input;
use vimc4_lpkf::language::Dialect;
use vimc4_lpkf::{
    AfterStatus, BarePairs, DecimalSpeed, InitEcho, InitReply, LineFeed, Model, ResolutionUnit,
    StatusDigits, Ta, UnknownCommand, UnknownPairs,
};
use vimc4_plant::PlantSignal;

use crate::fuzzing::operations::Setup;

/// The model that a setup is about. Every bit of the quirks turns some of them over; the highest
/// makes the buffer so small that it fills up, and has the spindle turn at once.
pub(super) fn model(setup: Setup) -> Arc<Model> {
    let mut model =
        Model::builtin(setup.model_of(&Model::names())).unwrap_or_else(|| unreachable!());
    if setup.is_plain() {
        return model;
    }
    let other = Arc::make_mut(&mut model);
    let (quirks, language) = (&mut other.quirks, &mut other.language);
    let is_smcu = other.command_set == Dialect::Smcu;
    if setup.quirk(0) {
        quirks.unknown_command = match is_smcu {
            true => UnknownCommand::Never,
            false => UnknownCommand::Always,
        };
        language.unknown_pairs = UnknownPairs::Move;
    }
    if setup.quirk(1) {
        quirks.init_reply = match quirks.init_reply {
            InitReply::Z => InitReply::C,
            InitReply::C => InitReply::Z,
        };
        quirks.init_echo = InitEcho::Off;
    }
    if setup.quirk(2) {
        quirks.hard_clip_blank = true;
        language.hard_clip_values = if is_smcu { 6 } else { 3 };
        quirks.after_status = if is_smcu { AfterStatus::Execute } else { AfterStatus::Wait };
    }
    if setup.quirk(3) {
        quirks.status_digits = StatusDigits::Decimal;
        language.status_texts = StatusDigits::Hexadecimal;
    }
    if setup.quirk(4) {
        quirks.decimal_speed = DecimalSpeed::Metres;
        language.resolution_unit = ResolutionUnit::Micrometres;
        if !is_smcu {
            quirks.after_status = AfterStatus::Execute;
        }
    }
    if setup.quirk(5) {
        quirks.bare_pairs = BarePairs::Repeat;
        language.line_feed = LineFeed::End;
    }
    if setup.quirk(6) {
        quirks.ta = Ta::None;
        language.shapes = is_smcu;
        language.read_port = true;
    }
    if setup.quirk(7) {
        other.buffer.bytes = 64;
        other.buffer.high_water = 40;
        other.spindle_unit.start_ms = 0;
    }
    model
}

/// A little of everything.
pub(in crate::fuzzing) fn inputs() -> [Input<'static>; 13] {
    let stop = PlantSignal::Stop.id();
    [
        Input::Bytes(b"PA100,-50;PR20,20,-20,3;AA50,50,90;AR10,0,-45.5;!ZA 5;!ZR -5;!ON0;OS;"),
        Input::Bytes(b"!ZA 5,2;!ZR -5,3;!MA1,2,3,4,5,6;!MR1,-1,1,-1,1,-1;!OA 100;!OA 0;!RD 0;"),
        Input::Bytes(b"!PH0,1\rX50F900\rX5Y5I0J5O1\rX50F-900\r;!IS;OH;!IS0;OH1;"),
        Input::Bytes(b"!ES1;PA9000,9000;!ST"),
        Input::Signal(stop, 1),
        Input::Signal(stop, 0),
        Input::Bytes(b"!CS!GB!RC!GO!RP"),
        Input::Bytes(
            b"PDPU!EM1;!WR 1,255;!TW5;!TS3;PR1,1;!HP!FP!CM1;!TM1,2,3,4;PD;IW0,0,9,9;PA99,99;",
        ),
        Input::Bytes(b"!GO!OC;!SV7\r!RM 9000\r!CC;!OI2;!CI;!VZ 99;!VZ 99,2;!AS 50;!RS 7937.5,1;"),
        Input::Power(false),
        Input::Power(true),
        Input::Bytes(b"VS0.005;VU 10;!CT0;QQ;!CT1;QQ;!TA1,2,3;!TR1,1,1;IN;"),
        Input::Bytes(b"OS;"),
    ]
}
