//! Estimates of probability densities from draws.

use super::draw::lerp;
use crate::report::results::mean;

/// Gaussian kernel density estimate with Silverman's bandwidth and reflection at the bounds of the prior.
pub(super) fn density(draws: &[f64], range: (f64, f64)) -> Vec<(f64, f64)> {
    let h = bandwidth(draws, -0.2);
    let norm = 1.0 / (draws.len() as f64 * h * (2.0 * std::f64::consts::PI).sqrt());
    let kernel = |d: f64| (-0.5 * (d / h).powi(2)).exp();
    (0..=120)
        .map(|i| {
            let x = lerp(range, f64::from(i) / 120.0);
            let mirrored = |v: f64| {
                kernel(x - v) + kernel(x - (2.0 * range.0 - v)) + kernel(x - (2.0 * range.1 - v))
            };
            (x, norm * draws.iter().map(|&v| mirrored(v)).sum::<f64>())
        })
        .collect()
}

/// Bandwidth 1.06 σ nᵖ with `power` p: −1/5 in one dimension, −1/6 in two.
fn bandwidth(draws: &[f64], power: f64) -> f64 {
    let m = mean(draws);
    let sd = (draws.iter().map(|v| (v - m).powi(2)).sum::<f64>() / draws.len() as f64).sqrt();
    (1.06 * sd * (draws.len() as f64).powf(power)).max(f64::MIN_POSITIVE)
}

pub(super) type Grid = (Vec<Vec<f64>>, Vec<f64>, Vec<f64>);

/// Product-kernel density estimate on a grid over the prior box, from binned draws.
pub(super) fn density_2d(pairs: &[(f64, f64)], x: (f64, f64), y: (f64, f64)) -> Grid {
    const N: usize = 48;
    let centre = |range, i: usize| lerp(range, (i as f64 + 0.5) / N as f64);
    let bin = |range: (f64, f64), v: f64| {
        let t = (v - range.0) / (range.1 - range.0);
        ((t * N as f64).max(0.0) as usize).min(N - 1)
    };
    let mut counts = vec![vec![0.0; N]; N];
    for &(a, b) in pairs {
        counts[bin(y, b)][bin(x, a)] += 1.0;
    }
    let smooth = |range: (f64, f64), values: Vec<f64>| {
        let h = bandwidth(&values, -1.0 / 6.0) / (range.1 - range.0) * N as f64;
        move |line: &[f64]| -> Vec<f64> {
            (0..N as i64)
                .map(|i| {
                    let kernel = |d: i64| (-0.5 * (d as f64 / h).powi(2)).exp();
                    let terms = line.iter().enumerate().map(|(j, &c)| {
                        let j = j as i64;
                        // reflected at both ends: the density ends at the bounds of the prior
                        c * (kernel(i - j) + kernel(i + j + 1) + kernel(2 * N as i64 - 1 - i - j))
                    });
                    terms.sum()
                })
                .collect()
        }
    };
    let along_x = smooth(x, pairs.iter().map(|p| p.0).collect());
    let along_y = smooth(y, pairs.iter().map(|p| p.1).collect());
    let rows: Vec<Vec<f64>> = counts.iter().map(|row| along_x(row)).collect();
    let mut z = vec![vec![0.0; N]; N];
    for j in 0..N {
        let column: Vec<f64> = rows.iter().map(|row| row[j]).collect();
        for (i, value) in along_y(&column).into_iter().enumerate() {
            z[i][j] = value;
        }
    }
    (z, (0..N).map(|i| centre(x, i)).collect(), (0..N).map(|i| centre(y, i)).collect())
}

/// Density levels whose contours enclose the given fractions of the mass.
pub(super) fn highest_density_levels(grid: &[Vec<f64>], fractions: &[f64]) -> Vec<f64> {
    let mut values: Vec<f64> = grid.iter().flatten().copied().collect();
    values.sort_by(|a, b| b.total_cmp(a));
    let total: f64 = values.iter().sum();
    let mut levels: Vec<f64> = fractions
        .iter()
        .map(|fraction| {
            let mut mass = 0.0;
            values
                .iter()
                .find(|&&v| {
                    mass += v;
                    mass >= fraction * total
                })
                .copied()
                .unwrap_or(0.0)
        })
        .collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    levels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn density_integrates_to_one_over_the_prior() {
        let draws: Vec<f64> = (0..400).map(|i| (f64::from(i) / 400.0).powi(2)).collect();
        let curve = density(&draws, (0.0, 1.0));
        let integral: f64 =
            curve.windows(2).map(|w| 0.5 * (w[0].1 + w[1].1) * (w[1].0 - w[0].0)).sum();
        assert!((integral - 1.0).abs() < 2e-3, "{integral}");
    }

    #[test]
    fn levels_enclose_their_fraction() {
        let pairs: Vec<(f64, f64)> = (0..5000)
            .map(|i| {
                let t = f64::from(i) * 0.618_033_988_75;
                ((t % 1.0 + (3.0 * t) % 1.0) / 2.0, ((7.0 * t) % 1.0 + (5.0 * t) % 1.0) / 2.0)
            })
            .collect();
        let (grid, xs, ys) = density_2d(&pairs, (0.0, 1.0), (0.0, 1.0));
        assert_eq!((xs.len(), ys.len()), (grid[0].len(), grid.len()));
        let levels = highest_density_levels(&grid, &[0.5]);
        let total: f64 = grid.iter().flatten().sum();
        let inside: f64 = grid.iter().flatten().filter(|&&v| v >= levels[0]).sum();
        assert!((inside / total - 0.5).abs() < 0.01);
    }
}
