//! What a transport has to say, taken in.

use std::borrow::Cow;
use std::sync::Arc;

use vimc4_device::{Damage, Device, FaultNumber, Faulting, Input, LineFault, Time, Way, When};

use vimc4_session::LineClients;

use crate::News;
use crate::deeds;
use crate::drive::Drive;
use crate::rig::Rig;
use crate::transport::Received;

/// Takes in what a transport has to say. All that comes of it has one time. Returns how many bytes
/// that were.
pub(crate) fn receive<D: Device + Clone>(
    drive: &mut Drive<D>,
    clients: &mut LineClients,
    from: usize,
    received: Received,
    buffer: &[u8],
) -> usize {
    let mut taken = 0;
    match received {
        Received::Bytes(count) => {
            let at = drive.catch_up_to_present();
            let bytes = buffer.get(..count).unwrap_or_default();
            taken = bytes.len();
            let rig = &mut drive.rig;
            mind_speed(rig, clients, from, at);
            if clients.are_several()
                && !rig.sinks.is_empty()
                && let Some(news) = clients.speaks(&rig.wire.label(from))
            {
                rig.tell_news(at, news);
            }
            take_line(rig, clients, from, bytes, at);
            if let Some(right) = clients.wrong_line_end(bytes) {
                let transport = rig.wire.label(from);
                rig.tell_news(at, News::LineFeed { transport, right: right.into() });
            }
            rig.disappoint();
        }
        Received::Finished => {}
        Received::News(news) => {
            let at = drive.catch_up_to_present();
            let news = match news {
                News::WrongSpeed { transport, client, line, .. } => {
                    let noise = drive.rig.has_physics;
                    News::WrongSpeed { transport, client, line, noise }
                }
                news => news,
            };
            if matches!(news, News::Closed { observes: false, .. }) {
                end_speed(&mut drive.rig, clients, from, at);
            } else if matches!(news, News::Opened { observes: false, .. } | News::WrongSpeed { .. })
            {
                mind_speed(&mut drive.rig, clients, from, at);
            }
            let half = clients.open_or_close(&news);
            // A client that comes is told what it will find, and of one that goes what it has left.
            let comes = matches!(news, News::Opened { .. });
            let (first, second) = if comes { (half, Some(news)) } else { (Some(news), half) };
            for news in first.into_iter().chain(second) {
                drive.rig.tell_news(at, news);
            }
        }
    }
    drive.rig.wire.drop_finished();
    taken
}

/// Where the line has its physics, the speed of the client that speaks is the speed of the host.
fn mind_speed<D: Device>(rig: &mut Rig<D>, clients: &LineClients, from: usize, at: Time) {
    if !rig.has_physics {
        return;
    }
    let speed = rig.wire.client_baud(from).filter(|speed| *speed != rig.device.baud());
    set_speed(rig, clients, from, at, speed);
}

/// The client has left, and its speed with it.
fn end_speed<D: Device>(rig: &mut Rig<D>, clients: &LineClients, from: usize, at: Time) {
    if rig.has_physics {
        set_speed(rig, clients, from, at, None);
    }
}

fn set_speed<D: Device>(
    rig: &mut Rig<D>,
    clients: &LineClients,
    from: usize,
    at: Time,
    speed: Option<u32>,
) {
    let known = rig.device.faults().into_iter().find(|view| view.number == FaultNumber::TERMINAL);
    let known = known.and_then(|view| match view.fault.of_line()?.damage {
        Damage::Speed(speed) => Some(speed),
        _ => None,
    });
    let faulting = match speed {
        speed if speed == known => return,
        Some(speed) => {
            let fault = LineFault::new(Damage::Speed(speed), Way::Both, When::ALWAYS);
            Faulting::Begin(FaultNumber::TERMINAL, fault.into())
        }
        None => Faulting::End(FaultNumber::TERMINAL),
    };
    let by = clients.source(&rig.wire.label(from));
    match rig.is_paused() {
        true => rig.hold_back(Input::Fault(&faulting), Some(&by)),
        false => rig.input(Input::Fault(&faulting), at, Some(&by)),
    }
}

/// Passes on what has arrived, and says when it begins behind a half line of somebody else.
fn take_line<D: Device>(
    rig: &mut Rig<D>,
    clients: &mut LineClients,
    from: usize,
    bytes: &[u8],
    at: Time,
) {
    let label = rig.wire.label(from);
    let half_line = |half, spoils| News::HalfLine { transport: Arc::clone(&label), half, spoils };
    if !clients.track_lines() {
        return deeds::send(rig, bytes, at, || clients.source(&label));
    }
    let by = clients.source_of_partial(&label, bytes);
    if let Some(by) = &by
        && let Some(half) = clients.continued_partial(by)
    {
        rig.tell_news(at, half_line(half, true));
    }
    match clients.take(bytes, by) {
        Cow::Borrowed(bytes) => deeds::send(rig, bytes, at, || clients.source(&label)),
        Cow::Owned(bytes) if bytes.is_empty() => {}
        Cow::Owned(bytes) => deeds::send(rig, &bytes, at, || clients.source(&label)),
    }
    if let Some(half) = clients.late_partial() {
        rig.tell_news(at, half_line(half, false));
    }
}
