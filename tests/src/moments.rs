//! What holds in a moment, by looking at it.

use vimc4_device::{Condition, Device, Event, View};
use vimc4_plant::{End, Machine};

/// Whether a condition holds in a moment, by what can be seen.
pub fn holds<D: Device>(
    condition: &Condition,
    view: &View<D::Details>,
    machine: &Machine,
    device: &D,
    events: &[Event],
) -> bool {
    let axis = |wanted: u8| view.axes.iter().find(|axis| axis.index == wanted);
    let place = |wanted: u8| axis(wanted).map(|axis| axis.position);
    let again = |part: &Condition| holds(part, view, machine, device, events);
    let seen = |is: &dyn Fn(&Event) -> bool| events.iter().any(is);
    match condition {
        Condition::AxisAt { axis, position } => place(*axis) == Some(*position),
        Condition::AxisBelow { axis, position } => place(*axis).is_some_and(|at| at < *position),
        Condition::AxisAbove { axis, position } => place(*axis).is_some_and(|at| at > *position),
        Condition::Outside { low, high } => view.axes.iter().any(|axis| {
            let index = usize::from(axis.index);
            axis.position < low[index] || axis.position > high[index]
        }),
        Condition::PortBit { port, bit, level } => {
            let value = view.ports.iter().find(|view| view.input && view.port == *port);
            (value.map_or(0, |view| view.value) >> bit & 1 == 1) == *level
        }
        Condition::Limit { axis: wanted, positive, active } => {
            let Some(axis) = axis(*wanted) else { return false };
            let (end, letter) = if *positive { (End::Positive, '+') } else { (End::Negative, '-') };
            let name = format!("limit {}{letter}", axis.name.to_lowercase());
            let pressed = machine.axis(usize::from(*wanted)).presses(end, axis.carriage);
            (pressed || view.signal(&name) == Some(1)) == *active
        }
        Condition::SignalIs { signal, value } => {
            let shown = view.signals.iter().find(|view| view.id == *signal);
            shown.is_some_and(|view| view.value == Some(*value))
        }
        Condition::Idle => device.is_idle() && device.wake().is_none_or(|at| at > view.at),
        Condition::At(time) => view.at >= *time,
        Condition::Command { like } => seen(&|event| match (event, like) {
            (Event::Command { .. }, None) => true,
            (Event::Command { mnemonic, bytes }, Some(like)) => {
                is_form(mnemonic, like) || bytes.starts_with(like.as_bytes())
            }
            _ => false,
        }),
        Condition::Answered { like } => seen(&|event| match event {
            Event::Answer { mnemonic, .. } => {
                like.as_ref().is_none_or(|like| is_form(mnemonic, like))
            }
            _ => false,
        }),
        Condition::Answer { text } => seen(&|event| match event {
            Event::Answer { bytes, .. } => {
                *bytes == text.as_bytes() || *bytes == format!("{text}\r").as_bytes()
            }
            _ => false,
        }),
        Condition::Error { code } => seen(&|event| match event {
            Event::Answer { bytes, why: Some(_), .. } => {
                let text = String::from_utf8_lossy(bytes);
                code.as_ref().is_none_or(|code| {
                    text.trim_end() == code || text.trim_end() == format!("E{code}")
                })
            }
            _ => false,
        }),
        Condition::Line { line: wanted } => seen(&|event| match event {
            Event::Line { line, .. } => wanted.is_none_or(|wanted| wanted == *line),
            _ => false,
        }),
        Condition::SignalChanges { signal: wanted, to } => seen(&|event| match event {
            Event::Signal { signal, value } => signal == wanted && to.is_none_or(|to| to == *value),
            _ => false,
        }),
        Condition::All(parts) => parts.iter().all(again),
        Condition::Any(parts) => parts.iter().any(again),
        other => unreachable!("{other}"),
    }
}

/// Whether a command is of a kind, or a form of it: `OH/0` is one of `OH`.
fn is_form(mnemonic: &str, kind: &str) -> bool {
    mnemonic == kind || mnemonic.split('/').next() == Some(kind)
}
