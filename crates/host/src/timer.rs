//! A timer that rings on time.
//!
//! The timers of tokio tick in milliseconds, and a character at 19,200 baud takes half of one.
//! On Linux the kernel rings instead: a timerfd is waited for beside the sockets, so no thread
//! stands between its ringing and the task. Elsewhere the milliseconds have to do; the model's
//! times are exact all the same, only the bytes leave a little late.

#[cfg(target_os = "linux")]
pub(crate) use linux::Timer;
#[cfg(not(target_os = "linux"))]
pub(crate) use portable::Timer;

#[cfg(target_os = "linux")]
mod linux {
    use std::io;
    use std::task::{Context, Poll};
    use std::time::Instant;

    use rustix::time::{
        Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, timerfd_create,
        timerfd_settime,
    };
    use tokio::net::unix::pipe;

    use crate::wake_flag::WakeFlag;

    /// One alarm, which can be set, moved and cleared.
    ///
    /// A timerfd is readable when it rings, which is all that tokio's reading end of a pipe
    /// asks of its descriptor; `AsyncFd`, made for the purpose, has no safe constructor.
    #[derive(Debug)]
    pub(crate) struct Timer {
        fd: pipe::Receiver,
        armed: Option<Instant>,
        wake_flag: WakeFlag,
    }

    impl Timer {
        pub(crate) fn new() -> io::Result<Timer> {
            let flags = TimerfdFlags::NONBLOCK | TimerfdFlags::CLOEXEC;
            let fd = timerfd_create(TimerfdClockId::Monotonic, flags)?;
            Ok(Timer {
                fd: pipe::Receiver::from_owned_fd_unchecked(fd)?,
                armed: None,
                wake_flag: WakeFlag::default(),
            })
        }

        /// Rings at `moment`, at once if that is past, never with `None`. Setting the alarm it
        /// already has costs nothing.
        pub(crate) fn arm(&mut self, moment: Option<Instant>) -> io::Result<()> {
            if self.armed == moment {
                return Ok(());
            }
            let zero = Timespec { tv_sec: 0, tv_nsec: 0 };
            let it_value = match moment {
                None => zero,
                Some(moment) => {
                    // Zero would clear the alarm instead of letting it ring at once.
                    let span = moment.saturating_duration_since(Instant::now());
                    Timespec {
                        tv_sec: i64::try_from(span.as_secs()).unwrap_or(i64::MAX),
                        tv_nsec: i64::from(span.subsec_nanos()).max(i64::from(span.is_zero())),
                    }
                }
            };
            timerfd_settime(
                &self.fd,
                TimerfdTimerFlags::empty(),
                &Itimerspec { it_interval: zero, it_value },
            )?;
            self.armed = moment;
            Ok(())
        }

        /// Ready once after the alarm rang.
        pub(crate) fn poll(&mut self, cx: &mut Context<'_>) -> Poll<()> {
            let Timer { fd, armed, wake_flag } = self;
            wake_flag.poll(cx, |cx| {
                let mut rings = [0; 8];
                while let Poll::Ready(Ok(())) = fd.poll_read_ready(cx) {
                    match fd.try_read(&mut rings) {
                        Ok(_) => {
                            *armed = None;
                            return Poll::Ready(());
                        }
                        // The readiness was stale and is cleared now; asking again registers us.
                        Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                        Err(_) => break,
                    }
                }
                Poll::Pending
            })
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod portable {
    use std::future::Future;
    use std::io;
    use std::pin::Pin;
    use std::task::{Context, Poll};
    use std::time::Instant;

    /// One alarm, which can be set, moved and cleared.
    #[derive(Debug)]
    pub(crate) struct Timer {
        sleep: Option<Pin<Box<tokio::time::Sleep>>>,
        armed: Option<Instant>,
    }

    impl Timer {
        pub(crate) fn new() -> io::Result<Timer> {
            Ok(Timer { sleep: None, armed: None })
        }

        pub(crate) fn arm(&mut self, moment: Option<Instant>) -> io::Result<()> {
            if self.armed != moment {
                self.armed = moment;
                self.sleep = moment.map(|moment| Box::pin(tokio::time::sleep_until(moment.into())));
            }
            Ok(())
        }

        pub(crate) fn poll(&mut self, cx: &mut Context<'_>) -> Poll<()> {
            let Some(sleep) = &mut self.sleep else { return Poll::Pending };
            match sleep.as_mut().poll(cx) {
                Poll::Pending => Poll::Pending,
                Poll::Ready(()) => {
                    self.sleep = None;
                    self.armed = None;
                    Poll::Ready(())
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::future::poll_fn;
    use std::time::{Duration, Instant};

    use super::Timer;

    #[test]
    fn an_alarm_rings_once_and_on_time() {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let mut timer = Timer::new().unwrap();
            let began = Instant::now();
            timer.arm(Some(began + Duration::from_millis(3))).unwrap();
            poll_fn(|cx| timer.poll(cx)).await;
            assert!(began.elapsed() >= Duration::from_millis(3));
            // Past moments ring at once, and a cleared alarm does not ring.
            timer.arm(Some(began)).unwrap();
            poll_fn(|cx| timer.poll(cx)).await;
            timer.arm(Some(Instant::now() + Duration::from_millis(5))).unwrap();
            timer.arm(None).unwrap();
            let silent =
                tokio::time::timeout(Duration::from_millis(20), poll_fn(|cx| timer.poll(cx)));
            assert!(silent.await.is_err());
        });
    }
}
