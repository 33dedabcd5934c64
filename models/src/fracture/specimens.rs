//! The specimens of a calibration as their likelihood takes them: what differs between them, and
//! what they share.
//!
//! y_k = m + δ + e_k with e_k ~ N(0, Σ) for each specimen and one δ ~ N(0, S) for all: the error of
//! the forward model, which more specimens do not average away. An orthogonal transform takes the n
//! rows apart: n − 1 contrasts z_j ~ N(0, Σ), in which δ and m cancel, and √n ȳ ~ N(√n m, Σ + nS).
//! Their joint density is that of the rows with δ integrated out. S may depend on the parameters: a surrogate
//! is known best where its runs are, and its error is S(θ) = s² h(θ), the leverage h times the variance of runs.
//!
//! Where something is known of each specimen that the forward model takes, such as the stiffness of its
//! own microstructure, each has an m_k of its own: the transform of these is the mean of that of the rows.

use std::borrow::Cow;

use ppl::DomainError;
use ppl::prelude::*;
use surrogate::{CoefficientPosterior, DynPce};

use super::CalibrationError;

/// Quantities of interest of specimens, relative to their means, and the covariance of the error that
/// all share.
#[derive(Clone, Debug)]
pub struct Specimens {
    rows: Vec<Vec<f64>>,
    /// n − 1 contrasts between specimens.
    pub(super) contrasts: Vec<Vec<f64>>,
    /// The last inputs of the forward model, known of each specimen; no rows if nothing is known.
    known: Vec<Vec<f64>>,
    /// √n times their mean.
    pub(super) total: Vec<f64>,
    /// S but for what follows, quantities × quantities; zero is the paper's likelihood.
    shared: Vec<Vec<f64>>,
    /// What runs leave open of the forward model.
    open: Option<Open>,
}

/// An error of the forward model that is not the same everywhere.
#[derive(Clone, Debug)]
struct Open {
    /// Its leverage h.
    coefficients: CoefficientPosterior,
    /// Its covariance per leverage, in the same relative quantities.
    scatter: Vec<Vec<f64>>,
}

impl Specimens {
    /// Specimens without a shared error: one row each, in the order of the forward model's outputs.
    ///
    /// # Errors
    /// No specimen, or rows of different lengths.
    pub fn new(qois: &[Vec<f64>]) -> Result<Self, CalibrationError> {
        let [first, ..] = qois else { return Err(CalibrationError::TooFew(0)) };
        let expected = first.len();
        if let Some(row) = qois.iter().find(|row| row.len() != expected) {
            return Err(CalibrationError::Quantities { expected, found: row.len() });
        }
        let (contrasts, total) = helmert(qois);
        let shared = vec![vec![0.0; expected]; expected];
        let (known, open) = (Vec::new(), None);
        Ok(Self { rows: qois.to_vec(), contrasts, known, total, shared, open })
    }

    /// With what is known of each specimen: one row each, the last inputs of the forward model.
    ///
    /// # Errors
    /// Another number of rows than of specimens, or rows of different lengths.
    pub fn knowing(mut self, known: Vec<Vec<f64>>) -> Result<Self, CalibrationError> {
        let width = known.first().map_or(0, Vec::len);
        if known.len() != self.len() || known.iter().any(|row| row.len() != width) {
            return Err(CalibrationError::Known { expected: self.len(), found: known.len() });
        }
        self.known = known;
        Ok(self)
    }

    /// How many inputs of the forward model are known of each specimen.
    pub(super) fn known_inputs(&self) -> usize {
        self.known.first().map_or(0, Vec::len)
    }

    /// The mean response over the specimens at parameters `point`, and the means of the contrasts.
    pub(super) fn expected<R: Scalar>(
        &self,
        forward: &DynPce,
        point: &[R],
    ) -> (Vec<R>, Vec<Vec<R>>) {
        if self.known_inputs() == 0 {
            let mean = forward.at(point);
            let zeros = vec![R::from(0.0); mean.len()];
            return (mean, vec![zeros; self.contrasts.len()]);
        }
        let response = |known: &Vec<f64>| -> Vec<R> {
            let known = known.iter().map(|&x| R::from(x));
            forward.at(&point.iter().copied().chain(known).collect::<Vec<R>>())
        };
        let rows: Vec<Vec<R>> = self.known.iter().map(response).collect();
        let (contrasts, total) = helmert(&rows);
        let root = (self.len() as f64).sqrt();
        (total.into_iter().map(|sum| sum / root).collect(), contrasts)
    }

    /// The specimens as they would be if all had the mean response `mean` at the parameters `point`: each
    /// moved by what its own known inputs make of it.
    pub(super) fn about(
        &self,
        forward: &DynPce,
        point: &[f64],
        mean: &[f64],
    ) -> Result<Cow<'_, Self>, DomainError> {
        if self.known_inputs() == 0 {
            return Ok(Cow::Borrowed(self));
        }
        let mut rows = self.rows.clone();
        for (row, known) in rows.iter_mut().zip(&self.known) {
            let own = forward.value(&[point, known].concat())?;
            row.iter_mut().zip(own).zip(mean).for_each(|((y, own), mean)| *y += mean - own);
        }
        let (contrasts, total) = helmert(&rows);
        Ok(Cow::Owned(Self { rows, contrasts, total, known: Vec::new(), ..self.clone() }))
    }

    /// With the covariance S of the error δ that all specimens share, in the same relative quantities:
    /// of the surrogate, of the mesh, of the geometry.
    ///
    /// # Errors
    /// Another size than that of the quantities.
    pub fn sharing(mut self, covariance: Vec<Vec<f64>>) -> Result<Self, CalibrationError> {
        let expected = self.total.len();
        let wrong = |found: usize| CalibrationError::Quantities { expected, found };
        if covariance.len() != expected {
            return Err(wrong(covariance.len()));
        }
        if let Some(row) = covariance.iter().find(|row| row.len() != expected) {
            return Err(wrong(row.len()));
        }
        self.shared = covariance;
        Ok(self)
    }

    /// With what runs leave open of the forward model as a further error that all specimens share: its
    /// covariance is `scatter`, in the same relative quantities, times the leverage at the parameters.
    ///
    /// # Errors
    /// Another size than that of the quantities.
    pub fn leaving_open(
        self,
        coefficients: CoefficientPosterior,
        scatter: Vec<Vec<f64>>,
    ) -> Result<Self, CalibrationError> {
        let shared = self.shared.clone();
        // of the same size as the other
        let checked = self.sharing(scatter)?;
        let open = Some(Open { coefficients, scatter: checked.shared.clone() });
        Ok(Self { shared, open, ..checked })
    }

    /// S at parameters `point`. Inputs that are known of each specimen stand at their mean: of a response that
    /// is linear in them, that of the mean over the specimens.
    pub(super) fn shared_at<R: Scalar>(&self, point: &[R]) -> Result<Vec<Vec<R>>, DomainError> {
        let constant = |row: &Vec<f64>| row.iter().map(|&s| R::from(s)).collect();
        let mut shared: Vec<Vec<R>> = self.shared.iter().map(constant).collect();
        if let Some(Open { coefficients, scatter }) = &self.open {
            let known = column_means(&self.known).into_iter().map(R::from);
            let place: Vec<R> = point.iter().copied().chain(known).collect();
            let leverage = coefficients.try_at(&place)?[0];
            for (row, scatter) in shared.iter_mut().zip(scatter) {
                row.iter_mut().zip(scatter).for_each(|(entry, &s)| *entry = *entry + leverage * s);
            }
        }
        Ok(shared)
    }

    /// Number of specimens.
    pub fn len(&self) -> usize {
        self.contrasts.len() + 1
    }

    /// Never: there is at least one.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// The mean of √n ȳ where the forward model says `mean`.
    pub(super) fn mean_of_total<R: Scalar>(&self, mean: &[R]) -> Vec<R> {
        let root = (self.len() as f64).sqrt();
        mean.iter().map(|&m| m * root).collect()
    }

    /// The factor of Σ + nS, from that of Σ.
    pub(super) fn factor_of_total<R: Scalar>(
        &self,
        scatter: &DynCholeskyFactor<R>,
        shared: &[Vec<R>],
    ) -> Result<DynCholeskyFactor<R>, DomainError> {
        factor_of(self.len(), scatter, shared)
    }

    /// A new specimen, which shares δ with those seen.
    pub(super) fn new_specimen<R: Scalar>(
        &self,
        mean: &[R],
        scatter: &DynCholeskyFactor<R>,
        shared: &[Vec<R>],
    ) -> Result<MvNormalCholesky<Vec<R>, DynCholeskyFactor<R>>, DomainError> {
        After::new(self.len(), scatter, shared)?.specimen(mean, &self.total)
    }

    /// log p(y_k | y_−k, θ, Σ) of each specimen k given the others, with δ integrated out; the covariance
    /// is the same for all k, so that n of them cost little more than one. At the parameters `point` the
    /// specimens' mean is `mean`.
    ///
    /// # Errors
    /// A covariance that is not positive definite, parameters outside the box, or a mean of another size.
    pub fn ln_conditionals(
        &self,
        point: &[f64],
        mean: &[f64],
        scatter: &DynCholeskyFactor<f64>,
    ) -> Result<Vec<f64>, DomainError> {
        let others = self.len() - 1;
        let after = After::new(others, scatter, &self.shared_at(point)?)?;
        // without others there is nothing to divide: 0/1
        let (root, all) = ((others.max(1) as f64).sqrt(), (self.len() as f64).sqrt());
        let of = |row: &Vec<f64>| {
            let total: Vec<f64> =
                self.total.iter().zip(row).map(|(total, y)| (all * total - y) / root).collect();
            Ok(after.specimen(mean, &total)?.ln_density(row))
        };
        self.rows.iter().map(of).collect()
    }
}

/// The factor of Σ + nS for any number n of specimens.
fn factor_of<R: Scalar>(
    specimens: usize,
    scatter: &DynCholeskyFactor<R>,
    shared: &[Vec<R>],
) -> Result<DynCholeskyFactor<R>, DomainError> {
    let n = specimens as f64;
    if shared.iter().flatten().all(|s| s.value() == 0.0) {
        return Ok(scatter.clone());
    }
    let mut covariance = scatter.covariance();
    for (row, shared) in covariance.iter_mut().zip(shared) {
        row.iter_mut().zip(shared).for_each(|(entry, &s)| *entry = *entry + s * n);
    }
    DynCholeskyFactor::of_covariance(&covariance)
}

/// The distribution of a specimen after n others, but for their total.
struct After<R: Scalar> {
    /// √n
    root: f64,
    /// L
    factor: DynCholeskyFactor<R>,
    /// Those of W.
    columns: Vec<Vec<R>>,
    /// The factor of Σ + S − WᵀW.
    own: DynCholeskyFactor<R>,
}

impl<R: Scalar> After<R> {
    /// What specimens that were seen tell of one more: δ given them is N(Wᵀ w, S − WᵀW) with
    /// L Lᵀ = Σ + nS, W = √n L⁻¹ S and w = L⁻¹ (√n ȳ − √n m).
    fn new(
        seen: usize,
        scatter: &DynCholeskyFactor<R>,
        shared: &[Vec<R>],
    ) -> Result<Self, DomainError> {
        let factor = factor_of(seen, scatter, shared)?;
        let root = (seen as f64).sqrt();
        let columns = shared.iter().map(|column| {
            let column: Vec<R> = column.iter().map(|&s| s * root).collect();
            factor.solve_lower(&column)
        });
        let columns: Vec<Vec<R>> = columns.collect::<Result<_, _>>()?;
        let mut covariance = scatter.covariance();
        for (i, row) in covariance.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                *entry = *entry - dot(&columns[i], &columns[j]) + shared[i][j];
            }
        }
        let own = DynCholeskyFactor::of_covariance(&covariance)?;
        Ok(Self { root, factor, columns, own })
    }

    /// One more specimen where the forward model says `mean` and the others' √n ȳ is `total`.
    fn specimen(
        &self,
        mean: &[R],
        total: &[f64],
    ) -> Result<MvNormalCholesky<Vec<R>, DynCholeskyFactor<R>>, DomainError> {
        let gap: Vec<R> = total.iter().zip(mean).map(|(&y, &m)| -(m * self.root - y)).collect();
        let whitened = self.factor.solve_lower(&gap)?;
        let shifted: Vec<R> =
            mean.iter().zip(&self.columns).map(|(&m, column)| m + dot(column, &whitened)).collect();
        Ok(MvNormalCholesky(shifted, self.own.clone()))
    }
}

fn dot<R: Scalar>(a: &[R], b: &[R]) -> R {
    a.iter().zip(b).map(|(&a, &b)| a * b).sum()
}

/// The mean of every column of rows of one length; nothing of no rows.
pub(crate) fn column_means(rows: &[Vec<f64>]) -> Vec<f64> {
    let columns = rows.first().map_or(0, Vec::len);
    let mean = |m: usize| rows.iter().map(|row| row[m]).sum::<f64>() / rows.len() as f64;
    (0..columns).map(mean).collect()
}

/// Helmert's orthogonal transform of rows: contrasts √(j/(j+1)) (mean of the first j − row j + 1), and
/// √n times the mean.
fn helmert<R: Scalar>(rows: &[Vec<R>]) -> (Vec<Vec<R>>, Vec<R>) {
    let mut mean = rows[0].clone();
    let mut contrasts = Vec::with_capacity(rows.len() - 1);
    for (j, row) in (1..).zip(&rows[1..]) {
        let j = f64::from(j);
        let weight = (j / (j + 1.0)).sqrt();
        contrasts.push(mean.iter().zip(row).map(|(&m, &x)| (m - x) * weight).collect());
        mean.iter_mut().zip(row).for_each(|(m, &x)| *m = *m + (x - *m) / (j + 1.0));
    }
    let root = (rows.len() as f64).sqrt();
    (contrasts, mean.iter().map(|&m| m * root).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const QOIS: [[f64; 2]; 4] = [[1.02, 0.97], [0.98, 1.05], [1.05, 1.01], [0.95, 0.96]];
    const FACTOR: [[f64; 2]; 2] = [[0.05, 0.0], [0.02, 0.04]];
    const SHARED: [[f64; 2]; 2] = [[9e-4, 2e-4], [2e-4, 4e-4]];
    const MEAN: [f64; 2] = [1.01, 0.99];

    fn specimens() -> Specimens {
        let rows: Vec<Vec<f64>> = QOIS.map(Vec::from).to_vec();
        Specimens::new(&rows).unwrap().sharing(SHARED.map(Vec::from).to_vec()).unwrap()
    }

    fn scatter() -> DynCholeskyFactor<f64> {
        DynCholeskyFactor::new(&FACTOR.map(Vec::from)).unwrap()
    }

    /// Rows of several specimens as one normal vector: Σ on the diagonal, S everywhere.
    fn joint(n: usize) -> (Vec<f64>, Vec<Vec<f64>>) {
        let sigma = scatter().covariance();
        let entry = |a: usize, b: usize| {
            let own = if a / 2 == b / 2 { sigma[a % 2][b % 2] } else { 0.0 };
            own + SHARED[a % 2][b % 2]
        };
        let size = 2 * n;
        let mean = (0..size).map(|a| MEAN[a % 2]).collect();
        (mean, (0..size).map(|a| (0..size).map(|b| entry(a, b)).collect()).collect())
    }

    fn ln_density(n: usize, x: &[f64]) -> f64 {
        let (mean, covariance) = joint(n);
        let factor = DynCholeskyFactor::of_covariance(&covariance).unwrap();
        MvNormalCholesky(mean, factor).ln_density(&x.to_vec())
    }

    #[test]
    fn contrasts_and_total_have_the_density_of_all_rows_at_once() {
        let specimens = specimens();
        let contrast = MvNormalCholesky(vec![0.0; 2], scatter());
        let apart: f64 = specimens.contrasts.iter().map(|z| contrast.ln_density(z)).sum();
        let shared = specimens.shared_at(&[1.3_f64]).unwrap();
        let factor = specimens.factor_of_total(&scatter(), &shared).unwrap();
        let total = MvNormalCholesky(specimens.mean_of_total(&MEAN), factor);
        let found = apart + total.ln_density(&specimens.total);
        let expected = ln_density(4, &QOIS.concat());
        assert!((found - expected).abs() < 1e-11, "{found} {expected}");
    }

    #[test]
    fn a_new_specimen_has_the_conditional_density_of_the_joint_one() {
        let specimens = specimens();
        let new = [1.03, 0.98];
        let found = specimens
            .new_specimen(&MEAN, &scatter(), &SHARED.map(Vec::from))
            .unwrap()
            .ln_density(&new.to_vec());
        let all = [QOIS.concat(), new.to_vec()].concat();
        let expected = ln_density(5, &all) - ln_density(4, &QOIS.concat());
        assert!((found - expected).abs() < 1e-11, "{found} {expected}");
    }

    /// Rows with means of their own, as a forward model with one parameter and one known input gives them.
    #[test]
    fn what_is_known_of_each_specimen_moves_its_own_mean() {
        use surrogate::Input;
        let inputs = ["theta", "k"].map(|name| Input::new(name, 0.0, 2.0).unwrap()).to_vec();
        let terms = [
            (vec![0, 0], vec![1.0, 1.1]),
            (vec![1, 0], vec![0.2, -0.1]),
            (vec![0, 1], vec![0.3, 0.05]),
            (vec![1, 1], vec![0.02, 0.04]),
        ];
        let forward = DynPce::from_terms(inputs, vec!["a".into(), "b".into()], terms).unwrap();
        let known = [0.9, 1.2, 1.0, 0.7];
        let specimens = specimens().knowing(known.map(|k| vec![k]).to_vec()).unwrap();
        assert_eq!(specimens.known_inputs(), 1);
        let (mean, means) = specimens.expected(&forward, &[1.3]);
        let apart: f64 = specimens
            .contrasts
            .iter()
            .zip(means)
            .map(|(z, mean)| MvNormalCholesky(mean, scatter()).ln_density(z))
            .sum();
        let shared = specimens.shared_at(&[1.3_f64]).unwrap();
        let factor = specimens.factor_of_total(&scatter(), &shared).unwrap();
        let total = MvNormalCholesky(specimens.mean_of_total(&mean), factor);
        let found = apart + total.ln_density(&specimens.total);
        // the joint density of all rows about their own means
        let own: Vec<f64> = known.iter().flat_map(|&k| forward.value(&[1.3, k]).unwrap()).collect();
        let shifted: Vec<f64> = QOIS
            .concat()
            .iter()
            .zip(&own)
            .zip([MEAN; 4].concat())
            .map(|((y, m), c)| y - m + c)
            .collect();
        let expected = ln_density(4, &shifted);
        assert!((found - expected).abs() < 1e-11, "{found} {expected}");
        // and each has its density given the others
        let about = specimens.about(&forward, &[1.3], &mean).unwrap();
        for (k, found) in
            about.ln_conditionals(&[1.3], &mean, &scatter()).unwrap().iter().enumerate()
        {
            let others = [&shifted[..2 * k], &shifted[2 * k + 2..]].concat();
            let conditional = expected - ln_density(3, &others);
            assert!((found - conditional).abs() < 1e-10, "{k}: {found} {conditional}");
        }
    }

    /// log p(y) − log p(y_−k) with the covariance of all rows built directly.
    #[test]
    fn each_specimen_has_its_conditional_density_given_the_others() {
        let found = specimens().ln_conditionals(&[1.3], &MEAN, &scatter()).unwrap();
        let all = ln_density(4, &QOIS.concat());
        assert_eq!(found.len(), 4);
        for (k, found) in found.iter().enumerate() {
            let others: Vec<f64> = (0..4).filter(|&i| i != k).flat_map(|i| QOIS[i]).collect();
            let expected = all - ln_density(3, &others);
            assert!((found - expected).abs() < 1e-10, "{k}: {found} {expected}");
        }
        // one specimen alone, and two, of which one is left
        let one = Specimens::new(&[QOIS[0].to_vec()]).unwrap();
        let one = one.sharing(SHARED.map(Vec::from).to_vec()).unwrap();
        let found = one.ln_conditionals(&[1.3], &MEAN, &scatter()).unwrap();
        let expected = ln_density(1, &QOIS[0]);
        assert!((found[0] - expected).abs() < 1e-10, "{} {expected}", found[0]);
        let two: Vec<Vec<f64>> = QOIS[..2].iter().map(|row| row.to_vec()).collect();
        let two = Specimens::new(&two).unwrap().sharing(SHARED.map(Vec::from).to_vec()).unwrap();
        let found = two.ln_conditionals(&[1.3], &MEAN, &scatter()).unwrap();
        let expected = ln_density(2, &QOIS[..2].concat()) - ln_density(1, &QOIS[1]);
        assert!((found[0] - expected).abs() < 1e-10, "{} {expected}", found[0]);
    }

    #[test]
    fn without_a_shared_error_specimens_are_independent() {
        let rows: Vec<Vec<f64>> = QOIS.map(Vec::from).to_vec();
        let found =
            Specimens::new(&rows).unwrap().ln_conditionals(&[1.3], &MEAN, &scatter()).unwrap();
        for (row, found) in rows.iter().zip(found) {
            let expected = MvNormalCholesky(MEAN.to_vec(), scatter()).ln_density(row);
            assert!((found - expected).abs() < 1e-10, "{found} {expected}");
        }
    }

    /// S(θ) = S + s² h(θ): the joint density of all rows with it built directly, its slope by differences, and
    /// with what is known of each specimen at its mean.
    #[test]
    fn what_runs_leave_open_is_shared_where_the_parameters_are() {
        use surrogate::{Dataset, FitOptions, Input, OrderRule};
        let inputs = ["theta", "k"].map(|name| Input::new(name, 0.0, 2.0).unwrap()).to_vec();
        let mut runs = Dataset::new(inputs, vec!["a".into(), "b".into()], "").unwrap();
        for i in 0..9 {
            let (x, k) = (0.25 * f64::from(i), f64::from(i * i % 5) * 0.5);
            runs.push(&[x, k], &[x + 0.1 * k * k, 1.0 + x * k - 0.3 * x * x]).unwrap();
        }
        let options = FitOptions { rule: OrderRule::Fixed(1), ..FitOptions::default() };
        let open = DynPce::fit(&runs, &options).unwrap().coefficients;
        let scatter = vec![vec![4e-4, 1e-4], vec![1e-4, 3e-4]];
        let known = vec![vec![0.9], vec![1.2], vec![1.0], vec![0.7]];
        let wrong = specimens().leaving_open(open.clone(), vec![vec![0.0]; 2]);
        assert!(wrong.is_err());
        let specimens = specimens()
            .knowing(known)
            .unwrap()
            .leaving_open(open.clone(), scatter.clone())
            .unwrap();
        let of = |theta: f64| specimens.shared_at(&[theta]).unwrap();
        let h = open.leverage(&[1.3, 0.95]).unwrap();
        for (i, row) in of(1.3).iter().enumerate() {
            for (j, found) in row.iter().enumerate() {
                let expected = SHARED[i][j] + h * scatter[i][j];
                assert!((found - expected).abs() < 1e-15, "{found} {expected}");
            }
        }
        let dual = ppl::Dual::variables([1.3]);
        let slope = specimens.shared_at(&dual).unwrap()[1][0].gradient()[0];
        let difference = (of(1.3 + 1e-5)[1][0] - of(1.3 - 1e-5)[1][0]) / 2e-5;
        assert!((slope / difference - 1.0).abs() < 1e-6, "{slope} {difference}");
        assert!(of(0.1)[0][0] > of(1.0)[0][0], "less is known at the ends");
    }

    #[test]
    fn sizes_that_do_not_fit_are_refused() {
        assert!(Specimens::new(&[]).is_err());
        assert!(Specimens::new(&[vec![1.0], vec![1.0, 2.0]]).is_err());
        assert!(specimens().sharing(vec![vec![0.0; 2]]).is_err());
        assert!(specimens().sharing(vec![vec![0.0]; 2]).is_err());
        assert!(specimens().knowing(vec![vec![1.0]; 3]).is_err());
        assert!(specimens().knowing(vec![vec![1.0], vec![], vec![1.0], vec![1.0]]).is_err());
    }
}
