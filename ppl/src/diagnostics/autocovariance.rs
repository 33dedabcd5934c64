//! Autocovariance by the fast Fourier transform.

use nalgebra::Complex;

/// Biased autocovariance (1/n) Σ_t (x_t − x̄)(x_{t+l} − x̄) for lags l = 0 … n − 1, averaged over chains of equal
/// length. Each chain is centred on its own mean.
///
/// Two chains share one complex transform: for z = a + ib, the real part of the autocovariance of z is the sum of the
/// autocovariances of a and b. The power spectra are summed, so that one inverse transform is enough.
pub(super) fn autocovariance(chains: &[&[f64]]) -> Vec<f64> {
    let draws = chains[0].len();
    let size = (2 * draws).next_power_of_two(); // zero padding prevents circular wrap-around
    let roots: Vec<Complex<f64>> = (0..size / 2)
        .map(|k| Complex::cis(-2.0 * std::f64::consts::PI * k as f64 / size as f64))
        .collect();

    let mut power = vec![Complex::new(0.0, 0.0); size];
    let mut signal = power.clone();
    for pair in chains.chunks(2) {
        signal.fill(Complex::new(0.0, 0.0));
        let first = super::mean(pair[0].iter().copied());
        for (z, x) in signal.iter_mut().zip(pair[0]) {
            z.re = x - first;
        }
        if let Some(other) = pair.get(1) {
            let second = super::mean(other.iter().copied());
            for (z, x) in signal.iter_mut().zip(*other) {
                z.im = x - second;
            }
        }
        transform(&mut signal, &roots);
        for (p, z) in power.iter_mut().zip(&signal) {
            p.re += z.norm_sqr();
        }
    }

    transform(&mut power, &roots); // the spectrum is real and even, so forward and inverse transform differ only in scale
    let scale = 1.0 / (size as f64 * draws as f64 * chains.len() as f64);
    power[..draws].iter().map(|z| z.re * scale).collect()
}

/// In-place radix-2 fast Fourier transform. `roots[k] = exp(−2πik/n)` for k < n/2; n is a power of two.
fn transform(x: &mut [Complex<f64>], roots: &[Complex<f64>]) {
    let n = x.len();
    let shift = usize::BITS - n.trailing_zeros();
    for i in 0..n {
        let j = i.reverse_bits() >> shift;
        if i < j {
            x.swap(i, j);
        }
    }
    let mut half = 1;
    while half < n {
        let stride = n / (2 * half);
        for block in x.chunks_exact_mut(2 * half) {
            let (low, high) = block.split_at_mut(half);
            for (k, (a, b)) in low.iter_mut().zip(high).enumerate() {
                let turned = *b * roots[k * stride];
                *b = *a - turned;
                *a += turned;
            }
        }
        half *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_direct_sum() {
        let chains: Vec<Vec<f64>> = (0..3)
            .map(|c| (0..37).map(|t| ((t * t + 11 * c) as f64 * 0.37).sin() + c as f64).collect())
            .collect();
        let chains: Vec<&[f64]> = chains.iter().map(Vec::as_slice).collect();
        let fast = autocovariance(&chains);
        for lag in 0..37 {
            let direct: f64 = chains
                .iter()
                .map(|chain| {
                    let mean = chain.iter().sum::<f64>() / 37.0;
                    (0..37 - lag).map(|t| (chain[t] - mean) * (chain[t + lag] - mean)).sum::<f64>()
                        / 37.0
                })
                .sum::<f64>()
                / 3.0;
            assert!((fast[lag] - direct).abs() < 1e-13, "lag {lag}: {} {direct}", fast[lag]);
        }
    }
}
