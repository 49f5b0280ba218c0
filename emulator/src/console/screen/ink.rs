//! What is emphasised how: by attributes first, so that nothing is lost without colour and on any
//! background.

use ratatui_core::style::{Color, Modifier, Style};

/// What something on the screen is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ink {
    Plain,
    /// What is read second: rules, what things mean, what has not happened yet.
    Faint,
    /// What is read first.
    Strong,
    /// The heading of the screen, and the line where one is.
    Present,
    /// What has gone wrong, or is pressed and should not be.
    Alarm,
    /// What is as it should be.
    Well,
    /// What was sent to the controller.
    Sent,
    /// What can be typed or pressed.
    Key,
}

/// With colour or without.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inks {
    pub(crate) colour: bool,
}

impl Inks {
    /// No yellow and no blue: one is not seen on white, the other not on black.
    pub(crate) fn style(self, ink: Ink) -> Style {
        let (style, colour) = match ink {
            Ink::Plain => (Style::new(), None),
            Ink::Faint => (Style::new().add_modifier(Modifier::DIM), None),
            Ink::Strong => (Style::new().add_modifier(Modifier::BOLD), None),
            Ink::Present => (Style::new().add_modifier(Modifier::REVERSED), None),
            Ink::Alarm => {
                let style = Style::new().add_modifier(Modifier::BOLD);
                match self.colour {
                    true => (style, Some(Color::Red)),
                    false => (style.add_modifier(Modifier::UNDERLINED), None),
                }
            }
            Ink::Well => (Style::new(), Some(Color::Green)),
            Ink::Sent => (Style::new(), Some(Color::Cyan)),
            Ink::Key => (Style::new().add_modifier(Modifier::BOLD), Some(Color::Magenta)),
        };
        colour.filter(|_| self.colour).map_or(style, |colour| style.fg(colour))
    }
}
