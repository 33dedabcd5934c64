//! The specimens of a calibration, transformed for the likelihood into contrasts between specimens and totals over
//! specimens.
//!
//! The model is y_k = m + δ + e_k for the quantities y_k of specimen k, with the response m of the forward model, e_k ~
//! N(0, Σ) for each specimen and one δ ~ N(0, S) for all specimens. δ is the error of the forward model, which does not
//! decrease with the number of specimens. An orthogonal transform turns the n rows into n − 1 contrasts z_j ~ N(0, Σ),
//! in which δ and m cancel, and the total √n ȳ ~ N(√n m, Σ + nS), where ȳ is the mean of the rows. The joint density of
//! contrasts and total is the density of the rows with δ integrated out. S may depend on the parameters: the error of a
//! surrogate is S(θ) = s² h(θ), the variance s² of runs times the leverage h, which is small near the runs.
//!
//! The forward model may have inputs that are known for each specimen, such as the stiffness of its microstructure.
//! Each specimen then has its own mean m_k, and the same transform is applied to the means. Specimens with unknown
//! inputs form a second group. The covariance of a specimen of this group is Σ + T, where T = b bᵀ is the effect of the
//! population's spread on the response. In addition to δ, all specimens of this group share an error with covariance
//! T/N, where N is the number of members from which the population is estimated.
//!
//! A specimen may lack some quantities. Its recorded quantities have the marginal normal distribution: the entries of
//! mean, Σ, S and T that belong to the recorded quantities. Specimens with the same recorded quantities form a group, so
//! that the transform applies to each group. The totals of all groups have one joint normal density, in which δ is
//! integrated out.

use ppl::DomainError;
use ppl::prelude::*;
use surrogate::CoefficientPosterior;

use super::CalibrationError;
pub(super) use super::contrasts::Kind;
use super::contrasts::{Group, helmert, recorded};
use super::population::{Population, Spread};

/// Quantities of interest of specimens, relative to their means, and the covariance of the error that all specimens
/// share.
#[derive(Clone, Debug)]
pub struct Specimens {
    /// Quantities of the specimens in their original order; NaN for a quantity that was not recorded.
    pub(super) rows: Vec<Vec<f64>>,
    /// Whether the inputs of each specimen are known.
    pub(super) is_known: Vec<bool>,
    /// Groups of specimens with the same covariance; no group is empty.
    pub(super) groups: Vec<Group>,
    /// Last inputs of the forward model for each specimen with known inputs; empty if the model has no such inputs.
    pub(super) inputs: Vec<Vec<f64>>,
    /// Population of the unknown inputs; `None` if all inputs are known.
    pub(super) population: Option<Population>,
    /// Concatenated totals of the groups, see [`Group::total`].
    pub(super) totals: Vec<f64>,
    /// Constant part of the covariance S of the error that all specimens share, quantities × quantities. If S is zero,
    /// the likelihood is the likelihood of the paper.
    pub(super) shared: Vec<Vec<f64>>,
    /// Terms of the covariance S that depend on the parameters: the errors of a forward model that was estimated from
    /// runs.
    pub(super) open: Vec<Open>,
}

/// Error of the forward model that depends on the parameters: a covariance times a leverage h.
#[derive(Clone, Debug)]
pub(super) struct Open {
    /// Posterior of the coefficients, which gives the leverage h.
    coefficients: CoefficientPosterior,
    /// Covariance of the error at leverage 1, for quantities relative to the means of the specimens.
    scatter: Vec<Vec<f64>>,
}

impl Specimens {
    /// Creates specimens without a shared error. `qois` has one row per specimen, in the order of the forward model's
    /// outputs; NaN for a quantity that was not recorded.
    ///
    /// # Errors
    /// If there is no specimen, the rows have different lengths, or a specimen has no recorded quantity.
    pub fn new(qois: &[Vec<f64>]) -> Result<Self, CalibrationError> {
        let [first, ..] = qois else { return Err(CalibrationError::TooFew(0)) };
        let expected = first.len();
        if let Some(row) = qois.iter().find(|row| row.len() != expected) {
            return Err(CalibrationError::Quantities { expected, found: row.len() });
        }
        if let Some(specimen) = qois.iter().position(|row| recorded(row).is_empty()) {
            return Err(CalibrationError::NothingRecorded { specimen });
        }
        let is_known = vec![true; qois.len()];
        let groups = Group::of_each(qois, &is_known);
        Ok(Self {
            rows: qois.to_vec(),
            is_known,
            totals: totals(&groups),
            groups,
            inputs: Vec::new(),
            population: None,
            shared: vec![vec![0.0; expected]; expected],
            open: Vec::new(),
        })
    }

    /// Adds the last inputs of the forward model for each specimen, `None` if they are unknown, and the population to
    /// which the unknown inputs belong.
    ///
    /// # Errors
    /// If the number of entries differs from the number of specimens, rows have different lengths, or there are unknown
    /// inputs but no population.
    pub fn knowing(
        self,
        inputs: &[Option<Vec<f64>>],
        population: Option<Population>,
    ) -> Result<Self, CalibrationError> {
        let wrong = || CalibrationError::Known { expected: self.len(), found: inputs.len() };
        let width = population.as_ref().map(|population| population.mean().len());
        let mut widths = inputs.iter().flatten().map(Vec::len).chain(width);
        let first = widths.next();
        if inputs.len() != self.len() || widths.any(|width| Some(width) != first) {
            return Err(wrong());
        }
        let is_known: Vec<bool> = inputs.iter().map(Option::is_some).collect();
        if population.is_none() && is_known.contains(&false) {
            return Err(CalibrationError::Population { found: 0 });
        }
        let groups = Group::of_each(&self.rows, &is_known);
        let totals = totals(&groups);
        let population = population.filter(|_| is_known.contains(&false));
        let inputs = inputs.iter().flatten().cloned().collect();
        Ok(Self { is_known, groups, inputs, population, totals, ..self })
    }

    /// Whether every quantity of every specimen was recorded.
    pub(super) fn is_complete(&self) -> bool {
        self.groups.iter().all(|group| group.recorded.len() == self.shared.len())
    }

    /// Contrasts of all groups of one kind, group after group.
    pub(super) fn contrasts_of(&self, kind: Kind) -> Vec<&Vec<f64>> {
        self.of_kind(kind).flat_map(|group| &group.contrasts).collect()
    }

    /// The groups of specimens of one kind.
    pub(super) fn of_kind(&self, kind: Kind) -> impl Iterator<Item = &Group> {
        self.groups.iter().filter(move |group| group.kind == kind)
    }

    /// Number of inputs of the forward model that are not parameters.
    pub(super) fn known_inputs(&self) -> usize {
        let of_population = self.population.as_ref().map_or(0, |p| p.mean().len());
        self.inputs.first().map_or(of_population, Vec::len)
    }

    /// Evaluates the forward model for the specimens at the parameters `point`.
    ///
    /// # Errors
    /// If the parameters lie outside the box of an error that depends on the parameters.
    pub(super) fn expected<R: Scalar>(
        &self,
        forward: &impl DynDifferentiable,
        point: &[R],
    ) -> Result<Expected<R>, DomainError> {
        let shared = self.shared_at(point)?;
        let unknown = self.population.as_ref().map(|p| p.response(forward, point));
        if self.known_inputs() == 0 {
            let mean = forward.at(point);
            let (own, totals) = (Vec::new(), Vec::new());
            return Ok(Expected { own, contrasts: Vec::new(), totals, mean, unknown, shared });
        }
        let response = |inputs: &Vec<f64>| -> Vec<R> {
            let inputs = inputs.iter().map(|&x| R::from(x));
            forward.at(&point.iter().copied().chain(inputs).collect::<Vec<R>>())
        };
        let own: Vec<Vec<R>> = self.inputs.iter().map(response).collect();
        let of_group = |group: &Group| {
            let rows: Vec<Vec<R>> = group.places.iter().map(|&k| group.part(&own[k])).collect();
            helmert(&rows)
        };
        let (contrasts, totals): (Vec<_>, Vec<_>) = self.of_kind(Kind::Known).map(of_group).unzip();
        let mean = match (&totals[..], self.is_complete()) {
            ([total], true) => scaled_back(total, own.len()),
            _ => scaled_back(&helmert(&own).1, own.len()),
        };
        Ok(Expected { own, contrasts: contrasts.concat(), totals, mean, unknown, shared })
    }

    /// Sets the covariance S of the error δ that all specimens share: the error of the surrogate, the mesh and the
    /// geometry, for quantities relative to the means of the specimens.
    ///
    /// # Errors
    /// If the size of `covariance` differs from the number of quantities.
    pub fn sharing(mut self, covariance: Vec<Vec<f64>>) -> Result<Self, CalibrationError> {
        let expected = self.shared.len();
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

    /// Adds an error of the forward model that depends on the parameters and that all specimens share. The covariance
    /// of the error is `scatter`, for quantities relative to the means of the specimens, times the leverage at the
    /// parameters.
    ///
    /// # Errors
    /// If the size of `scatter` differs from the number of quantities.
    pub fn leaving_open(
        self,
        coefficients: CoefficientPosterior,
        scatter: Vec<Vec<f64>>,
    ) -> Result<Self, CalibrationError> {
        let shared = self.shared.clone();
        // `sharing` checks the size of the matrix
        let checked = self.sharing(scatter)?;
        let scatter = checked.shared.clone();
        let mut open = checked.open.clone();
        open.push(Open { coefficients, scatter });
        Ok(Self { shared, open, ..checked })
    }

    /// Returns the covariance S of the shared error at the parameters `point`. Known inputs are set to their mean
    /// over the specimens; if the response is linear in these inputs, this is the error of the mean response. If some
    /// specimens have unknown inputs, the mean of the population is used instead.
    pub(super) fn shared_at<R: Scalar>(&self, point: &[R]) -> Result<Vec<Vec<R>>, DomainError> {
        let constant = |row: &Vec<f64>| row.iter().map(|&s| R::from(s)).collect();
        let mut shared: Vec<Vec<R>> = self.shared.iter().map(constant).collect();
        for Open { coefficients, scatter } in &self.open {
            let middle = match &self.population {
                Some(population) => population.mean().to_vec(),
                None => column_means(&self.inputs),
            };
            let place: Vec<R> =
                point.iter().copied().chain(middle.into_iter().map(R::from)).collect();
            let leverage = coefficients.try_at(&place)?[0];
            for (row, scatter) in shared.iter_mut().zip(scatter) {
                row.iter_mut().zip(scatter).for_each(|(entry, &s)| *entry += leverage * s);
            }
        }
        Ok(shared)
    }

    /// Number of specimens.
    pub fn len(&self) -> usize {
        self.is_known.len()
    }

    /// Always false, because there is at least one specimen.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// The mean response over all specimens.
    pub(super) fn mean<R: Scalar>(&self, expected: &Expected<R>) -> Vec<R> {
        match &expected.unknown {
            None => expected.mean.clone(),
            Some(unknown) if self.inputs.is_empty() => unknown.mean.clone(),
            Some(unknown) => {
                let part = self.inputs.len() as f64 / self.len() as f64;
                let both = expected.mean.iter().zip(&unknown.mean);
                both.map(|(&a, &b)| a * part + b * (1.0 - part)).collect()
            }
        }
    }

    /// Returns zeros: the expected contrast between specimens with unknown inputs, or between specimens of a forward
    /// model that has only parameters as inputs.
    pub(super) fn no_contrast<R: Scalar>(&self) -> Vec<R> {
        vec![R::from(0.0); self.shared.len()]
    }

    /// Expected totals of the groups, concatenated.
    pub(super) fn mean_of_totals<R: Scalar>(&self, expected: &Expected<R>) -> Vec<R> {
        let of_group = |(g, group): (usize, &Group)| self.mean_of_total(g, group, expected);
        self.groups.iter().enumerate().flat_map(of_group).collect()
    }

    /// Expected total of the group at the index `g`.
    pub(super) fn mean_of_total<R: Scalar>(
        &self,
        g: usize,
        group: &Group,
        expected: &Expected<R>,
    ) -> Vec<R> {
        match expected.totals.get(g) {
            // groups with known inputs come first
            Some(total) if !self.is_complete() => total.clone(),
            _ => scaled(&group.part(expected.mean_of(group.kind)), group.len()),
        }
    }

    /// Returns the Cholesky factor of the covariance of the totals. `scatter` is the Cholesky factor of the
    /// covariance Σ between specimens. For a single group of n specimens with known inputs, the covariance of the
    /// total is Σ + nS with the covariance S of the shared error.
    pub(super) fn factor_of_totals<R: Scalar>(
        &self,
        expected: &Expected<R>,
        scatter: &DynCholeskyFactor<R>,
    ) -> Result<DynCholeskyFactor<R>, DomainError> {
        self.factor_of(&self.sized_groups(), expected, scatter)
    }

    /// Cholesky factor of the covariance of the recorded quantities of one specimen of a group, without the errors that
    /// specimens share.
    pub(super) fn factor_of_specimen<R: Scalar>(
        &self,
        group: &Group,
        expected: &Expected<R>,
        scatter: &DynCholeskyFactor<R>,
    ) -> Result<DynCholeskyFactor<R>, DomainError> {
        let whole = match group.kind {
            Kind::Known => scatter.clone(),
            Kind::Unknown => self.factor_of_unknown(expected, scatter)?,
        };
        if group.recorded.len() == self.shared.len() {
            return Ok(whole);
        }
        let covariance = whole.covariance();
        let rows: Vec<Vec<R>> =
            group.recorded.iter().map(|&m| group.part(&covariance[m])).collect();
        DynCholeskyFactor::of_covariance(&rows)
    }

    /// Cholesky factor of the covariance Σ + T of specimens with unknown inputs, where T is the effect of the inputs'
    /// spread; the factor of Σ if there are no such specimens.
    pub(super) fn factor_of_unknown<R: Scalar>(
        &self,
        expected: &Expected<R>,
        scatter: &DynCholeskyFactor<R>,
    ) -> Result<DynCholeskyFactor<R>, DomainError> {
        let Some(unknown) = &expected.unknown else { return Ok(scatter.clone()) };
        let mut covariance = scatter.covariance();
        add(&mut covariance, |i, j| unknown.between(i, j));
        DynCholeskyFactor::of_covariance(&covariance)
    }

    /// Returns the Cholesky factor of the covariance of the totals of groups of the given sizes.
    pub(super) fn factor_of<R: Scalar>(
        &self,
        groups: &[(&Group, usize)],
        expected: &Expected<R>,
        scatter: &DynCholeskyFactor<R>,
    ) -> Result<DynCholeskyFactor<R>, DomainError> {
        let is_shared = expected.shared.iter().flatten().any(|s| s.value() != 0.0);
        if let ([(group, _)], false) = (groups, is_shared)
            && group.kind == Kind::Known
        {
            return self.factor_of_specimen(group, expected, scatter);
        }
        let scatter = scatter.covariance();
        // group and quantity of each entry of the concatenated totals
        let places: Vec<(usize, usize)> = (0..groups.len())
            .flat_map(|g| groups[g].0.recorded.iter().map(move |&m| (g, m)))
            .collect();
        let entry = |&(a, i): &(usize, usize), &(b, j): &(usize, usize)| {
            let ((g, n), (h, m)) = (groups[a], groups[b]);
            let shared = self.common(g.kind, h.kind, expected, i, j) * ((n * m) as f64).sqrt();
            match a == b {
                true => self.own(g.kind, expected, &scatter, i, j) + shared,
                false => shared,
            }
        };
        let covariance: Vec<Vec<R>> =
            places.iter().map(|a| places.iter().map(|b| entry(a, b)).collect()).collect();
        DynCholeskyFactor::of_covariance(&covariance)
    }

    /// Entry (i, j) of the covariance between two different specimens, one of kind `a` and one of kind `b`.
    pub(super) fn common<R: Scalar>(
        &self,
        a: Kind,
        b: Kind,
        expected: &Expected<R>,
        i: usize,
        j: usize,
    ) -> R {
        let shared = expected.shared[i][j];
        match &expected.unknown {
            Some(unknown) if (a, b) == (Kind::Unknown, Kind::Unknown) => {
                shared + unknown.shared(i, j)
            }
            _ => shared,
        }
    }

    /// Entry (i, j) of the covariance of a specimen's own deviation, which is independent of the deviations of other
    /// specimens.
    pub(super) fn own<R: Scalar>(
        &self,
        kind: Kind,
        expected: &Expected<R>,
        scatter: &[Vec<R>],
        i: usize,
        j: usize,
    ) -> R {
        match (&expected.unknown, kind) {
            (Some(unknown), Kind::Unknown) => scatter[i][j] + unknown.between(i, j),
            _ => scatter[i][j],
        }
    }

    /// Returns each group with the number of its specimens.
    pub(super) fn sized_groups(&self) -> Vec<(&Group, usize)> {
        self.groups.iter().map(|group| (group, group.len())).collect()
    }
}

/// Concatenates the totals of the groups (for each quantity, √n times the mean of the n specimens of a group).
fn totals(groups: &[Group]) -> Vec<f64> {
    groups.iter().flat_map(|group| group.total.iter().copied()).collect()
}

/// Results of the forward model for the specimens at given parameters.
#[derive(Clone, Debug)]
pub(super) struct Expected<R> {
    /// Response of each specimen with known inputs; empty if the forward model has no such inputs.
    own: Vec<Vec<R>>,
    /// Expected contrasts between the specimens of each group with known inputs, group after group; empty if the forward
    /// model has no such inputs, because the contrasts are then zero.
    pub(super) contrasts: Vec<Vec<R>>,
    /// Expected totals of the groups with known inputs; empty if the forward model has no such inputs.
    totals: Vec<Vec<R>>,
    /// Mean response of the specimens with known inputs.
    mean: Vec<R>,
    /// Response of a specimen with unknown inputs, if there are such specimens.
    pub(super) unknown: Option<Spread<R>>,
    /// Covariance S of the shared error at the parameters.
    shared: Vec<Vec<R>>,
}

impl<R> Expected<R> {
    pub(super) fn mean_of(&self, kind: Kind) -> &[R] {
        match (kind, &self.unknown) {
            (Kind::Unknown, Some(unknown)) => &unknown.mean,
            _ => &self.mean,
        }
    }

    /// Expected response of a specimen, given by its position among the specimens of its kind.
    pub(super) fn own_mean(&self, kind: Kind, place: usize) -> &[R] {
        match kind {
            Kind::Known => self.own.get(place).map_or(&self.mean, |own| own),
            Kind::Unknown => self.mean_of(kind),
        }
    }
}

/// Mean of the numbers of every column of rows of the same length; NaN cells are skipped. Empty if there are no rows. The
/// mean of a column without a number is NaN.
pub fn column_means(rows: &[Vec<f64>]) -> Vec<f64> {
    let columns = rows.first().map_or(0, Vec::len);
    let mean = |m: usize| {
        let measured_values = || rows.iter().map(|row| row[m]).filter(|x| !x.is_nan());
        measured_values().sum::<f64>() / measured_values().count() as f64
    };
    (0..columns).map(mean).collect()
}

/// √n times a mean.
pub(super) fn scaled<R: Scalar>(mean: &[R], n: usize) -> Vec<R> {
    let root = (n as f64).sqrt();
    mean.iter().map(|&m| m * root).collect()
}

/// A total of n rows divided by √n.
fn scaled_back<R: Scalar>(total: &[R], n: usize) -> Vec<R> {
    let root = (n as f64).sqrt();
    total.iter().map(|&sum| sum / root).collect()
}

fn add<R: Scalar>(matrix: &mut [Vec<R>], entry: impl Fn(usize, usize) -> R) {
    for (i, row) in matrix.iter_mut().enumerate() {
        row.iter_mut().enumerate().for_each(|(j, own)| *own += entry(i, j));
    }
}
