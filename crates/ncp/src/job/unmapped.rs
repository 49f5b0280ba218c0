//! Ports that the machine's profile maps to nothing, reported together.

use crate::diagnostic::{Diagnostic, Problem};
use crate::job;

/// Collects the diagnostics about unmapped ports: one for the lines that a lenient reading leaves
/// out, and one for the others.
#[derive(Debug, Default)]
pub(super) struct Unmapped([Option<Diagnostic>; 2]);

impl Unmapped {
    /// Passes a diagnostic on, unless it is about an unmapped port.
    pub(super) fn pass(&mut self, found: Diagnostic, report: &mut dyn FnMut(Diagnostic)) {
        let Problem::Asked(job::Problem::PortsUnmapped { ports, lines }) = found.problem else {
            return report(found);
        };
        let group = self.0.get_mut(usize::from(found.left_out));
        let Some(group) = group.map(|group| {
            group.get_or_insert(Diagnostic {
                problem: job::Problem::PortsUnmapped { ports, lines: 0 }.into(),
                ..found
            })
        }) else {
            return;
        };
        if let Problem::Asked(job::Problem::PortsUnmapped { ports: all, lines: sum }) =
            &mut group.problem
        {
            all.insert_all(ports);
            *sum = sum.saturating_add(lines);
        }
    }

    /// Reports what was collected, at the first line of each kind.
    pub(super) fn report(self, report: &mut dyn FnMut(Diagnostic)) {
        self.0.into_iter().flatten().for_each(report);
    }
}
