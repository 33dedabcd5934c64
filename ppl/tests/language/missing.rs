//! Missing data: `place.impute() ~ D`.

use ppl::prelude::*;
use ppl::{Role, Workspace, check};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

ppl::model! {
    /// A normal mean with missing data.
    fn mean(ys: &[Option<f64>]) {
        let mu ~ Normal(0.0, 10.0);
        for i in 0..ys.len() {
            ys[i].impute() ~ Normal(mu, 2.0);
        }
    }

    /// A regression with missing covariates, whose completed values later statements use.
    fn regression(x: &[Option<f64>], y: &[f64]) {
        let slope ~ Normal(0.0, 1.0);
        #[dims(row = ["a", "b", "c"])]
        for (x, y) in x.iter().zip(y) {
            x.impute() ~ Normal(1.0, 0.5);
            y ~ Normal(slope * x, 0.2);
        }
    }

    /// A vector that is missing or observed as a whole, and a single datum without a plate.
    fn whole(point: Option<[f64; 2]>, level: Option<f64>) {
        point.impute() ~ Normal(0.0, 1.0).array::<2>();
        level.impute() ~ Normal(point[0] + point[1], 1.0);
    }
}

const HOLES: [Option<f64>; 5] = [Some(1.0), None, Some(3.0), Some(2.5), None];

#[test]
fn missing_values_are_unknowns_of_their_own_name() {
    let layout = mean(&HOLES).layout().unwrap().clone();
    let found: Vec<_> =
        layout.variables.iter().map(|v| (v.name.as_str(), v.shape.as_slice(), v.role)).collect();
    assert_eq!(
        found,
        [
            ("mu", &[][..], Role::Parameter),
            ("ys", &[3], Role::Observed),
            ("ys.missing", &[2], Role::Parameter),
        ]
    );
    // the labels of the observed and of the missing entries
    assert_eq!(layout.coordinates["ys_dim_0"], ["0", "2", "3"]);
    assert_eq!(layout.coordinates["ys.missing_dim_0"], ["1", "4"]);
    let layout = regression(&[None, Some(0.4), None], &[1.0, 0.2, 0.7]).layout().unwrap().clone();
    assert_eq!(layout.coordinates["x.missing_dim_0"], ["a", "c"]);
    assert_eq!(layout.variables.iter().find(|v| v.name == "y").unwrap().dims, ["row"]);

    let layout = whole(None, Some(1.0)).layout().unwrap().clone();
    let found: Vec<_> = layout.variables.iter().map(|v| (v.name.as_str(), &v.shape[..])).collect();
    assert_eq!(found, [("point.missing", &[2][..]), ("level", &[])]);
    assert!(layout.coordinates.is_empty());
}

/// Missing values with the same normal distribution carry no information on μ, and their posterior is the posterior
/// predictive distribution.
#[test]
fn the_posterior_is_that_of_the_data_there_are() {
    let posterior = Nuts::default().seed(11).sample(&mean(&HOLES)).unwrap();
    let precision = 3.0 / 4.0 + 0.01;
    let centre = (6.5 / 4.0) / precision;
    check::mean(&posterior, "mu", centre).within_mcse(4.0);
    check::sd(&posterior, "mu", precision.powf(-0.5)).within_mcse(4.0);
    check::mean(&posterior, "ys.missing[1]", centre).within_mcse(4.0);
    check::sd(&posterior, "ys.missing[1]", (4.0 + 1.0 / precision).sqrt()).within_mcse(4.0);
    assert_eq!(posterior.loo().unwrap().points.len(), 3, "only data are left out");
}

#[test]
fn density_in_closed_form() {
    let model = regression(&[None, Some(0.4), None], &[1.0, 0.2, 0.7]);
    let ln_normal = |x: f64, m: f64, s: f64| Normal(m, s).ln_density(&x);
    let (slope, a, c) = (0.8, 1.1, 0.9);
    let mut expected = ln_normal(slope, 0.0, 1.0);
    for (x, y) in [(a, 1.0), (0.4, 0.2), (c, 0.7)] {
        expected += ln_normal(x, 1.0, 0.5) + ln_normal(y, slope * x, 0.2);
    }
    let point = [slope, a, c];
    let (mut w, mut reverse, mut forward) = (Workspace::default(), [0.0; 3], [0.0; 3]);
    let found = model.gradient(&point, &mut reverse, &mut w).unwrap();
    approx::assert_relative_eq!(found, expected, max_relative = 1e-13);
    model.forward_gradient(&point, &mut forward).unwrap();
    for (r, f) in reverse.iter().zip(forward) {
        approx::assert_relative_eq!(*r, f, max_relative = 1e-12);
    }
    // ∂/∂a: contributions of the density of `a`, and of the regression on `a`
    let by_hand = -(a - 1.0) / 0.25 + slope * (1.0 - slope * a) / 0.04;
    approx::assert_relative_eq!(reverse[1], by_hand, max_relative = 1e-12);

    let record = model.constrain(&point, &mut Xoshiro256PlusPlus::seed_from_u64(1)).unwrap();
    assert_eq!(record.values("x.missing").unwrap(), [a, c]);
    assert_eq!(record.values("x").unwrap(), [0.4]);
    assert_eq!(record.get("x").unwrap().log_likelihood, [ln_normal(0.4, 1.0, 0.5)]);
}
