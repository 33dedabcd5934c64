//! Storage of chains in files.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::sampler::draws::chains::Chains;
use crate::sampler::hamiltonian::trajectory::DEPTHS;

/// Format identifier at the beginning of a file of chains.
const FORMAT: &str = "ppl chains 1";

#[derive(Deserialize)]
struct Header {
    format: String,
}

#[derive(Serialize)]
struct Written<'a> {
    format: &'a str,
    chains: &'a Chains,
}

#[derive(Deserialize)]
struct Read {
    chains: Chains,
}

/// Error while writing or reading a file of chains.
#[derive(Debug, Error)]
pub enum ChainsFileError {
    /// The file system reported an error.
    #[error("cannot {action} the chains {}: {source}", path.display())]
    File {
        /// The operation that failed, "read" or "write".
        action: &'static str,
        /// Path of the file.
        path: PathBuf,
        /// Error of the file system.
        source: io::Error,
    },
    /// The file does not contain chains in this version of the format.
    #[error(
        "{} is not a file of chains in the format `{FORMAT}` (it begins with {found}): give a file \
         written by `Chains::save` of this version, or run the sampler again",
        path.display()
    )]
    Format {
        /// Path of the file.
        path: PathBuf,
        /// Format identifier found in the file.
        found: String,
    },
    /// The contents of the file are damaged.
    #[error("the chains in {} are damaged ({message}): run the sampler again", path.display())]
    Damaged {
        /// Path of the file.
        path: PathBuf,
        /// Description and position of the damage.
        message: String,
    },
}

impl Chains {
    /// Writes the chains and the state of their random streams to a JSON file, from which the sampler can resume them.
    ///
    /// Numbers are stored exactly. The write is atomic: an error never leaves an incomplete file at `path`.
    ///
    /// # Errors
    /// [`ChainsFileError`] with the path.
    ///
    /// # Example
    /// ```
    /// # struct Normal;
    /// # impl ppl::LogDensity for Normal {
    /// #     type Workspace = ();
    /// #     fn dim(&self) -> usize { 1 }
    /// #     fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, ppl::Rejection> { Ok(-0.5 * y[0] * y[0]) }
    /// #     fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, ppl::Rejection> { g[0] = -y[0]; self.log_density(y, w) }
    /// # }
    /// use ppl::{Chains, Nuts};
    ///
    /// # let directory = tempfile::tempdir()?;
    /// # let path = directory.path().join("chains.json");
    /// let nuts = Nuts::default().warmup(100).seed(7);
    /// nuts.clone().draws(300).run(&Normal)?.save(&path)?;
    /// // later: the 500 draws are identical to the draws of a single run
    /// let chains = nuts.clone().draws(500).resume(&Normal, Chains::load(&path)?)?;
    /// assert_eq!(chains, nuts.draws(500).run(&Normal)?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), ChainsFileError> {
        let path = path.as_ref();
        let mut partial = path.as_os_str().to_owned();
        partial.push(".partial");
        let write = || {
            let file = fs::File::create(&partial)?;
            let mut writer = io::BufWriter::new(file);
            serde_json::to_writer(&mut writer, &Written { format: FORMAT, chains: self })?;
            writer.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()?;
            fs::rename(&partial, path)
        };
        write().map_err(|source| {
            // remove the incomplete file; an error of the removal is ignored in favour of the first error
            let _ = fs::remove_file(&partial);
            ChainsFileError::File { action: "write", path: path.to_owned(), source }
        })
    }

    /// Reads chains that [`Chains::save`] wrote.
    ///
    /// # Errors
    /// [`ChainsFileError`] with the path and a description of the problem.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, ChainsFileError> {
        let path = path.as_ref().to_owned();
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(source) => return Err(ChainsFileError::File { action: "read", path, source }),
        };
        match serde_json::from_str::<Header>(&text) {
            Ok(Header { format }) if format == FORMAT => {}
            Ok(Header { format }) => {
                return Err(ChainsFileError::Format { path, found: format!("`{format}`") });
            }
            Err(error) if error.is_data() => {
                return Err(ChainsFileError::Format { path, found: "no format".into() });
            }
            Err(error) => {
                return Err(ChainsFileError::Damaged { path, message: error.to_string() });
            }
        }
        let read = serde_json::from_str::<Read>(&text).map_err(|error| error.to_string());
        let checked = read.and_then(|Read { chains }| chains.check().map(|()| chains));
        checked.map_err(|message| ChainsFileError::Damaged { path, message })
    }

    /// Checks that the lengths of all vectors are consistent, so that indices into the draws are valid.
    pub(crate) fn check(&self) -> Result<(), String> {
        if let Some(depth) = self.max_depth.filter(|depth| !DEPTHS.contains(depth)) {
            return Err(format!("{depth} doublings are out of range"));
        }
        for (number, chain) in self.chains.iter().enumerate() {
            let (got, expected) = (chain.draws.len(), chain.stats.len() * self.dim);
            if got != expected {
                return Err(format!("chain {number} has {got} numbers, not {expected}"));
            }
            let only_tuned = chain.stream.is_some() && chain.is_empty();
            let done = chain.warmup.stats.len();
            if only_tuned && chain.warmup.end.len() != self.dim
                || chain.paused.as_deref().is_some_and(|paused| !paused.fits(self.dim, done))
                || chain.tuning.as_deref().is_some_and(|tuning| !tuning.fits(self.dim, done))
            {
                return Err(format!(
                    "the warmup of chain {number} is inconsistent with its transitions"
                ));
            }
            if chain.divergences.iter().any(|d| d.position.len() != self.dim) {
                let dim = self.dim;
                return Err(format!(
                    "a divergence of chain {number} does not have {dim} coordinates"
                ));
            }
        }
        Ok(())
    }
}
