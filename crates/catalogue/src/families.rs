//! What is made from the list of families.

/// Makes [`Family`], [`Model`], [`Controller`]'s inside, [`State`] and [`Details`] with one variant
/// for each family, and three macros that do the same with whichever it is:
///
/// * `of!(Kind, value, inner => expression)` with what is in a value of one of these kinds;
/// * expression)` with what is in two values, if they are of one family; => `both!(Kind, value,
///   Kind, value, one, other => expression)` with what is in two values, if they are of the same
///   family; => expression)` with what is in two values, if they are of one family;
/// * `by!(family, M => expression)` with the model type of a family.
///
/// A Cargo feature can leave a family out; its condition stands before the family.
///
/// The `$` in front of the list is for these macros' own variables.
macro_rules! families {
    (($d:tt) $(
        $(#[doc = $doc:literal])+ $(#[cfg($cfg:meta)])?
        $name:ident, $lower:ident = $of:ident;
    )+) => {
        /// Controllers that speak one language. What differs within a family is a value in a profile.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Family {
            $($(#[doc = $doc])+ $(#[cfg($cfg)])? $name,)+
        }

        impl Family {
            /// All of them.
            pub const ALL: [Family; [$($(#[cfg($cfg)])? Family::$name),+].len()] =
                [$($(#[cfg($cfg)])? Family::$name),+];
        }

        /// A model of controller: a profile that several controllers share. Copies are cheap.
        ///
        /// Two models are equal if every value of their profiles is. Serialised it is its profile.
        #[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
        #[serde(untagged)]
        #[non_exhaustive]
        pub enum Model {
            $($(#[doc = $doc])+ $(#[cfg($cfg)])? $name(std::sync::Arc<$of::Model>),)+
        }

        impl Model {
            $(
                /// The profile, if it is of that family.
                $(#[cfg($cfg)])?
                #[must_use]
                pub fn $lower(&self) -> Option<&$of::Model> {
                    match self {
                        Model::$name(model) => Some(model),
                        _ => None,
                    }
                }
            )+

            /// Its family.
            #[must_use]
            pub fn family(&self) -> Family {
                match self {
                    $($(#[cfg($cfg)])? Model::$name(_) => Family::$name,)+
                }
            }
        }

        /// The controller itself.
        #[derive(Clone, Debug)]
        pub(crate) enum Inner {
            $($(#[cfg($cfg)])? $name(Box<$of::Controller>),)+
        }

        /// Everything that decides what a controller will do.
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(rename_all = "lowercase")]
        #[non_exhaustive]
        pub enum State {
            $($(#[doc = $doc])+ $(#[cfg($cfg)])? $name(Box<$of::State>),)+
        }

        impl State {
            /// The family of the controller that it is a state of.
            #[must_use]
            pub fn family(&self) -> Family {
                match self {
                    $($(#[cfg($cfg)])? State::$name(_) => Family::$name,)+
                }
            }

            /// The names of its model and its machine.
            #[must_use]
            pub fn profile_names(&self) -> (&str, &str) {
                match self {
                    $($(#[cfg($cfg)])? State::$name(state) => state.profile_names(),)+
                }
            }

            /// The same with the model and the machine of another, if that is of the same family.
            #[must_use]
            pub fn with_profiles_of(&self, other: &State) -> Option<State> {
                match (self, other) {
                    $(
                        $(#[cfg($cfg)])?
                        (State::$name(own), State::$name(other)) => {
                            Some(State::$name(Box::new(own.with_profiles_of(other))))
                        }
                    )+
                    _ => None,
                }
            }
        }

        impl State {
            /// The same with what another has in its memory that outlives the power, if that is of the
            /// same family.
            #[must_use]
            pub fn with_memory_of(&self, other: &State) -> Option<State> {
                match (self, other) {
                    $(
                        $(#[cfg($cfg)])?
                        (State::$name(own), State::$name(other)) => {
                            Some(State::$name(Box::new(own.with_memory_of(other))))
                        }
                    )+
                    _ => None,
                }
            }
        }

        /// What is visible only on controllers of one family.
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(tag = "family", rename_all = "lowercase")]
        #[non_exhaustive]
        pub enum Details {
            $($(#[doc = $doc])+ $(#[cfg($cfg)])? $name($of::Details),)+
        }

        impl Details {
            $(
                /// Those of a controller of that family, if it is one.
                $(#[cfg($cfg)])?
                #[must_use]
                pub fn $lower(&self) -> Option<&$of::Details> {
                    match self {
                        Details::$name(details) => Some(details),
                        _ => None,
                    }
                }
            )+
        }

        $(
            $(#[cfg($cfg)])?
            impl From<std::sync::Arc<$of::Model>> for Model {
                fn from(model: std::sync::Arc<$of::Model>) -> Model {
                    Model::$name(model)
                }
            }

            $(#[cfg($cfg)])?
            impl From<$of::Controller> for Inner {
                fn from(controller: $of::Controller) -> Inner {
                    Inner::$name(Box::new(controller))
                }
            }

            $(#[cfg($cfg)])?
            impl From<$of::State> for State {
                fn from(state: $of::State) -> State {
                    State::$name(Box::new(state))
                }
            }

            $(#[cfg($cfg)])?
            impl From<$of::Details> for Details {
                fn from(details: $of::Details) -> Details {
                    Details::$name(details)
                }
            }
        )+

        macro_rules! of {
            ($d kind:ident, $d value:expr, $d inner:ident => $d expression:expr) => {
                match $d value {
                    $($(#[cfg($cfg)])? $d kind::$name($d inner) => $d expression,)+
                }
            };
        }

        macro_rules! both {
            ($d one:ident, $d value:expr, $d other:ident, $d second:expr,
             $d a:ident, $d b:ident => $d expression:expr) => {
                match ($d value, $d second) {
                    $($(#[cfg($cfg)])? ($d one::$name($d a), $d other::$name($d b)) => Some($d expression),)+
                    _ => None,
                }
            };
        }

        macro_rules! by {
            ($d family:expr, $d model:ident => $d expression:expr) => {
                match $d family {
                    $($(#[cfg($cfg)])? Family::$name => {
                        type $d model = $crate::list::$name;
                        $d expression
                    })+
                }
            };
        }

        $($(#[cfg($cfg)])? pub(crate) type $name = $of::Model;)+

        pub(crate) use {both, by, of};
    };
}
