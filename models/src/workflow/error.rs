//! What can end a stage.

use std::io;
use std::path::{Path, PathBuf};

use fem::{
    DeviceError, EnsembleError, FemError, ImageError, MeshError, MeshingError, PackingError,
    ScanError, SeparateError, SurfaceImportError,
};
use surrogate::SurrogateError;

use crate::error::InputError;
use crate::fracture::CalibrationError;

/// An input of the case stands at the path of a product.
#[derive(Debug, thiserror::Error)]
#[error(
        "{}: {key} = {} stands in the folder of the results, {}, where breccia writes {product}: name another \
         folder with --out",
        case.display(),
        input.display(),
        dir.display()
    )]
pub struct InputInPlace {
    /// The case.
    pub case: PathBuf,
    /// The key that names the input.
    pub key: String,
    /// The input.
    pub input: PathBuf,
    /// The product, or a pattern of the names of products.
    pub product: String,
    /// The folder of the results.
    pub dir: PathBuf,
}

/// Why a stage of the workflow ended before it was done.
#[derive(Debug, thiserror::Error)]
pub enum WorkflowError {
    /// A file that a person wrote is wrong.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The device that was asked for cannot be used.
    #[error("--device: {0}")]
    Device(#[from] DeviceError),
    /// Another of the processes that share a simulation cannot take part.
    #[error("rank {rank}: {message}")]
    Rank {
        /// Which.
        rank: usize,
        /// What it said.
        message: String,
    },
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// The folder of the results cannot be made.
    #[error("{} cannot be made ({source}); name another folder with --out", path.display())]
    Results {
        /// The folder.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// A first case cannot be written.
    #[error("{}: {source}; name a file that does not exist yet, in a folder that does", path.display())]
    Init {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// A result of another stage cannot be understood.
    #[error("{}: {source}; run `breccia {stage}` again", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// The stage that writes it.
        stage: &'static str,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// The stage before has not been run.
    #[error("{} is not there: run `breccia {stage}` first, or `breccia run` for all stages", path.display())]
    Missing {
        /// The file that is needed.
        path: PathBuf,
        /// The stage that writes it.
        stage: &'static str,
    },
    /// A result of another stage belongs to another case.
    #[error("{} is of other inputs or outputs than the case; run `breccia {stage}` again", path.display())]
    OtherCase {
        /// The file.
        path: PathBuf,
        /// The stage that writes it.
        stage: &'static str,
    },
    /// A result of another stage was made from something else than is there now.
    #[error(
        "{} is not up to date: {change}; run `breccia {stage}` again, or `breccia run` for all stages",
        path.display()
    )]
    Stale {
        /// The file.
        path: PathBuf,
        /// The stage that writes it.
        stage: String,
        /// What has changed.
        change: String,
    },
    /// The folder has the results of another case.
    #[error(
        "{} has the results of another case, {}; name another folder with --out, or give it to this \
         case with --reuse: what differs is then made again",
        path.display(),
        owner.display()
    )]
    OtherFolder {
        /// The folder.
        path: PathBuf,
        /// The other case.
        owner: PathBuf,
    },
    /// A file of the user's lies in the place of one that a command is about to write.
    #[error(
        "{} {}, and `breccia {command}` would replace it: {}",
        path.display(),
        if *is_changed { "was changed after breccia wrote it" } else { "was not written by breccia" },
        keeping(name)
    )]
    UsersFile {
        /// The file.
        path: PathBuf,
        /// The command that would write it.
        command: String,
        /// The name of the file in the folder of the results.
        name: String,
        /// Whether the program has once written a file of this name there.
        is_changed: bool,
    },
    /// An input of the case stands at the path of a product.
    #[error(transparent)]
    InputInPlace(Box<InputInPlace>),
    /// A file has the name of the record of written files, and is none.
    #[error(
        "{} is not the record of the files that breccia writes there: move the file to another place, or name \
         another folder with --out",
        path.display()
    )]
    NoRecord {
        /// The file.
        path: PathBuf,
    },
    /// The folder has runs by another version of the program.
    #[error(
        "{} has runs by another version of the program ({difference}), which may compute something else: \
         go on with that version, name another folder with --out, or delete this one to make its runs \
         again",
        path.display()
    )]
    OtherProgram {
        /// The folder of the runs.
        path: PathBuf,
        /// The two versions.
        difference: String,
    },
    /// The file system refuses a lock.
    #[error(
        "cannot lock {}: {source}; processes that share results need locks that all machines see (a local \
         disk, NFS with its lock service, Lustre mounted with flock): name a folder there with --out",
        path.display()
    )]
    Lock {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// A folder that has no results.
    #[error(
        "{} is no folder of results: {why}; name the one that `breccia run CASE --out DIR` writes to",
        path.display()
    )]
    NoResults {
        /// The folder.
        path: PathBuf,
        /// What is missing.
        why: &'static str,
    },
    /// The mesh cannot be read or written.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The mesh of a file is not usable.
    #[error("{}: {source}", path.display())]
    UnsoundMesh {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: MeshError,
    },
    /// The mesh cannot be built.
    #[error("{}: specimen: {source}", file.display())]
    Meshing {
        /// The case.
        file: PathBuf,
        /// What is wrong.
        source: MeshingError,
    },
    /// A file of an image cannot be read or written.
    #[error(transparent)]
    ImageFile(#[from] ImageError),
    /// An image that cannot be segmented.
    #[error("{}: specimen.image: {source}", file.display())]
    Segmentation {
        /// The case.
        file: PathBuf,
        /// What is wrong.
        source: ImageError,
    },
    /// STL files that are no grains.
    #[error("{}: specimen.stl: {source}", file.display())]
    Surfaces {
        /// The case.
        file: PathBuf,
        /// What is wrong.
        source: Box<SurfaceImportError>,
    },
    /// Grains that cannot be shrunk to a least distance.
    #[error("{}: {source}", file.display())]
    Separation {
        /// The case.
        file: PathBuf,
        /// What is wrong.
        source: SeparateError,
    },
    /// A virtual scan that cannot be made.
    #[error("{}: specimen.scan: {source}", file.display())]
    Scan {
        /// The case.
        file: PathBuf,
        /// What is wrong.
        source: ScanError,
    },
    /// The grains do not fit.
    #[error("{}: specimen.grains: {source}", file.display())]
    Packing {
        /// The case.
        file: PathBuf,
        /// What is wrong.
        source: PackingError,
    },
    /// The case's test cannot be set up.
    #[error("{}: {source}", file.display())]
    Test {
        /// The case.
        file: PathBuf,
        /// What is wrong.
        source: FemError,
    },
    /// A simulation has failed on its way, or its curve cannot be written.
    #[error(transparent)]
    Fem(#[from] FemError),
    /// An ensemble of simulations cannot go on.
    #[error(transparent)]
    Ensemble(#[from] EnsembleError),
    /// The surrogate cannot be fitted, read or evaluated.
    #[error(transparent)]
    Surrogate(#[from] SurrogateError),
    /// The posterior cannot be sampled.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// A result that the next stage cannot use.
    #[error("{0}")]
    Unusable(String),
    /// Ctrl-C.
    #[error("interrupted; what is finished is kept, and the same command goes on from there")]
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

/// What keeps a file of the user's that has the name of a product.
fn keeping(name: &str) -> String {
    match name.ends_with("labels.tif") {
        // labels are an input as well, whoever made them
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
