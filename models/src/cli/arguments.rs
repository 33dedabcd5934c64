//! Commands and arguments of the command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

use super::cluster::Jobs;
use super::interrupt::INTERRUPT;
use super::replace::replaceable;
use crate::workflow::{DeviceChoice, missing_case};
use crate::{CaseFile, FolderAccess, InputError, JointWorkflow, Workflow, WorkflowError};

/// Calibrates the fracture of bonded granular materials, with uncertainty.
///
/// Computes the posterior of stiffness, toughness and viscosity of the matrix from the compression curves of specimens
/// and a finite-element model of their microstructure. Without arguments, the built-in default case runs: virtual
/// specimens, 100 simulations, surrogate, posterior, confirmation, report.
#[derive(Parser)]
#[command(name = "breccia", version, after_help = EXAMPLES)]
pub(super) struct Cli {
    #[command(subcommand)]
    pub(super) command: Option<Command>,

    /// Number of simultaneous simulations; results do not depend on it [default: all cores]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

const EXAMPLES: &str = "\
Examples:
  breccia                                   the default case, results in breccia-out/
  breccia init my.toml                      write a case that explains every key
  breccia init --own-data my-tests          write a case for your own curves, with example curves
  breccia schema > case.schema.json         the keys of a case, for an editor
  breccia check my.toml                     print the interpreted input, the expected cost and every mistake
  breccia simulate my.toml --out try        one simulation: try/curve.csv
  breccia surfaces my.toml --out try        the surface of each grain: try/surfaces/grain-001.stl
  breccia prony relaxation.csv --out try    a Prony series of a relaxation test
  breccia run my.toml --out results         all stages; the same command resumes an interrupted run
  breccia calibrate --out results           one stage again, after results/case.toml was edited
  breccia status results                    state of the results, on any machine that has access to the folder
  breccia ensemble --out results --slurm    the simulations of a case as jobs of a Slurm cluster
  breccia study my-study.toml --out study   several calibrations and their comparison
  breccia study my-study.toml --out study --slurm   the same as jobs of a Slurm cluster

Stages, in order: segment, mesh, experiments, ensemble, surrogate, calibrate, confirm, validate,
verdict, next-test, report.
`breccia help STAGE` describes a stage and the files that it writes.";

/// Kind of a file that `breccia schema` describes.
#[derive(Clone, Copy, Default, ValueEnum)]
pub(super) enum FileKind {
    #[default]
    Case,
    Study,
}

#[derive(Subcommand)]
#[allow(clippy::large_enum_variant)]
pub(super) enum Command {
    /// Run all stages of a case that are not finished yet
    #[command(after_help = "Example:\n  breccia run my.toml --out results --threads 2")]
    Run(CaseAndFolder),
    /// Write the default case, with an explanation of every key
    #[command(after_help = "Example:\n  breccia init my.toml\n  breccia init --own-data my-tests")]
    Init {
        /// The file to write; an existing file is never replaced
        #[arg(default_value = "case.toml")]
        file: PathBuf,

        /// Write a case for measured specimens to DIR instead, with an example table and example curves
        #[arg(long, value_name = "DIR", conflicts_with = "file")]
        own_data: Option<PathBuf>,
    },
    /// Print the JSON Schema of cases or studies, with which an editor completes and checks a file
    #[command(after_help = "Example:\n  breccia schema > case.schema.json\n  \
                      breccia schema study > study.schema.json\n\
                      The first line `#:schema case.schema.json` of a case names the schema.")]
    Schema {
        /// Kind of the files
        #[arg(value_enum, default_value_t)]
        kind: FileKind,
    },
    /// Read a case and all files that it names; print the interpreted input, the expected cost and every mistake
    #[command(
        after_help = "Computes nothing and writes nothing. Exit code 0: no mistakes; 1: mistakes.\n\
                      For a study, all laboratories and cases are read.\n\
                      Example:\n  breccia check my.toml"
    )]
    Check {
        /// The case, or the study
        case: PathBuf,
    },
    /// Run one compression test with the parameters of the case; writes curve.csv
    #[command(after_help = "Example:\n  breccia simulate my.toml --out try\n\
                      Several processes, on one machine or more (built with --features mpi):\n  \
                      mpirun -n 4 breccia simulate my.toml --out try")]
    Simulate {
        #[command(flatten)]
        target: CaseAndFolder,

        /// Device that solves the linear systems
        #[arg(long, value_enum, default_value_t)]
        device: DeviceChoice,
    },
    /// Write the surface of each grain as STL: surfaces/grain-001.stl, surfaces.csv
    #[command(after_help = "The surfaces are in mm, in the coordinates of the mesh:\n\
                      the axis of the specimen is z, and its bottom is at z = 0.\n\
                      Example:\n  breccia surfaces my.toml --out try\n\
                      With the paper's steps:\n  \
                      breccia surfaces my.toml --out try --smoothing-passes 10 --decimation 20 --least-distance-mm 0.01")]
    Surfaces {
        #[command(flatten)]
        target: CaseAndFolder,

        /// Passes of Taubin's filter over each surface
        #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=1000))]
        smoothing_passes: u16,

        /// Divide the number of triangles by FACTOR
        #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = factor)]
        decimation: f64,

        /// Shrink grains about their centroids until they are at least MM mm apart; 0: no shrinking
        #[arg(long, value_name = "MM", default_value_t = 0.0, value_parser = length)]
        least_distance_mm: f64,
    },
    /// Fit a Prony series to a relaxation test or a dynamic test (DMA); writes the lines for a case and a picture
    #[command(
        after_help = "TABLE is a CSV file with the columns time_s,modulus_mpa, or frequency_hz,storage_mpa,loss_mpa.\n\
                      Writes NAME-prony.toml and NAME-prony.png for a table NAME.csv; existing files are never replaced.\n\
                      Example:\n  breccia prony relaxation.csv --out try"
    )]
    Prony {
        /// Table of the measured moduli
        table: PathBuf,

        /// Folder for the files
        #[arg(long, value_name = "DIR", default_value = ".")]
        out: PathBuf,
    },
    /// Run several related calibrations and compare them; writes study.csv and report.html
    #[command(
        after_help = "Writes a folder of results for each case, with all files of `run`, and the comparison:\n\
                      DIR/study.csv and DIR/report.html. The same command resumes an interrupted study.\n\
                      Example:\n  breccia study studies/bonded-granular.toml --out study",
        args_conflicts_with_subcommands = true,
        subcommand_negates_reqs = true
    )]
    Study {
        #[command(subcommand)]
        action: Option<StudyAction>,

        /// The study: a base case, and the keys that each laboratory and each case changes
        #[arg(required = true)]
        file: Option<PathBuf>,

        /// Results folder; a later run resumes from its files
        #[arg(long, value_name = "DIR", default_value = "breccia-study")]
        out: PathBuf,

        /// Set a key of all cases to another value, as in --set specimen.spacing_mm=0.3; may be repeated
        #[arg(long, value_name = "KEY=VALUE")]
        set: Vec<String>,

        /// Overwrite FILE in DIR even if you have written or edited it; may be repeated
        #[arg(long, value_name = "FILE")]
        replace: Vec<PathBuf>,

        /// Run only the laboratory or case whose folder within DIR is PART
        #[arg(long, value_name = "PART", conflicts_with_all = ["slurm", "slurm_script"])]
        only: Option<String>,

        /// Last stage to run, for the case given with --only
        #[arg(long, value_name = "STAGE", requires = "only")]
        until: Option<String>,

        #[command(flatten)]
        jobs: Jobs,
    },
    /// Show the state of each stage, on any machine that has access to the folder; changes no file
    #[command(
        after_help = "Prints one line per stage. Exit code 0: all stages are done; 3: work is left; 1: no results.\n\
                      Example:\n  breccia status results"
    )]
    Status {
        /// The folder that was given to `run`, `study` or a stage with --out
        #[arg(default_value = "breccia-out")]
        dir: PathBuf,
    },
}

/// Commands on the results of a study.
#[derive(Subcommand)]
pub(super) enum StudyAction {
    /// Copy a case of a study with everything that it needs to a folder of its own
    #[command(
        after_help = "Inputs outside of the folder of the case are copied to DEST/inputs. No stage has to be run again:\n\
                      edit DEST/case.toml, and `breccia run --out DEST` runs what the change concerns.\n\
                      Example:\n  breccia study detach study/first first"
    )]
    Detach {
        /// Folder of the case within the folder of the study
        case: PathBuf,

        /// The folder to write; it must not exist
        dest: PathBuf,
    },
}

#[derive(Args)]
pub(super) struct CaseAndFolder {
    /// The case [default: DIR/case.toml if it exists, else the built-in default case]
    case: Option<PathBuf>,

    /// Results folder; a later run resumes from its files
    #[arg(long, value_name = "DIR", default_value = "breccia-out")]
    pub(super) out: PathBuf,

    /// Use DIR for this case although it has results of another case; results with other inputs are computed again
    #[arg(long)]
    reuse: bool,

    /// Calibrate even if a measured mean is outside the range of all simulations; no parameter is then called
    /// identified
    #[arg(long)]
    accept_out_of_range: bool,

    /// Overwrite FILE in DIR even if you have written or edited it; may be repeated
    #[arg(long, value_name = "FILE")]
    replace: Vec<PathBuf>,
}

impl CaseAndFolder {
    /// Reads the case, or returns the built-in default case.
    pub(super) fn case_file(&self) -> Result<CaseFile, InputError> {
        let copied_case = self.out.join("case.toml");
        match &self.case {
            Some(path) => CaseFile::read(path),
            None if copied_case.is_file() => CaseFile::read(&copied_case),
            None => missing_case(&self.out).map_or_else(|| Ok(CaseFile::default_case()), Err),
        }
    }

    /// Results and files that the command may overwrite in the results folder.
    pub(super) fn access(&self) -> Result<FolderAccess, WorkflowError> {
        Ok(FolderAccess { reuse: self.reuse, replace: replaceable(&self.out, &self.replace)? })
    }

    /// Opens the folders of a case with several tests.
    pub(super) fn open_tests<'a>(
        &self,
        file: &CaseFile,
        threads: usize,
    ) -> Result<JointWorkflow<'a>, WorkflowError> {
        let access = self.access()?;
        let workflow = JointWorkflow::open(file, &self.out, threads, &INTERRUPT, &access)?;
        Ok(if self.accept_out_of_range { workflow.accept_out_of_range() } else { workflow })
    }

    /// Returns the case for a command that works on a single test.
    pub(super) fn single_test(&self, command: &str) -> Result<CaseFile, InputError> {
        let file = self.case_file()?;
        let Some(first) = file.case.tests.first() else { return Ok(file) };
        let case = self.out.join("tests").join(&first.name).join("case.toml");
        let help = format!(
            "Run a stage first, and then breccia {command} {} for one of them.",
            case.display()
        );
        Err(InputError::new(&file.path, "tests", "", "has several tests", help))
    }

    /// Opens the results folder of a case with one test.
    pub(super) fn open<'a>(
        &self,
        file: &CaseFile,
        threads: usize,
    ) -> Result<Workflow<'a>, WorkflowError> {
        let workflow = Workflow::open_with(file, &self.out, threads, &INTERRUPT, &self.access()?)?;
        Ok(if self.accept_out_of_range { workflow.accept_out_of_range() } else { workflow })
    }
}

/// Parses a factor of at least 1.
fn factor(text: &str) -> Result<f64, String> {
    let factor = text.parse().ok().filter(|factor| (1.0..=1e6).contains(factor));
    factor.ok_or_else(|| "give a factor of at least 1 (recommended: 20)".to_owned())
}

/// Parses a length in mm, or 0.
fn length(text: &str) -> Result<f64, String> {
    let length = text.parse().ok().filter(|length| (0.0..=1e3).contains(length));
    length.ok_or_else(|| "give a length in mm, or 0".to_owned())
}
