//! The line over TCP: raw bytes and nothing else, or with settings and modem lines (RFC 2217).

use std::collections::VecDeque;
use std::fmt;
use std::future::Future;
use std::io;
use std::net::{Shutdown, SocketAddr};
use std::pin::Pin;
use std::str::FromStr;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use socket2::{SockRef, TcpKeepalive};
use thiserror::Error;
use tokio::io::{AsyncRead, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::time::{Sleep, sleep};
use vimc4_device::ModemLine;

use super::outbox::Outbox;
use super::telnet::Telnet;
#[cfg(target_os = "linux")]
use super::vigil::{self, Vigil};
use super::{Received, Sent, Transport};
use crate::LineEvent;
use crate::wake_flag::WakeFlag;

/// How long a newcomer waits for the holder's end before it is refused. A client that closes
/// and connects again at once overtakes the news of its own closing.
const GRACE: Duration = Duration::from_millis(100);

/// How many newcomers wait, and how many clients watch. A flood of connections gets no further than
/// this.
const CROWD: usize = 16;

/// How long a refused client has to read why, and to close. A connection that is closed before its bytes
/// were read is reset, and what was sent to it is lost.
const FAREWELL: Duration = Duration::from_secs(1);

/// A silent client is asked for a sign of life this often, and has vanished after three times
/// without one. That is 12 s, and with the kernel's own leisure no more than 15 s.
const SIGN_OF_LIFE: Duration = Duration::from_secs(4);

/// What happens to a second client while a first one holds the line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clients {
    /// It is turned away: two programs that drive one machine are an accident.
    #[default]
    Refuse,
    /// It gets the line, and the first one is disconnected.
    Takeover,
    /// It may listen: it sees what the controller sends, and what it writes is ignored.
    Observe,
}

impl FromStr for Clients {
    type Err = String;

    fn from_str(text: &str) -> Result<Clients, String> {
        match text {
            "refuse" => Ok(Clients::Refuse),
            "takeover" => Ok(Clients::Takeover),
            "observe" => Ok(Clients::Observe),
            _ => Err(format!("`{text}` is none of refuse, takeover, observe")),
        }
    }
}

impl fmt::Display for Clients {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Clients::Refuse => "refuse",
            Clients::Takeover => "takeover",
            Clients::Observe => "observe",
        })
    }
}

/// A listening address of a controller. One client holds the line at a time.
#[derive(Debug)]
pub struct Tcp {
    label: Arc<str>,
    listener: TcpListener,
    /// Rings when a connection comes in.
    wake_flag: WakeFlag,
    address: SocketAddr,
    policy: Clients,
    holder: Option<Client>,
    observers: Vec<Client>,
    waiting: VecDeque<(Client, Pin<Box<Sleep>>)>,
    /// Clients that were refused and have not closed yet.
    refused: VecDeque<(Client, Pin<Box<Sleep>>)>,
    /// Set while the system has no descriptors left for newcomers.
    exhausted: Option<Pin<Box<Sleep>>>,
    news: VecDeque<LineEvent>,
    /// Clients have settings and modem lines.
    has_lines: bool,
    /// The speed of the device's line, in bits per second.
    baud: u32,
    /// Whether clients may send, as CTS says.
    ready: bool,
    /// What the device shows on a line of its own.
    line: Option<(ModemLine, bool)>,
}

/// Why an address cannot be listened on.
#[derive(Debug, Error)]
pub enum TcpError {
    /// Something listens there already.
    #[error(
        "port {port} at {ip} is taken; end the program that has it, or choose another address \
         (port 0 finds a free one)",
        port = .0.port(), ip = .0.ip()
    )]
    Taken(SocketAddr),
    /// Anything else.
    #[error("cannot listen at {address}: {source}; choose an address of this computer")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the operating system says.
        source: io::Error,
    },
}

#[derive(Debug)]
struct Client {
    stream: TcpStream,
    peer: SocketAddr,
    outbox: Outbox,
    /// It has closed its side, or both: that looks the same until something is sent.
    finished: bool,
    /// What was sent since then, in bytes.
    sent_since: u64,
    /// Nothing more will come for it.
    dismissed: bool,
    /// It does not answer any more.
    vanished: bool,
    /// It only observes, and was told of when it sent something all the same.
    told: bool,
    /// Its settings and modem lines, where it has any.
    telnet: Option<Box<Telnet>>,
    #[cfg(target_os = "linux")]
    vigil: Vigil,
}

impl Client {
    fn new(stream: TcpStream, peer: SocketAddr, telnet: Option<Telnet>) -> Client {
        Client {
            stream,
            peer,
            outbox: Outbox::default(),
            finished: false,
            sent_since: 0,
            dismissed: false,
            vanished: false,
            told: false,
            telnet: telnet.map(Box::new),
            #[cfg(target_os = "linux")]
            vigil: Vigil::default(),
        }
    }
}

impl Tcp {
    /// Listens at the address for clients that send raw bytes; port 0 picks a free one. It must be
    /// called within a tokio runtime.
    ///
    /// # Errors
    ///
    /// If the address is taken, or is none of this computer.
    pub fn bind(address: SocketAddr, policy: Clients) -> Result<Tcp, TcpError> {
        Tcp::listen(address, policy, false)
    }

    /// The same for clients that speak RFC 2217: Telnet with the settings and the modem lines of a
    /// serial port.
    ///
    /// # Errors
    ///
    /// As [`bind`](Tcp::bind).
    pub fn bind_rfc2217(address: SocketAddr, policy: Clients) -> Result<Tcp, TcpError> {
        Tcp::listen(address, policy, true)
    }

    fn listen(address: SocketAddr, policy: Clients, has_lines: bool) -> Result<Tcp, TcpError> {
        let failed = |source: io::Error| match source.kind() {
            io::ErrorKind::AddrInUse => TcpError::Taken(address),
            _ => TcpError::Listen { address, source },
        };
        // The standard library's listener, made without waiting, has SO_REUSEADDR on Unix.
        let listener = std::net::TcpListener::bind(address).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        Ok(Tcp {
            label: Arc::from(format!("{} {address}", if has_lines { "rfc2217" } else { "tcp" })),
            listener: TcpListener::from_std(listener).map_err(failed)?,
            wake_flag: WakeFlag::default(),
            address,
            policy,
            holder: None,
            observers: Vec::new(),
            waiting: VecDeque::new(),
            refused: VecDeque::new(),
            exhausted: None,
            news: VecDeque::new(),
            has_lines,
            baud: 0,
            ready: true,
            line: None,
        })
    }

    /// Where it listens.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Accepts every incoming connection.
    fn accept(&mut self, cx: &mut Context<'_>) {
        if let Some(pause) = &mut self.exhausted {
            if pause.as_mut().poll(cx).is_pending() {
                return;
            }
            self.exhausted = None;
        }
        loop {
            let Tcp { listener, wake_flag, .. } = self;
            let Poll::Ready(accepted) = wake_flag.poll(cx, |cx| listener.poll_accept(cx)) else {
                return;
            };
            match accepted {
                Ok((stream, peer)) => {
                    prepare(&stream);
                    let telnet = self.has_lines.then(|| Telnet::new(self.baud));
                    let mut client = Client::new(stream, peer, telnet);
                    client.set_line(ModemLine::Cts, self.ready);
                    if let Some((line, on)) = self.line {
                        client.set_line(line, on);
                    }
                    self.admit(client);
                }
                Err(error) if is_of_one_connection(&error) => {}
                Err(_) => {
                    // Out of descriptors: the connection stays in the queue, and asking for it
                    // again at once would be a busy loop.
                    let mut pause = Box::pin(sleep(Duration::from_secs(1)));
                    if pause.as_mut().poll(cx).is_pending() {
                        self.exhausted = Some(pause);
                        return;
                    }
                }
            }
        }
    }

    fn admit(&mut self, client: Client) {
        match (&self.holder, self.policy) {
            (None, _) => self.hold(client),
            // Most clients that close are gone, and none that comes after them shall be refused.
            (Some(holder), _) if holder.finished => {
                self.release(None);
                self.hold(client);
            }
            (Some(_), Clients::Takeover) => {
                self.release(Some(client.peer.to_string()));
                self.hold(client);
            }
            (Some(_), Clients::Observe) if self.observers.len() < CROWD => {
                self.opened(&client, true);
                self.observers.push(client);
            }
            (Some(_), Clients::Refuse) if self.waiting.len() < CROWD => {
                self.waiting.push_back((client, Box::pin(sleep(GRACE))));
            }
            (Some(_), _) => self.refuse(client),
        }
    }

    fn hold(&mut self, client: Client) {
        self.opened(&client, false);
        self.holder = Some(client);
    }

    fn opened(&mut self, client: &Client, observes: bool) {
        let (transport, client) = (Arc::clone(&self.label), client.peer.to_string());
        self.news.push_back(LineEvent::Opened { transport, client, observes });
    }

    /// The holder is gone, or somebody takes its place; the one that has waited longest comes next.
    fn release(&mut self, taken_by: Option<String>) {
        if let Some(mut holder) = self.holder.take() {
            let (transport, client) = (Arc::clone(&self.label), holder.peer.to_string());
            let mut lost = holder.outbox.clear();
            if holder.finished && matches!(holder.stream.take_error(), Ok(Some(_))) {
                // It was gone altogether: its system has refused what was sent.
                lost = holder.sent_since;
            }
            if lost > 0 {
                let transport = Arc::clone(&self.label);
                self.news.push_back(LineEvent::Lost { transport, bytes: lost });
            }
            self.news.push_back(LineEvent::Closed { transport, client, observes: false, taken_by });
        }
        if let Some((client, _)) = self.waiting.pop_front() {
            self.hold(client);
        }
    }

    /// Tells a client why it is refused, and closes our side of its connection.
    fn refuse(&mut self, client: Client) {
        let holder = self.holder.as_ref().map_or_else(String::new, |c| c.peer.to_string());
        let socket = SockRef::from(&client.stream);
        // A new connection has room for a line. Whatever fails here, it is closed.
        let _ = socket.send(format!("refused: {holder} has the line\r\n").as_bytes());
        let _ = socket.shutdown(Shutdown::Write);
        self.news.push_back(LineEvent::Refused {
            transport: Arc::clone(&self.label),
            client: client.peer.to_string(),
            holder,
        });
        if self.refused.len() < CROWD {
            self.refused.push_back((client, Box::pin(sleep(FAREWELL))));
        }
    }

    /// Reads from the refused clients until they close.
    fn attend_refused(&mut self, cx: &mut Context<'_>) {
        self.refused.retain_mut(|(client, time)| {
            if time.as_mut().poll(cx).is_ready() {
                return false;
            }
            let mut ignored = [0; 4_096];
            for _ in 0..16 {
                match client.poll_read(cx, &mut ignored) {
                    Poll::Pending => return true,
                    Poll::Ready(Ok(n)) if n > 0 => {}
                    Poll::Ready(_) => return false,
                }
            }
            // It sends without a pause; others have their turn.
            cx.waker().wake_by_ref();
            true
        });
    }

    /// Refuses the newcomers that waited in vain. The holder's stream was empty just now, not
    /// ended.
    fn expire(&mut self, cx: &mut Context<'_>) {
        for (client, mut grace) in std::mem::take(&mut self.waiting) {
            match grace.as_mut().poll(cx) {
                Poll::Pending => self.waiting.push_back((client, grace)),
                Poll::Ready(()) => self.refuse(client),
            }
        }
        self.attend_refused(cx);
    }

    /// Observers are read only to see them leave.
    fn attend_observers(&mut self, cx: &mut Context<'_>) {
        let Tcp { observers, news, label, baud, .. } = self;
        observers.retain_mut(|observer| {
            let mut ignored = [0; 256];
            while !observer.vanished {
                match observer.poll_read(cx, &mut ignored) {
                    Poll::Pending => return true,
                    Poll::Ready(Ok(n)) if n > 0 => {
                        if observer.decode(&mut ignored[..n], *baud, label, news) > 0
                            && !std::mem::replace(&mut observer.told, true)
                        {
                            let (transport, client) =
                                (Arc::clone(label), observer.peer.to_string());
                            news.push_back(LineEvent::Unheard { transport, client });
                        }
                    }
                    Poll::Ready(_) => break,
                }
            }
            news.push_back(LineEvent::Closed {
                transport: Arc::clone(label),
                client: observer.peer.to_string(),
                observes: true,
                taken_by: None,
            });
            false
        });
    }
}

impl Transport for Tcp {
    fn label(&self) -> &Arc<str> {
        &self.label
    }

    fn client_baud(&mut self) -> Option<u32> {
        Some(self.holder.as_ref()?.telnet.as_ref()?.baud())
    }

    fn poll_receive(&mut self, cx: &mut Context<'_>, buffer: &mut [u8]) -> Poll<Received> {
        self.accept(cx);
        self.attend_observers(cx);
        while let Some(holder) = &mut self.holder {
            if let Some(news) = self.news.pop_front() {
                return Poll::Ready(Received::News(news));
            }
            if holder.vanished {
                self.release(None);
                continue;
            }
            if holder.finished {
                // A client that waits for the line comes before one that only listens on.
                if self.waiting.is_empty() && !(holder.dismissed && holder.outbox.is_empty()) {
                    break;
                }
                self.release(None);
                continue;
            }
            if buffer.is_empty() {
                break;
            }
            match holder.poll_read(cx, buffer) {
                Poll::Pending => break,
                Poll::Ready(Ok(n)) if n > 0 => {
                    let Tcp { label, news, baud, .. } = self;
                    let count = holder.decode(&mut buffer[..n], *baud, label, news);
                    if count > 0 {
                        return Poll::Ready(Received::Bytes(count));
                    }
                }
                Poll::Ready(Ok(_)) => {
                    holder.finished = true;
                    return Poll::Ready(Received::Finished);
                }
                Poll::Ready(Err(_)) => self.release(None),
            }
        }
        self.expire(cx);
        match self.news.pop_front() {
            Some(news) => Poll::Ready(Received::News(news)),
            None => Poll::Pending,
        }
    }

    fn poll_send(&mut self, cx: &mut Context<'_>) {
        for client in self.holder.iter_mut().chain(&mut self.observers) {
            let waited = !client.outbox.is_empty();
            let flushed = client.poll_flush(cx);
            client.mind(flushed);
            client.poll_vigil(cx);
            if waited && client.dismissed && client.outbox.is_empty() {
                // It has everything now; receiving is where it is let go.
                cx.waker().wake_by_ref();
            }
        }
    }

    fn send(&mut self, bytes: &[u8]) -> Sent {
        let mut sent = Sent::Nobody;
        for client in self.holder.iter_mut().chain(&mut self.observers) {
            let result = client.send(bytes);
            sent = match (&result, sent) {
                (Ok(0), Sent::Nobody) => Sent::Accepted,
                (Ok(lost), Sent::Lost(before)) => Sent::Lost(before.saturating_add(*lost)),
                (Ok(lost), _) if *lost > 0 => Sent::Lost(*lost),
                (Ok(_) | Err(_), sent) => sent,
            };
            if client.finished {
                client.sent_since += u64::try_from(bytes.len()).unwrap_or(u64::MAX);
            }
            client.mind(result);
            #[cfg(target_os = "linux")]
            client.vigil.begin();
        }
        sent
    }

    fn set_baud(&mut self, baud: u32) {
        self.baud = baud;
    }

    fn set_ready(&mut self, ready: bool) {
        self.ready = ready;
        for client in self.holder.iter_mut().chain(&mut self.observers) {
            client.set_line(ModemLine::Cts, ready);
        }
    }

    fn set_line(&mut self, line: ModemLine, on: bool) {
        self.line = Some((line, on));
        for client in self.holder.iter_mut().chain(&mut self.observers) {
            client.set_line(line, on);
        }
    }

    fn has_listener(&self) -> bool {
        self.holder.as_ref().is_some_and(|holder| holder.finished && !holder.dismissed)
    }

    fn dismiss_listener(&mut self) {
        if let Some(holder) = &mut self.holder {
            holder.dismissed = holder.finished;
        }
    }
}

impl Client {
    /// A client that cannot be written to is gone. One that still speaks is seen to be gone when
    /// it is read; one that only listened has nothing to wait for.
    fn mind<T>(&mut self, written: io::Result<T>) {
        if written.is_err() && self.finished {
            self.outbox.clear();
            self.dismissed = true;
        }
    }

    /// Looks whether it is still there, if that is due.
    fn poll_vigil(&mut self, cx: &mut Context<'_>) {
        #[cfg(target_os = "linux")]
        if !self.vanished && self.vigil.poll(cx, &self.stream).is_ready() {
            self.vanished = true;
            // Receiving is where it is let go.
            cx.waker().wake_by_ref();
        }
        #[cfg(not(target_os = "linux"))]
        let _ = cx;
    }

    fn poll_read(&mut self, cx: &mut Context<'_>, buffer: &mut [u8]) -> Poll<io::Result<usize>> {
        let mut read = ReadBuf::new(buffer);
        ready!(Pin::new(&mut self.stream).poll_read(cx, &mut read))?;
        Poll::Ready(Ok(read.filled().len()))
    }

    /// What is in the bytes for the device comes to their beginning; the rest is between the client
    /// and its port. Returns how many they are.
    fn decode(
        &mut self,
        bytes: &mut [u8],
        line: u32,
        label: &Arc<str>,
        news: &mut VecDeque<LineEvent>,
    ) -> usize {
        let Some(telnet) = &mut self.telnet else { return bytes.len() };
        let count = telnet.receive(bytes, line, label, news);
        self.reply();
        count
    }

    /// A line of the device is on or off now, which a client with lines may want to know.
    fn set_line(&mut self, line: ModemLine, on: bool) {
        if let Some(telnet) = &mut self.telnet {
            telnet.set_line(line, on);
        }
        self.reply();
    }

    /// Whether the client has asked for nothing to be sent to it.
    fn is_suspended(&self) -> bool {
        self.telnet.as_ref().is_some_and(|telnet| telnet.is_suspended())
    }

    /// Sends what the client's port has to say, and what has waited for it.
    fn reply(&mut self) {
        let suspended = self.is_suspended();
        let Client { stream, outbox, telnet, .. } = self;
        let Some(telnet) = telnet else { return };
        let replies = telnet.take_replies();
        // A client that cannot be written to is seen to be gone when it is read.
        let _ = outbox.send(&replies, writer(stream, suspended));
        let _ = outbox.flush(writer(stream, suspended));
    }

    /// Sends what the device says. Returns how many bytes were lost.
    fn send(&mut self, bytes: &[u8]) -> io::Result<u64> {
        let suspended = self.is_suspended();
        let Client { stream, outbox, telnet, .. } = self;
        let bytes = telnet.as_mut().map_or(bytes, |telnet| telnet.escaped(bytes));
        outbox.send(bytes, writer(stream, suspended))
    }

    /// Passes on what waits, as far as the client takes it.
    fn poll_flush(&mut self, cx: &mut Context<'_>) -> io::Result<()> {
        while !self.outbox.is_empty() && !self.is_suspended() {
            match self.stream.poll_write_ready(cx) {
                Poll::Ready(ready) => ready?,
                Poll::Pending => break,
            }
            let Client { stream, outbox, .. } = self;
            outbox.flush(|bytes| stream.try_write(bytes))?;
        }
        Ok(())
    }
}

/// Writes to a client as far as it takes it, or not at all while it wants nothing.
fn writer(stream: &TcpStream, suspended: bool) -> impl Fn(&[u8]) -> io::Result<usize> {
    move |bytes| {
        if suspended { Err(io::ErrorKind::WouldBlock.into()) } else { stream.try_write(bytes) }
    }
}

/// A client answers commands one by one: its bytes must not wait for company, and its absence
/// must be noticed although a quiet line is normal. What the system does not offer is left out.
fn prepare(stream: &TcpStream) {
    let _ = stream.set_nodelay(true);
    let socket = SockRef::from(stream);
    let keepalive = TcpKeepalive::new().with_time(SIGN_OF_LIFE).with_interval(SIGN_OF_LIFE);
    #[cfg(not(windows))]
    let keepalive = keepalive.with_retries(2);
    let _ = socket.set_tcp_keepalive(&keepalive);
    #[cfg(target_os = "linux")]
    vigil::prepare(stream);
}

/// Errors of the connection that was to be accepted, which say nothing about the listener.
fn is_of_one_connection(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::ConnectionAborted
            | io::ErrorKind::ConnectionReset
            | io::ErrorKind::ConnectionRefused
            | io::ErrorKind::Interrupted
    )
}
