//! The reading of a model that writes everything down by name.

use std::borrow::Cow;

use rand::RngCore;

use crate::density::Rejection;
use crate::dimensions::{self, Coordinates};
use crate::distribution::{Distribution, Unknown};
use crate::model::Context;
use crate::reading::{Pool, too_few_coordinates};
use crate::real::Real;
use crate::record::Record as Recordable;
use crate::rows::{Collected, NewRow};
use crate::site::Site;
use crate::terms::Settled;

/// What a named quantity is to the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// Unknown: `let x ~ D`.
    Parameter,
    /// Deterministic and recorded: `#[track] let x = …`.
    Tracked,
    /// Drawn or computed on finished draws: `#[predict] let x ~ D`, `#[predict] let x = …`.
    Predicted,
    /// Conditioned on: `place ~ D`.
    Observed,
}

/// A named quantity and its shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variable {
    /// Name in the model.
    pub name: String,
    /// Dimensions, empty for a number; statements in loops stack along the first.
    pub shape: Vec<usize>,
    /// Names of the dimensions: those of `#[dims(…)]`, or `<name>_dim_0`, ….
    pub dims: Vec<String>,
    /// What it is.
    pub role: Role,
}

/// The values of one named quantity at one point.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Name and shape.
    pub variable: Variable,
    /// Elements, last dimension fastest. For observed quantities: the data.
    pub values: Vec<f64>,
    /// For parameters: the ends of the prior's support, if it has two finite ones.
    pub bounds: Option<(f64, f64)>,
    /// For parameters: the log density of their distribution, summed over the statements executed.
    pub log_prior: f64,
    /// For observed quantities: a new draw from the same distribution, element by element.
    pub replicate: Vec<f64>,
    /// For observed quantities: the log density of each statement executed.
    pub log_likelihood: Vec<f64>,
}

/// All named quantities of a model at one point, in the order of their statements.
#[derive(Clone, Debug, Default)]
pub struct Record {
    /// One a name.
    pub entries: Vec<Entry>,
    /// The point in unconstrained coordinates.
    pub unconstrained: Vec<f64>,
    /// Labels of the entries along dimensions, by the name of the dimension.
    pub coordinates: Coordinates,
}

impl Record {
    /// The entry of this name.
    pub fn get(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.variable.name == name)
    }

    /// The values of this name.
    pub fn values(&self, name: &str) -> Option<&[f64]> {
        self.get(name).map(|entry| entry.values.as_slice())
    }

    /// The replicate of the observed quantity of this name: data simulated from this point.
    pub fn replicate(&self, name: &str) -> Option<&[f64]> {
        self.get(name).map(|entry| entry.replicate.as_slice())
    }

    fn entry(&mut self, at: &Label, role: Role, shape: &[usize]) -> Result<&mut Entry, Rejection> {
        let refused = |problem: String| {
            let message = format!("{}: the name `{}` {problem}", at.site.place, at.name);
            Rejection::Fatal { message }
        };
        let found = self.entries.iter().position(|e| e.variable.name == at.name);
        let Some(index) = found else {
            let own = at.site.dims;
            if !own.is_empty() && own.len() != shape.len() {
                return Err(refused(format!(
                    "has {} named dimension(s), but its value has the shape {shape:?}",
                    own.len()
                )));
            }
            let mut full = shape.to_vec();
            let mut names: Vec<Option<&str>> = own.iter().copied().map(Some).collect();
            names.resize(shape.len(), None);
            if at.stacked {
                full.insert(0, 1);
                names.insert(0, at.plate);
            }
            let dims = names.iter().enumerate().map(|(k, name)| {
                name.map_or_else(|| format!("{}_dim_{k}", at.name), str::to_owned)
            });
            let variable =
                Variable { name: at.name.to_string(), shape: full, dims: dims.collect(), role };
            self.entries.push(Entry {
                variable,
                values: Vec::new(),
                bounds: None,
                log_prior: 0.0,
                replicate: Vec::new(),
                log_likelihood: Vec::new(),
            });
            let last = self.entries.len() - 1;
            return Ok(&mut self.entries[last]);
        };
        let entry = &mut self.entries[index];
        if entry.variable.role != role || !at.stacked {
            return Err(refused("stands for two statements: rename one".to_owned()));
        }
        if entry.variable.shape[1..] != *shape {
            return Err(refused(format!(
                "changes its shape from {:?} to {shape:?} between iterations",
                &entry.variable.shape[1..]
            )));
        }
        entry.variable.shape[0] += 1;
        Ok(entry)
    }
}

/// A statement as it stands in the results.
struct Label {
    site: &'static Site,
    /// With those of the submodels around it in front.
    name: Cow<'static, str>,
    /// Whether it, or a submodel around it, stands in a loop.
    stacked: bool,
    plate: Option<&'static str>,
}

/// Where a trace takes its unknowns from.
pub(crate) enum Source<'y> {
    /// Draws from the prior.
    Prior,
    /// Unconstrained coordinates.
    Point(std::slice::Iter<'y, f64>),
}

/// Records every statement; predictions and replicates are drawn with `rng`.
pub(crate) struct Trace<'y> {
    source: Source<'y>,
    rng: &'y mut dyn RngCore,
    pub(crate) record: Record,
    /// Places of the submodels around the current statement.
    around: Vec<&'static Site>,
    /// What suffices of observations, if it is wanted.
    pub(crate) pools: Option<Vec<Pool>>,
    /// The rows of the current loop.
    rows: Collected,
}

impl<'y> Trace<'y> {
    pub(crate) fn new(source: Source<'y>, rng: &'y mut dyn RngCore) -> Self {
        let (record, rows) = (Record::default(), Collected::default());
        Self { source, rng, record, around: Vec::new(), pools: None, rows }
    }

    /// What was recorded, if its dimensions fit together.
    pub(crate) fn finish(self) -> Result<Record, Rejection> {
        dimensions::check(&self.record.entries, &self.record.coordinates)
            .map_err(|message| Rejection::Fatal { message })?;
        Ok(self.record)
    }

    fn label(&self, site: &'static Site) -> Label {
        let mut label = Label {
            site,
            name: Cow::Borrowed(site.name),
            stacked: site.repeated,
            plate: site.plate,
        };
        for part in self.around.iter().rev() {
            label.name = format!("{}.{}", part.name, label.name).into();
            if !label.stacked {
                (label.stacked, label.plate) = (part.repeated, part.plate);
            }
        }
        label
    }

    fn write(
        &mut self,
        at: &Label,
        role: Role,
        value: &(impl Recordable + ?Sized),
    ) -> Result<&mut Entry, Rejection> {
        let entry = self.record.entry(at, role, &value.shape())?;
        value.flatten(&mut entry.values);
        Ok(entry)
    }

    fn declared<D: Unknown<Real<f64>>>(
        &mut self,
        at: &Label,
        distribution: D,
    ) -> Result<D::Value, Rejection> {
        distribution.validate().map_err(|error| at.site.rejection(error))?;
        let value = match &mut self.source {
            Source::Prior => distribution.draw(self.rng),
            Source::Point(coordinates) => {
                let mut missing = false;
                let mut next = || {
                    Real(coordinates.next().copied().unwrap_or_else(|| {
                        missing = true;
                        f64::NAN
                    }))
                };
                let value = distribution.constrain(&mut next, false, &mut Settled::new(1.0));
                if missing {
                    return Err(too_few_coordinates(at.site));
                }
                value
            }
        };
        distribution.unconstrain(&value, &mut self.record.unconstrained);
        let log_prior = distribution.ln_density(&value);
        let entry = self.write(at, Role::Parameter, &value)?;
        entry.bounds = distribution.bounds();
        entry.log_prior += log_prior.0;
        Ok(value)
    }

    fn observed<D: Distribution<Real<f64>>>(
        &mut self,
        at: &Label,
        datum: &D::Value,
        distribution: D,
    ) -> Result<(), Rejection> {
        distribution.validate().map_err(|error| at.site.rejection(error))?;
        let replicate = distribution.draw(self.rng);
        let log_likelihood = distribution.ln_density(datum);
        let entry = self.write(at, Role::Observed, datum)?;
        replicate.flatten(&mut entry.replicate);
        entry.log_likelihood.push(log_likelihood.0);
        Ok(())
    }
}

impl Context for Trace<'_> {
    type Number = f64;
    const BINDS: bool = true;

    fn predicts(&self) -> bool {
        true
    }

    fn unknown<D: Unknown<Real<f64>>>(
        &mut self,
        site: &'static Site,
        distribution: D,
    ) -> Result<D::Value, Rejection> {
        self.declared(&self.label(site), distribution)
    }

    fn observe<D: Distribution<Real<f64>>>(
        &mut self,
        site: &'static Site,
        datum: D::Value,
        distribution: D,
    ) -> Result<(), Rejection> {
        self.observed(&self.label(site), &datum, distribution)
    }

    fn observe_all<D, I>(
        &mut self,
        site: &'static Site,
        data: I,
        distribution: D,
    ) -> Result<(), Rejection>
    where
        D: Distribution<Real<f64>, Value = I::Item>,
        I: Iterator,
    {
        let data: Vec<D::Value> = data.collect();
        for datum in &data {
            self.observed(&self.label(site), datum, distribution.clone())?;
        }
        if let Some(pools) = self.pools.as_mut().filter(|_| D::POOLS) {
            let mut sums = Vec::new();
            D::sum_up(data.into_iter(), &mut sums);
            pools.push(Pool::Sums(sums.into()));
        }
        Ok(())
    }

    fn add_row<D: Distribution<Real<f64>>>(
        &mut self,
        _: &D,
        datum: D::Value,
        tell: impl FnOnce(&mut NewRow),
    ) {
        if self.pools.is_none() {
            return;
        }
        if !D::LEAST_SQUARES {
            self.rows.refuse();
            return;
        }
        let mut row = NewRow::default();
        tell(&mut row);
        let mut numbers = Vec::new();
        datum.flatten(&mut numbers);
        row.datum(&numbers);
        self.rows.push(row);
    }

    fn end_rows(&mut self) {
        if let Some(pools) = &mut self.pools {
            let rows = std::mem::take(&mut self.rows).finish();
            pools.push(rows.map_or(Pool::Each, Pool::Rows));
        }
    }

    /// Missing values are `y.missing`, the others `y`; both know which entries they are.
    fn impute<D: Unknown<Real<f64>>>(
        &mut self,
        site: &'static Site,
        datum: Option<D::Value>,
        distribution: D,
    ) -> Result<D::Value, Rejection> {
        let mut at = self.label(site);
        let missing = format!("{}.missing", at.name);
        if at.stacked {
            // neither has an entry for all that the plate stacks
            let plate = at.plate.take();
            let entries = &self.record.entries;
            let stacked = |e: &&Entry| e.variable.name == at.name || e.variable.name == missing;
            let index: usize = entries.iter().filter(stacked).map(|e| e.variable.shape[0]).sum();
            let coordinates = &mut self.record.coordinates;
            let labels = plate.and_then(|plate| coordinates.get(plate));
            let own = labels.and_then(|labels| labels.get(index).cloned());
            let name = if datum.is_some() { &at.name } else { missing.as_str() };
            let labels = coordinates.entry(format!("{name}_dim_0")).or_default();
            labels.push(own.unwrap_or_else(|| index.to_string()));
        }
        match datum {
            Some(x) => self.observed(&at, &x, distribution).map(|()| x),
            None => {
                at.name = missing.into();
                self.declared(&at, distribution)
            }
        }
    }

    fn factor(&mut self, _: &'static Site, _: Real<f64>) -> Result<(), Rejection> {
        Ok(())
    }

    fn track<T: Recordable + ?Sized>(
        &mut self,
        site: &'static Site,
        value: &T,
    ) -> Result<(), Rejection> {
        self.write(&self.label(site), Role::Tracked, value)?;
        Ok(())
    }

    fn track_prediction<T: Recordable + ?Sized>(
        &mut self,
        site: &'static Site,
        value: &T,
    ) -> Result<(), Rejection> {
        self.write(&self.label(site), Role::Predicted, value)?;
        Ok(())
    }

    fn predict<D: Distribution<Real<f64>>>(
        &mut self,
        site: &'static Site,
        distribution: D,
    ) -> Result<D::Value, Rejection> {
        distribution.validate().map_err(|error| site.rejection(error))?;
        let value = distribution.draw(self.rng);
        self.write(&self.label(site), Role::Predicted, &value)?;
        Ok(value)
    }

    fn coordinates<L: IntoIterator<Item: ToString>>(
        &mut self,
        dimension: &'static str,
        labels: impl FnOnce() -> L,
    ) {
        let labels = labels().into_iter().map(|label| label.to_string()).collect();
        self.record.coordinates.insert(dimension.to_owned(), labels);
    }

    fn enter(&mut self, site: &'static Site) {
        self.around.push(site);
    }

    fn leave(&mut self) {
        self.around.pop();
    }
}
