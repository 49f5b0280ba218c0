//! Diagrams, which documents have as text, as pictures: no script draws them when the page is read.

use crate::Outcome;

/// A mermaid diagram as a figure of HTML.
pub(crate) fn figure(text: &str) -> Outcome<String> {
    let svg = mermaid_rs_renderer::render(text).map_err(|error| format!("a diagram: {error}"))?;
    // In Markdown a block of HTML ends with an empty line.
    let svg: String =
        svg.lines().filter(|line| !line.trim().is_empty()).collect::<Vec<_>>().join("\n");
    Ok(format!("<figure class=\"diagram\">{svg}</figure>\n"))
}
