//! Setting breakpoints.

use serde_json::{Value, json};

use crate::arguments::{
    DataBreakpointInfo, Lines, SetBreakpoints, SetDataBreakpoints, SetExceptionBreakpoints,
    SetFunctionBreakpoints, SourceName, With,
};
use crate::message::Refusal;
use crate::points::{Point, Spot, Told};
use crate::state::{Answered, MOST_SOURCES, Session, answer};

/// The one filter of exceptions.
pub(crate) const ERRORS: &str = "errors";

/// How many lines are searched for places of breakpoints.
const MOST_LINES: i64 = 100_000;

impl Session {
    pub(crate) fn set_breakpoints(&mut self, set: SetBreakpoints) -> Answered {
        let key = match set.source.reference {
            0 => set.source.path.clone(),
            reference => format!("\0{reference}"),
        };
        if key.is_empty() {
            return Err(Refusal::new("a source has a path or a sourceReference"));
        }
        if !self.points.lines.contains_key(&key) && self.points.lines.len() >= MOST_SOURCES {
            return Err(Refusal(format!("{MOST_SOURCES} files with breakpoints are the most")));
        }
        let old = self.points.lines.remove(&key).unwrap_or_default();
        let spots: Vec<_> = set
            .breakpoints
            .into_iter()
            .map(|breakpoint| {
                let line = self.line_in(breakpoint.line);
                (self.spot(&set.source, line), breakpoint.with)
            })
            .collect();
        let points = self.replaced(old, spots);
        let told = self.told(&points);
        if !points.is_empty() {
            self.points.lines.insert(key, points);
        }
        told
    }

    fn spot(&self, source: &SourceName, line: i64) -> Spot {
        Spot::Line(self.texts(source), line)
    }

    pub(crate) fn set_function_breakpoints(&mut self, set: SetFunctionBreakpoints) -> Answered {
        let old = std::mem::take(&mut self.points.functions);
        let spots = set.breakpoints.into_iter();
        let spots = spots.map(|breakpoint| (Spot::Function(breakpoint.name), breakpoint.with));
        let points = self.replaced(old, spots.collect());
        let told = self.told(&points);
        self.points.functions = points;
        told
    }

    pub(crate) fn set_data_breakpoints(&mut self, set: SetDataBreakpoints) -> Answered {
        let old = std::mem::take(&mut self.points.data);
        let mut spots = Vec::new();
        for breakpoint in set.breakpoints {
            let parts = breakpoint.data_id.split_once(':');
            let parts =
                parts.and_then(|(thread, path)| Some((thread.parse::<usize>().ok()?, path)));
            let (thread, path) = parts.unwrap_or((0, breakpoint.data_id.as_str()));
            let spot = match breakpoint.access_type.as_str() {
                "" | "write" => Spot::Data(thread, path.to_owned()),
                other => Spot::Never(format!(
                    "a data breakpoint stops where a value changes, which is `write`, and not `{other}`"
                )),
            };
            spots.push((spot, breakpoint.with));
        }
        let points = self.replaced(old, spots);
        let told = self.told(&points);
        self.points.data = points;
        told
    }

    pub(crate) fn set_exception_breakpoints(&mut self, set: SetExceptionBreakpoints) -> Answered {
        let plain = set.filters.into_iter().map(|filter| (filter, String::new()));
        let with = set.filter_options.into_iter();
        let with = with.map(|option| (option.filter_id, option.condition));
        let filters: Vec<(String, String)> = plain.chain(with).collect();
        if let Some((unknown, _)) = filters.iter().find(|(filter, _)| filter != ERRORS) {
            return Err(Refusal(format!(
                "there is no filter {unknown}; the one there is is {ERRORS}"
            )));
        }
        let old = std::mem::take(&mut self.points.errors);
        let spots = filters.into_iter().map(|(_, codes)| (Spot::Errors(codes), With::default()));
        let points = self.replaced(old, spots.collect());
        let told = self.told(&points);
        self.points.errors = points;
        told
    }

    /// Replaces breakpoints by others. One that stays as it was keeps its number.
    fn replaced(&mut self, mut old: Vec<Point>, spots: Vec<(Spot, With)>) -> Vec<Point> {
        let mut points = Vec::with_capacity(spots.len());
        for (spot, with) in spots {
            let same = old.iter().position(|old| old.spot == spot && old.with == with);
            let point = same.map(|same| old.swap_remove(same)).filter(|same| !same.on.is_empty());
            points.push(point.unwrap_or_else(|| {
                self.points.last += 1;
                let (on, line, message) = (Vec::new(), None, None);
                let mut point = Point { id: self.points.last, spot, with, on, line, message };
                point.set(&mut self.held);
                point
            }));
        }
        old.iter_mut().for_each(|point| point.clear(&mut self.held));
        points
    }

    fn told(&self, points: &[Point]) -> Answered {
        let told: Vec<Told> =
            points.iter().map(|point| point.told(self.client.first_line)).collect();
        answer(json!({ "breakpoints": told }))
    }

    /// Sets all of them again for new controllers, and reports what has changed.
    pub(crate) fn set_all_again(&mut self) {
        let mut points = std::mem::take(&mut self.points);
        for (key, of_source) in &mut points.lines {
            let source = match key.strip_prefix('\0').and_then(|number| number.parse().ok()) {
                Some(reference) => SourceName { path: String::new(), reference },
                None => SourceName { path: key.clone(), reference: 0 },
            };
            let texts = self.texts(&source);
            for point in of_source {
                if let Spot::Line(own, _) = &mut point.spot {
                    own.clone_from(&texts);
                }
            }
        }
        for point in points.all() {
            let before = point.told(self.client.first_line);
            point.on.clear();
            point.set(&mut self.held);
            let after = point.told(self.client.first_line);
            if after != before {
                self.tell("breakpoint", json!({ "reason": "changed", "breakpoint": after }));
            }
        }
        self.points = points;
    }

    pub(crate) fn breakpoint_locations(&mut self, lines: Lines) -> Answered {
        let first = self.line_in(lines.line);
        let last = self.line_in(lines.end_line.unwrap_or(lines.line)).min(first + MOST_LINES);
        let mut found = Vec::new();
        for (thread, text) in self.texts(&lines.source) {
            let Some(held) = self.held.get(thread) else { continue };
            let mut line = first.max(1);
            while let Ok(from) = u32::try_from(line)
                && line <= last
                && let Ok((_, at)) = held.at_line(text, from)
                && i64::from(at) <= last
            {
                found.push(at);
                line = i64::from(at) + 1;
            }
        }
        found.sort_unstable();
        found.dedup();
        let found: Vec<Value> =
            found.into_iter().map(|line| json!({ "line": self.line_out(line) })).collect();
        answer(json!({ "breakpoints": found }))
    }

    pub(crate) fn data_breakpoint_info(&mut self, about: DataBreakpointInfo) -> Answered {
        let (thread, path) = match about.variables_reference {
            0 => (self.of_frame(about.frame_id)?, about.name.clone()),
            reference => self.part(reference, &about.name)?,
        };
        let held = self.resting(thread as i64 + 1)?;
        if path.trim().is_empty() {
            return answer(json!({ "dataId": null, "description": "no field is named" }));
        }
        match held.debugger().variable(&path) {
            Ok(_) => answer(json!({
                "dataId": format!("{thread}:{path}"),
                "description": format!("{path} changes"),
                "accessTypes": ["write"],
                "canPersist": true,
            })),
            Err(error) => answer(json!({ "dataId": null, "description": error.to_string() })),
        }
    }

    /// The path of a part of something that has a number.
    pub(crate) fn part(&mut self, of: i64, name: &str) -> Result<(usize, String), Refusal> {
        let (thread, path) = self.values.get(of).cloned().ok_or_else(|| {
            Refusal(format!("value {of} no longer exists; scopes has the present ones"))
        })?;
        let held = self.resting(thread as i64 + 1)?;
        let whole = held.debugger().variable(&path).map_err(Refusal::new)?;
        let part = whole.children().into_iter().find(|part| part.name == name);
        let part = part.ok_or_else(|| {
            Refusal(match path.as_str() {
                "" => format!("there is no {name} there"),
                path => format!("there is no {name} in {path}"),
            })
        })?;
        Ok((thread, part.path))
    }
}
