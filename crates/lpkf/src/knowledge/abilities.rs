//! What the controllers of a model can do with each form of a command: from the table of the commands
//! and their parameters, and from what the controller lets happen while it does something.

use vimc4_device::{Ability, Activity as Doing, Situation, StopCause};

use crate::Model;
use crate::language::{Answer, Axis, Dialect, Form, Kind, Op, Side, Status, forms};
use crate::model::{AfterStatus, InitReply, StatusDigits, UnknownCommand};
use crate::signals::is_caused;

/// What a command can be doing that takes its time.
const MOVING: &[Doing] = &[Doing::Move, Doing::Settling];
const SEEKING: &[Doing] = &[
    Doing::ReferenceTowardsSwitch,
    Doing::ReferenceOutOfSwitch,
    Doing::ReferenceFreeSteps,
    Doing::Settling,
];

/// Every form of every command, what is no command, and what comes unasked.
pub(super) fn of(model: &Model) -> Vec<Ability> {
    let known = forms().iter().filter(|form| form.known_to(model.command_set));
    let mut abilities: Vec<Ability> = known.map(|form| command(model, form)).collect();
    abilities.push(Ability {
        mnemonic: "?",
        title: "what is no command",
        section: "",
        answers: written(model, malformed(model).into_iter().chain(refusals(model, None))),
        finds: finds(model, None),
        stops: Vec::new(),
    });
    abilities.push(Ability {
        mnemonic: "",
        title: "what comes unasked",
        section: "",
        answers: written(model, unasked(model)),
        finds: Vec::new(),
        stops: Vec::new(),
    });
    abilities
}

fn command(model: &Model, form: &Form) -> Ability {
    let stops = stops(model, form);
    let failures = failures(model, form, &stops);
    let mut answers = succeeds(model, form);
    answers.extend(written(model, failures.into_iter().chain(refusals(model, Some(form)))));
    let finds = finds(model, Some(form));
    Ability {
        mnemonic: form.mnemonic,
        title: form.title,
        section: form.source,
        answers,
        finds,
        stops,
    }
}

// --- answers ---

/// What a command sends that has succeeded.
fn succeeds(model: &Model, form: &Form) -> Vec<(String, &'static str)> {
    let done = match (form.op, model.quirks.init_reply) {
        (Op::Initialize, InitReply::Z) => Some(("Z", "initialized")),
        // What was broken off goes on, and has the answer.
        _ if form.answer == Answer::Silence => None,
        _ => Some(("C", "completed, in the echo mode")),
    };
    let data = form.answer.letter().map(|letter| (letter.to_string(), form.title));
    data.into_iter().chain(done.map(|(kind, means)| (kind.to_owned(), means))).collect()
}

/// Statuses as this model writes them, each once. One that it has no number for is not sent.
fn written(
    model: &Model,
    statuses: impl IntoIterator<Item = Status>,
) -> Vec<(String, &'static str)> {
    let decimal = model.quirks.status_digits == StatusDigits::Decimal;
    let mut statuses: Vec<Status> = statuses.into_iter().collect();
    statuses.sort_unstable();
    statuses.dedup();
    let written = statuses
        .into_iter()
        .filter_map(|status| Some((status.written(model.command_set, decimal)?, status.meaning())));
    written.collect()
}

/// What is said to bytes that are no command.
fn malformed(model: &Model) -> Vec<Status> {
    let mut statuses = vec![Status::SingleCoordinate, Status::MissingParameter];
    if model.quirks.unknown_command != UnknownCommand::Never {
        statuses.push(Status::UnknownCommand);
    }
    let known = forms().iter().filter(|form| form.known_to(model.command_set));
    for form in known {
        statuses.extend(form.parameters.iter().filter_map(|parameter| match parameter.kind {
            Kind::Axis | Kind::Nominal | Kind::Actual => Some(Status::NoSuchAxis),
            Kind::Interface => Some(Status::NoSuchInterface),
            Kind::Port => Some(Status::NoSuchIoModule),
            _ => None,
        }));
        if form.op == Op::FollowVectors {
            statuses.extend([Status::VectorBufferFull, Status::TooManyVectorParameters]);
        }
    }
    statuses
}

/// With what a command is refused, whatever it says, because of what was before. On an SMCU these have
/// no number, so nothing is sent.
fn refusals(model: &Model, form: Option<&Form>) -> Vec<Status> {
    let op = form.map(|form| form.op);
    let mut statuses = Vec::new();
    if model.quirks.after_status == AfterStatus::Refuse && !op.is_some_and(goes_on) {
        statuses.extend([
            Status::WrongAfterStop,
            Status::WrongAfterLimit,
            Status::WrongAfterSoftFrame,
            Status::WrongAfterMessage,
        ]);
    }
    if model.interface.trackball && op != Some(Op::CloseInterface) {
        statuses.push(Status::WrongAfterOpenInterface);
    }
    statuses
}

/// How a command can fail: because of its parameters, of what the machine is, or of what it meets.
fn failures(model: &Model, form: &Form, stops: &[(StopCause, Situation)]) -> Vec<Status> {
    let smcu = model.command_set == Dialect::Smcu;
    let mut statuses = Vec::new();
    for parameter in form.parameters {
        match parameter.kind {
            Kind::Speed => statuses.extend([Status::SpeedTooLow, Status::SpeedTooHigh]),
            Kind::Acceleration => {
                statuses.extend([Status::AccelerationTooLow, Status::AccelerationTooHigh]);
            }
            Kind::Resolution => {
                statuses.extend([Status::ResolutionTooSmall, Status::ResolutionTooLarge]);
            }
            Kind::Axis | Kind::Nominal => statuses.push(Status::NoSuchAxis),
            Kind::Actual => statuses.extend([Status::NoCounterAxis, Status::NoSuchAxis]),
            Kind::Port => statuses.extend((!smcu).then_some(Status::NoSuchIoModule)),
            Kind::Interface => statuses.push(match model.interface.trackball {
                true => Status::JoystickNotConnected,
                false => Status::NoSuchInterface,
            }),
            Kind::Angle => statuses.push(Status::WorkAreaLeft),
            _ => {}
        }
    }
    match form.op {
        Op::MoveZAbsolute | Op::MoveZRelative | Op::ZSpeed => statuses.push(Status::NoSuchAxis),
        Op::ReferenceOf => statuses.push(Status::ReferenceNotAllowed),
        Op::FollowVectors => {
            statuses.extend([Status::WorkAreaLeft, Status::SpeedTooLow, Status::SpeedTooHigh]);
        }
        _ => {}
    }
    for (cause, _) in stops {
        statuses.extend(statuses_of(*cause, model, axes(form)));
    }
    if moves(form.op) || form.op == Op::OpenInterface {
        statuses.extend(forbidding(model));
    }
    statuses
}

/// What is sent when this stops a command that moves these axes.
fn statuses_of(cause: StopCause, model: &Model, axes: &[Axis]) -> Vec<Status> {
    let smcu = model.command_set == Dialect::Smcu;
    let sides = || axes.iter().flat_map(|axis| [(*axis, Side::Negative), (*axis, Side::Positive)]);
    match cause {
        StopCause::StopButton => vec![Status::FastStop],
        StopCause::Message => vec![Status::MessageInterrupt0, Status::MessageInterrupt1],
        StopCause::LimitSwitch | StopCause::LimitByHand if smcu => vec![Status::LimitSwitch],
        StopCause::LimitSwitch | StopCause::LimitByHand => {
            sides().map(|(axis, side)| Status::limit_switch(axis, side)).collect()
        }
        StopCause::Border if smcu => vec![Status::WorkAreaLeft],
        StopCause::Border => sides().map(|(axis, side)| Status::range_left(axis, side)).collect(),
        StopCause::Failure => forbidding(model),
        _ => Vec::new(),
    }
}

/// The failures with which nothing can move.
fn forbidding(model: &Model) -> Vec<Status> {
    let of_model = |status: &Status| status.forbids_motion() && status.known_to(model.command_set);
    Status::ALL.iter().copied().filter(of_model).collect()
}

/// What is sent although no command asked for it: what is lost, what a machine or a person does while
/// nothing executes, and what a trackball or a homing machine meets.
fn unasked(model: &Model) -> Vec<Status> {
    let set = model.command_set;
    let of_world = |status: &Status| status.known_to(set) && !is_caused(*status, set);
    let mut statuses: Vec<Status> = Status::ALL.iter().copied().filter(of_world).collect();
    statuses.extend([Status::ReceiverOverflow, Status::FastStop]);
    if model.command_set == Dialect::MotionSystem {
        statuses.push(Status::CommandBufferFull);
        statuses.extend([Status::MessageInterrupt0, Status::MessageInterrupt1]);
    }
    for cause in [StopCause::LimitSwitch, StopCause::Border] {
        statuses.extend(statuses_of(cause, model, fitted(model)));
    }
    statuses
}

// --- what is found ---

fn finds(model: &Model, form: Option<&Form>) -> Vec<Situation> {
    let op = form.map(|form| form.op);
    let motion_system = model.command_set == Dialect::MotionSystem;
    let refuses = model.quirks.after_status == AfterStatus::Refuse;
    let stops = model.quirks.after_status != AfterStatus::Execute;
    let bypasses = form.is_some_and(|form| form.direct);
    let mut found = vec![Doing::Idle];
    // Others wait until the controller is free.
    if bypasses {
        found.extend(busy(model));
    } else if motion_system && (refuses || op.is_some_and(asks)) {
        // While `!GB` leads back the controller is stopped and moves.
        found.push(Doing::Move);
    }
    let taken =
        bypasses || op == Some(Op::Initialize) || op.is_some_and(|op| asks(op) || resumes(op));
    if taken || stops && (refuses || op == Some(Op::CloseInterface)) {
        found.push(Doing::Stopped);
    }
    if model.interface.trackball
        && (motion_system || taken && !op.is_some_and(asks) || op == Some(Op::CloseInterface))
    {
        found.push(Doing::Trackball);
        found.push(Doing::FollowingTrackball);
    }
    let mut once = Vec::new();
    for doing in found {
        if !once.contains(&Situation::Doing(doing)) {
            once.push(Situation::Doing(doing));
        }
    }
    once
}

/// All that some command of the model can be doing.
fn busy(model: &Model) -> Vec<Doing> {
    let known = forms().iter().filter(|form| form.known_to(model.command_set));
    let mut doing: Vec<Doing> = Vec::new();
    for does in known.flat_map(|form| does(model, form)) {
        if !doing.contains(&does) {
            doing.push(does);
        }
    }
    doing
}

/// Whether it only asks, so that it is answered by a controller that is stopped, too.
fn asks(op: Op) -> bool {
    matches!(op, Op::OutputStatus | Op::NominalPosition | Op::ActualPosition | Op::ReadPort)
}

fn resumes(op: Op) -> bool {
    matches!(op, Op::Continue | Op::GoBack | Op::RepeatBroken)
}

/// Whether a controller takes it that refuses all others.
fn goes_on(op: Op) -> bool {
    matches!(op, Op::GoOn | Op::ClearBuffer) || asks(op)
}

// --- what stops it ---

fn stops(model: &Model, form: &Form) -> Vec<(StopCause, Situation)> {
    use StopCause as Cause;
    let motion_system = model.command_set == Dialect::MotionSystem;
    let strikes = |doing: Doing| {
        let drives = !matches!(doing, Doing::Settling | Doing::Waiting | Doing::WaitingForHead);
        let all = [
            (Cause::StopButton, true),
            (Cause::Message, motion_system),
            (Cause::Failure, !forbidding(model).is_empty()),
            (Cause::PowerLoss, true),
            (Cause::LimitSwitch, drives),
            (Cause::LimitByHand, drives),
            (Cause::Border, drives),
        ];
        let can = all.into_iter().filter(|(_, can)| *can);
        can.map(move |(cause, _)| (cause, Situation::Doing(doing))).collect::<Vec<_>>()
    };
    does(model, form).into_iter().flat_map(strikes).collect()
}

/// What a command can be doing that takes time.
fn does(model: &Model, form: &Form) -> Vec<Doing> {
    let mut doing = match form.op {
        Op::ArcAbsolute | Op::ArcRelative => vec![Doing::Arc, Doing::Settling],
        Op::Circle => vec![Doing::Move, Doing::Arc, Doing::Settling],
        Op::FollowVectors => vec![Doing::FollowingVectors, Doing::Settling],
        Op::PenDown | Op::PenUp => vec![Doing::WaitingForHead],
        Op::Wait => vec![Doing::Waiting],
        Op::Reference | Op::ReferenceOf => SEEKING.to_vec(),
        // A machine that homes does so with this command, too.
        Op::Initialize => SEEKING[..3].to_vec(),
        Op::HardClipLimits | Op::HardClipLimitsOf => {
            vec![Doing::ReferenceTowardsSwitch, Doing::Move, Doing::Settling]
        }
        Op::GoBack => vec![Doing::Move],
        op if moves(op) => MOVING.to_vec(),
        _ => Vec::new(),
    };
    // What was broken off in an arc goes on as a motion along the rest of it.
    let rests = matches!(form.op, Op::ArcAbsolute | Op::ArcRelative | Op::FollowVectors)
        && model.command_set == Dialect::MotionSystem;
    if rests {
        doing.push(Doing::Move);
    }
    doing
}

/// Whether it moves axes where it is told to or to their switches.
fn moves(op: Op) -> bool {
    matches!(
        op,
        Op::ArcAbsolute
            | Op::ArcRelative
            | Op::Circle
            | Op::EdgeAbsolute
            | Op::EdgeRelative
            | Op::SpaceAbsolute
            | Op::SpaceRelative
            | Op::PlotAbsolute
            | Op::PlotRelative
            | Op::MoveAllAbsolute
            | Op::MoveAllRelative
            | Op::MoveZAbsolute
            | Op::MoveZRelative
            | Op::MoveAxisAbsolute
            | Op::MoveAxisRelative
            | Op::FollowVectors
            | Op::Reference
            | Op::ReferenceOf
            | Op::HardClipLimits
            | Op::HardClipLimitsOf
            | Op::Initialize
    )
}

/// The axes that a command can move: those of its coordinates, or any that it names.
fn axes(form: &Form) -> &'static [Axis] {
    let has = |name: &str| form.parameters.iter().any(|parameter| parameter.name == name);
    match form.op {
        Op::MoveZAbsolute | Op::MoveZRelative => &Axis::ALL[2..3],
        Op::MoveAllAbsolute | Op::MoveAllRelative => &Axis::ALL,
        Op::Circle => &Axis::ALL[..2],
        _ if has("x") && has("z") => &Axis::ALL[..3],
        _ if has("x") => &Axis::ALL[..2],
        _ => &Axis::ALL,
    }
}

/// The axes that a controller of the model can have.
fn fitted(model: &Model) -> &'static [Axis] {
    match model.command_set {
        Dialect::Smcu => &Axis::ALL[..3],
        Dialect::MotionSystem => &Axis::ALL,
    }
}
