//! Compares the likelihood of specimens with the joint normal density of all their quantities.

use ppl::Nuts;
use ppl::prelude::*;
use surrogate::{DynPce, Input};

use super::given_others::{ln_conditionals, new_specimen};
use super::likelihood::{ln_density_of, of_specimens};
use super::population::Population;
use super::specimens::Specimens;
use super::{Evidence, calibrate, relative_to_means};
use crate::prior::Prior;

const QOIS: [[f64; 2]; 4] = [[1.02, 0.97], [0.98, 1.05], [1.05, 1.01], [0.95, 0.96]];
const FACTOR: [[f64; 2]; 2] = [[0.05, 0.0], [0.02, 0.04]];
const SHARED: [[f64; 2]; 2] = [[9e-4, 2e-4], [2e-4, 4e-4]];
/// θ of the forward model below.
const THETA: f64 = 1.3;

fn specimens() -> Specimens {
    specimens_of(&QOIS)
}

fn specimens_of(qois: &[[f64; 2]; 4]) -> Specimens {
    let rows: Vec<Vec<f64>> = qois.map(Vec::from).to_vec();
    Specimens::new(&rows).unwrap().sharing(SHARED.map(Vec::from).to_vec()).unwrap()
}

/// Returns `QOIS` without the quantities at the given specimens and columns.
fn without<const N: usize>(missing: [(usize, usize); N]) -> [[f64; 2]; 4] {
    let mut qois = QOIS;
    missing.iter().for_each(|&(k, m)| qois[k][m] = f64::NAN);
    qois
}

/// Four sets of rows with missing quantities: in one row, in one row for each quantity, and (twice) in all rows but
/// one.
fn incomplete() -> [[[f64; 2]; 4]; 4] {
    [
        without([(1, 0)]),
        without([(0, 1), (2, 0)]),
        without([(0, 1), (1, 1), (3, 1)]),
        without([(0, 0), (1, 0), (2, 1), (3, 1)]),
    ]
}

fn scatter() -> DynCholeskyFactor<f64> {
    DynCholeskyFactor::new(&FACTOR.map(Vec::from)).unwrap()
}

fn members() -> Vec<Vec<f64>> {
    [0.8, 0.95, 1.05, 0.9, 1.1, 1.0].map(|k| vec![k]).to_vec()
}

/// Forward model with two quantities that depend on θ and, if `with_k` is set, linearly on k.
fn forward(with_k: bool) -> DynPce {
    let names = if with_k { &["theta", "k"][..] } else { &["theta"] };
    let inputs = names.iter().map(|name| Input::new(*name, 0.0, 2.0).unwrap()).collect();
    let index = |a: u8, b: u8| if with_k { vec![a, b] } else { vec![a] };
    let mut terms = vec![(index(0, 0), vec![1.0, 1.1]), (index(1, 0), vec![0.2, -0.1])];
    if with_k {
        terms.extend([(vec![0, 1], vec![0.3, 0.05]), (vec![1, 1], vec![0.02, 0.04])]);
    }
    DynPce::from_terms(inputs, vec!["a".into(), "b".into()], terms).unwrap()
}

/// Means and covariance of the rows of specimens. The covariance between two specimens is S, plus s²/N b bᵀ if k is
/// unknown. The covariance of one specimen is the covariance between two specimens plus Σ, and plus s² b bᵀ if k is
/// unknown. Here b is the derivative of the response with respect to k; for the other symbols see `specimens.rs` and
/// `population.rs`.
struct Joint {
    means: Vec<Vec<f64>>,
    covariance: Vec<Vec<f64>>,
}

impl Joint {
    /// Joint distribution of `n` specimens without inputs other than θ.
    fn alike(n: usize) -> Self {
        let mean = forward(false).value(&[THETA]).unwrap();
        Self::of(vec![mean; n], &vec![None; n])
    }

    fn knowing(known: &[Option<f64>]) -> Self {
        let (pce, k) = (forward(true), members().concat());
        let n = k.len() as f64;
        let mean = k.iter().sum::<f64>() / n;
        let variance = k.iter().map(|k| (k - mean).powi(2)).sum::<f64>() / (n - 3.0);
        let at = |k: f64| pce.value(&[THETA, k]).unwrap();
        let slope: Vec<f64> = at(1.5).iter().zip(at(0.5)).map(|(a, b)| a - b).collect();
        let means = known.iter().map(|k| at(k.unwrap_or(mean))).collect();
        let unknown: Vec<Option<(Vec<f64>, [f64; 2])>> = known
            .iter()
            .map(|k| k.is_none().then(|| (slope.clone(), [variance, variance / n])))
            .collect();
        Self::of(means, &unknown)
    }

    fn of(means: Vec<Vec<f64>>, unknown: &[Option<(Vec<f64>, [f64; 2])>]) -> Self {
        let sigma = scatter().covariance();
        let entry = |a: usize, b: usize| {
            let (g, h, i, j) = (a / 2, b / 2, a % 2, b % 2);
            let mut entry = SHARED[i][j] + if g == h { sigma[i][j] } else { 0.0 };
            if let (Some((slope, [own, common])), Some(_)) = (&unknown[g], &unknown[h]) {
                entry += slope[i] * slope[j] * (common + if g == h { *own } else { 0.0 });
            }
            entry
        };
        let size = 2 * means.len();
        let covariance = (0..size).map(|a| (0..size).map(|b| entry(a, b)).collect()).collect();
        Self { means, covariance }
    }

    /// Log density of the recorded quantities (entries of `rows` that are not NaN) of the `chosen` specimens: the marginal
    /// distribution of these quantities in the joint normal distribution of all quantities.
    fn ln_density(&self, rows: &[Vec<f64>], chosen: &[usize]) -> f64 {
        let all = chosen.iter().flat_map(|&k| [2 * k, 2 * k + 1]);
        let places: Vec<usize> = all.filter(|&a| !rows[a / 2][a % 2].is_nan()).collect();
        let part = |a: &usize| places.iter().map(|&b| self.covariance[*a][b]).collect();
        let covariance: Vec<Vec<f64>> = places.iter().map(part).collect();
        let factor = DynCholeskyFactor::of_covariance(&covariance).unwrap();
        let mean: Vec<f64> = places.iter().map(|&a| self.means[a / 2][a % 2]).collect();
        let x: Vec<f64> = places.iter().map(|&a| rows[a / 2][a % 2]).collect();
        MvNormalCholesky(mean, factor).ln_density(&x)
    }
}

/// Checks the density of contrasts and totals, the density of one more specimen, and the density of each specimen
/// given the other specimens.
fn assert_density_of(
    specimens: &Specimens,
    qois: &[[f64; 2]; 4],
    pce: &DynPce,
    known: Option<&[Option<f64>]>,
) {
    let mut rows: Vec<Vec<f64>> = qois.map(Vec::from).to_vec();
    let all: Vec<usize> = (0..rows.len()).collect();
    let joint = known.map_or_else(|| Joint::alike(rows.len()), Joint::knowing);
    let expected = specimens.expected(pce, &[THETA]).unwrap();
    let found = ln_density_of(specimens, &expected, &scatter()).unwrap();
    let whole = joint.ln_density(&rows, &all);
    assert!((found - whole).abs() < 1e-10, "{found} {whole}");

    let conditionals = ln_conditionals(specimens, &expected, &scatter()).unwrap();
    assert_eq!(conditionals.len(), rows.len());
    for (k, found) in conditionals.iter().enumerate() {
        let others: Vec<usize> = all.iter().copied().filter(|&i| i != k).collect();
        let exact = whole - joint.ln_density(&rows, &others);
        assert!((found - exact).abs() < 1e-10, "{k}: {found} {exact}");
    }

    // if all inputs are known, there is no population for a new specimen, and its density is not tested
    if known.is_some_and(|known| !known.contains(&None)) {
        return;
    }
    let more = known.map(|known| [known, &[None]].concat());
    let joint = more.map_or_else(|| Joint::alike(rows.len() + 1), |more| Joint::knowing(&more));
    let new = vec![1.03, 0.98];
    rows.push(new.clone());
    let found = new_specimen(specimens, &expected, &scatter()).unwrap().ln_density(&new);
    let exact = joint.ln_density(&rows, &[&all[..], &[4]].concat()) - whole;
    assert!((found - exact).abs() < 1e-10, "{found} {exact}");
}

#[test]
fn contrasts_and_totals_have_the_density_of_all_rows_at_once() {
    assert_density_of(&specimens(), &QOIS, &forward(false), None);
    for qois in incomplete() {
        assert_density_of(&specimens_of(&qois), &qois, &forward(false), None);
    }
}

/// The statements of the model have the log density of [`ln_density_of`], for specimens with all quantities and for
/// specimens without some quantities.
#[test]
fn statements_of_the_model_have_the_density() {
    use ppl::Workspace;
    ppl::model! {
        fn fixed(forward: &DynPce, specimens: &Specimens, scatter: &[Vec<f64>]) {
            let theta ~ Uniform(0.0, 2.0);
            let rows: Vec<Vec<Real>> =
                scatter.iter().map(|row| row.iter().map(|&x| Real::from(x)).collect()).collect();
            let scatter = DynCholeskyFactor::new(&rows)?;
            let expected = specimens.expected(forward, &[theta])?;
            let data ~ of_specimens(specimens, &expected, &scatter);
        }
    }
    let factor = FACTOR.map(Vec::from).to_vec();
    let pce = forward(false);
    for qois in [[QOIS].as_slice(), &incomplete()].concat() {
        let specimens = specimens_of(&qois);
        let model = fixed(&pce, &specimens, &factor);
        let at =
            |x: f64| model.log_density_without_jacobian(&[x], &mut Workspace::default()).unwrap();
        let exact = |theta: f64| {
            let expected = specimens.expected(&pce, &[theta]).unwrap();
            ln_density_of(&specimens, &expected, &scatter()).unwrap()
        };
        // the density of the uniform prior cancels in the difference
        let theta = |x: f64| 2.0 / (1.0 + (-x).exp());
        let found = at(0.7) - at(-0.2);
        let expected = exact(theta(0.7)) - exact(theta(-0.2));
        assert!((found - expected).abs() < 1e-10, "{found} {expected}");
    }
}

/// The inputs of all, some, one or no specimens are known. If the model is linear and the unknown input is normal, the
/// marginal density of the quantities is normal.
#[test]
fn what_is_known_of_some_specimens_moves_their_means_and_what_is_not_widens_the_others() {
    let k = [0.9, 1.2, 1.0, 0.7].map(Some);
    for known in
        [k, [k[0], None, k[2], None], [None, None, k[2], None], [k[0], k[1], k[2], None], [None; 4]]
    {
        for qois in [[QOIS].as_slice(), &incomplete()].concat() {
            let inputs = known.map(|k| k.map(|k| vec![k]));
            let population = Population::of(&members()).unwrap();
            let specimens = specimens_of(&qois).knowing(&inputs, Some(population)).unwrap();
            assert_eq!(specimens.known_inputs(), 1);
            assert_density_of(&specimens, &qois, &forward(true), Some(&known));
            let (expected, joint) =
                (specimens.expected(&forward(true), &[THETA]).unwrap(), Joint::knowing(&known));
            for (i, mean) in specimens.mean(&expected).iter().enumerate() {
                let exact = joint.means.iter().map(|mean| mean[i]).sum::<f64>() / 4.0;
                assert!((mean - exact).abs() < 1e-12, "{mean} {exact}");
            }
        }
    }
}

#[test]
fn two_specimens_of_which_one_is_left() {
    let rows: Vec<Vec<f64>> = QOIS[..2].iter().map(|row| row.to_vec()).collect();
    let two = Specimens::new(&rows).unwrap().sharing(SHARED.map(Vec::from).to_vec()).unwrap();
    let expected = two.expected(&forward(false), &[THETA]).unwrap();
    let found = ln_conditionals(&two, &expected, &scatter()).unwrap();
    let joint = Joint::alike(2);
    let exact = joint.ln_density(&rows, &[0, 1]) - joint.ln_density(&rows, &[1]);
    assert!((found[0] - exact).abs() < 1e-10, "{} {exact}", found[0]);
}

#[test]
fn without_a_shared_error_specimens_are_independent() {
    let rows: Vec<Vec<f64>> = QOIS.map(Vec::from).to_vec();
    let specimens = Specimens::new(&rows).unwrap();
    let expected = specimens.expected(&forward(false), &[THETA]).unwrap();
    let found = ln_conditionals(&specimens, &expected, &scatter()).unwrap();
    let mean = forward(false).value(&[THETA]).unwrap();
    for (row, found) in rows.iter().zip(found) {
        let exact = MvNormalCholesky(mean.clone(), scatter()).ln_density(row);
        assert!((found - exact).abs() < 1e-10, "{found} {exact}");
    }
}

/// Compares S(θ) = S + s² h(θ), at the mean of the known inputs, with an independent computation, and the derivative of
/// S(θ) with a difference quotient.
#[test]
fn what_runs_leave_open_is_shared_where_the_parameters_are() {
    use surrogate::{Dataset, FitOptions, OrderRule};
    let inputs = ["theta", "k"].map(|name| Input::new(name, 0.0, 2.0).unwrap()).to_vec();
    let mut runs = Dataset::new(inputs, vec!["a".into(), "b".into()], "").unwrap();
    for i in 0..9 {
        let (x, k) = (0.25 * f64::from(i), f64::from(i * i % 5) * 0.5);
        runs.push(&[x, k], &[x + 0.1 * k * k, 1.0 + x * k - 0.3 * x * x]).unwrap();
    }
    let options = FitOptions { rule: OrderRule::Fixed(1), ..FitOptions::default() };
    let open = DynPce::fit(&runs, &options).unwrap().coefficients;
    let scatter = vec![vec![4e-4, 1e-4], vec![1e-4, 3e-4]];
    let known = [0.9, 1.2, 1.0, 0.7].map(|k| Some(vec![k]));
    let wrong = specimens().leaving_open(open.clone(), vec![vec![0.0]; 2]);
    assert!(wrong.is_err());
    let specimens = specimens()
        .knowing(&known, None)
        .unwrap()
        .leaving_open(open.clone(), scatter.clone())
        .unwrap();
    let shared_at = |theta: f64| specimens.shared_at(&[theta]).unwrap();
    let h = open.leverage(&[1.3, 0.95]).unwrap();
    for (i, row) in shared_at(1.3).iter().enumerate() {
        for (j, found) in row.iter().enumerate() {
            let expected = SHARED[i][j] + h * scatter[i][j];
            assert!((found - expected).abs() < 1e-15, "{found} {expected}");
        }
    }
    let dual = ppl::Dual::variables([1.3]);
    let slope = specimens.shared_at(&dual).unwrap()[1][0].gradient()[0];
    let difference = (shared_at(1.3 + 1e-5)[1][0] - shared_at(1.3 - 1e-5)[1][0]) / 2e-5;
    assert!((slope / difference - 1.0).abs() < 1e-6, "{slope} {difference}");
    assert!(
        shared_at(0.1)[0][0] > shared_at(1.0)[0][0],
        "the error is larger at the ends of the box"
    );
}

/// A group may have a single specimen if other groups determine the covariance.
#[test]
fn one_specimen_alone_has_the_density_of_itself() {
    let one = Specimens::new(&[QOIS[0].to_vec()]).unwrap();
    let one = one.sharing(SHARED.map(Vec::from).to_vec()).unwrap();
    let found =
        ln_conditionals(&one, &one.expected(&forward(false), &[THETA]).unwrap(), &scatter())
            .unwrap();
    let exact = Joint::alike(1).ln_density(&[QOIS[0].to_vec()], &[0]);
    assert!((found[0] - exact).abs() < 1e-10, "{} {exact}", found[0]);
}

#[test]
fn sizes_that_do_not_fit_are_refused() {
    assert!(Specimens::new(&[]).is_err());
    assert!(Specimens::new(&[vec![1.0], vec![1.0, 2.0]]).is_err());
    let error = Specimens::new(&[vec![1.0, 2.0], vec![f64::NAN; 2]]).unwrap_err();
    assert!(error.to_string().starts_with("specimen 2"), "{error}");
    let qois = vec![vec![1.0, f64::NAN], vec![1.1, f64::NAN]];
    let evidence = Evidence { qois, ..Evidence::default() };
    let error = relative_to_means(&forward(false), &evidence).unwrap_err();
    assert!(error.to_string().ends_with("quantity of interest b"), "{error}");
    assert!(specimens().sharing(vec![vec![0.0; 2]]).is_err());
    assert!(specimens().sharing(vec![vec![0.0]; 2]).is_err());
    let one = || Some(vec![1.0]);
    let population = || Population::of(&members()).ok();
    assert!(specimens().knowing(&vec![one(); 3], None).is_err());
    assert!(specimens().knowing(&[one(), Some(vec![]), one(), one()], None).is_err());
    assert!(specimens().knowing(&[one(), None, one(), one()], None).is_err());
    assert!(specimens().knowing(&[one(), None, one(), one()], population()).is_ok());
    let two = vec![Some(vec![1.0, 2.0]); 4];
    assert!(specimens().knowing(&two, population()).is_err());
}

ppl::model! {
    /// The calibration model in which unknown inputs are sampled variables, and known inputs are
    /// data.
    fn with_latent_inputs(
        forward: &DynPce,
        rows: &[Vec<f64>],
        known: &[Option<f64>],
        population: &Population,
        shared: &DynCholeskyFactor<f64>,
    ) {
        let input = &forward.inputs()[0];
        let theta ~ Uniform(input.lower, input.upper);
        let sd ~ Normal(0.15, 0.25).truncate(0.0..).iid(2);
        let corr ~ LkjCholesky::of(2, 3.0);
        let chol = corr.scale_rows(&sd)?;
        let delta ~ MvNormalCholesky(vec![0.0; 2], shared);
        let off ~ Normal(0.0, 1.0);
        let middle = off * (population.sd()[0] / population.count().sqrt()) + population.mean()[0];
        for (y, known) in rows.iter().zip(known) {
            let z ~ Normal(0.0, 1.0);
            let k = match known {
                Some(k) => Real::from(*k),
                None => middle + z * population.sd()[0],
            };
            let response = forward.at(&[theta, k]);
            let mean: Vec<Real> = response.iter().zip(&delta).map(|(&m, &d)| m + d).collect();
            y ~ MvNormalCholesky(mean, &chol);
        }
    }
}

/// Compares the posterior of the marginal likelihood with a posterior in which all unknown inputs are sampled.
#[test]
fn inputs_that_are_integrated_out_do_what_sampled_ones_do() {
    let qois: Vec<Vec<f64>> =
        [[1.09, 1.02], [0.90, 0.97], [1.02, 1.01], [1.12, 1.03], [0.93, 1.00], [0.94, 0.97]]
            .map(Vec::from)
            .to_vec();
    let known = [None, None, Some(1.02), Some(1.15), None, None];
    let population = Population::of(&members()).unwrap();
    let pce = forward(true);
    let shared: Vec<Vec<f64>> = SHARED.map(Vec::from).to_vec();
    let evidence = Evidence {
        qois: qois.clone(),
        known: known.iter().map(|k| k.map(|k| vec![k])).collect(),
        population: Some(population.clone()),
        shared: shared.clone(),
        ..Evidence::default()
    };
    let sampler = Nuts::default().chains(4).draws(1500).seed(5).target_accept(0.95);
    let marginal = calibrate(&pce, &Prior::uniform_on(&pce.inputs()[..1]), &evidence, &sampler, 5)
        .unwrap()
        .posterior;
    let (relative, _) = relative_to_means(&pce, &evidence).unwrap();
    let shared = DynCholeskyFactor::of_covariance(&shared).unwrap();
    let latent = with_latent_inputs(&relative, &qois, &known, &population, &shared);
    let latent = sampler.sample(&latent).unwrap();
    let moments = |trace: Vec<Vec<f64>>| {
        let chains: Vec<&[f64]> = trace.iter().map(Vec::as_slice).collect();
        let all = trace.concat();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        let sd = (all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / all.len() as f64).sqrt();
        let mcse = [ppl::diagnostics::mcse_mean(&chains), ppl::diagnostics::mcse_sd(&chains)];
        ([mean, sd], mcse)
    };
    for (ours, theirs) in [("theta[theta]", "theta"), ("sd[0]", "sd[0]"), ("sd[1]", "sd[1]")] {
        let ours = moments(marginal.trace(ours).unwrap());
        let theirs = moments(latent.trace(theirs).unwrap());
        for i in 0..2 {
            let error = ours.1[i].hypot(theirs.1[i]);
            assert!((ours.0[i] - theirs.0[i]).abs() < 4.0 * error, "{ours:?} {theirs:?}");
        }
    }
}
