//! Comparison of two posteriors of one parameter.

/// Agreement of two samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Agreement {
    /// Probability mass that the two densities have in common: 1 for equal, 0 for disjoint densities.
    pub(crate) overlap: f64,
    /// Ratio of the second sample to the first: median, 5 and 95 % quantiles.
    pub(crate) ratio: [f64; 3],
}

/// Number of bins of the histograms for the overlap; with more bins, noise would reduce the overlap.
const BINS: usize = 40;

/// Compares the draws of two posteriors that were sampled independently of each other.
///
/// The overlap is ∫ min(p, q), computed from histograms of all draws (Inman & Bradley 1989,
/// doi:10.1080/03610928908830074).
pub(crate) fn agreement(a: &[f64], b: &[f64]) -> Agreement {
    let (low, high) = a
        .iter()
        .chain(b)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)));
    let width = ((high - low) / BINS as f64).max(f64::MIN_POSITIVE);
    let shares = |draws: &[f64]| {
        let mut shares = vec![0.0; BINS];
        for x in draws {
            shares[(((x - low) / width) as usize).min(BINS - 1)] += 1.0 / draws.len() as f64;
        }
        shares
    };
    let overlap = shares(a).iter().zip(shares(b)).map(|(p, q)| p.min(q)).sum();
    // independent draws can be paired in any order; a stride that is coprime to their number mixes the chains
    let n = a.len().min(b.len());
    let stride = (n / 3..n).find(|s| gcd(*s, n) == 1).unwrap_or(1);
    let mut ratios: Vec<f64> =
        (0..n).map(|i| b[(i * stride) % n * b.len() / n] / a[i * a.len() / n]).collect();
    ratios.sort_by(f64::total_cmp);
    let quantile = |p: f64| ratios[((n - 1) as f64 * p).round() as usize];
    Agreement { overlap, ratio: [0.5, 0.05, 0.95].map(quantile) }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    /// Two normal distributions with equal standard deviation σ and means d σ apart have the overlap 2 Φ(−d/2). The
    /// logarithm of the ratio of two narrow normal distributions is approximately normal.
    #[test]
    fn overlap_and_ratio_of_normals_are_those_of_the_closed_form() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        let mut draws = |mean: f64, sd: f64| -> Vec<f64> {
            let normal = Normal::new(mean, sd).unwrap();
            (0..20_000).map(|_| normal.sample(&mut rng)).collect()
        };
        let (a, b) = (draws(280.0, 5.0), draws(290.0, 5.0));
        // 2 Φ(−1) = 0.31731
        let computed = agreement(&a, &b);
        assert!((computed.overlap - 0.3173).abs() < 0.015, "{computed:?}");
        // ln(290/280) = 0.03509; sd √(5²/280² + 5²/290²) = 0.024822; the 5 and 95 % quantiles are 1.6449 sd from the
        // median
        for (ratio, z) in computed.ratio.iter().zip([0.0, -1.6449, 1.6449]) {
            assert!((ratio.ln() - (0.03509 + z * 0.024822)).abs() < 0.0015, "{computed:?}");
        }
        let same = agreement(&a, &draws(280.0, 5.0));
        assert!(same.overlap > 0.97, "{same:?}");
        let apart = agreement(&a, &draws(400.0, 5.0));
        assert_eq!(apart.overlap, 0.0);
    }
}
