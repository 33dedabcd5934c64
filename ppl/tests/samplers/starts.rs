//! Chains that begin far from the posterior.

use ppl::prelude::*;

ppl::model! {
    /// Counts that grow over forty years; at (level, rate) = (2, 2) the last expected count is e⁸⁰.
    fn growth(counts: &[u64]) {
        let level ~ Normal(0.0, 10.0);
        let rate ~ Normal(0.0, 10.0);
        for (t, count) in counts.iter().enumerate() {
            count ~ PoissonLog(level + rate * t as f64);
        }
    }
}

/// At the starting points the energy has too few digits to show the change of one step, and a mass matrix learned on
/// the way to the posterior is wrong at the posterior; every chain must still converge.
#[test]
fn chains_arrive_from_where_rates_overflow() {
    let level = [26, 33, 40, 60, 90, 130, 200, 260];
    let counts: Vec<u64> = (0..40).map(|t| level[t / 5] + t as u64 % 5).collect();
    let model = growth(&counts);
    for (seed, far) in [(1, 2.0), (2, 1.0), (3, 8.0)] {
        let starts = [[far, far], [-far, far], [far, -far], [0.5, 0.9 * far]].map(Vec::from);
        let nuts = Nuts::default().init_points(starts.to_vec()).seed(seed);
        let posterior = nuts.sample(&model).expect("samples");
        for (chain, start) in posterior.chains.chains.iter().zip(&starts) {
            assert_eq!(&chain.warmup.start, start, "where it was sent is on record");
        }
        assert_eq!(posterior.chains.divergences(), 0);
        for row in &posterior.summary().rows {
            assert!(row.rhat < 1.02 && row.ess_bulk > 400.0, "{far}: {row:?}");
        }
    }
}
