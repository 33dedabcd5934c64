//! Named dimensions of quantities, and labels of the entries along them.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Index;

use crate::bound::Layout;
use crate::entry::{Entry, Variable};
use crate::group::{element_names, labelled_names};
use crate::posterior::Posterior;

/// Labels that fit no dimension.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LabelError {
    /// No quantity of this name.
    #[error("the model has no quantity `{name}`; it has {known}")]
    NoQuantity {
        /// The name asked for.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// Fewer dimensions.
    #[error(
        "`{name}` has {dimensions} dimension(s), counted from 0: there is no dimension {dimension}"
    )]
    NoDimension {
        /// The quantity.
        name: String,
        /// The dimension asked for.
        dimension: usize,
        /// How many there are.
        dimensions: usize,
    },
    /// Another number of labels.
    #[error("dimension `{dimension}` has {entries} entries in `{name}` but {labels} labels")]
    Length {
        /// The dimension's name.
        dimension: String,
        /// The quantity.
        name: String,
        /// Entries along it.
        entries: usize,
        /// Labels given.
        labels: usize,
    },
}

/// Labels of the entries along dimensions, by the name of the dimension.
///
/// In the order of the names. No map: every crate with a model compiles the destructor anew.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Coordinates(Vec<(String, Vec<String>)>);

impl Coordinates {
    fn position(&self, dimension: &str) -> Result<usize, usize> {
        self.0.binary_search_by(|(name, _)| name.as_str().cmp(dimension))
    }

    /// No dimension has labels.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The labels along `dimension`.
    pub fn get(&self, dimension: &str) -> Option<&Vec<String>> {
        self.position(dimension).ok().map(|index| &self.0[index].1)
    }

    /// All dimensions that have labels.
    pub fn iter(&self) -> std::slice::Iter<'_, (String, Vec<String>)> {
        self.0.iter()
    }

    /// The labels along `dimension`, to be written.
    pub(crate) fn labels(&mut self, dimension: &str) -> &mut Vec<String> {
        let index = self.position(dimension).unwrap_or_else(|index| {
            self.0.insert(index, (dimension.to_owned(), Vec::new()));
            index
        });
        &mut self.0[index].1
    }
}

impl<'a> IntoIterator for &'a Coordinates {
    type Item = &'a (String, Vec<String>);
    type IntoIter = std::slice::Iter<'a, (String, Vec<String>)>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl Index<&str> for Coordinates {
    type Output = Vec<String>;

    /// # Panics
    /// If the dimension has no labels.
    fn index(&self, dimension: &str) -> &Vec<String> {
        self.get(dimension).expect("a dimension with labels")
    }
}

impl Layout {
    /// The names of all numbers of a quantity, with labels for indices where its dimensions have
    /// them, each its own.
    pub(crate) fn labelled(&self, variable: &Variable) -> Vec<String> {
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

    /// The name with indices of the number with this name with labels.
    pub(crate) fn index_of(&self, labelled: &str) -> Option<String> {
        let name = labelled.split('[').next()?;
        let variable = self.variables.iter().find(|v| v.name == name)?;
        let index = self.labelled(variable).iter().position(|own| own == labelled)?;
        element_names(name, &variable.shape).into_iter().nth(index)
    }
}

impl Posterior {
    /// Labels the entries along one dimension of a quantity, in tables and exports:
    /// `posterior.label("mean", 0, &["slope", "peak force", "displacement at peak"])?`.
    ///
    /// A dimension that was named in the model, by `#[dims(…)]`, gets the labels wherever it
    /// stands.
    ///
    /// # Errors
    /// [`LabelError`] for a name or dimension that does not exist, or a wrong number of labels.
    pub fn label(
        &mut self,
        name: &str,
        dimension: usize,
        labels: &[&str],
    ) -> Result<(), LabelError> {
        let variables = &self.layout.variables;
        let Some(variable) = variables.iter().find(|v| v.name == name) else {
            let known = variables.iter().map(|v| v.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(LabelError::NoQuantity { name: name.to_owned(), known });
        };
        let Some(&entries) = variable.shape.get(dimension) else {
            let (name, dimensions) = (name.to_owned(), variable.shape.len());
            return Err(LabelError::NoDimension { name, dimension, dimensions });
        };
        let named = variable.dims[dimension].clone();
        check_length(&named, variable, entries, labels.len())?;
        *self.layout.coordinates.labels(&named) =
            labels.iter().map(|&label| label.to_owned()).collect();
        Ok(())
    }
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

/// Whether dimensions have one length each, as many labels as entries, and names of their own.
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
