//! Past points, and the jumps that their differences make.

use rand::Rng;
use serde::{Deserialize, Serialize};

use super::run::Stream;

/// Points of which the older half is forgotten as more come in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Archive {
    dim: usize,
    /// Row-major.
    points: Vec<f64>,
    /// Standard deviations of the points in use.
    spread: Vec<f64>,
}

impl Archive {
    pub(super) fn new(dim: usize, points: &[Vec<f64>]) -> Self {
        Self { dim, points: points.concat(), spread: vec![0.0; dim] }
    }

    /// Whether it is of `dim` coordinates, with points to pick from.
    pub(super) fn fits(&self, dim: usize) -> bool {
        let whole = dim == 0 || !self.points.is_empty() && self.points.len().is_multiple_of(dim);
        self.dim == dim && self.spread.len() == dim && whole
    }

    pub(super) fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    pub(super) fn file(&mut self, y: &[f64]) {
        self.points.extend_from_slice(y);
    }

    /// The newer half of the points.
    fn recent(&self) -> &[f64] {
        let len = self.points.len() / self.dim.max(1);
        &self.points[len / 2 * self.dim..]
    }

    /// Computes the standard deviations anew.
    pub(super) fn measure(&mut self) {
        let mut spread = std::mem::take(&mut self.spread);
        for (i, sd) in spread.iter_mut().enumerate() {
            let column = self.recent().iter().skip(i).step_by(self.dim).copied();
            let (_, variance) = crate::diagnostics::mean_and_variance(column);
            *sd = variance.sqrt();
        }
        self.spread = spread;
    }

    pub(super) fn spread(&self) -> &[f64] {
        &self.spread
    }

    fn pick(&self, rng: &mut Stream) -> &[f64] {
        let recent = self.recent();
        let index = rng.random_range(0..recent.len() / self.dim);
        &recent[index * self.dim..][..self.dim]
    }

    /// `to = from + γ (z₁ − z₂)`: symmetric, since the order of the two is.
    pub(super) fn difference(&self, from: &[f64], gamma: f64, to: &mut [f64], rng: &mut Stream) {
        let (one, two) = (self.pick(rng), self.pick(rng));
        for (i, to) in to.iter_mut().enumerate() {
            *to = from[i] + gamma * (one[i] - two[i]);
        }
    }

    /// `to = from + γ P(z₁ − z₂)`, P the projection on the line through `from` and a third point
    /// z, γ uniform on (1.2, 2.2). Returns `(d − 1) ln(|to − z| / |from − z|)`, which the
    /// acceptance needs because the volume on a line through z grows with the distance; `None`
    /// where z is `from`.
    pub(super) fn snooker(&self, from: &[f64], to: &mut [f64], rng: &mut Stream) -> Option<f64> {
        let (z, one, two) = (self.pick(rng), self.pick(rng), self.pick(rng));
        let gamma = rng.random_range(1.2..2.2);
        let squared: f64 = from.iter().zip(z).map(|(y, z)| (y - z).powi(2)).sum();
        if squared == 0.0 {
            return None;
        }
        let along: f64 = (0..self.dim).map(|i| (one[i] - two[i]) * (from[i] - z[i])).sum();
        let factor = gamma * along / squared;
        for (i, to) in to.iter_mut().enumerate() {
            *to = from[i] + factor * (from[i] - z[i]);
        }
        Some((self.dim as f64 - 1.0) * (1.0 + factor).abs().ln())
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    fn archive() -> Archive {
        let mut archive = Archive::new(2, &[]);
        for k in 0..8 {
            archive.file(&[f64::from(k), f64::from(k * k)]);
        }
        archive.measure();
        archive
    }

    #[test]
    fn the_older_half_is_forgotten() {
        let archive = archive();
        assert_eq!(archive.recent()[..2], [4.0, 16.0]);
        // 4, 5, 6, 7: variance 5/3
        approx::assert_relative_eq!(archive.spread()[0], (5.0f64 / 3.0).sqrt());
        let mut rng = Stream::seed_from_u64(1);
        assert!((0..100).all(|_| archive.pick(&mut rng)[0] >= 4.0));
    }

    /// The step lies on the line through a point of the archive, and the correction is the ratio
    /// of the distances to it.
    #[test]
    fn a_snooker_step_by_hand() {
        let archive = archive();
        let (from, mut to) = ([0.5, -1.0], [0.0; 2]);
        for seed in 0..50 {
            let correction =
                archive.snooker(&from, &mut to, &mut Stream::seed_from_u64(seed)).expect("apart");
            let z = archive.pick(&mut Stream::seed_from_u64(seed));
            let cross = (to[0] - z[0]) * (from[1] - z[1]) - (to[1] - z[1]) * (from[0] - z[0]);
            assert!(cross.abs() < 1e-9, "{cross}");
            let distance = |y: &[f64]| (y[0] - z[0]).hypot(y[1] - z[1]);
            approx::assert_relative_eq!(
                correction,
                (distance(&to) / distance(&from)).ln(),
                epsilon = 1e-12
            );
        }
    }
}
