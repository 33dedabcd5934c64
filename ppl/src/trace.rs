//! The reading of a model that writes everything down by name.

use std::borrow::Cow;

use rand::RngCore;

use crate::density::Rejection;
use crate::dimensions;
use crate::distribution::{Distribution, Unknown};
use crate::entry::{Entry, Label, Record, Role};
use crate::model::Context;
use crate::reading::{Pool, too_few_coordinates};
use crate::real::Real;
use crate::record::Record as Recordable;
use crate::rows::{Collected, NewRow};
use crate::site::Site;
use crate::terms::Settled;

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
