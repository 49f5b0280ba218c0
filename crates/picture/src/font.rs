//! Letters as strokes, for pictures that are made of dots.
//!
//! Each letter is drawn on a grid: x from 0 to 4, y from 0 to 8, where the base line is 2, small letters
//! reach up to 6 and capitals to 8.

/// How many units of the grid are as high as the size of a text.
pub(crate) const HEIGHT: u32 = 10;

/// How many units further the next letter begins.
pub(crate) const ADVANCE: u32 = 6;

/// The base line.
const BASE: i8 = 2;

/// What is drawn for a letter that is not among these.
const UNKNOWN: &str = "0208484202";

/// The strokes of the letters: x and y of one place after the other, with a space between strokes.
const LETTERS: [(char, &str); 94] = [
    (' ', ""),
    ('0', "120307183847433212"),
    ('1', "062822 1232"),
    ('2', "07183847460242"),
    ('3', "07183847463525 354443321203"),
    ('4', "32380444"),
    ('5', "480805354443321203"),
    ('6', "473818070312324344351504"),
    ('7', "084812"),
    ('8', "15060718384746351504031232434435"),
    ('9', "463515060718384743321203"),
    ('A', "022842 1434"),
    ('B', "02083847463505 3544433202"),
    ('C', "4738180703123243"),
    ('D', "02082846442202"),
    ('E', "48080242 0535"),
    ('F', "480802 0535"),
    ('G', "47381807031232434525"),
    ('H', "0208 4248 0545"),
    ('I', "1232 2228 1838"),
    ('J', "4843321203"),
    ('K', "0208 480542"),
    ('L', "080242"),
    ('M', "0208254842"),
    ('N', "02084248"),
    ('O', "120307183847433212"),
    ('P', "02083847463505"),
    ('Q', "120307183847433212 2442"),
    ('R', "02083847463505 2542"),
    ('S', "473818070615354443321203"),
    ('T', "0848 2822"),
    ('U', "080312324348"),
    ('V', "082248"),
    ('W', "0812253248"),
    ('X', "0248 0842"),
    ('Y', "082548 2522"),
    ('Z', "08480242"),
    ('a', "16364542 441403123243"),
    ('b', "0802 0516364543321203"),
    ('c', "4536160503123243"),
    ('d', "4842 4536160503123243"),
    ('e', "04444536160503123243"),
    ('f', "38281712 0626"),
    ('g', "4536160503123243 46413010"),
    ('h', "0802 0516364542"),
    ('i', "2226 2728"),
    ('j', "262110 2728"),
    ('k', "0802 460442"),
    ('l', "282332"),
    ('m', "0206 05162522 25364542"),
    ('n', "0206 0516364542"),
    ('o', "120305163645433212"),
    ('p', "0006 0516364543321203"),
    ('q', "4046 4536160503123243"),
    ('r', "0206 051636"),
    ('s', "4616051434433202"),
    ('t', "18132232 0636"),
    ('u', "0603123243 4642"),
    ('v', "062246"),
    ('w', "0612243246"),
    ('x', "0246 0642"),
    ('y', "4610 0623"),
    ('z', "06460242"),
    ('.', "2223"),
    (',', "2311"),
    (':', "2223 2526"),
    (';', "2311 2526"),
    ('-', "1434"),
    ('+', "0444 2226"),
    ('=', "0343 0545"),
    ('/', "0148"),
    ('(', "38272332"),
    (')', "18272312"),
    ('[', "38181232"),
    (']', "18383212"),
    ('<', "460442"),
    ('>', "064402"),
    ('%', "0248 0708181707 3233434232"),
    ('#', "1218 3238 0444 0646"),
    ('*', "0545 1337 3317"),
    ('!', "2824 2223"),
    ('?', "0718384746352524 2322"),
    ('\'', "2826"),
    ('"', "1816 3836"),
    ('_', "0242"),
    ('|', "2028"),
    ('°', "1728372617"),
    ('²', "1728371535"),
    ('µ', "0006 03123243 4642"),
    ('·', "2425"),
    ('×', "0346 0643"),
    ('–', "0444"),
    ('—', "0444"),
    ('…', "0203 2223 4243"),
];

/// The strokes of a letter. y is counted from the base line, upwards.
pub(crate) fn strokes(letter: char) -> Vec<Vec<(u8, i8)>> {
    let known = LETTERS.iter().find(|known| known.0 == letter);
    let strokes = known.map_or(UNKNOWN, |known| known.1).split_terminator(' ');
    let place = |pair: &[u8]| match pair {
        [x, y] => (x.wrapping_sub(b'0'), y.wrapping_sub(b'0') as i8 - BASE),
        _ => (0, 0),
    };
    strokes.map(|stroke| stroke.as_bytes().chunks(2).map(place).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_are_whole_places_of_the_grid_and_each_is_another() {
        for (number, (letter, drawn)) in LETTERS.iter().enumerate() {
            for stroke in drawn.split_terminator(' ') {
                assert!(stroke.len() >= 4 && stroke.len() % 2 == 0, "{letter}: {stroke}");
            }
            for (x, y) in strokes(*letter).into_iter().flatten() {
                assert!(x <= 4 && (-2..=6).contains(&y), "{letter}: {x} {y}");
            }
            let earlier = LETTERS.iter().take(number);
            assert!(earlier.clone().all(|(known, _)| known != letter), "{letter} twice");
            let alike = ['0', 'O', '–', '—', '\u{2d}'];
            let same = |(known, other): &(char, &str)| other == drawn && !alike.contains(known);
            assert!(!earlier.clone().any(same), "{letter} looks like another");
        }
        for letter in (' '..='~').filter(|letter| letter.is_ascii_alphanumeric()) {
            assert!(LETTERS.iter().any(|known| known.0 == letter), "{letter} is missing");
        }
    }
}
