use crate::Model;
use crate::prelude::*;

crate::model! {
    fn line(x: &[[f64; 2]], y: &[f64]) {
        let level ~ Normal(0.0, 1.0);
        let slope ~ Normal(0.0, 1.0).array::<2>();
        let sd ~ HalfNormal(1.0);
        y ~ NormalGlm(x, level, slope, sd);
    }
}

/// Precomputed statistics are compared with the data and not used if they differ. A wrong statistic would not change
/// the results, but the data would be evaluated at every point. The test therefore checks that the statistics are used.
#[test]
fn the_statistics_of_a_regression_stand_the_comparison_with_its_data() {
    let wave = |i: usize, k: usize| (0.3 + i as f64 * (0.9 + 0.37 * k as f64)).sin();
    let x: Vec<[f64; 2]> = (0..30).map(|i| [wave(i, 0), 40.0 + wave(i, 1)]).collect();
    let y: Vec<f64> = (0..30).map(|i| 3.0 + wave(i, 7)).collect();
    let model = line(&x, &y);
    let inspection = super::inspect(model.model(), is_static(model.model()));
    assert!(inspection.statistics.is_some());
    assert!(inspection.constant.is_some());
}

fn is_static<M: Model>(_: &M) -> bool {
    M::STATIC
}
