//! Named quantities of a model: shapes, dimensions, labels, roles.

use std::collections::{BTreeMap, BTreeSet};

use crate::quantity::coordinates::Coordinates;
use crate::quantity::draws::{element_names, labelled_names};
use crate::quantity::record::{Entry, Role, Variable};

/// The named quantities of a model, in the order of their statements.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Layout {
    /// Number of unconstrained coordinates.
    pub dim: usize,
    /// All quantities with their names, shapes, dimensions and roles.
    pub variables: Vec<Variable>,
    /// Labels of the entries along dimensions, by the name of the dimension.
    pub coordinates: Coordinates,
    /// Units by the name of the quantity: one unit for the quantity, or one unit for each entry along its last
    /// dimension.
    pub units: BTreeMap<String, Vec<String>>,
}

impl Layout {
    /// Variables with the given role.
    pub fn with_role(&self, role: Role) -> impl Iterator<Item = &Variable> {
        self.variables.iter().filter(move |v| v.role == role)
    }

    /// Names of all elements of a quantity, such as `sd[north]` and `sd[south]`. Labels replace the indices of a
    /// dimension if all its labels are distinct.
    pub fn labelled(&self, variable: &Variable) -> Vec<String> {
        let labels: Vec<Option<&Vec<String>>> = variable
            .dims
            .iter()
            .zip(&variable.shape)
            .map(|(dimension, &length)| {
                let labels = self.coordinates.get(dimension)?;
                let distinct: BTreeSet<&String> = labels.iter().collect();
                (distinct.len() == length).then_some(labels)
            })
            .collect();
        labelled_names(&variable.name, &variable.shape, |dimension, index| {
            labels[dimension].map_or_else(|| index.to_string(), |labels| labels[index].clone())
        })
    }

    /// Converts an element name with labels to the name with indices.
    pub(crate) fn index_of(&self, labelled: &str) -> Option<String> {
        let name = labelled.split('[').next()?;
        let variable = self.variables.iter().find(|v| v.name == name)?;
        let index = self.labelled(variable).iter().position(|element| element == labelled)?;
        element_names(name, &variable.shape).into_iter().nth(index)
    }

    /// Sets the labels along one dimension of a quantity.
    pub(crate) fn label(
        &mut self,
        name: &str,
        dimension: usize,
        labels: &[&str],
    ) -> Result<(), LabelError> {
        let variable = self.named(name)?;
        let Some(&entries) = variable.shape.get(dimension) else {
            let (name, dimensions) = (name.to_owned(), variable.shape.len());
            return Err(LabelError::NoDimension { name, dimension, dimensions });
        };
        let named = &variable.dims[dimension];
        check_length(named, variable, entries, labels.len())?;
        let labels = labels.iter().map(|&label| label.to_owned()).collect();
        *self.coordinates.labels(&named.clone()) = labels;
        Ok(())
    }

    /// Sets the units of a quantity.
    pub(crate) fn set_units(&mut self, name: &str, units: &[&str]) -> Result<(), LabelError> {
        let variable = self.named(name)?;
        if let ([_, _, ..], Some(dimension), Some(&entries)) =
            (units, variable.dims.last(), variable.shape.last())
        {
            check_length(dimension, variable, entries, units.len())?;
        }
        let units = units.iter().map(|&unit| unit.to_owned()).collect();
        self.units.insert(name.to_owned(), units);
        Ok(())
    }

    fn named(&self, name: &str) -> Result<&Variable, LabelError> {
        let names =
            || self.variables.iter().map(|v| v.name.as_str()).collect::<Vec<_>>().join(", ");
        let matching = self.variables.iter().find(|v| v.name == name);
        matching.ok_or_else(|| LabelError::NoQuantity { name: name.to_owned(), known: names() })
    }
}

/// Error of labels or units that do not fit the model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LabelError {
    /// The model has no quantity with this name.
    #[error("the model has no quantity `{name}`; it has {known}")]
    NoQuantity {
        /// Requested name.
        name: String,
        /// Names of the existing quantities.
        known: String,
    },
    /// The requested dimension does not exist: the quantity has fewer dimensions.
    #[error(
        "`{name}` has {dimensions} dimension(s), counted from 0: there is no dimension {dimension}"
    )]
    NoDimension {
        /// Name of the quantity.
        name: String,
        /// Index of the requested dimension.
        dimension: usize,
        /// Number of dimensions of the quantity.
        dimensions: usize,
    },
    /// The number of labels is wrong.
    #[error("dimension `{dimension}` has {entries} entries in `{name}` but {labels} labels")]
    Length {
        /// Name of the dimension.
        dimension: String,
        /// Name of the quantity.
        name: String,
        /// Number of entries along the dimension.
        entries: usize,
        /// Number of labels given.
        labels: usize,
    },
}

fn check_length(
    dimension: &str,
    variable: &Variable,
    entries: usize,
    labels: usize,
) -> Result<(), LabelError> {
    if labels == entries {
        return Ok(());
    }
    let (dimension, name) = (dimension.to_owned(), variable.name.clone());
    Err(LabelError::Length { dimension, name, entries, labels })
}

/// Checks three conditions: a named dimension has the same length in all quantities; the number of its labels, if
/// any, equals this length; and no quantity has the name of a dimension.
pub(crate) fn check(entries: &[Entry], coordinates: &Coordinates) -> Result<(), String> {
    let mut lengths: BTreeMap<&str, (&str, usize)> = BTreeMap::new();
    for variable in entries.iter().map(|entry| &entry.variable) {
        for (dimension, &length) in variable.dims.iter().zip(&variable.shape) {
            if let Some(labels) = coordinates.get(dimension) {
                check_length(dimension, variable, length, labels.len())
                    .map_err(|error| error.to_string())?;
            }
            let (first, other) = *lengths.entry(dimension).or_insert((&variable.name, length));
            if other != length {
                return Err(format!(
                    "dimension `{dimension}` has {other} entries in `{first}` and {length} in \
                     `{}`: give one of them another name",
                    variable.name
                ));
            }
        }
    }
    match entries.iter().find(|entry| lengths.contains_key(entry.variable.name.as_str())) {
        None => Ok(()),
        Some(entry) => Err(format!(
            "`{}` is the name of a quantity and of a dimension: rename one",
            entry.variable.name
        )),
    }
}
