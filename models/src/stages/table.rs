//! Table of the stages: name, products and function of each.

use std::sync::LazyLock;

use super::{
    calibrate, confirm, ensemble, experiments, joint, next_test, report, surrogate, validate,
    verdict,
};
use crate::case::Case;
use crate::experiments::validation_folders::VALIDATE;
use crate::pipeline::extensions::further_stages;
use crate::pipeline::stage::Stage;
use crate::progress::say;
use crate::results_folder::pattern::matches;
use crate::specimen::{mesh, segment};

/// All stages in order: the stages of Breccia, and before `verdict` the stages that a program of the user adds.
pub static STAGES: LazyLock<Vec<Stage>> = LazyLock::new(|| {
    let mut stages = BUILT_IN.to_vec();
    let verdict = stages.iter().position(|stage| stage.name == "verdict").unwrap_or(stages.len());
    stages.splice(verdict..verdict, further_stages().iter().copied());
    stages
});

/// The stages of Breccia in order. A new stage is an entry here and a module in this folder.
pub(crate) const BUILT_IN: [Stage; 11] = [
    Stage {
        name: "segment",
        about: "Find the grains of an image, or of a virtual scan: labels.tif, grains.csv, segment.csv",
        products: &[
            "scan.tif",
            "labels.tif",
            "solid.tif",
            "grains.csv",
            "segment.csv",
            "slices.png",
            "grains.png",
            "grain_sizes.svg",
            "images/#-labels.tif",
            "images/#-solid.tif",
            "images/#-grains.csv",
            "images/#-segment.csv",
            "images/#-slices.png",
            "warnings/segment.txt",
        ],
        share: None,
        run: segment::run,
    },
    Stage {
        name: "mesh",
        about: "Build the mesh: mesh.vtu (for ParaView), mesh.msh (Gmsh), mesh.csv",
        products: &[
            "mesh.msh",
            "mesh.vtu",
            "mesh.png",
            "mesh_quality.svg",
            "mesh.csv",
            "meshes/#.msh",
            "meshes/#.csv",
            "warnings/mesh.txt",
        ],
        share: None,
        run: mesh::run,
    },
    Stage {
        name: "experiments",
        about: "Compute the quantities of the measured specimens, or simulate virtual specimens: experiments.csv",
        products: &[
            "experiments.csv",
            "curve_checks.csv",
            "experiments/specimens.csv",
            "experiments/truth.csv",
            "experiments/bias.csv",
            "experiments/curves/*.csv",
            "experiments/scans/*.tif",
            "warnings/experiments.txt",
        ],
        share: None,
        run: experiments::run,
    },
    Stage {
        name: "ensemble",
        about: "Run all simulations of the design that are not finished: runs.csv, curves/",
        products: &[
            "runs.csv",
            "failed_runs.csv",
            "fidelity_runs.csv",
            "fidelity.csv",
            "fidelity.json",
            "quadrature.csv",
            "sequential.csv",
            "curves/run-#.csv",
            "curves/level-#-run-#.csv",
            "warnings/ensemble.txt",
        ],
        share: Some(ensemble::share),
        run: ensemble::run,
    },
    Stage {
        name: "surrogate",
        about: "Fit the polynomial chaos surrogate: surrogate.json",
        products: &[
            "surrogate.json",
            "surrogate_orders.csv",
            "surrogate_error.json",
            "surrogate_uncertainty.json",
            "surrogate_specimens.json",
            "sobol.csv",
        ],
        share: None,
        run: surrogate::run,
    },
    Stage {
        name: "calibrate",
        about: "Sample the posterior and find its mode: posterior.zarr, summary.csv, map.csv",
        products: &[
            "posterior.zarr",
            "posterior.csv",
            "predictive.csv",
            "predictive_curves.csv",
            "sampling.csv",
            "summary.csv",
            "posterior.txt",
            "range.csv",
            "map.csv",
            "fit.csv",
            "uncertainty.csv",
            "loo.csv",
            "influence.csv",
            "sensitivity.csv",
            "evidence.csv",
            "warnings/calibrate.txt",
        ],
        share: None,
        run: calibrate::run,
    },
    Stage {
        name: "confirm",
        about: "Simulate at the mode and at posterior draws: confirm.csv, fields/map.pvd (for ParaView)",
        products: &[
            "confirm.csv",
            "confirm_runs.csv",
            "curves/baseline.csv",
            "curves/map.csv",
            "curves/draw-#.csv",
            "curves/second-mesh.csv",
            "fields/map-rising.vtu",
            "fields/map-peak.vtu",
            "fields/map-last.vtu",
            "fields/map-rising.png",
            "fields/map-peak.png",
            "fields/map-last.png",
            "fields/map.pvd",
            "fields/map.csv",
            "warnings/confirm.txt",
        ],
        share: None,
        run: confirm::run,
    },
    Stage {
        name: VALIDATE,
        about: "Predict held-out specimens from the posterior and compare them: validation.csv",
        products: &[
            "validation.csv",
            "validation_summary.csv",
            "validation_coverage.csv",
            "validation_curves.csv",
            "warnings/validate.txt",
        ],
        share: None,
        run: validate::run,
    },
    Stage {
        name: "verdict",
        about: "Report which parameters are identified, and all warnings: verdict.csv, warnings.txt, summary.txt",
        products: &["verdict.csv", "warnings.txt", "summary.txt"],
        share: None,
        run: verdict::run,
    },
    Stage {
        name: "next-test",
        about: "Estimate how much further tests would narrow the posterior, and the specimens needed: next-test.csv",
        products: &[
            "next-test.csv",
            "next-test-specimens.csv",
            "next-test-failed.csv",
            "next-test/candidate-#.csv",
        ],
        share: None,
        run: next_test::run,
    },
    Stage {
        name: "report",
        about: "Write figures and tables of all stages to one page: report.html",
        products: &["report.html"],
        share: None,
        run: report::run,
    },
];

/// Stages that calibrate several tests together, in order. All other stages are run in the folder of each test.
pub(crate) static JOINT_STAGES: [Stage; 3] = [
    Stage {
        name: "calibrate",
        about: "Sample the joint posterior of several tests, and the posteriors that omit one test each",
        products: &[
            "posterior.zarr",
            "posterior.csv",
            "sampling.csv",
            "summary.csv",
            "posterior.txt",
            "map.csv",
            "uncertainty.csv",
            "without_tests.csv",
            "sensitivity.csv",
            "evidence.csv",
            "joint_model.json",
            "joint/*.json",
            "joint/validation/*.json",
            "joint/candidate/*.json",
            "warnings/calibrate.txt",
        ],
        share: None,
        run: joint::calibrate,
    },
    Stage {
        name: "verdict",
        about: "Report which parameters all tests together identify, and all warnings",
        products: &["verdict.csv", "warnings.txt", "summary.txt"],
        share: None,
        run: joint::verdict,
    },
    Stage {
        name: "report",
        about: "Write figures and tables of all tests to one page: report.html",
        products: &["report.html"],
        share: None,
        run: joint::report,
    },
];

/// Stages that are run in the results folder of a case.
pub(crate) fn stages_of(case: &Case) -> &'static [Stage] {
    match case.tests.is_empty() {
        true => &STAGES,
        false => &JOINT_STAGES,
    }
}

/// Former names of stages with the present names.
pub(crate) const FORMER_NAMES: [(&str, &str); 1] = [("design", "next-test")];

impl Stage {
    /// Returns the stage that had this name in earlier versions. Prints a note with the present name.
    pub(crate) fn formerly_named(name: &str) -> Option<&'static Stage> {
        let (_, present) = FORMER_NAMES.iter().find(|(former, _)| *former == name)?;
        say("note", &format!("the stage {name} is called {present} now"));
        Self::named(present)
    }

    /// Returns the stage of this name.
    pub fn named(name: &str) -> Option<&'static Stage> {
        STAGES.iter().find(|stage| stage.name == name)
    }

    /// Returns the name of the stage that writes a file of the results folder.
    pub(crate) fn that_writes(file: &str) -> Option<&'static str> {
        let writes = |product: &&str| matches(product, file);
        let mut all = STAGES.iter().chain(&JOINT_STAGES);
        all.find(|stage| stage.products.iter().any(writes)).map(|stage| stage.name)
    }

    /// Whether two stages have the same name, or a product in common.
    pub(crate) fn conflicts_with(&self, other: &Self) -> bool {
        let example = |product: &str| product.replace('#', "1").replace('*', "a");
        let writes = |stage: &Self, product: &str| {
            stage.products.iter().any(|pattern| matches(pattern, &example(product)))
        };
        self.name == other.name
            || self.products.iter().any(|product| writes(other, product))
            || other.products.iter().any(|product| writes(self, product))
    }

    /// The products that the stage may write for a case.
    pub(crate) fn products_of(&self, case: &Case) -> impl Iterator<Item = &'static str> {
        let is_scanned = case.specimen.scan.is_some();
        let experiments = case.experiments.as_ref();
        let is_virtual = experiments.is_some_and(|e| e.virtual_specimens.is_some());
        self.products.iter().copied().filter(move |product| match *product {
            "scan.tif" => is_scanned,
            // for measured specimens, these paths contain copies of the user's files
            product => is_virtual || !product.starts_with("experiments/"),
        })
    }

    /// Whether a stage may write the product `name` for this case: false if the number in the name exceeds the number
    /// of runs or draws of the case.
    pub(crate) fn may_write(case: &Case, name: &str) -> bool {
        let Some((front, number)) = numbered_curve(name) else { return true };
        let most = match front {
            "draw" => case.confirm.draws,
            _ => {
                let extended: usize = case.extend.iter().map(|extension| extension.runs).sum();
                // upper limit of the number of runs in batches, with a margin of one batch
                let placed = case.sequential.as_ref().map_or(0, |keys| keys.most + keys.batch);
                case.design.runs + extended + placed
            }
        };
        (1..=most).contains(&number)
    }
}

/// Extracts kind and number of a simulated curve from its file name: `draw` and 7 from `curves/draw-7.csv`,
/// `level-2-run` and 13 from `curves/level-2-run-013.csv`.
fn numbered_curve(name: &str) -> Option<(&str, usize)> {
    let (front, number) = name.strip_prefix("curves/")?.strip_suffix(".csv")?.rsplit_once('-')?;
    Some((front, number.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::CaseFile;

    #[test]
    fn curves_beyond_the_runs_of_a_case_are_none_of_its_products() {
        let mut case = CaseFile::default_case().case;
        case.sequential = None;
        case.extend.clear();
        (case.design.runs, case.confirm.draws) = (12, 2);
        for name in
            ["run-001", "run-012", "run-12", "level-2-run-012", "draw-2", "map", "second-mesh"]
        {
            assert!(Stage::may_write(&case, &format!("curves/{name}.csv")), "{name}");
        }
        for name in ["run-099", "run-013", "run-000", "level-2-run-013", "draw-3"] {
            assert!(!Stage::may_write(&case, &format!("curves/{name}.csv")), "{name}");
        }
        assert!(Stage::may_write(&case, "next-test/candidate-99.csv"));
        case.sequential = Some(crate::case::SequentialCase { most: 5, ..Default::default() });
        assert!(Stage::may_write(&case, "curves/run-017.csv"));
    }
}
