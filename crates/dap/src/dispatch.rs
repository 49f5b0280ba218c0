//! Requests and the functions that answer them.

use vimc4_debug::{Depth, Way};
use vimc4_timeline::Progress;

use crate::arguments::Cancel;
use crate::held::Held;
use crate::life::configuration;
use crate::message::{Incoming, Outgoing, Refusal, Request};
use crate::state::{Answered, DONE, Session, Stage};
use crate::table::{Ask, Row};

impl Session {
    /// Takes in a message. Every message is answered. Long work asks `progress` now and then
    /// whether to go on.
    pub fn receive(&mut self, message: Incoming, progress: &mut Progress<'_>) {
        let (to, command, result) = match message {
            Incoming::Request(request) => {
                let result = self.asked(&request, progress);
                (request.seq, request.command, result)
            }
            Incoming::Unreadable { seq, command, refusal } => (seq, command, Err(refusal)),
        };
        let is_introduced = command == "initialize" && result.is_ok();
        // The events that it caused follow the answer.
        let answer = Outgoing::Answer { to, command, result };
        let events = std::mem::take(&mut self.out);
        self.out.push(answer);
        self.out.extend(events);
        if is_introduced {
            self.tell("initialized", serde_json::Value::Null);
        }
    }

    /// Answers a request that was cancelled.
    pub fn refuse(&mut self, request: Request, refusal: Refusal) {
        let Request { seq: to, command, .. } = request;
        self.out.push(Outgoing::Answer { to, command, result: Err(refusal) });
    }

    fn asked(&mut self, request: &Request, progress: &mut Progress<'_>) -> Answered {
        let row = Row::named(&request.command)
            .ok_or_else(|| Refusal(format!("there is no request {}", request.command)))?;
        // Who is about to leave needs no introduction.
        let is_first = matches!(row.ask, Ask::Initialize | Ask::Disconnect);
        if self.stage == Stage::Silent && !is_first {
            return Err(Refusal::new("initialize comes first"));
        }
        let done = match row.ask {
            Ask::Initialize => self.initialize(request.read()?),
            Ask::Launch => self.open(configuration(request.arguments.clone())?, progress),
            Ask::Attach => self.attach(configuration(request.arguments.clone())?, progress),
            Ask::SetBreakpoints => self.set_breakpoints(request.read()?),
            Ask::SetFunctionBreakpoints => self.set_function_breakpoints(request.read()?),
            Ask::SetDataBreakpoints => self.set_data_breakpoints(request.read()?),
            Ask::SetExceptionBreakpoints => self.set_exception_breakpoints(request.read()?),
            Ask::DataBreakpointInfo => self.data_breakpoint_info(request.read()?),
            Ask::BreakpointLocations => self.breakpoint_locations(request.read()?),
            Ask::ConfigurationDone => self.configuration_done(),
            Ask::Threads => self.threads(),
            Ask::StackTrace => self.stack_trace(request.read()?),
            Ask::Scopes => self.scopes(request.read()?),
            Ask::Variables => self.variables(request.read()?),
            Ask::SetVariable => self.set_variable(request.read()?),
            Ask::SetExpression => self.set_expression(request.read()?),
            Ask::Evaluate => self.evaluate(request.read()?, progress),
            Ask::Completions => self.completions(request.read()?),
            Ask::Continue => self.go(request.read()?, Way::Forward),
            Ask::ReverseContinue => self.go(request.read()?, Way::Back),
            Ask::Next => self.step(request.read()?, Way::Forward, Depth::Over),
            Ask::StepIn => self.step(request.read()?, Way::Forward, Depth::Into),
            Ask::StepOut => self.step(request.read()?, Way::Forward, Depth::Out),
            Ask::StepBack => self.step(request.read()?, Way::Back, Depth::Into),
            Ask::Pause => self.pause(request.read()?),
            Ask::GotoTargets => self.goto_targets(request.read()?),
            Ask::Goto => self.goto(request.read()?),
            Ask::RestartFrame => self.restart_frame(request.read()?),
            Ask::ExceptionInfo => self.exception_info(request.read()?),
            Ask::Disassemble => self.disassemble(request.read()?),
            Ask::Source => self.source_text(request.read()?),
            Ask::LoadedSources => self.loaded_sources(),
            Ask::Restart => self.restart(request.read()?, progress),
            Ask::Cancel => self.cancel(request.read()?),
            Ask::Terminate => self.terminate(),
            Ask::Disconnect => self.disconnect(),
        };
        let sets_breakpoints = matches!(
            row.ask,
            Ask::SetBreakpoints
                | Ask::SetFunctionBreakpoints
                | Ask::SetDataBreakpoints
                | Ask::SetExceptionBreakpoints
        );
        if sets_breakpoints {
            self.heed_again();
        }
        done
    }

    /// Ends the run of a progress. A request that has been answered is over already.
    fn cancel(&mut self, cancel: Cancel) -> Answered {
        let is_meant = |number: u64| {
            let number = number.to_string();
            cancel.progress_id.as_deref().is_some_and(|id| id == number)
        };
        let place = self.runs.iter().position(|run| is_meant(run.number));
        if let Some(run) = place.and_then(|place| self.runs.remove(place)) {
            self.give_up(run);
        }
        let is_away = self.away.iter().find(|run| is_meant(run.number)).map(|run| run.thread);
        let held = is_away.and_then(|thread| self.held.get_mut(thread));
        if let Some((_, live)) = held.and_then(Held::live) {
            live.pause();
        }
        DONE
    }
}

/// The number under which the progress of a request is shown, by the number of the request.
#[must_use]
pub fn request_progress(request: i64) -> String {
    format!("request {request}")
}

impl Request {
    /// What it does, for people: the line of an expression, or its command.
    #[must_use]
    pub fn title(&self) -> String {
        let line = self.arguments.get("expression").and_then(serde_json::Value::as_str);
        line.unwrap_or(&self.command).to_owned()
    }
}

impl Incoming {
    /// Whether this message cancels long work: the run of this number, or the request of this
    /// number.
    #[must_use]
    pub fn breaks_off(&self, run: Option<u64>, request: Option<i64>) -> bool {
        let Incoming::Request(asked) = self else { return false };
        match Row::named(&asked.command).map(|row| row.ask) {
            Some(Ask::Pause | Ask::Restart | Ask::Terminate | Ask::Disconnect) => true,
            Some(Ask::Cancel) => asked.read().is_ok_and(|cancel: Cancel| {
                let run = run.map(|run| run.to_string());
                let of_request = request.map(request_progress);
                cancel.request_id.is_some_and(|id| request == Some(id))
                    || cancel.progress_id.is_some_and(|id| {
                        run.as_deref() == Some(id.as_str()) || of_request == Some(id)
                    })
            }),
            _ => false,
        }
    }

    /// The number of the request that this one cancels, if it does.
    #[must_use]
    pub fn cancels(&self) -> Option<i64> {
        let Incoming::Request(asked) = self else { return None };
        let row = Row::named(&asked.command).filter(|row| row.ask == Ask::Cancel);
        row.and_then(|_| asked.read().ok()).and_then(|cancel: Cancel| cancel.request_id)
    }
}
