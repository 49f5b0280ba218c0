//! The pages of the commands: one for each family, with every command of every model, what it can be
//! answered, and the sessions that show it.

use std::fmt::Write as _;

use vimc4_catalogue::Family;
use vimc4_coverage::Coverage;

use crate::Outcome;
use crate::book::Chapter;
use crate::paths::escape;
use crate::sessions::Played;

/// So many sessions are shown with a command at once.
const SHOWN: usize = 8;

pub(crate) fn families() -> impl Iterator<Item = Family> {
    Family::ALL.into_iter()
}

/// A form of a command, as the models of a family know it.
struct Form<'c> {
    mnemonic: &'c str,
    title: &'c str,
    /// The models that know it, in the order of all.
    models: Vec<&'c str>,
    /// Its answers: the code and what it means, and on which models.
    answers: Vec<((&'c str, &'c str), Vec<&'c str>)>,
}

/// The page of a family.
pub(crate) fn page(family: Family, played: &[Played]) -> Outcome<Chapter> {
    let names = family.models();
    let tables = tables(family)?;
    let forms = forms(&tables);
    let sessions: Vec<&Played> = played.iter().filter(|it| it.family() == family).collect();
    let mut text = format!(
        "# Commands of {family}'s controllers\n\nEvery form of every command that a model knows, what it can \
         be answered, and the sessions that show it. Open a session to see it line by line: what is sent, what \
         comes, when, and where the axes are then. **Play** goes through it line by line.\n\n\
         The letters D, F and A say how sure a behaviour is: documented, relied upon in the field, assumed; \
         [Behaviour and its evidence](behaviour.md) has all behaviours in one table.\n\n"
    );
    table(&mut text, &forms, &names, &sessions);
    for form in &forms {
        describe(&mut text, form, &names, &sessions);
    }
    Ok(Chapter {
        path: format!("docs/commands-{}.md", family.name()),
        title: format!("Commands of {family}'s controllers"),
        depth: 0,
        text: Some(text),
    })
}

/// What each model of a family can do.
fn tables(family: Family) -> Outcome<Vec<(&'static str, Coverage)>> {
    let models = family.models().into_iter().map(|name| {
        let model = vimc4_catalogue::model(name).map_err(|error| error.to_string())?;
        Ok((name, Coverage::of(&model)))
    });
    models.collect()
}

/// The forms that any of the models has, in the order of their tables.
fn forms<'c>(tables: &'c [(&'c str, Coverage)]) -> Vec<Form<'c>> {
    let mut forms: Vec<Form<'_>> = Vec::new();
    for (model, coverage) in tables {
        for command in coverage.commands.iter().filter(|command| !command.mnemonic.is_empty()) {
            let at = forms.iter().position(|form| form.mnemonic == command.mnemonic);
            let at = at.unwrap_or_else(|| {
                forms.push(Form {
                    mnemonic: &command.mnemonic,
                    title: &command.title,
                    models: vec![],
                    answers: vec![],
                });
                forms.len() - 1
            });
            let Some(form) = forms.get_mut(at) else { continue };
            form.models.push(model);
            for answer in &command.answers {
                let key = (answer.name.as_str(), answer.about.as_str());
                match form.answers.iter_mut().find(|(known, _)| *known == key) {
                    Some((_, models)) => models.push(model),
                    None => form.answers.push((key, vec![model])),
                }
            }
        }
    }
    forms
}

/// All of them at a glance.
fn table(text: &mut String, forms: &[Form<'_>], names: &[&str], sessions: &[&Played]) {
    let _ = writeln!(text, "| command | | models | sessions |\n|---|---|---|---:|");
    for form in forms {
        let shown = sessions.iter().filter(|it| it.commands.contains_key(form.mnemonic)).count();
        let _ = writeln!(
            text,
            "| [`{}`](#{}) | {} | {} | {shown} |",
            form.mnemonic.replace('|', "\\|"),
            anchor(form.mnemonic),
            form.title.replace('|', "\\|"),
            of(&form.models, names),
        );
    }
}

/// One of them.
fn describe(text: &mut String, form: &Form<'_>, names: &[&str], sessions: &[&Played]) {
    let Form { mnemonic, title, models, answers } = form;
    let _ = writeln!(
        text,
        "\n## `{mnemonic}` {title} {{#{}}}\n\nModels: {}.\n",
        anchor(mnemonic),
        of(models, names)
    );
    if !answers.is_empty() {
        let _ = writeln!(text, "| answer | | models |\n|---|---|---|");
        for ((code, about), on) in answers {
            let _ =
                writeln!(text, "| `{code}` | {} | {} |", about.replace('|', "\\|"), of(on, names));
        }
        text.push('\n');
    }
    let mut shown: Vec<&&Played> =
        sessions.iter().filter(|it| it.commands.contains_key(*mnemonic)).collect();
    // The fewer commands a session has, the more it says about each.
    shown.sort_by_key(|it| (it.commands.len(), &it.session.id));
    let missing: Vec<&str> = models
        .iter()
        .filter(|model| !shown.iter().any(|it| it.commands[*mnemonic].contains(**model)))
        .copied()
        .collect();
    if !missing.is_empty() {
        let _ = writeln!(text, "No session shows it on {}.\n", missing.join(", "));
    }
    let (first, others) = shown.split_at(shown.len().min(SHOWN));
    for played in first {
        session(text, played, mnemonic, names);
    }
    if !others.is_empty() {
        let _ =
            writeln!(text, "<details><summary>{} more in which it is used</summary>", others.len());
        for played in others {
            session(text, played, mnemonic, names);
        }
        text.push_str("</details>\n");
    }
}

/// A session, closed. Opened it is read from its file, and without scripts that is a link.
fn session(text: &mut String, played: &Played, mnemonic: &str, names: &[&str]) {
    let on: Vec<&str> = played.commands[mnemonic].iter().copied().collect();
    let on: Vec<&str> = names.iter().filter(|name| on.contains(name)).copied().collect();
    let _ = writeln!(
        text,
        "<details class=\"session\" data-id=\"{}\"><summary>{} <small>{} · {}</small></summary>\
         <a href=\"../fixtures/sessions/{}.toml.html\">The session</a></details>",
        escape(&played.session.id),
        escape(&played.session.title),
        of(&on, names),
        played.session.source.evidence(),
        escape(played.file()),
    );
}

/// Models, in as few words as they have.
fn of(models: &[&str], all: &[&str]) -> String {
    if models == all { "all".to_owned() } else { models.join(", ") }
}

/// The place of a command on its page: letters and digits as they are, others by number.
fn anchor(mnemonic: &str) -> String {
    let mut text = "command-".to_owned();
    for letter in mnemonic.chars() {
        match letter {
            'a'..='z' | '0'..='9' => text.push(letter),
            // Small and capital letters are different commands.
            'A'..='Z' => text.push(letter),
            other => drop(write!(text, "-{:x}", u32::from(other))),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use super::*;

    #[test]
    fn every_command_has_a_place_of_its_own() -> Outcome<()> {
        for family in families() {
            let tables = tables(family)?;
            let forms = forms(&tables);
            let anchors: BTreeSet<String> =
                forms.iter().map(|form| anchor(form.mnemonic)).collect();
            assert_eq!(anchors.len(), forms.len());
            let known: BTreeMap<&str, usize> =
                forms.iter().map(|form| (form.mnemonic, form.models.len())).collect();
            for (model, table) in &tables {
                let mut own = table.commands.iter().filter(|command| !command.mnemonic.is_empty());
                assert!(own.all(|command| known[command.mnemonic.as_str()] > 0), "{model}");
            }
        }
        Ok(())
    }
}
