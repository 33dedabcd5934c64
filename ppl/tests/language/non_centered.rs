//! The non-centred form is the same distribution in other coordinates.

use ppl::prelude::*;
use ppl::{Bound, Joined, LocationScale, Model, Workspace, check};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

ppl::model! {
    fn centred(ys: &[f64; 3]) {
        let mu ~ Normal(0.0, 2.0);
        let tau ~ LogNormal(0.0, 0.5);
        let theta ~ Normal(mu, tau).array::<3>();
        let heavy ~ StudentT(4.0 + tau, mu, tau).iid(2);
        let skew ~ LogNormal(mu, tau);
        let pair ~ MvNormalCholesky([mu, 1.0 * tau], spread(tau));
        for j in 0..3 {
            ys[j] ~ Normal(theta[j] + heavy[0] * pair[1], 1.0 + skew);
        }
    }

    fn moved(ys: &[f64; 3]) {
        let mu ~ Normal(0.0, 2.0);
        let tau ~ LogNormal(0.0, 0.5);
        let theta ~ Normal(mu, tau).non_centered().array::<3>();
        let heavy ~ StudentT(4.0 + tau, mu, tau).non_centered().iid(2);
        let skew ~ LogNormal(mu, tau).non_centered();
        let pair ~ MvNormalCholesky([mu, 1.0 * tau], spread(tau)).non_centered();
        for j in 0..3 {
            ys[j] ~ Normal(theta[j] + heavy[0] * pair[1], 1.0 + skew);
        }
    }

    fn schools(effects: &[f64; 8], errors: &[f64; 8], centred: bool) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfNormal(10.0);
        let theta = if centred {
            let near ~ Normal(mu, tau).array::<8>();
            near
        } else {
            let far ~ Normal(mu, tau).non_centered().array::<8>();
            far
        };
        #[track] let first = theta[0];
        for j in 0..8 {
            effects[j] ~ Normal(theta[j], errors[j]);
        }
    }
}

fn spread<R: Scalar>(tau: R) -> CholeskyFactor<R, 2> {
    let zero = R::from(0.0);
    CholeskyFactor::new([[tau, zero], [tau * 0.3, R::from(2.0)]]).expect("a positive diagonal")
}

const YS: [f64; 3] = [0.4, -1.0, 2.0];

/// Densities at the same values: log p(z) = log p(x) + log |dx/dz|, where the Jacobian is computed by hand.
#[test]
fn densities_differ_by_the_change_of_variables() {
    let (centred, moved) = (centred(&YS), moved(&YS));
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    let mut w = Workspace::default();
    for _ in 0..20 {
        let x = centred.draw_prior(&mut rng).unwrap();
        let at = |name: &str| x.values(name).unwrap();
        let (mu, tau) = (at("mu")[0], at("tau")[0]);
        let mut z = vec![mu, tau.ln()];
        z.extend(at("theta").iter().chain(at("heavy")).map(|x| (x - mu) / tau));
        z.push((at("skew")[0].ln() - mu) / tau);
        let first = (at("pair")[0] - mu) / tau;
        z.extend([first, (at("pair")[1] - tau - 0.3 * tau * first) / 2.0]);

        // named values are the same in both forms
        let there = moved.constrain(&z, &mut rng).unwrap();
        for (a, b) in x.entries.iter().zip(&there.entries) {
            assert_eq!(a.variable, b.variable);
            for (a, b) in a.values.iter().zip(&b.values) {
                approx::assert_relative_eq!(*a, *b, max_relative = 1e-9);
            }
        }
        for (a, b) in there.unconstrained.iter().zip(&z) {
            approx::assert_relative_eq!(*a, *b, max_relative = 1e-9, epsilon = 1e-12);
        }
        // the Jacobian: five numbers and one logarithm scaled by τ, and a pair scaled by τ and 2
        let jacobian = 7.0 * tau.ln() + 2.0f64.ln();
        let over_x = centred.log_density(&x.unconstrained, &mut w).unwrap();
        let over_z = moved.log_density(&z, &mut w).unwrap();
        approx::assert_relative_eq!(over_z, over_x + jacobian, max_relative = 1e-10);
        // without Jacobians the two densities of the values are equal
        approx::assert_relative_eq!(
            moved.log_density_without_jacobian(&z, &mut w).unwrap(),
            centred.log_density_without_jacobian(&x.unconstrained, &mut w).unwrap(),
            max_relative = 1e-10
        );
    }
}

/// Tape and dual numbers agree.
#[test]
fn gradients() {
    let model = moved(&YS);
    check::gradient(&model, 3);
    let (mut w, mut reverse, mut forward) = (Workspace::default(), [0.0; 10], [0.0; 10]);
    let y: Vec<f64> = (0..10).map(|i| 0.3 * f64::from(i % 5) - 0.5).collect();
    model.gradient(&y, &mut reverse, &mut w).unwrap();
    model.forward_gradient(&y, &mut forward).unwrap();
    for (r, f) in reverse.iter().zip(forward) {
        approx::assert_relative_eq!(*r, f, max_relative = 1e-11);
    }
}

/// The density of a coordinate does not depend on location and scale, even where x − μ has lost all digits.
#[test]
fn far_locations_keep_the_digits_of_the_coordinates() {
    let far = Normal(1e12, 1e-6).non_centered();
    let (_, term) = Joined::with(|terms| far.constrain(&mut || 0.7, true, terms));
    assert_eq!(term, Normal(0.0, 1.0).ln_density(&0.7));
    let x: f64 = Normal(3.0, 2.0).stretch(&0.5);
    assert_eq!(x, 4.0);
}

fn sample(model: &Bound<impl Model>) -> ppl::Posterior {
    Nuts::default()
        .chains(4)
        .warmup(800)
        .draws(1500)
        .target_accept(0.95)
        .seed(5)
        .sample(model)
        .unwrap()
}

/// With measurement errors small relative to τ both forms sample well, and have the same posterior.
#[test]
fn posteriors_of_both_forms_agree() {
    let effects = [28.0, 8.0, -3.0, 7.0, -1.0, 1.0, 18.0, 12.0];
    let errors = [4.0; 8];
    let (near, far) =
        (sample(&schools(&effects, &errors, true)), sample(&schools(&effects, &errors, false)));
    let (near, far) = (near.summary(), far.summary());
    for name in ["mu", "tau", "first"] {
        let (a, b) = (near.row(name).unwrap(), far.row(name).unwrap());
        let error = a.mcse_mean.hypot(b.mcse_mean);
        assert!(
            (a.mean - b.mean).abs() < 4.0 * error,
            "{name}: {} and {} ± {error}",
            a.mean,
            b.mean
        );
        // the logarithm of the sd, whose standard error is about 1/√(2 ESS)
        let error = (0.5 / a.ess_bulk + 0.5 / b.ess_bulk).sqrt();
        assert!((a.sd / b.sd).ln().abs() < 5.0 * error, "{name}: {} and {}", a.sd, b.sd);
    }
}
