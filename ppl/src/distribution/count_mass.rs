//! Probabilities of intervals of counts, with their derivatives in the parameters.

use super::{Count, CountMass};
use crate::scalar::Scalar;

/// P(K < first), P(first ≤ K ≤ last) and P(K > last), from the tails that keep digits; [`u64::MAX`]
/// is no last.
pub(super) fn masses<D: Count>(counts: &D, first: u64, last: u64) -> (f64, f64, f64) {
    let before = first.checked_sub(1);
    let below = before.map_or(0.0, |k| counts.cdf(k));
    let above = if last == u64::MAX { 0.0 } else { counts.sf(last) };
    let inside = if below > 0.5 {
        before.map_or(1.0, |k| counts.sf(k)) - above
    } else if above > 0.5 {
        counts.cdf(last) - below
    } else {
        1.0 - below - above
    };
    (below, inside, above)
}

/// ln P(first ≤ K ≤ last) from the distribution function, unless it underflows.
pub(super) fn ln_inside<D: Count>(counts: &D, first: u64, last: u64) -> Option<f64> {
    let (below, inside, above) = masses(counts, first, last);
    let value = if inside > 0.5 { (-(below + above)).ln_1p() } else { inside.ln() };
    (inside > 1e-280).then_some(value)
}

/// Up to so many counts are summed up in less time than a distribution function takes.
const FEW: usize = 8;

/// What may be left of one minus its largest loss when the others are taken off too, for the
/// difference to keep all but two digits.
const LEFT: f64 = 0.01;

/// ln P(K is none of `cut_off`), value and derivatives from the same terms; `None` if those are not
/// few, or take most of what is left of one by the largest of them.
///
/// The largest is taken from one in its logarithm: after a single zero no digit is lost, however
/// little is left.
pub(super) fn ln_mass_without<R, D>(counts: &D, cut_off: impl Iterator<Item = u64>) -> Option<R>
where
    R: Scalar,
    D: CountMass<R>,
{
    if cut_off.size_hint().0 > FEW {
        return None;
    }
    let mut terms = [R::from(f64::NEG_INFINITY); FEW];
    let (mut n, mut largest, mut others) = (0, f64::NEG_INFINITY, 0.0);
    for (term, k) in terms.iter_mut().zip(cut_off) {
        *term = counts.ln_pmf(k);
        n += 1;
        let value = term.value();
        if value > largest {
            others += largest.exp();
            largest = value;
        } else {
            others += value.exp();
        }
    }
    let without_largest = -largest.exp_m1();
    let rest = without_largest - others;
    let keeps_digits = rest > LEFT * without_largest;
    if !keeps_digits {
        return None;
    }
    let value = if rest > 0.5 { (-(largest.exp() + others)).ln_1p() } else { rest.ln() };
    let weighted = terms[..n].iter().map(|term| (*term, -term.value().exp() / rest));
    Some(R::fuse_iter(value, weighted.filter(|(_, weight)| *weight < 0.0)))
}

/// A sampler that looks for its step comes to scales where a sum would not end.
const MOST_TERMS: usize = 1_000_000;

/// From the few counts that are cut off, or else with the value of the distribution function and
/// derivatives from terms: ∂ ln P is the expectation of ∂ ln p over the interval; NaN where too many
/// would be needed.
pub(super) fn ln_mass_by_sum<R, D>(counts: &D, first: u64, last: u64) -> R
where
    R: Scalar,
    D: CountMass<R>,
{
    if first > last {
        return R::from(f64::NEG_INFINITY);
    }
    if last == u64::MAX
        && let Some(mass) = ln_mass_without(counts, 0..first)
    {
        return mass;
    }
    let value = ln_inside(counts, first, last);
    let (mean, variance) = (counts.mean(), counts.variance());
    let centre = (mean as u64).clamp(first, last);
    let reference = counts.ln_pmf(centre);
    let peak = reference.value();
    // parameters that are data leave nothing to sum; a partial may vanish at one count, not at
    // three
    let fixed = [1, 2].iter().all(|&d| counts.ln_pmf(centre.saturating_add(d)).is_constant());
    if let (Some(value), true) = (value, reference.is_constant() && fixed) {
        return R::from(value);
    }
    // without a last count, what the first cuts off has the opposite derivative and fewer terms; where
    // little is left they cancel, but the tail of some 40 variances per mean may not end
    let deviation = variance.sqrt();
    let most = MOST_TERMS as f64;
    let cut_off = last == u64::MAX && (first as f64) < most.min(20.0 * deviation);
    let endless = 20.0 * deviation + 40.0 * variance / mean > most;
    if let Some(value) = value.filter(|ln_inside| cut_off && (endless || *ln_inside > -10.0)) {
        let weighted = (0..first).map(|k| {
            let term = counts.ln_pmf(k);
            (term, -(term.value() - value).exp())
        });
        return R::fuse_iter(value, weighted.filter(|(_, weight)| *weight < 0.0));
    }
    let mut terms = vec![(reference, 1.0)];
    let mut total = 1.0;
    let mut add = |k: u64| {
        let term = counts.ln_pmf(k);
        let weight = (term.value() - peak).exp();
        total += weight;
        terms.push((term, weight));
        weight > 1e-18 * total && terms.len() < MOST_TERMS
    };
    let (mut up, mut down) = (centre, centre);
    while up < last && add(up + 1) {
        up += 1;
    }
    while down > first && add(down - 1) {
        down -= 1;
    }
    if terms.len() >= MOST_TERMS {
        return R::from(f64::NAN);
    }
    terms.retain(|(_, weight)| *weight > 0.0);
    terms.iter_mut().for_each(|(_, weight)| *weight /= total);
    R::fuse_iter(value.unwrap_or(peak + total.ln()), terms)
}

/// ln Σ p(k) over a range whose terms are all needed.
pub(super) fn ln_mass_of_all<R: Scalar, D: CountMass<R>>(counts: &D, first: u64, last: u64) -> R {
    let terms: Vec<R> = (first..=last).map(|k| counts.ln_pmf(k)).collect();
    let peak = terms.iter().fold(f64::NEG_INFINITY, |peak, term| peak.max(term.value()));
    if peak == f64::NEG_INFINITY {
        return R::from(peak);
    }
    let weights = || terms.iter().map(|term| (term.value() - peak).exp());
    let total: f64 = weights().sum();
    let normalised = weights().map(|weight| weight / total);
    R::fuse_iter(peak + total.ln(), terms.iter().copied().zip(normalised))
}
