//! What somebody has set up on the screen, and the picture that makes of a session.

use std::env;

use ratatui_core::buffer::Buffer;
use ratatui_core::layout::Rect;
use vimc4_debug::Unit;

use super::draw::draw;
use super::ink::Inks;
use super::path::Gaze;
use super::picture::{Picture, Prompt};
use super::svg::svg;
use crate::console::camera::{self, Around};
use crate::console::session::Session;

/// What the arrow keys can go by.
pub(super) const UNITS: [Unit; 8] = [
    Unit::Command,
    Unit::Line,
    Unit::Loop,
    Unit::Segment,
    Unit::Event,
    Unit::Cause,
    Unit::Byte,
    Unit::Step,
];

/// What somebody has set up on the screen.
pub(super) struct Look {
    pub(super) inks: Inks,
    pub(super) gaze: Gaze,
    pub(super) unit: usize,
    pub(super) prompt: Prompt,
    /// Lines that were typed, and which of them is shown.
    pub(super) typed: Vec<String>,
    pub(super) recalled: usize,
    pub(super) shows_keys: bool,
    /// Whether no line console is behind the screen.
    pub(super) is_first: bool,
    around: Around,
    pub(super) pictures: u32,
}

impl Look {
    pub(super) fn new(inks: Inks) -> Look {
        Look {
            inks,
            gaze: Gaze::default(),
            unit: 0,
            prompt: Prompt::default(),
            typed: Vec::new(),
            recalled: 0,
            shows_keys: false,
            is_first: true,
            around: Around::default(),
            pictures: 0,
        }
    }

    pub(super) fn picture(&mut self, session: &mut Session) -> Picture {
        let (view, clock) = (session.view(), session.clock().to_owned());
        let is_running = session.is_running();
        let said = session.said.clone();
        let debugger = &mut session.debugger;
        let mut picture = Picture {
            view,
            machine: session.machine.clone(),
            signals: Vec::new(),
            clock,
            command: None,
            listing: vimc4_debug::Listing { of: String::new(), lines: Vec::new() },
            talk: Vec::new(),
            strokes: Vec::new(),
            gaze: self.gaze,
            line: super::picture::TimeLine::default(),
            watches: Vec::new(),
            said: said.into(),
            prompt: self.prompt.clone(),
            unit: UNITS[self.unit].to_string(),
            shows_keys: self.shows_keys,
            is_first: self.is_first,
        };
        camera::show(debugger, &mut self.around, &mut picture);
        if is_running {
            picture.line.now = picture.view.at;
            picture.line.end = picture.view.at.max(picture.line.end);
        }
        picture
    }
}

/// Whether colours are wanted.
pub(super) fn inks() -> Inks {
    Inks { colour: env::var_os("NO_COLOR").is_none_or(|value| value.is_empty()) }
}

/// The screen in so many columns and rows, as a picture.
pub(crate) fn as_svg(session: &mut Session, (width, height): (u16, u16)) -> String {
    let picture = Look::new(Inks { colour: true }).picture(session);
    let area = Rect::new(0, 0, width, height);
    let mut buffer = Buffer::empty(area);
    draw(&picture, Inks { colour: true }, area, &mut buffer);
    let title = format!("{} on {}", picture.view.model, picture.view.machine);
    svg(&buffer, &title)
}
