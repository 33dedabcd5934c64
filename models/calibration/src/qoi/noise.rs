//! Noise of readings, estimated from the difference between each reading and a smooth curve through its neighbours.

/// Number of readings from which one difference is computed: the cubic through four readings
/// predicts the fifth reading.
const STENCIL: usize = 5;
/// Least number of blocks in which readings are averaged; readings are not averaged if there are fewer than twice this
/// number.
const BLOCKS: usize = 150;

/// Standard deviation of the noise of one reading y at x, in the unit of y; 0 for fewer than five readings.
///
/// The divided difference of five readings, scaled to weights of norm 1, has the variance of one reading and vanishes
/// for a cubic. Differences beyond 3 robust standard deviations (spikes, sudden drops) are ignored. From 300 readings
/// on, means of blocks are compared instead of readings, so that noise that neighbouring readings share is weighted
/// as in a mean of readings: the result is √m times the standard deviation of the mean of m readings.
pub fn standard_deviation(x: &[f64], y: &[f64]) -> f64 {
    let size = (y.len() / BLOCKS).max(1);
    if size == 1 {
        return of_differences(x, y);
    }
    let means = |values: &[f64]| -> Vec<f64> {
        let blocks = values.chunks_exact(size);
        blocks.map(|block| block.iter().sum::<f64>() / size as f64).collect()
    };
    (size as f64).sqrt() * of_differences(&means(x), &means(y))
}

/// Standard deviation of the noise of one reading without averaging in blocks, for decisions about single readings.
pub fn of_single_readings(x: &[f64], y: &[f64]) -> f64 {
    of_differences(x, y)
}

fn of_differences(x: &[f64], y: &[f64]) -> f64 {
    let differences = x.windows(STENCIL).zip(y.windows(STENCIL));
    let mut sizes: Vec<f64> = differences.map(|(x, y)| difference(x, y).abs()).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    sizes.sort_unstable_by(f64::total_cmp);
    // the median of |z| is 0.6745 for a standard normal z
    let robust = sizes[sizes.len() / 2] / 0.6745;
    let usual = sizes.partition_point(|size| *size <= 3.0 * robust);
    let squares: f64 = sizes[..usual].iter().map(|size| size * size).sum();
    // the mean of z² over |z| < 3 is 0.9733
    (squares / (0.9733 * usual as f64)).sqrt()
}

/// Divided difference of readings, with weights of norm 1.
fn difference(x: &[f64], y: &[f64]) -> f64 {
    /// Distance that is added between successive readings, as a fraction of the range of the displacements, so that readings
    /// at the same displacement have different positions.
    const LEAST_GAP: f64 = 1e-6;
    let span = x.iter().fold(0.0_f64, |span, other| span.max((other - x[0]).abs()));
    let position = |i: usize| match span > 0.0 {
        true => (x[i] - x[0]) / span + LEAST_GAP * i as f64,
        false => i as f64,
    };
    let gap = |i: usize, j: usize| {
        let gap = position(i) - position(j);
        if gap == 0.0 { 1e-12 } else { gap }
    };
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..x.len() {
        let product: f64 = (0..x.len()).filter(|&j| j != i).map(|j| gap(i, j)).product();
        sum += y[i] / product;
        squares += 1.0 / (product * product);
    }
    sum / squares.sqrt()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    fn readings(n: usize, noise: f64, seed: u64) -> (Vec<f64>, Vec<f64>) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let noise = Normal::new(0.0, noise).unwrap();
        let x: Vec<f64> = (0..n).map(|i| i as f64 / n as f64).collect();
        let y = x.iter().map(|x| 150.0 * (3.0 * x).sin() + noise.sample(&mut rng)).collect();
        (x, y)
    }

    /// The mean of the estimated variance over 50 curves is correct within 4 standard errors, which are computed from
    /// the scatter of the estimates.
    #[test]
    fn the_noise_of_coarse_and_dense_curves_is_found_beside_spikes() {
        for n in [45, 200, 4000] {
            let ratios: Vec<f64> = (0..50)
                .map(|seed| {
                    let (x, mut y) = readings(n, 1.5, seed);
                    y[n / 3] += 60.0;
                    (standard_deviation(&x, &y) / 1.5).powi(2)
                })
                .collect();
            let mean = ratios.iter().sum::<f64>() / 50.0;
            let scatter = ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / 49.0;
            let error = (scatter / 50.0).sqrt();
            assert!((mean - 1.0).abs() < 4.0 * error + 0.03, "{n}: {mean} ± {error}");
            assert!(scatter.sqrt() < 0.6, "{n}: {scatter}");
        }
    }

    /// The estimated noise of a smooth curve is nearly zero, also with unequal and repeated displacements.
    #[test]
    fn a_curve_without_noise_has_none() {
        for n in [30, 1000] {
            let (mut x, _) = readings(n, 0.1, 0);
            x.iter_mut().for_each(|x| *x *= 0.7 + 0.3 * *x);
            x[4] = x[5];
            let y: Vec<f64> = x.iter().map(|x| 150.0 * (3.0 * x).sin()).collect();
            let estimate = standard_deviation(&x, &y);
            assert!(estimate < 2e-5 * 150.0, "{n}: {estimate}");
        }
        assert_eq!(standard_deviation(&[0.0; 4], &[1.0; 4]), 0.0);
        assert!(standard_deviation(&[0.3; 40], &[1.0; 40]).abs() < 1e-9);
    }

    /// Noise that ten neighbouring readings share has √10 times the effect of independent noise on a mean.
    #[test]
    fn noise_that_neighbours_share_counts_by_its_effect_on_means() {
        let (x, _) = readings(20_000, 0.1, 0);
        let shared = readings(2000, 1.0, 5).1;
        let y: Vec<f64> = (0..20_000).map(|i| shared[i / 10]).collect();
        let estimate = standard_deviation(&x, &y);
        assert!((2.4..4.0).contains(&estimate), "{estimate}");
        assert!(of_single_readings(&x, &y) < 0.5);
    }
}
