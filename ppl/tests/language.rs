//! The language of `model!` against the same models by hand.

use ppl::prelude::*;

ppl::model! {
    /// A line.
    pub fn line(x: &[f64], y: &[f64]) {
        let slope ~ Normal(0.0, 1.0).array::<2>();
        let sd ~ Normal(0.15, 0.25).truncate(0.0..);
        #[track] let twice = 2.0 * slope[1] + 1.0 - 0.5 * slope[0] / sd;
        for (x, y) in x.iter().zip(y) {
            let mean = slope[0] * x + slope[1] - 0.1 * (1.0 - sd);
            y ~ Normal(mean, sd);
        }
        #[predict] let new ~ Normal(slope[1], sd);
        #[predict] let sum = new + twice;
    }
}

#[test]
fn first() {
    let (x, y) = ([0.0, 1.0, 2.0], [0.1, 0.9, 2.2]);
    let model = line(&x, &y);
    let layout = model.layout().unwrap();
    assert_eq!(layout.dim, 3);
    let names: Vec<_> =
        layout.variables.iter().map(|v| (v.name.as_str(), v.shape.clone())).collect();
    assert_eq!(
        names,
        [
            ("slope", vec![2]),
            ("sd", vec![]),
            ("twice", vec![]),
            ("y", vec![3]),
            ("new", vec![]),
            ("sum", vec![])
        ]
    );
}

/// Three quantities of three parameters, with domain: the first argument must be positive.
struct Forward3;

impl ppl::Differentiable<3, 3> for Forward3 {
    fn value_and_jacobian(
        &self,
        &[a, b, c]: &[f64; 3],
    ) -> Result<([f64; 3], [[f64; 3]; 3]), ppl::DomainError> {
        if a <= 0.0 {
            return Err(ppl::DomainError::new(format!("a must be positive, got {a}")));
        }
        let value = [a * b, a.ln() + c, b * c * c];
        let jacobian = [[b, a, 0.0], [1.0 / a, 0.0, 1.0], [0.0, c * c, 2.0 * b * c]];
        Ok((value, jacobian))
    }
}

ppl::model! {
    /// The shape of the paper's calibration.
    pub fn calibration(forward: &Forward3, qois: &[[f64; 3]]) {
        let young     ~ Uniform(2.5, 3.0);
        let toughness ~ Uniform(0.1, 0.5);
        let viscosity ~ Uniform(0.5, 1.5);

        let sd   ~ Normal(0.15, 0.25).truncate(0.0..).array::<3>();
        let corr ~ LkjCholesky::<3>(3.0);
        let chol = corr.scale_rows(sd);

        #[track] let mean = forward.at([young, toughness, viscosity]);
        for y in qois {
            y ~ MvNormalCholesky(mean, chol);
        }
        #[predict] let new_specimen ~ MvNormalCholesky(mean, chol);
    }
}

#[test]
fn calibration_layout() {
    let qois = [[1.0, 2.0, 0.5], [1.1, 1.9, 0.4]];
    let model = calibration(&Forward3, &qois);
    assert_eq!(model.layout().unwrap().dim, 9);
}
