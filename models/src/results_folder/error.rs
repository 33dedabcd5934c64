//! Errors that end a stage of the workflow.

use std::io;
use std::path::{Path, PathBuf};

use fem::{
    DeviceError, EnsembleError, FemError, ImageError, MeshError, MeshingError, PackingError,
    RankLost, ScanError, SeparateError, SurfaceImportError,
};
use surrogate::SurrogateError;

use crate::error::InputError;
use crate::fracture::CalibrationError;

/// An input file of the case has the path of a product, so that a stage would overwrite it.
#[derive(Debug, thiserror::Error)]
#[error(
        "{}: {key} = {} is in the results folder, {}, where breccia writes {product}: name another \
         folder with --out",
        case.display(),
        input.display(),
        dir.display()
    )]
pub struct InputInPlace {
    /// Path of the case file.
    pub case: PathBuf,
    /// Key of the case that names the input file.
    pub key: String,
    /// Path of the input file.
    pub input: PathBuf,
    /// Name of the product, or a pattern of product names.
    pub product: String,
    /// The folder of the results.
    pub dir: PathBuf,
}

/// Error that ends a stage of the workflow before it is complete.
#[derive(Debug, thiserror::Error)]
pub enum WorkflowError {
    /// A file written by the user contains an error.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The device requested with `--device` cannot be used.
    #[error("--device: {0}")]
    Device(#[from] DeviceError),
    /// Another rank of a parallel simulation reported an error.
    #[error("rank {rank}: {message}")]
    Rank {
        /// Number of the rank.
        rank: usize,
        /// Error message of the rank.
        message: String,
    },
    /// Another rank of a parallel simulation has ended.
    #[error(transparent)]
    RankLost(#[from] RankLost),
    /// A file cannot be read or written.
    #[error("{}: {source}{}", path.display(), remedy(source.kind()))]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The results folder cannot be created.
    #[error("{} cannot be created ({source}); name another folder with --out", path.display())]
    Results {
        /// The folder.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// `breccia init` cannot write a file of the new case.
    #[error("{}: {source}; name a file that does not exist yet, in a folder that does", path.display())]
    Init {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// A JSON file written by another stage cannot be parsed.
    #[error("{}: {source}; run `breccia {stage}` again", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Stage that writes the file.
        stage: &'static str,
        /// Cause of the error.
        source: serde_json::Error,
    },
    /// A file of an earlier stage is missing, because that stage has not been run.
    #[error("{} is missing: run `breccia {stage}` first, or `breccia run` for all stages", path.display())]
    Missing {
        /// Path of the missing file.
        path: PathBuf,
        /// Stage that writes the file.
        stage: &'static str,
    },
    /// A result of another stage does not match the case: for example, it has other parameters, phases or image sizes.
    #[error("{} has other inputs or outputs than the case; run `breccia {stage}` again", path.display())]
    OtherCase {
        /// The file.
        path: PathBuf,
        /// Stage that writes the file.
        stage: &'static str,
    },
    /// A result of another stage is out of date: one of its inputs has changed.
    #[error(
        "{} is not up to date: {change}; run `breccia {stage}` again, or `breccia run` for all stages",
        path.display()
    )]
    Stale {
        /// The file.
        path: PathBuf,
        /// Stage that writes the file.
        stage: String,
        /// Description of the change.
        change: String,
    },
    /// The results folder contains the results of another case.
    #[error(
        "{} has the results of another case, {}; name another folder with --out, or give it to this \
         case with --reuse: results with other inputs are then computed again",
        path.display(),
        owner.display()
    )]
    OtherFolder {
        /// The folder.
        path: PathBuf,
        /// Path of the other case file.
        owner: PathBuf,
    },
    /// A command would overwrite a file that the user has created or edited.
    #[error(
        "{} {}, and `breccia {command}` would replace it: {}",
        path.display(),
        if *is_changed { "was changed after breccia wrote it" } else { "was not written by breccia" },
        keeping(name)
    )]
    UsersFile {
        /// The file.
        path: PathBuf,
        /// Command that would overwrite the file.
        command: String,
        /// The name of the file in the folder of the results.
        name: String,
        /// True if the program wrote the file and the user edited it; false if the user created the file.
        is_changed: bool,
    },
    /// An input file of the case has the path of a product, so that a stage would overwrite it.
    #[error(transparent)]
    InputInPlace(Box<InputInPlace>),
    /// A file has the name of the program's record of written files, but does not contain such a
    /// record.
    #[error(
        "{} is not the record of the files that breccia writes there: move the file to another place, or name \
         another folder with --out",
        path.display()
    )]
    NoRecord {
        /// The file.
        path: PathBuf,
    },
    /// The folder contains runs of another version of the program.
    #[error(
        "{} has runs by another version of the program ({difference}), which may give other results: \
         continue with that version, name another folder with --out, or delete this folder to compute its \
         runs again",
        path.display()
    )]
    OtherProgram {
        /// The folder of the runs.
        path: PathBuf,
        /// Description of the difference between the two versions.
        difference: String,
    },
    /// The file system does not grant a lock on a file.
    #[error(
        "cannot lock {}: {source}; processes that share results need locks that all machines see (a local \
         disk, NFS with its lock service, Lustre mounted with flock): name a folder there with --out",
        path.display()
    )]
    Lock {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The folder contains no results.
    #[error(
        "{} is not a results folder: {why}; name the folder to which `breccia run CASE --out DIR` writes",
        path.display()
    )]
    NoResults {
        /// The folder.
        path: PathBuf,
        /// Reason why the folder is not a results folder.
        why: &'static str,
    },
    /// The mesh cannot be read or written.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The mesh in a file is invalid.
    #[error("{}: {source}", path.display())]
    UnsoundMesh {
        /// The file.
        path: PathBuf,
        /// Cause of the error.
        source: MeshError,
    },
    /// The mesh cannot be built.
    #[error("{}: specimen: {source}", file.display())]
    Meshing {
        /// Path of the case file.
        file: PathBuf,
        /// Cause of the error.
        source: MeshingError,
    },
    /// A file of an image cannot be read or written.
    #[error(transparent)]
    ImageFile(#[from] ImageError),
    /// The image cannot be segmented.
    #[error("{}: specimen.image: {source}", file.display())]
    Segmentation {
        /// Path of the case file.
        file: PathBuf,
        /// Cause of the error.
        source: ImageError,
    },
    /// The STL files cannot be used as grains.
    #[error("{}: specimen.stl: {source}", file.display())]
    Surfaces {
        /// Path of the case file.
        file: PathBuf,
        /// Cause of the error.
        source: Box<SurfaceImportError>,
    },
    /// The grains cannot be shrunk to the least distance.
    #[error("{}: {source}", file.display())]
    Separation {
        /// Path of the case file.
        file: PathBuf,
        /// Cause of the error.
        source: SeparateError,
    },
    /// The virtual scan cannot be computed.
    #[error("{}: specimen.scan: {source}", file.display())]
    Scan {
        /// Path of the case file.
        file: PathBuf,
        /// Cause of the error.
        source: ScanError,
    },
    /// The packing of grains cannot be generated.
    #[error("{}: specimen.grains: {source}", file.display())]
    Packing {
        /// Path of the case file.
        file: PathBuf,
        /// Cause of the error.
        source: PackingError,
    },
    /// The test of the case cannot be set up.
    #[error("{}: {source}", file.display())]
    Test {
        /// Path of the case file.
        file: PathBuf,
        /// Cause of the error.
        source: FemError,
    },
    /// A simulation failed, or its curve cannot be written.
    #[error(transparent)]
    Fem(#[from] FemError),
    /// An ensemble of simulations cannot continue.
    #[error(transparent)]
    Ensemble(#[from] EnsembleError),
    /// The surrogate cannot be fitted, read or evaluated.
    #[error(transparent)]
    Surrogate(#[from] SurrogateError),
    /// The posterior cannot be sampled.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// A result cannot be used by the next stage; the text gives the reason.
    #[error("{0}")]
    Unusable(String),
    /// The user interrupted the program with Ctrl-C.
    #[error("interrupted; finished results are kept, and the same command resumes from them")]
    Interrupted,
}

impl WorkflowError {
    pub(crate) fn io(path: &Path, source: io::Error) -> Self {
        Self::Io { path: path.to_owned(), source }
    }

    pub(crate) fn results(path: &Path, source: io::Error) -> Self {
        Self::Results { path: path.to_owned(), source }
    }
}

/// Remedy for an error of the operating system; empty if there is none that always helps.
fn remedy(kind: io::ErrorKind) -> &'static str {
    match kind {
        io::ErrorKind::PermissionDenied => {
            "; you have no permission for this file or its folder: name another folder with --out, or change the \
             permissions (chmod u+rwX)"
        }
        io::ErrorKind::ReadOnlyFilesystem => {
            "; the disk cannot be written: name a folder on another disk with --out"
        }
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "; free space on the disk and run the same command again, which resumes"
        }
        _ => "",
    }
}

/// Advice on how to keep a user's file that has the name of a product.
fn keeping(name: &str) -> String {
    match name.ends_with("labels.tif") {
        // a file of labels can also be an input of the case, whether the user or the program wrote it
        true => {
            "to use these labels, move the file to another place and name it there as labels in \
                 [specimen.image] in place of stack; or name another folder with --out"
                .to_owned()
        }
        false => format!(
            "move the file to another place, name another folder with --out, or allow it with --replace {name}"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_files_name_the_remedy() {
        let text = |kind: io::ErrorKind| {
            WorkflowError::io(Path::new("out/written.csv"), kind.into()).to_string()
        };
        let denied = text(io::ErrorKind::PermissionDenied);
        for part in ["out/written.csv: ", "another folder with --out", "chmod"] {
            assert!(denied.contains(part), "{denied}");
        }
        assert!(text(io::ErrorKind::StorageFull).contains("free space"));
        assert!(!text(io::ErrorKind::NotFound).contains(';'));
    }
}
