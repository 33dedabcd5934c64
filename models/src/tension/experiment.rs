//! Tension tests of metals, from engineering readings to true stress over plastic strain.

use std::path::Path;

use crate::error::InputError;
use crate::table::CsvTable;

/// 1 ksi in MPa.
const MPA_PER_KSI: f64 = 6.894_757_293_168;
/// Plastic strain at which a metal is said to flow: hardening begins here.
const OFFSET_STRAIN: f64 = 0.002;
/// Fewest points that a hardening curve is calibrated on.
const LEAST_POINTS: usize = 8;

/// One point of a hardening curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HardeningPoint {
    /// ε_p = ln(1 + e) − σ/E.
    pub plastic_strain: f64,
    /// Cauchy stress σ = S (1 + e) in MPa.
    pub true_stress_mpa: f64,
}

/// A test in tension, from 0.2 % of plastic strain to the largest load.
///
/// There the specimen begins to neck (Considère: dσ/dε = σ), and a single strain no longer describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct TensionTest {
    /// Name of the specimen.
    pub specimen: String,
    /// True strain at the largest load.
    pub uniform_strain: f64,
    /// The curve between.
    pub points: Vec<HardeningPoint>,
}

impl TensionTest {
    /// From readings (engineering strain, engineering stress in MPa) and Young's modulus in MPa.
    pub fn of_readings(specimen: &str, readings: &[(f64, f64)], young_mpa: f64) -> Self {
        let highest = |a: &usize, b: &usize| readings[*a].1.total_cmp(&readings[*b].1);
        let last = (0..readings.len()).max_by(highest);
        let before = &readings[..last.map_or(0, |last| last + 1)];
        let of = |&(strain, stress_mpa): &(f64, f64)| {
            let true_stress_mpa = stress_mpa * (1.0 + strain);
            let plastic_strain = strain.ln_1p() - true_stress_mpa / young_mpa;
            HardeningPoint { plastic_strain, true_stress_mpa }
        };
        let yielded = |point: &HardeningPoint| point.plastic_strain >= OFFSET_STRAIN;
        Self {
            specimen: specimen.to_owned(),
            uniform_strain: before.last().map_or(0.0, |reading| reading.0.ln_1p()),
            points: before.iter().map(of).filter(yielded).collect(),
        }
    }
}

/// Reads `specimen,engineering_strain,engineering_stress_ksi`, one line a reading, specimens in the order of
/// their first line; `young_mpa` is Young's modulus.
///
/// # Errors
/// [`InputError`] with line, column and value; a specimen with too few points between yield and the
/// largest load.
pub fn read_tension_tests(file: &Path, young_mpa: f64) -> Result<Vec<TensionTest>, InputError> {
    let (strain, stress) = ("engineering_strain", "engineering_stress_ksi");
    let table = CsvTable::read(file, &["specimen", strain, stress])?;
    let mut readings: Vec<(&str, Vec<(f64, f64)>)> = Vec::new();
    for row in table.rows() {
        let reading = (row.number(strain)?, MPA_PER_KSI * row.number(stress)?);
        if !(-0.1..5.0).contains(&reading.0) {
            let help = "Engineering strain is elongation over gauge length: 0.6, not 60 %.";
            return Err(row.error(strain, "must lie between -0.1 and 5", help));
        }
        let name = row.text("specimen");
        match readings.iter_mut().find(|(known, _)| *known == name) {
            Some((_, readings)) => readings.push(reading),
            None => readings.push((name, vec![reading])),
        }
    }
    let tests: Vec<TensionTest> =
        readings.iter().map(|(name, all)| TensionTest::of_readings(name, all, young_mpa)).collect();
    if let Some(test) = tests.iter().find(|test| test.points.len() < LEAST_POINTS) {
        let problem = format!(
            "has {} points between {OFFSET_STRAIN} of plastic strain and its largest load, of {LEAST_POINTS}",
            test.points.len()
        );
        let help = "Give the whole curve, in the order in which it was measured, in ksi.";
        return Err(InputError::new(
            file,
            format!("specimen {}", test.specimen),
            "",
            problem,
            help,
        ));
    }
    match tests.len() {
        0 => Err(InputError::new(file, "", "", "has no readings", "Write a line for each.")),
        _ => Ok(tests),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hollomon's σ = K ε^n under constant volume: S = K ln(1+e)^n/(1+e), whose largest load is at ε = n.
    #[test]
    fn readings_give_back_the_law_up_to_its_necking_strain() {
        let (strength, exponent, young) = (1000.0, 0.3, 200_000.0);
        let stress = |strain: f64| strength * strain.ln_1p().powf(exponent) / (1.0 + strain);
        let readings: Vec<(f64, f64)> =
            (1..800).map(|i| 1e-3 * f64::from(i)).map(|e| (e, stress(e))).collect();
        let test = TensionTest::of_readings("A", &readings, young);
        assert!((test.uniform_strain - exponent).abs() < 1e-3, "{}", test.uniform_strain);
        assert!(test.points.len() > 300 && test.points[0].plastic_strain >= OFFSET_STRAIN);
        for point in &test.points {
            let total = point.plastic_strain + point.true_stress_mpa / young;
            let expected = strength * total.powf(exponent);
            approx::assert_relative_eq!(point.true_stress_mpa, expected, max_relative = 1e-12);
        }
    }

    /// The first specimen's largest load is 84.0228 ksi at 0.610127 (lines of the file).
    #[test]
    fn the_eight_specimens_are_read() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/matcal_304L_tension.csv");
        let tests = read_tension_tests(&file, 200_000.0).unwrap();
        let names: Vec<&str> = tests.iter().map(|test| test.specimen.as_str()).collect();
        assert_eq!((names.len(), names[0], names[7]), (8, "R1S1-Large", "R4S2-Large"));
        let last = tests[0].points.last().unwrap();
        // 84.0228 ksi = 579.317 MPa by hand
        approx::assert_relative_eq!(last.true_stress_mpa, 579.317 * 1.610127, max_relative = 1e-5);
        approx::assert_relative_eq!(tests[0].uniform_strain, 1.610127f64.ln(), max_relative = 1e-9);
        for test in &tests {
            let inside = |point: &HardeningPoint| {
                (OFFSET_STRAIN..test.uniform_strain).contains(&point.plastic_strain)
            };
            assert!(test.points.iter().all(inside), "{}", test.specimen);
        }
    }

    #[test]
    fn mistakes_in_a_file_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("tension.csv");
        let message = |text: &str| {
            std::fs::write(&file, text).unwrap();
            read_tension_tests(&file, 200_000.0).unwrap_err().to_string()
        };
        let header = "specimen,engineering_strain,engineering_stress_ksi\n";
        for (text, expected) in [
            (
                "specimen,engineering_strain,engineering_stress\n".to_owned(),
                "engineering_stress_ksi",
            ),
            (format!("{header}A,0.01,x\n"), "line 2, column engineering_stress_ksi = x"),
            (format!("{header}A,60,80\n"), "line 2, column engineering_strain = 60"),
            (format!("{header}A,0.1,60\nA,0.2,70\n"), "specimen A: has 2 points"),
            (header.to_owned(), "has no readings"),
        ] {
            let found = message(&text);
            assert!(found.contains(expected) && found.contains("tension.csv"), "{found}");
        }
    }
}
