//! What a controller is connected to: its transports, its flash file, and its sinks.

use bytes::Bytes;
use vimc4_device::{Device, Event, Kinds, ModemLine, Time, Warning};
use vimc4_session::{Session, SessionOutput, Sinks};

use crate::storage::Storage;
use crate::wire::Wire;
use crate::{ReportKind, Sink, SinkId};

/// The transports, the flash file, and the sinks of a controller. They get the outputs of its session.
pub(crate) struct Connections {
    pub(crate) wire: Wire,
    pub(crate) storage: Storage,
    pub(crate) sinks: Sinks,
}

impl Connections {
    pub(crate) fn new(baud: u32) -> Connections {
        let (wire, storage, sinks) = (Wire::new(baud), Storage::default(), Sinks::default());
        Connections { wire, storage, sinks }
    }

    /// Hands out all outputs of a session in their order. Stored data is on disk before the reply that
    /// confirms it is sent.
    pub(crate) fn flush<D: Device>(&mut self, session: &mut Session<D>) {
        while let Some(output) = session.poll_output() {
            match output {
                SessionOutput::Report(at, what, meaning) => {
                    self.report(session, at, what, meaning);
                }
                SessionOutput::Bytes(at, bytes) => self.send(session, at, &bytes),
                SessionOutput::Store(change) => self.storage.store(&change),
                SessionOutput::Settled => self.settle(session),
            }
        }
        session.set_watch_due(self.sinks.due());
    }

    fn settle<D: Device>(&mut self, session: &Session<D>) {
        self.storage.secure();
        self.sinks.settle(session.now(), &|| session.written_state());
        self.wire.set_baud(session.device().baud());
        // Clients are asked to wait, on the lines that exist for it, while the device takes nothing.
        let line = session.device().modem_line();
        let shows_ready = !matches!(line, Some((ModemLine::Cts, _)));
        let is_ready = !session.is_paused() && session.device().room(true) > 0;
        self.wire.set_ready(is_ready || !shows_ready);
        self.wire.set_line(line);
    }

    fn report<D: Device>(
        &mut self,
        session: &mut Session<D>,
        at: Time,
        what: ReportKind,
        meaning: Option<String>,
    ) {
        let explain =
            |command: &[u8]| meaning.clone().unwrap_or_else(|| session.device().explain(command));
        if self.sinks.report(at, what, &explain) {
            session.set_wants(self.sinks.wants());
        }
    }

    fn send<D: Device>(&mut self, session: &mut Session<D>, at: Time, bytes: &Bytes) {
        self.storage.secure();
        // A reply would confirm data that is not stored.
        if self.storage.has_failed() {
            return;
        }
        // Reported before it leaves: the recording has whatever a client has seen.
        if self.sinks.wants().is_some_and(|wants| wants.sent) {
            self.report(session, at, ReportKind::Sent { bytes: bytes.clone() }, None);
        }
        let delivery = self.wire.send(bytes);
        for news in delivery.losses {
            self.report(session, at, ReportKind::News(news), None);
        }
        let wants = self.sinks.wants();
        if !delivery.heard && wants.is_some_and(|wants| wants.kinds.contain(Kinds::WARNING)) {
            let lost = u64::try_from(bytes.len()).unwrap_or(u64::MAX);
            let event = Event::Warning(Warning::NobodyListens { lost });
            self.report(session, at, ReportKind::Event { command: None, event }, None);
        }
    }

    /// Time has passed. Returns whether a sink wanted to know.
    pub(crate) fn pass_time<D: Device>(&mut self, session: &mut Session<D>) {
        if self.sinks.pass(session.now()) {
            session.settle();
            self.flush(session);
        }
    }

    /// Lets a sink watch from now on.
    pub(crate) fn watch<D: Device>(
        &mut self,
        session: &mut Session<D>,
        sink: Box<dyn Sink>,
    ) -> SinkId {
        let explain = |command: &[u8]| session.device().explain(command);
        let id = self.sinks.add(sink, session.now(), || session.beginning(), &explain);
        self.sinks_changed(session);
        id
    }

    /// Detaches a sink. Returns whether it was still attached.
    pub(crate) fn detach<D: Device>(&mut self, session: &mut Session<D>, id: SinkId) -> bool {
        let was_there = self.sinks.remove(id);
        self.sinks_changed(session);
        was_there
    }

    /// Detaches the sinks that want inputs.
    pub(crate) fn end_recordings<D: Device>(&mut self, session: &mut Session<D>) {
        self.sinks.end_recordings();
        self.sinks_changed(session);
    }

    /// The sinks want other reports than before, or at another time.
    pub(crate) fn sinks_changed<D: Device>(&mut self, session: &mut Session<D>) {
        session.set_wants(self.sinks.wants());
        session.set_watch_due(self.sinks.due());
    }
}
