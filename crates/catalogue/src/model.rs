//! A model of any family.

use std::sync::Arc;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use vimc4_device::{Ability, Deed, Device, Model as _, PortView, View};
use vimc4_plant::{ProfileError, parse_profile};

use crate::list::{Details, Family, Model, both, by, of};

/// What every profile has.
#[derive(Deserialize)]
struct Head {
    command_set: Option<String>,
}

impl Model {
    /// The built-in model of that name.
    #[must_use]
    pub fn builtin(name: &str) -> Option<Model> {
        let of = |family| by!(family, M => M::builtin(name).map(Model::from));
        Family::ALL.into_iter().find_map(of)
    }

    /// The profile of a built-in model.
    #[must_use]
    pub fn builtin_toml(name: &str) -> Option<&'static str> {
        Family::ALL.into_iter().find_map(|family| by!(family, M => M::builtin_toml(name)))
    }

    /// Reads a profile. Its `command_set` names its family.
    ///
    /// # Errors
    ///
    /// If it is not TOML, names no command set, has unknown or missing keys, or an impossible
    /// value.
    pub fn from_toml(text: &str) -> Result<Model, ProfileError> {
        let Head { command_set } = parse_profile(text)?;
        let set = command_set.as_deref().unwrap_or_default();
        match Family::ALL.into_iter().find(|family| family.command_sets().contains(&set)) {
            Some(family) => by!(family, M => M::from_toml(text).map(Arc::new).map(Model::from)),
            None => Err(no_command_set(text, command_set.as_deref())),
        }
    }

    /// Reads the profile of a model with this command set from any other form, such as JSON. That its values
    /// are possible is not looked at: it is for what was a model before.
    ///
    /// # Errors
    ///
    /// If there is no such command set, or that is no such profile.
    pub fn written<'de, D: Deserializer<'de>>(set: &str, profile: D) -> Result<Model, D::Error> {
        match Family::ALL.into_iter().find(|family| family.command_sets().contains(&set)) {
            Some(family) => {
                by!(family, M => M::deserialize(profile).map(Arc::new).map(Model::from))
            }
            None => Err(D::Error::custom(format!("there is no command set {set}"))),
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        of!(Model, self, model => model.name())
    }

    /// What it is, in one line.
    #[must_use]
    pub fn title(&self) -> &str {
        of!(Model, self, model => model.title())
    }

    /// Bits per second of its line after power-on.
    #[must_use]
    pub fn baud(&self) -> u32 {
        of!(Model, self, model => model.baud())
    }

    /// Whether its line has RTS and CTS, with which it tells the host to wait.
    #[must_use]
    pub fn has_handshake_lines(&self) -> bool {
        of!(Model, self, model => model.has_handshake_lines())
    }

    /// The axes that it can have, as it calls them, in the order in which points count them.
    #[must_use]
    pub fn axis_names(&self) -> &'static [&'static str] {
        of!(Model, self, model => model.axis_names())
    }

    /// What its controllers can do with each form of a command.
    #[must_use]
    pub fn abilities(&self) -> Vec<Ability> {
        of!(Model, self, model => model.abilities())
    }

    /// Whether the motors have current and whether the spindle is switched on, as a view of one of its
    /// controllers shows it.
    #[must_use]
    pub fn drives(&self, view: &View<Details>) -> [bool; 2] {
        match (self, &view.details) {
            (Model::Isel(model), Details::Isel(details)) => {
                let spindle = model.spindle_bit().is_some_and(|(port, bit)| {
                    let is_it = |found: &&PortView| !found.input && found.port == port;
                    view.ports.iter().find(is_it).is_some_and(|found| found.value >> bit & 1 == 1)
                });
                [details.motors_on, spindle]
            }
            #[cfg(feature = "lpkf")]
            (Model::Lpkf(_), Details::Lpkf(details)) => [view.powered, details.spindle],
            #[cfg(feature = "lpkf")]
            _ => [false; 2],
        }
    }

    /// Whether its commands are the same.
    pub(crate) fn has_commands_of(&self, other: &Model) -> bool {
        both!(Model, self, Model, other, one, other => one.has_commands_of(other)).unwrap_or(false)
    }

    /// How long its panel takes to erase the memory, in ms, if it can.
    #[must_use]
    pub fn panel_erase_ms(&self) -> Option<u64> {
        of!(Model, self, model => model.panel_erase_ms())
    }

    /// Whether its panel can erase the stored program.
    #[must_use]
    pub fn erases_at_panel(&self) -> bool {
        of!(Model, self, model => model.erasing_at_panel()).is_ok()
    }

    /// What a person does at the panel of this controller, as it is now, to erase its stored
    /// program. Switches that are turned for it are turned back.
    ///
    /// # Errors
    ///
    /// If the panel cannot erase: why, for people.
    pub fn erasing(&self, controller: &impl Device) -> Result<Deed, &'static str> {
        let hands = of!(Model, self, model => model.erasing_at_panel())?;
        let hands = hands.iter().map(|(name, value)| ((*name).to_owned(), *value));
        let mut signals: Vec<(String, i32)> = hands.collect();
        let before = controller.view(controller.now());
        for switch in controller.signals().iter().filter(|signal| signal.positions.is_some()) {
            if signals.iter().any(|(name, _)| *name == switch.name)
                && let Some(value) = before.signal(&switch.name)
            {
                signals.push((switch.name.clone(), value));
            }
        }
        Ok(Deed::Several { what: "erase".to_owned(), signals })
    }
}

/// A profile names no command set, or an unknown one.
fn no_command_set(text: &str, found: Option<&str>) -> ProfileError {
    let sets = Family::ALL.map(|family| {
        let sets: Vec<String> =
            family.command_sets().iter().map(|set| format!("{set:?}")).collect();
        format!("{} ({family})", sets.join(", "))
    });
    let message = match found {
        Some(set) => format!("there is no command set {set:?}"),
        None => "the profile names no command set".to_owned(),
    };
    let help = format!("command_set is one of {}", sets.join(" or "));
    ProfileError::about_key(text, "", "command_set", message, help)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_set_says_which_family_a_profile_is_of() {
        for family in Family::ALL {
            for name in family.models() {
                let text = Model::builtin_toml(name).unwrap();
                let model = Model::from_toml(text).unwrap();
                assert_eq!((model.family(), model.name()), (family, name));
                assert_eq!(Some(model), Model::builtin(name));
            }
        }
        let wrong = Model::from_toml("name = \"x\"\ncommand_set = \"imc5\"\n").unwrap_err();
        assert_eq!(wrong.span, Some(11..31));
        for set in Family::ALL.into_iter().flat_map(Family::command_sets) {
            assert!(wrong.help.contains(&format!("{set:?}")), "{}", wrong.help);
        }
        let none = Model::from_toml("name = \"x\"\n").unwrap_err();
        assert_eq!(none.message, "the profile names no command set");
    }
}
