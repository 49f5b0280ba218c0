//! Files that pages link to and that are no pages: a browser shows them as text, and folders as lists. The
//! site is whole without any repository that can be browsed.

use crate::paths::escape;

const STYLE: &str = "\
body{margin:2rem auto;max-width:60rem;padding:0 1rem;font:16px/1.5 system-ui,sans-serif}\
pre{font:14px/1.5 ui-monospace,monospace;overflow-x:auto}\
:root{color-scheme:light dark}";

/// A text file as a page.
pub(crate) fn file(path: &str, text: &str) -> String {
    let name = path.rsplit('/').next().unwrap_or(path);
    let up = "../".repeat(path.matches('/').count());
    page(
        path,
        &format!(
            "<p><a href=\"{up}index.html\">virtual IMC4</a>: <code>{}</code>, <a href=\"{}\" download>as a \
             file</a></p>\n<pre>{}</pre>\n",
            escape(path),
            escape(name),
            escape(text)
        ),
    )
}

/// A folder as a page: each file as it is named in it, and what to open.
pub(crate) fn folder(path: &str, files: &[(String, String)]) -> String {
    let up = "../".repeat(path.matches('/').count() + 1);
    let items = files.iter().map(|(name, link)| {
        format!("<li><a href=\"{}\">{}</a></li>\n", escape(link), escape(name))
    });
    page(
        path,
        &format!(
            "<p><a href=\"{up}index.html\">virtual IMC4</a>: <code>{}</code></p>\n<ul>\n{}</ul>\n",
            escape(path),
            items.collect::<String>()
        ),
    )
}

fn page(title: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width\"><title>{}</title><style>{STYLE}</style>\
         </head><body>\n{body}</body></html>\n",
        escape(title)
    )
}
