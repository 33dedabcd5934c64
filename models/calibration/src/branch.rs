//! Branches of a load program in a curve: loading, hold and unloading.
//!
//! In each branch the machine controls the displacement of the platen or its force, which is then a linear function of
//! time. At a corner, the function of time changes. The corners are found by dividing the readings
//! at the largest distance from a chord until no distance exceeds a tolerance (Ramer, Comput. Graph. Image Process. 1
//! (1972) 244; Douglas & Peucker, Cartographica 10 (1973) 112). Each corner is then moved to the reading next to the
//! intersection of the least-squares lines of its two segments, because noise displaces the largest distance.
//!
//! For a machine that controls the force in some of the branches, the control of each reading is known: a purely elastic
//! specimen under a constant force has a constant displacement, too, so that the values alone do not show the control.

use std::ops::{Range, RangeInclusive};

/// Fraction of a segment at each of its ends that the least-squares line of the segment does not
/// use.
const OMITTED: f64 = 0.1;
/// Smallest number of intervals between readings that a segment needs for a least-squares line.
const FEWEST: usize = 4;

/// Kind of a branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BranchKind {
    /// The displacement increases, or the force if the machine controls the force.
    Loading,
    /// The displacement is constant.
    Hold,
    /// The force is constant, and the displacement may change: creep.
    ForceHold,
    /// The displacement decreases, or the force if the machine controls the force.
    Unloading,
}

/// Consecutive readings of a curve in which the controlled value (displacement or force) increases, is constant, or
/// decreases.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Branch {
    pub kind: BranchKind,
    /// Readings of the branch. Two consecutive branches share the reading at their corner.
    pub readings: Range<usize>,
}

/// Values that the machine may control, with the largest difference of values that count as equal.
#[derive(Clone, Copy, Debug)]
pub struct Controlled<'a> {
    pub values: &'a [f64],
    pub tolerance: f64,
}

impl Controlled<'_> {
    /// Returns the indices of the first reading of a range, of its corners and of its last reading.
    fn corners(&self, time_s: &[f64], range: RangeInclusive<usize>) -> Vec<usize> {
        let first = *range.start();
        let (time_s, values) = (&time_s[range.clone()], &self.values[range]);
        let corners = moved(time_s, values, &corners(time_s, values, self.tolerance));
        corners.into_iter().map(|corner| first + corner).collect()
    }

    /// Returns −1, 0 or 1 for values that decrease, are equal or increase between two readings.
    fn direction(&self, from: usize, to: usize) -> i8 {
        let change = self.values[to] - self.values[from];
        i8::from(change > self.tolerance) - i8::from(change < -self.tolerance)
    }
}

/// Force of a machine that controls the force in some of the branches.
#[derive(Clone, Copy, Debug)]
pub struct ControlledForce<'a> {
    pub force: Controlled<'a>,
    /// For each reading, whether the machine controlled the force since the reading before.
    pub is_controlled: &'a [bool],
}

/// Returns the branches of a curve whose machine controls the displacement, and in some branches the force (`force`).
///
/// Returns no branch if the times decrease anywhere, or if there are fewer than two readings.
pub fn branches(
    time_s: &[f64],
    displacement: Controlled<'_>,
    force: Option<ControlledForce<'_>>,
) -> Vec<Branch> {
    let count = displacement.values.len();
    let ascends = time_s.windows(2).all(|pair| pair[0] <= pair[1]);
    let has_all =
        |f: ControlledForce<'_>| [f.force.values.len(), f.is_controlled.len()] == [count; 2];
    if count < 2 || time_s.len() != count || !force.is_none_or(has_all) || !ascends {
        return Vec::new();
    }
    let by_force = |reading: usize| force.filter(|force| force.is_controlled[reading]);
    let mut branches: Vec<Branch> = Vec::new();
    let mut first = 0;
    while first + 1 < count {
        let control = by_force(first + 1);
        let is_same = |reading: &usize| by_force(*reading).is_some() == control.is_some();
        let last = (first + 1..count).take_while(is_same).last().unwrap_or(first + 1);
        let (controlled, hold) = match control {
            Some(ControlledForce { force, .. }) => (force, BranchKind::ForceHold),
            None => (displacement, BranchKind::Hold),
        };
        for pair in controlled.corners(time_s, first..=last).windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let kind = match controlled.direction(from, to) {
                1 => BranchKind::Loading,
                -1 => BranchKind::Unloading,
                _ => hold,
            };
            match branches.last_mut() {
                // a change of the speed alone does not start a new branch
                Some(branch) if branch.kind == kind => branch.readings.end = to + 1,
                _ => branches.push(Branch { kind, readings: from..to + 1 }),
            }
        }
        first = last;
    }
    branches
}

/// Returns the readings of the first loading of a curve with branches: the readings of loading branches whose
/// displacement exceeds the displacements of all earlier branches.
pub(crate) fn first_loading(branches: &[Branch], displacement_mm: &[f64]) -> Vec<usize> {
    let mut farthest_mm = f64::NEG_INFINITY;
    let mut chosen = Vec::new();
    for branch in branches {
        let readings = branch.readings.clone();
        if branch.kind == BranchKind::Loading {
            chosen.extend(readings.clone().filter(|&i| displacement_mm[i] > farthest_mm));
        }
        farthest_mm = readings.map(|i| displacement_mm[i]).fold(farthest_mm, f64::max);
    }
    chosen
}

/// Returns the indices of the first reading, the corners and the last reading.
fn corners(time_s: &[f64], u: &[f64], tolerance_mm: f64) -> Vec<usize> {
    let mut corners = vec![0];
    let mut intervals = vec![(0, u.len() - 1)];
    while let Some((from, to)) = intervals.pop() {
        let chord = Straight::between((time_s[from], u[from]), (time_s[to], u[to]));
        let distance = |i: &usize| (u[*i] - chord.at(time_s[*i])).abs();
        let farthest = (from + 1..to).max_by(|a, b| distance(a).total_cmp(&distance(b)));
        match farthest.filter(|i| distance(i) > tolerance_mm) {
            // divide the earlier part first, so that the corners are found in the order of time
            Some(corner) => intervals.extend([(corner, to), (from, corner)]),
            None => corners.push(to),
        }
    }
    corners
}

/// Moves each corner to the reading next to the intersection of the lines of its two segments.
fn moved(time_s: &[f64], u: &[f64], corners: &[usize]) -> Vec<usize> {
    let mut moved = corners.to_vec();
    for k in 1..corners.len().saturating_sub(1) {
        let [before, corner, after] = [corners[k - 1], corners[k], corners[k + 1]];
        let lines =
            [Straight::of(time_s, u, before, corner), Straight::of(time_s, u, corner, after)];
        let [Some(first), Some(second)] = lines else { continue };
        let Some(meeting_s) = first.meets(&second) else { continue };
        let distance = |i: &usize| (time_s[*i] - meeting_s).abs();
        // a corner must not pass its neighbours
        let between = moved[k - 1] + 1..after;
        if let Some(near) = between.min_by(|a, b| distance(a).total_cmp(&distance(b))) {
            moved[k] = near;
        }
    }
    moved
}

/// Displacement or force as a linear function of time.
struct Straight {
    time_s: f64,
    displacement_mm: f64,
    /// Slope, mm/s.
    speed: f64,
}

impl Straight {
    fn between(from: (f64, f64), to: (f64, f64)) -> Self {
        let duration_s = to.0 - from.0;
        let speed = if duration_s > 0.0 { (to.1 - from.1) / duration_s } else { 0.0 };
        Self { time_s: from.0, displacement_mm: from.1, speed }
    }

    /// Returns the least-squares line through the readings of a segment, without the readings near its ends. Returns
    /// `None` for few readings, or if all readings have the same time.
    fn of(time_s: &[f64], u: &[f64], from: usize, to: usize) -> Option<Self> {
        // a line through few readings would depend mostly on noise
        if to - from < FEWEST {
            return None;
        }
        let omitted = ((to - from) as f64 * OMITTED).ceil() as usize;
        let (from, to) = match to - from > 2 * omitted + 1 {
            true => (from + omitted, to - omitted),
            false => (from, to),
        };
        let count = (to - from + 1) as f64;
        let mean = |values: &[f64]| values[from..=to].iter().sum::<f64>() / count;
        let (middle_s, middle_mm) = (mean(time_s), mean(u));
        let sum = |f: &dyn Fn(usize) -> f64| (from..=to).map(f).sum::<f64>();
        let square = sum(&|i| (time_s[i] - middle_s).powi(2));
        let product = sum(&|i| (time_s[i] - middle_s) * (u[i] - middle_mm));
        let speed = product / square;
        (square > 0.0).then_some(Self { time_s: middle_s, displacement_mm: middle_mm, speed })
    }

    fn at(&self, time_s: f64) -> f64 {
        self.displacement_mm + self.speed * (time_s - self.time_s)
    }

    /// Returns the time at which two lines intersect, s; `None` for parallel lines.
    fn meets(&self, other: &Self) -> Option<f64> {
        let apart = self.at(other.time_s) - other.displacement_mm;
        let time_s = other.time_s + apart / (other.speed - self.speed);
        time_s.is_finite().then_some(time_s)
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    /// Returns readings of a load program: `n` per segment.
    fn readings(program: &[(f64, f64)], n: usize) -> (Vec<f64>, Vec<f64>) {
        let (mut time_s, mut u) = (vec![0.0], vec![0.0]);
        let mut before = (0.0, 0.0);
        for &(t, x) in program {
            for i in 1..=n {
                let part = i as f64 / n as f64;
                time_s.push(before.0 + part * (t - before.0));
                u.push(before.1 + part * (x - before.1));
            }
            before = (t, x);
        }
        (time_s, u)
    }

    fn by_displacement(time_s: &[f64], u: &[f64], tolerance: f64) -> Vec<Branch> {
        branches(time_s, Controlled { values: u, tolerance }, None)
    }

    /// A ramp in displacement with a curved force, a ramp in force, a hold of the force with creep, unloading in force,
    /// and a hold of the displacement with a rising force.
    #[test]
    fn branches_with_a_controlled_force_are_found() {
        use BranchKind::{ForceHold, Hold, Loading, Unloading};
        let ends = [1.0, 2.0, 8.0, 9.0, 12.0].map(|time_s| (time_s, 0.0));
        let time_s = readings(&ends, 40).0;
        let exact = |t: f64| match t {
            t if t <= 1.0 => (0.05 * t, 50.0 * t.powf(0.8)),
            t if t <= 2.0 => (0.05 + 0.03 * (t - 1.0).powi(2), 50.0 + 40.0 * (t - 1.0)),
            t if t <= 8.0 => (0.08 + 0.03 * (1.0 - (2.0 - t).exp()), 90.0),
            t if t <= 9.0 => (0.11 - 0.06 * (t - 8.0).powf(1.2), 90.0 - 80.0 * (t - 8.0)),
            _ => (0.05, 10.0 + 15.0 * (1.0 - (9.0 - t).exp())),
        };
        let (u, f): (Vec<f64>, Vec<f64>) = time_s.iter().map(|&t| exact(t)).unzip();
        let displacement = Controlled { values: &u, tolerance: 1e-7 };
        let force = Controlled { values: &f, tolerance: 1e-4 };
        let is_controlled: Vec<bool> =
            time_s.iter().map(|t| *t > 1.0 + 1e-9 && *t < 9.0 + 1e-9).collect();
        let force = ControlledForce { force, is_controlled: &is_controlled };
        let found = branches(&time_s, displacement, Some(force));
        let kinds: Vec<BranchKind> = found.iter().map(|b| b.kind).collect();
        assert_eq!(kinds, [Loading, ForceHold, Unloading, Hold], "{found:?}");
        let starts: Vec<usize> = found.iter().map(|b| b.readings.start).collect();
        assert_eq!(starts, [0, 80, 120, 160]);
    }

    /// An elastic specimen does not creep: under a constant force, its displacement is constant, too.
    #[test]
    fn the_hold_of_an_elastic_creep_test_is_a_hold_of_the_force() {
        let (time_s, u) = readings(&[(1.0, 0.1), (9.0, 0.1), (10.0, 0.0)], 8);
        let f: Vec<f64> = u.iter().map(|u| 700.0 * u).collect();
        let displacement = Controlled { values: &u, tolerance: 1e-9 };
        let hold = |from: f64| {
            let is_controlled: Vec<bool> =
                time_s.iter().map(|t| *t > from + 1e-9 && *t < 9.0 + 1e-9).collect();
            let force = Controlled { values: &f, tolerance: 1e-6 };
            let force = ControlledForce { force, is_controlled: &is_controlled };
            let found = branches(&time_s, displacement, Some(force));
            let kinds = found.iter().map(|branch| branch.kind).collect::<Vec<_>>();
            assert_eq!([kinds[0], kinds[2]], [BranchKind::Loading, BranchKind::Unloading]);
            assert_eq!(found[1].readings, 8..17);
            kinds[1]
        };
        // the force is controlled from the start, or during the hold only, or never
        assert_eq!(
            [0.0, 1.0, 9.0].map(hold),
            [BranchKind::ForceHold, BranchKind::ForceHold, BranchKind::Hold]
        );
    }

    const PROGRAM: [(f64, f64); 5] =
        [(0.01, 0.02), (20.0, 0.02), (21.0, 0.005), (21.5, 0.005), (23.0, 0.04)];
    const KINDS: [BranchKind; 5] = [
        BranchKind::Loading,
        BranchKind::Hold,
        BranchKind::Unloading,
        BranchKind::Hold,
        BranchKind::Loading,
    ];

    #[test]
    fn exact_readings_have_the_branches_of_their_program() {
        for n in [1, 2, 7, 40] {
            let (time_s, u) = readings(&PROGRAM, n);
            let detected = by_displacement(&time_s, &u, 1e-9);
            assert_eq!(detected.iter().map(|b| b.kind).collect::<Vec<_>>(), KINDS, "{n}");
            for (k, branch) in detected.iter().enumerate() {
                assert_eq!(branch.readings, k * n..(k + 1) * n + 1);
            }
            let chosen = first_loading(&detected, &u);
            let beyond = (4 * n + 1..=5 * n).filter(|&i| u[i] > 0.02);
            assert_eq!(chosen, (0..=n).chain(beyond).collect::<Vec<_>>(), "{n}");
        }
    }

    #[test]
    fn noise_moves_corners_by_five_readings_at_most() {
        let n = 50;
        let (time_s, exact) = readings(&PROGRAM, n);
        let sd = 1e-4;
        let noise = Normal::new(0.0, sd).unwrap();
        for seed in 0..50 {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let u: Vec<f64> = exact.iter().map(|x| x + noise.sample(&mut rng)).collect();
            let detected = by_displacement(&time_s, &u, 8.0 * sd);
            assert_eq!(detected.iter().map(|b| b.kind).collect::<Vec<_>>(), KINDS, "{seed}");
            for (k, branch) in detected.iter().enumerate() {
                let off = branch.readings.start.abs_diff(k * n);
                assert!(off <= 5, "{seed}: branch {k} starts {off} readings away from its corner");
            }
        }
    }

    #[test]
    fn a_straight_test_and_a_change_of_speed_are_one_branch() {
        let (time_s, u) = readings(&[(1.0, 0.1), (5.0, 0.2)], 10);
        let only = Branch { kind: BranchKind::Loading, readings: 0..21 };
        assert_eq!(by_displacement(&time_s, &u, 1e-9), [only]);
        let back: Vec<f64> = time_s.iter().rev().copied().collect();
        assert_eq!(by_displacement(&back, &u, 1e-9), []);
        assert_eq!(by_displacement(&[], &u, 1e-9), []);
        assert_eq!(by_displacement(&[0.0], &[0.0], 1e-9), []);
    }
}
