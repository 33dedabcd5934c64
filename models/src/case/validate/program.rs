//! Checks of `test.program`, and of the quantities that need a certain load program.

use fem::{FemError, LoadProgram, ProgramPoint};

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
            // `check_kind` reports a program beside `test.kind`
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
            let most_mm = file.case.specimen.height_mm.map_or(1e3, |height_mm| 0.5 * height_mm);
            let help = "It is how far the top platen has moved down: at most half the height.";
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
    let program = program.as_ref();
    let refuse = |quantity: &Quantity, problem: &str, help: &str| {
        Err(file.error("qoi.quantities", quantity.to_string(), problem, help))
    };
    for quantity in &file.case.compared_quantities() {
        match quantity.extent() {
            Extent::Time(time_s) if time_s > test.duration_s() => {
                let problem = format!("lies beyond the end of the test, {} s", test.duration_s());
                return refuse(quantity, &problem, "Name a time that every run reaches.");
            }
            Extent::ForceHold if !program.is_some_and(has_force_hold) => {
                let help = "Add two points with the same force_n to test.program.";
                return refuse(quantity, "needs a hold of the force, and the test has none", help);
            }
            Extent::Hold if !program.is_some_and(has_hold) => {
                let help = "Add two points with the same displacement_mm to test.program.";
                return refuse(quantity, "needs a hold, and the test has none", help);
            }
            Extent::Unloading if !program.is_some_and(has_unloading) => {
                let help = "Add a point with a smaller displacement_mm to test.program.";
                return refuse(quantity, "needs an unloading, and the test has none", help);
            }
            _ => {}
        }
    }
    Ok(())
}

/// Start and end value of each segment whose two end points both state the value that `value` returns: a displacement
/// (mm) or a force (N). The program starts at zero.
fn changes(program: &LoadProgram, value: fn(&ProgramPoint) -> Option<f64>) -> Vec<[f64; 2]> {
    let ends: Vec<Option<f64>> = program.points().iter().map(value).collect();
    let starts = [Some(0.0)].into_iter().chain(ends.iter().copied());
    starts.zip(&ends).filter_map(|(from, to)| Some([from?, (*to)?])).collect()
}

fn has_hold(program: &LoadProgram) -> bool {
    let changes = changes(program, ProgramPoint::displacement_mm);
    changes.iter().any(|[from, to]| from == to && *from > 0.0)
}

fn has_force_hold(program: &LoadProgram) -> bool {
    let changes = changes(program, ProgramPoint::force_n);
    changes.iter().any(|[from, to]| from == to && *from > 0.0)
}

/// Whether the program unloads. Whether a segment that changes from displacement to force, or from force to displacement,
/// unloads is not known before the simulation; such a segment counts as unloading.
fn has_unloading(program: &LoadProgram) -> bool {
    let falls = |value: fn(&ProgramPoint) -> Option<f64>| {
        changes(program, value).iter().any(|[from, to]| to < from)
    };
    let changes_control =
        |pair: &[ProgramPoint]| pair[0].force_n().is_some() != pair[1].force_n().is_some();
    falls(ProgramPoint::displacement_mm)
        || falls(ProgramPoint::force_n)
        || program.points().windows(2).any(changes_control)
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
        for (test, list, part) in [
            ("displacement_mm = 0.1", "\"relaxed-fraction\"", "needs a hold"),
            (&program, "\"unloading-slope\"", "needs an unloading"),
            (&program, "\"hysteresis-energy\"", "needs an unloading"),
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
    }
}
