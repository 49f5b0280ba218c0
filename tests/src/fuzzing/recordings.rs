//! Recordings: whatever is in a file, it is refused with a place, or read and written as the same.

use vimc4_timeline::recording::Recording;

/// Any bytes are read as a recording. An error points into them; what was read is written so that it
/// is read as the same, and so is every beginning of it.
///
/// # Panics
///
/// If something does not hold.
pub fn recording(data: &[u8]) {
    let lines = data.split_inclusive(|byte| *byte == b'\n').count().max(1);
    let read = match Recording::read(data) {
        Ok(read) => read,
        Err(error) => {
            assert!((1..=lines).contains(&(error.line as usize)), "{error}");
            assert!(!error.message.is_empty() && !error.help.is_empty(), "{error}");
            return;
        }
    };
    assert!(read.torn.is_none_or(|line| line as usize == lines), "{:?}", read.torn);
    let text = read.write();
    let read_again = |text: &[u8]| {
        Recording::read(text).unwrap_or_else(|error| unreachable!("{error}: {text:?}"))
    };
    let again = read_again(&text);
    assert_eq!(again.write(), text);
    assert_eq!(again.head, read.head);
    assert_eq!(again.entries.len(), read.entries.len());
    for (one, other) in read.entries.iter().zip(&again.entries) {
        assert_eq!((one.at, &one.what), (other.at, &other.what));
    }
    let head = text.iter().position(|byte| *byte == b'\n').map_or(text.len(), |end| end + 1);
    for end in (head..text.len()).rev().take(200) {
        let torn = read_again(&text[..end]);
        assert!(torn.entries.len() <= read.entries.len());
    }
}
