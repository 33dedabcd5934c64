//! Simulation of a parallel-beam CT scanner for one slice: projection, filter, back-projection.
//!
//! # Reference
//! A. C. Kak, M. Slaney, "Principles of Computerized Tomographic Imaging", IEEE Press (1988),
//! chapter 3 (doi:10.1137/1.9780898719277).

use std::f64::consts::PI;

/// Projection directions and detector of a scanner, for slices of `width` × `width` pixels.
pub(super) struct ScanGeometry {
    width: usize,
    /// Cosine and sine of each projection direction.
    directions: Vec<[f32; 2]>,
    /// For each row of pixels, the range of pixels in the circle that the scanner covers: first pixel, and last pixel +
    /// 1.
    rows: Vec<[usize; 2]>,
    /// Coefficients of the ramp filter for distances of 0, 1, 2, … detector pixels.
    ramp: Vec<f32>,
}

impl ScanGeometry {
    pub(super) fn new(width: usize, projections: usize) -> ScanGeometry {
        let angle = |k: usize| PI * k as f64 / projections as f64;
        let directions =
            (0..projections).map(|k| [angle(k).cos() as f32, angle(k).sin() as f32]).collect();
        let radius = 0.5 * width as f64 - 1.0;
        let row = |j: usize| {
            let y = j as f64 + 0.5 - 0.5 * width as f64;
            let half = (radius * radius - y * y).max(0.0).sqrt();
            let first = (0.5 * width as f64 - half).ceil() as usize;
            [first, (width - first).max(first)]
        };
        let tap = |n: usize| match n {
            0 => 0.25,
            n if n % 2 == 0 => 0.0,
            n => -1.0 / (PI * n as f64).powi(2),
        };
        ScanGeometry {
            width,
            directions,
            rows: (0..width).map(row).collect(),
            ramp: (0..width).map(|n| tap(n) as f32).collect(),
        }
    }

    /// Returns the number of projection directions.
    pub(super) fn projections(&self) -> usize {
        self.directions.len()
    }

    /// Calls `each` for every pixel in the circle, with the index of the pixel and its projected position on the
    /// detector (in detector pixels from the first detector pixel).
    fn visit(&self, direction: [f32; 2], mut each: impl FnMut(usize, f32)) {
        let middle = 0.5 * (self.width as f32 - 1.0);
        let [cos, sin] = direction;
        for (j, &[first, last]) in self.rows.iter().enumerate() {
            let row = j * self.width;
            let start = (j as f32 - middle) * sin - middle * cos + middle;
            for i in first..last {
                each(row + i, start + i as f32 * cos);
            }
        }
    }

    /// Returns the line integrals (in pixels) of two maps at once, as one detector row per direction.
    pub(super) fn project(&self, maps: &[[f32; 2]]) -> Vec<[f32; 2]> {
        let mut all = vec![[0.0; 2]; self.projections() * self.width];
        for (row, &direction) in all.chunks_mut(self.width).zip(&self.directions) {
            self.visit(direction, |pixel, at| {
                let [a, b] = maps[pixel];
                if a > 0.0 || b > 0.0 {
                    let first = at as usize;
                    let t = at - first as f32;
                    row[first] = [row[first][0] + (1.0 - t) * a, row[first][1] + (1.0 - t) * b];
                    row[first + 1] = [row[first + 1][0] + t * a, row[first + 1][1] + t * b];
                }
            });
        }
        all
    }

    /// Reconstructs a map (one value per pixel) from its line integrals by filtered back-projection; values outside the
    /// circle are zero.
    pub(super) fn reconstruct(&self, integrals: &[f32]) -> Vec<f32> {
        let mut map = vec![0.0; self.width * self.width];
        let mut filtered = vec![0.0; self.width];
        let share = (PI / self.projections() as f64) as f32;
        for (row, &direction) in integrals.chunks(self.width).zip(&self.directions) {
            self.filter(row, &mut filtered);
            self.visit(direction, |pixel, at| {
                let first = at as usize;
                let t = at - first as f32;
                map[pixel] += share * ((1.0 - t) * filtered[first] + t * filtered[first + 1]);
            });
        }
        map
    }

    /// Convolves one detector row with the ramp filter.
    fn filter(&self, row: &[f32], out: &mut [f32]) {
        let width = self.width;
        for (i, out) in out.iter_mut().enumerate() {
            let left = row[..i].iter().rev().zip(&self.ramp[1..]).map(|(x, tap)| x * tap);
            let right = row[i + 1..].iter().zip(&self.ramp[1..width - i]).map(|(x, tap)| x * tap);
            *out = row[i] * self.ramp[0] + left.sum::<f32>() + right.sum::<f32>();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a map of a disc with value 1 and an edge one pixel wide.
    fn disc(width: usize, centre: [f64; 2], radius: f64) -> Vec<f32> {
        let pixel = |c: usize| {
            let [x, y] = [c % width, c / width].map(|k| k as f64 + 0.5 - 0.5 * width as f64);
            (0.5 + radius - (x - centre[0]).hypot(y - centre[1])).clamp(0.0, 1.0) as f32
        };
        (0..width * width).map(pixel).collect()
    }

    #[test]
    fn projections_are_the_chords_of_a_disc() {
        let geometry = ScanGeometry::new(96, 64);
        let (centre, radius) = ([8.0, -5.0], 25.0);
        let maps: Vec<[f32; 2]> =
            disc(96, centre, radius).into_iter().map(|x| [x, 2.0 * x]).collect();
        let integrals = geometry.project(&maps);
        let mut squares = 0.0;
        for (row, &[cos, sin]) in integrals.chunks(96).zip(&geometry.directions) {
            let middle = centre[0] * f64::from(cos) + centre[1] * f64::from(sin) + 47.5;
            for (i, &[one, two]) in row.iter().enumerate() {
                let off = i as f64 - middle;
                let chord = 2.0 * (radius * radius - off * off).max(0.0).sqrt();
                squares += (f64::from(one) - chord).powi(2);
                assert!((two - 2.0 * one).abs() < 1e-3);
            }
            let area: f64 = row.iter().map(|&[one, _]| f64::from(one)).sum();
            assert!((area / (PI * radius * radius) - 1.0).abs() < 0.002, "{area}");
        }
        let rms = (squares / integrals.len() as f64).sqrt();
        assert!(rms < 0.7, "{rms} of 50");
    }

    #[test]
    fn the_reconstruction_of_a_disc_is_the_disc() {
        let geometry = ScanGeometry::new(96, 150);
        let map = disc(96, [8.0, -5.0], 25.0);
        let maps: Vec<[f32; 2]> = map.iter().map(|&x| [x, 0.0]).collect();
        let integrals: Vec<f32> = geometry.project(&maps).into_iter().map(|[one, _]| one).collect();
        let reconstructed = geometry.reconstruct(&integrals);
        let mut squares = 0.0;
        let inner: Vec<usize> = (0..96 * 96)
            .filter(|c| {
                let [x, y] = [c % 96, c / 96].map(|k| k as f64 - 47.5);
                x.hypot(y) < 44.0
            })
            .collect();
        for &pixel in &inner {
            squares += f64::from(reconstructed[pixel] - map[pixel]).powi(2);
        }
        let rms = (squares / inner.len() as f64).sqrt();
        assert!(rms < 0.05, "{rms}");
        let sum: f32 = reconstructed.iter().sum();
        assert!((sum / map.iter().sum::<f32>() - 1.0).abs() < 0.02);
    }
}
