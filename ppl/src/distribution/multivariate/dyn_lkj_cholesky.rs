//! The LKJ distribution of correlation matrices whose size comes from the data.

use rand::Rng;

use super::dyn_cholesky_factor::DynCholeskyFactor;
use super::lkj::Lkj;
use super::lkj_cholesky::LkjCholesky;
use crate::accumulator::Accumulator;
use crate::datum::Datum;
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::{Distribution, Unknown, lift};
use crate::parameter::Parameter;
use crate::scalar::Scalar;
use crate::special::Hyperbolic;

/// [`LkjCholesky`] of a size that is known at run time only; made by [`LkjCholesky::of`].
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     /// As many quantities as the rows of the data have numbers.
///     fn correlated(rows: &[Vec<f64>]) {
///         let k = rows.first().map_or(0, Vec::len);
///         let mean ~ Normal(0.0, 10.0).iid(k);
///         let sd ~ HalfNormal(1.0).iid(k);
///         let corr ~ LkjCholesky::of(k, 2.0);
///         let chol = corr.scale_rows(&sd)?;
///         for y in rows {
///             y ~ MvNormalCholesky(&mean, &chol);
///         }
///     }
/// }
/// let rows = [vec![0.3, 1.2, -0.4], vec![0.1, 0.9, 0.2]];
/// let model = correlated(&rows);
/// assert_eq!(model.layout()?.dim, 3 + 3 + 3);
/// # Ok::<(), ppl::ModelError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct DynLkjCholesky<E> {
    size: usize,
    eta: E,
}

impl LkjCholesky<0> {
    /// Factors of `size` rows, where that is known at run time only: `LkjCholesky::of(k, 2.0)`.
    pub fn of<E: Parameter>(size: usize, eta: E) -> DynLkjCholesky<E> {
        DynLkjCholesky { size, eta }
    }
}

impl<E: Parameter> Family for DynLkjCholesky<E> {}

impl<E: Parameter> DynLkjCholesky<E> {
    fn numbers(&self) -> Lkj {
        Lkj { eta: self.eta.number(), size: self.size }
    }
}

impl<R, E> Distribution<R> for DynLkjCholesky<E>
where
    R: Scalar,
    E: Parameter + Datum<R>,
{
    type Value = DynCholeskyFactor<R>;

    fn ln_density(&self, factor: &DynCholeskyFactor<R>) -> R {
        if factor.size() != self.size {
            return R::from(f64::NEG_INFINITY);
        }
        let (l, lkj) = (factor.values(), self.numbers());
        let value = lkj.ln_density((0..self.size).map(|i| l.row(i)));
        let eta: R = lift(self.eta);
        let mut in_eta = if eta.is_constant() { 0.0 } else { lkj.normaliser_slope() };
        in_eta += (1..self.size).map(|i| 2.0 * l.row(i)[i].ln()).sum::<f64>();
        let diagonal = (1..self.size).map(|i| (factor.row(i)[i], lkj.power(i) / l.row(i)[i]));
        R::fuse_iter(value, diagonal.chain([(eta, in_eta)]))
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("LkjCholesky", "eta", self.eta.number())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> DynCholeskyFactor<R> {
        let (lkj, mut rest) = (self.numbers(), 1.0);
        DynCholeskyFactor::from_fn(self.size, |i, j| {
            R::from(lkj.draw_entry((i, j), &mut rest, rng))
        })
    }
}

impl<R, E> Unknown<R> for DynLkjCholesky<E>
where
    R: Scalar,
    E: Parameter + Datum<R>,
{
    fn dim(&self) -> usize {
        self.size * self.size.saturating_sub(1) / 2
    }

    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Accumulator<R>,
    ) -> DynCholeskyFactor<R> {
        let (lkj, eta) = (self.numbers(), lift::<R>(self.eta));
        let (mut value, mut in_eta) = match !eta.is_constant() {
            // the same at every point
            false if terms.leave_out_constants() => (0.0, 0.0),
            varies => lkj.constant(jacobian, varies),
        };
        let mut rest = R::from(1.0);
        let factor = DynCholeskyFactor::from_fn(self.size, |i, j| {
            if j == 0 {
                rest = R::from(1.0);
            }
            if i == j {
                return rest;
            }
            // ln p = constant − Σ weight ln cosh y, where weight and y = x/√(2 bⱼ) move with η
            let (x, inverse) = (next(), lkj.scale(j).recip());
            let at = Hyperbolic::at(x.value() * inverse);
            let weight = if jacobian { 2.0 * lkj.shape(j) } else { lkj.power(i) };
            let slope = -weight * at.tanh * inverse;
            // what x adds when η moves
            let moved = -x.value() * inverse * inverse;
            value -= weight * at.ln_cosh();
            in_eta += slope * moved - 2.0 * at.ln_cosh();
            terms.add(0.0, ((x, slope),));
            // Lᵢⱼ = r tanh y, and r sech y is left for the rest of the row
            let whole = rest.value();
            let in_x = whole * at.sech * inverse;
            let entry = in_x * at.sech;
            let left = -in_x * at.tanh;
            let value =
                R::gather(whole * at.tanh, ((rest, at.tanh), (x, entry), (eta, entry * moved)));
            rest = R::gather(whole * at.sech, ((rest, at.sech), (x, left), (eta, left * moved)));
            value
        });
        terms.add(value, ((eta, in_eta),));
        factor
    }

    fn unconstrain(&self, factor: &DynCholeskyFactor<R>, out: &mut Vec<f64>) {
        let l = factor.values();
        self.numbers().unconstrain((0..self.size).map(|i| l.row(i)), out);
    }
}
