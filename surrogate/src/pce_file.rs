//! The file format of a surrogate: JSON with every multi-index and its coefficients.

use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::dataset::Input;
use crate::dyn_pce::DynPce;
use crate::error::SurrogateError;
use crate::pce::Pce;
use crate::scale::Scale;

/// The stored form of a surrogate. Every term has its multi-index, so that the order of the terms does not
/// matter.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PceFile {
    basis: Basis,
    inputs: Vec<Input>,
    outputs: Vec<String>,
    tolerance: f64,
    /// Names of the inputs and outputs on a logarithmic scale. Older files do not have this field.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    logarithmic: Vec<String>,
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

impl Serialize for DynPce {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let term = |(index, c): &(Vec<u8>, Vec<f64>)| Term {
            index: index.clone(),
            coefficients: c.clone(),
        };
        PceFile {
            basis: Basis::OrthonormalLegendre,
            inputs: self.inputs().to_vec(),
            outputs: self.outputs().to_vec(),
            tolerance: self.tolerance(),
            logarithmic: self.logarithmic(),
            terms: self.terms().iter().map(term).collect(),
        }
        .serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for DynPce {
    fn deserialize<S: Deserializer<'de>>(deserializer: S) -> Result<Self, S::Error> {
        let PceFile { inputs, outputs, tolerance, logarithmic, terms, .. } =
            PceFile::deserialize(deserializer)?;
        DynPce::from_terms(inputs, outputs, terms.into_iter().map(|t| (t.index, t.coefficients)))
            .and_then(|pce| pce.with_logarithmic(&logarithmic))
            .and_then(|pce| pce.with_tolerance(tolerance))
            .map_err(serde::de::Error::custom)
    }
}

impl<const D: usize, const M: usize> Serialize for Pce<D, M> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        DynPce::serialize(self, serializer)
    }
}

impl<'de, const D: usize, const M: usize> Deserialize<'de> for Pce<D, M> {
    fn deserialize<S: Deserializer<'de>>(deserializer: S) -> Result<Self, S::Error> {
        DynPce::deserialize(deserializer)?.try_into().map_err(serde::de::Error::custom)
    }
}

impl DynPce {
    /// The names of the inputs and outputs on a logarithmic scale.
    pub fn logarithmic(&self) -> Vec<String> {
        let inputs = self.inputs().iter().map(|i| &i.name).zip(self.input_scales());
        let outputs = self.outputs().iter().zip(self.output_scales().iter().copied());
        let all = inputs.chain(outputs).filter(|(_, scale)| *scale == Scale::Log);
        all.map(|(name, _)| name.clone()).collect()
    }

    /// Puts the named inputs and outputs on a logarithmic scale, and all other inputs and outputs
    /// on a linear scale.
    fn with_logarithmic(self, names: &[String]) -> Result<Self, SurrogateError> {
        let columns: Vec<&String> =
            self.inputs().iter().map(|i| &i.name).chain(self.outputs()).collect();
        if let Some(name) = names.iter().find(|name| !columns.contains(name)) {
            let known_names =
                columns.into_iter().map(String::as_str).collect::<Vec<_>>().join(", ");
            return Err(SurrogateError::UnknownName { name: name.clone(), known: known_names });
        }
        let scale = |name| if names.contains(name) { Scale::Log } else { Scale::Linear };
        let inputs: Vec<Scale> = self.inputs().iter().map(|i| scale(&i.name)).collect();
        let outputs: Vec<Scale> = self.outputs().iter().map(scale).collect();
        self.with_scales(&inputs, &outputs)
    }

    /// Writes the expansion as JSON.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), SurrogateError> {
        let path = path.as_ref();
        let text = serde_json::to_string_pretty(self)
            .map_err(|source| SurrogateError::Json { path: path.to_owned(), source })?;
        std::fs::write(path, text)
            .map_err(|source| SurrogateError::Io { path: path.to_owned(), source })
    }

    /// Reads a file that [`DynPce::write`] wrote; the terms may be in any order.
    ///
    /// # Errors
    /// If the file cannot be read or is not the JSON of an expansion.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SurrogateError> {
        read(path.as_ref())
    }
}

impl<const D: usize, const M: usize> Pce<D, M> {
    /// Reads a file that [`DynPce::write`] wrote; the terms may be in any order.
    ///
    /// # Errors
    /// If the file cannot be read, is not the JSON of an expansion, or does not have `D` inputs and `M`
    /// outputs.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SurrogateError> {
        read(path.as_ref())
    }
}

fn read<T: DeserializeOwned>(path: &Path) -> Result<T, SurrogateError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| SurrogateError::Io { path: path.to_owned(), source })?;
    serde_json::from_str(&text)
        .map_err(|source| SurrogateError::Json { path: path.to_owned(), source })
}
