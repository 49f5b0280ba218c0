//! Messages of editors, read from where they come and written to where they go.

use std::io::{self, BufRead, Write};

use vimc4_dap::framing::{Decoder, Frame, framed};

/// The next message; `None` at the end of the input.
pub(crate) fn read(input: &mut impl BufRead, decoder: &mut Decoder) -> io::Result<Option<Frame>> {
    loop {
        let bytes = match input.fill_buf() {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            bytes => bytes?,
        };
        if bytes.is_empty() {
            return Ok(None);
        }
        let mut rest = bytes;
        let found = decoder.decode(&mut rest).map_err(io::Error::other)?;
        let taken = bytes.len() - rest.len();
        input.consume(taken);
        if found.is_some() {
            return Ok(found);
        }
    }
}

/// Sends a message.
pub(crate) fn write(out: &mut impl Write, message: &str) -> io::Result<()> {
    out.write_all(framed(message).as_bytes())?;
    out.flush()
}
