//! Ctrl-C, and an end that comes from outside.

use std::process;
use std::sync::mpsc;
use std::thread;

use super::cancel::Cancel;
use super::{screen, shell};
use crate::endings::Endings;

/// Lets Ctrl-C end what is under way, and not the console; other ways to ask for an end do end it,
/// after the farewell.
pub(crate) fn listen(cancel: &Cancel, farewell: impl Fn() + Send + 'static) {
    let cancel = cancel.clone();
    let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_all().build() else {
        return;
    };
    let (ready, is_ready) = mpsc::channel();
    // Without the thread Ctrl-C ends the program, as it does everywhere.
    let _ = thread::Builder::new().name("interrupts".to_owned()).spawn(move || {
        runtime.block_on(async {
            let mut endings = Endings::without_interrupt();
            loop {
                tokio::select! {
                    biased;
                    interrupt = tokio::signal::ctrl_c() => match interrupt {
                        Ok(()) => cancel.wish(),
                        Err(_) => return,
                    },
                    _ = endings.told() => {
                        farewell();
                        screen::leave();
                        shell::leave();
                        process::exit(ENDED);
                    }
                    () = tell(&ready) => {}
                }
            }
        });
    });
    let _ = is_ready.recv();
}

/// Says that what is waited for before it is heard from now on, and is never done.
async fn tell(ready: &mpsc::Sender<()>) {
    let _ = ready.send(());
    std::future::pending().await
}

/// The exit code of a program that was told to end, as shells have it.
const ENDED: i32 = 143;
