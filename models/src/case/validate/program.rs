//! Checks of `test.program`, and of the quantities that need a certain load program.

use fem::{FemError, LoadProgram};

use super::super::{Case, CaseFile, ConditionsCase, Mistakes, ProgramPointCase, Toe};
use crate::error::InputError;
use crate::qoi::{Extent, Quantity};

/// Largest number of points of a load program; a larger number is assumed to be a measured curve.
const MOST_POINTS: usize = 1000;

/// Checks the load program, and refuses keys that a load program replaces or does not allow.
pub(super) fn check_program(file: &CaseFile, mistakes: &mut Mistakes) {
    let Some(program) = &file.case.test.program else { return };
    mistakes.note(check_beside_program(file));
    let help =
        "List points in the order of time: program = [{ time_s = 1.0, displacement_mm = 0.1 }, …].";
    let count = program.len();
    if count == 0 || count > MOST_POINTS {
        let problem = format!("has {count} points: 1 to {MOST_POINTS} are allowed");
        mistakes.note(Err(file.error("test.program", "", problem, help)));
        return;
    }
    let mut is_complete = true;
    for (k, point) in program.iter().enumerate() {
        let checked = check_point(file, k, point);
        is_complete &= checked.is_ok();
        mistakes.note(checked);
    }
    if is_complete {
        mistakes.note(check_order(file));
    }
}

/// Refuses keys that a load program replaces or does not allow.
fn check_beside_program(file: &CaseFile) -> Result<(), InputError> {
    let Case { test, conditions, experiments, .. } = &file.case;
    let replaced =
        "The program states displacement and time: remove this key, or remove test.program.";
    let corrects = experiments.as_ref().is_some_and(|e| e.toe == Toe::Correct);
    let refused = [
        (test.displacement_mm.is_some(), "test.displacement_mm", replaced),
        (test.duration_s.is_some(), "test.duration_s", replaced),
        (
            test.arc_length.is_some(),
            "test.arc_length",
            "The arc-length method needs constant speed: remove this key, and use steps or adaptive.",
        ),
        (
            // the conditions of `test.kind` follow the program
            conditions.as_ref().is_some_and(ConditionsCase::is_written),
            "conditions",
            "Conditions replace the platens that the program moves: remove one of the two.",
        ),
        (
            corrects,
            "experiments.toe",
            "The time of a curve cannot be counted from a corrected origin: write toe = \"report\".",
        ),
    ];
    let refused = refused.into_iter().find(|(is_given, ..)| *is_given);
    refused.map_or(Ok(()), |(_, key, help)| {
        Err(file.error(key, "", "is given beside test.program", help))
    })
}

fn check_point(file: &CaseFile, k: usize, point: &ProgramPointCase) -> Result<(), InputError> {
    let key = |name: &str| format!("test.program[{k}].{name}");
    let ProgramPointCase { displacement_mm, force_n, steps, .. } = *point;
    match (displacement_mm, force_n) {
        (Some(_), Some(force_n)) => {
            let help =
                "The platen is controlled by one of the two in each segment: remove the other.";
            let problem = "is given beside displacement_mm";
            return Err(file.error(&key("force_n"), force_n.to_string(), problem, help));
        }
        (None, None) => {
            let help = "Add the displacement of the top platen at this time, or the force as force_n; the start is 0 mm \
                        and 0 N at 0 s.";
            return Err(file.error(&key("displacement_mm"), "", "is missing", help));
        }
        (Some(displacement_mm), None) => {
            let (most_mm, help) = match (file.case.test.kind, file.case.specimen.height_mm) {
                (None, Some(height_mm)) => {
                    let help =
                        "It is how far the top platen has moved down: at most half the height.";
                    (0.5 * height_mm, help)
                }
                (None, None) => (1e3, "It is how far the top platen has moved down."),
                (Some(_), _) => (1e3, "It is how far the moving surface of test.kind has moved."),
            };
            file.within(&key("displacement_mm"), displacement_mm, 0.0, most_mm, "mm", help)?;
        }
        (None, Some(force_n)) => {
            let help =
                "It is the force on the whole top platen: positive in compression, at least 0.";
            file.within(&key("force_n"), force_n, 0.0, 1e9, "N", help)?;
        }
    }
    let Some(steps) = steps else { return Ok(()) };
    let help = "It is the number of equal load steps up to this point.";
    file.within(&key("steps"), f64::from(steps), 1.0, 1e6, "steps", help)
}

/// Checks the order of the times with the checks of `fem`.
fn check_order(file: &CaseFile) -> Result<(), InputError> {
    let Err(error) = file.case.test.load_program() else { return Ok(()) };
    let FemError::OutOfRange { entity, field, value, requirement } = error else {
        let help = "breccia init writes a case that explains every key.";
        return Err(file.error("test.program", "", error.to_string(), help));
    };
    let number = entity.rsplit("point ").next().and_then(|number| number.parse::<usize>().ok());
    let key = match number {
        Some(number) => format!("test.program[{}].{field}", number - 1),
        None => "test.program".to_owned(),
    };
    let help = match field {
        "time_s" => "Times count from the start of the test and increase from point to point.",
        _ => "Let the platen press the specimen at one point at least.",
    };
    Err(file.error(&key, value.to_string(), format!("must be {requirement}"), help))
}

/// Refuses a quantity that needs a time, a hold or an unloading that the test does not have.
pub(super) fn check_branches(file: &CaseFile) -> Result<(), InputError> {
    if !file.case.is_built_in() {
        // the test of an outside simulator is not known here
        return Ok(());
    }
    let test = &file.case.test;
    let Ok(program) = test.load_program() else {
        // another check reports the invalid program
        return Ok(());
    };
    let branches = program.as_ref().map(branches).unwrap_or_default();
    let count = |kind: Segment| branches.iter().filter(|branch| **branch == kind).count();
    let unloadings = count(Segment::Unloading) + count(Segment::Unknown);
    let refuse = |quantity: &Quantity, problem: &str, help: &str| {
        Err(file.error("qoi.quantities", quantity.to_string(), problem, help))
    };
    for quantity in &file.case.compared_quantities() {
        match quantity.extent() {
            Extent::Time(time_s) if time_s > test.duration_s() => {
                let problem = format!("lies beyond the end of the test, {} s", test.duration_s());
                return refuse(quantity, &problem, "Name a time that every run reaches.");
            }
            Extent::ForceHold if count(Segment::ForceHold) == 0 => {
                let help = "Add two points with the same force_n to test.program.";
                return refuse(quantity, "needs a hold of the force, and the test has none", help);
            }
            Extent::Hold(needed) if count(Segment::Hold) < needed as usize => {
                let help = "Add two points with the same displacement_mm to test.program.";
                let problem = match needed {
                    1 => "needs a hold, and the test has none".to_owned(),
                    _ => format!("needs {needed} holds, and the test has {}", count(Segment::Hold)),
                };
                return refuse(quantity, &problem, help);
            }
            Extent::Unloading(needed) if unloadings < needed as usize => {
                let help = "Add a point with a smaller displacement_mm to test.program.";
                let problem = match needed {
                    1 => "needs an unloading, and the test has none".to_owned(),
                    _ => format!("needs {needed} unloadings, and the test has {unloadings}"),
                };
                return refuse(quantity, &problem, help);
            }
            _ => {}
        }
    }
    Ok(())
}

/// Kind of a branch of a load program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Segment {
    Loading,
    /// Hold of a displacement.
    Hold,
    ForceHold,
    Unloading,
    /// The segment changes from displacement to force, or from force to displacement. Whether it unloads is not known before
    /// the simulation.
    Unknown,
}

/// Returns the branches of a load program from its first loading on. Consecutive segments of the same known kind are one
/// branch.
fn branches(program: &LoadProgram) -> Vec<Segment> {
    let mut branches: Vec<Segment> = Vec::new();
    // the program starts without displacement and without force
    let mut before = (Some(0.0), Some(0.0));
    for point in program.points() {
        let end = (point.displacement_mm(), point.force_n());
        let segment = match (before, end) {
            ((Some(from), _), (Some(to), _)) => Segment::between(from, to, Segment::Hold),
            ((_, Some(from)), (_, Some(to))) => Segment::between(from, to, Segment::ForceHold),
            _ => Segment::Unknown,
        };
        before = end;
        let rests = branches.is_empty() && !matches!(segment, Segment::Loading | Segment::Unknown);
        let continues = branches.last() == Some(&segment) && segment != Segment::Unknown;
        if !rests && !continues {
            branches.push(segment);
        }
    }
    branches
}

impl Segment {
    /// Kind of a segment with these values of the controlled displacement or force.
    fn between(from: f64, to: f64, hold: Self) -> Self {
        if to > from {
            Self::Loading
        } else if to < from {
            Self::Unloading
        } else {
            hold
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::super::CaseFile;

    const HOLD: &str = "[{ time_s = 0.1, displacement_mm = 0.05, steps = 10 }, { time_s = 5.0, displacement_mm = 0.05 }]";

    /// Parses a small case whose table `[test]` contains the lines `test`, followed by the tables
    /// `further`.
    fn parse(test: &str, further: &str) -> Result<CaseFile, String> {
        let text = format!(
            "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 0.7\n\
             [material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[test]\n{test}\n{further}"
        );
        CaseFile::parse(&text, Path::new("case.toml")).map_err(|error| error.to_string())
    }

    #[test]
    fn a_program_replaces_displacement_and_duration() {
        let file = parse(&format!("program = {HOLD}\nsteps = 20\ntemperature_celsius = 50.0"), "")
            .unwrap();
        let test = &file.case.test;
        assert_eq!((test.duration_s(), test.duration_s, test.displacement_mm), (5.0, None, None));
        assert_eq!(test.temperature_celsius, Some(50.0));
        let again = CaseFile::parse(&file.case.to_toml(), Path::new("again.toml")).unwrap();
        assert_eq!(again.case, file.case);
        let program = test.load_program().unwrap().unwrap();
        assert_eq!((program.largest_mm(), program.points()[0].steps), (0.05, Some(10)));
        let plain = parse("displacement_mm = 0.1", "").unwrap().case.test;
        assert_eq!((plain.duration_s(), plain.duration_s), (1.0, Some(1.0)));
        assert_eq!(plain.load_program().unwrap(), None);
    }

    #[test]
    fn mistakes_name_the_point_and_the_key() {
        let point = |point: &str| HOLD.replace("{ time_s = 5.0, displacement_mm = 0.05 }", point);
        let both = |key: &str| format!("{key}\nprogram = {HOLD}");
        for (test, fragments) in [
            (both("displacement_mm = 0.1"), ["test.displacement_mm", "beside test.program"]),
            (both("duration_s = 5.0"), ["test.duration_s", "beside test.program"]),
            (
                both("stop_below_peak = 0.1\narc_length = { step = 0.1, release_n_mm = 0.1 }"),
                ["test.arc_length", "constant speed"],
            ),
            ("program = []".into(), ["test.program", "has 0 points"]),
            (
                format!("program = {}", point("{ time_s = 0.05, displacement_mm = 0.05 }")),
                ["test.program[1].time_s = 0.05", "increase from point to point"],
            ),
            (
                format!("program = {}", point("{ time_s = 0.1, displacement_mm = 0.0 }")),
                ["test.program[1].time_s = 0.1", "later than the point before"],
            ),
            (
                format!(
                    "program = {}",
                    point("{ time_s = 5.0, force_n = 10.0, displacement_mm = 0.05 }")
                ),
                ["test.program[1].force_n = 10", "beside displacement_mm"],
            ),
            (
                format!("program = {}", point("{ time_s = 5.0, force_n = -10.0 }")),
                ["test.program[1].force_n = -10", "positive in compression"],
            ),
            (
                format!("program = {}", point("{ time_s = 5.0 }")),
                ["test.program[1].displacement_mm", "is missing"],
            ),
            (
                format!("program = {}", point("{ time_s = 5.0, displacement_mm = -0.05 }")),
                ["test.program[1].displacement_mm = -0.05", "half the height"],
            ),
            (
                format!("program = {}", point("{ time_s = 5.0, displacement_mm = 3.0 }")),
                ["test.program[1].displacement_mm = 3", "half the height"],
            ),
            (
                format!(
                    "program = {}",
                    point("{ time_s = 5.0, displacement_mm = 0.05, steps = 0 }")
                ),
                ["test.program[1].steps = 0", "load steps"],
            ),
            (
                format!("program = {}", point("{ time = 5.0, displacement_mm = 0.05 }")),
                ["unknown key \"time\"", "time_s"],
            ),
            (
                "program = [{ time_s = 1.0, displacement_mm = 0.0 }]".into(),
                ["test.program = 0", "press the specimen"],
            ),
            (both("temperature_celsius = -300.0"), ["test.temperature_celsius = -300", "°C"]),
            (both("steps = 0"), ["test.steps = 0", "at least 1"]),
            ("steps = 4".into(), ["test.displacement_mm", "test.program"]),
        ] {
            let message = parse(&test, "").unwrap_err();
            for fragment in fragments {
                assert!(message.contains(fragment), "{fragment:?} is not in {message:?} of {test}");
            }
        }
        let measure = "measure = { surface = \"top\", direction = [0, 0, -1] }";
        let conditions = format!("[conditions]\nremove_rigid_motions = true\n{measure}");
        let message = parse(&format!("program = {HOLD}"), &conditions).unwrap_err();
        assert!(message.contains("conditions: is given beside test.program"), "{message}");
    }

    #[test]
    fn quantities_without_their_branch_or_time_are_refused() {
        let quantities = |list: &str| format!("[qoi]\nquantities = [{list}]\n");
        let program = format!("program = {HOLD}");
        // a rest at the start, a loading in two segments, two unloadings (one in two segments), and a hold of the rest
        let points = [
            (1.0, 0.0),
            (2.0, 0.01),
            (3.0, 0.05),
            (4.0, 0.03),
            (5.0, 0.02),
            (6.0, 0.05),
            (7.0, 0.0),
            (8.0, 0.0),
        ];
        let points =
            points.map(|(t, mm)| format!("{{ time_s = {t:?}, displacement_mm = {mm:?} }}"));
        let twice = format!("program = [{}]", points.join(", "));
        for (test, list, part) in [
            ("displacement_mm = 0.1", "\"relaxed-fraction\"", "needs a hold"),
            (&program, "\"unloading-slope\"", "needs an unloading"),
            (&program, "\"hysteresis-energy\"", "needs an unloading"),
            (&program, "\"relaxed-fraction-2\"", "needs 2 holds, and the test has 1"),
            (&twice, "\"unloading-slope-3\"", "needs 3 unloadings, and the test has 2"),
            (&twice, "\"hysteresis-energy-3\"", "needs 3 unloadings"),
            (&program, "\"force-at-6-s\"", "beyond the end of the test, 5 s"),
            (&program, "\"force-at-0.06-mm\"", "largest displacement of test.program = 0.05"),
            ("displacement_mm = 0.1", "\"force-at-1.5-s\"", "beyond the end of the test, 1 s"),
        ] {
            let message = parse(test, &quantities(list)).unwrap_err();
            for part in ["qoi.quantities", part] {
                assert!(message.contains(part), "{part:?} is not in {message:?} of {list}");
            }
        }
        let good = quantities("\"relaxed-fraction\", \"force-at-5-s\", \"force-at-0.05-s\"");
        parse(&program, &good).unwrap();
        parse("displacement_mm = 0.1", &quantities("\"force-at-0.5-s\"")).unwrap();
        let good =
            quantities("\"unloading-slope-2\", \"hysteresis-energy-2\", \"relaxed-fraction-1\"");
        parse(&twice, &good).unwrap();
    }
}
