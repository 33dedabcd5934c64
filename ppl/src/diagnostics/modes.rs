//! Detection of separate posterior modes of one quantity, and of the chains that sample each mode.

use super::identifiability::has_heavy_tails;
use super::order::quantile_of_sorted;
use super::{borrow, mean_and_variance};

/// Number of cells of the density estimate, between the 0.5 % and 99.5 % quantiles.
const CELLS: usize = 512;
/// Largest ratio of the density in a valley to the density at the lower of the two neighbouring peaks.
const VALLEY: f64 = 0.2;
/// Smallest fraction of all draws in a mode.
const LEAST_FRACTION: f64 = 0.03;
/// Smallest number of times that the sequence of draws in a mode crosses the median of the mode. Forty independent
/// draws cross the median about twenty times; a chain that is stuck in a tail for a while crosses the median far less
/// often.
const LEAST_TURNS: usize = 20;

/// Modes of a quantity that are separated by deep valleys of its density.
#[derive(Clone, Debug, PartialEq)]
pub struct Modes {
    /// Mean of the draws in each mode, ascending.
    pub centres: Vec<f64>,
    /// Boundaries between neighbouring modes, ascending.
    pub valleys: Vec<f64>,
    /// Fraction of each chain's draws in each mode: `chain × mode`.
    pub fractions: Vec<Vec<f64>>,
    /// Number of transitions of each chain between modes.
    pub changes: Vec<usize>,
}

impl Modes {
    /// Finds the modes of a quantity, given one trace per chain; `None` if there is only one mode.
    ///
    /// The draws of all chains are smoothed with a kernel density estimate. The bandwidth is chosen for the narrowest
    /// chain that is not stuck at one place. The density is cut where it falls below a fifth of the lower
    /// neighbouring peak, if at least 3 % of the draws lie on each side of the cut. A quantity with heavy tails is
    /// first transformed to a scale with light tails. The draws of a mode must also cross the median of the mode at
    /// least twenty times, as forty independent draws do on average. This condition excludes places at which a chain
    /// was stuck for a while.
    ///
    /// R-hat shows that chains differ, but does not show the modes. R-hat can also be near 1 if each chain has
    /// changed between modes only a few times.
    ///
    /// ```
    /// use ppl::diagnostics::Modes;
    ///
    /// let wave = |centre: f64| (0..200).map(|t| centre + (t as f64).sin()).collect::<Vec<_>>();
    /// let (low, high, other) = (wave(-5.0), wave(5.0), wave(-5.0));
    /// let modes = Modes::find(&[&low, &high, &other]).expect("two modes");
    /// assert_eq!(modes.centres.len(), 2);
    /// assert_eq!(modes.sitting_in(0), [0, 2]);
    /// assert!(!modes.mixed());
    /// ```
    pub fn find(chains: &[&[f64]]) -> Option<Self> {
        let mut sorted = chains.concat();
        if sorted.len() < 100 || sorted.iter().any(|x| !x.is_finite()) {
            return None;
        }
        sorted.sort_unstable_by(f64::total_cmp);
        let mut valleys = match AsinhScale::of_heavy_tails(&sorted) {
            None => valleys(chains, &sorted)?,
            Some(scale) => {
                let onto = |draws: &[f64]| draws.iter().map(|&x| scale.onto(x)).collect();
                let chains: Vec<Vec<f64>> = chains.iter().map(|chain| onto(chain)).collect();
                let sorted: Vec<f64> = onto(&sorted);
                let valleys = valleys(&borrow(&chains), &sorted)?;
                valleys.into_iter().map(|u| scale.back(u)).collect()
            }
        };
        if valleys.is_empty() {
            return None;
        }
        valleys.sort_unstable_by(f64::total_cmp);

        let mode_of = |x: f64| valleys.partition_point(|&valley| valley <= x);
        let modes = valleys.len() + 1;
        let (mut sums, mut counts) = (vec![0.0; modes], vec![0.0; modes]);
        for &x in &sorted {
            sums[mode_of(x)] += x;
            counts[mode_of(x)] += 1.0;
        }
        let fraction = |chain: &[f64], mode: usize| {
            let inside = chain.iter().filter(|&&x| mode_of(x) == mode).count();
            inside as f64 / chain.len() as f64
        };
        let fractions =
            chains.iter().map(|chain| (0..modes).map(|mode| fraction(chain, mode)).collect());
        let changes = chains.iter().map(|chain| {
            chain.windows(2).filter(|pair| mode_of(pair[0]) != mode_of(pair[1])).count()
        });
        Some(Self {
            centres: sums.iter().zip(&counts).map(|(sum, count)| sum / count).collect(),
            fractions: fractions.collect(),
            changes: changes.collect(),
            valleys,
        })
    }

    /// Indices of the chains with at least 99 % of their draws in the given mode.
    pub fn sitting_in(&self, mode: usize) -> Vec<usize> {
        (0..self.fractions.len()).filter(|&chain| self.fractions[chain][mode] >= 0.99).collect()
    }

    /// Whether the draws determine the weights of the modes. Every chain must have changed between modes at least ten
    /// times. Two changes are enough for a chain whose fraction of draws in every mode is at least half of the
    /// average over the chains.
    pub fn mixed(&self) -> bool {
        let average = |mode: usize| {
            self.fractions.iter().map(|fractions| fractions[mode]).sum::<f64>()
                / self.fractions.len() as f64
        };
        self.fractions.iter().zip(&self.changes).all(|(fractions, &changes)| {
            let even = (0..fractions.len()).all(|mode| fractions[mode] >= 0.5 * average(mode));
            changes >= 10 || changes >= 2 && even
        })
    }
}

/// Returns the positions at which the smoothed density of all chains is cut; `None` if no density can be estimated.
fn valleys(chains: &[&[f64]], sorted: &[f64]) -> Option<Vec<f64>> {
    let mut valleys = Vec::new();
    Smoothed::new(chains, sorted)?.cut(0, CELLS, &mut valleys);
    Some(valleys)
}

/// Transformation u = asinh((x − median)/width) that makes heavy tails light.
///
/// On the original scale, successive draws far out in a Cauchy tail form an isolated cluster. On the transformed
/// scale the tail decays exponentially, and such draws are a part of the tail.
struct AsinhScale {
    centre: f64,
    width: f64,
}

impl AsinhScale {
    /// Creates the transformation for the given draws; returns `None` if the draws have no heavy tails.
    fn of_heavy_tails(sorted: &[f64]) -> Option<Self> {
        let quantile = |p| quantile_of_sorted(sorted, p);
        let width = 0.5 * (quantile(0.75) - quantile(0.25));
        let heavy = has_heavy_tails(sorted) && width > 0.0;
        heavy.then(|| Self { centre: quantile(0.5), width })
    }

    fn onto(&self, x: f64) -> f64 {
        ((x - self.centre) / self.width).asinh()
    }

    fn back(&self, u: f64) -> f64 {
        self.centre + self.width * u.sinh()
    }
}

/// Number of times that the draws cross `centre`.
fn turns(draws: impl Iterator<Item = f64>, centre: f64) -> usize {
    let mut sides = draws.map(|x| x < centre);
    let mut last = sides.next();
    sides.filter(|&side| last.replace(side) != Some(side)).count()
}

/// Returns the smallest standard deviation of a chain. Chains that are stuck at one place are ignored, unless all
/// chains are stuck.
fn narrowest(chains: &[&[f64]]) -> Option<f64> {
    let spreads = chains.iter().map(|chain| {
        let (centre, variance) = mean_and_variance(chain.iter().copied());
        (turns(chain.iter().copied(), centre) < LEAST_TURNS, variance.sqrt())
    });
    let spreads = spreads.filter(|(_, sd)| *sd > 0.0);
    spreads.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))).map(|(_, sd)| sd)
}

/// Kernel density estimate on cells between the 0.5 % and 99.5 % quantiles.
struct Smoothed<'d> {
    chains: &'d [&'d [f64]],
    sorted: &'d [f64],
    first: f64,
    width: f64,
    density: Vec<f64>,
    /// Number of draws in all preceding cells, for each cell.
    before: Vec<usize>,
}

impl<'d> Smoothed<'d> {
    /// Smooths a histogram with a Gaussian kernel. The bandwidth is given by Silverman's rule for the narrowest chain
    /// that is not stuck.
    fn new(chains: &'d [&'d [f64]], sorted: &'d [f64]) -> Option<Self> {
        let total = sorted.len();
        let (first, last) = (sorted[total / 200], sorted[total - 1 - total / 200]);
        let width = (last - first) / CELLS as f64;
        let narrowest = narrowest(chains)?;
        if !(width > 0.0 && narrowest.is_finite()) {
            return None;
        }
        let length = chains.iter().map(|chain| chain.len()).min().unwrap_or(0) as f64;
        let cells = CELLS as f64;
        let bandwidth = (0.9 * narrowest * length.powf(-0.2) / width).clamp(1.0, cells);

        let mut counts = vec![0; CELLS];
        for x in sorted {
            let cell = ((x - first) / width).clamp(0.0, cells - 1.0);
            counts[cell as usize] += 1;
        }
        let mut before = vec![0];
        before.extend(counts.iter().scan(0, |sum, count| {
            *sum += count;
            Some(*sum)
        }));
        let reach = (4.0 * bandwidth).ceil() as usize;
        let kernel: Vec<f64> =
            (0..=reach).map(|k| (-0.5 * (k as f64 / bandwidth).powi(2)).exp()).collect();
        let density = (0..CELLS).map(|i| {
            let near = i.saturating_sub(reach)..(i + reach + 1).min(CELLS);
            near.map(|j| counts[j] as f64 * kernel[i.abs_diff(j)]).sum()
        });
        Some(Self { chains, sorted, first, width, density: density.collect(), before })
    }

    /// Whether the cells `from..to` are a mode: they contain at least [`LEAST_FRACTION`] of all draws, and these
    /// draws cross their median at least [`LEAST_TURNS`] times.
    fn is_mode(&self, from: usize, to: usize) -> bool {
        let [below, above] = [from, to].map(|cell| self.before[cell]);
        let enough = (above - below) as f64 >= LEAST_FRACTION * self.sorted.len() as f64;
        enough && {
            let part = &self.sorted[below..above];
            let (lowest, median, highest) = (part[0], part[part.len() / 2], part[part.len() - 1]);
            let inside = |x: &f64| lowest <= *x && *x <= highest;
            let turns = self.chains.iter().map(|chain| {
                let inside = chain.iter().copied().filter(inside);
                turns(inside, median)
            });
            turns.sum::<usize>() >= LEAST_TURNS
        }
    }

    /// Cuts the cells `from..to` at the deepest valley, and then cuts both parts recursively. Appends the positions
    /// of the cuts to `valleys`.
    fn cut(&self, from: usize, to: usize, valleys: &mut Vec<f64>) {
        let part = &self.density[from..to];
        let highest = |best: &mut f64, x: &f64| {
            *best = x.max(*best);
            Some(*best)
        };
        let left: Vec<f64> = part.iter().scan(0.0, highest).collect();
        let mut right: Vec<f64> = part.iter().rev().scan(0.0, highest).collect();
        right.reverse();
        let depth = |i: usize| part[i] / left[i].min(right[i]);
        let divides = |i: usize| self.is_mode(from, from + i) && self.is_mode(from + i, to);
        let valley = (1..part.len())
            .filter(|&i| depth(i) < VALLEY && divides(i))
            .min_by(|&i, &j| depth(i).total_cmp(&depth(j)));
        if let Some(i) = valley {
            // cut in the middle of a valley of constant density
            let flat = part[i..].iter().take_while(|&&x| x <= part[i]).count();
            let at = from + i + flat / 2;
            valleys.push(self.first + self.width * (at as f64 + 0.5));
            self.cut(from, at, valleys);
            self.cut(at, to, valleys);
        }
    }
}
