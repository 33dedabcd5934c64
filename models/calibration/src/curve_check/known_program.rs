//! Branches of a curve whose load program is known.
//!
//! The program states the order of the branches, the value that the machine controls in each branch, and the times of
//! the corners. The readings only decide where the machine departs from these times: the controlled value (displacement
//! or force) is linear in time within a segment, and the sum of squared residuals of the least-squares lines, in units
//! of the noise, changes with the corners. First, the start of the program moves relative to the first reading, with
//! all corners. Then each corner moves within its two segments. Finally, the first segment starts after a rest, if the
//! readings show a rest. Each move needs a significant decrease of the sum, so that noise alone moves no corner.

use crate::branch::{Branch, BranchKind};
use crate::experiment::TestCurve;
use crate::qoi::noise;

/// Smallest standard deviation of a reading, as a fraction of the range of all readings: machines follow their program
/// only approximately.
const LEAST_NOISE: f64 = 5e-4;
/// Least decrease of the sum of squared normalised residuals for which a corner is moved: the square of five standard
/// deviations of a normally distributed parameter.
const SIGNIFICANT: f64 = 25.0;
/// Fewest readings that move corners: the noise of fewer readings is too uncertain.
const FEWEST: usize = 20;
/// Largest time between a reading and a corner at which the reading counts as the reading of the corner, as a fraction
/// of the duration of the shorter segment at the corner.
const AT_CORNER: f64 = 1e-3;
/// Smallest change of a controlled value that counts as a change, as a fraction of the range of all readings.
const EQUAL: f64 = 0.005;

/// Value that the machine prescribes at the end of a segment of a load program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProgramLoad {
    /// Displacement in mm.
    Displacement(f64),
    /// Force in N. The displacement is then a result.
    Force(f64),
}

impl ProgramLoad {
    fn is_force(self) -> bool {
        matches!(self, Self::Force(_))
    }

    fn value(self) -> f64 {
        match self {
            Self::Displacement(value) | Self::Force(value) => value,
        }
    }
}

/// Segment of a load program. The prescribed value is linear in time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProgramSegment {
    /// End in s after the start of the program.
    pub end_s: f64,
    /// Prescribed value at the end. The values of all segments may be scaled by a common factor, such as the ratio of
    /// two heights: only their relative sizes matter.
    pub end: ProgramLoad,
}

/// Branches of a curve, and how well the curve follows the program.
pub(super) struct DividedCurve {
    /// Branches; two consecutive branches share the reading at their corner. Empty for a single branch.
    pub(super) branches: Vec<Branch>,
    /// Sum of squared residuals of the controlled values in units of the noise.
    pub(super) misfit: f64,
}

/// Returns the branches of a curve whose times start at zero and increase. There is no branch without a program, or
/// with fewer than two readings.
pub(super) fn divided(curve: &TestCurve, program: &[ProgramSegment]) -> DividedCurve {
    if program.is_empty() || curve.time_s.len() < 2 {
        return DividedCurve { branches: Vec::new(), misfit: 0.0 };
    }
    let lines = Lines::of(curve, program);
    let mut corners_s: Vec<f64> = lines.corners_s(0.0);
    if curve.time_s.len() >= FEWEST {
        let offset_s = lines.offset_s();
        corners_s.iter_mut().for_each(|corner_s| *corner_s += offset_s);
        for k in 1..corners_s.len() - 1 {
            corners_s[k] = lines.moved(&corners_s, k);
        }
        if corners_s[0] >= 0.0 {
            corners_s[0] = lines.start_s(corners_s[1]);
        }
    }
    let misfit = lines.cost(&corners_s);
    let branches = lines.branches(curve, &corners_s);
    DividedCurve { branches: if branches.len() > 1 { branches } else { Vec::new() }, misfit }
}

/// A curve with sums for least-squares lines through any consecutive readings.
struct Lines<'a> {
    times: &'a [f64],
    program: &'a [ProgramSegment],
    displacement: Channel,
    force: Channel,
}

impl<'a> Lines<'a> {
    fn of(curve: &'a TestCurve, program: &'a [ProgramSegment]) -> Self {
        let times = &curve.time_s[..];
        Self {
            times,
            program,
            displacement: Channel::of(times, &curve.displacement_mm),
            force: Channel::of(times, &curve.force_n),
        }
    }

    fn channel(&self, segment: usize) -> &Channel {
        if self.program[segment].end.is_force() { &self.force } else { &self.displacement }
    }

    /// Returns start, corners and end of the program, s after the first reading, for a program that starts `offset_s`
    /// after the first reading.
    fn corners_s(&self, offset_s: f64) -> Vec<f64> {
        let ends = self.program.iter().map(|segment| offset_s + segment.end_s);
        [offset_s].into_iter().chain(ends).collect()
    }

    /// Number of readings up to a time.
    fn before(&self, time_s: f64) -> usize {
        self.times.partition_point(|t| *t <= time_s)
    }

    /// Sum of squared normalised residuals. Each fitted constant counts as one, because it makes one residual vanish, and
    /// each reading after the end of the program counts as one.
    fn cost(&self, corners_s: &[f64]) -> f64 {
        let readings: Vec<usize> =
            corners_s.iter().map(|&corner_s| self.before(corner_s)).collect();
        // the machine rests before the start of the program
        let mut cost = self.channel(0).about_mean(0, readings[0]);
        for (k, pair) in readings.windows(2).enumerate() {
            cost += self.channel(k).about_line(pair[0], pair[1]);
        }
        cost + (self.times.len() - readings[readings.len() - 1]) as f64
    }

    /// Returns the time from the first reading to the start of the program, s; zero if no other start is significantly
    /// better.
    fn offset_s(&self) -> f64 {
        let corners_s = self.corners_s(0.0);
        let longest_s = corners_s.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        let (end_s, last_s) = (corners_s[corners_s.len() - 1], self.times[self.times.len() - 1]);
        let most_s = (0.5 * longest_s).max(last_s - end_s);
        let range = -0.5 * longest_s..=most_s;
        let mut best = (0.0, self.cost(&corners_s) - SIGNIFICANT);
        // offsets at which the start, the first corner or the last corner before the end is midway between two readings
        let mut tried: Vec<f64> = [0, 1, corners_s.len() - 2]
            .iter()
            .flat_map(|&k| self.between_readings().map(move |time_s| (k, time_s)))
            .map(|(k, time_s)| time_s - corners_s[k])
            .filter(|offset_s| range.contains(offset_s))
            .collect();
        tried.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        for offset_s in tried {
            // a cyclic program repeats itself: among starts that fit equally well, the start nearest to the first
            // reading is chosen
            let far = 0.5 * SIGNIFICANT * offset_s.abs() / most_s;
            let cost = self.cost(&self.corners_s(offset_s)) + far;
            if cost < best.1 {
                best = (offset_s, cost);
            }
        }
        best.0
    }

    fn between_readings(&self) -> impl Iterator<Item = f64> + '_ {
        self.times.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]))
    }

    /// Returns the time of a corner from the readings of its two segments, s; the given time if no other time is
    /// significantly better.
    fn moved(&self, corners_s: &[f64], k: usize) -> f64 {
        let [before_s, corner_s, after_s] = [corners_s[k - 1], corners_s[k], corners_s[k + 1]];
        let (from, to) = (self.before(before_s), self.before(after_s));
        let (first, second) = (self.channel(k - 1), self.channel(k));
        let cost = |corner: usize| first.about_line(from, corner) + second.about_line(corner, to);
        let range = 0.5 * (before_s + corner_s)..=0.5 * (corner_s + after_s);
        let mut best = (corner_s, cost(self.before(corner_s)) - SIGNIFICANT);
        for corner in from.max(1)..to {
            let time_s = 0.5 * (self.times[corner - 1] + self.times[corner]);
            let cost = cost(corner);
            if range.contains(&time_s) && cost < best.1 {
                best = (time_s, cost);
            }
        }
        best.0
    }

    /// Returns the time at which the first segment starts, for a first segment that ends at `end_s`; zero if no rest before
    /// the start is significant.
    fn start_s(&self, end_s: f64) -> f64 {
        let (channel, to) = (self.channel(0), self.before(end_s));
        let mut best = (0.0, channel.about_line(0, to) - SIGNIFICANT);
        for start in 1..to {
            let cost = channel.about_mean(0, start) + channel.about_line(start, to);
            if cost < best.1 {
                best = (0.5 * (self.times[start - 1] + self.times[start]), cost);
            }
        }
        best.0
    }

    fn branches(&self, curve: &TestCurve, corners_s: &[f64]) -> Vec<Branch> {
        let segments = self.program.len();
        let kinds: Vec<BranchKind> =
            (0..segments).map(|k| self.kind(curve, corners_s, k)).collect();
        let is_hold = |k: usize| matches!(kinds[k], BranchKind::Hold | BranchKind::ForceHold);
        let mut branches: Vec<Branch> = Vec::new();
        let mut from = 0;
        // the rest before the program starts
        let start = self.reading_at(corners_s, 0, Side::Nearest);
        if start > 0 {
            branches.push(Branch { kind: BranchKind::Hold, readings: 0..start + 1 });
            from = start;
        }
        for k in 0..segments {
            // the reading at a corner belongs to the hold, whose value is constant
            let side = match k + 1 < segments {
                true if is_hold(k) && !is_hold(k + 1) => Side::Before,
                true if !is_hold(k) && is_hold(k + 1) => Side::After,
                true => Side::Nearest,
                false => Side::Before,
            };
            let to = self.reading_at(corners_s, k + 1, side).max(from);
            match branches.last_mut() {
                // a change of the speed alone does not start a new branch
                Some(last) if last.kind == kinds[k] => last.readings.end = to + 1,
                // a loading counts even if it is shorter than the time between two readings
                _ if to > from || kinds[k] == BranchKind::Loading => {
                    branches.push(Branch { kind: kinds[k], readings: from..to + 1 });
                }
                _ => {}
            }
            from = to;
            if to + 1 == self.times.len() {
                break;
            }
        }
        branches
    }

    /// Returns the kind of the branch in a segment.
    fn kind(&self, curve: &TestCurve, corners_s: &[f64], k: usize) -> BranchKind {
        let ProgramSegment { end, .. } = self.program[k];
        let before = match k {
            0 => Some(0.0),
            _ => Some(self.program[k - 1].end)
                .filter(|start| start.is_force() == end.is_force())
                .map(ProgramLoad::value),
        };
        let change = match before {
            Some(before) => end.value() - before,
            // the value that the specimen has reached is known from its readings only
            None => self.change(curve, corners_s, k),
        };
        match change {
            change if change > 0.0 => BranchKind::Loading,
            change if change < 0.0 => BranchKind::Unloading,
            _ if end.is_force() => BranchKind::ForceHold,
            _ => BranchKind::Hold,
        }
    }

    /// Returns the change of the controlled value in a segment; zero if noise explains it.
    fn change(&self, curve: &TestCurve, corners_s: &[f64], k: usize) -> f64 {
        let (from, to) = (self.before(corners_s[k]), self.before(corners_s[k + 1]));
        // the first value is the last reading of the preceding segment, which is at the start of this segment
        let from = from.saturating_sub(1);
        let channel = self.channel(k);
        let values =
            if self.program[k].end.is_force() { &curve.force_n } else { &curve.displacement_mm };
        if to < from + 2 {
            return 0.0;
        }
        let mean = |range: std::ops::Range<usize>| {
            values[range.clone()].iter().sum::<f64>() / range.len() as f64
        };
        // means of the first and the last third
        let third = ((to - from) / 3).max(1);
        let change = mean(to - third..to) - mean(from..from + third);
        let by_noise = 5.0 * channel.noise * (2.0 / third as f64).sqrt();
        if change.abs() > by_noise.max(EQUAL * channel.range) { change } else { 0.0 }
    }

    /// Returns the index of the reading at a corner.
    fn reading_at(&self, corners_s: &[f64], k: usize, side: Side) -> usize {
        let corner_s = corners_s[k];
        let last = self.times.len() - 1;
        let neighbours = [k.checked_sub(1), Some(k)];
        let durations = neighbours.iter().flatten().filter_map(|&i| corners_s.get(i..i + 2));
        let shortest_s = durations.map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
        let at_s = AT_CORNER * shortest_s;
        let after = self.times.partition_point(|t| *t < corner_s - at_s).min(last);
        let before = self.times.partition_point(|t| *t <= corner_s + at_s).saturating_sub(1);
        match side {
            Side::Before => before,
            Side::After => after,
            Side::Nearest => {
                let distance = |i: usize| (self.times[i] - corner_s).abs();
                if distance(after) < distance(before) { after } else { before }
            }
        }
    }
}

/// The reading that represents a corner without a reading.
enum Side {
    Before,
    After,
    Nearest,
}

/// Displacement or force of a curve, with cumulative sums for least-squares lines.
struct Channel {
    /// Difference between the largest and the smallest value.
    range: f64,
    /// Standard deviation of one reading.
    noise: f64,
    /// Sums of x, y, x², xy, y² over all readings before each reading, with times and values scaled to about one.
    sums: Vec<[f64; 5]>,
    /// Variance of one reading in scaled units.
    variance: f64,
}

impl Channel {
    fn of(times: &[f64], values: &[f64]) -> Self {
        let [low, high] = values
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &v| [low.min(v), high.max(v)]);
        let range = high - low;
        let noise = noise::of_single_readings(times, values).max(LEAST_NOISE * range);
        let scale = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
        let duration_s = times.last().copied().unwrap_or(0.0);
        let mut sums = vec![[0.0; 5]];
        let mut sum = [0.0; 5];
        for (&time_s, &value) in times.iter().zip(values) {
            let (x, y) = (scale(time_s, duration_s) - 0.5, scale(value - low, range) - 0.5);
            for (sum, term) in sum.iter_mut().zip([x, y, x * x, x * y, y * y]) {
                *sum += term;
            }
            sums.push(sum);
        }
        let variance = scale(noise, range).max(LEAST_NOISE).powi(2);
        Self { range, noise, sums, variance }
    }

    /// Number of readings, and sums of x², xy and y² about the means of the readings `from..to`.
    fn about(&self, from: usize, to: usize) -> (f64, [f64; 3]) {
        let count = to.saturating_sub(from) as f64;
        if count == 0.0 {
            return (0.0, [0.0; 3]);
        }
        let [x, y, xx, xy, yy] = std::array::from_fn(|i| self.sums[to][i] - self.sums[from][i]);
        (count, [xx - x * x / count, xy - x * y / count, yy - y * y / count])
    }

    /// Squared normalised residuals about the mean, plus the number of fitted constants.
    fn about_mean(&self, from: usize, to: usize) -> f64 {
        let (count, [.., yy]) = self.about(from, to);
        yy.max(0.0) / self.variance + count.min(1.0)
    }

    /// Squared normalised residuals about the least-squares line, plus the number of fitted constants.
    fn about_line(&self, from: usize, to: usize) -> f64 {
        let (count, [xx, xy, yy]) = self.about(from, to);
        let explained = if count > 2.0 && xx > 0.0 { xy * xy / xx } else { 0.0 };
        let squares = if count > 2.0 { (yy - explained).max(0.0) } else { 0.0 };
        squares / self.variance + count.min(2.0)
    }
}

#[cfg(test)]
mod tests;
