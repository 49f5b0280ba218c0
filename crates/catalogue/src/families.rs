//! What is made from the list of families.

/// Makes [`Family`], [`Model`], [`Controller`]'s inside, [`State`] and [`Details`] with one variant
/// for each family, and three macros that do the same with whichever it is:
///
/// * `of!(Kind, value, inner => expression)` with what is in a value of one of these kinds;
/// * `both!(Kind, value, Kind, value, one, other => expression)` with what is in two values, if
///   they are of one family;
/// * `by!(family, M => expression)` with the model type of a family.
///
/// There are two families at least.
///
/// The `$` in front of the list is for these macros' own variables.
macro_rules! families {
    (($d:tt) $($(#[doc = $doc:literal])+ $name:ident, $lower:ident = $of:ident;)+) => {
        /// Controllers that speak one language. What differs within a family is a value in a profile.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Family {
            $($(#[doc = $doc])+ $name,)+
        }

        impl Family {
            /// All of them.
            pub const ALL: [Family; [$(Family::$name),+].len()] = [$(Family::$name),+];
        }

        /// A model of controller: a profile that several controllers share. Copies are cheap.
        ///
        /// Two models are equal if every value of their profiles is. Serialised it is its profile.
        #[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
        #[serde(untagged)]
        #[non_exhaustive]
        pub enum Model {
            $($(#[doc = $doc])+ $name(std::sync::Arc<$of::Model>),)+
        }

        impl Model {
            $(
                /// The profile, if it is of that family.
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
                    $(Model::$name(_) => Family::$name,)+
                }
            }
        }

        /// The controller itself.
        #[derive(Clone, Debug)]
        pub(crate) enum Inner {
            $($name(Box<$of::Controller>),)+
        }

        /// Everything that decides what a controller will do.
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(rename_all = "lowercase")]
        #[non_exhaustive]
        pub enum State {
            $($(#[doc = $doc])+ $name(Box<$of::State>),)+
        }

        impl State {
            /// The family of the controller that it is a state of.
            #[must_use]
            pub fn family(&self) -> Family {
                match self {
                    $(State::$name(_) => Family::$name,)+
                }
            }
        }

        /// What can be seen of a controller that only its family has.
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(tag = "family", rename_all = "lowercase")]
        #[non_exhaustive]
        pub enum Details {
            $($(#[doc = $doc])+ $name($of::Details),)+
        }

        impl Details {
            $(
                /// Those of a controller of that family, if it is one.
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
            impl From<std::sync::Arc<$of::Model>> for Model {
                fn from(model: std::sync::Arc<$of::Model>) -> Model {
                    Model::$name(model)
                }
            }

            impl From<$of::Controller> for Inner {
                fn from(controller: $of::Controller) -> Inner {
                    Inner::$name(Box::new(controller))
                }
            }

            impl From<$of::State> for State {
                fn from(state: $of::State) -> State {
                    State::$name(Box::new(state))
                }
            }

            impl From<$of::Details> for Details {
                fn from(details: $of::Details) -> Details {
                    Details::$name(details)
                }
            }
        )+

        macro_rules! of {
            ($d kind:ident, $d value:expr, $d inner:ident => $d expression:expr) => {
                match $d value {
                    $($d kind::$name($d inner) => $d expression,)+
                }
            };
        }

        macro_rules! both {
            ($d one:ident, $d value:expr, $d other:ident, $d second:expr,
             $d a:ident, $d b:ident => $d expression:expr) => {
                match ($d value, $d second) {
                    $(($d one::$name($d a), $d other::$name($d b)) => Some($d expression),)+
                    _ => None,
                }
            };
        }

        macro_rules! by {
            ($d family:expr, $d model:ident => $d expression:expr) => {
                match $d family {
                    $(Family::$name => {
                        type $d model = $crate::list::$name;
                        $d expression
                    })+
                }
            };
        }

        $(pub(crate) type $name = $of::Model;)+

        pub(crate) use {both, by, of};
    };
}
