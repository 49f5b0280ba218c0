//! What a condition on ports lacks, and what somebody types to change that.

use std::fmt;

use vimc4_catalogue::Controller;
use vimc4_device::{Condition, Deed, Device, Event};

/// A condition that does not hold. Behind what is waited for it says what is there now, and what changes
/// that, as far as the condition is about bits of ports.
pub(crate) struct Unmet<'c> {
    pub(crate) condition: &'c Condition,
    pub(crate) device: &'c Controller,
}

impl Unmet<'_> {
    /// The bits that are not as they are to be: port, bit and what it is to be.
    fn bits(&self) -> Vec<(u16, u8, bool)> {
        let parts = match self.condition {
            Condition::All(parts) => parts.as_slice(),
            part => std::slice::from_ref(part),
        };
        let lacking = parts.iter().filter(|part| {
            let nothing: [&Event; 0] = [];
            !self.device.holds(part, nothing.into_iter())
        });
        let bits = lacking.map(|part| match part {
            Condition::PortBit { port, bit, level } => Some((*port, *bit, *level)),
            _ => None,
        });
        // What lacks something else is not explained by half.
        bits.collect::<Option<_>>().unwrap_or_default()
    }
}

impl fmt::Display for Unmet<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bits = self.bits();
        let [(port, _, level), ..] = bits.as_slice() else { return Ok(()) };
        match self.condition {
            Condition::PortBit { .. } => write!(f, "; it is {}", u8::from(!level))?,
            _ => {
                let ports = self.device.view(self.device.now()).ports;
                let here = ports.iter().find(|own| own.input && own.port == *port);
                here.map_or(Ok(()), |here| write!(f, "; it is {}", here.value))?;
            }
        }
        let signals = self.device.signals();
        let mut typed = Vec::new();
        for (port, bit, level) in &bits {
            let deed = Deed::Input { port: *port, bit: *bit, level: *level };
            if deed.inputs(&signals).is_err() {
                return write!(f, ", and nothing outside drives bit {bit} of port {port}");
            }
            typed.push(format!("`{deed}`"));
        }
        match typed.as_slice() {
            [typed] => write!(f, ", and {typed} changes that"),
            typed => write!(f, ", and {} change that together", typed.join(", ")),
        }
    }
}
