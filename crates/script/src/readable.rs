//! Whether a file is text, or binary.

use std::borrow::Cow;

use vimc4_catalogue::Handling;

use crate::before_end_mark;
use crate::packed::packed;
use crate::sort::{BEGINNINGS, is_comment, is_job, is_plot};

/// How many bytes at the beginning of a file show what it is.
const LOOKED_AT: usize = 4_096;

/// No label is longer than this.
const LABEL_MAX: usize = 256;

/// Refuses what is not text.
///
/// # Errors
///
/// What it is, and what would be right, as a sentence.
pub fn readable(name: &str, bytes: &[u8], handling: &Handling) -> Result<(), String> {
    if let Some(packed) = packed(bytes) {
        return Err(format!("{name} is packed with {packed}; unpack it first"));
    }
    let bytes = before_end_mark(bytes);
    let is_line_end = |byte: &u8| matches!(byte, b'\r' | b'\n');
    let counts: Cow<'_, [u8]> = match handling.takes_stream {
        // NULs separate the commands of a plot, and it may be filled up with them.
        true if is_plot(bytes) => bytes.iter().copied().filter(|byte| *byte != 0).collect(),
        true => bytes.into(),
        // Comments may be in any language and code.
        false if is_job(bytes) => return Ok(()),
        false => {
            let lines = bytes.split(is_line_end).map(<[u8]>::trim_ascii_start);
            lines.filter(|line| !is_comment(line)).flatten().copied().take(LOOKED_AT).collect()
        }
    };
    if !is_binary(&counts) {
        return Ok(());
    }
    let what = match name.rsplit_once('.') {
        Some((_, end)) if end.eq_ignore_ascii_case("lmd") => {
            "LMD, the layers and tools of a board for LPKF's programs"
        }
        _ => "not text",
    };
    let right = match handling.takes_stream {
        true => {
            "plot it into a file in the program that wrote it: HPGL, text such as PU;PA1000,2000;PD;"
        }
        false => BEGINNINGS,
    };
    Err(format!("{name} is binary, {what}: it has no commands that could be sent; {right}"))
}

/// Whether this is not a text: more than one byte in ten is a control character that no text has, or
/// outside of ASCII. Labels may be in any language and code. NULs are no reason as long as
/// nothing else is; but a third of a text they are not.
fn is_binary(bytes: &[u8]) -> bool {
    let bytes = &bytes[..bytes.len().min(LOOKED_AT)];
    let nuls = bytes.iter().filter(|&&byte| byte == 0).count();
    let mut strange = 0;
    let mut rest = bytes;
    while let [first, behind @ ..] = rest {
        let is_text = match first {
            // The controls of text, of labels, of a plotter's handshake and of the end of a file.
            0 | 3 | b'\t' | b'\n' | b'\r' | b'\x0C' | b'\x0E' | b'\x0F' | 0x11 | 0x13 | 0x1A
            | 0x1B => true,
            byte => (b' '..=b'~').contains(byte),
        };
        let length = if is_text { label(rest).max(1) } else { encoded(rest) };
        strange += usize::from(length == 0);
        rest = rest.get(length.max(1)..).unwrap_or(behind);
    }
    let strange = if strange > 0 { strange + nuls } else { 0 };
    strange * 10 > bytes.len() || nuls * 3 > bytes.len()
}

/// How long the label is that begins here: its text ends at an ETX, and where that was forgotten,
/// at a semicolon. 0 if none does.
fn label(bytes: &[u8]) -> usize {
    let Some(text) = bytes.strip_prefix(b"LB") else { return 0 };
    let text = &text[..text.len().min(LABEL_MAX)];
    let at = |end| text.iter().position(|byte| *byte == end).map(|place| place + 1);
    match at(3).or_else(|| at(b';')) {
        Some(length) if !text[..length].contains(&0) => 2 + length,
        _ => 0,
    }
}

/// How long the character is that begins here, if it is one of UTF-8 beyond ASCII; else 0.
fn encoded(bytes: &[u8]) -> usize {
    let is_character = |length: &usize| {
        bytes.first().is_some_and(|first| !first.is_ascii())
            && bytes.get(..*length).is_some_and(|bytes| str::from_utf8(bytes).is_ok())
    };
    (2..=4).find(is_character).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use vimc4_device::escape;

    /// Whether a file is refused as binary for an LPKF controller, and for one of isel.
    fn refused(bytes: &[u8]) -> [bool; 2] {
        ["smcu", "imc4"].map(|name| {
            let handling = Handling::of(&vimc4_catalogue::model(name).expect("a built-in model"));
            readable("x", bytes, &handling).is_err()
        })
    }

    #[test]
    fn nuls_are_no_reason_in_a_plot() {
        for count in [1, 20, 10_000] {
            let nuls = vec![0; count];
            for plot in
                [[&nuls[..], b"IN;PA1,2;\n"].concat(), [b"IN;", &nuls[..], b"PA1,2;"].concat()]
            {
                assert!(!refused(&plot)[0], "{count}");
            }
        }
        let filled = [&[0; 50][..], b"IN;\x01\x02\x80\x81\xFF"].concat();
        assert!(refused(&filled)[0]);
    }

    #[test]
    fn what_is_binary_is_so_for_all_controllers() {
        let elf =
            b"\x7FELF\x02\x01\x01\0\0\0\0\0\0\0\0\0\x03\0>\0\x01\0\0\0\xD0#\0\0\0\0\0\0@\0\0\0";
        let png =
            b"\x89PNG\r\n\x1A\n\0\0\0\rIHDR\0\0\0\x01\0\0\0\x01\x08\x06\0\0\0\x1F\x15\xC4\x89";
        for binary in [&elf[..], png, b"\0\0\0\0"] {
            assert_eq!(refused(binary), [true; 2], "{}", escape(binary));
        }
        let cyrillic = b"\xEF\xEB\xE0\xF2\xE0";
        for text in [
            [b"; ", &cyrillic[..], b"\r\n@07\r\n"].concat(),
            [b"  # ", &cyrillic[..], b"\n71\n9\n"].concat(),
            [b"IMF_PBL_V1.0\n; ", &cyrillic[..]].concat(),
        ] {
            assert!(!refused(&text)[1], "{}", escape(&text));
        }
    }

    #[test]
    fn what_is_packed_is_told_as_such() {
        // The text within may be as it was.
        let zip =
            b"PK\x03\x04\x0A\0\0\0\0\0@07\n@0P\nIN;PA1,2;@07\n@0P\nIN;PA1,2;@07\n@0P\nIN;PA1,2;\n";
        for (mark, packer) in
            [(&b"\x1F\x8B\x08"[..], "gzip"), (zip, "zip"), (b"\x28\xB5\x2F\xFD", "zstd")]
        {
            for name in ["smcu", "imc4"] {
                let handling =
                    Handling::of(&vimc4_catalogue::model(name).expect("a built-in model"));
                let said = readable("x", mark, &handling);
                assert_eq!(said, Err(format!("x is packed with {packer}; unpack it first")));
            }
        }
    }

    #[test]
    fn what_is_binary_is_seen() {
        for text in [
            &b""[..],
            b"IN;\0PA1,2;\0PD;\r\0PU;\0",
            b"\x1B.(;IN;SP1;PU0,0;LBnote\x03;PD10,10;PU;SP0;",
            b"PA1,2;\n\x0C\t PU;\r\n",
            b"P",
            b"LBGeh\xC3\xA4use\x03;PA100,100;",
            b"LBGeh\xE4use;PA100,100;",
            b"LB\xD0\x9F\xD0\xBB\xD0\xB0\xD1\x82\xD0\xB0\x03;PA1,1;",
            "# \u{43F}\u{43B}\u{430}\u{442}\u{430}\nPA1,1;".as_bytes(),
            b"\x1B.Y\x1B.J\x1B.K\x1B.R\x1B.@0;0:IN;PA10,10;",
            b"PA100,100;\0\0\0",
            b"\0\0\0PA100,100;",
            b"PA100,\0\0\x00100;",
            b"PA5,5;\r\n\x1A",
        ] {
            assert!(!is_binary(text), "{}", escape(text));
        }
        for binary in [
            &b"LMD\0\x01\0\0\0PA1,2;"[..],
            b"\0\0\0\0",
            b"\x89LMD\r\n\x1A\n\0\0\0\x0D",
            b"P\0A\x001\0,\x002\0;\0",
            b"LB\0\x80\x81\x82\x83\x03",
        ] {
            assert!(is_binary(binary), "{}", escape(binary));
        }
    }
}
