//! What the controllers of a model can do with each form of a command: from the tables of the language,
//! and from what the firmware lets happen while it does something.

use vimc4_device::{Ability, Activity as Doing, Situation, StopCause};
use vimc4_isel_wire::{Class, CommandSpec, Mode, Op, Reply, spec, table};

use crate::Model;
use crate::model::{AfterFree, ControlReply, StopInReference, StoreOver, Unreferenced};

/// What a direct line can find: it waits until the controller is at rest.
const AT_REST: [Situation; 3] = [
    Situation::Doing(Doing::Idle),
    Situation::StoppedMotion,
    Situation::Doing(Doing::ProgramStopped),
];
const STORING: Situation = Situation::Doing(Doing::Storing);

/// The phases of a reference run.
const REFERENCING: [Doing; 3] =
    [Doing::ReferenceTowardsSwitch, Doing::ReferenceOutOfSwitch, Doing::ReferenceFreeSteps];

/// Every form of every command.
pub(super) fn of(model: &Model) -> Vec<Ability> {
    let dialect = model.command_set.dialect();
    let direct = table(dialect, Mode::Direct).iter().map(|spec| direct(model, spec));
    let stored = table(dialect, Mode::Stored).iter().map(stored);
    let mut abilities: Vec<Ability> = direct.chain(stored).collect();
    abilities.push(Ability {
        mnemonic: "?",
        title: "what is no command",
        section: "",
        answers: vec![answer(Reply::Syntax), answer(Reply::NotStorable)],
        finds: AT_REST.into_iter().chain([STORING]).collect(),
        stops: Vec::new(),
    });
    let controls =
        [("254", "reset", model.quirks.reset_reply), ("255", "break", model.quirks.break_reply)];
    let answered = controls.into_iter().filter(|(_, _, reply)| *reply == ControlReply::Done);
    abilities.extend(answered.map(|(mnemonic, title, _)| Ability {
        mnemonic,
        title,
        section: "",
        answers: vec![answer(Reply::Done)],
        finds: Vec::new(),
        stops: Vec::new(),
    }));
    abilities
}

/// A command of a direct line.
fn direct(model: &Model, spec: &CommandSpec) -> Ability {
    let has_free =
        vimc4_isel_wire::spec(model.command_set.dialect(), Mode::Direct, Op::Free).is_some();
    let after_free = has_free && model.quirks.after_free == AfterFree::Reference;
    let unreferenced = model.quirks.unreferenced == Unreferenced::R;
    let gives = |reply: Reply| match (spec.op, reply) {
        // A controller that stores over a program has no reason to refuse.
        (Op::Store, Reply::DataField) => model.quirks.store_over == StoreOver::Refuse,
        // Some models ask for a reference run with another reply, or not after an axis was freed.
        (Op::AbsoluteMove | Op::Start, Reply::Reference) => after_free || unreferenced,
        (_, Reply::Reference) => after_free,
        (_, reply) => spec.replies.contains(&reply),
    };
    let moves =
        spec.class == Class::Motion && !matches!(spec.op, Op::Free | Op::Reference | Op::SelfTest);
    let possible = |reply: &Reply| match reply {
        Reply::Reference => moves && gives(*reply),
        reply => gives(*reply) && spec.replies.contains(reply),
    };
    let answers = Reply::ALL.into_iter().filter(possible).map(answer).collect();
    Ability {
        mnemonic: spec.mnemonic,
        title: spec.title,
        section: spec.sections,
        answers,
        finds: AT_REST.to_vec(),
        stops: stops(model, spec.op),
    }
}

/// A command of a program: it is stored, and the program executes it. The end of the program is not
/// executed as a line.
fn stored(spec: &CommandSpec) -> Ability {
    let executed = [Situation::Doing(Doing::ProgramLine), Situation::Looping(Doing::ProgramLine)];
    let executed = executed.into_iter().filter(|_| spec.op != Op::End);
    Ability {
        mnemonic: spec.mnemonic,
        title: spec.title,
        section: spec.sections,
        answers: spec.replies.iter().copied().map(answer).collect(),
        finds: [STORING].into_iter().chain(executed).collect(),
        stops: Vec::new(),
    }
}

fn answer(reply: Reply) -> (String, &'static str) {
    (char::from(reply.code()).to_string(), reply.meaning())
}

/// What can stop a command, and while it does what.
fn stops(model: &Model, op: Op) -> Vec<(StopCause, Situation)> {
    let by_host = |doing| {
        causes(model, doing, false).into_iter().map(move |cause| (cause, Situation::Doing(doing)))
    };
    match op {
        Op::RelativeMove | Op::AbsoluteMove | Op::Circle | Op::Helix | Op::MoveUntil => {
            by_host(Doing::Move).collect()
        }
        Op::Free => by_host(Doing::LeavingLimitSwitch).collect(),
        Op::Reference => REFERENCING.into_iter().flat_map(by_host).collect(),
        Op::SelfTest => by_host(Doing::SelfTest).collect(),
        Op::Erase => by_host(Doing::Erasing).collect(),
        Op::Start => {
            let program = in_program(model).into_iter().flat_map(|doing| {
                let causes = causes(model, doing, true).into_iter();
                causes.flat_map(move |cause| {
                    [(cause, Situation::Doing(doing)), (cause, Situation::Looping(doing))]
                })
            });
            by_host(Doing::Move).chain(program).collect()
        }
        _ => Vec::new(),
    }
}

/// What a program can be doing.
fn in_program(model: &Model) -> Vec<Doing> {
    let has = |op| spec(model.command_set.dialect(), Mode::Stored, op).is_some();
    let lines = [
        (Op::RelativeMove, Doing::ProgramMove),
        (Op::Reference, REFERENCING[0]),
        (Op::Reference, REFERENCING[1]),
        (Op::Reference, REFERENCING[2]),
        (Op::Delay, Doing::ProgramDelay),
        (Op::BranchIf, Doing::ProgramWaitsForPort),
        (Op::AwaitSync, Doing::ProgramWaitsForCharacter),
        (Op::Loop, Doing::ProgramHaltedOnItself),
    ];
    let doing = lines.into_iter().filter(|(op, _)| has(*op)).map(|(_, doing)| doing);
    doing.chain((model.timing.line_us > 0).then_some(Doing::ProgramLine)).collect()
}

/// What can strike while a controller does this, for the host or for a program.
fn causes(model: &Model, doing: Doing, program: bool) -> Vec<StopCause> {
    use StopCause as Cause;
    let references = REFERENCING.contains(&doing);
    let frees = doing == Doing::LeavingLimitSwitch;
    let tests = doing == Doing::SelfTest;
    let moves = matches!(doing, Doing::Move | Doing::ProgramMove) || tests;
    let drives = moves || references || frees;
    let erases = doing == Doing::Erasing;
    // On a reference run it stands in for the switch, which the free steps do not look for.
    let ends = model.quirks.stop_in_reference == StopInReference::End && program;
    // A line that branches to itself is never over.
    let stays = doing == Doing::ProgramHaltedOnItself;
    let heeds_stop = !tests && !erases && !stays && (ends || doing != Doing::ReferenceFreeSteps);
    let watches = |op| program && spec(model.command_set.dialect(), Mode::Direct, op).is_some();
    let all = [
        (Cause::StopByte, heeds_stop),
        (Cause::StopButton, heeds_stop),
        (Cause::BreakByte, !tests && !erases),
        (Cause::AbortInput, watches(Op::InitAbort)),
        (Cause::ResetByte, true),
        (Cause::PowerLoss, true),
        (Cause::EmergencyStop, true),
        (Cause::EmergencyInput, watches(Op::InitEmergency)),
        (Cause::Supply, drives),
        (Cause::Overtemperature, drives),
        (Cause::Cover, drives),
        (Cause::CoverInput, watches(Op::InitCover)),
        (Cause::LimitSwitch, moves),
        (Cause::LimitByHand, moves),
        (Cause::WrongSwitch, references || frees),
    ];
    all.into_iter().filter(|(_, can)| *can).map(|(cause, _)| cause).collect()
}
