//! Fits of synthetic data, and errors of wrong tables.

use std::path::Path;

use super::*;

fn series(long_term_mpa: f64, terms: &[(f64, f64)]) -> PronySeries {
    let term = |&(modulus_mpa, time_s): &(f64, f64)| PronyTerm { modulus_mpa, time_s };
    PronySeries { long_term_mpa, terms: terms.iter().map(term).collect() }
}

/// Times or frequencies, equally spaced on a logarithmic axis.
fn spaced(low: f64, high: f64, count: u32) -> Vec<f64> {
    (0..count).map(|k| low * (high / low).powf(f64::from(k) / f64::from(count - 1))).collect()
}

fn relaxed(truth: &PronySeries, noise: impl Fn(usize) -> f64) -> MeasuredModuli {
    let times = spaced(1e-3, 1e3, 61).into_iter().enumerate();
    let row = |(k, t): (usize, f64)| [t, truth.relaxation_mpa(t) * (1.0 + noise(k))];
    MeasuredModuli::Relaxation(times.map(row).collect())
}

fn dynamic(truth: &PronySeries) -> MeasuredModuli {
    let row = |omega: f64| {
        let [storage, loss] = truth.complex_mpa(omega);
        [omega, storage, loss]
    };
    MeasuredModuli::Dynamic(spaced(1e-3, 1e3, 31).into_iter().map(row).collect())
}

/// Storage and loss modulus are the transform of the relaxation modulus: G′ + iG″ = iω ∫ G(t) e^(−iωt) dt. The integral
/// of the decaying part is computed numerically.
#[test]
fn storage_and_loss_are_the_transform_of_the_relaxation_modulus() {
    let truth = series(2.0, &[(3.0, 0.1), (1.0, 2.0)]);
    for omega in [0.3, 1.0, 7.0] {
        let (mut cosine, mut sine, step) = (0.0, 0.0, 1e-4);
        for k in 0..400_000 {
            let t = step * (f64::from(k) + 0.5);
            let decaying = truth.relaxation_mpa(t) - truth.long_term_mpa;
            cosine += decaying * (omega * t).cos() * step;
            sine += decaying * (omega * t).sin() * step;
        }
        let [storage, loss] = truth.complex_mpa(omega);
        assert!((storage - truth.long_term_mpa - omega * sine).abs() < 1e-6 * storage);
        assert!((loss - omega * cosine).abs() < 1e-6 * loss);
    }
}

#[test]
fn a_series_is_recovered_from_its_closed_forms() {
    for truth in [
        series(10.0, &[(5.0, 0.1)]),
        series(100.0, &[(60.0, 0.1), (40.0, 1.0)]),
        series(1.0, &[(4.0, 0.02), (7.0, 0.7), (2.0, 30.0)]),
    ] {
        for data in [relaxed(&truth, |_| 0.0), dynamic(&truth)] {
            let fit = PronyFit::new(&data);
            let found = &fit.series;
            assert_eq!(found.terms.len(), truth.terms.len(), "{fit:?}");
            let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-3;
            assert!(near(found.long_term_mpa, truth.long_term_mpa), "{found:?}");
            for (a, b) in found.terms.iter().zip(&truth.terms) {
                assert!(
                    near(a.modulus_mpa, b.modulus_mpa) && near(a.time_s, b.time_s),
                    "{a:?} {b:?}"
                );
            }
        }
    }
}

/// With noise of 1 % the criterion does not add terms for the noise, and the curve is closer to the truth than the data.
#[test]
fn noise_adds_no_terms() {
    let truth = series(100.0, &[(60.0, 0.1), (40.0, 10.0)]);
    // a fixed irregular sequence with the standard deviation 1 %
    let noise = |k: usize| 0.01 * 12f64.sqrt() * ((k as f64 * 0.754_877_666).fract() - 0.5);
    let fit = PronyFit::new(&relaxed(&truth, noise));
    assert_eq!(fit.series.terms.len(), 2, "{fit:?}");
    assert!((0.005..0.015).contains(&fit.relative_error), "{fit:?}");
    for t in spaced(1e-3, 1e3, 50) {
        let ratio = fit.series.relaxation_mpa(t) / truth.relaxation_mpa(t);
        assert!((ratio - 1.0).abs() < 0.01, "{ratio} at {t} s");
    }
}

/// A power law, which no finite series describes exactly, is fitted with an error below 1 % over
/// six decades.
#[test]
fn a_power_law_is_described_over_its_decades() {
    let times = spaced(1e-3, 1e3, 61).into_iter();
    let data = MeasuredModuli::Relaxation(times.map(|t| [t, 50.0 * t.powf(-0.2)]).collect());
    let fit = PronyFit::new(&data);
    assert!(fit.relative_error < 0.01 && fit.series.terms.len() > 3, "{fit:?}");
}

/// A modulus that increases with time, and storage and loss modulus in exchanged columns, have no series. A constant
/// modulus with noise has a series without terms.
#[test]
fn data_that_no_series_describes_are_refused_and_large_errors_are_reported() {
    let checked =
        |data: &MeasuredModuli| check_fit(&PronyFit::new(data), data, Path::new("data.csv"));
    let times = || spaced(1e-3, 1e3, 61).into_iter().enumerate();
    let noise = |k: usize| 0.02 * ((k as f64 * 0.754_877_666).fract() - 0.5);
    let of_time = |modulus: &dyn Fn(f64) -> f64| {
        let row = |(k, t): (usize, f64)| [t, modulus(t) * (1.0 + noise(k))];
        MeasuredModuli::Relaxation(times().map(row).collect())
    };
    let rising = of_time(&|t| 100.0 * t.powf(0.03));
    let refused = checked(&rising).expect_err("rising").to_string();
    for part in ["data.csv", "increases with time", "offset"] {
        assert!(refused.contains(part), "{refused}");
    }
    let constant = of_time(&|_| 100.0);
    let fit = PronyFit::new(&constant);
    assert!(fit.series.terms.is_empty(), "{fit:?}");
    assert_eq!(checked(&constant), Ok(None));
    let truth = series(2.0, &[(3.0, 0.1), (1.0, 2.0)]);
    assert_eq!(checked(&dynamic(&truth)), Ok(None));
    // a step of the modulus, as after a change of the temperature, is not a sum of decaying terms
    let step = of_time(&|t| if t < 1.0 { 100.0 } else { 20.0 });
    let warning = checked(&step).expect("a series").expect("a warning");
    assert!(warning.contains("% in the mean"), "{warning}");
}

#[test]
fn the_lines_of_a_series_are_toml_with_fractions_below_one() {
    let text = series(1e-9, &[(0.3, 0.1), (0.7, 12.345_678)]).to_toml();
    let table: toml::Table = text.parse().expect("valid TOML");
    let shear = table["viscoelastic"]["shear"].as_array().expect("a list");
    let fraction = |k: usize| shear[k]["fraction"].as_float().expect("a number");
    assert!(fraction(0) + fraction(1) < 1.0 && (fraction(0) - 0.3).abs() < 1e-5);
    assert_eq!(shear[1]["time_s"].as_float(), Some(12.35));
    assert_eq!(table["viscoelastic"]["moduli"].as_str(), Some("instantaneous"));
}

/// The fractions of the written lines, and the digits with which they are written.
fn written(series: &PronySeries) -> Vec<(f64, usize)> {
    let text = series.to_toml();
    let fraction = |line: &str| {
        let text = line.split_once("fraction = ")?.1.split_once(',')?.0.to_owned();
        let mantissa = text.split('e').next().unwrap_or_default();
        let digits = mantissa.trim_start_matches(['0', '.']).bytes();
        Some((text.parse().expect("a number"), digits.filter(u8::is_ascii_digit).count()))
    };
    text.lines().filter_map(fraction).collect()
}

/// Small fractions are written with six significant digits, like large ones, and no fraction is written as zero.
#[test]
fn fractions_are_written_with_six_significant_digits() {
    let truth = series(1e6, &[(0.7, 0.1), (123.456_789, 1.0), (5e5, 2.0), (3.2e-9, 3.0)]);
    let whole = truth.instantaneous_mpa();
    let found = written(&truth);
    assert_eq!(found.len(), 4);
    for ((fraction, digits), term) in found.into_iter().zip(&truth.terms) {
        let exact = term.modulus_mpa / whole;
        assert!(fraction > 0.0 && fraction <= exact, "{fraction} {exact}");
        assert!((fraction / exact - 1.0).abs() <= 1e-5, "{fraction} {exact}");
        assert!(digits <= 6, "{fraction}");
    }
    // numbers of few digits are written as they are
    let found = written(&series(0.25, &[(0.25, 0.1), (0.5, 1.0)]));
    assert_eq!(found, [(0.25, 2), (0.5, 1)]);
}

/// Every written series is accepted by a case, even if its long-term modulus is tiny.
#[test]
fn written_series_are_accepted_by_a_case() {
    for (long_term_mpa, terms) in [
        (1e-9, vec![(0.3, 0.1), (0.7, 1.0)]),
        (1e-12, vec![(0.999_999, 0.1), (9.999_99e-7, 1.0)]),
        (1e-14, vec![(1.0, 0.1)]),
        (5.0, vec![(1e-7, 0.1), (1e-30, 1.0)]),
    ] {
        let text = series(long_term_mpa, &terms).to_toml();
        let case = format!(
            "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 0.7\n[material.matrix]\nyoung_mpa = 275\n\
             poisson = 0.25\n{text}[test]\ndisplacement_mm = 0.2\n"
        );
        let read = crate::case::CaseFile::parse(&case, Path::new("case.toml"));
        assert!(read.is_ok(), "{text}{}", read.unwrap_err());
    }
}

#[test]
fn a_picture_is_drawn_of_both_tests() {
    let truth = series(100.0, &[(60.0, 0.1), (40.0, 1.0)]);
    for data in [relaxed(&truth, |_| 0.0), dynamic(&truth)] {
        let bytes = prony_picture(&data, &PronyFit::new(&data)).expect("a picture");
        assert_eq!(&bytes[1..4], b"PNG");
    }
}

fn read(text: &str) -> Result<MeasuredModuli, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("table.csv");
    std::fs::write(&path, text).expect("written");
    MeasuredModuli::read(&path).map_err(|error| error.to_string())
}

#[test]
fn tables_are_read_and_wrong_ones_refused_with_their_line() {
    let rows = "1,5\n2,4\n3,3\n4,2\n5,1\n";
    let data = read(&format!("time_s,modulus_mpa\n{rows}")).expect("valid");
    assert_eq!(data.times_s(), [1.0, 5.0]);
    let rows = "1,5,1\n2,4,1\n3,3,1\n4,2,1\n5,1,1\n";
    let MeasuredModuli::Dynamic(hertz) =
        read(&format!("frequency_hz, storage_mpa, loss_mpa\n{rows}")).expect("valid")
    else {
        panic!("a dynamic test")
    };
    assert!((hertz[1][0] - 4.0 * std::f64::consts::PI).abs() < 1e-12);
    let angular = read(&format!("angular_frequency_per_s,storage_mpa,loss_mpa\n{rows}"));
    assert_eq!(angular.expect("valid").times_s(), [0.2, 1.0]);
    for (text, fragments) in [
        ("time,modulus\n1,2\n", ["line 1", "Name the columns time_s,modulus_mpa"]),
        ("time_s,modulus_mpa\n1,5\n2,-4\n", ["line 3, modulus_mpa = -4", "positive number"]),
        ("time_s,modulus_mpa\n0,5\n", ["line 2, time_s = 0", "positive number"]),
        ("time_s,modulus_mpa\n1,5\n2,four\n", ["line 3, modulus_mpa = four", "positive number"]),
        ("time_s,modulus_mpa\n1,5\n2\n", ["line 3", "every row"]),
        ("time_s,modulus_mpa\n1,5\n2,4\n", ["has 2 rows", "at least 5"]),
        ("time_s,modulus_mpa\n1,5\n1,5\n1,4\n1,4\n1,4\n", ["same time_s", "several times"]),
    ] {
        let message = read(text).expect_err(text);
        for fragment in fragments {
            assert!(message.contains(fragment), "{fragment:?} is not in {message:?}");
        }
    }
    let missing = MeasuredModuli::read(Path::new("no-such-table.csv")).expect_err("no file");
    assert!(missing.to_string().contains("no-such-table.csv"), "{missing}");
}
