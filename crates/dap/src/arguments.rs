//! The arguments of requests. A missing argument has the protocol's default; an unknown one is
//! ignored.

use serde::Deserialize;

fn yes() -> bool {
    true
}

fn path() -> String {
    "path".to_owned()
}

/// What a client says about itself.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Initialize {
    #[serde(default = "yes")]
    pub(crate) lines_start_at1: bool,
    #[serde(default = "path")]
    pub(crate) path_format: String,
    #[serde(default)]
    pub(crate) supports_progress_reporting: bool,
    #[serde(default)]
    pub(crate) supports_invalidated_event: bool,
}

#[derive(Clone, Debug, Default, Deserialize)]
pub(crate) struct SourceName {
    #[serde(default)]
    pub(crate) path: String,
    #[serde(default, rename = "sourceReference")]
    pub(crate) reference: i64,
}

#[derive(Clone, Debug, Deserialize)]
pub(crate) struct SetBreakpoints {
    pub(crate) source: SourceName,
    #[serde(default)]
    pub(crate) breakpoints: Vec<SourceBreakpoint>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SourceBreakpoint {
    pub(crate) line: i64,
    #[serde(flatten)]
    pub(crate) with: With,
}

/// What every kind of breakpoint can have.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct With {
    #[serde(default)]
    pub(crate) condition: String,
    #[serde(default)]
    pub(crate) hit_condition: String,
    #[serde(default)]
    pub(crate) log_message: String,
}

#[derive(Clone, Debug, Deserialize)]
pub(crate) struct SetFunctionBreakpoints {
    pub(crate) breakpoints: Vec<FunctionBreakpoint>,
}

#[derive(Clone, Debug, Deserialize)]
pub(crate) struct FunctionBreakpoint {
    pub(crate) name: String,
    #[serde(flatten)]
    pub(crate) with: With,
}

#[derive(Clone, Debug, Deserialize)]
pub(crate) struct SetDataBreakpoints {
    pub(crate) breakpoints: Vec<DataBreakpoint>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct DataBreakpoint {
    pub(crate) data_id: String,
    #[serde(default)]
    pub(crate) access_type: String,
    #[serde(flatten)]
    pub(crate) with: With,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SetExceptionBreakpoints {
    #[serde(default)]
    pub(crate) filters: Vec<String>,
    #[serde(default)]
    pub(crate) filter_options: Vec<FilterOption>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct FilterOption {
    pub(crate) filter_id: String,
    #[serde(default)]
    pub(crate) condition: String,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct DataBreakpointInfo {
    #[serde(default)]
    pub(crate) variables_reference: i64,
    #[serde(default)]
    pub(crate) frame_id: i64,
    pub(crate) name: String,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Lines {
    pub(crate) source: SourceName,
    pub(crate) line: i64,
    #[serde(default)]
    pub(crate) end_line: Option<i64>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct OfThread {
    pub(crate) thread_id: i64,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct StackTrace {
    pub(crate) thread_id: i64,
    #[serde(default)]
    pub(crate) start_frame: usize,
    /// 0 for all.
    #[serde(default)]
    pub(crate) levels: usize,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct OfFrame {
    pub(crate) frame_id: i64,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Variables {
    pub(crate) variables_reference: i64,
    #[serde(default)]
    pub(crate) filter: String,
    #[serde(default)]
    pub(crate) start: usize,
    /// 0 for all.
    #[serde(default)]
    pub(crate) count: usize,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SetVariable {
    pub(crate) variables_reference: i64,
    pub(crate) name: String,
    pub(crate) value: String,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SetExpression {
    pub(crate) expression: String,
    pub(crate) value: String,
    #[serde(default)]
    pub(crate) frame_id: i64,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Evaluate {
    pub(crate) expression: String,
    #[serde(default)]
    pub(crate) frame_id: i64,
    #[serde(default)]
    pub(crate) context: String,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Completions {
    pub(crate) text: String,
    /// The column of the cursor, in UTF-16 units.
    pub(crate) column: i64,
    /// The line of the cursor, if the text has several.
    #[serde(default)]
    pub(crate) line: Option<i64>,
    #[serde(default)]
    pub(crate) frame_id: i64,
}

/// What a step is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) enum Granularity {
    #[default]
    Statement,
    Line,
    Instruction,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Step {
    pub(crate) thread_id: i64,
    #[serde(default)]
    pub(crate) granularity: Granularity,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Goto {
    pub(crate) thread_id: i64,
    pub(crate) target_id: usize,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Disassemble {
    pub(crate) memory_reference: String,
    #[serde(default)]
    pub(crate) offset: i64,
    #[serde(default)]
    pub(crate) instruction_offset: i64,
    pub(crate) instruction_count: i64,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SourceText {
    #[serde(default)]
    pub(crate) source: Option<SourceName>,
    #[serde(default)]
    pub(crate) source_reference: i64,
}

/// The arguments of `cancel`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Cancel {
    #[serde(default)]
    pub(crate) request_id: Option<i64>,
    #[serde(default)]
    pub(crate) progress_id: Option<String>,
}

/// The arguments of `restart`: the present configuration, if the client sends it.
#[derive(Clone, Debug, Default, Deserialize)]
pub(crate) struct Restart {
    #[serde(default)]
    pub(crate) arguments: Option<serde_json::Value>,
}
