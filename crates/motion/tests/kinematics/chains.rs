//! Paths one after the other.

use proptest::prelude::*;
use vimc4_motion::{AXES, Chain, Path, Point, StraightLine};

use crate::segments::paths;
use crate::{cases, closed_forms_match, point, walked};

fn chain(links: impl IntoIterator<Item = Path>) -> Path {
    Path::Chain(Chain::new(links))
}

fn line<const N: usize>(delta: [i64; N]) -> Path {
    Path::Line(StraightLine::new(point(delta)))
}

proptest! {
    #![proptest_config(cases(1_000))]

    #[test]
    fn any_chain(links in prop::collection::vec(paths(), 0..6), split in 0..9_000u64) {
        closed_forms_match(&chain(links), split, false);
    }

    /// The walk is that of the links, each from where the one before it ended.
    #[test]
    fn its_links_walked(links in prop::collection::vec(paths(), 0..6)) {
        let mut expected: Vec<Point> = vec![[0; AXES]];
        for link in &links {
            let start = expected[expected.len() - 1];
            let places = link.steps().map(|place| std::array::from_fn(|i| start[i] + place[i]));
            expected.extend(places);
        }
        prop_assert_eq!(walked(&chain(links)), expected);
    }

    /// A step is made in the link that leads there, and the circle engine stands where the step is.
    #[test]
    fn a_step_belongs_to_a_link(links in prop::collection::vec(paths(), 1..6), k in 0..9_000u64) {
        let path = chain(links);
        prop_assume!(path.length() > 0);
        let k = k % path.length();
        let (link, step) = path.link_at(k);
        let (here, next) = (path.at(k), path.at(k + 1));
        let (from, to) = (link.at(step), link.at(step + 1));
        for axis in 0..AXES {
            prop_assert_eq!(next[axis] - here[axis], to[axis] - from[axis]);
        }
        if let (Some((plane, start)), Some((_, now))) = (link.circle_at(0), link.circle_at(step)) {
            prop_assert_eq!((now.x - start.x, now.y - start.y), (from[plane.0], from[plane.1]));
        }
    }

    /// However they are put together, the same links are the same chain.
    #[test]
    fn chains_of_chains(links in prop::collection::vec(paths(), 0..6), cut in 0..6usize) {
        let (before, after) = links.split_at(cut.min(links.len()));
        let nested = chain([chain(before.to_vec()), line([]), chain(after.to_vec())]);
        prop_assert_eq!(nested, chain(links));
    }
}

#[test]
fn back_and_forth() {
    let path = chain([line([5, 2]), line([]), line([-8]), line([0, 0, 1])]);
    closed_forms_match(&path, 7, true);
    assert_eq!(path.length(), 14);
    assert_eq!(path.at(14), point([-3, 2, 1]));
    assert_eq!(path.extent(13), (point([-3]), point([5, 2])));
    // On the way out, not on the way back; and beyond the start only on the way back.
    assert_eq!((path.first_at(0, 4), path.first_at(0, -1)), (Some(4), Some(11)));
}

#[test]
fn nothing_to_do() {
    for links in [vec![], vec![line([]), line([])]] {
        let path = chain(links);
        closed_forms_match(&path, 0, true);
        assert_eq!((path.length(), path.first_at(AXES, 1)), (0, None));
    }
    assert_eq!(chain([line([1])]).first_at(AXES, 1), None);
}
