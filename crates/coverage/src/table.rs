//! Coverage for people: a table, and sentences about what is missing.

use std::fmt::Write as _;

use crate::coverage::{Command, Coverage, Point, Total};

impl Command {
    /// Its mnemonic, or what stands for it where it has none.
    pub(crate) fn name(&self) -> &str {
        if self.mnemonic.is_empty() { "unasked" } else { &self.mnemonic }
    }
}

impl Point {
    /// It in one line.
    pub(crate) fn in_words(&self) -> String {
        if self.about.is_empty() {
            self.name.clone()
        } else {
            format!("{}, {}", self.name, self.about)
        }
    }
}

impl Coverage {
    /// A line for each form of a command: how many of its answers, states and causes of a stop were met,
    /// out of how many. `-` where none is possible.
    #[must_use]
    pub fn table(&self) -> String {
        let totals = self.totals();
        let mut rows = vec![["", "", "answers", "states", "stops"].map(str::to_owned)];
        for command in &self.commands {
            let of = |points: &[Point]| share(Total::of(points));
            rows.push([
                command.name().to_owned(),
                command.title.clone(),
                of(&command.answers),
                of(&command.states),
                of(&command.stops),
            ]);
        }
        let all = [totals.answers, totals.states, totals.stops].map(share);
        let [answers, states, stops] = all;
        let Total { met, possible } = totals.commands;
        rows.push(["all".to_owned(), format!("{met} of {possible} sent"), answers, states, stops]);
        let widths: [usize; 5] = std::array::from_fn(|column| {
            rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0)
        });
        let mut table = String::new();
        for [name, title, answers, states, stops] in rows {
            let [a, b, c, d, e] = widths;
            // Writing to a string cannot fail.
            let _ = writeln!(
                table,
                "{name:<a$}  {title:<b$}  {answers:>c$}  {states:>d$}  {stops:>e$}"
            );
        }
        table
    }

    /// What was never met, in sentences: first the commands that were never sent, then what is missing of
    /// those that were.
    #[must_use]
    pub fn missing(&self) -> Vec<String> {
        let never = self.commands.iter().filter(|c| !c.is_met() && c.is_sent());
        let never: Vec<String> =
            never.map(|command| format!("`{}` ({})", command.name(), command.title)).collect();
        let mut sentences = Vec::new();
        if !never.is_empty() {
            sentences.push(format!("You never sent {}.", never.join(", ")));
        }
        // What is missing of several commands alike is said once.
        let mut alike: Vec<(String, Vec<&str>)> = Vec::new();
        for command in self.commands.iter().filter(|c| c.is_met() || !c.is_sent()) {
            for what in command.missing() {
                match alike.iter_mut().find(|(said, _)| *said == what) {
                    Some((_, commands)) => commands.push(command.name()),
                    None => alike.push((what, vec![command.name()])),
                }
            }
        }
        sentences.extend(alike.into_iter().map(|(what, commands)| {
            let commands: Vec<String> = commands.iter().map(|name| format!("`{name}`")).collect();
            format!("{}: {what}.", commands.join(", "))
        }));
        sentences
    }
}

impl Command {
    /// Whether a host sends it: not what comes unasked.
    fn is_sent(&self) -> bool {
        !self.mnemonic.is_empty()
    }

    /// What of it was never met, as ends of sentences.
    fn missing(&self) -> Vec<String> {
        let mut missing = Vec::new();
        let answers = unmet(&self.answers).map(|p| format!("`{}` ({})", p.name, p.about));
        let answers: Vec<String> = answers.collect();
        if !answers.is_empty() {
            missing.push(format!("you never met {}", answers.join(", ")));
        }
        let states: Vec<String> =
            unmet(&self.states).map(|state| format!("\u{201c}{}\u{201d}", state.name)).collect();
        if !states.is_empty() {
            missing.push(format!("you never met it in {}", states.join(", ")));
        }
        // What stops it, during one thing after the other; what is alike is said once.
        let mut during: Vec<(&str, Vec<&str>)> = Vec::new();
        for point in unmet(&self.stops) {
            match during.iter_mut().find(|(state, _)| *state == point.about) {
                Some((_, causes)) => causes.push(&point.name),
                None => during.push((&point.about, vec![&point.name])),
            }
        }
        let mut alike: Vec<(Vec<&str>, Vec<String>)> = Vec::new();
        for (state, causes) in during {
            let state = format!("\u{201c}{state}\u{201d}");
            match alike.iter_mut().find(|(same, _)| *same == causes) {
                Some((_, states)) => states.push(state),
                None => alike.push((causes, vec![state])),
            }
        }
        missing.extend(alike.into_iter().map(|(causes, states)| {
            format!("during {} you never met {}", states.join(", "), causes.join(", "))
        }));
        missing
    }
}

fn unmet(points: &[Point]) -> impl Iterator<Item = &Point> {
    points.iter().filter(|point| point.met == 0)
}

/// `3/14`, or `-` where nothing is possible.
fn share(Total { met, possible }: Total) -> String {
    if possible == 0 { "-".to_owned() } else { format!("{met}/{possible}") }
}
