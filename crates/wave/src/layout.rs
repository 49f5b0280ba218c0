//! What a viewer shows first: the signals that people look for, in their groups.

use std::fmt::Write as _;

use crate::scene::{Kind, Scene};

/// A save file of GTKWave for a waveform of this name: `gtkwave out.gtkw` opens both.
#[must_use]
pub fn gtkwave(scene: &Scene, waveform: &str) -> String {
    let mut text = format!("[*] vimc4\n[dumpfile] \"{waveform}\"\n[sst_expanded] 1\n");
    let _ = writeln!(text, "[treeopen] {}.", scene.name);
    let mut group = "";
    for signal in &scene.signals {
        if signal.group != group {
            group = &signal.group;
            let _ = writeln!(text, "@200\n-{group}");
        }
        // How a signal is shown: a curve over its whole range for positions, hexadecimal for ports.
        let is_curve = signal.name == "position";
        let (flags, bits) = match signal.kind {
            Kind::Number if is_curve => ("88020", ""),
            Kind::Byte => ("22", "[7:0]"),
            Kind::Bit => ("28", ""),
            Kind::Number | Kind::Text => ("20", ""),
        };
        let _ = writeln!(text, "@{flags}\n{}{bits}", scene.path(signal));
        if is_curve {
            // Two more rows of height.
            text.push_str("@20000\n-\n-\n");
        }
    }
    text
}

/// A file of commands for Surfer: `surfer out.vcd -c out.sucl`.
#[must_use]
pub fn surfer(scene: &Scene) -> String {
    let (mut text, mut group) = (String::new(), "");
    for signal in &scene.signals {
        if signal.group != group {
            group = &signal.group;
            let _ = writeln!(text, "divider_add {group}");
        }
        let _ = writeln!(text, "variable_add {}", scene.path(signal));
    }
    text.push_str("zoom_fit\n");
    text
}
