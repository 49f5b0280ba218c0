//! How JavaScript calls the desk, where nothing generates the glue: texts are handed over in linear memory.
//!
//! The page asks for room ([`room`]), writes a request there, and calls [`ask`] or [`hear`], which answer
//! the length of what is to be read at [`answer`]. A module has one desk, and one thread.
#![expect(
    unsafe_code,
    reason = "names that JavaScript can find, and nothing else: no block is unsafe"
)]

use std::cell::RefCell;

use crate::Desk;

/// What JavaScript and the desk hand over to each other.
#[derive(Default)]
struct Counter {
    desk: Desk,
    request: Vec<u8>,
    answer: Vec<u8>,
}

thread_local! {
    static COUNTER: RefCell<Counter> = RefCell::default();
}

/// Makes room for a request of so many bytes, and says where.
#[unsafe(no_mangle)]
pub extern "C" fn room(bytes: usize) -> *mut u8 {
    COUNTER.with_borrow_mut(|counter| {
        counter.request.clear();
        counter.request.resize(bytes, 0);
        counter.request.as_mut_ptr()
    })
}

/// Answers the request, which is three lines: the method, the path, and all that follows is the body. Returns
/// the length of the answer: the status, a line that says `json` or `text`, and the body.
#[unsafe(no_mangle)]
pub extern "C" fn ask(now: f64) -> usize {
    COUNTER.with_borrow_mut(|Counter { desk, request, answer }| {
        let request = String::from_utf8_lossy(request);
        let mut lines = request.splitn(3, '\n');
        let mut next = || lines.next().unwrap_or_default();
        let reply = desk.ask(next(), next(), next(), now);
        let sort = if reply.is_json { "json" } else { "text" };
        *answer = format!("{}\n{sort}\n{}", reply.status, reply.body).into_bytes();
        answer.len()
    })
}

/// Says what has happened since it was called last, as [`Desk::hear`] does. Returns the length of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn hear(now: f64) -> usize {
    COUNTER.with_borrow_mut(|Counter { desk, answer, .. }| {
        *answer = desk.hear(now).into_bytes();
        answer.len()
    })
}

/// Where the answer is, until the next call.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    COUNTER.with_borrow(|counter| counter.answer.as_ptr())
}
