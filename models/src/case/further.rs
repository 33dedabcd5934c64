//! `[further_tests]`: candidates for the next tests, and the precision that they must achieve.

use std::collections::BTreeMap;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::overlay::{merge, nested, remove};
use super::schema::{changed_tables, percent_of_quantities};
use super::{ByParameter, Case, CaseFile, Microstructure, SpecimenGeometry, TestCase};
use crate::error::InputError;
use crate::qoi::Quantity;

/// Tables that a candidate test may change. All other tables are fixed, because they define the calibration.
const TABLES: [&str; 11] = [
    "specimen",
    "material",
    "interface",
    "phase_field",
    "test",
    "machine",
    "conditions",
    "solver",
    "simulator",
    "design",
    "fidelity",
];

/// `[further_tests]`: candidates for the next tests.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FurtherTestsCase {
    /// Numbers of additional specimens for which the posterior is predicted.
    #[schemars(inner(range(min = 1, max = 100_000)))]
    pub specimens: Vec<usize>,
    /// Target widths of the 90 % intervals of parameters, in the parameter's unit. The number of specimens that reaches
    /// each width is computed.
    pub width90: ByParameter<f64>,
    /// Candidate tests, in addition to more specimens of the present test.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub candidate: Vec<CandidateCase>,
}

/// `[[further_tests.candidate]]`: one candidate for the next test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CandidateCase {
    /// Name of the candidate.
    pub name: String,
    /// With `[[tests]]`: name of the test that the candidate changes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub test: Option<String>,
    /// Quantities that the curves of the candidate supply. If the candidate is the present test, these quantities are
    /// added to the quantities that the case compares; by default, no quantity is added. If the candidate is another
    /// test, the default is the quantities that the case compares.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub quantities: Vec<Quantity>,
    /// Keys of the case whose values differ in this test, with the values for this test. If both `set` and `without`
    /// are empty, the candidate is the present test.
    #[serde(default, skip_serializing_if = "Table::is_empty")]
    #[schemars(schema_with = "candidate_keys")]
    pub set: Table,
    /// Keys of the case that are removed for this test.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<String>,
    /// Number of simulations of the design, if the candidate is another test.
    #[serde(default = "thirty")]
    #[schemars(range(min = 4, max = 1_000_000))]
    pub runs: usize,
    /// Standard deviation in % of quantities between specimens of another test. The default is the scatter of the
    /// present specimens.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[schemars(transform = percent_of_quantities(1e-3, 200.0))]
    pub scatter_percent: BTreeMap<Quantity, f64>,
}

fn candidate_keys(_: &mut SchemaGenerator) -> Schema {
    changed_tables(&TABLES)
}

impl Default for FurtherTestsCase {
    fn default() -> Self {
        Self {
            specimens: vec![1, 2, 4, 8, 16, 32],
            width90: ByParameter::default(),
            candidate: Vec::new(),
        }
    }
}

impl CandidateCase {
    /// Whether the candidate is a different test, and not only further quantities from curves of the present test.
    pub(crate) fn is_another_test(&self) -> bool {
        !(self.set.is_empty() && self.without.is_empty())
    }

    /// Path of the candidate's mesh file as written in the case; `None` if the candidate uses the
    /// mesh of the case.
    pub(crate) fn mesh(&self) -> Option<&str> {
        self.set.get("specimen")?.get("mesh")?.as_str()
    }

    /// Sets the path of the mesh file.
    pub(crate) fn set_mesh(&mut self, path: &str) {
        merge(&mut self.set, &nested("specimen.mesh", path.into()));
    }

    /// Quantities that the curves of the candidate supply, if the case compares the quantities `present`.
    pub(crate) fn measured(&self, present: &[Quantity]) -> Vec<Quantity> {
        let mut measured = match self.is_another_test() {
            true if !self.quantities.is_empty() => Vec::new(),
            _ => present.to_vec(),
        };
        for quantity in &self.quantities {
            if !measured.contains(quantity) {
                measured.push(quantity.clone());
            }
        }
        measured
    }
}

impl CaseFile {
    /// Returns the case for the runs of a candidate, with paths relative to the folder of this case. The returned
    /// case has no experiments, and all its runs use the cheapest mesh.
    ///
    /// # Errors
    /// If the candidate sets or removes a key that another test cannot change, or if the result is not a valid case.
    pub(crate) fn of_candidate(&self, candidate: &CandidateCase) -> Result<Self, InputError> {
        let place = |rest: &str| format!("further_tests.candidate ({}).{rest}", candidate.name);
        let refuse = |rest: &str, key: &str| {
            let problem = "cannot differ in another test";
            let help = format!("Name keys of: {}.", TABLES.join(", "));
            Err(InputError::new(&self.path, place(rest), key, problem, help))
        };
        if let Some(key) = candidate.set.keys().find(|key| !TABLES.contains(&key.as_str())) {
            return refuse("set", key);
        }
        let mut case = self.case.clone();
        case.prior = case.whole_prior();
        case.extend.clear();
        case.qoi.quantities = candidate.measured(&case.compared_quantities());
        case.design.runs = candidate.runs;
        case.design.packings = case.design.packings.map(|packings| packings.min(candidate.runs));
        case.fidelity.levels.truncate(1);
        // no run of a candidate is repeated, but the check of the levels requires at least 3 repeats
        case.fidelity.levels.iter_mut().for_each(|level| level.repeats = 3);
        let has_mesh = candidate.mesh().is_some();
        if has_mesh {
            case.design.packings = None;
            case.fidelity = Default::default();
        }
        let Case { calibration, confirm, further_tests, .. } = &mut case;
        *calibration = Default::default();
        *confirm = Default::default();
        *further_tests = Default::default();
        case.experiments = None;
        case.validation.clear();
        let mut table: Table = Table::try_from(&case).map_err(|e| {
            let help = "Leave the candidate out.";
            InputError::new(&self.path, place("set"), "", e.to_string(), help)
        })?;
        if let (true, Some(Value::Table(specimen))) = (has_mesh, table.get_mut("specimen")) {
            // a mesh file replaces all other keys of the specimen
            specimen.retain(|key, _| key == "order");
        }
        for key in &candidate.without {
            let first = key.split('.').next().unwrap_or_default();
            if !TABLES.contains(&first) {
                return refuse("without", key);
            }
            if !remove(&mut table, key) {
                let help = "Name keys of this case by their paths.";
                let problem = "is not in the case";
                return Err(InputError::new(&self.path, place("without"), key, problem, help));
            }
        }
        merge(&mut table, &candidate.set);
        Self::parse(&table.to_string(), &self.path).map_err(|error| {
            // line numbers of the merged text are not line numbers of the user's file
            InputError { place: place(&error.place), excerpt: None, ..error }
        })
    }

    /// Whether a candidate, whose case is `own`, is the present test: at most keys of runs, load steps and solvers
    /// differ.
    pub(super) fn is_present_test(&self, candidate: &CandidateCase, own: &Self) -> bool {
        let unchanged =
            CandidateCase { set: Table::new(), without: Vec::new(), ..candidate.clone() };
        let test = |case: &Case| {
            let (design, fidelity, solver) = Default::default();
            let test = TestCase { steps: None, adaptive: None, ..case.test.clone() };
            Case { design, fidelity, solver, test, ..case.clone() }
        };
        // if the present test lacks a quantity of the candidate, the two tests differ
        let present = self.of_candidate(&unchanged);
        present.is_ok_and(|present| test(&own.case) == test(&present.case))
    }

    /// Checks each candidate as a complete case.
    pub(super) fn check_further_tests(&self) -> Result<(), InputError> {
        let further = &self.case.further_tests;
        // a case without a prior is a single simulation and calibrates nothing
        let Some(prior) = self.case.whole_prior() else { return Ok(()) };
        for &specimens in &further.specimens {
            let (key, help) = ("further_tests.specimens", "Write them as specimens = [4, 8, 16].");
            self.within(key, specimens as f64, 1.0, 1e5, "specimens", help)?;
        }
        for (parameter, &width) in further.width90.iter() {
            let key = format!("further_tests.width90.{parameter}");
            let Some(prior) = prior.get(parameter) else {
                let help = "Name a parameter of [prior].";
                return Err(self.error(&key, width.to_string(), "is not calibrated", help));
            };
            let [lower, upper] = prior.range();
            let most = upper - lower;
            let help = "It is the width of a 90 % interval, in the parameter's unit.";
            self.within(&key, width, 1e-9 * most, most, "(the prior's width)", help)?;
        }
        let mut names: Vec<&str> = vec![PRESENT];
        for candidate in &further.candidate {
            let place = |rest: &str| format!("further_tests.candidate ({}){rest}", candidate.name);
            let refuse = |rest: &str, value: &str, problem: &str, help: &str| {
                Err(self.error(&place(rest), value, problem, help))
            };
            if let Some(test) = &candidate.test {
                let problem = "names a test of [[tests]], and the case has one test";
                return refuse(".test", &format!("{test:?}"), problem, "Remove it.");
            }
            if names.contains(&candidate.name.as_str()) || candidate.name.trim().is_empty() {
                let help = "Give each candidate a name of its own.";
                return refuse(".name", "", "is taken", help);
            }
            names.push(&candidate.name);
            let present = self.case.compared_quantities();
            let measured = candidate.measured(&present);
            if !candidate.is_another_test() {
                if measured.len() == present.len() {
                    let help = "Name further quantities of the present curves, or the changed keys of another test in \
                                set. More specimens of the present test need no candidate.";
                    return refuse("", "", "is the present test", help);
                }
                if self.case.experiments.as_ref().is_some_and(|e| e.values.is_some()) {
                    let help = "Name all quantities of the tables in qoi.quantities.";
                    return refuse(
                        "",
                        "",
                        "needs curves for further quantities, and the case has no curves",
                        help,
                    );
                }
                if let Some(quantity) = candidate.scatter_percent.keys().next() {
                    let help = "Remove it: the scatter is computed from the present curves.";
                    let key = format!(".scatter_percent.{quantity}");
                    return refuse(
                        &key,
                        "",
                        "is given, but this candidate has no new specimens",
                        help,
                    );
                }
                continue;
            }
            for (quantity, &percent) in &candidate.scatter_percent {
                let key = place(&format!(".scatter_percent.{quantity}"));
                let help = "It is the standard deviation between specimens in %: 5.0 for 5 %.";
                self.within(&key, percent, 1e-3, 200.0, "%", help)?;
                if !measured.contains(quantity) {
                    let help = "Name quantities of this candidate.";
                    return Err(self.error(&key, percent.to_string(), "is not measured", help));
                }
            }
            let unknown = measured.iter().find(|quantity| {
                !present.contains(quantity) && !candidate.scatter_percent.contains_key(quantity)
            });
            if let Some(quantity) = unknown {
                let help = "The present specimens do not show the scatter of this quantity: state it in %.";
                let key = format!(".scatter_percent.{quantity}");
                return refuse(&key, "", "is missing", help);
            }
            if self.case.design.import.is_some() {
                let help = "Give [simulator], which can make these runs.";
                return refuse(
                    ".set",
                    "",
                    "needs runs, and the runs of this case are imported",
                    help,
                );
            }
            let own = self.of_candidate(candidate)?;
            if self.is_present_test(candidate, &own) {
                let help = "Change a value of the present test. More specimens of the present test need no candidate, and \
                            further quantities of its curves need quantities alone, without set.";
                return refuse(".set", "", "has the values of the present test", help);
            }
            let is_made_anew = match own.geometry()? {
                SpecimenGeometry::Mesh { .. }
                | SpecimenGeometry::Absent
                | SpecimenGeometry::Block { .. }
                | SpecimenGeometry::Surfaces { .. }
                | SpecimenGeometry::Cylinder { scan: None, .. } => true,
                // a scanned packing has the grains of the calibrated specimen, unless each run generates its own
                // packing
                SpecimenGeometry::Cylinder { grains, .. } => {
                    grains.is_some() && own.case.design.microstructure == Microstructure::PerRun
                }
                SpecimenGeometry::Image { .. } => false,
            };
            if own.case.specimen != self.case.specimen && !is_made_anew {
                let help = "The grains of this case are found in an image. Give a mesh file, or a packing without a scan.";
                return refuse(".set", "specimen", "makes no mesh of its own", help);
            }
        }
        Ok(())
    }
}

/// Name of the candidate that consists of more specimens of the present test.
pub(crate) const PRESENT: &str = "more specimens";

fn thirty() -> usize {
    30
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    const CASE: &str = "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 1.4\n\
        [material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n\
        [test]\ndisplacement_mm = 0.2\nduration_s = 1.0\nsteps = 20\n\
        [prior]\nmatrix.young_mpa = [250.0, 300.0]\n[experiments]\ntable = \"specimens.csv\"\n";

    fn mistakes(text: &str) -> Vec<String> {
        let mistakes = CaseFile::parse_all(text, Path::new("case.toml")).1;
        mistakes.iter().map(ToString::to_string).collect()
    }

    /// A candidate that repeats the values of the present test, or that changes only settings of the runs, is not
    /// another test.
    #[test]
    fn a_candidate_with_the_values_of_the_present_test_is_refused() {
        let with = |set: &str| {
            mistakes(&format!("{CASE}[[further_tests.candidate]]\nname = \"slow\"\n{set}\n"))
        };
        for set in [
            "set.test.duration_s = 1.0",
            "set.test = { displacement_mm = 0.2, steps = 40 }",
            "set.design.seed = 7",
            "set.material.matrix.young_mpa = 275.0",
        ] {
            let found = with(set);
            assert_eq!(found.len(), 1, "{set}: {found:?}");
            let part = "further_tests.candidate (slow).set: has the values of the present test";
            assert!(found[0].contains(part), "{found:?}");
        }
        for set in ["set.test.duration_s = 1.0001", "set.specimen.height_mm = 4.5"] {
            assert_eq!(with(set), [""; 0], "{set}");
        }
    }

    /// A candidate that has the values of another test of the case is refused, too.
    #[test]
    fn a_candidate_with_the_values_of_another_test_is_refused() {
        let with = |duration_s: f64| {
            mistakes(&format!(
                "{CASE}[[tests]]\nname = \"fast\"\n[[tests]]\nname = \"slow\"\nset.test.duration_s = 30.0\n\
                 [[further_tests.candidate]]\nname = \"slower\"\ntest = \"fast\"\nset.test.duration_s = {duration_s:?}\n"
            ))
        };
        assert_eq!(with(60.0), [""; 0]);
        let found = with(30.0);
        assert!(found[0].contains("has the values of the test slow"), "{found:?}");
    }
}
