//! What the places of axes mean: names, units and where the machine ends.

use vimc4_motion::{AXES, Point};

/// One axis of the machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// What the controller calls it, such as `X`.
    pub name: String,
    /// The unit of what people read: `mm`, `°`, or `steps` where nothing else is known.
    pub unit: String,
    /// How much of the unit a step is.
    pub per_step: f64,
    /// The lowest and the highest place that the axis can take, in steps from its reference point.
    pub travel: (Option<i64>, Option<i64>),
}

impl Axis {
    /// An axis of which nothing is known but its name.
    #[must_use]
    pub fn in_steps(name: &str) -> Axis {
        Axis {
            name: name.to_owned(),
            unit: "steps".to_owned(),
            per_step: 1.0,
            travel: (None, None),
        }
    }

    /// Whether its places can be drawn in space.
    #[must_use]
    pub fn is_linear(&self) -> bool {
        self.unit != "°"
    }
}

/// The machine around a path.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// What stands above the picture.
    pub title: String,
    /// The axes, in the order of a [`Point`]; there may be fewer.
    pub axes: Vec<Axis>,
}

impl Frame {
    /// What a step of each axis is in its unit; 0 for axes that it does not have.
    #[must_use]
    pub fn scales(&self) -> [f64; AXES] {
        std::array::from_fn(|axis| self.axes.get(axis).map_or(0.0, |axis| axis.per_step))
    }

    /// The same for the axes that have a length.
    #[must_use]
    pub fn lengths(&self) -> [f64; AXES] {
        let length = |axis: &Axis| if axis.is_linear() { axis.per_step } else { 0.0 };
        std::array::from_fn(|axis| self.axes.get(axis).map_or(0.0, length))
    }

    /// The name of an axis.
    pub(crate) fn name(&self, axis: usize) -> &str {
        self.axes.get(axis).map_or("?", |axis| axis.name.as_str())
    }

    /// The unit of an axis.
    pub(crate) fn unit(&self, axis: usize) -> &str {
        self.axes.get(axis).map_or("steps", |axis| axis.unit.as_str())
    }

    /// The corners of the machine's envelope, lowest and highest, as far as the first three axes have
    /// ends, in their units.
    pub(crate) fn envelope(&self) -> [(Option<f64>, Option<f64>); 3] {
        std::array::from_fn(|axis| {
            let Some(axis) = self.axes.get(axis) else { return (None, None) };
            let (low, high) = axis.travel;
            let there = |steps: Option<i64>| steps.map(|steps| steps as f64 * axis.per_step);
            (there(low), there(high))
        })
    }
}

/// A place in the units of the axes.
pub(crate) fn scaled(place: &Point, scales: &[f64; AXES]) -> [f64; AXES] {
    std::array::from_fn(|axis| place[axis] as f64 * scales[axis])
}

/// How far apart two places are.
pub(crate) fn distance(from: &[f64], to: &[f64]) -> f64 {
    from.iter().zip(to).map(|(from, to)| (to - from) * (to - from)).sum::<f64>().sqrt()
}

/// A place that is so much further.
pub(crate) fn added(place: &Point, by: &Point) -> Point {
    std::array::from_fn(|axis| place[axis].saturating_add(by[axis]))
}
