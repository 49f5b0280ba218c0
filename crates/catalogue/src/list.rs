//! The list of families. Everything that exists once per family is made from it.

families! { ($)
    /// isel: commands that begin with `@`, and a memory for a program.
    Isel, isel = vimc4_isel;
    /// LPKF: a stream of HPGL commands.
    #[cfg(feature = "lpkf")]
    Lpkf, lpkf = vimc4_lpkf;
}
