//! What each stage may read: keys of the case, and products of other stages. A stage reads only a part for most cases; its
//! record in `stages.toml` states this part.

use crate::pipeline::stage::Reads;

pub(super) const SEGMENT: Reads = Reads {
    keys: &["specimen", "design.microstructure", "design.import", "simulator"],
    products: &[],
};

pub(super) const MESH: Reads = Reads {
    keys: &[
        "specimen",
        "material",
        "interface",
        "phase_field",
        "test",
        "conditions",
        "solver",
        "design.microstructure",
        "design.import",
        "simulator",
    ],
    products: &[
        "labels.tif",
        "solid.tif",
        "grains.csv",
        "segment.csv",
        "images/#-labels.tif",
        "images/#-solid.tif",
        "images/#-grains.csv",
        "images/#-segment.csv",
    ],
};

pub(super) const EXPERIMENTS: Reads = Reads {
    keys: &[
        "specimen",
        "material",
        "interface",
        "phase_field",
        "test",
        "conditions",
        "solver",
        "machine",
        "simulator",
        "parameters",
        "qoi",
        "prior",
        "extend",
        "design",
        "fidelity",
        "experiments",
        "calibration.likelihood",
    ],
    products: &[
        "mesh.msh",
        "meshes/#.msh",
        "labels.tif",
        "solid.tif",
        "grains.csv",
        "segment.csv",
        "images/#-labels.tif",
        "images/#-solid.tif",
        "images/#-grains.csv",
        "images/#-segment.csv",
    ],
};

pub(super) const ENSEMBLE: Reads = Reads {
    keys: &[
        "specimen",
        "material",
        "interface",
        "phase_field",
        "test",
        "conditions",
        "solver",
        "machine",
        "simulator",
        "parameters",
        "qoi",
        "prior",
        "extend",
        "design",
        "fidelity",
        // batches of `[sequential]` are placed by calibrations
        "sequential",
        "surrogate",
        "calibration",
        "experiments",
    ],
    products: &[
        "mesh.msh",
        "meshes/#.msh",
        "labels.tif",
        "solid.tif",
        "grains.csv",
        "segment.csv",
        "images/#-labels.tif",
        "images/#-solid.tif",
        "images/#-grains.csv",
        "images/#-segment.csv",
        "experiments.csv",
    ],
};

pub(super) const SURROGATE: Reads =
    Reads { keys: &["surrogate"], products: &["runs.csv", "experiments.csv"] };

/// Products of the stages `ensemble` and `surrogate` that make the forward model.
macro_rules! forward_model {
    ($($further:literal),* $(,)?) => {
        &[
            "runs.csv",
            "fidelity.json",
            "surrogate.json",
            "surrogate_error.json",
            "surrogate_uncertainty.json",
            "surrogate_specimens.json",
            "experiments.csv",
            $($further),*
        ]
    };
}

pub(super) const CALIBRATE: Reads = Reads {
    keys: &[
        "test",
        "conditions",
        "machine",
        "simulator",
        "parameters",
        "qoi",
        "prior",
        "extend",
        "design",
        "sequential",
        "surrogate",
        "experiments",
        "calibration",
        "specimen.image",
    ],
    products: forward_model!(
        "fidelity_runs.csv",
        "curves/run-#.csv",
        "curves/level-#-run-#.csv",
        "experiments/specimens.csv",
        "experiments/curves/*.csv",
        "experiments/scans/*.tif",
    ),
};

pub(super) const CONFIRM: Reads = Reads {
    keys: &[
        "specimen",
        "material",
        "interface",
        "phase_field",
        "test",
        "conditions",
        "solver",
        "simulator",
        "qoi",
        "prior",
        "design",
        "calibration.likelihood",
        "confirm",
    ],
    products: &[
        "labels.tif",
        "solid.tif",
        "grains.csv",
        "segment.csv",
        "images/#-labels.tif",
        "images/#-solid.tif",
        "images/#-grains.csv",
        "images/#-segment.csv",
        "mesh.msh",
        "experiments.csv",
        "map.csv",
        "posterior.csv",
    ],
};

// a validation is a case of its own, of any keys
pub(super) const VALIDATE: Reads = Reads {
    keys: &[""],
    products: forward_model!(
        "mesh.msh",
        "meshes/#.msh",
        "posterior.csv",
        "experiments/specimens.csv",
        "experiments/curves/*.csv",
        "experiments/scans/*.tif",
    ),
};

pub(super) const VERDICT: Reads = Reads {
    keys: &[
        "specimen",
        "simulator",
        "parameters",
        "qoi",
        "prior",
        "extend",
        "design",
        "experiments.toe",
        "calibration",
        "validation",
    ],
    products: &[
        "runs.csv",
        "failed_runs.csv",
        "experiments.csv",
        "curve_checks.csv",
        "posterior.csv",
        "posterior.txt",
        "summary.csv",
        "map.csv",
        "range.csv",
        "fit.csv",
        "influence.csv",
        "confirm.csv",
        "curves/map.csv",
        "validation.csv",
        "validation_summary.csv",
        "validation_coverage.csv",
        "warnings/*.txt",
    ],
};

// a candidate for a further test is a case of its own, of any keys
pub(super) const NEXT_TEST: Reads = Reads {
    keys: &[""],
    products: forward_model!(
        "labels.tif",
        "solid.tif",
        "grains.csv",
        "segment.csv",
        "images/#-labels.tif",
        "images/#-solid.tif",
        "images/#-grains.csv",
        "images/#-segment.csv",
        "mesh.msh",
        "meshes/#.msh",
        "fidelity_runs.csv",
        "curves/run-#.csv",
        "curves/level-#-run-#.csv",
        "posterior.csv",
        "experiments/specimens.csv",
        "experiments/curves/*.csv",
        "experiments/scans/*.tif",
    ),
};

// the report shows the whole case and the results of all stages
pub(super) const REPORT: Reads = Reads { keys: &[""], products: &["*", "*/*", "*/*/*"] };

pub(super) const JOINT_CALIBRATE: Reads =
    Reads { keys: &["tests", "prior", "extend", "calibration"], products: &["tests/*/*"] };

pub(super) const JOINT_VERDICT: Reads = Reads {
    keys: &[""],
    products: &[
        "posterior.csv",
        "posterior.txt",
        "summary.csv",
        "map.csv",
        "joint/parameters.json",
        "warnings/calibrate.txt",
        "tests/*/*",
        "tests/*/*/*",
    ],
};

pub(super) const JOINT_REPORT: Reads = REPORT;
