//! Many clients in one thread.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::os::fd::OwnedFd;
use std::time::Instant;

use rustix::buffer::spare_capacity;
use rustix::event::{Timespec, epoll};

use super::failure::{Doing, Failure, Outcome};
use super::port::{LIMIT, Wire};

/// Clients that are waited for together and served one by one.
pub(crate) struct Crowd {
    streams: Vec<TcpStream>,
    epoll: OwnedFd,
}

impl Crowd {
    /// One client for each address.
    pub(crate) fn connect(addresses: impl Iterator<Item = SocketAddr>) -> Outcome<Crowd> {
        let epoll = epoll::create(epoll::CreateFlags::CLOEXEC).doing("wait for many clients")?;
        let mut streams = Vec::new();
        for address in addresses {
            let stream = Wire::connect(address)?.into_stream();
            stream.set_nonblocking(true).doing("set a connection up")?;
            let number = epoll::EventData::new_u64(streams.len() as u64);
            epoll::add(&epoll, &stream, number, epoll::EventFlags::IN)
                .doing("wait for many clients")?;
            streams.push(stream);
        }
        Ok(Crowd { streams, epoll })
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.streams.len()
    }

    /// Sends something from one client.
    pub(crate) fn send(&mut self, client: usize, bytes: &[u8]) -> Outcome<()> {
        self.streams[client].write_all(bytes).doing("write to the line")
    }

    /// Lets them talk up to a time: whenever bytes have arrived, `turn` is told for which client
    /// and how many, and what it returns is sent from there.
    pub(crate) fn converse<'a>(
        &mut self,
        until: Instant,
        mut turn: impl FnMut(usize, usize) -> Option<&'a [u8]>,
    ) -> Outcome<()> {
        let mut events = Vec::with_capacity(self.streams.len().max(1));
        let mut buffer = [0; 256];
        let limit = Timespec { tv_sec: LIMIT.as_secs() as i64, tv_nsec: 0 };
        while Instant::now() < until {
            let found = epoll::wait(&self.epoll, spare_capacity(&mut events), Some(&limit));
            if found.doing("wait for many clients")? == 0 {
                return Err(Failure::new("no server answers any of the clients"));
            }
            for event in events.drain(..) {
                let client = event.data.u64() as usize;
                let count = match self.streams[client].read(&mut buffer) {
                    Ok(0) => return Err(Failure::new("the server has closed a line")),
                    Ok(count) => count,
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => continue,
                    Err(error) => return Err(Failure::new(format!("cannot read: {error}"))),
                };
                if let Some(answer) = turn(client, count) {
                    self.streams[client].write_all(answer).doing("write to the line")?;
                }
            }
        }
        Ok(())
    }
}
