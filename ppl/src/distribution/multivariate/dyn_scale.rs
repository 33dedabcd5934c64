//! Multivariate normal densities of factors whose size comes from the data.

use rand::Rng;
use rand_distr::StandardNormal;

use super::dyn_cholesky_factor::DynCholeskyFactor;
use super::mv_normal_cholesky::Scale;
use crate::accumulator::Accumulator;
use crate::datum::Datum;
use crate::density::DomainError;
use crate::partials::Each;
use crate::scalar::Scalar;
use crate::special::HALF_LN_2PI;

impl<R, T> Scale<R> for DynCholeskyFactor<T>
where
    R: Scalar,
    T: Datum<R> + Clone,
{
    type Vector = Vec<R>;

    fn size(&self) -> usize {
        self.size()
    }

    fn add_terms(&self, mean: &Vec<R>, x: &Vec<R>, terms: &mut impl Accumulator<R>) {
        let factor: DynCholeskyFactor<R> = self.lift();
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

    fn validate(&self, mean: &Vec<R>) -> Result<(), DomainError> {
        require_length("length of the mean", mean.len(), self.size())?;
        for (i, mean) in mean.iter().enumerate() {
            DomainError::require_finite(NAME, format_args!("mean[{i}]"), mean.value())?;
        }
        let factor: DynCholeskyFactor<R> = self.lift();
        factor.validate(NAME)
    }

    fn fits(&self, x: &Vec<R>) -> Result<(), DomainError> {
        require_length("length of x", x.len(), self.size())
    }

    fn draw<G: Rng + ?Sized>(&self, mean: &Vec<R>, rng: &mut G) -> Vec<R> {
        let factor: DynCholeskyFactor<R> = self.lift();
        let z: Vec<f64> = mean.iter().map(|_| rng.sample(StandardNormal)).collect();
        let moved = |(i, mean): (usize, &R)| {
            let row = factor.row(i).iter().zip(&z);
            R::from(mean.value() + row.map(|(l, z)| l.value() * z).sum::<f64>())
        };
        mean.iter().enumerate().take(factor.size()).map(moved).collect()
    }

    fn collect(&self, next: &mut impl FnMut() -> R) -> Vec<R> {
        (0..self.size()).map(|_| next()).collect()
    }
}

const NAME: &str = "MvNormalCholesky";

fn require_length(what: &'static str, length: usize, rows: usize) -> Result<(), DomainError> {
    let requirement = format_args!("that of the factor's rows, {rows}");
    DomainError::require(length == rows, NAME, what, requirement, length as f64)
}
