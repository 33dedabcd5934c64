//! Legendre polynomials on [−1, 1] and their derivatives.

/// Highest degree of an input in an expansion. Because of this limit, an evaluation can store the values of all
/// polynomials on the stack.
pub const MAX_ORDER: usize = 16;

/// The Legendre polynomials and their derivatives: the pairs (P_k(t), P_k'(t)) for k = 0 … K − 1.
///
/// The recurrences are (k+1) P_(k+1) = (2k+1) t P_k − k P_(k−1) and P'_(k+1) = (2k+1) P_k + P'_(k−1). The second
/// recurrence has no division by 1 − t² and is therefore valid at t = ±1 too.
#[inline]
pub(crate) fn legendre<const K: usize>(t: f64) -> [[f64; 2]; K] {
    let mut p = [[1.0, 0.0]; K];
    if K > 1 {
        p[1] = [t, 1.0];
    }
    for k in 1..K.saturating_sub(1) {
        let (odd, next) = ((2 * k + 1) as f64, (k + 1) as f64);
        let value = (odd / next) * (t * p[k][0]) - (k as f64 / next) * p[k - 1][0];
        p[k + 1] = [value, odd * p[k][0] + p[k - 1][1]];
    }
    p
}

/// The factor √(2k+1) that makes P_k orthonormal for the uniform density ½ on [−1, 1].
pub(crate) fn norm(k: usize) -> f64 {
    ((2 * k + 1) as f64).sqrt()
}

/// Values of the basis polynomials at t: Π_i ψ_(a_i)(t_i) for each multi-index a, with ψ_k = √(2k+1) P_k and the
/// Legendre polynomials P_k.
pub(crate) fn basis_row<'a>(indices: impl IntoIterator<Item = &'a Vec<u8>>, t: &[f64]) -> Vec<f64> {
    let psi = orthonormal(t);
    let product =
        |a: &Vec<u8>| a.iter().zip(&psi).map(|(&k, psi)| psi[usize::from(k)][0]).product();
    indices.into_iter().map(product).collect()
}

/// Derivatives of [`basis_row`] with respect to t_1, t_2, …, one row per coordinate.
pub(crate) fn basis_slopes<'a>(
    indices: impl IntoIterator<Item = &'a Vec<u8>> + Clone,
    t: &[f64],
) -> Vec<Vec<f64>> {
    let psi = orthonormal(t);
    let product = |a: &Vec<u8>, d: usize| {
        let factor = |(i, psi): (usize, &Polynomials)| psi[usize::from(a[i])][usize::from(i == d)];
        psi.iter().enumerate().map(factor).product()
    };
    let row = |d: usize| indices.clone().into_iter().map(|a| product(a, d)).collect();
    (0..t.len()).map(row).collect()
}

type Polynomials = [[f64; 2]; MAX_ORDER + 1];

/// The pairs (ψ_k(t), ψ_k'(t)) of orthonormal Legendre polynomials for each coordinate t and all degrees k.
fn orthonormal(t: &[f64]) -> Vec<Polynomials> {
    let at = |&t: &f64| {
        let p = legendre::<{ MAX_ORDER + 1 }>(t);
        std::array::from_fn(|k| p[k].map(|p| norm(k) * p))
    };
    t.iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn reference_values_of_the_orthonormal_polynomials() {
        let expected = [
            1.0,
            0.519615242270663,
            -0.816164811787423,
            -1.011999876482206,
            0.2188125,
            1.145516598997888,
        ];
        for (k, (p, e)) in legendre::<6>(0.3).iter().zip(expected).enumerate() {
            assert_relative_eq!(norm(k) * p[0], e, max_relative = 1e-14);
        }
    }

    /// Closed forms: P_4 = (35t⁴ − 30t² + 3)/8 and P_5 = (63t⁵ − 70t³ + 15t)/8; at t = ±1, P_k' = (±1)^(k+1) k(k+1)/2.
    #[test]
    fn values_and_derivatives_have_their_closed_forms() {
        for t in [-1.0, -0.8, 0.0, 0.37, 1.0f64] {
            let p = legendre::<6>(t);
            let p4 = (35.0 * t.powi(4) - 30.0 * t * t + 3.0) / 8.0;
            let d5 = (315.0 * t.powi(4) - 210.0 * t * t + 15.0) / 8.0;
            assert_relative_eq!(p[4][0], p4, epsilon = 1e-14);
            assert_relative_eq!(p[5][1], d5, epsilon = 1e-13);
        }
        for (k, p) in legendre::<{ MAX_ORDER + 1 }>(-1.0).iter().enumerate() {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            assert_relative_eq!(p[0], sign, max_relative = 1e-13);
            assert_relative_eq!(
                p[1],
                -sign * (k * (k + 1) / 2) as f64,
                epsilon = 1e-12,
                max_relative = 1e-13
            );
        }
    }

    /// Integrates by the midpoint rule on a fine grid, with error O(h²).
    #[test]
    fn the_basis_is_orthonormal() {
        let n = 20_000;
        let mut gram = [[0.0; 9]; 9];
        for i in 0..n {
            let p = legendre::<9>(-1.0 + (2 * i + 1) as f64 / n as f64);
            for a in 0..9 {
                for b in 0..9 {
                    gram[a][b] += norm(a) * p[a][0] * norm(b) * p[b][0] / n as f64;
                }
            }
        }
        for a in 0..9 {
            for b in 0..9 {
                assert_relative_eq!(gram[a][b], f64::from(a == b), epsilon = 1e-5);
            }
        }
    }
}
