//! The reading of a model that writes everything down by name.

use rand::Rng;

use crate::density::Rejection;
use crate::distribution::{Distribution, Unknown};
use crate::model::{Context, Site};
use crate::reading::too_few_coordinates;
use crate::real::Real;
use crate::record::Record as Recordable;

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

    fn entry(
        &mut self,
        site: &'static Site,
        role: Role,
        shape: &[usize],
    ) -> Result<&mut Entry, Rejection> {
        let found = self.entries.iter().position(|e| e.variable.name == site.name);
        let Some(index) = found else {
            let mut full = shape.to_vec();
            if site.repeated {
                full.insert(0, 1);
            }
            let variable = Variable { name: site.name.to_owned(), shape: full, role };
            self.entries.push(Entry {
                variable,
                values: Vec::new(),
                bounds: None,
                replicate: Vec::new(),
                log_likelihood: Vec::new(),
            });
            let last = self.entries.len() - 1;
            return Ok(&mut self.entries[last]);
        };
        let entry = &mut self.entries[index];
        let problem = if entry.variable.role != role || !site.repeated {
            Some("stands for two statements: rename one".to_owned())
        } else if entry.variable.shape[1..] != *shape {
            Some(format!(
                "changes its shape from {:?} to {shape:?} between iterations",
                &entry.variable.shape[1..]
            ))
        } else {
            None
        };
        if let Some(problem) = problem {
            let message = format!("{}: the name `{}` {problem}", site.place, site.name);
            return Err(Rejection::Fatal { message });
        }
        entry.variable.shape[0] += 1;
        Ok(entry)
    }
}

/// Where a trace takes its unknowns from.
pub(crate) enum Source<'y> {
    /// Draws from the prior.
    Prior,
    /// Unconstrained coordinates.
    Point(std::slice::Iter<'y, f64>),
}

/// Records every statement; predictions and replicates are drawn with `rng`.
pub(crate) struct Trace<'y, G> {
    pub(crate) source: Source<'y>,
    pub(crate) rng: G,
    pub(crate) record: Record,
}

impl<'y, G: Rng> Trace<'y, G> {
    pub(crate) fn new(source: Source<'y>, rng: G) -> Self {
        Self { source, rng, record: Record::default() }
    }

    fn write(
        &mut self,
        site: &'static Site,
        role: Role,
        value: &(impl Recordable + ?Sized),
    ) -> Result<&mut Entry, Rejection> {
        let entry = self.record.entry(site, role, &value.shape())?;
        value.flatten(&mut entry.values);
        Ok(entry)
    }
}

impl<G: Rng> Context for Trace<'_, G> {
    type Number = f64;

    fn predicts(&self) -> bool {
        true
    }

    fn unknown<D: Unknown<Real<f64>>>(
        &mut self,
        site: &'static Site,
        distribution: D,
    ) -> Result<D::Value, Rejection> {
        distribution.validate().map_err(|error| site.rejection(error))?;
        let value = match &mut self.source {
            Source::Prior => distribution.draw(&mut self.rng),
            Source::Point(coordinates) => {
                let mut missing = false;
                let mut next = || {
                    Real(coordinates.next().copied().unwrap_or_else(|| {
                        missing = true;
                        f64::NAN
                    }))
                };
                let (value, _) = distribution.constrain(&mut next, false);
                if missing {
                    return Err(too_few_coordinates(site));
                }
                value
            }
        };
        distribution.unconstrain(&value, &mut self.record.unconstrained);
        self.write(site, Role::Parameter, &value)?.bounds = distribution.bounds();
        Ok(value)
    }

    fn observe<D: Distribution<Real<f64>>>(
        &mut self,
        site: &'static Site,
        datum: D::Value,
        distribution: D,
    ) -> Result<(), Rejection> {
        distribution.validate().map_err(|error| site.rejection(error))?;
        let replicate = distribution.draw(&mut self.rng);
        let log_likelihood = distribution.ln_density(&datum);
        let entry = self.write(site, Role::Observed, &datum)?;
        replicate.flatten(&mut entry.replicate);
        entry.log_likelihood.push(log_likelihood.0);
        Ok(())
    }

    fn factor(&mut self, _: &'static Site, _: Real<f64>) -> Result<(), Rejection> {
        Ok(())
    }

    fn track<T: Recordable + ?Sized>(
        &mut self,
        site: &'static Site,
        value: &T,
    ) -> Result<(), Rejection> {
        self.write(site, Role::Tracked, value)?;
        Ok(())
    }

    fn track_prediction<T: Recordable + ?Sized>(
        &mut self,
        site: &'static Site,
        value: &T,
    ) -> Result<(), Rejection> {
        self.write(site, Role::Predicted, value)?;
        Ok(())
    }

    fn predict<D: Distribution<Real<f64>>>(
        &mut self,
        site: &'static Site,
        distribution: D,
    ) -> Result<D::Value, Rejection> {
        distribution.validate().map_err(|error| site.rejection(error))?;
        let value = distribution.draw(&mut self.rng);
        self.write(site, Role::Predicted, &value)?;
        Ok(value)
    }
}
