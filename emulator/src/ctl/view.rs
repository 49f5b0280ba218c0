//! What is seen of a controller, as text.

use std::fmt::Write;

use serde_json::Value;
use vimc4_device::View;

use super::client::part;

/// A view and the list of signals, in words.
pub(crate) fn told(view: &Value, signals: &Value) -> String {
    // Another version may show other things: then they are shown as they are.
    let Ok(seen) = serde_json::from_value::<View<Value>>(view.clone()) else {
        return format!("{view:#}");
    };
    let mut said = format!("{} on {} at {}: {}", seen.model, seen.machine, seen.at, seen.activity);
    let mut put = |line: String| _ = write!(said, "\n{line}");
    if let Some(waits_for) = seen.waits_for {
        put(format!("  waits for {waits_for}"));
    }
    for axis in &seen.axes {
        let mut more = String::new();
        if axis.speed != 0 {
            more.push_str(&format!(", {:.3} Hz", axis.speed as f64 / 1e6));
        }
        if !axis.configured {
            more.push_str(", not configured");
        }
        if axis.configured {
            more.push_str(axis.reference_in_words());
        }
        put(format!("  {:<16} {:>8} steps{more}", axis.name, axis.position));
    }
    for port in &seen.ports {
        let direction = if port.input { "input" } else { "output" };
        put(format!(
            "  {:<16} {:>8}",
            format!("{direction} {}", port.port),
            format!("{:08b}", port.value)
        ));
    }
    for signal in signals.as_array().into_iter().flatten() {
        // Of what is off there is a lot.
        let value = match (signal["value"].as_u64(), &signal["positions"]) {
            (None, _) => continue,
            (Some(value), Value::Array(names)) => {
                let name = usize::try_from(value).ok().and_then(|value| names.get(value)?.as_str());
                name.map_or_else(|| value.to_string(), str::to_owned)
            }
            (Some(0), _) => continue,
            (Some(value), _) => value.to_string(),
        };
        put(format!("  {:<16} {value:>8}", part(signal, "name")));
    }
    for timer in &seen.timers {
        put(format!("  due at {}: {}", timer.due, timer.cause));
    }
    said
}
