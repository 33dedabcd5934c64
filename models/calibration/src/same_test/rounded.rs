//! Recognises the readings of one test in two files with different digits or a constant shift.

use super::resolution::Resolution;
use crate::experiment::TestCurve;

/// Share of the readings that may differ, so that a copy with some edited readings is found.
pub(super) const DIFFERENT: f64 = 0.02;
/// Share of the readings that may be outside the other curve.
pub(super) const OUTSIDE: f64 = 0.2;
/// Largest number of readings of a rounded copy that may differ: edited readings. Two tests whose forces differ by much less
/// than the resolution differ in few rounded readings, too.
const MOST_DIFFERENT: usize = 3;
/// Smallest number of readings: fewer rounded readings of different tests may agree by chance.
const LEAST: usize = 20;
/// Largest resolution of a force, as a fraction of the largest force. With a coarser resolution, forces of different
/// tests may agree.
const COARSEST: f64 = 0.004;
/// Largest resolution of a force per reading, as a fraction of the largest force. If the forces of two specimens differ by
/// a fraction x of the resolution, a reading agrees with the probability 1 − x. With this limit, specimens whose
/// forces differ by 0.1 % of the peak agree in all readings with a probability below exp(−20).
const COARSEST_PER_READING: f64 = 5e-5;
/// Ratio of two resolutions above which they are equal: both files have the same digits.
const EQUAL: f64 = 0.9;
/// Largest number of readings of one file per reading of the other file.
const LARGEST_STRIDE: usize = 20;
/// Number of readings that are compared before all readings.
const SAMPLE: usize = 6;
/// Largest ratio of the trend of the differences with the force to its standard error. Rounding has no trend, and
/// two specimens of different strength have.
const TREND: f64 = 4.0;

/// Whether two curves have the readings of one test, rounded to different digits or shifted by a constant displacement.
/// One of the files may have only every k-th reading, and readings may be missing at the start and at the end.
///
/// Differences between the readings must be explained by the resolutions of the two files: the difference of two
/// rounded numbers is at most half the sum of their last digits, and the differences of numbers with equal digits, after a
/// shift that is not a multiple of the last digit, lie within one last digit. The resolution is read from the numbers themselves.
pub(super) fn is_rounded_copy(a: &TestCurve, b: &TestCurve) -> bool {
    let (few, many) = if a.force_n.len() <= b.force_n.len() { (a, b) } else { (b, a) };
    if few.force_n.len() < LEAST {
        return false;
    }
    let pair = Pair { few: Columns::of(few), many: Columns::of(many) };
    if [&pair.few, &pair.many].iter().any(|file| file.is_coarse()) {
        return false;
    }
    let (count, other) = (few.force_n.len(), many.force_n.len());
    let missing = (OUTSIDE * count as f64) as usize;
    (1..=LARGEST_STRIDE).any(|stride| {
        // reading i of `few` is reading `stride` i + start − `before` of `many`
        let before = stride * missing;
        let last = (other + before).saturating_sub(stride * (count - missing).saturating_sub(1));
        (0..last).any(|start| pair.agrees(&Alignment { stride, start, before }))
    })
}

/// Displacements and forces of a file with their resolutions.
struct Columns<'a> {
    curve: &'a TestCurve,
    displacement: Resolution,
    force: Resolution,
    largest_force_n: f64,
}

impl<'a> Columns<'a> {
    fn of(curve: &'a TestCurve) -> Self {
        Self {
            curve,
            displacement: Resolution::of(&curve.displacement_mm),
            force: Resolution::of(&curve.force_n),
            largest_force_n: curve.force_n.iter().fold(0.0, |most: f64, f| f.abs().max(most)),
        }
    }

    fn is_coarse(&self) -> bool {
        let readings = self.curve.force_n.len() as f64;
        let coarsest = COARSEST.min(COARSEST_PER_READING * readings);
        self.force.at(self.largest_force_n) > coarsest * self.largest_force_n
    }
}

/// Which reading of one file corresponds to a reading of the other file.
struct Alignment {
    stride: usize,
    start: usize,
    before: usize,
}

impl Alignment {
    fn partner(&self, index: usize, readings: usize) -> Option<usize> {
        let partner = (self.stride * index + self.start).checked_sub(self.before)?;
        (partner < readings).then_some(partner)
    }
}

struct Pair<'a> {
    few: Columns<'a>,
    many: Columns<'a>,
}

/// Difference of two readings, and its largest size by rounding.
#[derive(Clone, Copy)]
struct Difference {
    value: f64,
    rounding: f64,
}

impl Difference {
    fn of(value: f64, a: f64, b: f64) -> Self {
        let (coarse, fine) = (a.max(b), a.min(b));
        let sum = if fine > EQUAL * coarse { coarse } else { coarse + fine };
        // the round-off of the numbers themselves
        Self { value, rounding: 0.5 * sum * (1.0 + 1e-6) + 1e-12 * value.abs() }
    }

    fn is_rounding(&self) -> bool {
        self.value.abs() <= self.rounding
    }
}

impl Pair<'_> {
    fn agrees(&self, alignment: &Alignment) -> bool {
        let [few, many] = [&self.few, &self.many].map(|file| file.curve.force_n.len());
        let common = |i: usize| Some((i, alignment.partner(i, many)?));
        let first = (0..few).find(|&i| common(i).is_some());
        let last = (0..few).rev().find(|&i| common(i).is_some());
        let (Some(first), Some(last)) = (first, last) else { return false };
        let count = last - first + 1;
        if (count as f64) < (1.0 - OUTSIDE) * few as f64 || count < LEAST {
            return false;
        }
        let sample = (0..SAMPLE).filter_map(|k| common(first + k * (count - 1) / (SAMPLE - 1)));
        let sample: Vec<Difference> = sample.map(|pair| self.force(pair)).collect();
        if sample.iter().filter(|force| force.is_rounding()).count() + 1 < SAMPLE {
            return false;
        }
        let pairs: Vec<(usize, usize)> = (first..=last).filter_map(common).collect();
        let different = (DIFFERENT * pairs.len() as f64) as usize;
        let least = pairs.len() - different.min(MOST_DIFFERENT);
        let forces: Vec<Difference> = pairs.iter().map(|&pair| self.force(pair)).collect();
        let displacements: Vec<Difference> =
            pairs.iter().map(|&pair| self.displacement(pair)).collect();
        forces.iter().filter(|force| force.is_rounding()).count() >= least
            && have_common_shift(&displacements, least)
            && !self.has_trend(&pairs, &forces)
    }

    fn force(&self, (i, j): (usize, usize)) -> Difference {
        let (a, b) = (self.few.curve.force_n[i], self.many.curve.force_n[j]);
        Difference::of(b - a, self.few.force.at(a), self.many.force.at(b))
    }

    fn displacement(&self, (i, j): (usize, usize)) -> Difference {
        let (a, b) = (self.few.curve.displacement_mm[i], self.many.curve.displacement_mm[j]);
        Difference::of(b - a, self.few.displacement.at(a), self.many.displacement.at(b))
    }

    /// Whether the differences of the forces grow with the force. Edited readings are
    /// omitted.
    fn has_trend(&self, pairs: &[(usize, usize)], forces: &[Difference]) -> bool {
        let points: Vec<[f64; 2]> = pairs
            .iter()
            .zip(forces)
            .map(|(&(i, _), d)| (self.few.curve.force_n[i], d))
            .filter(|(_, d)| d.is_rounding())
            .map(|(force, d)| [force, d.value])
            .collect();
        let count = points.len() as f64;
        let mean = |k: usize| points.iter().map(|point| point[k]).sum::<f64>() / count;
        let (x, y) = (mean(0), mean(1));
        let sum =
            |f: fn(f64, f64) -> f64| points.iter().map(|p| f(p[0] - x, p[1] - y)).sum::<f64>();
        let (xx, xy, yy) = (sum(|x, _| x * x), sum(|x, y| x * y), sum(|_, y| y * y));
        let slope = xy / xx;
        let residual = (yy - slope * xy).max(0.0) / (count - 2.0);
        // equal digits leave differences of round-off, whose trend means nothing
        let is_round_off = yy.sqrt() <= 1e-9 * self.few.largest_force_n * count.sqrt();
        !is_round_off && slope.abs() > TREND * (residual / xx).sqrt()
    }
}

/// Whether a constant explains at least `least` differences up to their rounding.
fn have_common_shift(differences: &[Difference], least: usize) -> bool {
    // the intervals of possible shifts: count the intervals that contain each of their ends
    let mut ends: Vec<(f64, i32)> = Vec::with_capacity(2 * differences.len());
    for Difference { value, rounding } in differences {
        ends.extend([(value - rounding, 1), (value + rounding, -1)]);
    }
    // an interval that begins where another one ends shares this point with it
    ends.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
    let mut open = 0;
    ends.into_iter().any(|(_, step)| {
        open += step;
        open >= least as i32
    })
}
