//! Least-squares parabolas.

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len() as f64;
    values.sum::<f64>() / n
}

/// A least-squares parabola, in the polynomials 1, x − a, (x − a)(x − b) − s that are orthogonal over
/// the points, so that each coefficient is one projection.
pub(super) struct Parabola {
    a: f64,
    b: f64,
    s: f64,
    pub(super) coefficients: [f64; 3],
}

impl Parabola {
    pub(super) fn of(points: &[(f64, f64)]) -> Self {
        let a = mean(points.iter().map(|p| p.0));
        let norm1: f64 = points.iter().map(|(x, _)| (x - a).powi(2)).sum();
        let b = points.iter().map(|(x, _)| x * (x - a).powi(2)).sum::<f64>() / norm1;
        let s = norm1 / points.len() as f64;
        let second = |x: f64| (x - a) * (x - b) - s;
        let norm2: f64 = points.iter().map(|(x, _)| second(*x).powi(2)).sum();
        let c0 = mean(points.iter().map(|p| p.1));
        let c1 = points.iter().map(|(x, y)| y * (x - a)).sum::<f64>() / norm1;
        let c2 = points.iter().map(|(x, y)| y * second(*x)).sum::<f64>() / norm2;
        Self { a, b, s, coefficients: [c0, c1, c2] }
    }

    pub(super) fn at(&self, x: f64) -> f64 {
        let Self { a, b, s, coefficients: [c0, c1, c2] } = self;
        c0 + c1 * (x - a) + c2 * ((x - a) * (x - b) - s)
    }

    /// Its derivative.
    pub(super) fn slope_at(&self, x: f64) -> f64 {
        let [_, c1, c2] = self.coefficients;
        c1 + c2 * (2.0 * x - self.a - self.b)
    }

    /// Its vertex, if it opens downwards.
    pub(super) fn vertex(&self) -> Option<(f64, f64)> {
        let [_, c1, c2] = self.coefficients;
        let x = 0.5 * (self.a + self.b) - 0.5 * c1 / c2;
        (c2 < 0.0).then(|| (x, self.at(x)))
    }
}
