//! The beginning of a session and its end.

use serde_json::{Value, json};

use crate::arguments::{Initialize, Restart};
use crate::belonging::ATTACH_TAKES;
use crate::held::{Held, Walk};
use crate::message::{Outgoing, Refusal};
use crate::open::Configuration;
use crate::reading;
use crate::setting::ERRORS;
use crate::state::{Answered, DONE, Session, Stage, answer};
use vimc4_debug::Way;
use vimc4_timeline::Progress;

impl Session {
    pub(crate) fn initialize(&mut self, about: Initialize) -> Answered {
        if self.stage != Stage::Silent {
            return Err(Refusal::new("initialize comes only once"));
        }
        if about.path_format != "path" {
            return Err(Refusal(format!("paths cannot be {}, only path", about.path_format)));
        }
        self.stage = Stage::Introduced;
        self.client.first_line = i64::from(about.lines_start_at1);
        self.client.shows_progress = about.supports_progress_reporting;
        self.client.is_told_what_is_old = about.supports_invalidated_event;
        answer(json!({
            "supportsConfigurationDoneRequest": true,
            "supportsFunctionBreakpoints": true,
            "supportsConditionalBreakpoints": true,
            "supportsHitConditionalBreakpoints": true,
            "supportsLogPoints": true,
            "supportsDataBreakpoints": true,
            "supportsExceptionFilterOptions": true,
            "supportsExceptionInfoRequest": true,
            "exceptionBreakpointFilters": [{
                "filter": ERRORS,
                "label": "Error replies",
                "description": "Stops where a controller answers with an error",
                "default": true,
                "supportsCondition": true,
                "conditionDescription": "Codes such as 3, 5; all, if none is said",
            }],
            "supportsBreakpointLocationsRequest": true,
            "supportsEvaluateForHovers": true,
            "supportsSetVariable": true,
            "supportsSetExpression": true,
            "supportsCompletionsRequest": true,
            "completionTriggerCharacters": [" ", "."],
            "supportsStepBack": true,
            "supportsSteppingGranularity": true,
            "supportsGotoTargetsRequest": true,
            "supportsRestartFrame": true,
            "supportsRestartRequest": true,
            "supportsTerminateRequest": true,
            "supportsCancelRequest": true,
            "supportsDisassembleRequest": true,
            "supportsLoadedSourcesRequest": true,
            "supportsSingleThreadExecutionRequests": true,
        }))
    }

    /// Opens what a configuration says.
    pub(crate) fn open(
        &mut self,
        configuration: Configuration,
        progress: &mut Progress<'_>,
    ) -> Answered {
        if self.stage != Stage::Introduced {
            return Err(Refusal::new("something is open already; restart opens it again"));
        }
        self.put_in(configuration, progress)?;
        self.begin_all();
        DONE
    }

    /// The same for a recording, which cannot be continued, or for controllers that run already.
    pub(crate) fn attach(
        &mut self,
        configuration: Configuration,
        progress: &mut Progress<'_>,
    ) -> Answered {
        let is_opened = |each: &Configuration| each.program.is_some() || each.serve;
        if configuration.each().iter().any(is_opened) {
            return Err(Refusal::new(ATTACH_TAKES));
        }
        let before = std::mem::replace(&mut self.is_attached, true);
        let opened = self.open(configuration, progress);
        if opened.is_err() {
            // What is open is as it was.
            self.is_attached = before;
        }
        opened
    }

    fn put_in(
        &mut self,
        configuration: Configuration,
        progress: &mut Progress<'_>,
    ) -> Result<(), Refusal> {
        // They may be why nothing can be opened.
        self.say(configuration.unknown(self.is_attached));
        configuration.check(self.is_attached)?;
        let is_of_files = configuration.each().iter().all(|each| each.recording.is_some());
        if self.held.iter().any(|held| held.opened.live.is_some()) {
            // That frees their ports. Afterwards their settings are made again.
            self.away.clear();
            self.runs.clear();
            self.held.clear();
        }
        let opened = match self.is_attached && !is_of_files {
            true => self.opener.attach(&configuration)?,
            false => self.opener.open(&configuration, progress)?,
        };
        self.runs.clear();
        self.say(opened.iter().map(|opened| opened.said.clone()).filter(|said| !said.is_empty()));
        for thread in 0..self.held.len() {
            self.frames.forget(thread);
            self.values.forget(thread);
        }
        self.targets.clear();
        self.held = opened.into_iter().map(Held::new).collect();
        self.configuration = Some(configuration);
        self.stage = Stage::Open;
        self.set_all_again();
        Ok(())
    }

    /// Says something in the debug console, each in lines of its own.
    fn say(&mut self, said: impl IntoIterator<Item = String>) {
        for said in said {
            let body = json!({ "category": "console", "output": format!("{said}\n") });
            self.out.push(Outgoing::event("output", body));
        }
    }

    pub(crate) fn configuration_done(&mut self) -> Answered {
        if self.is_configured {
            return Err(Refusal::new("configurationDone comes only once"));
        }
        self.is_configured = true;
        self.begin_all();
        DONE
    }

    /// Begins, once the program is open and the breakpoints are set, whichever comes first.
    fn begin_all(&mut self) {
        if !self.is_configured || self.stage != Stage::Open {
            return;
        }
        let configuration = self.configuration.clone().unwrap_or_default();
        for thread in 0..self.held.len() {
            let body = json!({ "reason": "started", "threadId": thread + 1 });
            self.tell("thread", body);
            let walk = match configuration.stop_on_entry && !configuration.no_debug {
                true => Walk::Entry,
                false => Walk::Go(Way::Forward),
            };
            if configuration.no_debug {
                self.leave_breakpoints_alone(thread);
            }
            self.begin(thread, walk);
        }
    }

    fn leave_breakpoints_alone(&mut self, thread: usize) {
        let Some(held) = self.held.get_mut(thread) else { return };
        let debugger = held.debugger();
        let ids: Vec<_> = debugger.breakpoints().iter().map(|own| own.id).collect();
        for id in ids {
            debugger.enable_breakpoint(id, false);
        }
    }

    pub(crate) fn restart(&mut self, restart: Restart, progress: &mut Progress<'_>) -> Answered {
        let configuration = match restart.arguments {
            Some(arguments) if !arguments.is_null() => Some(configuration(arguments)?),
            _ => self.configuration.clone(),
        };
        let configuration = configuration
            .ok_or_else(|| Refusal::new("nothing is open; launch or attach comes first"))?;
        self.put_in(configuration, progress)?;
        self.is_configured = true;
        self.begin_all();
        DONE
    }

    pub(crate) fn terminate(&mut self) -> Answered {
        self.end();
        DONE
    }

    pub(crate) fn disconnect(&mut self) -> Answered {
        self.let_go_of_all();
        self.stage = Stage::Over;
        DONE
    }
}

/// The client's configuration of what is to be opened.
pub(crate) fn configuration(arguments: Value) -> Result<Configuration, Refusal> {
    reading::read("the attributes of the configuration", arguments).map_err(Refusal)
}
