//! Checks of `test.kind`.

use fem::Platens;

use super::super::test_kind::{TestKindCase, WrongKey};
use super::super::{CaseFile, ConditionsCase, Mistakes};
use super::conditions::{OF_BLOCK, OF_CYLINDER};

/// Checks the keys of a kind of test, and refuses keys that the kind replaces.
pub(super) fn check_kind(file: &CaseFile, kind: TestKindCase, mistakes: &mut Mistakes) {
    let (case, kind) = (&file.case, kind.kind());
    let name = kind.name();
    let problem = format!("cannot be combined with test.kind = {name}");
    let is_written = case.conditions.as_ref().is_some_and(ConditionsCase::is_written);
    let refused = [
        (is_written, "conditions", "The kind has its own conditions: remove one of the two."),
        (
            case.test.program.is_some(),
            "test.program",
            "Give displacement_mm and duration_s, or write the test as [conditions] with a table of times.",
        ),
        (
            case.test.platens != Platens::Sliding,
            "test.platens",
            "This kind of test has no platens: remove the key.",
        ),
    ];
    if let Some((_, key, help)) = refused.into_iter().find(|(is_given, ..)| *is_given) {
        mistakes.note(Err(file.error(key, "", problem, help)));
        return;
    }
    let key = "test.displacement_mm";
    match case.test.displacement_mm {
        None => {
            let problem = format!("is missing: test.kind = {name} needs it");
            let help = "It is the displacement at the end of the test.";
            mistakes.note(Err(file.error(key, "", problem, help)));
        }
        Some(value) => {
            let help = "It is the displacement at the end of the test.";
            mistakes.note(file.within(key, value, 1e-9, 1e3, "mm", help));
        }
    }
    let specimen = &case.specimen;
    let has = |surface: &str| match (&specimen.mesh, specimen.block_mm) {
        (Some(_), _) => specimen.surfaces.contains_key(surface),
        (None, Some(_)) => OF_BLOCK.contains(&surface),
        (None, None) => OF_CYLINDER.contains(&surface),
    };
    if let Some(surface) = kind.surfaces().iter().find(|surface| !has(surface)) {
        let problem = format!("needs the surface {surface:?}, which the specimen does not have");
        let help = match specimen.mesh {
            Some(_) => {
                format!("Name the physical surface: specimen.surfaces = {{ {surface} = 11 }}.")
            }
            None => "Give radius_mm and height_mm of a cylinder in place of block_mm.".to_owned(),
        };
        mistakes.note(Err(file.error("test.kind", name, problem, help)));
    } else if let Err(WrongKey { key, value, problem, help }) = kind.check(&case.test_setting()) {
        mistakes.note(Err(file.error(&key, value, problem, help)));
    } else if let Some(conditions) = &case.conditions {
        mistakes.note(file.check_confined_toe(conditions));
    }
}
