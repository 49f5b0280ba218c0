//! The examples of the crates run to their ends.

#[path = "../../crates/catalogue/examples/ask.rs"]
mod ask;
#[path = "../../crates/ncp/examples/commands_of_a_job.rs"]
mod commands_of_a_job;
#[path = "../../crates/device/examples/lamp.rs"]
mod lamp;
#[path = "../../crates/vimc4/examples/stop_in_a_move.rs"]
mod stop_in_a_move;
#[path = "../../crates/isel/examples/virtual_time.rs"]
mod virtual_time;

/// A test for each.
macro_rules! run {
    ($($name:ident),*) => {$(
        #[test]
        fn $name() {
            if let Err(error) = crate::$name::main() {
                panic!("{error}");
            }
        }
    )*};
}

mod run {
    run!(ask, commands_of_a_job, lamp, stop_in_a_move, virtual_time);
}
