//! A plot as a picture.

use crate::frame::Frame;
use crate::graphs::graphs;
use crate::path::views;
use crate::plot::Plot;
use crate::png::png;
use crate::scene::Scene;
use crate::svg::svg;
use crate::view::{Colouring, View};

/// A picture of a plot: the same plot, frame and choice give the same bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    scene: Scene,
}

impl Picture {
    /// Draws views, one beside or below the other.
    #[must_use]
    pub fn of(plot: &Plot, frame: &Frame, wanted: &[View], colouring: Colouring) -> Picture {
        let mut scene = Scene { title: frame.title.clone(), ..Scene::default() };
        let spatial: Vec<View> =
            wanted.iter().copied().filter(|view| *view != View::Time).collect();
        if !spatial.is_empty() || wanted.is_empty() {
            views(&mut scene, plot, frame, &spatial, colouring);
        }
        if wanted.contains(&View::Time) {
            graphs(&mut scene, plot, frame);
        }
        // Whole dots, whichever program makes them.
        scene.height = scene.height.ceil();
        Picture { scene }
    }

    /// The views that show a path best: from above alone if the third axis never moves.
    #[must_use]
    pub fn best_views(plot: &Plot) -> &'static [View] {
        let is_flat = plot.legs().iter().all(|leg| leg.to()[2] == leg.from[2]);
        if is_flat { &[View::Top] } else { &[View::Top, View::Isometric] }
    }

    /// The picture as SVG.
    #[must_use]
    pub fn svg(&self) -> String {
        svg(&self.scene)
    }

    /// The picture as PNG; `None` if there is no memory for it.
    #[must_use]
    pub fn png(&self) -> Option<Vec<u8>> {
        png(&self.scene)
    }
}
