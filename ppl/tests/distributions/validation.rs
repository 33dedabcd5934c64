//! Parameters outside their domain: the message contains family, parameter, requirement and value, and the density is
//! NaN.

use ppl::Univariate;
use ppl::prelude::*;

fn assert_message(result: Result<(), ppl::DomainError>, expected: &str) {
    assert_eq!(result.unwrap_err().to_string(), expected);
}

#[test]
fn messages() {
    let positive = "must be positive and finite, got";
    assert_message(
        Univariate::validate(&Normal(f64::NAN, 1.0)),
        "Normal: mean must be finite, got NaN",
    );
    assert_message(Univariate::validate(&Normal(0.0, -1.0)), &format!("Normal: sd {positive} -1"));
    assert_message(
        Univariate::validate(&Uniform(3.0, 1.0)),
        "Uniform: lower end must be below the upper end 1, got 3",
    );
    assert_message(
        Univariate::validate(&Uniform(f64::NEG_INFINITY, 1.0)),
        "Uniform: lower end must be finite, got -inf",
    );
    assert_message(Univariate::validate(&HalfNormal(0.0)), &format!("HalfNormal: sd {positive} 0"));
    assert_message(
        Univariate::validate(&LogNormal(0.0, f64::INFINITY)),
        &format!("LogNormal: sd of the logarithm {positive} inf"),
    );
    assert_message(
        Univariate::validate(&Exponential(-2.0)),
        &format!("Exponential: rate {positive} -2"),
    );
    assert_message(Univariate::validate(&Gamma(1.0, 0.0)), &format!("Gamma: rate {positive} 0"));
    assert_message(Univariate::validate(&Gamma(-1.0, 1.0)), &format!("Gamma: shape {positive} -1"));
    assert_message(
        Univariate::validate(&Beta(1.0, -3.0)),
        &format!("Beta: second shape {positive} -3"),
    );
    assert_message(
        Univariate::validate(&StudentT(0.0, 0.0, 1.0)),
        &format!("StudentT: degrees of freedom {positive} 0"),
    );
    assert_message(
        Univariate::validate(&HalfCauchy(-0.5)),
        &format!("HalfCauchy: scale {positive} -0.5"),
    );
    assert_message(
        Distribution::<f64>::validate(&Poisson(-1.0)),
        "Poisson: rate must be at least 0 and finite, got -1",
    );
    assert_message(
        Distribution::<f64>::validate(&Bernoulli(1.5)),
        "Bernoulli: probability must be within 0 and 1, got 1.5",
    );
    assert_message(
        Distribution::<f64>::validate(&LkjCholesky::<3>(0.0)),
        &format!("LkjCholesky: eta {positive} 0"),
    );
    assert_message(
        Univariate::validate(&Normal(0.0, 1.0).truncate(2.0..1.0)),
        "truncate: lower end must be below the upper end 1, got 2",
    );
    assert_message(
        Distribution::<f64>::validate(&Normal(0.0, 1.0).censor(2.0..1.0)),
        "censor: lower end must be below the upper end 1, got 2",
    );
    assert_message(
        Univariate::validate(&Weibull(1.0, 0.0)),
        &format!("Weibull: scale {positive} 0"),
    );
    assert_message(
        Distribution::<f64>::validate(&Binomial(3u64, -0.5)),
        "Binomial: probability must be within 0 and 1, got -0.5",
    );
    let pair = [Normal(0.0, 1.0), Normal(1.0, 1.0)];
    assert_message(
        Distribution::<f64>::validate(&Mixture([0.5, 0.6], pair)),
        "Mixture: sum of the weights must be 1, got 1.1",
    );
    assert_message(
        Distribution::<f64>::validate(&Mixture(vec![1.0], pair)),
        "Mixture: number of weights must be equal to the number of components, 2, got 1",
    );
    let reversed = Normal(0.0, 1.0).truncate(2.0..1.0);
    assert!(reversed.quantile(0.5).is_nan() && reversed.mean().is_nan());
    assert!(Normal(0.0, 1.0).truncate(f64::NAN..).quantile(0.5).is_nan());
    assert_message(
        Univariate::validate(&Uniform(0.0, 1.0).truncate(2.0..)),
        "truncate: probability of the interval must be positive, got 0",
    );
    let factor = CholeskyFactor::new([[1.0, 0.0], [0.5, 2.0]]).unwrap();
    assert_message(
        Distribution::<f64>::validate(&MvNormalCholesky([0.0, f64::NAN], factor)),
        "MvNormalCholesky: mean[1] must be finite, got NaN",
    );
    let error = CholeskyFactor::new([[1.0, 0.5], [0.5, 2.0]]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "CholeskyFactor: entry (0, 1) above the diagonal must be zero, got 0.5"
    );
    let error = CholeskyFactor::new([[1.0, 0.0], [0.5, -2.0]]).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!("CholeskyFactor: diagonal entry 1 of the Cholesky factor {positive} -2")
    );
}

/// A sampler that leaves the domain gets NaN, which it counts as a rejection.
#[test]
fn densities_outside_the_domain_are_no_numbers() {
    let x = 0.4;
    let densities: [f64; 12] = [
        Normal(0.0, -1.0).ln_density(&x),
        HalfNormal(-1.0).ln_density(&x),
        LogNormal(0.0, -1.0).ln_density(&x),
        Exponential(-1.0).ln_density(&x),
        Gamma(-1.0, 1.0).ln_density(&x),
        Gamma(1.0, -1.0).ln_density(&x),
        Beta(-1.0, 1.0).ln_density(&x),
        Beta(1.0, -1.0).ln_density(&x),
        StudentT(-1.0, 0.0, 1.0).ln_density(&x),
        StudentT(1.0, 0.0, -1.0).ln_density(&x),
        HalfCauchy(-1.0).ln_density(&x),
        Poisson(-1.0).ln_density(&2),
    ];
    for (i, ln_density) in densities.iter().enumerate() {
        assert!(ln_density.is_nan(), "case {i}: {ln_density}");
    }
}
