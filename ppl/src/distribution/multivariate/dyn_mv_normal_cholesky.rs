//! The multivariate normal distribution of a size that comes from the data.

use rand::Rng;
use rand_distr::StandardNormal;

use super::dyn_cholesky_factor::DynCholeskyFactor;
use super::mv_normal_cholesky::MvNormalCholesky;
use crate::density::DomainError;
use crate::distribution::traits::{Distribution, Unknown};
use crate::partials::Each;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::HALF_LN_2PI;
use crate::terms::{Joined, Terms};

/// A factor of a size known at run time, owned or behind a reference.
pub trait DynFactor: Clone {
    /// What its entries are.
    type Entry: Clone;

    /// The factor.
    fn factor(&self) -> &DynCholeskyFactor<Self::Entry>;
}

impl<T: Clone> DynFactor for DynCholeskyFactor<T> {
    type Entry = T;

    fn factor(&self) -> &Self {
        self
    }
}

impl<T: Clone> DynFactor for &DynCholeskyFactor<T> {
    type Entry = T;

    fn factor(&self) -> &DynCholeskyFactor<T> {
        self
    }
}

/// Means are slices or vectors here, as are values: `MvNormalCholesky(&mean, &factor)`.
impl<R, M, L> Distribution<R> for MvNormalCholesky<M, L>
where
    R: Scalar,
    M: Datum<Vec<R>> + Clone,
    L: DynFactor<Entry: Datum<R>>,
{
    type Value = Vec<R>;

    fn ln_density(&self, x: &Vec<R>) -> R {
        Joined::of(|terms| self.add_terms(x, terms))
    }

    fn add_terms(&self, x: &Vec<R>, terms: &mut impl Terms<R>) {
        let (mean, factor): (_, DynCholeskyFactor<R>) = (self.0.lift(), self.1.factor().lift());
        let (k, l) = (factor.size(), factor.values());
        if x.len() != k || mean.len() != k {
            return terms.add_number(R::from(f64::NEG_INFINITY));
        }
        // z = L⁻¹(x − μ)
        let mut value = -HALF_LN_2PI * k as f64;
        let mut z = Vec::with_capacity(k);
        for i in 0..k {
            let (entries, diagonal) = l.row(i).split_at(i);
            let inner: f64 = entries.iter().zip(&z).map(|(l, z)| l * z).sum();
            let own = (x[i].value() - mean[i].value() - inner) / diagonal[0];
            value -= 0.5 * own * own + diagonal[0].ln();
            z.push(own);
        }
        if !R::DIFFERENTIABLE {
            return terms.add_number(R::from(value));
        }
        // w = L⁻ᵀ z
        let mut w = z.clone();
        for i in (0..k).rev() {
            w[i] /= l.row(i)[i];
            for j in 0..i {
                w[j] -= l.row(i)[j] * w[i];
            }
        }
        let ends = (0..k).flat_map(|i| [(x[i], -w[i]), (mean[i], w[i])]);
        let entries = (0..k).flat_map(|i| {
            let (z, w, own) = (&z, &w, l.row(i)[i].recip());
            let row = factor.row(i).iter().enumerate();
            row.map(move |(j, &entry)| (entry, w[i] * z[j] - if i == j { own } else { 0.0 }))
        });
        terms.add(value, Each(ends.chain(entries)));
    }

    fn validate(&self) -> Result<(), DomainError> {
        const NAME: &str = "MvNormalCholesky";
        let (mean, factor): (Vec<R>, DynCholeskyFactor<R>) =
            (self.0.lift(), self.1.factor().lift());
        let requirement = format_args!("that of the factor's rows, {}", factor.size());
        let (holds, length) = (mean.len() == factor.size(), mean.len() as f64);
        DomainError::require(holds, NAME, "length of the mean", requirement, length)?;
        for (i, mean) in mean.iter().enumerate() {
            DomainError::require_finite(NAME, format_args!("mean[{i}]"), mean.value())?;
        }
        factor.validate(NAME)
    }

    fn fits(&self, x: &Vec<R>) -> Result<(), DomainError> {
        let k = self.1.factor().size();
        let requirement = format_args!("that of the factor's rows, {k}");
        let length = x.len() as f64;
        DomainError::require(x.len() == k, "MvNormalCholesky", "length of x", requirement, length)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Vec<R> {
        let (mean, factor): (Vec<R>, DynCholeskyFactor<R>) =
            (self.0.lift(), self.1.factor().lift());
        let z: Vec<f64> = mean.iter().map(|_| rng.sample(StandardNormal)).collect();
        let moved = |(i, mean): (usize, &R)| {
            let row = factor.row(i).iter().zip(&z);
            R::from(mean.value() + row.map(|(l, z)| l.value() * z).sum::<f64>())
        };
        mean.iter().enumerate().take(factor.size()).map(moved).collect()
    }
}

impl<R, M, L> Unknown<R> for MvNormalCholesky<M, L>
where
    R: Scalar,
    M: Datum<Vec<R>> + Clone,
    L: DynFactor<Entry: Datum<R>>,
{
    fn dim(&self) -> usize {
        self.1.factor().size()
    }

    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        _: bool,
        terms: &mut impl Terms<R>,
    ) -> Vec<R> {
        let x = (0..self.1.factor().size()).map(|_| next()).collect();
        self.add_terms(&x, terms);
        x
    }

    fn unconstrain(&self, x: &Vec<R>, out: &mut Vec<f64>) {
        out.extend(x.iter().map(|x| x.value()));
    }
}
