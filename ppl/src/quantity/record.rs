//! Record of the named quantities of a model at one point.

use std::borrow::Cow;

use crate::density::site::Site;
use crate::density::{FatalError, Rejection};
use crate::quantity::coordinates::Coordinates;

/// Role of a named quantity in the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// Unknown, declared by `let x ~ D`.
    Parameter,
    /// Recorded deterministic quantity, `#[track] let x = …`.
    Tracked,
    /// Prediction, drawn or computed after sampling at each stored draw: `#[predict] let x ~ D` or `#[predict] let x =
    /// …`.
    Predicted,
    /// Observed quantity, conditioned on by `place ~ D`.
    Observed,
}

/// A named quantity and its shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variable {
    /// Name of the quantity in the model.
    pub name: String,
    /// Dimensions of the value; empty for a scalar. Values of statements in a loop are stacked along the first
    /// dimension.
    pub shape: Vec<usize>,
    /// Names of the dimensions, from `#[dims(…)]` or else `<name>_dim_0`, ….
    pub dims: Vec<String>,
    /// Role of the quantity.
    pub role: Role,
}

/// Values of one named quantity at one point.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Name and shape of the quantity.
    pub variable: Variable,
    /// Elements of the value, row-major; the data for observed quantities.
    pub values: Vec<f64>,
    /// Bounds at which the prior of a parameter can truncate the posterior. The bounds are the ends of the prior's
    /// support if both ends are finite and not natural bounds of the quantity (such as 0 and 1 for a share), or the end
    /// at which the prior was truncated. `None` for other quantities and other priors.
    pub bounds: Option<(f64, f64)>,
    /// Log density of the prior of a parameter, summed over the executed statements; 0 for other quantities.
    pub log_prior: f64,
    /// Replicate of an observed quantity, that is, a new draw from the same distribution for every element; empty for
    /// other quantities.
    pub replicate: Vec<f64>,
    /// Log density of every executed observation statement; empty for quantities that are not observed.
    pub log_likelihood: Vec<f64>,
    /// Names of the dimensions along which the surrounding loops of the model (plates) stack the values.
    plates: Vec<&'static str>,
}

/// All named quantities of a model at one point, in the order of the statements.
#[derive(Clone, Debug, Default)]
pub struct Record {
    /// One entry per name.
    pub entries: Vec<Entry>,
    /// The point at which the record was computed, in unconstrained coordinates.
    pub unconstrained: Vec<f64>,
    /// Labels of the entries along dimensions, by the name of the dimension.
    pub coordinates: Coordinates,
    /// Sum of all `factor` terms; `None` if there are no `factor` terms.
    pub(crate) factors: Option<f64>,
    /// Names of observations that were not executed because their plates (loops of the model) were empty.
    pub(crate) without_data: Vec<String>,
}

impl Record {
    /// Returns the entry of the named quantity.
    pub fn get(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.variable.name == name)
    }

    /// Returns the values of the named quantity.
    pub fn values(&self, name: &str) -> Option<&[f64]> {
        self.get(name).map(|entry| entry.values.as_slice())
    }

    /// Returns the replicate of the named observed quantity, that is, data simulated at this point.
    pub fn replicate(&self, name: &str) -> Option<&[f64]> {
        self.get(name).map(|entry| entry.replicate.as_slice())
    }

    /// Returns the log likelihood at this point: the sum of the log densities of all observations
    /// and of all `factor` terms.
    pub(crate) fn log_likelihood(&self) -> f64 {
        let observed = self.entries.iter().flat_map(|entry| &entry.log_likelihood);
        observed.sum::<f64>() + self.factors.unwrap_or(0.0)
    }

    /// Splits the first dimension of values that nested loops of the model (plates) stacked into one dimension per
    /// loop. An entry is split only if the dimensions of all loops have labels and the number of stacked values is
    /// the product of the numbers of labels.
    pub(crate) fn unfold(&mut self) {
        for Entry { variable, plates, .. } in &mut self.entries {
            if plates.len() < 2 {
                continue;
            }
            let lengths = plates.iter().map(|plate| Some(self.coordinates.get(plate)?.len()));
            let Some(lengths) = lengths.collect::<Option<Vec<usize>>>() else { continue };
            if lengths.iter().product::<usize>() == variable.shape[0] {
                variable.shape.splice(..1, lengths);
                variable.dims.splice(..1, plates.iter().map(|&plate| plate.to_owned()));
                plates.clear();
            }
        }
    }

    pub(crate) fn entry(
        &mut self,
        at: &Label,
        role: Role,
        shape: &[usize],
    ) -> Result<&mut Entry, Rejection> {
        let refused = |problem: String| -> Rejection {
            let (location, name) = (at.site.location, at.name.to_string());
            Box::new(FatalError::Name { location, name, problem }).into()
        };
        let existing = self.entries.iter().position(|e| e.variable.name == at.name);
        let Some(index) = existing else {
            let named_dims = at.site.dims;
            if !named_dims.is_empty() && named_dims.len() != shape.len() {
                return Err(refused(format!(
                    "has {} named dimension(s), but its value has the shape {shape:?}",
                    named_dims.len()
                )));
            }
            let mut full = shape.to_vec();
            let mut names: Vec<Option<&str>> = named_dims.iter().copied().map(Some).collect();
            names.resize(shape.len(), None);
            if at.stacked {
                full.insert(0, 1);
                names.insert(0, at.plates.last().copied());
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
                plates: at.plates.clone(),
            });
            let last = self.entries.len() - 1;
            return Ok(&mut self.entries[last]);
        };
        let entry = &mut self.entries[index];
        if entry.variable.role != role || !at.stacked {
            return Err(refused("is used by two statements: rename one of them".to_owned()));
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

/// Identification of a statement in the results.
pub(crate) struct Label {
    pub(crate) site: &'static Site,
    /// Name of the statement, with the names of the surrounding submodels as prefixes.
    pub(crate) name: Cow<'static, str>,
    /// Whether the statement or a surrounding submodel is in a loop.
    pub(crate) stacked: bool,
    /// Names of the dimensions along which the values are stacked, innermost last.
    pub(crate) plates: Vec<&'static str>,
}
