//! A surrogate on disk: JSON with every coefficient beside its multi-index.

use std::path::Path;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::dataset::{Input, check_count};
use crate::error::SurrogateError;
use crate::pce::Pce;

/// The form in which a surrogate is stored: no number's meaning depends on its position.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PceFile {
    basis: Basis,
    inputs: Vec<Input>,
    outputs: Vec<String>,
    tolerance: f64,
    terms: Vec<Term>,
}

#[derive(Serialize, Deserialize)]
enum Basis {
    #[serde(rename = "orthonormal Legendre")]
    OrthonormalLegendre,
}

/// A multi-index and the coefficients of all outputs.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Term {
    index: Vec<u8>,
    coefficients: Vec<f64>,
}

impl<const D: usize, const M: usize> Serialize for Pce<D, M> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let term = |(index, c): &([u8; D], [f64; M])| Term {
            index: index.to_vec(),
            coefficients: c.to_vec(),
        };
        PceFile {
            basis: Basis::OrthonormalLegendre,
            inputs: self.inputs().to_vec(),
            outputs: self.outputs().to_vec(),
            tolerance: self.tolerance(),
            terms: self.terms().iter().map(term).collect(),
        }
        .serialize(serializer)
    }
}

impl<'de, const D: usize, const M: usize> Deserialize<'de> for Pce<D, M> {
    fn deserialize<S: Deserializer<'de>>(deserializer: S) -> Result<Self, S::Error> {
        PceFile::deserialize(deserializer)?.try_into().map_err(serde::de::Error::custom)
    }
}

impl<const D: usize, const M: usize> TryFrom<PceFile> for Pce<D, M> {
    type Error = SurrogateError;

    fn try_from(file: PceFile) -> Result<Self, SurrogateError> {
        let (inputs, outputs) = (array("inputs", file.inputs)?, array("outputs", file.outputs)?);
        let mut terms = Vec::with_capacity(file.terms.len());
        for term in file.terms {
            terms.push((
                array("degrees in a term", term.index)?,
                array("coefficients in a term", term.coefficients)?,
            ));
        }
        Pce::from_terms(inputs, outputs, terms)?.with_tolerance(file.tolerance)
    }
}

fn array<T, const N: usize>(what: &'static str, items: Vec<T>) -> Result<[T; N], SurrogateError> {
    check_count(what, N, items.len())?;
    let mut items = items.into_iter();
    Ok(std::array::from_fn(|_| items.next().expect("the number of items was checked")))
}

impl<const D: usize, const M: usize> Pce<D, M> {
    /// Writes the expansion as JSON.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), SurrogateError> {
        let path = path.as_ref();
        let text = serde_json::to_string_pretty(self)
            .map_err(|source| SurrogateError::Json { path: path.to_owned(), source })?;
        std::fs::write(path, text)
            .map_err(|source| SurrogateError::Io { path: path.to_owned(), source })
    }

    /// Reads what [`Pce::write`] writes; the terms may stand in any order.
    ///
    /// # Errors
    /// The file cannot be read, is no such JSON, or has other than `D` inputs and `M` outputs.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SurrogateError> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path)
            .map_err(|source| SurrogateError::Io { path: path.to_owned(), source })?;
        serde_json::from_str(&text)
            .map_err(|source| SurrogateError::Json { path: path.to_owned(), source })
    }
}
