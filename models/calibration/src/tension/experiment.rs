//! Tension tests of metals: conversion of engineering readings to true stress as a function of plastic strain.

use std::path::Path;

use crate::error::InputError;
use crate::table::CsvTable;

/// 1 ksi in MPa.
pub(crate) const MPA_PER_KSI: f64 = 6.894_757_293_168;
/// Plastic strain that defines the yield point; hardening curves begin here.
const OFFSET_STRAIN: f64 = 0.002;
/// Least number of points of a hardening curve.
const LEAST_POINTS: usize = 8;

/// One point of a hardening curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HardeningPoint {
    /// Plastic strain ε_p = ln(1 + e) − σ/E, where e is the engineering strain.
    pub plastic_strain: f64,
    /// Cauchy stress σ = S (1 + e) in MPa, where S is the engineering stress.
    pub true_stress_mpa: f64,
}

/// Treatment of readings that were taken while the specimen was temporarily unloaded. Such readings do not show the
/// flow stress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unloading {
    /// The readings are kept as points of the curve.
    Kept,
    /// Readings are omitted if their engineering stress is below the largest preceding engineering stress by more than
    /// this fraction. Smaller decreases before the largest load are noise.
    LeftOut(f64),
}

impl Default for Unloading {
    fn default() -> Self {
        Self::LeftOut(0.01)
    }
}

/// A test in tension, from 0.2 % of plastic strain to the largest load.
///
/// At the largest load the specimen begins to neck (Considère's criterion dσ/dε = σ). In the neck the strain is not
/// uniform, so that later readings are omitted.
#[derive(Clone, Debug, PartialEq)]
pub struct TensionTest {
    /// Name of the specimen.
    pub specimen: String,
    /// True strain at the largest load.
    pub uniform_strain: f64,
    /// Hardening curve from 0.2 % of plastic strain to the largest load.
    pub points: Vec<HardeningPoint>,
    /// Points that were omitted from the curve because the specimen was unloaded.
    pub unloading: Vec<HardeningPoint>,
}

impl TensionTest {
    /// Converts readings (engineering strain, engineering stress in MPa). `young_mpa` is Young's modulus in MPa.
    pub fn of_readings(
        specimen: &str,
        readings: &[(f64, f64)],
        young_mpa: f64,
        unloading: Unloading,
    ) -> Self {
        let highest = |a: &usize, b: &usize| readings[*a].1.total_cmp(&readings[*b].1);
        let last = (0..readings.len()).max_by(highest);
        let before = &readings[..last.map_or(0, |last| last + 1)];
        let mut test = Self {
            specimen: specimen.to_owned(),
            uniform_strain: before.last().map_or(0.0, |reading| reading.0.ln_1p()),
            points: Vec::new(),
            unloading: Vec::new(),
        };
        let mut largest = f64::NEG_INFINITY;
        for &(strain, stress_mpa) in before {
            largest = largest.max(stress_mpa);
            let true_stress_mpa = stress_mpa * (1.0 + strain);
            let plastic_strain = strain.ln_1p() - true_stress_mpa / young_mpa;
            if plastic_strain < OFFSET_STRAIN {
                continue;
            }
            let flows = match unloading {
                Unloading::Kept => true,
                Unloading::LeftOut(part) => stress_mpa >= (1.0 - part) * largest,
            };
            let curve = if flows { &mut test.points } else { &mut test.unloading };
            curve.push(HardeningPoint { plastic_strain, true_stress_mpa });
        }
        test
    }
}

/// Name of a specimen, and its readings: engineering strain, engineering stress in MPa.
pub(crate) type NamedCurve = (String, Vec<(f64, f64)>);

/// Reads the readings (engineering strain, engineering stress in MPa) of each specimen from a table with the columns
/// `specimen,engineering_strain,engineering_stress_ksi`. The specimens are in the order of their first lines.
///
/// # Errors
/// If a value is missing or wrong. The error names line, column and value.
pub(crate) fn read_engineering_curves(file: &Path) -> Result<Vec<NamedCurve>, InputError> {
    let (strain, stress) = ("engineering_strain", "engineering_stress_ksi");
    let table = CsvTable::read(file, &["specimen", strain, stress])?;
    let mut curves: Vec<NamedCurve> = Vec::new();
    for row in table.rows() {
        let reading = (row.number(strain)?, MPA_PER_KSI * row.number(stress)?);
        if !(-0.1..5.0).contains(&reading.0) {
            let help = "Engineering strain is elongation over gauge length: 0.6, not 60 %.";
            return Err(row.error(strain, "must lie between -0.1 and 5", help));
        }
        let name = row.text("specimen");
        match curves.iter_mut().find(|(specimen, _)| specimen == name) {
            Some((_, readings)) => readings.push(reading),
            None => curves.push((name.to_owned(), vec![reading])),
        }
    }
    Ok(curves)
}

/// Reads a table with the columns `specimen,engineering_strain,engineering_stress_ksi`, one line per reading. The
/// specimens are in the order of their first lines. `young_mpa` is Young's modulus in MPa. [`TensionTest::unloading`]
/// contains the readings that were omitted.
///
/// # Errors
/// If a value is missing or wrong, or a specimen has too few points between yield and the largest load. The error names
/// line, column and value, or the specimen.
pub fn read_tension_tests(
    file: &Path,
    young_mpa: f64,
    unloading: Unloading,
) -> Result<Vec<TensionTest>, InputError> {
    let readings = read_engineering_curves(file)?;
    let test_of = |(name, all): &(String, Vec<(f64, f64)>)| {
        TensionTest::of_readings(name, all, young_mpa, unloading)
    };
    let tests: Vec<TensionTest> = readings.iter().map(test_of).collect();
    if let Some(test) = tests.iter().find(|test| test.points.len() < LEAST_POINTS) {
        let problem = format!(
            "has {} points between a plastic strain of {OFFSET_STRAIN} and its largest load, but at least {LEAST_POINTS} are needed",
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
        0 => Err(InputError::new(
            file,
            "",
            "",
            "has no readings",
            "Write one line for each reading.",
        )),
        _ => Ok(tests),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Engineering readings of Hollomon's law σ = K ε^n at constant volume: S = K ln(1+e)^n/(1+e), with the largest
    /// load at ε = n.
    #[test]
    fn readings_give_back_the_law_up_to_its_necking_strain() {
        let (strength, exponent, young) = (1000.0, 0.3, 200_000.0);
        let stress = |strain: f64| strength * strain.ln_1p().powf(exponent) / (1.0 + strain);
        let readings: Vec<(f64, f64)> =
            (1..800).map(|i| 1e-3 * f64::from(i)).map(|e| (e, stress(e))).collect();
        let test = TensionTest::of_readings("A", &readings, young, Unloading::default());
        assert!((test.uniform_strain - exponent).abs() < 1e-3, "{}", test.uniform_strain);
        assert!(test.points.len() > 300 && test.unloading.is_empty());
        assert!(test.points[0].plastic_strain >= OFFSET_STRAIN);
        for point in &test.points {
            let total = point.plastic_strain + point.true_stress_mpa / young;
            let expected = strength * total.powf(exponent);
            approx::assert_relative_eq!(point.true_stress_mpa, expected, max_relative = 1e-12);
        }
    }

    /// A specimen is unloaded elastically by 150 MPa and loaded again. Without these readings, the curve equals the
    /// curve of a specimen that was never unloaded.
    #[test]
    fn readings_of_unloading_are_left_out_or_kept() {
        let young = 200_000.0;
        let stress = |strain: f64| 900.0 * strain.ln_1p().powf(0.3) / (1.0 + strain);
        let curve: Vec<(f64, f64)> =
            (1..400).map(|i| 1e-3 * f64::from(i)).map(|e| (e, stress(e))).collect();
        let (strain, at) = curve[149];
        let part = |drop: f64| (strain - drop / young, at - drop);
        let turn = [50.0, 150.0, 100.0, 40.0].map(part);
        let readings = [&curve[..150], &turn, &curve[150..]].concat();
        let converted = |readings: &[(f64, f64)], unloading| {
            TensionTest::of_readings("A", readings, young, unloading)
        };
        let (straight, with_unloading) =
            (converted(&curve, Unloading::Kept), converted(&readings, Unloading::Kept));
        assert_eq!(with_unloading.points.len(), straight.points.len() + 4);
        let left = converted(&readings, Unloading::default());
        assert_eq!(left.unloading.len(), 4);
        assert_eq!(TensionTest { unloading: Vec::new(), ..left }, straight);
    }

    /// The largest load of the first specimen is 84.0228 ksi at a strain of 0.610127, as read in the file.
    #[test]
    fn the_eight_specimens_are_read() {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/data/matcal_304L_tension.csv");
        let tests = read_tension_tests(&file, 200_000.0, Unloading::default()).unwrap();
        let names: Vec<&str> = tests.iter().map(|test| test.specimen.as_str()).collect();
        assert_eq!((names.len(), names[0], names[7]), (8, "R1S1-Large", "R4S2-Large"));
        let last = tests[0].points.last().unwrap();
        // 84.0228 ksi = 579.317 MPa by hand
        approx::assert_relative_eq!(last.true_stress_mpa, 579.317 * 1.610127, max_relative = 1e-5);
        approx::assert_relative_eq!(tests[0].uniform_strain, 1.610127f64.ln(), max_relative = 1e-9);
        // the first specimen was unloaded twice, and all other specimens were never unloaded
        let left_out: Vec<usize> = tests.iter().map(|test| test.unloading.len()).collect();
        assert_eq!(left_out, [12, 0, 0, 0, 0, 0, 0, 0]);
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
            read_tension_tests(&file, 200_000.0, Unloading::default()).unwrap_err().to_string()
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
            let error = message(&text);
            assert!(error.contains(expected) && error.contains("tension.csv"), "{error}");
        }
    }
}
