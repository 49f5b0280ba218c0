//! Coverage in the format of lcov, over a text of the command tables.

use std::fmt::Write as _;

use crate::coverage::Coverage;

/// Coverage for viewers of the coverage of sources: a text with a line for each point, and what says
/// how often each line was met.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lcov {
    /// The text of the tables.
    pub source: String,
    /// The tracefile of lcov, which names the text.
    pub tracefile: String,
}

impl Coverage {
    /// As a tracefile of lcov. Commands are its functions, answers, states and stops its lines. `path` is
    /// where the text of the tables will be.
    #[must_use]
    pub fn lcov(&self, path: &str) -> Lcov {
        let mut source = format!("What a controller of the model {} can do.\n", self.model);
        let (mut functions, mut lines) = (String::new(), String::new());
        let (mut number, mut hit) = (1_u32, [0_u32; 2]);
        let mut covered = |source: &mut String, text: &str, met: u64| {
            number += 1;
            source.push_str(text);
            source.push('\n');
            // Writing to a string cannot fail.
            let _ = writeln!(lines, "DA:{number},{met}");
            hit[0] += 1;
            hit[1] += u32::from(met > 0);
            number
        };
        let mut called = 0;
        for command in &self.commands {
            let (name, times) = (command.name(), command.times());
            let section = match command.section.as_str() {
                "" => String::new(),
                section => format!(" ({section})"),
            };
            let header = format!("{name}: {}{section}", command.title);
            let line = covered(&mut source, &header, times);
            let _ = writeln!(functions, "FN:{line},{name}\nFNDA:{times},{name}");
            called += u32::from(times > 0);
            let kinds = [
                ("answer", &command.answers),
                ("state", &command.states),
                ("stop", &command.stops),
            ];
            for (kind, points) in kinds {
                for point in points {
                    covered(&mut source, &format!("    {kind} {}", point.in_words()), point.met);
                }
            }
        }
        let [found, met] = hit;
        let functions_found = self.commands.len();
        let tracefile = format!(
            "TN:vimc4\nSF:{path}\n{functions}FNF:{functions_found}\nFNH:{called}\n{lines}LF:{found}\n\
             LH:{met}\nend_of_record\n"
        );
        Lcov { source, tracefile }
    }
}
