//! Compares matrices whose size is known at run time with matrices whose size is known at compile time.

use ppl::prelude::*;
use ppl::{Dual, Workspace, check};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::numerics::assert_close;
use crate::vector_conformance::{Entries, assert_unknown, unknown};

ppl::model! {
    fn in_the_type(rows: &[[f64; 3]], x: &[f64]) {
        let level ~ Normal(0.0, 2.0).iid(3);
        let sd ~ Normal(0.15, 0.25).truncate(0.0..).iid(3);
        let corr ~ LkjCholesky::<3>(3.0);
        let other ~ LkjCholesky::<3>(1.6);
        let chol = corr.scale_rows([sd[0], sd[1], sd[2]]);
        for (y, x) in rows.iter().zip(x) {
            y ~ MvNormalCholesky([level[0] + x, level[1], level[2] * x], chol);
        }
        let effect ~ MvNormalCholesky([level[1], 0.5, level[0]], other);
        let (turned, solved) = (chol.times(effect), other.solve_lower(effect));
        factor(-0.1 * (turned[2] * solved[1] + chol.covariance()[2][1] + chol.correlation()[1][0]));
        factor(LkjCholesky::<3>(0.7).ln_density(&corr));
        #[predict] let new ~ MvNormalCholesky([level[0], level[1], level[2]], chol);
    }

    fn from_the_data(rows: &[Vec<f64>], x: &[f64]) {
        let k = rows[0].len();
        let level ~ Normal(0.0, 2.0).iid(k);
        let sd ~ Normal(0.15, 0.25).truncate(0.0..).iid(k);
        let corr ~ LkjCholesky::of(k, 3.0);
        let other ~ LkjCholesky::of(k, 1.6);
        let chol = corr.scale_rows(&sd)?;
        for (y, x) in rows.iter().zip(x) {
            y ~ MvNormalCholesky(vec![level[0] + x, level[1], level[2] * x], &chol);
        }
        let effect ~ MvNormalCholesky(vec![level[1], Real::from(0.5), level[0]], &other);
        let (turned, solved) = (chol.times(&effect)?, other.solve_lower(&effect)?);
        factor(-0.1 * (turned[2] * solved[1] + chol.covariance()[2][1] + chol.correlation()[1][0]));
        factor(LkjCholesky::of(k, 0.7).ln_density(&corr));
        #[predict] let new ~ MvNormalCholesky(&level, &chol);
    }
}

const ROWS: [[f64; 3]; 3] = [[0.3, -0.2, 0.9], [1.0, 0.4, -0.7], [0.1, 0.0, 0.5]];
const X: [f64; 3] = [0.5, -1.0, 2.0];

/// Compares values, gradients and all recorded quantities.
#[test]
fn one_model_in_both_forms() {
    let rows = ROWS.map(|row| row.to_vec());
    let (fixed, free) = (in_the_type(&ROWS, &X), from_the_data(&rows, &X));
    let layout = free.layout().unwrap();
    assert_eq!(layout.dim, 15);
    assert_eq!(layout.variables, fixed.layout().unwrap().variables);
    check::gradient(&free, 5);
    let (mut w, mut rng) = (Workspace::default(), Xoshiro256PlusPlus::seed_from_u64(3));
    for _ in 0..20 {
        let record = fixed.draw_prior(&mut rng).unwrap();
        let y = &record.unconstrained;
        let [mut ours, mut theirs, mut taped] = [[0.0; 15]; 3];
        let value = free.gradient(y, &mut ours, &mut w).unwrap();
        let expected = fixed.gradient(y, &mut theirs, &mut w).unwrap();
        assert_close(value, expected, 1e-12, 1e-12, "log density");
        let again = free.tape_gradient(y, &mut taped, &mut w).unwrap();
        assert_close(again, expected, 1e-12, 1e-12, "over the tape");
        let size = theirs.iter().fold(1.0f64, |size, g| size.max(g.abs()));
        for ((a, b), c) in ours.iter().zip(theirs).zip(taped) {
            assert_close(*a, b, 1e-11, 1e-11 * size, "gradient");
            assert_close(c, b, 1e-11, 1e-11 * size, "gradient over the tape");
        }
        let value = free.log_density_without_jacobian(y, &mut w).unwrap();
        let expected = fixed.log_density_without_jacobian(y, &mut w).unwrap();
        assert_close(value, expected, 1e-12, 1e-12, "over the values themselves");
        let there = free.constrain(y, &mut rng).unwrap();
        for name in ["corr", "other", "effect"] {
            for (a, b) in there.values(name).unwrap().iter().zip(record.values(name).unwrap()) {
                assert_close(*a, *b, 1e-12, 1e-12, name);
            }
        }
        for (back, y) in there.unconstrained.iter().zip(y) {
            assert_close(*back, *y, 1e-9, 1e-9, "coordinates");
        }
    }
    let drawn = free.draw_prior(&mut rng).unwrap();
    assert_eq!(drawn.values("corr").unwrap().len(), 9);
}

impl<R: Scalar> Entries<R> for DynCholeskyFactor<R> {
    fn entries(&self) -> Vec<R> {
        (0..self.size()).flat_map(|i| (0..=i).map(move |j| self.get(i, j))).collect()
    }
}

fn factor<R: Scalar>(p: &[R]) -> DynCholeskyFactor<R> {
    DynCholeskyFactor::new(&[vec![p[0]], vec![p[1], p[2]]]).unwrap()
}

unknown!(Lkj, |_p| LkjCholesky::of(3, 1.7));
unknown!(Joint, |p| MvNormalCholesky(p[..2].to_vec(), factor(&p[2..])));

/// Conformance tests: maps, Jacobians, derivatives and draws.
#[test]
fn unknowns() {
    assert_unknown("LKJ", &Lkj, &[], &[0.2, -0.5, 0.4], &[1, 3, 4]);
    assert_unknown("normal", &Joint, &[0.2, -0.1, 0.9, -0.3, 1.2], &[0.4, -0.7], &[0, 1]);
}

#[test]
fn sizes_that_do_not_fit_are_refused_in_words() {
    let factor = factor(&[1.0, 0.3, 2.0]);
    let message = |result: Result<_, ppl::DomainError>| result.unwrap_err().to_string();
    let lengths = "equal to the number of rows, 2, got 3";
    assert_eq!(
        message(factor.scale_rows(&[1.0; 3])),
        format!("DynCholeskyFactor: number of scales must be {lengths}")
    );
    assert_eq!(
        message(factor.solve_lower(&[1.0; 3]).map(|_| factor.clone())),
        format!("DynCholeskyFactor: length of b must be {lengths}")
    );
    assert_eq!(
        message(DynCholeskyFactor::new(&[vec![1.0], vec![2.0]])),
        "DynCholeskyFactor: length of row 1 must be between 2 and 2, got 1"
    );
    assert_eq!(
        message(DynCholeskyFactor::new(&[vec![1.0, 0.5], vec![2.0, 1.0]])),
        "DynCholeskyFactor: entry (0, 1) above the diagonal must be zero, got 0.5"
    );
    let joint = MvNormalCholesky(vec![0.0; 3], &factor);
    let error = Distribution::<f64>::validate(&joint).unwrap_err();
    assert_eq!((error.distribution, error.value), ("MvNormalCholesky", 3.0));
    let misfit: f64 = MvNormalCholesky(vec![0.0; 2], &factor).ln_density(&vec![0.1; 3]);
    assert_eq!(misfit, f64::NEG_INFINITY);
    let other: Dual<1> =
        LkjCholesky::of(3, 1.0).ln_density(&DynCholeskyFactor::new(&[vec![1.0.into()]]).unwrap());
    assert_eq!(other.value(), f64::NEG_INFINITY);
}

/// Checks that L Lᵀ is the original matrix, with derivatives, and that a matrix that is not positive definite is
/// rejected.
#[test]
fn factors_of_covariance_matrices() {
    let entries = Dual::<3>::variables([2.5, -0.4, 1.2]);
    let [a, b, c] = entries;
    let factor = DynCholeskyFactor::of_covariance(&[vec![a], vec![b, c]]).unwrap();
    let product = factor.covariance();
    for (entry, (i, j)) in entries.iter().zip([(0, 0), (1, 0), (1, 1)]) {
        assert_close(product[i][j].value(), entry.value(), 1e-15, 0.0, "L Lᵀ");
        for (got, expected) in product[i][j].gradient().iter().zip(entry.gradient()) {
            assert_close(*got, expected, 1e-14, 1e-14, "∂ L Lᵀ");
        }
    }
    let indefinite = DynCholeskyFactor::of_covariance(&[vec![1.0], vec![2.0, 1.0]]).unwrap_err();
    let words =
        "pivot 1 of the covariance matrix must be positive and finite (equal or nearly equal rows";
    assert!(indefinite.to_string().contains(words), "{indefinite}");
    assert!(indefinite.to_string().contains("add a nugget of about"), "{indefinite}");
    assert!(indefinite.to_string().ends_with("got -3"), "{indefinite}");
    // a covariance matrix for two equal points, without and with a nugget
    let singular = |nugget| [vec![1.0 + nugget], vec![1.0, 1.0 + nugget]];
    let error = DynCholeskyFactor::of_covariance(&singular(0.0)).unwrap_err();
    assert!(error.to_string().ends_with("got 0"), "{error}");
    assert!(DynCholeskyFactor::of_covariance(&singular(1e-10)).is_ok());
    assert!(DynCholeskyFactor::of_covariance(&[vec![1.0], vec![2.0]]).is_err());
}
