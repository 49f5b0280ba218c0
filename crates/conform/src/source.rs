//! Where a behaviour is known from: the items of `source`, checked against the index of the
//! manuals' sections, and their value as evidence.
//!
//! A source is a list of items between semicolons. Each is a manual with sections of it, as
//! `99 2.2.14, E1`; headings of LPKF's catalogue, as `!CT, Zur Syntax der Befehle`; `field`; or
//! `assumed`. A remark may follow each after a colon. The index is `fixtures/manuals.toml`.

use std::fmt;
use std::sync::LazyLock;

use serde::Deserialize;
use vimc4_catalogue::Family;

/// The index of the manuals' sections: their numbers and titles, nothing else.
static MANUALS: LazyLock<Result<Vec<Manual>, String>> = LazyLock::new(|| {
    toml::from_str(vimc4_fixtures::MANUALS)
        .map(|index: Index| index.manual)
        .map_err(|error| format!("fixtures/manuals.toml: {}", error.message()))
});

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Index {
    manual: Vec<Manual>,
}

/// A manual that can be cited.
#[derive(Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Manual {
    /// The prefix of its sections; empty where sections are cited by themselves.
    #[serde(default)]
    cited_as: String,
    title: String,
    /// The models it describes.
    #[serde(default)]
    models: Vec<String>,
    /// Whether its sections are cited by their numbers, which are then their first words, or by
    /// their titles.
    numbered: bool,
    sections: Vec<String>,
}

impl Manual {
    fn has(&self, section: &str) -> bool {
        let cited = |entry: &String| match entry.split_once(' ') {
            Some((number, _)) if self.numbered => number == section,
            _ => entry == section,
        };
        self.sections.iter().any(cited)
    }

    /// The first section inside this one, by its number. A chapter that has sections says nothing
    /// that could be looked up.
    fn first_inside(&self, section: &str) -> Option<&str> {
        let numbers = self.sections.iter().filter_map(|entry| entry.split(' ').next());
        numbers
            .filter(|_| self.numbered)
            .find(|number| number.strip_prefix(section).is_some_and(|rest| rest.starts_with('.')))
    }

    fn describes(&self, model: &str) -> bool {
        self.models.iter().any(|name| name == model)
    }
}

/// The built-in models of a family that some manual describes. The others are known from the field.
#[must_use]
pub fn with_manual(family: Family) -> Vec<&'static str> {
    let described = |model: &&str| {
        MANUALS.as_ref().is_ok_and(|manuals| manuals.iter().any(|manual| manual.describes(model)))
    };
    family.models().into_iter().filter(described).collect()
}

/// Where a behaviour is known from. It cites nothing that does not exist.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    text: String,
    evidence: Evidence,
    manuals: Vec<&'static Manual>,
}

/// The value of a source as evidence; at least one is set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Evidence {
    /// A manual says so.
    pub documented: bool,
    /// Host software in daily use depends on it.
    pub field: bool,
    /// No source says so; it was chosen.
    pub assumed: bool,
}

impl Source {
    /// Reads a source and the marks beside it, which must match its value as evidence.
    ///
    /// # Errors
    ///
    /// What is wrong, in words: a section that does not exist, an invalid item, or a mark that the
    /// source does not support.
    pub fn parse(text: &str, marks: &str) -> Result<Source, String> {
        let marks_read = Evidence::parse(marks)
            .ok_or("no evidence mark; D, F, A or several as in \"D+F\" are")?;
        let manuals = MANUALS.as_ref().map_err(Clone::clone)?;
        let mut evidence = Evidence::default();
        let mut cited_manuals = Vec::new();
        for item in text.split(';').map(str::trim) {
            let what = item.split_once(':').map_or(item, |(what, _remark)| what.trim());
            match what {
                "field" => evidence.field = true,
                "assumed" => evidence.assumed = true,
                _ => {
                    evidence.documented = true;
                    cited_manuals.push(cited(manuals, what)?);
                }
            }
        }
        if evidence != marks_read {
            return Err(format!(
                "evidence = {marks:?} and source = {text:?} do not agree, which is worth \
                 \"{evidence}\": D has a section of a manual, F has `field`, A has `assumed`"
            ));
        }
        Ok(Source { text: text.to_owned(), evidence, manuals: cited_manuals })
    }

    /// Its value as evidence.
    #[must_use]
    pub fn evidence(&self) -> Evidence {
        self.evidence
    }

    /// Whether it cites the section in each of isel's manuals that it cites, by the name of the manual
    /// and the section.
    #[must_use]
    pub fn cites_wherever(&self, sections: &[(&str, &str)]) -> bool {
        self.items().all(|item| {
            let (manual, cited) = item.split_once(' ').unwrap_or((item, ""));
            let wanted = sections.iter().find(|(name, _)| *name == manual);
            wanted.is_none_or(|(_, section)| cited.split(',').any(|one| one.trim() == *section))
        })
    }

    /// Its items, without their remarks.
    fn items(&self) -> impl Iterator<Item = &str> {
        self.text.split(';').map(|item| item.split(':').next().unwrap_or(item).trim())
    }

    /// Whether it is a source for what these models do: every manual that it cites must describe
    /// one of them, and where nothing but manuals is cited, one of these must describe each.
    ///
    /// # Errors
    ///
    /// What is wrong, in words.
    pub fn is_about(&self, models: &[&str]) -> Result<(), String> {
        if let Some(foreign) =
            self.manuals.iter().find(|manual| !models.iter().any(|model| manual.describes(model)))
        {
            return Err(format!(
                "the manual {:?} ({}) describes none of its models; leave it out, or say after \
                 `assumed:` that they are taken to do the same",
                foreign.cited_as, foreign.title
            ));
        }
        let described = |model: &&&str| self.manuals.iter().any(|manual| manual.describes(model));
        match models.iter().find(|model| !described(model)) {
            Some(model) if !self.evidence.field && !self.evidence.assumed => Err(format!(
                "no manual of {model} is cited; cite it, or say after `assumed:` what is taken to \
                 hold for it, and mark that with A"
            )),
            _ => Ok(()),
        }
    }
}

/// The manual of an item, whose sections all exist.
fn cited(manuals: &'static [Manual], what: &str) -> Result<&'static Manual, String> {
    let by_name = || {
        let (name, rest) = what.split_once(' ')?;
        let manual = manuals.iter().find(|manual| manual.cited_as == name)?;
        Some((manual, rest))
    };
    let by_heading = || manuals.iter().find(|manual| manual.cited_as.is_empty());
    let (manual, sections) =
        by_name().or_else(|| Some((by_heading()?, what))).ok_or("no manual can be cited")?;
    let mut sections = sections.split(',').map(str::trim);
    if let Some((chapter, inside)) =
        sections.clone().find_map(|chapter| Some((chapter, manual.first_inside(chapter)?)))
    {
        return Err(format!(
            "{chapter:?} of the manual {:?} ({}) is a chapter with sections; cite the section that \
             says it, such as {inside:?}",
            manual.cited_as, manual.title,
        ));
    }
    let unknown = sections.find(|section| !manual.has(section));
    let Some(unknown) = unknown else { return Ok(manual) };
    let names: Vec<&str> = manuals.iter().map(|manual| manual.cited_as.as_str()).collect();
    Err(format!(
        "no section {unknown:?} in the manual {:?} ({}). An item of `source` is `field`, \
         `assumed`, or {} with sections that fixtures/manuals.toml lists, or headings of LPKF's; \
         a remark follows a colon",
        manual.cited_as,
        manual.title,
        names.join(" ").trim(),
    ))
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Evidence {
    fn parse(text: &str) -> Option<Evidence> {
        let mut evidence = Evidence::default();
        for mark in text.split('+') {
            match mark.trim() {
                "D" => evidence.documented = true,
                "F" => evidence.field = true,
                "A" => evidence.assumed = true,
                _ => return None,
            }
        }
        Some(evidence)
    }
}

impl fmt::Display for Evidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let marks = [(self.documented, "D"), (self.field, "F"), (self.assumed, "A")];
        let marks: Vec<&str> = marks.iter().filter(|(set, _)| *set).map(|(_, m)| *m).collect();
        f.write_str(&marks.join("+"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_index_is_sound() {
        let manuals = MANUALS.as_ref().unwrap();
        for manual in manuals {
            for section in &manual.sections {
                let twice = manual.sections.iter().filter(|other| *other == section).count();
                assert_eq!(twice, 1, "{} {section}", manual.cited_as);
                let number = section.split(' ').next().unwrap();
                let digits = number.chars().filter(|c| !"ABCDE".contains(*c));
                let is_number = digits.clone().all(|c| c == '.' || c.is_ascii_digit());
                assert!(!manual.numbered || is_number, "{} {section}", manual.cited_as);
            }
        }
        let named = |name: &str| manuals.iter().filter(|manual| manual.cited_as == name).count();
        assert!(manuals.iter().all(|manual| named(&manual.cited_as) == 1));
        for model in vimc4_catalogue::models() {
            let described = manuals.iter().any(|manual| manual.describes(model));
            let title = vimc4_catalogue::model(model).unwrap().title().to_owned();
            let admits = title.ends_with("from field evidence, no manual");
            assert!(
                described != admits,
                "{model} has a manual, or its title says why not: {title}"
            );
        }
    }

    #[test]
    fn what_exists_is_cited() {
        let source = Source::parse("99 2.2.14, B3.10; assumed: the rest", "D+A").unwrap();
        assert_eq!(source.evidence().to_string(), "D+A");
        assert_eq!(source.to_string(), "99 2.2.14, B3.10; assumed: the rest");
        Source::parse("!CT, Zur Syntax der Befehle; field", "D+F").unwrap();
        Source::parse("98 Time delay, Bore: in um", "D").unwrap();
        Source::parse("assumed", "A").unwrap();
    }

    #[test]
    fn what_does_not_exist_is_no_source() {
        let wrong = |text, marks| Source::parse(text, marks).unwrap_err();
        assert!(wrong("12 2.2.32", "D").starts_with("no section \"2.2.32\" in the manual \"12\""));
        assert!(wrong("99 2.2.13, 9", "D").starts_with("no section \"9\""));
        assert!(wrong("!XY", "D").starts_with("no section \"!XY\""));
        assert!(wrong("a colleague", "D").starts_with("no section \"a colleague\""));
        assert!(wrong("98 Boring", "D").starts_with("no section \"Boring\""));
        assert!(wrong("", "D").starts_with("no section \"\""));
    }

    #[test]
    fn a_chapter_with_sections_is_no_source() {
        let wrong = |text| Source::parse(text, "D").unwrap_err();
        assert_eq!(
            wrong("99 3.1, 3"),
            "\"3\" of the manual \"99\" (isel, IMC4, manual of 1999) is a chapter with sections; cite \
             the section that says it, such as \"3.1\""
        );
        for (chapter, inside) in [("12 4.2", "4.2.1"), ("99 B3", "B3.1"), ("05 2.3: D", "2.3.1")] {
            assert!(wrong(chapter).ends_with(&format!("such as {inside:?}")), "{chapter}");
        }
        for whole in ["99 4", "12 1, 5", "05 6", "98 Bore"] {
            Source::parse(whole, "D").unwrap();
        }
    }

    #[test]
    fn a_section_is_looked_for_in_every_manual() {
        let codes = [("99", "4"), ("12", "5")];
        let cites = |text, marks| Source::parse(text, marks).unwrap().cites_wherever(&codes);
        assert!(cites("99 2.2.13, 4; 12 5: the code; field", "D+F"));
        assert!(!cites("99 4; 12 2.2.3", "D"));
    }

    #[test]
    fn a_mark_must_be_borne_out() {
        let wrong = |text, marks| Source::parse(text, marks).unwrap_err();
        assert!(wrong("assumed", "D").contains("do not agree"));
        assert!(wrong("99 2.2.13; assumed", "D").contains("worth \"D+A\""));
        assert!(wrong("field", "F+A").contains("worth \"F\""));
        assert!(wrong("field", "X").contains("no evidence mark"));
    }

    #[test]
    fn documented_needs_the_manual_of_every_model_and_no_other() {
        let source = Source::parse("99 2.2.13; 12 2.2.3", "D").unwrap();
        source.is_about(&["imc4", "imc-m"]).unwrap();
        let error = source.is_about(&["imc4", "imc4-m", "imc-m"]).unwrap_err();
        assert!(error.starts_with("no manual of imc4-m is cited"), "{error}");
        let error = source.is_about(&["imc4"]).unwrap_err();
        assert!(error.starts_with("the manual \"12\""), "{error}");
        let assumed = Source::parse("99 2.2.13; assumed: the others", "D+A").unwrap();
        assumed.is_about(&["imc4", "imc4-m"]).unwrap();
    }
}
