//! Comparison of prior and posterior of each parameter.

use std::fmt;

use super::order::quantile_of_sorted;
use super::{mean, mean_and_variance};
use crate::quantity::format::cell;

/// Largest relative standard error of the variance of the prior draws at which the variance is used; above it,
/// interquartile ranges are used. The limits between the labels of [`Identification`] differ by more than this error.
const LARGEST_ERROR: f64 = 0.1;
/// Contraction (1 − posterior variance/prior variance) below which the posterior is wider than the prior by more than
/// the sampling error.
const WIDENED: f64 = -0.5;
/// Ratio of the fraction of posterior draws near a bound to the fraction of prior draws near the same bound, above
/// which the posterior piles up at the bound. Under a prior Beta(½, ½), one datum can double the fraction. If a bound
/// truncates a posterior peak, the ratio is much larger, because the prior is many times wider than the peak.
const PILED_UP: f64 = 2.0;
/// Under a prior with heavy tails, a value is rare if less than this fraction of the prior draws is farther out in the
/// tail. The fraction is small because a horseshoe prior has hundreds of local scales, and some
/// of these scales are expected far out in the tail.
const RARE: f64 = 1e-3;

/// Names of the bounds of a prior.
const SIDES: [&str; 2] = ["lower", "upper"];

/// Degree to which the data narrow the distribution of a parameter, from the contraction 1 −
/// var(posterior)/var(prior).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Identification {
    /// Contraction below 0.1: the posterior is about as wide as the prior.
    Not,
    /// Contraction from 0.1 to 0.5.
    Weakly,
    /// Contraction of at least 0.5.
    Identified,
}

impl Identification {
    /// Returns the label of a contraction; [`Identification::Not`] for NaN.
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

/// Posterior draws that pile up at a bound of the prior.
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

/// Comparison of prior and posterior of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Identifiability {
    /// Name with indices, such as `sd[0]`.
    pub name: String,
    /// Prior mean and standard deviation.
    pub prior: [f64; 2],
    /// Posterior mean and standard deviation.
    pub posterior: [f64; 2],
    /// Interquartile ranges of prior and posterior if the prior has heavy tails; otherwise `None`.
    pub halves: Option<[f64; 2]>,
    /// Fraction of the posterior draws that pile up at a bound of the prior. A draw counts if its distance to the
    /// bound is below 1 % of the width of the bounded prior and below a fifth of the posterior standard deviation.
    /// The second limit excludes a bound of a wide prior that is far from the posterior in units of its standard
    /// deviation. `None` if no draws pile up at a bound, or if a similar fraction of the prior draws is near the
    /// bound.
    pub boundary_mass: Option<f64>,
    /// Bounds of the prior at which the posterior draws pile up.
    cuts: Vec<Cut>,
    conflict: bool,
}

impl Identifiability {
    /// Compares draws of the prior and of the posterior. `bounds` are the lower and the upper bound of the prior; an
    /// infinite bound is no bound.
    ///
    /// Draws pile up at a bound only if the fraction of posterior draws near the bound is more than twice the
    /// fraction of prior draws. This comparison is needed because a prior can itself have a large fraction near its
    /// bound, and a parameter that the data do not inform keeps this fraction. A bound at zero is ignored, because it
    /// is a natural bound of the quantity, such as a scale or a share.
    ///
    /// Under a prior with heavy tails, such as a Cauchy, the sample variance depends on a few extreme draws. Let κ be
    /// the kurtosis of the n prior draws. If the relative standard error √((κ − 1)/n) of their variance is above 0.1,
    /// interquartile ranges replace the standard deviations of prior and posterior.
    ///
    /// ```
    /// use ppl::diagnostics::{Identifiability, Identification};
    /// // prior and posterior are the same Cauchy distribution: the data do not inform the parameter
    /// let cauchy = |n: u32| -> Vec<f64> {
    ///     let at = |i| (std::f64::consts::PI * ((f64::from(i) + 0.5) / f64::from(n) - 0.5)).tan();
    ///     (0..n).map(at).collect()
    /// };
    /// let row = Identifiability::of_draws("x", &cauchy(2000), &cauchy(500), None);
    /// assert!(row.posterior[1] < 0.6 * row.prior[1], "standard deviations of Cauchy draws differ by chance");
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
                    // a single outlier increases the variance, but not the interquartile range
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

    /// Contraction c = 1 − var(posterior)/var(prior). The contraction is near 1 if the data determine the parameter,
    /// 0 if posterior and prior are equally wide, and negative if the posterior is wider than the prior.
    ///
    /// If [`halves`](Self::halves) is set, the squared interquartile ranges replace the variances.
    pub fn contraction(&self) -> f64 {
        let [before, after] = self.halves.unwrap_or([self.prior[1], self.posterior[1]]);
        1.0 - (after / before).powi(2)
    }

    /// Whether the posterior is wider than the prior, for example because the data favour the tail of the prior.
    pub(crate) fn widened(&self) -> bool {
        self.conflict || self.halves.is_some() && self.contraction() < WIDENED
    }

    /// Whether the data conflict with the prior, that is, favour values that are rare under the prior. A conflict is
    /// reported if the contraction is below −0.5 for a reason other than a single outlier. Under a prior with heavy
    /// tails, less than one in a thousand prior draws must also be as far out in the tail as the posterior median.
    pub fn conflict(&self) -> bool {
        self.conflict
    }

    /// Returns the label of the contraction.
    pub fn label(&self) -> Identification {
        Identification::of(self.contraction())
    }

    /// Whether the prior truncates the posterior: more than 5 % of the draws pile up at a prior bound.
    pub fn truncated(&self) -> bool {
        self.boundary_mass.is_some_and(|mass| mass > 0.05)
    }

    /// Description of the bounds at which draws pile up, such as "12 % at its upper end 100".
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
            write!(
                f,
                "; heavy tails: interquartile range {}, prior {}",
                cell(after),
                cell(before)
            )?;
        }
        write!(f, ")")?;
        if self.truncated() {
            write!(f, "; truncated by its prior: {}", self.cuts())
        } else {
            Ok(())
        }
    }
}

/// Mean and standard deviation, with the divisor n − 1 for the variance.
fn mean_and_sd(draws: &[f64]) -> [f64; 2] {
    let (mean, variance) = mean_and_variance(draws.iter().copied());
    [mean, variance.sqrt()]
}

/// Whether the relative standard error of the variance of `draws` exceeds [`LARGEST_ERROR`]. Also true if the
/// variance overflows.
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

/// Smaller of the fractions of draws below and above `x`, for sorted draws.
fn fraction_beyond(sorted: &[f64], x: f64) -> f64 {
    let below = sorted.partition_point(|&draw| draw < x);
    below.min(sorted.len() - below) as f64 / sorted.len() as f64
}

/// Fractions of the draws within `margin` of the lower and of the upper bound.
fn fractions_within(margin: f64, draws: &[f64], (lower, upper): (f64, f64)) -> [f64; 2] {
    let fraction =
        |is_near: &dyn Fn(f64) -> bool| mean(draws.iter().map(|&x| f64::from(is_near(x))));
    [fraction(&|x| x < lower + margin), fraction(&|x| x > upper - margin)]
}
