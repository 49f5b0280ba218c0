//! The requests that are answered: one table for the session and the manual.

/// A request of the protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ask {
    Attach,
    BreakpointLocations,
    Cancel,
    Completions,
    ConfigurationDone,
    Continue,
    DataBreakpointInfo,
    Disassemble,
    Disconnect,
    Evaluate,
    ExceptionInfo,
    Goto,
    GotoTargets,
    Initialize,
    Launch,
    LoadedSources,
    Next,
    Pause,
    Restart,
    RestartFrame,
    ReverseContinue,
    Scopes,
    SetBreakpoints,
    SetDataBreakpoints,
    SetExceptionBreakpoints,
    SetExpression,
    SetFunctionBreakpoints,
    SetVariable,
    Source,
    StackTrace,
    StepBack,
    StepIn,
    StepOut,
    Terminate,
    Threads,
    Variables,
}

/// A request that is answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// What it is called in the protocol.
    pub command: &'static str,
    /// What it does to a controller, in one line.
    pub about: &'static str,
    pub(crate) ask: Ask,
}

const fn row(command: &'static str, ask: Ask, about: &'static str) -> Row {
    Row { command, about, ask }
}

/// All requests that are answered, in the order of a session.
pub const REQUESTS: [Row; 36] = [
    row("initialize", Ask::Initialize, "comes first, and only once; lists what the adapter can do"),
    row(
        "launch",
        Ask::Launch,
        "opens a program, a recording or ports, with a controller of its own",
    ),
    row(
        "attach",
        Ask::Attach,
        "opens a recording, and stays within it; or takes controllers that run",
    ),
    row(
        "setBreakpoints",
        Ask::SetBreakpoints,
        "lines of the program, with condition, hit count, log",
    ),
    row(
        "setFunctionBreakpoints",
        Ask::SetFunctionBreakpoints,
        "commands, as in `@0A`, or any condition",
    ),
    row("setDataBreakpoints", Ask::SetDataBreakpoints, "fields and switches that change"),
    row(
        "setExceptionBreakpoints",
        Ask::SetExceptionBreakpoints,
        "error replies, all or some codes",
    ),
    row("dataBreakpointInfo", Ask::DataBreakpointInfo, "whether something can be waited for"),
    row("breakpointLocations", Ask::BreakpointLocations, "lines that have a command"),
    row("configurationDone", Ask::ConfigurationDone, "begins, once a program is open"),
    row("threads", Ask::Threads, "the controllers"),
    row("stackTrace", Ask::StackTrace, "the line, the loops around it, the command"),
    row("scopes", Ask::Scopes, "axes, signals, ports, the controller, its whole state"),
    row("variables", Ask::Variables, "the parts of something"),
    row("setVariable", Ask::SetVariable, "a switch or a field; in the past that begins a branch"),
    row("setExpression", Ask::SetExpression, "the same, by the path of the field"),
    row("evaluate", Ask::Evaluate, "an expression; in the console, any command of the debugger"),
    row("completions", Ask::Completions, "what can follow in the console"),
    row("continue", Ask::Continue, "on to the next breakpoint"),
    row("reverseContinue", Ask::ReverseContinue, "back to the last breakpoint"),
    row("next", Ask::Next, "on by a statement, a line or a step pulse, over loops"),
    row("stepIn", Ask::StepIn, "on by a statement, a line or a step pulse, into loops"),
    row("stepOut", Ask::StepOut, "out of the innermost loop, or of the program"),
    row(
        "stepBack",
        Ask::StepBack,
        "back by a statement, a line or a step pulse, into loops: undoes `stepIn` by a statement or line",
    ),
    row("pause", Ask::Pause, "stops here"),
    row("gotoTargets", Ask::GotoTargets, "a line, the last time and the next time"),
    row("goto", Ask::Goto, "goes to one of these"),
    row("restartFrame", Ask::RestartFrame, "back to where a line, a loop or a command began"),
    row("exceptionInfo", Ask::ExceptionInfo, "the error reply, and why"),
    row("disassemble", Ask::Disassemble, "lines of the stored program, and what they mean"),
    row("source", Ask::Source, "text that is in no file"),
    row("loadedSources", Ask::LoadedSources, "the files that are open"),
    row("restart", Ask::Restart, "opens everything again, as it is now"),
    row("cancel", Ask::Cancel, "ends a request or a progress within 50 ms"),
    row("terminate", Ask::Terminate, "ends the controllers"),
    row("disconnect", Ask::Disconnect, "ends the session"),
];

impl Row {
    /// The one of a name.
    #[must_use]
    pub fn named(command: &str) -> Option<&'static Row> {
        static ROWS: [Row; REQUESTS.len()] = REQUESTS;
        ROWS.iter().find(|row| row.command == command)
    }
}
