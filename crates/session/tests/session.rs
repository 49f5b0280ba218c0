//! A session, driven by hand.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::time::Duration;

use vimc4_catalogue::{Controller, all_names, bare, machine, model};
use vimc4_device::{Condition, Device, Kinds, Line};
use vimc4_language::read_condition;
use vimc4_session::{
    AdvanceRequest, Clock, Completion, ControlError, Destination, EventFilter, LineEvent,
    ReportKind, Session, SessionOutput, Source, Work,
};

fn condition(text: &str) -> Condition {
    read_condition(text, all_names()).unwrap()
}

/// A session on a bench, and all that has come out of it.
struct Bench {
    session: Session<Line<Controller>>,
    wall: Duration,
    replies: String,
    reports: Vec<ReportKind>,
}

impl Bench {
    fn new(clock: Clock) -> Bench {
        let controller = bare(&model("imc4").unwrap(), &machine("bench").unwrap(), b"").unwrap();
        let mut session = Session::new(Line::ideal(controller), clock);
        let filter = EventFilter { kinds: Kinds::NONE, ..EventFilter::ALL };
        session.set_wants(Some(filter));
        session.start(Duration::ZERO);
        let (replies, reports) = (String::new(), Vec::new());
        Bench { session, wall: Duration::ZERO, replies, reports }
    }

    fn poll(&mut self) {
        while let Some(output) = self.session.poll_output() {
            match output {
                SessionOutput::Bytes(_, bytes) => {
                    self.replies.push_str(std::str::from_utf8(&bytes).unwrap());
                }
                SessionOutput::Report(_, what, _) => self.reports.push(what),
                SessionOutput::Store(_) | SessionOutput::Settled => {}
            }
        }
    }

    fn send(&mut self, line: &str) {
        self.session.handle_bytes(self.wall, &"tcp".into(), None, line.as_bytes());
        self.poll();
    }

    /// Lets wall time pass, and does all that is due.
    fn wait(&mut self, span: Duration) {
        self.wall += span;
        self.work();
    }

    fn work(&mut self) {
        while self.session.handle_timeout(self.wall) != Work::Idle {
            self.poll();
        }
        self.poll();
    }

    fn x(&self) -> i64 {
        self.session.device().position(self.session.now())[0]
    }

    fn completion(&mut self) -> Completion {
        self.session.poll_completion().unwrap().1
    }
}

fn tester() -> Source {
    Source::Controls("a test".into())
}

#[test]
fn a_reply_comes_when_its_time_has_come() {
    let mut bench = Bench::new(Clock::Real);
    bench.send("@01\r@0A900,900\r");
    assert_eq!(bench.replies, "0");
    let due = bench.session.next_timeout().unwrap();
    bench.wait(due - Duration::from_nanos(1));
    assert_eq!(bench.replies, "0");
    bench.wait(Duration::from_nanos(1));
    assert_eq!((bench.replies.as_str(), bench.x()), ("00", 900));
    assert_eq!(bench.session.next_timeout(), None);
}

#[test]
fn a_breakpoint_in_a_move_holds_time_until_it_goes_on() {
    let mut bench = Bench::new(Clock::Real);
    bench.send("@01\r@0A900,900\r");
    let breakpoint = bench.session.add_breakpoint(condition("x = 300"));
    bench.session.await_pause();
    bench.wait(Duration::from_secs(60));
    assert_eq!((bench.replies.as_str(), bench.x()), ("0", 300));
    let Completion::Paused(pause) = bench.completion() else { panic!("it is not paused") };
    assert_eq!(pause.breakpoints, [breakpoint]);

    bench.session.remove_breakpoint(breakpoint);
    bench.session.resume(bench.wall, &tester()).unwrap();
    bench.wait(Duration::from_secs(60));
    assert_eq!((bench.replies.as_str(), bench.x()), ("00", 900));
    let resumed = ReportKind::News(LineEvent::Resumed { by: tester() });
    assert!(bench.reports.contains(&resumed));
    assert_eq!(bench.reports.last(), Some(&ReportKind::Goes));
}

#[test]
fn time_that_moves_on_request_arrives_or_says_why_not() {
    let mut bench = Bench::new(Clock::Manual);
    bench.send("@01\r@0A900,900\r");
    bench.wait(Duration::from_secs(60));
    assert_eq!(bench.x(), 0);

    let id = bench.session.advance(tester(), Destination::Until(condition("x = 450")));
    bench.work();
    let now = bench.session.now();
    assert_eq!(bench.session.poll_completion(), Some((id, Completion::Advanced(Ok(now)))));
    assert_eq!(bench.x(), 450);

    bench.session.advance(tester(), Destination::Until(condition("x = 5000")));
    bench.work();
    assert_eq!(bench.completion(), Completion::Advanced(Err(ControlError::Never)));

    let id = bench.session.advance(tester(), Destination::After(Duration::from_secs(9)));
    bench.session.change_advance(id, AdvanceRequest::Cancel);
    bench.work();
    let cancelled = Err(ControlError::Cancelled { at: now });
    assert_eq!(bench.completion(), Completion::Advanced(cancelled));
}
