//! `[fidelity]`: cheaper meshes for the runs of the design.

use fem::{GrainMode, Homogenisation, Meshing, Order};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Case, CaseFile, DesignCase, Mistakes, SpecimenGeometry};
use crate::error::InputError;

/// Smallest number of runs that are repeated on the next mesh.
const LEAST_REPEATS: usize = 3;

/// `[fidelity]`: cheaper meshes. All runs of the design use the first mesh. Some runs are repeated on the second mesh,
/// some of these on the third, and so on up to the mesh of the specimen. All runs are corrected by the ratios between
/// the results of successive meshes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FidelityCase {
    /// The cheaper meshes, cheapest first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub levels: Vec<LevelCase>,
}

/// An entry of `fidelity.levels`; omitted values are taken from the mesh of the specimen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LevelCase {
    /// Edge in mm of the hexahedra that are split into tetrahedra.
    #[schemars(range(min = 1e-3, max = 1e3))]
    pub spacing_mm: f64,
    /// Element order, 1 or 2.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub order: Option<Order>,
    /// Representation of grains in the mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grain_mode: Option<GrainMode>,
    /// Homogenisation rule for the moduli of tetrahedra that are partly grain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub homogenisation: Option<Homogenisation>,
    /// Number of equal load steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 10, max = 1_000_000_000))]
    pub steps: Option<u32>,
    /// Number of runs on this mesh that are repeated on the next mesh.
    #[serde(default = "eight")]
    #[schemars(range(min = LEAST_REPEATS, max = 1_000_000))]
    pub repeats: usize,
}

impl LevelCase {
    /// Returns the mesher settings of this level: the settings of the specimen, overridden by the values of the level.
    pub(crate) fn meshing(&self, specimen: &Meshing) -> Meshing {
        Meshing {
            spacing_mm: self.spacing_mm,
            mode: self.grain_mode.unwrap_or(specimen.mode),
            curved: self.order.map_or(specimen.curved, |order| order == Order::Quadratic),
            ..*specimen
        }
    }

    /// Whether the mesh of the level equals the mesh of the specimen.
    fn repeats_the_specimen(&self, case: &Case) -> bool {
        let specimen = &case.specimen;
        specimen.spacing_mm == Some(self.spacing_mm)
            && self.order.is_none_or(|order| order == specimen.order)
            && self.grain_mode.is_none_or(|mode| mode == specimen.grain_mode)
            && self.homogenisation.is_none_or(|rule| rule == specimen.homogenisation)
            && self.steps.is_none_or(|steps| case.test.steps == Some(steps))
    }
}

impl CaseFile {
    /// Checks the levels against the specimen and the design.
    pub(super) fn check_fidelity(&self, geometry: &SpecimenGeometry, mistakes: &mut Mistakes) {
        let levels = &self.case.fidelity.levels;
        if *geometry == SpecimenGeometry::Absent {
            // `check_outside` reports this table as an error
            return;
        }
        if let (SpecimenGeometry::Mesh { .. }, false) = (geometry, levels.is_empty()) {
            mistakes.note(Err(self.error(
                "fidelity.levels",
                "",
                "needs a specimen that is meshed here: specimen.mesh is a finished mesh",
                "Leave out [fidelity], or describe the specimen by a packing or an image.",
            )));
            return;
        }
        // another check reports an invalid number of runs; such a number does not limit the number of repeats
        let valid = |runs: usize, least: usize| Some(runs).filter(|&runs| runs >= least);
        let mut runs = valid(self.case.design.runs, DesignCase::LEAST_RUNS);
        for (i, level) in levels.iter().enumerate() {
            mistakes.note(self.check_level(i, level, runs, geometry));
            runs = valid(level.repeats, LEAST_REPEATS);
        }
    }

    /// Checks a level. `runs` is the number of runs on the cheaper mesh; `None` if this number is refused.
    fn check_level(
        &self,
        i: usize,
        level: &LevelCase,
        runs: Option<usize>,
        geometry: &SpecimenGeometry,
    ) -> Result<(), InputError> {
        let key = |name: &str| format!("fidelity.levels[{i}].{name}");
        let help = "A grain needs several elements: for the paper's grains 0.7 is coarse and 0.35 is fine.";
        self.within(&key("spacing_mm"), level.spacing_mm, 1e-3, 1e3, "mm", help)?;
        if let SpecimenGeometry::Cylinder { radius_mm, height_mm, .. } = geometry {
            self.check_spacing(&key("spacing_mm"), level.spacing_mm, *radius_mm, *height_mm)?;
        }
        if let SpecimenGeometry::Block { size_mm, planes_mm, .. } = geometry {
            let key = key("spacing_mm");
            self.check_block_spacing(&key, *size_mm, planes_mm, level.spacing_mm)?;
        }
        if level.repeats_the_specimen(&self.case) {
            return Err(self.error(
                &format!("fidelity.levels[{i}]"),
                "",
                "has the mesh of [specimen], with which the levels are compared",
                "Name a cheaper mesh: a larger spacing_mm, or order = 1.",
            ));
        }
        if let Some(steps) = level.steps {
            self.check_number_of_steps(&key("steps"), steps)?;
        }
        let help = "These runs are repeated on the next mesh: at least 3 show the scatter, and 8 are enough.";
        let most = runs.map_or(1e6, |runs| runs as f64);
        let (repeats, least) = (level.repeats as f64, LEAST_REPEATS as f64);
        self.within(&key("repeats"), repeats, least, most, "runs", help)
    }

    /// Checks the spacing of the second mesh at the posterior mode.
    pub(super) fn check_second_mesh(&self, geometry: &SpecimenGeometry) -> Result<(), InputError> {
        let key = "confirm.second_spacing_mm";
        let Some(spacing_mm) = self.case.confirm.second_spacing_mm else { return Ok(()) };
        if *geometry == SpecimenGeometry::Absent {
            // `check_outside` reports this key as an error
            return Ok(());
        }
        if self.case.specimen.spacing_mm == Some(spacing_mm) {
            let help = "Another spacing shows the error of the mesh: half of specimen.spacing_mm, or 1.2 times.";
            return Err(self.error(
                key,
                spacing_mm.to_string(),
                "equals specimen.spacing_mm",
                help,
            ));
        }
        self.within(key, spacing_mm, 1e-3, 1e3, "mm", "Half of specimen.spacing_mm is usual.")?;
        match geometry {
            SpecimenGeometry::Cylinder { radius_mm, height_mm, .. } => {
                self.check_spacing(key, spacing_mm, *radius_mm, *height_mm)
            }
            SpecimenGeometry::Block { size_mm, planes_mm, .. } => {
                self.check_block_spacing(key, *size_mm, planes_mm, spacing_mm)
            }
            _ => Ok(()),
        }
    }
}

fn eight() -> usize {
    8
}

#[cfg(test)]
mod tests {
    use crate::case::{Case, CaseFile};

    /// Each wrong number is reported once, without a range that follows from another wrong number.
    #[test]
    fn a_refused_number_of_runs_limits_no_repeats() {
        let table: toml::Table = Case::TEMPLATE.parse().unwrap();
        let mistakes = |runs: i64, repeats: [i64; 2]| {
            let mut table = table.clone();
            let levels = repeats.iter().zip([0.9, 0.7]).map(|(&repeats, spacing_mm)| {
                toml::Table::from_iter([
                    ("spacing_mm".to_owned(), toml::Value::from(spacing_mm)),
                    ("repeats".to_owned(), repeats.into()),
                ])
            });
            let levels: Vec<toml::Value> = levels.map(toml::Value::Table).collect();
            table["fidelity"]["levels"] = levels.into();
            table["design"]["runs"] = runs.into();
            let (_, mistakes) = CaseFile::parse_all(&table.to_string(), "case.toml".as_ref());
            mistakes.iter().map(ToString::to_string).collect::<Vec<_>>()
        };
        assert_eq!(mistakes(100, [20, 10]), [""; 0]);
        for (runs, repeats, key) in [
            (1, [20, 10], "design.runs = 1"),
            (100, [1, 10], "fidelity.levels[0].repeats = 1"),
            (100, [20, 21], "fidelity.levels[1].repeats = 21"),
        ] {
            let found = mistakes(runs, repeats);
            assert!(found.len() == 1 && found[0].contains(key), "{found:?}");
        }
    }
}
