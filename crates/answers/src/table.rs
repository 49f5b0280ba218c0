//! The routes: one table. Whoever answers makes a list of functions from it, and what does not answer one of
//! them does not compile; the document and the page of the API come from it, too.

use crate::fields::{Field, Of};

/// A route.
#[derive(Debug)]
pub struct Route {
    /// The method of HTTP, in capitals.
    pub method: &'static str,
    /// The path, with names in braces for what differs.
    pub path: &'static str,
    /// What it is for.
    pub about: &'static str,
    /// What may stand behind the question mark.
    pub query: &'static [Field],
    /// The fields of the body.
    pub body: &'static [Field],
    /// The name of the schema of what is answered.
    pub answer: &'static str,
}

const NONE: &[Field] = &[];

const ORDER: &[Field] = &[Field::needed("order", Of::Text, "as on standard input", "press stop")];
const VALUE: &[Field] =
    &[Field::needed("value", Of::Value, "a number, or the name of a switch's position", "1")];
const LINE: &[Field] = &[Field::needed("line", Of::Text, "the line so far", "press ")];
const DEBUG: &[Field] = &[Field::needed("line", Of::Text, "as in `vimc4 console`", "back command")];
const HOLD: &[Field] =
    &[Field::optional("by", Of::Text, "who is told to others", "process 4004 (vimc4 console)")];
const SEND: &[Field] = &[Field::needed("send", Of::Text, "bytes, a character for each", "@07\r")];
const CLOCK: &[Field] = &[Field::needed("clock", Of::Text, "real, or a factor such as 8x", "8x")];
const SPAN: &[Field] = &[Field::needed("span", Of::Text, "how far, with a unit", "250ms")];
const CONDITION: &[Field] =
    &[Field::needed("condition", Of::Text, "as behind `run until`", "x > 2500")];
const NAME: &[Field] = &[Field::optional("name", Of::Text, "what it is called", "before")];
const MOMENT: &[Field] = &[
    Field::optional("at", Of::Number, "a time, in nanoseconds", "1500000000"),
    Field::optional("branch", Of::Number, "on this branch; without a time, its end", "0"),
    Field::optional("command", Of::Number, "instead: when the command of this number began", "12"),
    Field::optional(
        "entry",
        Of::Number,
        "instead: when this entry of the journal happened, where it did",
        "7",
    ),
];
const DEED: &[Field] = &[
    Field::optional("order", Of::Text, "as on standard input", "hold estop"),
    Field::optional("send", Of::Text, "or bytes, a character for each", "@0P\r"),
    SIGHT[0],
    SIGHT[1],
];
const SIGHT: &[Field] = &[
    Field::optional("branch", Of::Number, "only if this branch is looked at", "0"),
    Field::optional("at", Of::Number, "only if this time is, in nanoseconds", "1500000000"),
];
const BRANCH: &[Field] =
    &[Field::optional("branch", Of::Number, "of this branch, instead of the present one", "0")];
const FAULT: &[Field] =
    &[Field::needed("fault", Of::Text, "as behind `fault`", "drop to-host once")];
const RULES: &[Field] =
    &[Field::needed("rules", Of::Text, "one in each line", "when x > 1000: press stop")];
const EXPECT: &[Field] = &[Field::needed(
    "expect",
    Of::Text,
    "a sentence, with how often",
    "command @A answered 0, at least once; then command @P, once",
)];
const IMAGE: &[Field] =
    &[Field::needed("image", Of::Image, "as in the file of --flash", "vimc4 flash 1\n")];
const PAGE: &[Field] = &[
    Field::optional("after", Of::Number, "only entries behind this number", "0"),
    Field::optional("limit", Of::Number, "no more of them, 1 to 1,000", "200"),
    Field::optional("kinds", Of::Text, "only entries of these kinds", "command,answer"),
    Field::optional("search", Of::Text, "only entries with this text in them", "@0A"),
];

/// Hands all routes to a macro: of each its method, path, query, body, schema, function and purpose.
#[macro_export]
macro_rules! routes {
    ($make:ident) => { $make! {
    GET "/v1" NONE NONE "Server" server
        "What this is, how many controllers there are, and whether it needs a token";
    GET "/v1/models" NONE NONE "Names" models "The names of the built-in models";
    GET "/v1/models/{name}" NONE NONE "Profile" model "The profile of a built-in model, as TOML";
    GET "/v1/machines" NONE NONE "Names" machines "The names of the built-in machines";
    GET "/v1/machines/{name}" NONE NONE "Profile" machine "The profile of a built-in machine, as TOML";
    GET "/v1/controllers" NONE NONE "Controllers" controllers "The controllers that run, and where";
    GET "/v1/controllers/{n}" NONE NONE "Controller" controller "One of them, by its number from 1";
    GET "/v1/controllers/{n}/model" NONE NONE "Object" its_model "The profile of its model";
    GET "/v1/controllers/{n}/machine" NONE NONE "Object" its_machine "The profile of its machine";
    GET "/v1/controllers/{n}/view" NONE NONE "View" view
        "Everything that is visible: positions, speeds, signals, ports, program, what it will do";
    GET "/v1/controllers/{n}/position" NONE NONE "Position" position
        "The step counters of its axes";
    GET "/v1/controllers/{n}/signals" NONE NONE "Signals" signals
        "What can be pressed, turned and set, with its present value";
    PUT "/v1/controllers/{n}/signals/{name}" NONE VALUE "Done" set_signal "Set a signal";
    GET "/v1/controllers/{n}/orders" NONE NONE "Verbs" verbs "The orders that there are";
    POST "/v1/controllers/{n}/orders" NONE ORDER "Said" order
        "Give an order, in the words of standard input";
    GET "/v1/controllers/{n}/completions" LINE NONE "Completions" completions
        "What can follow an order that has been begun";
    POST "/v1/controllers/{n}/line" NONE SEND "Done" send
        "Send bytes to the controller, as its host does; answers are in the journal";
    GET "/v1/controllers/{n}/flash" NONE NONE "Image" flash
        "What is in the memory that outlives the power, as in the file of --flash";
    PUT "/v1/controllers/{n}/flash" NONE IMAGE "Done" set_flash
        "Put another image into that memory: settings in it count when it is switched on again";
    GET "/v1/controllers/{n}/recording" NONE NONE "Recording" recording
        "All that is recorded so far: what was begun here, or by --record";
    POST "/v1/controllers/{n}/recording" NONE NONE "Done" begin_recording
        "Record everything from now on";
    DELETE "/v1/controllers/{n}/recording" NONE NONE "Done" end_recording
        "End the recording that was begun here, and forget it";
    GET "/v1/controllers/{n}/clock" NONE NONE "Clock" clock
        "The time, how it passes, and whether and why it is paused";
    PUT "/v1/controllers/{n}/clock" NONE CLOCK "Clock" set_clock
        "Let time pass at another speed, where it passes by itself";
    POST "/v1/controllers/{n}/clock/advance" NONE SPAN "Now" advance
        "Move time forward, with the clocks manual and instant";
    POST "/v1/controllers/{n}/clock/run-until" NONE CONDITION "Now" run_until
        "Let time pass until a condition holds, or time is paused; given up with the connection";
    POST "/v1/controllers/{n}/clock/cancel" NONE NONE "Now" cancel
        "Give up each advance and run-until that waits for time to pass";
    POST "/v1/controllers/{n}/clock/pause" NONE NONE "Now" pause "Let time stand still";
    POST "/v1/controllers/{n}/clock/resume" NONE NONE "Now" resume "Let time go on";
    POST "/v1/controllers/{n}/clock/step" NONE NONE "Step" step
        "Do the next thing only, while time is paused";
    GET "/v1/controllers/{n}/breakpoints" NONE NONE "Breakpoints" breakpoints "The breakpoints";
    POST "/v1/controllers/{n}/breakpoints" NONE CONDITION "Breakpoint" add_breakpoint
        "Pause time whenever a condition becomes true";
    DELETE "/v1/controllers/{n}/breakpoints/{id}" NONE NONE "Done" remove_breakpoint
        "Remove a breakpoint";
    POST "/v1/controllers/{n}/debugger" NONE DEBUG "Said" debug
        "Step forward and back, ask why and what if, in the words of the console; pauses time";
    POST "/v1/controllers/{n}/debugger/hold" NONE HOLD "Held" hold_debugger
        "Open the debugger for one client: it is closed when the connection of this request ends";
    GET "/v1/controllers/{n}/debugger/view" NONE NONE "View" debugger_view
        "Everything that is visible at the moment that the debugger looks at, or now if it is not open";
    POST "/v1/controllers/{n}/debugger/cancel" NONE NONE "Done" cancel_debugger
        "End what the debugger is doing: it answers where it stands";
    DELETE "/v1/controllers/{n}/debugger" NONE NONE "Done" close_debugger
        "Close the debugger: the controller goes on";
    GET "/v1/controllers/{n}/history" NONE NONE "History" history
        "The past that is kept, and the moment that is looked at, if the debugger is open";
    POST "/v1/controllers/{n}/history/go" NONE MOMENT "History" go
        "Look at a moment, or without one at the present; opens the debugger, which pauses time";
    POST "/v1/controllers/{n}/history/do" NONE DEED "History" do_there
        "Do something at the moment that is looked at: in the past that begins a branch";
    POST "/v1/controllers/{n}/history/take" NONE SIGHT "History" take
        "Take the controller itself to the moment that is looked at";
    GET "/v1/controllers/{n}/history/entries" BRANCH NONE "Journal" history_entries
        "What happened on a branch, as in the journal; the last 10,000 entries of it";
    GET "/v1/controllers/{n}/journal" PAGE NONE "Journal" journal
        "What happened, numbered and oldest first; `next` goes on from there as `after`";
    POST "/v1/controllers/{n}/journal/expect" NONE EXPECT "Met" so_far
        "Whether all that is kept of it is as expected; if not, what came closest";
    GET "/v1/controllers/{n}/expectations" NONE NONE "Expectations" expectations
        "What is expected, and how that stands";
    POST "/v1/controllers/{n}/expectations" NONE EXPECT "Expectation" watch
        "Expect something from now on";
    GET "/v1/controllers/{n}/expectations/{id}" NONE NONE "Expectation" expectation
        "How an expectation stands";
    POST "/v1/controllers/{n}/expectations/{id}/wait" NONE NONE "Expectation" wait_until_met
        "Wait until it is met, or cannot be any more; given up with the connection";
    POST "/v1/controllers/{n}/expectations/{id}/check" NONE NONE "Met" check
        "Whether it is met by all that has happened; it is not expected any more then";
    DELETE "/v1/controllers/{n}/expectations/{id}" NONE NONE "Done" give_up
        "Expect it no more, met or not";
    GET "/v1/controllers/{n}/faults" NONE NONE "Faults" faults "The faults that there are";
    POST "/v1/controllers/{n}/faults" NONE FAULT "Fault" begin_fault "Something goes wrong";
    DELETE "/v1/controllers/{n}/faults" NONE NONE "Done" end_faults "All faults end";
    DELETE "/v1/controllers/{n}/faults/{number}" NONE NONE "Done" end_fault "A fault ends";
    GET "/v1/controllers/{n}/rules" NONE NONE "Rules" rules "The rules that there are";
    POST "/v1/controllers/{n}/rules" NONE RULES "Scenario" begin_rules
        "Let things happen as rules say: a scenario";
    DELETE "/v1/controllers/{n}/rules" NONE NONE "Done" end_scenarios "All scenarios end";
    DELETE "/v1/controllers/{n}/rules/{scenario}" NONE NONE "Done" end_scenario "A scenario ends";
    POST "/v1/controllers/{n}/reset" NONE NONE "Done" reset "All scenarios and all faults end";
    GET "/v1/controllers/{n}/snapshots" NONE NONE "Snapshots" snapshots "The snapshots";
    POST "/v1/controllers/{n}/snapshots" NONE NAME "Snapshot" take_snapshot
        "Keep the present state";
    POST "/v1/controllers/{n}/snapshots/{id}/restore" NONE NONE "Now" restore_snapshot
        "Go back to a state, its time included";
    DELETE "/v1/controllers/{n}/snapshots/{id}" NONE NONE "Done" remove_snapshot
        "Forget a snapshot";
    POST "/v1/quit" NONE NONE "Done" quit "End the program, as `quit` does";
    } };
}

macro_rules! table {
    ($($method:ident $path:literal $query:ident $body:ident $answer:literal $run:ident $about:literal;)+) => {
        /// All routes, in the order of the page.
        pub static ROUTES: &[Route] = &[$(Route {
            method: stringify!($method),
            path: $path,
            about: $about,
            query: $query,
            body: $body,
            answer: $answer,
        }),+];
    };
}

routes!(table);

/// The parts of a path that have names.
pub type Named<'a> = Vec<(&'static str, &'a str)>;

/// The place of the route of a path and a method, with the parts of the path that have names; or the methods that the
/// path takes.
///
/// # Errors
///
/// The methods that there are for the path: none if there is nothing.
pub fn find<'a>(method: &str, path: &'a str) -> Result<(usize, Named<'a>), Vec<&'static str>> {
    let mut others = Vec::new();
    for (place, route) in ROUTES.iter().enumerate() {
        let Some(names) = names(route.path, path) else { continue };
        if route.method == method {
            return Ok((place, names));
        }
        others.push(route.method);
    }
    Err(others)
}

/// What stands in a path for the names of a pattern, if it fits.
fn names<'a>(pattern: &'static str, path: &'a str) -> Option<Named<'a>> {
    let (mut own, mut asked) = (pattern.split('/'), path.split('/'));
    let mut names = Vec::new();
    loop {
        match (own.next(), asked.next()) {
            (None, None) => return Some(names),
            (Some(own), Some(asked)) => {
                let name = own.strip_prefix('{').and_then(|name| name.strip_suffix('}'));
                match name {
                    Some(name) if !asked.is_empty() => names.push((name, asked)),
                    None if own == asked => {}
                    _ => return None,
                }
            }
            _ => return None,
        }
    }
}
