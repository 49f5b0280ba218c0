//! The line to a controller from within the process.

use std::io::{ErrorKind, Read, Write};
use std::ptr;
use std::slice;
use std::time::Duration;

use vimc4::MemoryPort;

use crate::emulator::{Emulator, controller};
use crate::error::{Failure, guarded};

/// A line to a controller, as a serial port that is open.
#[derive(Debug)]
pub struct Port(MemoryPort);

/// The line behind a pointer.
///
/// # Safety
///
/// The pointer is one that `vimc4_connect` has returned and that was not closed yet, or NULL, and no other
/// function is at work with it.
unsafe fn port<'a>(line: *mut Port) -> Result<&'a mut MemoryPort, Failure> {
    // SAFETY: the caller says that it is NULL or a box of `vimc4_connect` that nobody else uses now.
    let port = unsafe { line.as_mut() }.ok_or_else(|| Failure::new("the line is NULL"))?;
    Ok(&mut port.0)
}

/// Opens the line from within the process: a serial port without an operating system. To be closed with
/// vimc4_line_close; it may outlive the controller.
///
/// # Safety
///
/// `emulator` was started and not stopped yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_connect(emulator: *const Emulator) -> *mut Port {
    guarded(ptr::null_mut(), || {
        // SAFETY: as this function asks for.
        let emulator = unsafe { controller(emulator) }?;
        Ok(Box::into_raw(Box::new(Port(emulator.emulator.connect()?))))
    })
}

/// Closes a line. NULL is nothing to be closed.
///
/// # Safety
///
/// `line` is NULL, or was connected and not closed yet, and no other function is at work with it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_line_close(line: *mut Port) {
    guarded((), || {
        if !line.is_null() {
            // SAFETY: the caller says that it is a box of `vimc4_connect` that nobody uses any more.
            drop(unsafe { Box::from_raw(line) });
        }
        Ok(())
    });
}

/// Reads what the controller has sent, at most `count` bytes, and waits for the first one so many milliseconds
/// of wall time. Returns how many bytes they are; 0 when the time is over or the controller has ended.
///
/// # Safety
///
/// `line` was connected and not closed yet; `bytes` has room for `count` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_line_read(
    line: *mut Port,
    bytes: *mut u8,
    count: usize,
    milliseconds: u32,
) -> isize {
    guarded(-1, || {
        // SAFETY: as this function asks for.
        let port = unsafe { port(line) }?;
        if count == 0 {
            return Ok(0);
        }
        if bytes.is_null() {
            return Err(Failure::new("there are bytes to be read, but no room for them"));
        }
        port.set_timeout(Duration::from_millis(milliseconds.into()));
        let mut read = vec![0; count.min(1 << 20)];
        let read = match port.read(&mut read) {
            Ok(count) => &read[..count],
            Err(error) if error.kind() == ErrorKind::TimedOut => &[],
            Err(error) => return Err(Failure::of(error)),
        };
        // SAFETY: no more was read than there is room for, and that is not a memory of ours.
        unsafe { ptr::copy_nonoverlapping(read.as_ptr(), bytes, read.len()) };
        isize::try_from(read.len()).map_err(Failure::of)
    })
}

/// Sends bytes to the controller, and waits so many milliseconds of wall time where it takes none. Returns how
/// many were sent: all, or fewer when the time is over.
///
/// # Safety
///
/// `line` was connected and not closed yet; `bytes` are `count` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_line_write(
    line: *mut Port,
    bytes: *const u8,
    count: usize,
    milliseconds: u32,
) -> isize {
    guarded(-1, || {
        // SAFETY: as this function asks for.
        let port = unsafe { port(line) }?;
        if count == 0 {
            return Ok(0);
        }
        if bytes.is_null() || isize::try_from(count).is_err() {
            return Err(Failure::new("there are bytes to be sent, but they are nowhere"));
        }
        // SAFETY: the caller says that these are `count` bytes, which nobody changes meanwhile, and `count`
        // was looked at.
        let bytes = unsafe { slice::from_raw_parts(bytes, count) };
        port.set_timeout(Duration::from_millis(milliseconds.into()));
        let mut sent = 0;
        while sent < bytes.len() {
            match port.write(&bytes[sent..]) {
                Ok(count) => sent += count,
                Err(error) if error.kind() == ErrorKind::TimedOut => break,
                Err(error) => return Err(Failure::of(error)),
            }
        }
        isize::try_from(sent).map_err(Failure::of)
    })
}
