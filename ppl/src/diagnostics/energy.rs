//! Energy diagnostic of Hamiltonian Monte Carlo: whether momentum resampling reaches the tails.

/// Energy Bayesian fraction of missing information of one chain,
/// E-BFMI = Σ_t (E_t − E_{t−1})² / Σ_t (E_t − Ē)².
///
/// A value below 0.3 means that the energy E_t changes too slowly from draw to draw, so that the tails of the
/// posterior are underexplored. Typical causes are heavy tails or a funnel. The result is NaN for fewer than two
/// draws or a constant energy.
///
/// ```
/// assert_eq!(ppl::diagnostics::e_bfmi(&[1.0, 2.0, 3.0]), 1.0);
/// ```
///
/// Reference: Betancourt (2016), equation 8, arXiv:1604.00695.
pub fn e_bfmi(energy: &[f64]) -> f64 {
    let centre = super::mean(energy.iter().copied());
    let steps: f64 = energy.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum();
    if steps == 0.0 {
        return f64::NAN; // because of rounding, the spread of a constant may not be exactly 0
    }
    let spread: f64 = energy.iter().map(|e| (e - centre).powi(2)).sum();
    steps / spread
}
