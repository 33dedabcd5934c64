//! Least-squares lines and parabolas.

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len() as f64;
    values.sum::<f64>() / n
}

/// Slope of the least-squares line, unless all points have one abscissa.
pub(super) fn line_slope(points: &[(f64, f64)]) -> Option<f64> {
    let centre = mean(points.iter().map(|p| p.0));
    let (sxy, sxx) = points.iter().fold((0.0, 0.0), |(sxy, sxx), (x, y)| {
        (sxy + (x - centre) * y, sxx + (x - centre).powi(2))
    });
    (sxx > 0.0).then_some(sxy / sxx)
}

/// What the slope of the least-squares line through all of a curve between `from` and `to` gains for each
/// unit that these ends move by: ∂S/∂from and ∂S/∂to of S = 12/L³ ∫ (u − c) F du, with c in the middle
/// and L the length, the curve being straight between its points.
pub(super) fn slope_by_ends(u: &[f64], force: &[f64], from: f64, to: f64) -> [f64; 2] {
    let from = from.max(u[0]);
    let (length, centre) = (to - from, 0.5 * (from + to));
    let at = |x: f64| {
        let k = u.partition_point(|u| *u < x).clamp(1, u.len() - 1);
        force[k - 1] + (force[k] - force[k - 1]) * (x - u[k - 1]) / (u[k] - u[k - 1])
    };
    let inside = u.iter().copied().filter(|x| (from..to).contains(x) && *x > from);
    let places: Vec<f64> = [from].into_iter().chain(inside).chain([to]).collect();
    let (mut area, mut moment) = (0.0, 0.0);
    for ends in places.windows(2) {
        let (x, y) = ([ends[0] - centre, ends[1] - centre], [at(ends[0]), at(ends[1])]);
        let middle = 0.25 * (x[0] + x[1]) * (y[0] + y[1]);
        area += 0.5 * (x[1] - x[0]) * (y[0] + y[1]);
        // Simpson's rule, exact for a product of two lines
        moment += (x[1] - x[0]) / 6.0 * (x[0] * y[0] + 4.0 * middle + x[1] * y[1]);
    }
    let (moment_by, factor) = (|y: f64| 0.5 * (length * y - area), 12.0 / length.powi(3));
    let stretched = 3.0 * moment / length;
    [factor * (moment_by(at(from)) + stretched), factor * (moment_by(at(to)) - stretched)]
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
