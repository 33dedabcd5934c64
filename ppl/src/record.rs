//! The named quantities of a model at one point.

use std::borrow::Cow;

use crate::coordinates::Coordinates;
use crate::density::{FatalError, Rejection};
use crate::site::Site;

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
    /// For parameters: the ends of the prior's support, if it has two finite ones that are not the
    /// quantity's own, or one at which it was truncated.
    pub bounds: Option<(f64, f64)>,
    /// For parameters: the log density of their distribution, summed over the statements executed.
    pub log_prior: f64,
    /// For observed quantities: a new draw from the same distribution, element by element.
    pub replicate: Vec<f64>,
    /// For observed quantities: the log density of each statement executed.
    pub log_likelihood: Vec<f64>,
    /// Names of the dimensions along which the plates around stack.
    plates: Vec<&'static str>,
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
    /// The sum of all `factor`s, if there was one.
    pub(crate) factors: Option<f64>,
    /// Observations whose plates were empty.
    pub(crate) without_data: Vec<String>,
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

    /// The log likelihood there: of everything observed, and every `factor`.
    pub(crate) fn log_likelihood(&self) -> f64 {
        let observed = self.entries.iter().flat_map(|entry| &entry.log_likelihood);
        observed.sum::<f64>() + self.factors.unwrap_or(0.0)
    }

    /// Gives what nested plates stacked a dimension for each of them, where all have labels and
    /// their values are as many as the labels make together.
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
pub(crate) struct Label {
    pub(crate) site: &'static Site,
    /// With those of the submodels around it in front.
    pub(crate) name: Cow<'static, str>,
    /// Whether it, or a submodel around it, stands in a loop.
    pub(crate) stacked: bool,
    /// Names of the dimensions along which it stacks, the innermost last.
    pub(crate) plates: Vec<&'static str>,
}
