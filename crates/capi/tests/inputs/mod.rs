//! What must hold whatever a caller in C hands over: used by the test beside this and by the fuzz target
//! `capi`.

#![expect(unsafe_code, reason = "it calls the interface as C does")]

use std::ffi::{CStr, CString, c_char};
use std::ptr;

use vimc4_c::*;

/// Options that would touch files and ports of the machine this runs on.
const OUTSIDE: [&[u8]; 6] = [b"pty=", b"tcp=", b"rfc2217=", b"serial=", b"flash=", b"record="];

/// Time that passes in one call, at most.
const MINUTE: u64 = 60_000_000_000;

/// Hands over what the lines say: options up to an empty line, then calls, each by its first byte.
///
/// # Panics
///
/// If something does not hold.
pub(crate) fn inputs(data: &[u8]) {
    let mut lines = data.split(|byte| *byte == b'\n').take(200);
    let inside = |line: &&[u8]| {
        let is_file = |line: &[u8]| line.starts_with(b"m") && line.contains(&b'/');
        !OUTSIDE.iter().any(|key| line.starts_with(key)) && !is_file(line)
    };
    let mut options: Vec<CString> =
        lines.by_ref().take_while(|line| !line.is_empty()).filter(inside).map(text).collect();
    // Nothing waits for the wall.
    options.push(text(b"time=manual"));
    let mut places: Vec<*const c_char> = options.iter().map(|text| text.as_ptr()).collect();
    places.push(ptr::null());
    // SAFETY: the texts are there, and NULL is behind the last one.
    let emulator = unsafe { vimc4_start(places.as_ptr()) };
    if emulator.is_null() {
        return failed();
    }
    // SAFETY: it was started.
    let mut line = unsafe { vimc4_connect(emulator) };
    let mut snapshot = ptr::null_mut();
    for call in lines {
        let Some((what, rest)) = call.split_first() else { continue };
        let argument = text(rest);
        let number = rest.iter().take_while(|byte| byte.is_ascii_digit());
        let number = number
            .fold(0_u64, |sum, digit| sum.wrapping_mul(10).wrapping_add(u64::from(digit - b'0')));
        match what {
            // SAFETY: it was started, and the argument is a text.
            b'o' => told(unsafe { vimc4_order(emulator, argument.as_ptr()) }),
            // SAFETY: as above.
            b'u' => went(unsafe { vimc4_run_until(emulator, argument.as_ptr()) }),
            // SAFETY: as above.
            b's' => went(unsafe { vimc4_set_signal(emulator, argument.as_ptr(), number as i32) }),
            b'S' => {
                let name = text(&rest[rest.iter().take_while(|b| b.is_ascii_digit()).count()..]);
                // SAFETY: as above.
                went(unsafe { vimc4_set_signal(emulator, name.as_ptr(), number as i32) });
            }
            // SAFETY: it was started.
            b'a' => went(unsafe { vimc4_advance(emulator, number % MINUTE) }),
            b'w' => {
                // SAFETY: it is connected, and the bytes are as many.
                let sent = unsafe { vimc4_line_write(line, rest.as_ptr(), rest.len(), 0) };
                assert!(usize::try_from(sent).is_ok_and(|sent| sent <= rest.len()) || sent == -1);
            }
            b'r' => {
                let mut room = vec![0; (number % 4096) as usize];
                // SAFETY: it is connected, and there is so much room.
                let read = unsafe { vimc4_line_read(line, room.as_mut_ptr(), room.len(), 0) };
                assert!(usize::try_from(read).is_ok_and(|read| read <= room.len()));
            }
            b'p' => {
                let mut steps = vec![i64::MIN; (number % 8) as usize];
                // SAFETY: it was started, and there is so much room.
                let axes = unsafe { vimc4_position(emulator, steps.as_mut_ptr(), steps.len()) };
                assert!((1..=4).contains(&axes));
                let written = steps.iter().filter(|steps| **steps != i64::MIN).count();
                assert_eq!(written, steps.len().min(axes as usize));
            }
            b'v' => {
                // SAFETY: it was started.
                json(unsafe { vimc4_view(emulator) });
                // SAFETY: it was started.
                json(unsafe { vimc4_commands(emulator) });
                // SAFETY: it was started.
                json(unsafe { vimc4_events(emulator) });
            }
            // SAFETY: it was started.
            b'f' => went(unsafe { vimc4_forget(emulator) }),
            b'k' => {
                // SAFETY: it was taken or is NULL, and is not used any more.
                unsafe { vimc4_snapshot_free(snapshot) };
                // SAFETY: it was started.
                snapshot = unsafe { vimc4_snapshot_take(emulator) };
            }
            // SAFETY: it was started, and the snapshot was taken or is NULL.
            b'b' => went(unsafe { vimc4_restore(emulator, snapshot) }),
            b'c' => {
                // SAFETY: it was connected, and is not used any more.
                unsafe { vimc4_line_close(line) };
                // SAFETY: it was started.
                line = unsafe { vimc4_connect(emulator) };
            }
            // What is nowhere is refused.
            b'n' => {
                // SAFETY: NULL is what this is about.
                went(unsafe { vimc4_run_until(emulator, ptr::null()) });
                // SAFETY: as above.
                told(unsafe { vimc4_order(ptr::null(), argument.as_ptr()) });
                // SAFETY: as above.
                let sent = unsafe { vimc4_line_write(line, ptr::null(), rest.len(), 0) };
                assert_eq!(sent, if rest.is_empty() { 0 } else { -1 });
            }
            _ => {}
        }
    }
    // SAFETY: each was started, connected or taken, or is NULL, and none is used any more.
    unsafe { vimc4_stop(emulator) };
    // SAFETY: as above.
    unsafe { vimc4_line_close(line) };
    // SAFETY: as above.
    unsafe { vimc4_snapshot_free(snapshot) };
}

/// A text up to its first zero, of any bytes.
fn text(bytes: &[u8]) -> CString {
    let bytes = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
    CString::new(bytes).unwrap_or_default()
}

/// A call has failed, and says why.
fn failed() {
    // SAFETY: it is a text until the next call that fails.
    let why = unsafe { CStr::from_ptr(vimc4_last_error()) };
    let why = why.to_str().unwrap_or_else(|error| unreachable!("{error}: {why:?}"));
    assert!(!why.is_empty() && !why.starts_with("a defect"), "{why}");
}

fn went(result: impl Into<i64>) {
    let result = result.into();
    assert!(result >= -1, "{result}");
    if result == -1 {
        failed();
    }
}

/// What a call has said, which is freed.
fn said(text: *mut c_char) -> Option<String> {
    if text.is_null() {
        failed();
        return None;
    }
    // SAFETY: it is a text that nobody else has.
    let said = unsafe { CStr::from_ptr(text) }.to_str().map(str::to_owned);
    // SAFETY: it was returned to be freed.
    unsafe { vimc4_free(text) };
    Some(said.unwrap_or_else(|error| unreachable!("{error}")))
}

fn told(text: *mut c_char) {
    said(text);
}

fn json(text: *mut c_char) {
    let said = said(text).unwrap_or_else(|| unreachable!("it has ended"));
    let read = serde_json::from_str::<serde_json::Value>(&said);
    assert!(read.is_ok(), "{said}");
}
