//! The serving side of RFC 2217 and what a client says to it.

use vimc4_rfc2217::Server;

const IAC: u8 = 255;

/// Takes bytes of a client whole and byte by byte: the same comes of it, what is answered is
/// well-formed, and what the device says gets through.
pub fn rfc2217(data: &[u8]) {
    let (mut whole, mut bytewise) = (Server::new("x", 9_600), Server::new("x", 9_600));
    let mut all = data.to_vec();
    let count = whole.receive(&mut all);
    all.truncate(count);
    let mut pieces: Vec<u8> = Vec::new();
    for byte in data {
        let mut piece = [*byte];
        let count = bytewise.receive(&mut piece);
        pieces.extend(&piece[..count]);
    }
    assert_eq!(all, pieces, "the data does not hang on the pieces");
    assert_eq!(whole, bytewise);
    check(&whole.take_replies());
    while whole.next_request().is_some() {}
    let mut sent = Vec::new();
    whole.send(data, &mut sent);
    let mut client = Server::new("y", 9_600);
    if sent.len() == data.len() + data.iter().filter(|byte| **byte == IAC).count() {
        // Nothing is put behind a CR: it is binary, and the other side must know.
        client.receive(&mut [IAC, 251, 0]);
    }
    let count = client.receive(&mut sent);
    assert_eq!(&sent[..count], data, "every byte gets through");
}

/// Answers consist of options and of subnegotiations that end.
fn check(mut replies: &[u8]) {
    while let [first, rest @ ..] = replies {
        assert_eq!(*first, IAC, "a reply is no data");
        replies = match rest {
            [250, 44, text @ ..] => {
                let end = text.windows(2).position(|pair| pair == [IAC, 240]);
                let end = end.unwrap_or_else(|| unreachable!("{text:?} does not end"));
                &text[end + 2..]
            }
            [251..=254, _, rest @ ..] => rest,
            _ => unreachable!("{rest:?} is not a reply"),
        };
    }
}

/// A session as clients have it, and what is none.
pub(super) fn sessions() -> Vec<Vec<u8>> {
    [
        &b"\xff\xfb\x00\xff\xfd\x00\xff\xfb\x2c\xff\xfa\x2c\x01\x00\x00\x4b\x00\xff\xf0@07\r"[..],
        b"\xff\xfa\x2c\x05\x08\xff\xf0\xff\xfa\x2c\x05\x0b\xff\xf0\xff\xfa\x2c\x0c\x03\xff\xf0",
        b"\xff\xfa\x2c\x08\xff\xf0@0P\r\x00\xff\xff\xff\xfa\x2c\x09\xff\xf0\xff\xf3",
        b"\xff\xfa\x2c\x00me\xff\xff\xff\xf0\xff\xfa\x2c\x0b\xff\xff\xff\xf0",
        b"\xff\xfd\x01\xff\xfe\x00\xff\xfc\x2c\xff\xfa\x01\x00\xff\xf0\xff\xfa\x2c\xff\x07",
    ]
    .map(<[u8]>::to_vec)
    .to_vec()
}
