//! Multivariate normal densities of factors whose size is in their type.

use rand::Rng;
use rand_distr::StandardNormal;

use super::cholesky_factor::CholeskyFactor;
use super::mv_normal_cholesky::Scale;
use crate::accumulator::Accumulator;
use crate::datum::Datum;
use crate::density::DomainError;
use crate::partials::Partials;
use crate::scalar::Scalar;
use crate::special::HALF_LN_2PI;

/// The partials of one density.
struct Gradient<R, const K: usize> {
    x: [R; K],
    mean: [R; K],
    factor: CholeskyFactor<R, K>,
    z: [f64; K],
    w: [f64; K],
    /// 1/Lᵢᵢ.
    inverse: [f64; K],
}

impl<R: Scalar, const K: usize> Partials<R> for Gradient<R, K> {
    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        let Self { x, mean, factor, z, w, inverse } = self;
        let mut in_factor = [[0.0; K]; K];
        for i in 0..K {
            f(x[i], -w[i]);
            f(mean[i], w[i]);
            for j in 0..=i {
                in_factor[i][j] = w[i] * z[j];
            }
            in_factor[i][i] -= inverse[i];
        }
        factor.spread_rows(in_factor, f);
    }
}

/// The partials of many densities together.
struct Pooled<R, const K: usize> {
    mean: [R; K],
    factor: CholeskyFactor<R, K>,
    in_mean: [f64; K],
    in_factor: [[f64; K]; K],
}

impl<R: Scalar, const K: usize> Partials<R> for Pooled<R, K> {
    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        let Self { mean, factor, in_mean, in_factor } = self;
        for i in 0..K {
            f(mean[i], in_mean[i]);
        }
        factor.spread_rows(in_factor, f);
    }
}

/// Σ ln Lᵢᵢ; NaN if one is not positive. A loop, since a call of `product` keeps the compiler from
/// taking the logarithm out of a plate.
#[inline]
fn ln_determinant<const K: usize>(l: &[[f64; K]; K]) -> f64 {
    let (mut product, mut positive) = (1.0, true);
    for i in 0..K {
        product *= l[i][i];
        positive &= l[i][i] > 0.0;
    }
    if positive && product.is_normal() {
        return product.ln();
    }
    let mut sum = 0.0;
    for i in 0..K {
        sum += l[i][i].ln();
    }
    sum
}

/// b ← L⁻¹ b, with the reciprocals of the diagonal.
#[inline]
fn solve_lower<const K: usize>(l: &[[f64; K]; K], inverse: &[f64; K], b: &mut [f64; K]) {
    for i in 0..K {
        for j in 0..i {
            b[i] -= l[i][j] * b[j];
        }
        b[i] *= inverse[i];
    }
}

/// b ← L⁻ᵀ b.
#[inline]
fn solve_upper<const K: usize>(l: &[[f64; K]; K], inverse: &[f64; K], b: &mut [f64; K]) {
    for i in (0..K).rev() {
        for k in i + 1..K {
            b[i] -= l[k][i] * b[k];
        }
        b[i] *= inverse[i];
    }
}

/// 1/Lᵢᵢ.
#[inline(always)]
fn inverses<const K: usize>(l: &[[f64; K]; K]) -> [f64; K] {
    std::array::from_fn(|i| l[i][i].recip())
}

impl<R, T, const K: usize> Scale<R> for CholeskyFactor<T, K>
where
    R: Scalar,
    T: Datum<R> + Clone,
{
    type Vector = [R; K];

    fn size(&self) -> usize {
        K
    }

    #[inline(always)]
    fn add_terms(&self, mean: &[R; K], x: &[R; K], terms: &mut impl Accumulator<R>) {
        let factor: CholeskyFactor<R, K> = self.lifted();
        let l = factor.values();
        let inverse = inverses(&l);
        let mut z = std::array::from_fn(|i| x[i].value() - mean[i].value());
        solve_lower(&l, &inverse, &mut z);
        let mut square = 0.0;
        for i in 0..K {
            square += z[i] * z[i];
        }
        let value = -HALF_LN_2PI * K as f64 - 0.5 * square - ln_determinant(&l);
        if !R::DIFFERENTIABLE {
            return terms.add_number(R::from(value));
        }
        let mut w = z;
        solve_upper(&l, &inverse, &mut w);
        terms.add(value, Gradient { x: *x, mean: *mean, factor, z, w, inverse });
    }

    const HAS_STATISTICS: bool = true;

    /// n, x̄ and, row by row, the scatter matrix Σ (x − x̄)(x − x̄)ᵀ.
    fn sufficient_statistics(mut data: impl Iterator<Item = [R; K]>, sums: &mut Vec<f64>) {
        // sums of differences from one datum keep their digits
        let Some(origin) = data.next().map(|x| x.map(Scalar::value)) else { return };
        let (mut n, mut sum, mut scatter) = (1.0, [0.0; K], [[0.0; K]; K]);
        for x in data {
            n += 1.0;
            let d: [f64; K] = std::array::from_fn(|i| x[i].value() - origin[i]);
            for i in 0..K {
                sum[i] += d[i];
                for j in 0..K {
                    scatter[i][j] += d[i] * d[j];
                }
            }
        }
        sums.push(n);
        sums.extend((0..K).map(|i| origin[i] + sum[i] / n));
        sums.extend((0..K * K).map(|k| (k / K, k % K)).map(|(i, j)| {
            let between = sum[i] * sum[j] / n;
            scatter[i][j] - between
        }));
    }

    #[inline(always)]
    fn add_pooled_terms(&self, mean: &[R; K], sums: &[f64], terms: &mut impl Accumulator<R>) {
        let Some((&n, sums)) = sums.split_first() else { return };
        let (center, scatter) = sums.split_at(K);
        let factor: CholeskyFactor<R, K> = self.lifted();
        let l = factor.values();
        let mut z: [f64; K] = std::array::from_fn(|i| center[i] - mean[i].value());
        let inverse = inverses(&l);
        solve_lower(&l, &inverse, &mut z);
        // A = L⁻¹ S L⁻ᵀ, by rows of the symmetric S and then of what is left
        let (mut half, mut a) = ([[0.0; K]; K], [[0.0; K]; K]);
        for i in 0..K {
            half[i].copy_from_slice(&scatter[i * K..(i + 1) * K]);
            solve_lower(&l, &inverse, &mut half[i]);
        }
        for i in 0..K {
            for j in 0..K {
                a[i][j] = half[j][i];
            }
            solve_lower(&l, &inverse, &mut a[i]);
        }
        let mut value = -HALF_LN_2PI * K as f64 * n;
        for i in 0..K {
            value -= 0.5 * (n * z[i] * z[i] + a[i][i]);
        }
        value -= n * ln_determinant(&l);
        if !R::DIFFERENTIABLE {
            return terms.add_number(R::from(value));
        }
        // G = L⁻ᵀ (n z zᵀ + A), of which the lower triangle less n/Lᵢᵢ is the partial in L
        let mut in_factor = [[0.0; K]; K];
        for j in 0..K {
            let mut column: [f64; K] = std::array::from_fn(|i| n * z[i] * z[j] + a[i][j]);
            solve_upper(&l, &inverse, &mut column);
            for i in j..K {
                in_factor[i][j] = column[i];
            }
            in_factor[j][j] -= n * inverse[j];
        }
        let mut w = z;
        solve_upper(&l, &inverse, &mut w);
        let in_mean = w.map(|w| n * w);
        terms.add(value, Pooled { mean: *mean, factor, in_mean, in_factor });
    }

    fn validate(&self, mean: &[R; K]) -> Result<(), DomainError> {
        for (i, mean) in mean.iter().enumerate() {
            let name = format_args!("mean[{i}]");
            DomainError::require_finite("MvNormalCholesky", name, mean.value())?;
        }
        self.lifted::<R>().validate("MvNormalCholesky")
    }

    fn draw<G: Rng + ?Sized>(&self, mean: &[R; K], rng: &mut G) -> [R; K] {
        let l = self.lifted::<R>().values();
        let z: [f64; K] = std::array::from_fn(|_| rng.sample(StandardNormal));
        std::array::from_fn(|i| {
            let inner: f64 = (0..=i).map(|j| l[i][j] * z[j]).sum();
            R::from(mean[i].value() + inner)
        })
    }

    #[inline(always)]
    fn collect(&self, next: &mut impl FnMut() -> R) -> [R; K] {
        std::array::from_fn(|_| next())
    }
}
