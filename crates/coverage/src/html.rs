//! Coverage as a page of HTML that needs nothing else.

use std::fmt::Write as _;

use crate::coverage::{Command, Coverage, Point, Total};

const STYLE: &str = "\
body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:64rem;padding:0 1rem;color:#222}\
table{border-collapse:collapse}th,td{text-align:left;padding:.15rem .8rem .15rem 0}\
td.n{text-align:right;font-variant-numeric:tabular-nums}\
summary{cursor:pointer;padding:.3rem .5rem;border-left:.4rem solid #c33}\
summary.all{border-color:#2a7}summary.some{border-color:#d92}\
summary code{font-weight:bold}summary .n{float:right;color:#555}\
details{border-bottom:1px solid #ddd}details table{margin:.3rem 0 .8rem 1.5rem}\
tr.no td{color:#b00}tr.no td.n{font-weight:bold}.kind{color:#777}\
@media(prefers-color-scheme:dark){body{background:#181818;color:#ddd}details{border-color:#333}\
tr.no td{color:#f77}summary .n,.kind{color:#999}}";

impl Coverage {
    /// As a page: how much was met, what was not in sentences, and every command with its points.
    #[must_use]
    pub fn html(&self) -> String {
        let model = escape(&self.model);
        let mut page = format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta name=\"viewport\" content=\"width=device-width\">\
             <title>Protocol coverage: {model}</title><style>{STYLE}</style></head><body>\n\
             <h1>Protocol coverage: {model}</h1>\n<table><tr><th></th><th>met</th><th>possible</th><th></th></tr>\n"
        );
        let totals = self.totals();
        for (what, total) in [
            ("commands", totals.commands),
            ("answers", totals.answers),
            ("states", totals.states),
            ("stops", totals.stops),
        ] {
            let Total { met, possible } = total;
            // Writing to a string cannot fail.
            let _ = writeln!(
                page,
                "<tr><td>{what}</td><td class=\"n\">{met}</td><td class=\"n\">{possible}</td>\
                 <td class=\"n\">{:.1} %</td></tr>",
                total.percent()
            );
        }
        page.push_str("</table>\n<h2>Commands</h2>\n");
        for command in &self.commands {
            add(&mut page, command);
        }
        page.push_str("<h2>Never met</h2>\n<ul>\n");
        for sentence in self.missing() {
            let _ = writeln!(page, "<li>{}</li>", in_code(&sentence));
        }
        page.push_str("</ul>\n</body></html>\n");
        page
    }
}

fn add(page: &mut String, command: &Command) {
    let total = Total::of(command.points());
    let Total { met, possible } = total;
    let class = match met {
        0 => "none",
        _ if met == possible => "all",
        _ => "some",
    };
    // Some rows are in no section of a manual.
    let section = match command.section.as_str() {
        "" => String::new(),
        section => format!("<span class=\"kind\">{}</span>", escape(section)),
    };
    let _ = writeln!(
        page,
        "<details><summary class=\"{class}\"><code>{}</code> {} {section}\
         <span class=\"n\">{met} of {possible}</span></summary><table>",
        escape(command.name()),
        escape(&command.title),
    );
    let kinds =
        [("answer", &command.answers), ("state", &command.states), ("stop", &command.stops)];
    for (kind, points) in kinds {
        for point in points {
            let Point { name, about, met } = point;
            let row = if *met == 0 { " class=\"no\"" } else { "" };
            let _ = writeln!(
                page,
                "<tr{row}><td class=\"kind\">{kind}</td><td>{}</td><td>{}</td>\
                 <td class=\"n\">{met}</td></tr>",
                escape(name),
                escape(about),
            );
        }
    }
    page.push_str("</table></details>\n");
}

/// What stands between backquotes becomes code.
fn in_code(sentence: &str) -> String {
    let parts = sentence.split('`').enumerate().map(|(number, part)| match number % 2 {
        0 => escape(part),
        _ => format!("<code>{}</code>", escape(part)),
    });
    parts.collect()
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
