//! Sufficient statistics of a linear regression.
//!
//! Σᵢ (yᵢ − aᵢ − xᵢ b)² = Σ_g n_g (ȳ_g − a_g − x̄_g b)² + ‖ỹ − X̃ b‖², where ỹ and X̃ are the deviations from the means
//! of the groups. The triangular factor of a QR factorisation of [X̃ ỹ] has the rows (rₖ, zₖ) and a last row (0, ρ).
//! The last term is then Σₖ (zₖ − rₖ b)² + ρ².

use nalgebra::DMatrix;

use super::design::Design;
use super::intercept::Intercept;
use crate::distribution::Sequence;
use crate::number::partials::Partials;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::term::parameter::Parameter;

/// View of the stored statistics: n, ρ², the rows of the triangular factor, and the rows of the groups.
#[derive(Clone, Copy, Debug)]
pub(super) struct Statistics<'s> {
    /// Number of data.
    pub(super) n: f64,
    /// Residual sum of squares ρ².
    rest: f64,
    slopes: usize,
    /// Rows (rₖ, zₖ) of the triangular factor, one per slope k, row-major.
    triangle: &'s [f64],
    /// Means x̄_g and ȳ_g and number of data n_g of every group g, row-major.
    groups: &'s [f64],
}

impl<'s> Statistics<'s> {
    /// Computes the statistics of the data `y` and appends them to `out`. `groups` is the number of groups, `slopes`
    /// the number of predictors.
    pub(super) fn write(
        x: &impl Design,
        y: &[f64],
        groups: usize,
        group: impl Fn(usize) -> usize,
        slopes: usize,
        out: &mut Vec<f64>,
    ) {
        let width = slopes + 1;
        // x̄, ȳ and the number of data of each group; sums of differences from the first datum of the group avoid
        // cancellation
        let mut means = vec![0.0; groups * (width + 1)];
        let mut first = vec![None; groups];
        let entry = |i: usize, k: usize| if k < slopes { x.row(i)[k] } else { y[i] };
        for i in 0..y.len() {
            let g = group(i);
            let origin = *first[g].get_or_insert(i);
            let group_means = &mut means[g * (width + 1)..(g + 1) * (width + 1)];
            for k in 0..width {
                group_means[k] += entry(i, k) - entry(origin, k);
            }
            group_means[width] += 1.0;
        }
        for (group_means, origin) in means.chunks_exact_mut(width + 1).zip(&first) {
            if let Some(origin) = *origin {
                for k in 0..width {
                    group_means[k] = entry(origin, k) + group_means[k] / group_means[width];
                }
            }
        }
        let centred = DMatrix::from_fn(y.len().max(width), width, |i, k| {
            if i < y.len() { entry(i, k) - means[group(i) * (width + 1) + k] } else { 0.0 }
        });
        let triangle = centred.qr().r();
        let rest = triangle[(slopes, slopes)].powi(2);
        out.extend([y.len() as f64, rest]);
        for k in 0..slopes {
            out.extend(triangle.row(k).iter());
        }
        out.extend(means);
    }

    /// Reads stored statistics; `None` if `stored` is too short.
    #[inline(always)]
    pub(super) fn read(stored: &'s [f64], slopes: usize) -> Option<Self> {
        let (&[n, rest], stored) = stored.split_first_chunk()?;
        let (triangle, groups) = stored.split_at_checked(slopes * (slopes + 1))?;
        Some(Self { n, rest, slopes, triangle, groups })
    }
}

/// Sufficient statistics and parameters of a linear regression.
#[derive(Debug)]
pub(super) struct Fit<'s, A, B> {
    pub(super) statistics: Statistics<'s>,
    pub(super) intercept: &'s A,
    pub(super) slopes: &'s B,
    /// Precision 1/σ².
    pub(super) weight: f64,
}

impl<'s, A, B> Fit<'s, A, B> {
    /// Residual y − x b of a row [x, y], without the intercept.
    #[inline(always)]
    fn residual<R: Scalar>(&self, row: &[f64]) -> f64
    where
        B: Sequence<Item: Datum<R>>,
    {
        let mut residual = row[self.statistics.slopes];
        for k in 0..self.statistics.slopes {
            residual -= row[k] * self.slopes.at::<R>(k).value();
        }
        residual
    }

    #[inline(always)]
    fn triangle(&self) -> impl Iterator<Item = &'s [f64]> {
        self.statistics.triangle.chunks_exact(self.statistics.slopes + 1)
    }

    #[inline(always)]
    fn groups(&self) -> impl Iterator<Item = (usize, &'s [f64])> {
        self.statistics.groups.chunks_exact(self.statistics.slopes + 2).enumerate()
    }

    /// Sum of squared residuals, Σᵢ (yᵢ − ηᵢ)².
    #[inline(always)]
    pub(super) fn squares<R: Scalar>(&self) -> f64
    where
        A: Intercept<R>,
        B: Sequence<Item: Datum<R>>,
    {
        let mut squares = self.statistics.rest;
        for row in self.triangle() {
            let residual = self.residual::<R>(row);
            squares += residual * residual;
        }
        for (g, row) in self.groups() {
            let residual = self.residual::<R>(row) - self.intercept.of_group(g).number();
            squares += row[self.statistics.slopes + 1] * residual * residual;
        }
        squares
    }

    /// Partial derivatives of −½ Σᵢ (yᵢ − ηᵢ)²/σ² plus a function of σ; `slope` is the derivative of the sum with
    /// respect to σ.
    #[inline(always)]
    pub(super) fn and<S>(self, sd: S, slope: f64) -> FitPartials<'s, A, B, S> {
        FitPartials { fit: self, sd, slope }
    }
}

#[derive(Debug)]
pub(super) struct FitPartials<'s, A, B, S> {
    fit: Fit<'s, A, B>,
    sd: S,
    slope: f64,
}

/// Number of slopes whose partial derivatives are summed in registers at a time.
const BLOCK: usize = 8;

impl<R, A, B, S> Partials<R> for FitPartials<'_, A, B, S>
where
    R: Scalar,
    A: Intercept<R>,
    B: Sequence<Item: Datum<R>>,
    S: Parameter + Datum<R>,
{
    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        let Self { fit, sd, slope } = self;
        sd.spread(slope, f);
        let slopes = fit.statistics.slopes;
        for first in (0..slopes.max(1)).step_by(BLOCK) {
            let mut sums = [0.0; BLOCK];
            let mut add = |residual: f64, row: &[f64]| {
                for k in 0..BLOCK.min(slopes - first) {
                    sums[k] += residual * row[first + k];
                }
            };
            for row in fit.triangle() {
                add(fit.residual::<R>(row), row);
            }
            for (g, row) in fit.groups() {
                let residual = fit.residual::<R>(row) - fit.intercept.of_group(g).number();
                let residual = row[slopes + 1] * residual;
                add(residual, row);
                if first == 0 {
                    fit.intercept.of_group(g).spread(fit.weight * residual, f);
                }
            }
            for k in 0..BLOCK.min(slopes - first) {
                f(fit.slopes.at(first + k), fit.weight * sums[k]);
            }
        }
    }
}
