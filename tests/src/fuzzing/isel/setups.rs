//! The models that setups are about, and a little of everything for them.

use std::sync::Arc;

use vimc4_device::Input;
use vimc4_isel::{
    AfterFree, AxisCodes, BitValues, BranchBase, LeaveSwitch, LimitBits, LimitLatch, LoopCount,
    LowerCase, Model, PositionAxes, RestingSpeed, SelfTestEnd, SpeedOf3d, StopButton,
    StopInMoveUntil, StopInReference, StopReply, StoreOver, StoredArcs,
};
use vimc4_isel_wire::Fractions;
use vimc4_plant::PlantSignal;

use crate::fuzzing::operations::Setup;

/// The model that a setup is about. Every bit of the quirks turns some of them over; the
/// highest makes the memories so small that they fill up.
pub(super) fn model(setup: Setup) -> Arc<Model> {
    let mut model =
        Model::builtin(setup.model_of(&Model::names())).unwrap_or_else(|| unreachable!());
    if setup.is_plain() {
        return model;
    }
    let other = Arc::make_mut(&mut model);
    let quirks = &mut other.quirks;
    if setup.quirk(0) {
        quirks.stop_reply = StopReply::F0;
        quirks.cond_bit_base ^= 1;
        quirks.bit_values = BitValues::Binary;
    }
    if setup.quirk(1) {
        quirks.limit_latch = LimitLatch::Off;
        quirks.after_free = AfterFree::Any;
        quirks.store_over = StoreOver::Replace;
        quirks.resting_speed = RestingSpeed::Zero;
        quirks.axis_codes = AxisCodes::Any;
    }
    if setup.quirk(2) {
        quirks.leave_switch = LeaveSwitch::Away;
        quirks.stop_button = StopButton::Pressed;
        quirks.lower_case = LowerCase::Before;
        quirks.position_axes = PositionAxes::Configured;
        quirks.self_test_end = SelfTestEnd::Commands;
    }
    if setup.quirk(3) {
        quirks.loop_count = LoopCount::Total;
        quirks.stored_arcs = StoredArcs::Accept;
        quirks.limit_bits = LimitBits::End;
        quirks.cond_branch_base = BranchBase::Own;
    }
    if setup.quirk(4) {
        quirks.start_resumes_dnc ^= true;
        quirks.speed_of_3d = SpeedOf3d::Xyz;
        quirks.fractional_numbers = match quirks.fractional_numbers {
            Fractions::Reject => Fractions::Truncate,
            Fractions::Truncate => Fractions::Reject,
        };
    }
    if setup.quirk(5) {
        quirks.lost_steps = false;
        quirks.stop_in_reference = StopInReference::Switch;
        quirks.stop_in_move_until = StopInMoveUntil::Forget;
    }
    if setup.quirk(6) {
        other.timing.boot_ms = 1_500;
    }
    if setup.quirk(7) {
        other.flash.size = 200;
        other.line.receive_buffer = 40;
    }
    model
}

/// A little of everything.
pub(in crate::fuzzing) fn inputs() -> [Input<'static>; 16] {
    let (start, stop) = (PlantSignal::Start.id(), PlantSignal::Stop.id());
    let (on, key) = (PlantSignal::On.id(), PlantSignal::Key.id());
    [
        Input::Bytes(
            b"@07\r@0P\r@0V\r@0A100,900,-50,900,20,900,-20,900\r@0M1,900,2,900,3,900,0,0\r",
        ),
        Input::Bytes(b"@0R7\r@08\r@0R8\r@0F1\r@0y80,900,-5,10,0,-1,1\r@0H\r@0h\r@0U\r@0DS0\r"),
        Input::Bytes(&[253]),
        Input::Bytes(b"@0S\r@0b0\r@0b3\r@0B0,255\r@0i\r0100,900,100,900,0,900,0,900\r3 2,-1\r9\r"),
        Input::Signal(start, 1),
        Input::Signal(start, 0),
        Input::Bytes(b"@0S\r@0k\r@0IW\r@0IL\r"),
        Input::Signal(key, 0),
        Input::Signal(stop, 1),
        Input::Signal(on, 1),
        Input::Signal(key, 1),
        Input::Power(false),
        Input::Power(true),
        Input::Signal(start, 1),
        Input::Bytes(&[254]),
        Input::Bytes(b"@07\r@0d900,900,900\r@0P\r"),
    ]
}
