//! Checks of `[[validation]]`.

use super::super::several_tests::check_folder_name;
use super::super::validation::{has_surrogate_for, validation_case};
use super::super::{CaseFile, ExperimentsCase, Mistakes, ValidationCase};
use crate::error::InputError;

/// Smallest and largest number of posterior draws of a validation.
const DRAWS: [usize; 2] = [4, 10_000];

/// Checks each validation as a separate case, and checks its specimens.
pub(super) fn check_validation(file: &CaseFile, mistakes: &mut Mistakes) {
    let case = &file.case;
    if case.validation.is_empty() {
        return;
    }
    for (table, is_missing) in
        [("prior", case.prior.is_none()), ("experiments", case.experiments.is_none())]
    {
        if is_missing {
            let help = format!("Add [{table}], or leave [[validation]] out.");
            let problem = "is missing: [[validation]] needs a calibration";
            return mistakes.note(Err(file.error(table, "", problem, help)));
        }
    }
    let mut names: Vec<&str> = Vec::new();
    for (place, entry) in case.validation.iter().enumerate() {
        if let Some(test) = &entry.test {
            let key = format!("validation ({}).test", entry.name);
            let problem = "names a test of [[tests]], and the case has one test";
            mistakes.note(Err(file.error(&key, format!("{test:?}"), problem, "Remove it.")));
        }
        let named = check_folder_name(&entry.name).and_then(|()| {
            match names.contains(&entry.name.as_str()) {
                true => Err((
                    "is the name of two validations",
                    "Give each validation a name of its own.",
                )),
                false => Ok(()),
            }
        });
        let named = named.map_err(|(problem, help)| {
            let key = format!("validation[{place}].name");
            file.error(&key, format!("{:?}", entry.name), problem, help)
        });
        mistakes.note(named);
        names.push(&entry.name);
        let key = format!("validation ({}).draws", entry.name);
        let [least, most] = DRAWS.map(|n| n as f64);
        let help = "Each draw is one simulation; 24 are usual.";
        mistakes.note(file.within(&key, entry.draws as f64, least, most, "draws", help));
        match validation_case(file, entry, place) {
            Ok(own) => check_entry(file, entry, &own, mistakes),
            Err(own) => own.into_iter().for_each(|mistake| mistakes.note(Err(mistake))),
        }
    }
}

/// Checks the specimens, the source of the runs and the scatter of one validation, whose case is `own`.
fn check_entry(file: &CaseFile, entry: &ValidationCase, own: &CaseFile, mistakes: &mut Mistakes) {
    let place = |rest: &str| format!("validation ({}).{rest}", entry.name);
    if let (Some(import), false) = (&own.case.design.import, has_surrogate_for(file, entry)) {
        let help = "Give [simulator], which can make these runs, or validate with specimens of the calibrated test.";
        let problem = "has finished runs only, and a validation needs runs at posterior draws";
        let key = place("design.import");
        mistakes.note(Err(file.error(&key, import.display().to_string(), problem, help)));
    }
    for (quantity, &percent) in &entry.scatter_percent {
        let key = place(&format!("scatter_percent.{quantity}"));
        let help = "It is the standard deviation between specimens in %: 5.0 for 5 %.";
        mistakes.note(file.within(&key, percent, 1e-3, 200.0, "%", help));
        if !own.case.compared_quantities().contains(quantity) {
            let help = "Name quantities of this validation: set.qoi.quantities, or those of [qoi].";
            let problem = "is not compared";
            mistakes.note(Err(file.error(&key, percent.to_string(), problem, help)));
        }
    }
    if own.case.experiments.is_none() {
        let help = "Leave it out of `without`, and name held-out specimens: set.experiments.table = \"held-out.csv\".";
        let problem = "removes the specimens, and a validation compares its prediction with held-out specimens";
        mistakes.note(Err(file.error(&place("without"), "experiments", problem, help)));
    }
    if let [Some(calibrated), Some(held_out)] =
        [&file.case.experiments, &own.case.experiments].map(Option::as_ref)
    {
        mistakes.note(check_held_out(file, &place("set.experiments"), calibrated, held_out));
    }
}

/// Refuses specimens that the calibration uses, if the keys of the case show the use. The curves are compared later, when
/// the files are read.
fn check_held_out(
    file: &CaseFile,
    key: &str,
    calibrated: &ExperimentsCase,
    held_out: &ExperimentsCase,
) -> Result<(), InputError> {
    let problem = "names the specimens of the calibration";
    let selection = |own: &ExperimentsCase| {
        let files = (own.table.clone(), own.values.clone());
        (files, own.group.clone(), own.test.clone())
    };
    let seed = |own: &ExperimentsCase| own.virtual_specimens.as_ref().map(|own| own.seed);
    match (seed(calibrated), seed(held_out)) {
        (Some(a), Some(b)) if a == b => {
            let help = "Leave experiments.virtual.seed out, or choose another one.";
            Err(file.error(&format!("{key}.virtual.seed"), b.to_string(), problem, help))
        }
        (None, None) if selection(calibrated) == selection(held_out) => {
            let help = "Name held-out specimens: set.experiments.table = \"held-out.csv\", or another \
                        set.experiments.group of the same table.";
            Err(file.error(key, "", problem, help))
        }
        _ => Ok(()),
    }
}
