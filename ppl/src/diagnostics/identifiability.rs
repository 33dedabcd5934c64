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
/// A prior piles up at its bounds itself if the posterior has less than this many times its share
/// there: one datum doubles it where the prior is Beta(½, ½), and a prior that cuts a peak off is
/// many times wider than the peak.
const PILED_UP: f64 = 2.0;
/// A prior with heavy tails holds to be rare what is farther out than all but this share of it: a
/// local scale of a horseshoe is one of hundreds, and some of them are far out.
const RARE: f64 = 1e-3;

/// The ends of a prior.
const SIDES: [&str; 2] = ["lower", "upper"];

/// Mean and standard deviation of one parameter, prior or posterior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marginal {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub sd: f64,
}

impl Marginal {
    /// Of draws; the standard deviation with n − 1.
    pub fn of(draws: &[f64]) -> Self {
        let (mean, variance) = mean_and_variance(draws.iter().copied());
        Self { mean, sd: variance.sqrt() }
    }
}

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
    share: f64,
}

impl fmt::Display for Cut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.0} % at its {} end {}", 100.0 * self.share, self.side, cell(self.end))
    }
}

/// What the data did to one parameter.
///
/// ```
/// use ppl::diagnostics::{Identifiability, Identification, Marginal};
/// let prior = Marginal { mean: 275.0, sd: 14.4 };
/// let draws: Vec<f64> = (0..1000).map(|i| 280.0 + (i as f64).sin()).collect();
/// let row = Identifiability::new("young", prior, &draws, Some((250.0, 300.0)));
/// assert_eq!(row.label(), Identification::Identified);
/// assert!(row.contraction() > 0.99);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Identifiability {
    /// Name with indices, as `sd[0]`.
    pub name: String,
    /// Before the data.
    pub prior: Marginal,
    /// After the data.
    pub posterior: Marginal,
    /// Widths of the central halves of prior and posterior, where the prior has heavy tails.
    pub halves: Option<[f64; 2]>,
    /// [`boundary_mass`]; `None` for a prior that cuts nothing off, or has about as much there.
    pub boundary_mass: Option<f64>,
    /// Which ends have it.
    cuts: Vec<Cut>,
    /// Known truth, where the data are simulated.
    pub truth: Option<f64>,
    /// Largest total Sobol index of any output, where a surrogate gives one.
    pub sensitivity: Option<f64>,
    conflict: bool,
}

impl Identifiability {
    /// From draws of the prior and of the posterior; `bounds` are the prior's, infinite where it has
    /// none.
    ///
    /// Draws pile up at a bound only if they have more than twice the prior's share there: a prior may
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
    /// assert!(row.posterior.sd < 0.6 * row.prior.sd, "of no meaning");
    /// assert!(row.contraction().abs() < 0.01);
    /// assert_eq!(row.label(), Identification::Not);
    /// ```
    pub fn of_draws(
        name: impl Into<String>,
        before: &[f64],
        after: &[f64],
        bounds: Option<(f64, f64)>,
    ) -> Self {
        let mut row = Self::new(name, Marginal::of(before), after, None);
        let heavy = has_heavy_tails(before, row.prior);
        if heavy || row.conflict {
            let [before, after] = [before, after].map(sorted);
            let halves = [&before, &after].map(|sorted| central_half(sorted));
            row.halves = (heavy && halves[0] > 0.0).then_some(halves);
            row.conflict = row.contraction() < WIDENED
                && if heavy {
                    share_beyond(&before, quantile_of_sorted(&after, 0.5)) < RARE
                } else {
                    // one draw far out makes a variance, but not a width
                    halves[1] > halves[0]
                };
        }
        row.boundary_mass = bounds.and_then(|bounds| {
            let margin = boundary_margin(after, bounds);
            let [before, after] = [before, after].map(|draws| shares_within(margin, draws, bounds));
            let piled_up = |&(i, end): &(usize, f64)| end != 0.0 && after[i] > PILED_UP * before[i];
            let ends = [bounds.0, bounds.1].into_iter().enumerate().filter(piled_up);
            row.cuts = ends.map(|(i, end)| Cut { side: SIDES[i], end, share: after[i] }).collect();
            let mass = row.cuts.iter().map(|cut| cut.share).sum();
            (!row.cuts.is_empty()).then_some(mass)
        });
        row
    }

    /// From the prior's moments and posterior draws; `bounds` are the prior's, if it has two.
    pub fn new(
        name: impl Into<String>,
        prior: Marginal,
        draws: &[f64],
        bounds: Option<(f64, f64)>,
    ) -> Self {
        let mut row = Self {
            name: name.into(),
            prior,
            posterior: Marginal::of(draws),
            halves: None,
            boundary_mass: bounds.map(|bounds| boundary_mass(draws, bounds)),
            cuts: bounds.map_or_else(Vec::new, |bounds| {
                let shares = shares_within(boundary_margin(draws, bounds), draws, bounds);
                let ends = SIDES.iter().zip([bounds.0, bounds.1]).zip(shares);
                let ends = ends.map(|((side, end), share)| Cut { side, end, share });
                ends.filter(|cut| cut.share > 0.0).collect()
            }),
            truth: None,
            sensitivity: None,
            conflict: false,
        };
        row.conflict = row.contraction() < WIDENED;
        row
    }

    /// c = 1 − var(posterior)/var(prior): 1 all learned, 0 nothing, negative if the data widened it.
    ///
    /// With [`halves`](Self::halves), the squares of these widths stand for the variances.
    pub fn contraction(&self) -> f64 {
        let [before, after] = self.halves.unwrap_or([self.prior.sd, self.posterior.sd]);
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

    /// z = |posterior mean − truth| / posterior sd, where the truth is known.
    pub fn z_score(&self) -> Option<f64> {
        self.truth.map(|truth| (self.posterior.mean - truth).abs() / self.posterior.sd)
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
            cell(self.prior.mean),
            cell(self.prior.sd),
            cell(self.posterior.mean),
            cell(self.posterior.sd)
        )?;
        if let Some([before, after]) = self.halves {
            write!(f, "; heavy tails: central half {} wide after {}", cell(after), cell(before))?;
        }
        if let Some(z) = self.z_score() {
            write!(f, "; {z:.2} sd from the truth")?;
        }
        if let Some(sensitivity) = self.sensitivity {
            write!(f, "; largest total Sobol index {sensitivity:.2}")?;
        }
        write!(f, ")")?;
        if self.truncated() {
            write!(f, "; truncated by its prior: {}", self.cuts())
        } else {
            Ok(())
        }
    }
}

/// Whether the variance of these draws has a standard error of more than [`LARGEST_ERROR`] of it,
/// as far as they can tell: one that overflows is of no use either.
pub(super) fn has_heavy_tails(draws: &[f64], Marginal { mean: centre, sd }: Marginal) -> bool {
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

/// Share of the draws that are farther from their median than `x`, on its side.
fn share_beyond(sorted: &[f64], x: f64) -> f64 {
    let below = sorted.partition_point(|&own| own < x);
    below.min(sorted.len() - below) as f64 / sorted.len() as f64
}

/// Share of draws within 1 % of the width of the box from either bound, and within a fifth of their
/// own standard deviation: a wide prior does not cut off what is far from its bound on the scale of
/// the posterior. A bound may be infinite, and the width with it.
pub fn boundary_mass(draws: &[f64], bounds: (f64, f64)) -> f64 {
    shares_within(boundary_margin(draws, bounds), draws, bounds).iter().sum()
}

fn boundary_margin(draws: &[f64], (lower, upper): (f64, f64)) -> f64 {
    (0.01 * (upper - lower)).min(0.2 * Marginal::of(draws).sd)
}

/// Shares of the draws within `margin` of the lower and of the upper bound.
fn shares_within(margin: f64, draws: &[f64], (lower, upper): (f64, f64)) -> [f64; 2] {
    let share = |is_near: &dyn Fn(f64) -> bool| mean(draws.iter().map(|&x| f64::from(is_near(x))));
    [share(&|x| x < lower + margin), share(&|x| x > upper - margin)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_follow_the_contraction() {
        let prior = Marginal { mean: 0.0, sd: 1.0 };
        let with_sd = |sd: f64| Identifiability {
            name: "x".into(),
            prior,
            posterior: Marginal { mean: 0.5, sd },
            halves: None,
            conflict: false,
            boundary_mass: None,
            cuts: Vec::new(),
            truth: Some(1.5),
            sensitivity: None,
        };
        assert_eq!(with_sd(0.2).label(), Identification::Identified);
        assert_eq!(with_sd(0.8).label(), Identification::Weakly);
        assert_eq!(with_sd(0.99).label(), Identification::Not);
        assert_eq!(with_sd(1.3).label(), Identification::Not);
        assert_eq!(with_sd(f64::NAN).label(), Identification::Not);
        assert_eq!(with_sd(0.5).z_score(), Some(2.0));
        assert!((with_sd(0.5).contraction() - 0.75).abs() < 1e-15);
    }

    #[test]
    fn mass_at_a_bound_is_counted_on_both_sides() {
        let draws = [0.005, 0.5, 0.5, 0.995];
        assert_eq!(boundary_mass(&draws, (0.0, 1.0)), 0.5);
        let row =
            Identifiability::new("x", Marginal { mean: 0.5, sd: 0.29 }, &draws, Some((0.0, 1.0)));
        assert!(row.truncated());
        assert!(
            row.to_string().contains("25 % at its lower end 0 and 25 % at its upper end 1.000"),
            "{row}"
        );
    }

    /// A prior with mass at its ends, Beta(½, ½), is no cut where the data say nothing, and is one where
    /// they push against an end.
    #[test]
    fn a_prior_may_pile_up_at_its_own_bounds() {
        let at = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
            (0..2000).map(|i| of((f64::from(i) + 0.5) / 2000.0)).collect()
        };
        let arcsine = at(&|p| (std::f64::consts::FRAC_PI_2 * p).sin().powi(2));
        let pushed = at(&|p| 1.0 + 0.02 * (-p).ln_1p());
        let row = |after: &[f64]| Identifiability::of_draws("x", &arcsine, after, Some((0.0, 1.0)));
        assert!(boundary_mass(&arcsine, (0.0, 1.0)) > 0.1);
        assert!(!row(&arcsine).truncated());
        assert!(row(&pushed).to_string().contains("% at its upper end 1.000"));
        // towards zero, where a share ends by itself
        let away: Vec<f64> = pushed.iter().map(|x| 1.0 - x).collect();
        assert!(!row(&away).truncated());
    }

    /// Draws whose variance overflows, or that do so themselves, are judged by their central halves.
    #[test]
    fn overflowing_priors_are_compared_all_the_same() {
        for steepness in [100.0, 400.0] {
            let wild = |n: u32| -> Vec<f64> {
                let p = |i| (f64::from(i) + 0.5) / f64::from(n);
                (0..n).map(|i| (steepness * (2.0 * p(i) - 1.0).powi(9)).exp()).collect()
            };
            let (before, after) = (wild(2000), wild(1000));
            let row = Identifiability::of_draws("x", &before, &after, None);
            assert!(row.contraction().abs() < 0.02, "{row}");
            assert!(row.to_string().len() < 160, "{row}");
            let narrow: Vec<f64> = (0..1000).map(|i| 1.0 + 1e-4 * f64::from(i).sin()).collect();
            let row = Identifiability::of_draws("x", &before, &narrow, None);
            assert_eq!(row.label(), Identification::Identified);
        }
    }

    /// An exponential posterior is cut off at the bound, a gamma one on the same scale is not, however
    /// wide the prior.
    #[test]
    fn a_wide_prior_is_no_bound_by_itself() {
        let quantiles = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
            (0..1000).map(|i| of((f64::from(i) + 0.5) / 1000.0)).collect()
        };
        let exponential = quantiles(&|p| -(-p).ln_1p());
        let narrow = quantiles(&|p| 0.2 + 0.1 * (p / (1.0 - p)).ln().tanh());
        for width in [20.0, 100.0, 1e4] {
            assert!(boundary_mass(&exponential, (0.0, width)) > 0.15);
            assert_eq!(boundary_mass(&narrow, (0.0, width)), 0.0);
        }
    }
}
