//! Fit of a Prony series, and the choice of the number of terms.
//!
//! 1. Non-negative least squares on a grid of relaxation times, [`PER_DECADE`] per decade. Its solution has a few groups of
//!    neighbouring times, and each group becomes a term.
//! 2. Moduli and times of all terms are fitted together by the method of Levenberg and Marquardt.
//! 3. The number of terms is reduced one by one: two terms are merged or one term is removed, depending on which
//!    change increases the residual least. The remaining terms are fitted again.
//! 4. Of all these series, the series with the smallest Bayesian information criterion m ln(R/m) + (2n + 1) ln m is
//!    chosen, with n terms, m measured moduli, and the sum R of the squares of the relative residuals. R/m is at least
//!    the square of [`EXACT`].

use nalgebra::{DMatrix, DVector};

use super::data::MeasuredModuli;
use super::nonnegative::nonnegative;
use super::series::{PronySeries, PronyTerm};

/// Number of relaxation times of the grid per decade.
const PER_DECADE: f64 = 10.0;
/// Factor by which relaxation times may be shorter or longer than the measured times.
const BEYOND: f64 = 10.0;
/// Largest number of iterations of a fit.
const ITERATIONS: u32 = 300;
/// Relative residual below which a better fit does not count: moduli are not measured more accurately, and further
/// terms would need more state values at each point of a simulation.
const EXACT: f64 = 1e-3;
/// Smallest long-term modulus, relative to the smallest measured modulus.
const SMALLEST: f64 = 1e-6;

/// Prony series of measured moduli.
#[derive(Clone, Debug, PartialEq)]
pub struct PronyFit {
    /// The series.
    pub series: PronySeries,
    /// Root mean square of the relative residuals.
    pub relative_error: f64,
    /// Number of terms and Bayesian information criterion of each series that was compared, in the order of the number
    /// of terms.
    pub criterion: Vec<(usize, f64)>,
}

impl PronyFit {
    /// Fits a series. The number of terms has the smallest Bayesian information criterion.
    pub fn new(data: &MeasuredModuli) -> Self {
        let count = data.moduli().len() as f64;
        let mut candidate = refined(data, start(data));
        let mut best: Option<(f64, Candidate)> = None;
        let mut criterion = Vec::new();
        loop {
            let terms = candidate.terms.len();
            let mean = (candidate.residual / count).max(EXACT * EXACT);
            let value = count * mean.ln() + (2 * terms + 1) as f64 * count.ln();
            criterion.push((terms, value));
            if best.as_ref().is_none_or(|(least, _)| value < *least) {
                best = Some((value, candidate.clone()));
            }
            let fewer = reduced(&candidate).into_iter().map(|terms| refined(data, terms));
            match fewer.min_by(|a, b| a.residual.total_cmp(&b.residual)) {
                Some(next) => candidate = next,
                None => break,
            }
        }
        criterion.reverse();
        let (_, chosen) = best.expect("the loop compares at least one series");
        let relative_error = (chosen.residual / count).sqrt();
        let mut terms = chosen.terms;
        terms.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        let series = PronySeries { long_term_mpa: chosen.long_term_mpa, terms };
        Self { series, relative_error, criterion }
    }
}

/// A series, and the sum of the squares of its relative residuals.
#[derive(Clone, Debug)]
struct Candidate {
    long_term_mpa: f64,
    terms: Vec<PronyTerm>,
    residual: f64,
}

/// Returns the series of non-negative least squares on the grid, with a term for each group of neighbouring times.
fn start(data: &MeasuredModuli) -> (f64, Vec<PronyTerm>) {
    let [least, most] = data.times_s();
    let decades = (most / least).log10();
    let count = (decades * PER_DECADE).ceil().max(1.0);
    let times: Vec<f64> =
        (0..=count as u32).map(|k| least * 10f64.powf(decades * f64::from(k) / count)).collect();
    let moduli = data.moduli();
    let columns: Vec<Vec<f64>> = std::iter::once(data.long_term())
        .chain(times.iter().map(|&time_s| data.term(time_s)[0].clone()))
        .collect();
    let a = DMatrix::from_fn(moduli.len(), columns.len(), |i, j| columns[j][i] / moduli[i]);
    let x = nonnegative(&a, &DVector::from_element(moduli.len(), 1.0));
    let mut terms: Vec<PronyTerm> = Vec::new();
    let mut before = None;
    for (k, &time_s) in times.iter().enumerate() {
        let modulus_mpa = x[k + 1];
        if modulus_mpa <= 0.0 {
            continue;
        }
        match terms.last_mut() {
            Some(last) if before == Some(k.wrapping_sub(1)) => {
                *last = merged(last, &PronyTerm { modulus_mpa, time_s })
            }
            _ => terms.push(PronyTerm { modulus_mpa, time_s }),
        }
        before = Some(k);
    }
    (x[0], terms)
}

/// Replaces two terms by one. Its modulus is the sum of both moduli, and the logarithm of its time is the mean of both
/// logarithms, weighted by the moduli.
fn merged(a: &PronyTerm, b: &PronyTerm) -> PronyTerm {
    let modulus_mpa = a.modulus_mpa + b.modulus_mpa;
    let sum = a.modulus_mpa * a.time_s.ln() + b.modulus_mpa * b.time_s.ln();
    PronyTerm { modulus_mpa, time_s: (sum / modulus_mpa).exp() }
}

/// Returns all series with one term less: two neighbouring terms are merged, or the first or the last term is removed.
fn reduced(candidate: &Candidate) -> Vec<(f64, Vec<PronyTerm>)> {
    let Candidate { long_term_mpa, terms, .. } = candidate;
    let mut sorted = terms.clone();
    sorted.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    if sorted.is_empty() {
        return Vec::new();
    }
    let pair = |k: usize| {
        let mut terms = sorted.clone();
        let second = terms.remove(k + 1);
        terms[k] = merged(&terms[k], &second);
        (*long_term_mpa, terms)
    };
    let mut all: Vec<_> = (0..sorted.len() - 1).map(pair).collect();
    let last = sorted[sorted.len() - 1];
    all.push((*long_term_mpa, sorted[1..].to_vec()));
    all.push((long_term_mpa + last.modulus_mpa, sorted[..sorted.len() - 1].to_vec()));
    all
}

/// Fits the long-term modulus, the moduli and the times of a series by the method of Levenberg and Marquardt. The
/// unknowns are logarithms.
fn refined(data: &MeasuredModuli, (long_term_mpa, terms): (f64, Vec<PronyTerm>)) -> Candidate {
    let moduli = data.moduli();
    let smallest = SMALLEST * moduli.iter().copied().fold(f64::INFINITY, f64::min);
    let [least, most] = data.times_s();
    let bounds = [(least / BEYOND).ln(), (most * BEYOND).ln()];
    let long_term = data.long_term();
    let mut unknowns = vec![long_term_mpa.max(smallest).ln()];
    unknowns.extend(terms.iter().flat_map(|t| [t.modulus_mpa.max(smallest).ln(), t.time_s.ln()]));
    // residuals, and optionally their derivatives with respect to the unknowns
    let evaluate = |unknowns: &[f64]| {
        let mut residual = DVector::from_element(moduli.len(), -1.0);
        let mut slopes = DMatrix::zeros(moduli.len(), unknowns.len());
        let long_term_modulus = unknowns[0].exp();
        for i in 0..moduli.len() {
            slopes[(i, 0)] = long_term_modulus * long_term[i] / moduli[i];
            residual[i] += slopes[(i, 0)];
        }
        for (n, pair) in unknowns[1..].chunks_exact(2).enumerate() {
            let (modulus, [values, by_time]) = (pair[0].exp(), data.term(pair[1].exp()));
            for i in 0..moduli.len() {
                slopes[(i, 2 * n + 1)] = modulus * values[i] / moduli[i];
                slopes[(i, 2 * n + 2)] = modulus * by_time[i] / moduli[i];
                residual[i] += slopes[(i, 2 * n + 1)];
            }
        }
        (residual, slopes)
    };
    let (mut residual, mut slopes) = evaluate(&unknowns);
    let mut damping = 1e-3;
    for _ in 0..ITERATIONS {
        let normal = slopes.transpose() * &slopes;
        let gradient = slopes.transpose() * &residual;
        let mut damped = normal.clone();
        for k in 0..unknowns.len() {
            damped[(k, k)] += damping * normal[(k, k)].max(1e-12);
        }
        let Some(factor) = damped.cholesky() else {
            damping *= 10.0;
            continue;
        };
        let step = factor.solve(&gradient);
        let mut moved = unknowns.clone();
        for (k, value) in moved.iter_mut().enumerate() {
            // limit the change of each unknown to a factor of e per step
            *value -= step[k].clamp(-1.0, 1.0);
            *value = match k {
                0 => value.max(smallest.ln()),
                _ if k % 2 == 1 => value.max(smallest.ln()),
                _ => value.clamp(bounds[0], bounds[1]),
            };
        }
        let (next, next_slopes) = evaluate(&moved);
        let (old, new) = (residual.norm_squared(), next.norm_squared());
        if new < old {
            (unknowns, residual, slopes) = (moved, next, next_slopes);
            damping = (0.2 * damping).max(1e-14);
            if old - new <= 1e-13 * old {
                break;
            }
        } else {
            damping *= 4.0;
            if damping > 1e12 {
                break;
            }
        }
    }
    let term = |pair: &[f64]| PronyTerm { modulus_mpa: pair[0].exp(), time_s: pair[1].exp() };
    Candidate {
        long_term_mpa: unknowns[0].exp(),
        terms: unknowns[1..].chunks_exact(2).map(term).collect(),
        residual: residual.norm_squared(),
    }
}
