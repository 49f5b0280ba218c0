//! The names of axes and signals.

use std::sync::OnceLock;

use vimc4_device::{Device, Model as _, Names, Signal, SignalKind};

use crate::list::of;
use crate::{Family, Model, bare, machine, models};

/// The number of the axis of that name, 0 for X, in capital or small letters. What isel calls Z
/// and A is Z0 and Z1 to LPKF, and Z on an SMCU, which has no other.
///
/// ```
/// assert_eq!(["x", "Z", "Z0", "a", "z3", "b"].map(vimc4_catalogue::axis), [
///     Some(0), Some(2), Some(2), Some(3), Some(5), None
/// ]);
/// ```
#[must_use]
pub fn axis(name: &str) -> Option<u8> {
    let place = |axes: &&[&str]| axes.iter().position(|axis| axis.eq_ignore_ascii_case(name));
    u8::try_from(every().find_map(|axes| place(&axes))?).ok()
}

/// The names of the axes of all models.
fn every() -> impl Iterator<Item = &'static [&'static str]> {
    Family::ALL.into_iter().flat_map(Family::axes).copied()
}

impl Model {
    /// The names of the axes and of these signals of such a controller, and what can happen there.
    /// Its axes are also understood by the names that other models use.
    #[must_use]
    pub fn names(&self, signals: Vec<Signal>) -> Names {
        let own = self.axis_names();
        let numbered = || (0..).zip(own).map(|(axis, name)| (axis, (*name).to_owned()));
        let others = every().flat_map(|axes| {
            let names = (0..).zip(axes).take(own.len());
            names
                .filter(|(_, name)| !own.contains(name))
                .map(|(axis, name)| (axis, (*name).to_owned()))
        });
        Names::new(numbered().chain(others), signals)
            .with_erasing(self.erases_at_panel())
            .with_vocabulary(of!(Model, self, model => model.vocabulary()))
    }
}

/// The names of the axes and signals of all built-in models together: for text that is read before
/// its model and wiring are known.
///
/// ```
/// use vimc4_language::Order;
///
/// let names = vimc4_catalogue::all_names();
/// assert!(Order::read("cover open", names).is_ok() && Order::read("ball x -3", names).is_err());
/// assert!(Order::read("set ball x -3", names).is_ok());
/// ```
#[must_use]
pub fn all_names() -> &'static Names {
    static NAMES: OnceLock<Names> = OnceLock::new();
    NAMES.get_or_init(|| {
        let mut signals: Vec<Signal> = Vec::new();
        let mut axes = Vec::new();
        for model in models().into_iter().filter_map(Model::builtin) {
            axes.extend(
                (0..).zip(model.axis_names()).map(|(axis, name)| (axis, (*name).to_owned())),
            );
            let controller = machine("bench").ok().and_then(|bench| bare(&model, &bench, b"").ok());
            for signal in controller.iter().flat_map(Device::signals) {
                match signals.iter_mut().find(|known| known.name == signal.name) {
                    Some(known) => known.kind = widest(known.kind, signal.kind),
                    None => signals.push(signal),
                }
            }
        }
        Names::new(axes, signals).with_any_bit()
    })
}

/// The kind that takes the values of both.
fn widest(one: SignalKind, other: SignalKind) -> SignalKind {
    match (one, other) {
        (SignalKind::Analogue { low, high }, SignalKind::Analogue { low: least, high: most }) => {
            SignalKind::Analogue { low: low.min(least), high: high.max(most) }
        }
        (one, _) => one,
    }
}
