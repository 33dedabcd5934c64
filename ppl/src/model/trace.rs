//! Evaluation context that records all named quantities.

use std::borrow::Cow;

use rand::RngCore;

use crate::density::site::Site;
use crate::density::{FatalError, Location, Rejection};
use crate::distribution::{Distribution, Unknown};
use crate::model::context::{Context, ContextHooks, NumberOf};
use crate::model::evaluation::{SufficientStatistics, too_few_coordinates};
use crate::model::unknowns_from::UnknownsFrom;
use crate::number::real::Real;
use crate::quantity::datum::Recordable;
use crate::quantity::format;
use crate::quantity::layout;
use crate::quantity::record::{Entry, Label, Record, Role};
use crate::term::accumulator::Settled;

/// Context that records every statement. Predictions and replicates are drawn with `rng`.
pub(crate) struct Trace<'y> {
    pub(crate) source: UnknownsFrom<'y>,
    rng: &'y mut dyn RngCore,
    pub(crate) record: Record,
    /// Sites of the submodels around the current statement.
    around: Vec<&'static Site>,
    /// Sufficient statistics of the observations; `None` if they are not requested, or if a submodel does not execute
    /// the same statements at every point.
    pub(crate) statistics: Option<Vec<SufficientStatistics>>,
    /// Description of the datum at which the distribution of an observation was invalid; `None` if there was no such
    /// datum.
    pub(crate) failing: Option<String>,
    /// Location of the last executed statement. The field `ran` is the number of executed statements.
    pub(crate) last: Option<Location>,
    ran: usize,
    /// For each plate (`for` loop of the model) around the current statement: number of statements that were executed
    /// before the plate began. The innermost plate is last.
    begun: Vec<usize>,
}

impl<'y> Trace<'y> {
    pub(crate) fn new(source: UnknownsFrom<'y>, rng: &'y mut dyn RngCore) -> Self {
        let record = Record::default();
        let (around, statistics, failing, last) = (Vec::new(), None, None, None);
        let (ran, begun) = (0, Vec::new());
        Self { source, rng, record, around, statistics, failing, last, ran, begun }
    }

    /// Returns the record, or an error if the named dimensions are inconsistent.
    pub(crate) fn finish(mut self) -> Result<Record, Rejection> {
        let record = &mut self.record;
        record.unfold();
        let entries = &record.entries;
        record.without_data.retain(|name| entries.iter().all(|e| e.variable.name != *name));
        layout::check(&self.record.entries, &self.record.coordinates)
            .map_err(|problem| Box::new(FatalError::Dimensions { problem }))?;
        Ok(self.record)
    }

    fn label(&self, site: &'static Site) -> Label {
        let mut label = Label {
            site,
            name: Cow::Borrowed(site.name),
            stacked: site.repeated,
            plates: site.plates.to_vec(),
        };
        for part in self.around.iter().rev() {
            label.name = format!("{}.{}", part.name, label.name).into();
            if !label.stacked {
                (label.stacked, label.plates) = (part.repeated, part.plates.to_vec());
            } else if part.repeated && !label.plates.is_empty() {
                label.plates.splice(..0, part.plates.iter().copied());
            }
        }
        label
    }

    /// Creates the label for the statement `y.impute() ~ D`. Missing data are recorded under the name `y.missing`,
    /// observed data under `y`. In a loop of the model (a plate), the entries of both quantities are labelled with
    /// the labels of the loop's dimension, or with indices if the dimension has no labels.
    fn imputed(&mut self, site: &'static Site, is_missing: bool) -> Label {
        let mut at = self.label(site);
        let missing = format!("{}.missing", at.name);
        if at.stacked {
            // each of the two quantities has only some of the entries of the loop, so that the named dimension of
            // the loop is a dimension of neither quantity
            let plates = std::mem::take(&mut at.plates);
            let plate = if let [plate] = plates[..] { Some(plate) } else { None };
            let entries = &self.record.entries;
            let stacked = |e: &&Entry| e.variable.name == at.name || e.variable.name == missing;
            let index: usize = entries.iter().filter(stacked).map(|e| e.variable.shape[0]).sum();
            let coordinates = &mut self.record.coordinates;
            let labels = plate.and_then(|plate| coordinates.get(plate));
            let entry_label = labels.and_then(|labels| labels.get(index).cloned());
            let name = if is_missing { missing.as_str() } else { &at.name };
            let labels = coordinates.labels(&format!("{name}_dim_0"));
            labels.push(entry_label.unwrap_or_else(|| index.to_string()));
        }
        if is_missing {
            at.name = missing.into();
        }
        at
    }

    fn write(
        &mut self,
        at: &Label,
        role: Role,
        value: &dyn Recordable,
    ) -> Result<&mut Entry, Rejection> {
        let entry = self.record.entry(at, role, &value.shape())?;
        value.flatten(&mut entry.values);
        Ok(entry)
    }

    /// Registers a statement that is about to be executed.
    fn pass(&mut self, site: &Site) {
        self.last = Some(site.location);
        self.ran += 1;
    }

    /// Registers an observation that was not executed, because its loop has no data.
    fn without_data(&mut self, site: &'static Site) {
        let name = self.label(site).name.into_owned();
        if !self.record.without_data.contains(&name) {
            self.record.without_data.push(name);
        }
    }

    /// Records an unknown.
    fn declare(
        &mut self,
        site: &'static Site,
        is_imputed: bool,
        value: &dyn Recordable,
        bounds: Option<(f64, f64)>,
        log_prior: f64,
    ) -> Result<(), Rejection> {
        let at = if is_imputed { self.imputed(site, true) } else { self.label(site) };
        let entry = self.write(&at, Role::Parameter, value)?;
        // statements in a loop can have different bounds; the quantity then has no bounds
        let first = !at.stacked || entry.variable.shape[0] == 1;
        entry.bounds = bounds.filter(|_| first || entry.bounds == bounds);
        entry.log_prior += log_prior;
        Ok(())
    }

    fn declared<D: Unknown<Real<f64>>>(
        &mut self,
        site: &'static Site,
        is_imputed: bool,
        distribution: &D,
    ) -> Result<D::Value, Rejection> {
        self.pass(site);
        let label = match self.source {
            UnknownsFrom::Values(..) => Some(self.label(site)),
            _ => None,
        };
        let value = match &mut self.source {
            UnknownsFrom::Prior => site.locate(distribution.try_draw(self.rng))?,
            UnknownsFrom::Values(point, values) => {
                site.locate(distribution.validate())?;
                let terms = &mut Settled::new();
                let mut value = distribution.constrain(&mut || point.next(), false, terms);
                if let Some(label) = &label {
                    let missing = if is_imputed { ".missing" } else { "" };
                    values.overwrite(&format!("{}{missing}", label.name), &mut value);
                }
                value
            }
            UnknownsFrom::Point(point) => {
                site.locate(distribution.validate())?;
                let terms = &mut Settled::new();
                let value = distribution.constrain(&mut || point.next(), false, terms);
                if point.short {
                    return Err(too_few_coordinates(site));
                }
                value
            }
        };
        let first = self.record.unconstrained.len();
        distribution.unconstrain(&value, &mut self.record.unconstrained);
        if let (UnknownsFrom::Values(_, values), Some(label)) = (&mut self.source, &label)
            && self.record.unconstrained[first..].iter().any(|y| !y.is_finite())
        {
            values.problem.get_or_insert_with(|| {
                format!("`{}`: the value lies outside the support of its prior", label.name)
            });
        }
        let log_prior = log_density(distribution, &value);
        self.declare(site, is_imputed, &value, distribution.bounds(), log_prior)?;
        Ok(value)
    }

    /// Records an observation.
    fn condition(
        &mut self,
        site: &'static Site,
        is_imputed: bool,
        datum: &dyn Recordable,
        replicate: &dyn Recordable,
        log_likelihood: &[f64],
    ) -> Result<(), Rejection> {
        let at = if is_imputed { self.imputed(site, false) } else { self.label(site) };
        let entry = self.write(&at, Role::Observed, datum)?;
        replicate.flatten(&mut entry.replicate);
        entry.log_likelihood.extend(log_likelihood);
        Ok(())
    }

    fn observed<D: Distribution<Real<f64>>>(
        &mut self,
        site: &'static Site,
        is_imputed: bool,
        datum: &D::Value,
        distribution: &D,
    ) -> Result<(), Rejection> {
        self.pass(site);
        let drawn = distribution.fits(datum).and_then(|()| distribution.try_draw(self.rng));
        let replicate = match drawn {
            Ok(replicate) => replicate,
            Err(error) => {
                self.failing = Some(self.in_words(site, datum));
                return Err(site.rejection(error));
            }
        };
        let mut log_likelihood = Vec::new();
        distribution.pointwise(datum, &mut log_likelihood);
        self.condition(site, is_imputed, datum, &replicate, &log_likelihood)
    }

    /// Describes the datum that a statement is about to observe, for error messages.
    fn in_words(&self, site: &'static Site, datum: &dyn Recordable) -> String {
        let at = self.label(site);
        let index = self.record.get(&at.name).map_or(0, |entry| entry.log_likelihood.len());
        let mut elements = Vec::new();
        datum.flatten(&mut elements);
        format::datum(&at.name, at.stacked.then_some(index), &elements)
    }

    /// Records a value that has no density and no replicate, such as a tracked quantity.
    fn note(
        &mut self,
        site: &'static Site,
        role: Role,
        value: &dyn Recordable,
    ) -> Result<(), Rejection> {
        self.pass(site);
        self.write(&self.label(site), role, value)?;
        Ok(())
    }
}

/// Returns the log density of a value. The accumulator has the same type as in the primal backend, so that no
/// additional code is compiled.
fn log_density<D: Distribution<Real<f64>>>(distribution: &D, x: &D::Value) -> f64 {
    let mut terms = Settled::new();
    distribution.add_terms(x, &mut terms);
    terms.total()
}

impl Context for Trace<'_> {
    type Number = f64;

    fn predicts(&self) -> bool {
        true
    }

    fn unknown<D: Unknown<Real<f64>>>(
        &mut self,
        site: &'static Site,
        distribution: D,
    ) -> Result<D::Value, Rejection> {
        self.declared(site, false, &distribution)
    }

    fn observe<D: Distribution<Real<f64>>>(
        &mut self,
        site: &'static Site,
        datum: D::Value,
        distribution: D,
    ) -> Result<(), Rejection> {
        self.observed(site, false, &datum, &distribution)?;
        if let Some(statistics) = self.statistics.as_mut().filter(|_| D::SUMMARISES) {
            let mut sums = Vec::new();
            distribution.summarise(&datum, &mut sums);
            statistics.push(sums.into());
        }
        Ok(())
    }

    fn impute<D: Unknown<Real<f64>>>(
        &mut self,
        site: &'static Site,
        datum: Option<D::Value>,
        distribution: D,
    ) -> Result<D::Value, Rejection> {
        match datum {
            Some(x) => self.observed(site, true, &x, &distribution).map(|()| x),
            None => self.declared(site, true, &distribution),
        }
    }

    fn factor(&mut self, _: &'static Site, weight: Real<f64>) -> Result<(), Rejection> {
        *self.record.factors.get_or_insert(0.0) += weight.0;
        Ok(())
    }

    fn track<T: Recordable + ?Sized>(
        &mut self,
        site: &'static Site,
        value: &T,
    ) -> Result<(), Rejection> {
        self.note(site, Role::Tracked, &value)
    }

    fn track_prediction<T: Recordable + ?Sized>(
        &mut self,
        site: &'static Site,
        value: &T,
    ) -> Result<(), Rejection> {
        self.note(site, Role::Predicted, &value)
    }

    fn predict<D: Distribution<Real<f64>>>(
        &mut self,
        site: &'static Site,
        distribution: D,
    ) -> Result<D::Value, Rejection> {
        let value = site.locate(distribution.try_draw(self.rng))?;
        self.note(site, Role::Predicted, &value)?;
        Ok(value)
    }

    fn coordinates<L: IntoIterator<Item: ToString>>(
        &mut self,
        dimension: &'static str,
        labels: impl FnOnce() -> L,
    ) {
        let labels = labels().into_iter().map(|label| label.to_string()).collect();
        *self.record.coordinates.labels(dimension) = labels;
    }
}

impl ContextHooks for Trace<'_> {
    fn total(&mut self) -> Settled {
        self.begun.push(self.ran);
        Settled::new()
    }

    fn add_total(&mut self, site: &'static Site, _: Settled) -> Result<(), Rejection> {
        if self.begun.pop() == Some(self.ran) {
            self.without_data(site);
        }
        Ok(())
    }

    fn observe_all<D, I>(
        &mut self,
        site: &'static Site,
        data: I,
        distribution: D,
    ) -> Result<(), Rejection>
    where
        D: Distribution<NumberOf<Self>, Value = I::Item>,
        I: Iterator,
    {
        let data: Vec<D::Value> = data.collect();
        if data.is_empty() {
            self.without_data(site);
        }
        for datum in &data {
            self.observed(site, false, datum, &distribution)?;
        }
        if let Some(statistics) = self.statistics.as_mut().filter(|_| D::HAS_STATISTICS) {
            let mut sums = Vec::new();
            D::sufficient_statistics(data.into_iter(), &mut sums);
            statistics.push(sums.into());
        }
        Ok(())
    }

    fn enter(&mut self, site: &'static Site, is_static: bool) {
        self.around.push(site);
        if !is_static {
            self.statistics = None;
        }
    }

    fn leave(&mut self) {
        self.around.pop();
    }
}
