//! Recursive coordinate bisection.
//!
//! Reference: Berger & Bokhari, IEEE Trans. Comput. C-36 (1987) 570, doi:10.1109/TC.1987.1676942.

/// Assigns each point to one of `parts` parts by recursive bisection. Returns the part of each point.
///
/// The numbers of points of the parts differ by at most one. Each cut is perpendicular to the longest side of the
/// bounding box of the points that are divided.
pub(crate) fn bisect(positions: &[[f64; 3]], parts: usize) -> Vec<u32> {
    let mut part_of = vec![0; positions.len()];
    let mut all: Vec<u32> = (0..positions.len() as u32).collect();
    cut(&mut all, positions, parts, 0, &mut part_of);
    part_of
}

/// Assigns the points with the numbers `ids` to the parts `first` to `first + parts` − 1.
fn cut(ids: &mut [u32], positions: &[[f64; 3]], parts: usize, first: usize, part_of: &mut [u32]) {
    if parts <= 1 {
        ids.iter().for_each(|&id| part_of[id as usize] = first as u32);
        return;
    }
    let length = |k: usize| {
        let values = || ids.iter().map(|&id| positions[id as usize][k]);
        values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
    };
    let lengths = [0, 1, 2].map(length);
    let axis = (1..3).fold(0, |best, k| if lengths[k] > lengths[best] { k } else { best });
    let left = parts / 2;
    let middle = ids.len() * left / parts;
    if middle < ids.len() {
        // points with equal coordinates are ordered by their numbers, so that the result is unique
        let along = |id: &u32| positions[*id as usize][axis];
        ids.select_nth_unstable_by(middle, |a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
    }
    let (low, high) = ids.split_at_mut(middle);
    cut(low, positions, left, first, part_of);
    cut(high, positions, parts - left, first + left, part_of);
}
