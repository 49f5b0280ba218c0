//! What clients say and what they are answered, as RFC 2217 and Telnet have it.

use proptest::prelude::*;
use vimc4_rfc2217::{CTS, DCD, DSR, Parity, RI, Request, Server, StopBits};

const IAC: u8 = 255;
const WILL_BINARY: [u8; 3] = [IAC, 251, 0];
const DO_BINARY: [u8; 3] = [IAC, 253, 0];
const WILL_PORT: [u8; 3] = [IAC, 251, 44];

/// A subnegotiation of the serial port.
fn sub(text: &[u8]) -> Vec<u8> {
    [&[IAC, 250, 44], text, &[IAC, 240]].concat()
}

/// A server whose offers have been read.
fn server() -> Server {
    let mut server = Server::new("an IMC4", 19_200);
    server.take_replies();
    server
}

/// What a server makes of bytes: the data, and what is answered.
fn heard(server: &mut Server, bytes: &[u8]) -> (Vec<u8>, Vec<u8>) {
    let mut bytes = bytes.to_vec();
    let count = server.receive(&mut bytes);
    bytes.truncate(count);
    (bytes, server.take_replies())
}

fn requests(server: &mut Server) -> Vec<Request> {
    std::iter::from_fn(|| server.next_request()).collect()
}

fn sent(server: &Server, bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    server.send(bytes, &mut out);
    out
}

#[test]
fn it_begins_with_what_it_offers_and_what_it_asks_for() {
    let offers = Server::new("", 9_600).take_replies();
    assert_eq!(offers, [IAC, 251, 0, IAC, 251, 3, IAC, 253, 0, IAC, 253, 44]);
}

#[test]
fn what_is_agreed_on_is_not_agreed_on_again() {
    let mut server = server();
    // The answers to what was asked for.
    assert_eq!(heard(&mut server, &[WILL_BINARY, DO_BINARY].concat()).1, []);
    // The same once more, as a client may that asks on its own.
    assert_eq!(heard(&mut server, &[WILL_BINARY, DO_BINARY].concat()).1, []);
    // The client's echo and ours are no business of a serial port.
    assert_eq!(heard(&mut server, &[IAC, 253, 1, IAC, 251, 24]).1, [IAC, 252, 1, IAC, 254, 24]);
    assert_eq!(heard(&mut server, &[IAC, 254, 1, IAC, 252, 24]).1, []);
    // A client may also want it to end.
    assert_eq!(heard(&mut server, &[IAC, 252, 0, IAC, 254, 0]).1, [IAC, 254, 0, IAC, 252, 0]);
    assert_eq!(heard(&mut server, &[IAC, 252, 0, IAC, 254, 0]).1, []);
}

#[test]
fn a_client_that_has_agreed_is_told_of_the_lines() {
    let mut server = server();
    assert!(!server.has_port());
    // CTS and DSR are on.
    assert_eq!(heard(&mut server, &WILL_PORT).1, sub(&[107, 0x30]));
    assert!(server.has_port());
    server.set_line(CTS, false);
    // CTS has changed, and is off.
    assert_eq!(server.take_replies(), sub(&[107, 0x21]));
    server.set_line(CTS, false);
    assert_eq!(server.take_replies(), []);
    // It wants to know of DSR only.
    assert_eq!(
        heard(&mut server, &sub(&[11, 0x20])).1,
        [sub(&[111, 0x20]), sub(&[107, 0x20])].concat()
    );
    server.set_line(CTS, true);
    assert_eq!(server.take_replies(), []);
    assert_eq!(heard(&mut server, &sub(&[7])).1, sub(&[107, 0x20]));
    server.set_line(DSR, false);
    assert_eq!(server.take_replies(), sub(&[107, 0]));
    assert_eq!(heard(&mut server, &sub(&[11, 0xfc])).1.last_chunk(), Some(&[0x10, 0xff, 0xf0]));
    for (line, states) in [(RI, [0x54, 0x14]), (DCD, [0x98, 0x18])] {
        for (on, state) in [true, false].into_iter().zip(states) {
            server.set_line(line, on);
            assert_eq!(server.take_replies(), sub(&[107, state]));
        }
    }
}

#[test]
fn the_settings_are_taken_and_answered() {
    let mut server = server();
    for (asked, answered, request) in [
        (&[1, 0, 0, 0x4b, 0][..], &[101, 0, 0, 0x4b, 0][..], Some(Request::Baud(19_200))),
        // A zero asks for what holds.
        (&[1, 0, 0, 0, 0], &[101, 0, 0, 0x4b, 0], None),
        (&[2, 7], &[102, 7], Some(Request::DataBits(7))),
        (&[2, 0], &[102, 7], None),
        (&[2, 9], &[102, 7], None),
        (&[3, 3], &[103, 3], Some(Request::Parity(Parity::Even))),
        (&[3, 0], &[103, 3], None),
        (&[3, 6], &[103, 3], None),
        (&[4, 2], &[104, 2], Some(Request::StopBits(StopBits::Two))),
        (&[4, 0], &[104, 2], None),
        (&[5, 9], &[105, 9], Some(Request::Dtr(false))),
        (&[5, 7], &[105, 9], None),
        (&[5, 12], &[105, 12], Some(Request::Rts(false))),
        (&[5, 11], &[105, 11], Some(Request::Rts(true))),
        (&[5, 10], &[105, 11], None),
        (&[5, 5], &[105, 5], Some(Request::Break(true))),
        (&[5, 6], &[105, 6], Some(Request::Break(false))),
        (&[5, 4], &[105, 6], None),
        (&[5, 0], &[105, 1], None),
        (&[5, 3], &[105, 3], None),
        (&[5, 0], &[105, 3], None),
        (&[5, 13], &[105, 14], None),
        (&[5, 16], &[105, 16], None),
        (&[10, 255], &[110, 255], None),
        (&[12, 1], &[112, 1], Some(Request::Purge { received: true, sent: false })),
        (&[12, 2], &[112, 2], Some(Request::Purge { received: false, sent: true })),
        (&[12, 3], &[112, 3], Some(Request::Purge { received: true, sent: true })),
        (&[0], b"\x64an IMC4", None),
    ] {
        // A 255 inside is doubled, both ways.
        let doubled = |text: &[u8]| {
            text.iter()
                .flat_map(|&byte| vec![byte; 1 + usize::from(byte == IAC)])
                .collect::<Vec<_>>()
        };
        let (data, replies) = heard(&mut server, &sub(&doubled(asked)));
        assert_eq!((data, replies), (vec![], sub(&doubled(answered))), "{asked:?}");
        assert_eq!(requests(&mut server), Vec::from_iter(request), "{asked:?}");
    }
    heard(&mut server, &[sub(&[8]), sub(&[9]), sub(b"\0it's me"), vec![IAC, 243]].concat());
    assert_eq!(
        requests(&mut server),
        [
            Request::Suspend(true),
            Request::Suspend(false),
            Request::Signature(b"it's me".to_vec()),
            Request::BreakKey
        ]
    );
    // What has no shape of a request is not a request.
    let nothing = [&[][..], &[1, 2], &[2], &[3, 1, 1], &[99, 1], &[200]];
    for text in nothing {
        assert_eq!(heard(&mut server, &sub(text)), (vec![], vec![]), "{text:?}");
    }
    assert_eq!(requests(&mut server), []);
}

#[test]
fn text_has_a_nul_behind_each_cr_and_binary_has_none() {
    let mut server = server();
    assert_eq!(heard(&mut server, b"@07\r\0@0P\r\n\r@\0").0, b"@07\r@0P\r\n\r@\0");
    assert_eq!(sent(&server, b"C\r\xff"), b"C\r\0\xff\xff");
    heard(&mut server, &[WILL_BINARY, DO_BINARY].concat());
    assert_eq!(heard(&mut server, b"@07\r\0\xff\xff").0, b"@07\r\0\xff");
    assert_eq!(sent(&server, b"C\r\xff"), b"C\r\xff\xff");
}

#[test]
fn an_endless_subnegotiation_needs_bounded_memory_and_is_left_out() {
    let mut server = server();
    heard(&mut server, &[IAC, 250, 44, 0]);
    for _ in 0..1_000 {
        heard(&mut server, &[b'x'; 1_000]);
    }
    assert_eq!(heard(&mut server, &[IAC, 240, b'@']), (b"@".to_vec(), vec![]));
    assert_eq!(requests(&mut server), []);
}

#[test]
fn a_malformed_subnegotiation_is_left_out_as_a_whole() {
    let mut server = server();
    let (data, answer) = heard(&mut server, &[IAC, 250, 44, 1, IAC, 253, 1, IAC, 240]);
    assert_eq!((data, answer), (vec![], vec![]));
    assert_eq!(requests(&mut server), []);
    assert_eq!(heard(&mut server, b"@07\r"), (b"@07\r".to_vec(), vec![]));
    // The next one counts.
    heard(&mut server, &sub(&[5, 8]));
    assert_eq!(requests(&mut server), [Request::Dtr(true)]);
}

#[test]
fn a_flood_of_questions_that_nobody_reads_the_answers_to_needs_bounded_memory() {
    let mut server = server();
    for _ in 0..100_000 {
        server.receive(&mut sub(&[1, 0, 0, 0x25, 0x80]));
    }
    assert!(server.take_replies().len() <= 64 * 1024);
    assert!(requests(&mut server).len() <= 256);
}

/// What a client can say, well-formed or not.
fn said() -> impl Strategy<Value = Vec<u8>> {
    let piece = prop_oneof![
        proptest::collection::vec(any::<u8>(), 0..8),
        proptest::collection::vec(any::<u8>(), 0..8).prop_map(|text| sub(&text)),
        (250_u8..=255, any::<u8>()).prop_map(|(verb, option)| vec![IAC, verb, option]),
        Just(WILL_BINARY.to_vec()),
        Just(WILL_PORT.to_vec()),
        Just(b"@07\r".to_vec()),
    ];
    proptest::collection::vec(piece, 0..20).prop_map(|pieces| pieces.concat())
}

proptest! {
    #[test]
    fn it_does_not_matter_in_which_pieces_it_comes(
        bytes in said(),
        cuts in proptest::collection::vec(1_usize..9, 1..20),
    ) {
        let mut whole = server();
        let (data, replies) = heard(&mut whole, &bytes);
        let mut other = server();
        let (mut pieces, mut answers) = (Vec::new(), Vec::new());
        let (mut rest, mut cuts) = (&bytes[..], cuts.into_iter().cycle());
        while !rest.is_empty() {
            let (piece, after) = rest.split_at(cuts.next().unwrap().min(rest.len()));
            rest = after;
            let (data, replies) = heard(&mut other, piece);
            prop_assert!(data.len() <= piece.len());
            pieces.extend(data);
            answers.extend(replies);
        }
        prop_assert_eq!((data, replies), (pieces, answers));
        prop_assert_eq!(requests(&mut whole), requests(&mut other));
        prop_assert_eq!(whole, other);
    }

    #[test]
    fn every_byte_gets_through_both_ways(bytes: Vec<u8>, binary: bool) {
        let mut server = server();
        if binary {
            heard(&mut server, &[WILL_BINARY, DO_BINARY].concat());
        }
        // A client escapes as a server does.
        let escaped = sent(&server, &bytes);
        prop_assert_eq!(heard(&mut server, &escaped), (bytes, vec![]));
    }
}
