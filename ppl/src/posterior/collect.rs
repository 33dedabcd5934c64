//! Conversion of model records at many points to named columns.

use std::collections::BTreeMap;

use super::error::PosteriorError;
use crate::density::{Location, Rejection};
use crate::quantity::draws::{Group, Values};
use crate::quantity::record::{Entry, Record, Role};

/// Part of a record entry that is collected into a column.
#[derive(Clone, Copy)]
enum Aspect {
    Values,
    Replicate,
    LogLikelihood,
    LogPrior,
}

struct Column {
    name: String,
    shape: Vec<usize>,
    part: Aspect,
    len: usize,
}

impl Column {
    fn new(entry: &Entry, part: Aspect) -> Self {
        let mut column = Self {
            name: entry.variable.name.clone(),
            shape: entry.variable.shape.clone(),
            part,
            len: 0,
        };
        column.len = column.pick(entry).len();
        if let Aspect::LogLikelihood = part {
            // the log-likelihood has only the dimensions of the loops around the statement; the number of its
            // elements shows how many dimensions these are
            let mut lengths = column.shape.iter().scan(1, |all, &length| {
                *all *= length;
                Some(*all)
            });
            let plates = lengths.position(|all| all == column.len).map_or(0, |last| last + 1);
            column.shape.truncate(plates);
        }
        if let Aspect::LogPrior = part {
            column.shape.clear();
        }
        column
    }

    fn pick<'e>(&self, entry: &'e Entry) -> &'e [f64] {
        match self.part {
            Aspect::Values => &entry.values,
            Aspect::Replicate => &entry.replicate,
            Aspect::LogLikelihood => &entry.log_likelihood,
            Aspect::LogPrior => std::slice::from_ref(&entry.log_prior),
        }
    }
}

/// Columns of the four groups: posterior, predictive, log-likelihood and log-prior.
pub(crate) struct Columns([Vec<Column>; 4]);

impl Columns {
    pub(crate) fn new(template: &Record) -> Self {
        let columns = |choose: fn(Role) -> Option<Aspect>| {
            let entries = template.entries.iter();
            entries.filter_map(|e| Some(Column::new(e, choose(e.variable.role)?))).collect()
        };
        Self([
            columns(|role| match role {
                Role::Parameter | Role::Tracked => Some(Aspect::Values),
                _ => None,
            }),
            columns(|role| match role {
                Role::Predicted => Some(Aspect::Values),
                Role::Observed => Some(Aspect::Replicate),
                _ => None,
            }),
            columns(|role| (role == Role::Observed).then_some(Aspect::LogLikelihood)),
            columns(|role| (role == Role::Parameter).then_some(Aspect::LogPrior)),
        ])
    }

    fn columns(&self) -> impl Iterator<Item = &Column> {
        self.0.iter().flatten()
    }

    /// Joins the collected columns of all chains into groups.
    pub(crate) fn groups(&self, collected_by_chain: Vec<Collected>, draws: usize) -> [Group; 4] {
        let mut data =
            collected_by_chain.iter().fold(Vec::new(), |mut data: Vec<Vec<f64>>, collected| {
                data.resize(collected.columns.len(), Vec::new());
                for (all, column) in data.iter_mut().zip(&collected.columns) {
                    all.extend_from_slice(column);
                }
                data
            });
        let mut data = data.drain(..);
        self.0.each_ref().map(|columns| Group {
            chains: collected_by_chain.len(),
            draws,
            variables: columns
                .iter()
                .zip(&mut data)
                .map(|(c, data)| Values { name: c.name.clone(), shape: c.shape.clone(), data })
                .collect(),
        })
    }
}

/// Collected columns of one chain, in the order of [`Columns`].
pub(crate) struct Collected {
    columns: Vec<Vec<f64>>,
    pub(crate) rejected: BTreeMap<Location, u64>,
}

impl Collected {
    pub(crate) fn new(plan: &Columns) -> Self {
        Self { columns: plan.columns().map(|_| Vec::new()).collect(), rejected: BTreeMap::new() }
    }

    /// Adds the record of one draw of the chain with index `chain`. If a statement rejected the draw, the values of
    /// all later statements are NaN.
    pub(crate) fn add(
        &mut self,
        plan: &Columns,
        (record, outcome): (Record, Result<(), Rejection>),
        chain: usize,
    ) -> Result<(), PosteriorError> {
        if let Err(rejection) = &outcome {
            let Some(location) = rejection.location() else {
                return Err(PosteriorError::Stopped { chain, source: rejection.clone() });
            };
            *self.rejected.entry(location).or_insert(0) += 1;
        }
        for (column, data) in plan.columns().zip(&mut self.columns) {
            let values = record.get(&column.name).map(|entry| column.pick(entry));
            match values.filter(|values| values.len() == column.len) {
                Some(values) => data.extend_from_slice(values),
                None if outcome.is_err() => data.resize(data.len() + column.len, f64::NAN),
                None => {
                    return Err(PosteriorError::ChangingShape { name: column.name.clone() });
                }
            }
        }
        Ok(())
    }
}
