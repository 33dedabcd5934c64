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
//! Specimens of which it is not known are a second group: they scatter by Σ + T, where T = b bᵀ is what their
//! population does to the response, and share δ and T/N beside, N being how many the population is known
//! from. Totals of both groups have one joint normal density.

use ppl::DomainError;
use ppl::prelude::*;
use surrogate::{CoefficientPosterior, DynPce};

use super::CalibrationError;
use super::contrasts::{Group, helmert};
use super::population::{Population, Spread};

/// Quantities of interest of specimens, relative to their means, and the covariance of the error that
/// all share.
#[derive(Clone, Debug)]
pub struct Specimens {
    /// Of each specimen, whether its inputs are known.
    pub(super) is_known: Vec<bool>,
    pub(super) known: Group,
    pub(super) unknown: Group,
    /// The last inputs of the forward model of the known ones; no rows if there are none to be known.
    pub(super) inputs: Vec<Vec<f64>>,
    /// Of those of the others.
    pub(super) population: Option<Population>,
    /// Totals of the groups that there are, one after the other.
    pub(super) totals: Vec<f64>,
    /// S but for what follows, quantities × quantities; zero is the paper's likelihood.
    pub(super) shared: Vec<Vec<f64>>,
    /// What runs, and their specimens, leave open of the forward model.
    pub(super) open: Vec<Open>,
}

/// An error of the forward model that is not the same everywhere.
#[derive(Clone, Debug)]
pub(super) struct Open {
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
        let known = Group::of(qois.to_vec());
        Ok(Self {
            is_known: vec![true; qois.len()],
            totals: known.total.clone(),
            known,
            unknown: Group::default(),
            inputs: Vec::new(),
            population: None,
            shared: vec![vec![0.0; expected]; expected],
            open: Vec::new(),
        })
    }

    /// With the last inputs of the forward model, as far as they are known of each specimen, and the population
    /// that those of the others are taken from.
    ///
    /// # Errors
    /// Another number of entries than of specimens, rows of different lengths, or unknown inputs without a
    /// population.
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
        let rows = self.rows();
        let of = |known: bool| {
            let chosen = rows.iter().zip(&is_known).filter(|(_, own)| **own == known);
            Group::of(chosen.map(|(row, _)| (*row).clone()).collect())
        };
        let (known, unknown) = (of(true), of(false));
        let totals = [&known.total[..], &unknown.total].concat();
        let population = population.filter(|_| unknown.len() > 0);
        let inputs = inputs.iter().flatten().cloned().collect();
        Ok(Self { is_known, known, unknown, inputs, population, totals, ..self })
    }

    /// All rows in their order.
    pub(super) fn rows(&self) -> Vec<&Vec<f64>> {
        let (mut known, mut unknown) = (self.known.rows.iter(), self.unknown.rows.iter());
        let row = |is_known: &bool| if *is_known { known.next() } else { unknown.next() };
        self.is_known.iter().filter_map(row).collect()
    }

    /// How many inputs of the forward model are no parameters.
    pub(super) fn known_inputs(&self) -> usize {
        let of_population = self.population.as_ref().map_or(0, |p| p.mean().len());
        self.inputs.first().map_or(of_population, Vec::len)
    }

    /// What the forward model says of the specimens at parameters `point`.
    ///
    /// # Errors
    /// Parameters outside the box of an error that is not the same everywhere.
    pub(super) fn expected<R: Scalar>(
        &self,
        forward: &DynPce,
        point: &[R],
    ) -> Result<Expected<R>, DomainError> {
        let shared = self.shared_at(point)?;
        let unknown = self.population.as_ref().map(|p| p.response(forward, point));
        if self.known_inputs() == 0 {
            let mean = forward.at(point);
            let zeros = vec![R::from(0.0); mean.len()];
            let contrasts = vec![zeros; self.known.contrasts.len()];
            return Ok(Expected { own: Vec::new(), contrasts, mean, unknown, shared });
        }
        let response = |inputs: &Vec<f64>| -> Vec<R> {
            let inputs = inputs.iter().map(|&x| R::from(x));
            forward.at(&point.iter().copied().chain(inputs).collect::<Vec<R>>())
        };
        let own: Vec<Vec<R>> = self.inputs.iter().map(response).collect();
        let (contrasts, total) = helmert(&own);
        let root = (self.known.len() as f64).sqrt();
        let mean = total.into_iter().map(|sum| sum / root).collect();
        Ok(Expected { own, contrasts, mean, unknown, shared })
    }

    /// With the covariance S of the error δ that all specimens share, in the same relative quantities:
    /// of the surrogate, of the mesh, of the geometry.
    ///
    /// # Errors
    /// Another size than that of the quantities.
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
        let scatter = checked.shared.clone();
        let mut open = checked.open.clone();
        open.push(Open { coefficients, scatter });
        Ok(Self { shared, open, ..checked })
    }

    /// S at parameters `point`. Inputs that are known of each specimen stand at their mean: of a response that
    /// is linear in them, that of the mean over the specimens. Where some are not known they stand at that of
    /// the population.
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

    /// Never: there is at least one.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// The mean response over all specimens.
    pub(super) fn mean<R: Scalar>(&self, expected: &Expected<R>) -> Vec<R> {
        match &expected.unknown {
            None => expected.mean.clone(),
            Some(unknown) if self.known.len() == 0 => unknown.mean.clone(),
            Some(unknown) => {
                let part = self.known.len() as f64 / self.len() as f64;
                let both = expected.mean.iter().zip(&unknown.mean);
                both.map(|(&a, &b)| a * part + b * (1.0 - part)).collect()
            }
        }
    }

    /// What contrasts between specimens of which nothing is known are expected to be: zero.
    pub(super) fn no_contrast<R: Scalar>(&self) -> Vec<R> {
        vec![R::from(0.0); self.shared.len()]
    }

    /// The expected totals.
    pub(super) fn mean_of_totals<R: Scalar>(&self, expected: &Expected<R>) -> Vec<R> {
        let groups = self.groups().into_iter();
        groups.flat_map(|(group, size)| scaled(expected.mean_of(group), size)).collect()
    }

    /// The factor of the totals' covariance, from that of Σ; of one group it is Σ + nS.
    pub(super) fn factor_of_totals<R: Scalar>(
        &self,
        expected: &Expected<R>,
        scatter: &DynCholeskyFactor<R>,
    ) -> Result<DynCholeskyFactor<R>, DomainError> {
        self.factor_of(&self.groups(), expected, scatter)
    }

    /// The factor of the covariance between specimens of which nothing is known, Σ + T; Σ if there are none.
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

    /// The factor of the covariance of the totals of groups of these sizes.
    pub(super) fn factor_of<R: Scalar>(
        &self,
        groups: &[(Kind, usize)],
        expected: &Expected<R>,
        scatter: &DynCholeskyFactor<R>,
    ) -> Result<DynCholeskyFactor<R>, DomainError> {
        let is_shared = expected.shared.iter().flatten().any(|s| s.value() != 0.0);
        if let ([(Kind::Known, _)], false) = (groups, is_shared) {
            return Ok(scatter.clone());
        }
        let (scatter, size) = (scatter.covariance(), self.shared.len());
        let entry = |a: usize, b: usize| {
            let ((g, n), (h, m)) = (groups[a / size], groups[b / size]);
            let (i, j) = (a % size, b % size);
            let shared = self.common(g, h, expected, i, j) * ((n * m) as f64).sqrt();
            match a / size == b / size {
                true => self.own(g, expected, &scatter, i, j) + shared,
                false => shared,
            }
        };
        let all = size * groups.len();
        let covariance: Vec<Vec<R>> =
            (0..all).map(|a| (0..all).map(|b| entry(a, b)).collect()).collect();
        DynCholeskyFactor::of_covariance(&covariance)
    }

    /// An entry of the covariance of what a specimen of one kind shares with another.
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

    /// An entry of the covariance of what a specimen has alone.
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

    /// The groups that there are, with their sizes.
    pub(super) fn groups(&self) -> Vec<(Kind, usize)> {
        let all = [Kind::Known, Kind::Unknown].map(|kind| (kind, self.group(kind).len()));
        all.into_iter().filter(|(_, size)| *size > 0).collect()
    }

    pub(super) fn group(&self, kind: Kind) -> &Group {
        match kind {
            Kind::Known => &self.known,
            Kind::Unknown => &self.unknown,
        }
    }
}

/// Whether the inputs of a specimen are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Known,
    Unknown,
}

/// What the forward model says of specimens at some parameters.
#[derive(Clone, Debug)]
pub(super) struct Expected<R> {
    /// Of each specimen whose inputs are known; nothing where there are none to be known.
    own: Vec<Vec<R>>,
    /// Of their contrasts.
    pub(super) contrasts: Vec<Vec<R>>,
    /// Their mean.
    mean: Vec<R>,
    /// Of each of the others.
    pub(super) unknown: Option<Spread<R>>,
    /// S there.
    shared: Vec<Vec<R>>,
}

impl<R> Expected<R> {
    pub(super) fn mean_of(&self, kind: Kind) -> &[R] {
        match (kind, &self.unknown) {
            (Kind::Unknown, Some(unknown)) => &unknown.mean,
            _ => &self.mean,
        }
    }

    /// Of a specimen by its place in its group.
    pub(super) fn own_mean(&self, kind: Kind, place: usize) -> &[R] {
        match kind {
            Kind::Known => self.own.get(place).map_or(&self.mean, |own| own),
            Kind::Unknown => self.mean_of(kind),
        }
    }
}

/// The mean of every column of rows of one length; nothing of no rows.
pub fn column_means(rows: &[Vec<f64>]) -> Vec<f64> {
    let columns = rows.first().map_or(0, Vec::len);
    let mean = |m: usize| rows.iter().map(|row| row[m]).sum::<f64>() / rows.len() as f64;
    (0..columns).map(mean).collect()
}

/// √n times a mean.
pub(super) fn scaled<R: Scalar>(mean: &[R], n: usize) -> Vec<R> {
    let root = (n as f64).sqrt();
    mean.iter().map(|&m| m * root).collect()
}

fn add<R: Scalar>(matrix: &mut [Vec<R>], entry: impl Fn(usize, usize) -> R) {
    for (i, row) in matrix.iter_mut().enumerate() {
        row.iter_mut().enumerate().for_each(|(j, own)| *own += entry(i, j));
    }
}
