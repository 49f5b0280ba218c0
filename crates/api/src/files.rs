//! The files of the panel, which are part of the program. `web/` has their sources, and makes them.

/// Each file: where it is asked for, its type, and what is in it.
pub(crate) static FILES: &[(&str, &str, &[u8])] = &[
    ("/", "text/html; charset=utf-8", include_bytes!("../web/dist/index.html")),
    ("/panel.js", "text/javascript; charset=utf-8", include_bytes!("../web/dist/panel.js")),
    ("/panel.css", "text/css; charset=utf-8", include_bytes!("../web/dist/panel.css")),
    ("/icon.svg", "image/svg+xml", include_bytes!("../web/dist/icon.svg")),
    ("/licences.txt", "text/plain; charset=utf-8", include_bytes!("../web/dist/licences.txt")),
];
