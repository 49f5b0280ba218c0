//! A model of any family.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use vimc4_lpkf::CommandSet;
use vimc4_plant::{ProfileError, parse_profile};

use crate::Family;

/// A model of controller: a profile that several controllers share. Copies are cheap.
///
/// Two models are equal if every value of their profiles is. Serialised it is its profile.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum Model {
    /// One of isel's.
    Isel(Arc<vimc4_isel::Model>),
    /// One of LPKF's.
    Lpkf(Arc<vimc4_lpkf::Model>),
}

/// What every profile has, whatever else is in it.
#[derive(Deserialize)]
struct Head {
    command_set: Option<String>,
}

/// The same of whichever model it is.
macro_rules! of {
    ($model:expr, $inner:ident => $value:expr) => {
        match $model {
            Model::Isel($inner) => $value,
            Model::Lpkf($inner) => $value,
        }
    };
}

impl Model {
    /// The built-in model of that name.
    #[must_use]
    pub fn builtin(name: &str) -> Option<Model> {
        let isel = vimc4_isel::Model::builtin(name).map(Model::Isel);
        isel.or_else(|| vimc4_lpkf::Model::builtin(name).map(Model::Lpkf))
    }

    /// The profile of a built-in model.
    #[must_use]
    pub fn builtin_toml(name: &str) -> Option<&'static str> {
        vimc4_isel::Model::builtin_toml(name).or_else(|| vimc4_lpkf::Model::builtin_toml(name))
    }

    /// Reads a profile. Its `command_set` says of which family it is.
    ///
    /// # Errors
    ///
    /// If it is not TOML, names no command set, has unknown or missing keys, or a value that no
    /// controller can have.
    pub fn from_toml(text: &str) -> Result<Model, ProfileError> {
        let Head { command_set } = parse_profile(text)?;
        let set = command_set.as_deref().unwrap_or_default();
        match Family::ALL.into_iter().find(|family| family.command_sets().contains(&set)) {
            Some(Family::Isel) => Ok(Model::Isel(Arc::new(vimc4_isel::Model::from_toml(text)?))),
            Some(Family::Lpkf) => Ok(Model::Lpkf(Arc::new(vimc4_lpkf::Model::from_toml(text)?))),
            None => Err(no_command_set(text, command_set.as_deref())),
        }
    }

    /// Its family.
    #[must_use]
    pub fn family(&self) -> Family {
        match self {
            Model::Isel(_) => Family::Isel,
            Model::Lpkf(_) => Family::Lpkf,
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        of!(self, model => &model.name)
    }

    /// What it is, in one line.
    #[must_use]
    pub fn title(&self) -> &str {
        of!(self, model => &model.title)
    }

    /// Bits per second of its line after power-on.
    #[must_use]
    pub fn baud(&self) -> u32 {
        of!(self, model => model.line.baud)
    }

    /// Whether its line has RTS and CTS, with which it tells the host to wait.
    #[must_use]
    pub fn has_handshake_lines(&self) -> bool {
        match self {
            Model::Isel(_) => false,
            Model::Lpkf(_) => true,
        }
    }

    /// The axes that it can have, as it calls them, in the order in which points count them.
    #[must_use]
    pub fn axis_names(&self) -> &'static [&'static str] {
        match self {
            Model::Isel(_) => &["X", "Y", "Z", "A"],
            Model::Lpkf(model) => match model.command_set {
                CommandSet::Smcu => &["X", "Y", "Z"],
                CommandSet::MotionSystem => &["X", "Y", "Z0", "Z1", "Z2", "Z3"],
            },
        }
    }

    /// Whether its commands are the same.
    pub(crate) fn has_commands_of(&self, other: &Model) -> bool {
        match (self, other) {
            (Model::Isel(one), Model::Isel(other)) => one.command_set == other.command_set,
            (Model::Lpkf(one), Model::Lpkf(other)) => one.command_set == other.command_set,
            _ => false,
        }
    }

    /// Every value that each of its quirks can have, as TOML writes it.
    pub(crate) fn quirks(&self) -> &'static [(&'static str, &'static [&'static str])] {
        match self {
            Model::Isel(_) => &[
                ("version_handshake", &["\"first\"", "\"last\""]),
                ("stop_reply", &["\"F\"", "\"F0\""]),
                ("fractional_numbers", &["\"reject\"", "\"truncate\""]),
                ("limit_latch", &["\"strict\"", "\"off\""]),
                ("lost_steps", &["false", "true"]),
                ("leave_switch", &["\"refuse\"", "\"away\""]),
                ("loop_count", &["\"total\"", "\"extra\""]),
                ("cond_branch_base", &["\"next\"", "\"own\""]),
                ("cond_bit_base", &["0", "1"]),
                ("start_resumes_dnc", &["false", "true"]),
                ("unreferenced", &["\"2\"", "\"R\""]),
                ("stop_button", &["\"held\"", "\"pressed\""]),
                ("stop_in_reference", &["\"end\"", "\"switch\""]),
                ("stop_in_move_until", &["\"keep\"", "\"forget\""]),
                ("after_free", &["\"reference\"", "\"any\""]),
                ("speed_3d", &["\"longest\"", "\"xyz\""]),
                ("bit_values", &["\"any\"", "\"binary\""]),
                ("stored_arcs", &["\"check\"", "\"accept\""]),
                ("limit_bits", &["\"switch\"", "\"end\""]),
                ("axis_codes", &["\"nested\"", "\"any\""]),
                ("lower_case", &["\"after\"", "\"before\"", "\"before-and-error\""]),
                ("position_axes", &["\"three\"", "\"configured\""]),
                ("resting_speed", &["\"check\"", "\"zero\""]),
                ("store_over", &["\"refuse\"", "\"replace\""]),
                ("self_test_end", &["\"echo\"", "\"commands\""]),
                ("reset_reply", &["\"none\"", "\"0\""]),
                ("break_reply", &["\"none\"", "\"0\""]),
            ],
            Model::Lpkf(_) => &[
                ("unknown_command", &["\"echo\"", "\"never\"", "\"always\""]),
                ("init_reply", &["\"Z\"", "\"C\""]),
                ("init_echo", &["\"on\"", "\"off\""]),
                ("after_status", &["\"wait\"", "\"refuse\"", "\"execute\""]),
                ("hard_clip_blank", &["false", "true"]),
                ("status_digits", &["\"hexadecimal\"", "\"decimal\""]),
                ("decimal_speed", &["\"micrometres\"", "\"metres\""]),
                ("bare_pairs", &["\"ignore\"", "\"repeat\""]),
                ("ta", &["\"move\"", "\"none\""]),
            ],
        }
    }

    /// Why its panel cannot erase the memory, unless it can.
    #[must_use]
    pub fn refuses_to_erase(&self) -> Option<&'static str> {
        match self {
            Model::Isel(model) if model.timing.panel_erase_ms.is_some() => None,
            Model::Isel(_) => {
                Some("the panel of this model does not erase; send the command @0k instead")
            }
            Model::Lpkf(_) => Some("this model has no memory that could be erased"),
        }
    }
}

/// A profile names no command set, or none that there is.
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
