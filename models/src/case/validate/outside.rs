//! Checks of a case whose runs come from outside this program: `[simulator]`, `[parameters]` and imported tables.

use std::path::Path;

use super::super::{CaseFile, MachineCase, Mistakes, Parameter, PriorCase, Template};
use crate::error::{InputError, absence};
use crate::qoi::Quantity;

/// Names of columns in tables of this program, which a parameter or a quantity cannot have.
const RESERVED: [&str; 13] = [
    "batch",
    "chain",
    "draw",
    "group",
    "id",
    "image",
    "input",
    "packing_seed",
    "reason",
    "run",
    "seconds",
    "slope_fraction",
    "stiffness_ratio",
];

/// Checks the source of the runs, and the names of parameters and quantities that only this source knows.
pub(super) fn check_outside(file: &CaseFile, mistakes: &mut Mistakes) {
    check_free_parameters(file, mistakes);
    mistakes.note(check_columns(file));
    mistakes.note(check_values(file));
    if file.case.is_built_in() {
        return;
    }
    check_alone(file, mistakes);
    check_machine_outside(file, mistakes);
    if let Some(import) = &file.case.design.import {
        mistakes.note(check_file(file, "design.import", import));
    }
    if file.case.simulator.is_some() {
        check_simulator(file, mistakes);
    }
}

/// Refuses tables and keys that describe the built-in simulation.
fn check_alone(file: &CaseFile, mistakes: &mut Mistakes) {
    let case = &file.case;
    let source = if case.simulator.is_some() { "[simulator]" } else { "design.import" };
    let is_import = case.design.import.is_some();
    let of_simulation = [
        ("specimen", !case.specimen.is_absent()),
        ("material", !case.material.is_empty()),
        ("phase_field", case.phase_field.is_some()),
        ("test", !case.test.is_absent()),
        ("conditions", case.conditions.is_some()),
        ("fidelity", !case.fidelity.levels.is_empty()),
        ("design.derivatives", case.design.derivatives),
        ("confirm.second_spacing_mm", case.confirm.second_spacing_mm.is_some()),
    ];
    for (key, _) in of_simulation.into_iter().filter(|(_, is_given)| *is_given) {
        let problem = format!("is of the built-in simulation and cannot be combined with {source}");
        let help =
            "Keep one of the two. Write constants that the simulator needs into its input file.";
        mistakes.note(Err(file.error(key, "", problem, help)));
    }
    let of_new_runs = [
        ("simulator", is_import && case.simulator.is_some()),
        ("sequential", is_import && case.sequential.is_some()),
        ("extend", is_import && !case.extend.is_empty()),
    ];
    for (key, _) in of_new_runs.into_iter().filter(|(_, is_given)| *is_given) {
        let problem =
            "makes new runs and cannot be combined with design.import, which has finished runs";
        let help = "Keep one of the two.";
        mistakes.note(Err(file.error(key, "", problem, help)));
    }
    if case.prior.is_none() {
        let help = "Declare the calibrated parameters: [parameters] k1 = { unit = \"MPa\", prior = [1.0, 2.0] }.";
        mistakes.note(Err(file.error("parameters", "", "is missing", help)));
    }
}

/// Refuses `[machine]` if the case has no measured curves to correct, and calibrated properties of the machine if a
/// program makes the runs.
fn check_machine_outside(file: &CaseFile, mistakes: &mut Mistakes) {
    let case = &file.case;
    let has_values = case.experiments.as_ref().is_some_and(|e| e.values.is_some());
    if has_values && case.machine != MachineCase::default() {
        let problem = "corrects measured curves, but experiments.values has quantities";
        let help = "Correct the quantities in the table, and remove [machine].";
        mistakes.note(Err(file.error("machine", "", problem, help)));
    }
    // an imported table of runs of the built-in simulation may have a column of a property of the machine
    let of_runs = case.prior.iter().filter(|_| case.simulator.is_some());
    for (parameter, _) in of_runs.flat_map(PriorCase::iter) {
        if MachineCase::is_path(&parameter.to_string()) {
            let problem = "is calibrated by built-in simulations only, and cannot be combined with [simulator]";
            let help = "Write the property as a number in [machine], by which the measured curves are corrected, or \
                        calibrate it as a parameter of the program, in [parameters].";
            mistakes.note(Err(file.error(&format!("prior.{parameter}"), "", problem, help)));
        }
    }
}

fn check_free_parameters(file: &CaseFile, mistakes: &mut Mistakes) {
    let columns: Vec<String> =
        file.case.compared_quantities().iter().map(|q| q.column().into_owned()).collect();
    for (name, parameter) in &file.case.parameters {
        let key = format!("parameters.{name}");
        let refuse = |problem: &str, help: &str| Err(file.error(&key, "", problem, help));
        let mut letters = name.chars();
        let is_name = letters.next().is_some_and(|c| c.is_ascii_alphabetic())
            && letters.all(|c| c.is_ascii_alphanumeric() || c == '_');
        mistakes.note(if !is_name {
            refuse(
                "is not the name of a parameter",
                "Use letters, digits and _, and a letter first: {k1} is its placeholder.",
            )
        } else if RESERVED.contains(&name.as_str()) || columns.contains(name) {
            refuse("is the name of another column of the tables", "Choose another name.")
        } else if parameter.unit.trim().is_empty() {
            let help = "Write unit = \"1\" for a parameter without a unit.";
            Err(file.error(&format!("{key}.unit"), "\"\"", "is empty", help))
        } else if file.case.is_built_in() {
            refuse(
                "is not a parameter of the built-in simulation",
                "Add [simulator] or design.import, or name a number of the case in [prior].",
            )
        } else {
            Ok(())
        });
    }
}

/// Checks that quantities without a curve have a table from which they are read.
fn check_columns(file: &CaseFile) -> Result<(), InputError> {
    let (case, key) = (&file.case, "qoi.quantities");
    let compared = case.compared_quantities();
    let Some(quantity) = compared.iter().find(|quantity| !quantity.is_of_curve()) else {
        return Ok(());
    };
    let refuse = |quantity: &Quantity, problem: &str, help: &str| {
        Err(file.error(key, quantity.to_string(), problem, help))
    };
    if let Some(taken) = compared.iter().find(|q| RESERVED.contains(&&*q.column())) {
        return refuse(taken, "is the name of another column", "Choose another name.");
    }
    let columns = || compared.iter().map(|quantity| quantity.column());
    if let Some((i, _)) =
        columns().enumerate().find(|(i, name)| columns().take(*i).any(|c| c == *name))
    {
        return refuse(&compared[i], "is a column that is named twice", "Name each once.");
    }
    if case.is_built_in() {
        let help =
            "Add [simulator] or design.import, or name a quantity of curves: slope, peak-force.";
        return refuse(
            quantity,
            "is not computed from the curves of the built-in simulation",
            help,
        );
    }
    match case.experiments.as_ref().and_then(|e| e.table.as_ref()) {
        Some(_) => {
            let help =
                "Give the measured quantities in a table: experiments.values = \"measured.csv\".";
            refuse(quantity, "is not computed from the measured curves of experiments.table", help)
        }
        None => Ok(()),
    }
}

/// Checks the table of measured quantities.
fn check_values(file: &CaseFile) -> Result<(), InputError> {
    let (key, case) = ("experiments.values", &file.case);
    let Some(values) = case.experiments.as_ref().and_then(|e| e.values.as_ref()) else {
        return Ok(());
    };
    if case.is_built_in() {
        let problem = "needs runs from outside: [simulator] or design.import";
        let help = "Give the measured curves as experiments.table.";
        return Err(file.error(key, values.display().to_string(), problem, help));
    }
    check_file(file, key, values)
}

fn check_file(file: &CaseFile, key: &str, path: &Path) -> Result<(), InputError> {
    let absolute = file.beside(path);
    if absolute.is_file() {
        return Ok(());
    }
    let help = format!("The program looks for it at {}.", absolute.display());
    Err(file.error(key, path.display().to_string(), absence(&absolute), help))
}

fn check_simulator(file: &CaseFile, mistakes: &mut Mistakes) {
    let Some(simulator) = &file.case.simulator else { return };
    if let Some(limit) = simulator.time_limit_s {
        let help = "It is the time for one run: 600.0 for ten minutes.";
        mistakes.note(file.within("simulator.time_limit_s", limit, 1e-2, 1e9, "s", help));
    }
    let help = "1 tries a failed run once more.";
    let retries = f64::from(simulator.retries);
    mistakes.note(file.within("simulator.retries", retries, 0.0, 100.0, "", help));
    mistakes.note(check_program(file, &simulator.command));
    if simulator.input.is_none() && simulator.command.iter().any(|word| word.contains("{input}")) {
        let help = "Name the template of the input file: input = \"deck.inp\".";
        mistakes.note(Err(file.error("simulator.input", "", "is missing", help)));
    }
    let mut names = vec![simulator.result.clone()];
    for (key, source) in simulator
        .input
        .iter()
        .map(|source| ("simulator.input", source))
        .chain(simulator.files.iter().map(|source| ("simulator.files", source)))
    {
        let name = source.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let is_taken = names.contains(&name);
        mistakes.note(match check_file(file, key, source) {
            Ok(()) if is_taken => Err(file.error(
                key,
                source.display().to_string(),
                "has the name of another file of the run",
                "All files of a run lie in one folder: give each another name.",
            )),
            checked => checked,
        });
        names.push(name);
    }
    if Path::new(&simulator.result).file_name().is_none_or(|name| *name != *simulator.result) {
        let help = "Write the name of a file without a folder: result = \"result.csv\".";
        let (key, value) = ("simulator.result", simulator.result.clone());
        mistakes.note(Err(file.error(key, value, "is not the name of a file", help)));
    }
    mistakes.note(check_placeholders(file));
}

fn check_program(file: &CaseFile, command: &[String]) -> Result<(), InputError> {
    let key = "simulator.command";
    let Some(program) = command.first().filter(|program| !program.trim().is_empty()) else {
        let help = "Write the program and its arguments: command = [\"solver\", \"{input}\"].";
        return Err(file.error(key, "", "names no program", help));
    };
    // a program without a folder is sought in PATH by the machine that makes the runs
    if Path::new(program).components().count() < 2 {
        return Ok(());
    }
    check_file(file, key, Path::new(program))?;
    if is_executable(&file.beside(Path::new(program))) {
        return Ok(());
    }
    let help =
        format!("Write chmod +x {program}, or its interpreter first: [\"sh\", {program:?}].");
    Err(file.error(key, program, "is not executable", help))
}

/// Whether the permissions of a file allow anybody to execute it.
#[cfg(unix)]
fn is_executable(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    path.metadata().is_ok_and(|data| data.permissions().mode() & 0o111 != 0)
}

/// Whether the permissions of a file allow anybody to execute it; this system has no such permission.
#[cfg(not(unix))]
fn is_executable(_: &Path) -> bool {
    true
}

/// Checks that each placeholder names a parameter, and that each parameter has a placeholder.
fn check_placeholders(file: &CaseFile) -> Result<(), InputError> {
    let (Some(simulator), Some(prior)) = (&file.case.simulator, file.case.whole_prior()) else {
        return Ok(());
    };
    let parameters: Vec<String> = prior.names().collect();
    let allowed = || parameters.iter().map(String::as_str).chain(["run"]);
    let words: Vec<Template> = simulator.command.iter().map(|word| Template::parse(word)).collect();
    let in_command: Vec<&str> = allowed().chain(["input"]).collect();
    for (word, written) in words.iter().zip(&simulator.command) {
        word.check(&in_command).map_err(|bad| {
            let help = format!("Placeholders are: {}.", in_command.join(", "));
            file.error(
                "simulator.command",
                written,
                format!("{} {}", bad.written, bad.problem),
                help,
            )
        })?;
    }
    let mut templates = words;
    if let Some(input) = &simulator.input {
        let path = file.beside(input);
        // `check_file` reports a missing file
        if !path.is_file() {
            return Ok(());
        }
        let text = fem::read_regular_text(&path).map_err(|e| {
            InputError::unreadable(&path, &e, "The template of the input file is text, UTF-8.")
        })?;
        let template = Template::parse(&text);
        let in_input: Vec<&str> = allowed().collect();
        template.check(&in_input).map_err(|bad| {
            let location = format!("line {}", bad.line);
            let help = format!(
                "Placeholders are: {}; formats are :e, :.6e and :.4f. Doubled braces, as in {{{{name}}}}, write \
                 the name in braces.",
                in_input.join(", ")
            );
            InputError::new(&path, location, bad.written, bad.problem, help)
        })?;
        templates.push(template);
    }
    let is_used =
        |name: &str| templates.iter().any(|t| t.names().any(|placeholder| placeholder == name));
    // `check_machine_outside` refuses properties of the machine
    let is_of_program = |parameter: &&Parameter| !MachineCase::is_path(&parameter.to_string());
    match prior
        .parameters()
        .filter(is_of_program)
        .find(|parameter| !is_used(&parameter.to_string()))
    {
        Some(unused) => {
            let problem = "has no placeholder, so that no run depends on it";
            let help = format!("Write {{{unused}}} in simulator.input or in simulator.command.");
            let key = match unused.is_free() {
                true => format!("parameters.{unused}"),
                false => format!("prior.{unused}"),
            };
            Err(file.error(&key, "", problem, help))
        }
        None => Ok(()),
    }
}
