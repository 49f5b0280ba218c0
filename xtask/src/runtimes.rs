//! What the program is linked with that is no crate, and the texts of licences that crates lack.

/// The standard library or a runtime.
pub(crate) struct Runtime {
    /// With whose it is.
    pub(crate) name: &'static str,
    /// As SPDX writes it.
    pub(crate) licence: &'static str,
    /// The whole texts.
    pub(crate) texts: &'static [&'static str],
    /// What the targets have in their names that are linked with it.
    target: &'static str,
}

const APACHE: &str = include_str!("../../LICENSE-APACHE");

const RUNTIMES: [Runtime; 5] = [
    Runtime {
        name: "standard library of Rust",
        licence: "MIT OR Apache-2.0",
        texts: &[include_str!("../licences/Rust.txt"), APACHE],
        target: "",
    },
    Runtime {
        name: "musl",
        licence: "MIT",
        texts: &[include_str!("../licences/musl.txt")],
        target: "-linux-musl",
    },
    Runtime {
        name: "libunwind of LLVM",
        licence: "Apache-2.0 WITH LLVM-exception",
        texts: &[include_str!("../licences/libunwind.txt")],
        target: "-linux-musl",
    },
    Runtime {
        name: "runtime of MinGW-w64",
        licence: "ZPL-2.1, and what else stands in its text",
        texts: &[include_str!("../licences/MinGW-w64.txt")],
        target: "-windows-gnu",
    },
    Runtime {
        name: "runtime of GCC",
        licence: "GPL-3.0-or-later WITH GCC-exception-3.1",
        texts: &[
            include_str!("../licences/GCC-exception-3.1.txt"),
            include_str!("../licences/GPL-3.0.txt"),
        ],
        target: "-windows-gnu",
    },
];

/// What the program for a target is linked with.
pub(crate) fn linked(target: &str) -> impl Iterator<Item = &'static Runtime> {
    RUNTIMES.iter().filter(move |runtime| target.contains(runtime.target))
}

/// The whole text of a licence for crates that have none, or only a notice that refers to it.
pub(crate) fn referred_to(licence: &str) -> Option<&'static str> {
    let texts = [
        ("MPL-2.0", include_str!("../licences/MPL-2.0.txt")),
        ("BSL-1.0", include_str!("../licences/BSL-1.0.txt")),
        ("Apache-2.0", APACHE),
    ];
    texts.into_iter().find(|(name, _)| licence.contains(name)).map(|(_, text)| text)
}
