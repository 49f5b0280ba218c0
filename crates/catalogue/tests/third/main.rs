//! A third family: the files of the catalogue as they are, with a list that has a line more.
//!
//! `cart/` is what would be a crate of its own beside `crates/isel` and `crates/lpkf`, and `list.rs`
//! what the catalogue's list would be. The files' own tests run here too, with three families.

#![expect(clippy::unwrap_used, reason = "a test that finds nothing has failed")]
#![expect(unused_imports, reason = "the tests do not use all that the catalogue offers")]
#![expect(clippy::unit_arg, reason = "a cart shows nothing that others do not")]
#![expect(
    private_interfaces,
    reason = "the third family is not a crate whose types could be public"
)]

#[macro_use]
#[path = "../../src/families.rs"]
mod families;

#[path = "../../src/axes.rs"]
mod axes;
#[path = "../../src/controller.rs"]
mod controller;
#[path = "../../src/family.rs"]
mod family;
#[path = "../../src/handling.rs"]
mod handling;
#[path = "../../src/model.rs"]
mod model;
#[path = "../../src/names.rs"]
mod names;

mod cart;
mod list;

pub use axes::{all_names, axis};
pub use controller::Controller;
pub use handling::Handling;
pub use list::{Details, Family, Model, State};
pub use names::*;
pub use vimc4_device::{Effects, MemoryError};

use vimc4_device::{Device as _, Harness, Heard, Identity, Input, Question, Signal, Travel};

/// A cart that has just been switched on.
fn cart() -> Harness<Controller> {
    let model = model("cart").unwrap();
    Harness::new(bare(&model, &machine("bench").unwrap(), b"").unwrap())
}

#[test]
fn it_is_found_by_its_names() {
    assert_eq!(Family::ALL.map(Family::name), ["isel", "lpkf", "cart"]);
    assert!(models().contains(&"cart") && models().contains(&"imc4"));
    let built_in = model("cart").unwrap();
    assert_eq!(Model::from_toml(model_profile("cart").unwrap()), Ok(built_in.clone()));
    assert_eq!((built_in.family(), built_in.axis_names()), (Family::Cart, ["X"].as_slice()));
    assert_eq!(built_in.cart().map(|model| model.name.as_str()), Some("cart"));
    let wrong = Model::from_toml("command_set = \"wheels\"").unwrap_err();
    assert!(wrong.help.contains("\"rails\" (Cart & Sons)"), "{}", wrong.help);
}

#[test]
fn it_is_driven_as_the_others_are() {
    let mut cart = cart();
    assert_eq!(cart.ask(b"m5\r").unwrap(), b"0");
    assert_eq!(cart.ask(b"p\r").unwrap(), b"5");
    let now = cart.now();
    assert_eq!(cart.device().view(now).axes[0].position, 5);
    assert_eq!(cart.device().details(), Details::Cart(()));
    assert_eq!(cart.device().signals()[0].name, "stop");
    let known = |signal: &Signal| all_names().signals().iter().any(|any| any.name == signal.name);
    assert!(cart.device().signals().iter().all(known));
}

#[test]
fn its_state_can_be_kept_and_is_of_no_other_family() {
    let mut moved = cart();
    moved.ask(b"m5\r").unwrap();
    let state = moved.device().state();
    assert_eq!(state.family(), Family::Cart);
    let text = serde_json::to_string(&state).unwrap();
    let with = |state| {
        let mut other = bare(&model("cart").unwrap(), &machine("bench").unwrap(), b"").unwrap();
        other.restore(state);
        Harness::new(other)
    };
    let mut other = with(serde_json::from_str(&text).unwrap());
    assert_eq!(other.ask(b"p\r").unwrap(), b"5");

    let imc4 = bare(&model("imc4").unwrap(), &machine("bench").unwrap(), b"").unwrap();
    let other = with(imc4.state());
    assert_eq!(other.device().state().family(), Family::Cart);
    let memory = bare(&model("cart").unwrap(), &machine("bench").unwrap(), b"?");
    assert_eq!(memory.unwrap_err(), MemoryError::NoMemory);
}

#[test]
fn tools_know_of_it_what_it_tells_them() {
    let model = model("cart").unwrap();
    let handling = Handling::of(&model);
    let mut cart = cart();
    for line in handling.moving([7, 0, 0, 0, 0, 0], 1_000) {
        assert_eq!(cart.ask(format!("{line}\r").as_bytes()).unwrap(), handling.done);
    }
    let question = format!("{}\r", handling.position).into_bytes();
    let answer = cart.ask(&question).unwrap();
    assert_eq!(handling.hear(&question, &answer), Heard::Perhaps);
    assert_eq!(handling.read_position(&answer), Some(vec![7]));
    assert_eq!(handling.refusal(b"m5\r", b"stopped").as_deref(), Some("stopped"));
    assert_eq!(handling.stream(b"m5"), None);
    assert!(Family::Cart.effects_of(b"p\rm5\r").moves && !Family::Cart.effects_of(b"p\r").moves);
    assert_eq!(Family::Cart.travel_of(b"m5\r"), Travel::Relative);
    assert!(model.erasing(cart.device()).is_err());
}

#[test]
fn who_answers_is_told_by_each_family_for_itself() {
    let asked = |model: &Model, answer: &'static [u8]| {
        let ask = |_: Question| Ok::<_, ()>(answer.to_vec());
        Handling::of(model).identify(ask).unwrap()
    };
    let (cart, imc4) = (model("cart").unwrap(), model("imc4").unwrap());
    assert_eq!(asked(&cart, b"12"), Identity::Same("12".to_owned()));
    assert!(
        matches!(asked(&cart, b"E0D\r"), Identity::Foreign { what, .. } if what.contains("LPKF"))
    );
    assert!(
        matches!(asked(&imc4, b"stopped"), Identity::Foreign { what, .. } if what.contains("Cart"))
    );
}

/// The page that walks through all of this quotes the list, and leads to files that exist.
#[test]
fn the_page_about_it_is_true() {
    let page = include_str!("../../../../docs/adding-a-family.md");
    let quoted = page.split("```").nth(1).and_then(|block| block.split_once('\n')).unwrap().1;
    assert!(include_str!("list.rs").contains(quoted.trim_end()), "{quoted}");
    let docs = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
    let links: Vec<&str> =
        page.split("](").skip(1).filter_map(|rest| rest.split(')').next()).collect();
    assert!(links.len() > 5);
    for link in links {
        assert!(docs.join(link).exists(), "{link}");
    }
}
