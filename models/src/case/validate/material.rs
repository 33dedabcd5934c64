//! Checks of the materials of the regions.

use fem::{ElasticLaw, FemError, Fracture, Unsupported};

use super::super::{
    CaseFile, HardeningCase, HardeningTable, MaterialCase, Mistakes, PlasticCase, Property,
};
use crate::error::InputError;

/// Checks the constants of a region.
pub(super) fn check_material(
    file: &CaseFile,
    region: &str,
    m: &MaterialCase,
    mistakes: &mut Mistakes,
) {
    let mut is_complete = true;
    for (property, value) in [(Property::Young, m.young_mpa), (Property::Poisson, m.poisson)] {
        let key = format!("material.{region}.{}", property.key());
        let mistake = match (value, m.law.has_constants()) {
            (None, false) => {
                let help = format!("Add it. {}", property.help());
                file.error(&key, "", "is missing", help)
            }
            (Some(value), true) => file.error(
                &key,
                value.to_string(),
                "is given, but the law has constants of its own",
                "Remove it: the constants of the law determine the stiffness.",
            ),
            _ => continue,
        };
        is_complete = false;
        mistakes.note(Err(mistake));
    }
    if m.viscoelastic.is_some() && m.plastic.is_some() {
        is_complete = false;
        mistakes.note(Err(file.error(
            &format!("material.{region}.plastic"),
            "",
            "cannot be combined with viscoelastic",
            "A region is viscoelastic or plastic: remove one of the two.",
        )));
    }
    if let Some(shift) = m.viscoelastic.as_ref().and_then(|series| series.shift) {
        mistakes.note(check_shift(file, region, &shift));
    }
    if is_complete {
        let checked = check_in_fem(file, region, m);
        mistakes.note(checked.map_err(|error| material_error(file, region, m, error)));
    }
    // `fem` does not check these constants of a region without a toughness
    if m.toughness_n_per_mm.is_none() {
        let checked = Fracture {
            toughness_n_per_mm: 1.0,
            viscosity_mpa_s: m.viscosity_mpa_s,
            residual_stiffness: m.residual_stiffness,
        };
        let checked = checked.validate(region);
        mistakes.note(checked.map_err(|error| material_error(file, region, m, error)));
    }
}

/// Checks that the time shift of a region has a temperature at which it is valid.
fn check_shift(file: &CaseFile, region: &str, shift: &fem::TimeShift) -> Result<(), InputError> {
    let Some(celsius) = file.case.test.temperature_celsius else {
        return Err(file.error(
            "test.temperature_celsius",
            "",
            format!("is missing, but material.{region}.viscoelastic.shift depends on it"),
            "Add the temperature of the test in °C, or leave the shift out.",
        ));
    };
    match shift.validate("test", celsius) {
        // the check of the material reports the reference temperature with its key
        Ok(()) | Err(FemError::OutOfRange { field: "reference_celsius", .. }) => Ok(()),
        Err(error) => {
            let key = format!("material.{region}.viscoelastic.shift");
            let help = "Check its constants and the temperature.";
            Err(file.error(&key, "", error.to_string(), help))
        }
    }
}

/// Checks a material of a region with the checks of `fem`.
pub(super) fn check_in_fem(
    file: &CaseFile,
    region: &str,
    material: &MaterialCase,
) -> Result<(), FemError> {
    material.in_fem()?.validate(region, file.case.phase_field.as_ref())
}

/// Returns an error of `fem` about a material with the key of the case.
fn material_error(
    file: &CaseFile,
    region: &str,
    material: &MaterialCase,
    error: FemError,
) -> InputError {
    match error {
        FemError::OutOfRange { entity, field, value, requirement }
            if entity.starts_with(&format!("material.{region}.")) =>
        {
            let (key, value) = key_and_value(material, &entity, field, value);
            let problem = format!("must be {requirement}");
            let is_strength = entity.ends_with(".strength");
            let page = if is_strength { "strength" } else { "memory" };
            let help = format!("See docs/how-to/{page}.md.");
            file.error(&key, value.to_string(), problem, help)
        }
        FemError::OutOfRange { field, value, requirement, .. } => {
            let property = Property::ALL.into_iter().find(|p| p.key() == field);
            let table = match property {
                Some(_) => String::new(),
                None => format!("law.ogden.terms{}.", index_of_term(&material.law)),
            };
            let help = property.map_or("Leave the term out.", Property::help);
            let key = format!("material.{region}.{table}{field}");
            file.error(&key, value.to_string(), format!("must be {requirement}"), help)
        }
        FemError::Unsupported { reason, .. } => {
            let key = match reason {
                Unsupported::StrengthWithoutToughness
                | Unsupported::StrengthOfInelasticLaw
                | Unsupported::StrengthOfField
                | Unsupported::StrengthLength { .. } => "strength",
                Unsupported::PlasticLaw => "plastic",
                Unsupported::ViscoelasticLaw => "viscoelastic",
                _ => "law",
            };
            let key = format!("material.{region}.{key}");
            file.error(&key, "", reason.to_string(), sentence(reason.help()))
        }
        other => {
            let key = format!("material.{region}");
            file.error(&key, "", other.to_string(), "Check its numbers.")
        }
    }
}

/// Key and value of a constant that `fem` refuses. `fem` names the table of a constant, but not the row of a list.
fn key_and_value(
    material: &MaterialCase,
    entity: &str,
    field: &'static str,
    value: f64,
) -> (String, f64) {
    if let (Some(series), Some((_, modulus))) = (
        &material.viscoelastic,
        entity.rsplit_once(".viscoelastic.").filter(|_| ["fraction", "time_s"].contains(&field)),
    ) {
        let terms = if modulus == "bulk" { &series.bulk } else { &series.shear };
        let number = |term: &fem::PronyTerm| match field {
            "fraction" => term.fraction,
            _ => term.time_s,
        };
        let index = terms.iter().position(|term| number(term).to_bits() == value.to_bits());
        // the sum of several fractions is the value of no term
        let index = index.map(|index| format!("[{index}]")).unwrap_or_default();
        return (format!("{entity}{index}.{field}"), value);
    }
    let rows = match material.plastic.as_ref().and_then(|plastic| plastic.hardening.as_ref()) {
        Some(HardeningCase::Table(HardeningTable::Rows(rows)))
            if entity.ends_with(".hardening") =>
        {
            rows
        }
        _ => return (format!("{entity}.{field}"), value),
    };
    let row = |index: usize, key: &str| format!("{entity}.table[{index}].{key}");
    match (field, PlasticCase::first_fall(rows)) {
        ("hardening_mpa", Some(index)) => (row(index, "yield_mpa"), rows[index].yield_mpa),
        ("plastic_strain", _) => {
            let index = rows.iter().position(|row| row.plastic_strain == value);
            (row(index.unwrap_or(0), field), value)
        }
        _ => (format!("{entity}.table"), value),
    }
}

/// Index of the first term of Ogden's law that has no energy, in brackets; empty for other laws.
fn index_of_term(law: &ElasticLaw) -> String {
    let ElasticLaw::Ogden(ogden) = law else { return String::new() };
    let index = ogden.terms.iter().position(|term| term.alpha == 0.0);
    index.map(|index| format!("[{index}]")).unwrap_or_default()
}

/// Turns a clause into a sentence: adds a capital first letter and a full stop.
fn sentence(clause: &str) -> String {
    let mut letters = clause.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    first.chain(letters).chain(['.']).collect()
}
