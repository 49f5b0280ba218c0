//! The list of families with a third.

use crate::cart as vimc4_cart;

families! { ($)
    /// isel: commands that begin with `@`, and a memory for a program.
    Isel, isel = vimc4_isel;
    /// LPKF: a stream of HPGL commands.
    Lpkf, lpkf = vimc4_lpkf;
    /// Carts on rails.
    Cart, cart = vimc4_cart;
}
