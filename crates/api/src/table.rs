//! What answers each of the routes.

use crate::acts::*;
use crate::call::{Call, Coming};
use crate::expecting::{check, expectation, expectations, give_up, so_far, wait_until_met, watch};

macro_rules! runs {
    ($($method:ident $path:literal $query:ident $body:ident $answer:literal $run:ident $about:literal;)+) => {
        /// In the order of the table.
        pub(crate) static RUNS: &[fn(Call) -> Coming] = &[$(|call| Box::pin($run(call))),+];
    };
}

vimc4_answers::routes!(runs);
