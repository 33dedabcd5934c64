//! Tests of the fitted brightness.

use super::*;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

#[test]
fn a_known_profile_is_fitted_and_removed() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let shape = [64, 64, 24];
    for lean in [[0.0, 0.0], [0.15, -0.1]] {
        let cylinder = Fit {
            centre: [32.0, 32.0],
            radius: 30.0,
            bottom: 0.0,
            top: 24.0,
            lean,
            wander: 0.0,
            scatter: 0.0,
        };
        check_removal_of_a_profile(&cylinder, shape, &mut rng);
    }
}

fn check_removal_of_a_profile(cylinder: &Fit, shape: [usize; 3], rng: &mut impl Rng) {
    let set = cylinder.inside(shape, 2.0);
    let relative =
        |x, y, z| cylinder.radius_squared_and_height([x, y, z])[0] / cylinder.radius.powi(2);
    let truth = |s: f64| 0.88 + 0.2 * s + 0.05 * s * s;
    let height = |x, y, z| cylinder.radius_squared_and_height([x, y, z])[1] / 24.0;
    let drift = |t: f64| 0.9 + 0.2 * t.clamp(0.0, 1.0);
    let mut values = Vec::new();
    let mut clean = Vec::new();
    for n in 0..set.len() {
        let (x, y, z) = (n % 64, n / 64 % 64, n / 4096);
        // grains are more frequent at the rim and in the lower half; the fit must not attribute this distribution
        // to cupping or drift
        let (s, t) = (relative(x, y, z), height(x, y, z));
        let few = if s > 0.5 { 3 } else { 1 };
        let grain = (x / 9 + y / 9 + z / 12) % 5 < if t < 0.5 { few + 1 } else { few };
        let material = if grain { 35_000.0 } else { 20_000.0 };
        let noise = rng.random_range(-800.0..800.0);
        values.push((9000.0 + material * truth(s.min(1.0)) * drift(t) + noise) as u16);
        clean.push(9000.0 + material);
    }
    let profile = Brightness::fit(&values, shape, &set, cylinder, 9000.0, 15_000.0);
    assert!((profile.rim_over_centre() - truth(1.0) / truth(0.0)).abs() < 0.01, "{profile:?}");
    assert!((profile.top_over_bottom() - 1.1 / 0.9).abs() < 0.01, "{profile:?}");
    profile.correct(&mut values, shape, cylinder);
    let ratio = |n: usize| (f64::from(values[n]) - 9000.0) / (clean[n] - 9000.0);
    let inside: Vec<usize> = (0..set.len()).filter(|&n| set[n] == 1).collect();
    for part in [0.0..0.2, 0.4..0.6, 0.7..0.9] {
        let ring = inside
            .iter()
            .copied()
            .filter(|&n| part.contains(&relative(n % 64, n / 64 % 64, n / 4096)));
        let ratios: Vec<f64> = ring.map(ratio).collect();
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        assert!((mean - 0.9967).abs() < 0.005, "{part:?}: {mean}");
    }
}
