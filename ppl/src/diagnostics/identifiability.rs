//! What did the data say about each parameter?

use std::fmt;

use super::order::quantile_of_sorted;
use super::{mean, mean_and_variance};
use crate::words::cell;

/// The variance of the prior draws cannot be trusted if its own standard error is more than this
/// part of it: labels are 0.1 of the prior variance apart.
const LARGEST_ERROR: f64 = 0.1;
/// The contraction below which the posterior is wider than the prior, whatever the draws.
const WIDENED: f64 = -0.5;
/// A prior piles up at its bounds itself if the posterior has less than this many times its fraction
/// there: one datum doubles it where the prior is Beta(½, ½), and a prior that cuts a peak off is
/// many times wider than the peak.
const PILED_UP: f64 = 2.0;
/// A prior with heavy tails holds to be rare what is farther out than all but this fraction of it: a
/// local scale of a horseshoe is one of hundreds, and some of them are far out.
const RARE: f64 = 1e-3;

/// The ends of a prior.
const SIDES: [&str; 2] = ["lower", "upper"];

/// How far the data narrowed a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Identification {
    /// Contraction below 0.1: the posterior is the prior.
    Not,
    /// Contraction from 0.1 to 0.5.
    Weakly,
    /// Contraction of at least 0.5.
    Identified,
}

impl Identification {
    /// The label of a contraction; one that is not a number counts as nothing learned.
    pub fn of(contraction: f64) -> Self {
        match contraction {
            c if c >= 0.5 => Self::Identified,
            c if c >= 0.1 => Self::Weakly,
            _ => Self::Not,
        }
    }
}

impl fmt::Display for Identification {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Not => "not identified",
            Self::Weakly => "weakly identified",
            Self::Identified => "identified",
        })
    }
}

/// Draws that pile up at an end of a prior.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cut {
    side: &'static str,
    end: f64,
    fraction: f64,
}

impl fmt::Display for Cut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.0} % at its {} end {}", 100.0 * self.fraction, self.side, cell(self.end))
    }
}

/// What the data did to one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Identifiability {
    /// Name with indices, as `sd[0]`.
    pub name: String,
    /// Mean and standard deviation before the data.
    pub prior: [f64; 2],
    /// Mean and standard deviation after the data.
    pub posterior: [f64; 2],
    /// Widths of the central halves of prior and posterior, where the prior has heavy tails.
    pub halves: Option<[f64; 2]>,
    /// Fraction of the draws within 1 % of the width of the prior's box from a bound, and within a fifth
    /// of their own standard deviation: a wide prior does not cut off what is far from its bound on the
    /// scale of the posterior. `None` for a prior that cuts nothing off, or has about as much there.
    pub boundary_mass: Option<f64>,
    /// Which ends have it.
    cuts: Vec<Cut>,
    conflict: bool,
}

impl Identifiability {
    /// From draws of the prior and of the posterior; `bounds` are the prior's, infinite where it has
    /// none.
    ///
    /// Draws pile up at a bound only if they have more than twice the prior's fraction there: a prior may
    /// have much of its own, and what the data left where it was has the prior's shape. A bound at
    /// zero is the quantity's own, as of a scale or a share, and cuts nothing off.
    ///
    /// Under a prior with heavy tails, as a Cauchy, sample variances are those of the few farthest
    /// draws. Where the prior draws have a kurtosis κ so large that the standard error of their
    /// variance, √((κ − 1)/n) of it, is above a tenth, the widths of the central halves stand in
    /// for the standard deviations of prior and posterior alike.
    ///
    /// ```
    /// use ppl::diagnostics::{Identifiability, Identification};
    /// // quantiles of a Cauchy distribution: the data said nothing
    /// let cauchy = |n: u32| -> Vec<f64> {
    ///     let at = |i| (std::f64::consts::PI * ((f64::from(i) + 0.5) / f64::from(n) - 0.5)).tan();
    ///     (0..n).map(at).collect()
    /// };
    /// let row = Identifiability::of_draws("x", &cauchy(2000), &cauchy(500), None);
    /// assert!(row.posterior[1] < 0.6 * row.prior[1], "of no meaning");
    /// assert!(row.contraction().abs() < 0.01);
    /// assert_eq!(row.label(), Identification::Not);
    /// ```
    pub fn of_draws(
        name: impl Into<String>,
        before: &[f64],
        after: &[f64],
        bounds: Option<(f64, f64)>,
    ) -> Self {
        let mut row = Self {
            name: name.into(),
            prior: mean_and_sd(before),
            posterior: mean_and_sd(after),
            halves: None,
            boundary_mass: None,
            cuts: Vec::new(),
            conflict: false,
        };
        let heavy = has_heavy_tails(before);
        if heavy || row.contraction() < WIDENED {
            let [before, after] = [before, after].map(sorted);
            let halves = [&before, &after].map(|sorted| central_half(sorted));
            row.halves = (heavy && halves[0] > 0.0).then_some(halves);
            row.conflict = row.contraction() < WIDENED
                && if heavy {
                    fraction_beyond(&before, quantile_of_sorted(&after, 0.5)) < RARE
                } else {
                    // one draw far out makes a variance, but not a width
                    halves[1] > halves[0]
                };
        }
        if let Some((lower, upper)) = bounds {
            let margin = (0.01 * (upper - lower)).min(0.2 * row.posterior[1]);
            let [before, after] =
                [before, after].map(|draws| fractions_within(margin, draws, (lower, upper)));
            for (i, end) in [lower, upper].into_iter().enumerate() {
                if end != 0.0 && after[i] > PILED_UP * before[i] {
                    row.cuts.push(Cut { side: SIDES[i], end, fraction: after[i] });
                }
            }
            let mass = row.cuts.iter().map(|cut| cut.fraction).sum();
            row.boundary_mass = (!row.cuts.is_empty()).then_some(mass);
        }
        row
    }

    /// c = 1 − var(posterior)/var(prior): 1 all learned, 0 nothing, negative if the data widened it.
    ///
    /// With [`halves`](Self::halves), the squares of these widths stand for the variances.
    pub fn contraction(&self) -> f64 {
        let [before, after] = self.halves.unwrap_or([self.prior[1], self.posterior[1]]);
        1.0 - (after / before).powi(2)
    }

    /// The posterior is wider than the prior, as where the data ask for the prior's tail.
    pub(crate) fn widened(&self) -> bool {
        self.conflict || self.halves.is_some() && self.contraction() < WIDENED
    }

    /// The data ask for values that the prior holds to be rare: the contraction is below −0.5, and
    /// not for a draw far out; under a prior with heavy tails, which has such values, less than one
    /// in a thousand of its draws lies as far out as the posterior.
    pub fn conflict(&self) -> bool {
        self.conflict
    }

    /// The contraction in words.
    pub fn label(&self) -> Identification {
        Identification::of(self.contraction())
    }

    /// More than 5 % of the draws lie at a prior bound: the prior cuts the posterior.
    pub fn truncated(&self) -> bool {
        self.boundary_mass.is_some_and(|mass| mass > 0.05)
    }

    /// Where the prior cuts, in words: "12 % at its upper end 100".
    pub(crate) fn cuts(&self) -> String {
        self.cuts.iter().map(Cut::to_string).collect::<Vec<_>>().join(" and ")
    }
}

impl fmt::Display for Identifiability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}: {} (contraction {:.2}; prior {} ± {}, posterior {} ± {}",
            self.name,
            self.label(),
            self.contraction(),
            cell(self.prior[0]),
            cell(self.prior[1]),
            cell(self.posterior[0]),
            cell(self.posterior[1])
        )?;
        if let Some([before, after]) = self.halves {
            write!(f, "; heavy tails: central half {} wide after {}", cell(after), cell(before))?;
        }
        write!(f, ")")?;
        if self.truncated() {
            write!(f, "; truncated by its prior: {}", self.cuts())
        } else {
            Ok(())
        }
    }
}

/// The standard deviation with n − 1.
fn mean_and_sd(draws: &[f64]) -> [f64; 2] {
    let (mean, variance) = mean_and_variance(draws.iter().copied());
    [mean, variance.sqrt()]
}

/// Whether the variance of these draws has a standard error of more than [`LARGEST_ERROR`] of it,
/// as far as they can tell: one that overflows is of no use either.
pub(super) fn has_heavy_tails(draws: &[f64]) -> bool {
    let [centre, sd] = mean_and_sd(draws);
    let kurtosis = mean(draws.iter().map(|x| ((x - centre) / sd).powi(4)));
    let is_sure = sd.is_finite() && (kurtosis - 1.0) / draws.len() as f64 <= LARGEST_ERROR.powi(2);
    !is_sure
}

fn sorted(draws: &[f64]) -> Vec<f64> {
    let mut sorted = draws.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}

fn central_half(sorted: &[f64]) -> f64 {
    quantile_of_sorted(sorted, 0.75) - quantile_of_sorted(sorted, 0.25)
}

/// Fraction of the draws that are farther from their median than `x`, on its side.
fn fraction_beyond(sorted: &[f64], x: f64) -> f64 {
    let below = sorted.partition_point(|&own| own < x);
    below.min(sorted.len() - below) as f64 / sorted.len() as f64
}

/// Fractions of the draws within `margin` of the lower and of the upper bound.
fn fractions_within(margin: f64, draws: &[f64], (lower, upper): (f64, f64)) -> [f64; 2] {
    let fraction =
        |is_near: &dyn Fn(f64) -> bool| mean(draws.iter().map(|&x| f64::from(is_near(x))));
    [fraction(&|x| x < lower + margin), fraction(&|x| x > upper - margin)]
}
