//! Reads PNG: what this library writes, and what other programs do.

use miniz_oxide::inflate::decompress_to_vec_zlib;

/// A picture in dots.
pub(crate) struct Dots {
    pub(crate) width: usize,
    /// Red, green and blue, row by row.
    pub(crate) pixels: Vec<[u8; 3]>,
}

/// Reads a PNG of eight bits a channel, with or without transparency.
pub(crate) fn png(file: &[u8]) -> Dots {
    assert_eq!(&file[..8], b"\x89PNG\r\n\x1a\n");
    let (mut at, mut width, mut bytes) = (8, 0, 3);
    let mut packed = Vec::new();
    loop {
        let word = |at: usize| u32::from_be_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        let (length, kind) = (word(at), &file[at + 4..at + 8]);
        let data = &file[at + 8..at + 8 + length];
        match kind {
            b"IHDR" => {
                width = word(at + 8);
                assert_eq!((data[8], data[12]), (8, 0), "eight bits, not interlaced");
                bytes = if data[9] == 6 { 4 } else { 3 };
            }
            b"IDAT" => packed.extend_from_slice(data),
            b"IEND" => break,
            _ => {}
        }
        at += 12 + length;
    }
    let mut above = vec![0_u8; width * bytes];
    let mut pixels = Vec::new();
    for row in decompress_to_vec_zlib(&packed).unwrap().chunks(width * bytes + 1) {
        let mut now = row[1..].to_vec();
        for place in 0..now.len() {
            let left = if place < bytes { 0 } else { now[place - bytes] };
            let corner = if place < bytes { 0 } else { above[place - bytes] };
            let (a, b, c) = (i16::from(left), i16::from(above[place]), i16::from(corner));
            let guess = match row[0] {
                0 => 0,
                1 => left,
                2 => above[place],
                3 => ((a + b) / 2) as u8,
                // The nearest of the three to their plane.
                _ => match [(b - c).abs(), (a - c).abs(), (a + b - 2 * c).abs()] {
                    [x, y, z] if x <= y && x <= z => left,
                    [_, y, z] if y <= z => above[place],
                    _ => corner,
                },
            };
            now[place] = now[place].wrapping_add(guess);
        }
        pixels.extend(now.chunks(bytes).map(|pixel| [pixel[0], pixel[1], pixel[2]]));
        above = now;
    }
    Dots { width, pixels }
}
