//! Engineering curves of round bars, and their quantities of interest.

use std::path::Path;

use nalgebra::{Matrix3, Vector3};

use crate::error::InputError;
use crate::tension::read_engineering_curves;

/// Fraction of the largest stress above which readings determine the strain at the peak.
const NEAR_PEAK: f64 = 0.99;
/// Number of points at which the curve near the peak is interpolated for its parabola.
const PARABOLA_POINTS: usize = 101;
/// Least number of readings near the peak.
const LEAST_READINGS: usize = 5;

/// Engineering stress over engineering strain of one bar, measured or simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct BarCurve {
    /// Name of the specimen.
    pub specimen: String,
    /// Engineering strain (elongation over gauge length) and engineering stress in MPa, in the order of the test.
    pub readings: Vec<(f64, f64)>,
}

/// Largest engineering stress of a bar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarPeak {
    /// Largest reading of the engineering stress in MPa.
    pub stress_mpa: f64,
    /// Engineering strain at the vertex of a parabola that is fitted to the part of the curve above 99 % of the largest
    /// stress. The maximum of a ductile metal is so flat that the strain of the largest reading is mostly noise.
    pub strain: f64,
}

/// Reason why a quantity of interest of a bar cannot be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BarCurveError {
    /// The curve does not reach a strain.
    #[error(
        "specimen {specimen}: no reading at a strain of {strain}; the curve covers {from} to {to}"
    )]
    NotCovered {
        /// Name of the specimen.
        specimen: String,
        /// The requested strain.
        strain: f64,
        /// Smallest strain of the curve.
        from: f64,
        /// Largest strain of the curve.
        to: f64,
    },
    /// The largest stress is the first or last reading, or too few readings resolve it.
    #[error(
        "specimen {specimen}: the largest stress is not resolved: {readings} readings above 99 % of the largest stress \
         form no maximum; a test must continue until the load falls, with at least 5 readings near the largest load"
    )]
    NoPeak {
        /// Name of the specimen.
        specimen: String,
        /// Number of readings near the largest stress.
        readings: usize,
    },
}

impl BarCurve {
    /// Returns the engineering stress at an engineering strain in MPa, by linear interpolation. If the curve passes the
    /// strain several times, because the bar was unloaded, the largest of these stresses is returned: it belongs to the
    /// flowing bar.
    ///
    /// # Errors
    /// [`BarCurveError::NotCovered`] if the curve does not reach the strain.
    ///
    /// # Example
    /// ```
    /// use breccia_calibration::viscoplastic::BarCurve;
    ///
    /// let readings = vec![(0.0, 0.0), (0.1, 400.0), (0.09, 100.0), (0.2, 500.0)];
    /// let curve = BarCurve { specimen: "A".into(), readings };
    /// assert!((curve.stress_at(0.095)? - 380.0).abs() < 1e-9);
    /// # Ok::<(), breccia_calibration::viscoplastic::BarCurveError>(())
    /// ```
    pub fn stress_at(&self, strain: f64) -> Result<f64, BarCurveError> {
        let between = |pair: &[(f64, f64)]| {
            let [(a, stress_a), (b, stress_b)] = [pair[0], pair[1]];
            let is_passed = a != b && (a.min(b)..=a.max(b)).contains(&strain);
            is_passed.then(|| stress_a + (stress_b - stress_a) * (strain - a) / (b - a))
        };
        self.readings.windows(2).filter_map(between).max_by(f64::total_cmp).ok_or_else(|| {
            let strains = || self.readings.iter().map(|reading| reading.0);
            BarCurveError::NotCovered {
                specimen: self.specimen.clone(),
                strain,
                from: strains().fold(f64::INFINITY, f64::min),
                to: strains().fold(f64::NEG_INFINITY, f64::max),
            }
        })
    }

    /// Returns the largest engineering stress and the strain at which it occurs.
    ///
    /// # Errors
    /// [`BarCurveError::NoPeak`] if the stress does not fall on both sides of its largest value, or too few readings lie
    /// near it.
    pub fn peak(&self) -> Result<BarPeak, BarCurveError> {
        let stress = |k: usize| self.readings[k].1;
        let count = self.readings.len();
        let highest = (0..count).max_by(|&a, &b| stress(a).total_cmp(&stress(b))).unwrap_or(0);
        let largest = self.readings.get(highest).map_or(0.0, |reading| reading.1);
        let is_near = |&k: &usize| stress(k) >= NEAR_PEAK * largest;
        let before = (0..highest).rev().take_while(is_near).count();
        let after = (highest + 1..count).take_while(is_near).count();
        let no_peak = || BarCurveError::NoPeak {
            specimen: self.specimen.clone(),
            readings: before + after + 1,
        };
        let [first, last] = [highest - before, highest + after];
        if first == 0 || last + 1 >= count || before + after + 1 < LEAST_READINGS {
            return Err(no_peak());
        }
        // a fit to equally spaced points of the curve does not depend on the spacing of the readings
        let [from, to] = [first, last].map(|k| self.readings[k].0);
        let (centre, half) = (0.5 * (from + to), 0.5 * (to - from));
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for k in 0..PARABOLA_POINTS {
            let x = -1.0 + 2.0 * k as f64 / (PARABOLA_POINTS - 1) as f64;
            let powers = Vector3::new(1.0, x, x * x);
            normal += powers * powers.transpose();
            right += powers * self.stress_at(centre + half * x)?;
        }
        let coefficients = normal.cholesky().ok_or_else(no_peak)?.solve(&right);
        let vertex = -0.5 * coefficients[1] / coefficients[2];
        if coefficients[2] < 0.0 && vertex.abs() <= 1.0 {
            Ok(BarPeak { stress_mpa: largest, strain: centre + half * vertex })
        } else {
            Err(no_peak())
        }
    }

    /// Returns quantities of interest: the stresses at some engineering strains (MPa), the largest stress (MPa), and its
    /// strain. `M` is the number of strains plus two.
    ///
    /// # Errors
    /// The errors of [`stress_at`](Self::stress_at) and of [`peak`](Self::peak).
    ///
    /// # Panics
    /// If `M` is not the number of strains plus two.
    pub fn quantities<const M: usize>(&self, strains: &[f64]) -> Result<[f64; M], BarCurveError> {
        assert_eq!(strains.len() + 2, M, "a quantity for each strain, and two of the peak");
        let mut quantities = [0.0; M];
        for (quantity, &strain) in quantities.iter_mut().zip(strains) {
            *quantity = self.stress_at(strain)?;
        }
        let peak = self.peak()?;
        quantities[M - 2] = peak.stress_mpa;
        quantities[M - 1] = peak.strain;
        Ok(quantities)
    }
}

/// Reads a table with the columns `specimen,engineering_strain,engineering_stress_ksi`, one line per reading. The bars
/// are in the order of their first lines; stresses are converted to MPa.
///
/// # Errors
/// If a value is missing or wrong, or the table has no line. The error names line, column and value.
pub fn read_bar_curves(file: &Path) -> Result<Vec<BarCurve>, InputError> {
    let curves = read_engineering_curves(file)?;
    if curves.is_empty() {
        return Err(InputError::new(
            file,
            "",
            "",
            "has no readings",
            "Write one line for each reading.",
        ));
    }
    let bar = |(specimen, readings)| BarCurve { specimen, readings };
    Ok(curves.into_iter().map(bar).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(stress: impl Fn(f64) -> f64, spacing: f64, end: f64) -> BarCurve {
        let strains = (0..).map(|k| spacing * f64::from(k)).take_while(|e| *e <= end);
        let readings = strains.map(|e| (e, stress(e))).collect();
        BarCurve { specimen: "A".into(), readings }
    }

    #[test]
    fn a_parabola_has_its_peak_at_its_vertex() {
        let stress = |e: f64| 500.0 - 400.0 * (e - 0.412).powi(2);
        for spacing in [0.003, 0.0171, 0.03] {
            let peak = curve(stress, spacing, 0.8).peak().unwrap();
            assert!((peak.strain - 0.412).abs() < 2e-3, "{spacing}: {peak:?}");
            assert!((peak.stress_mpa - 500.0).abs() < 0.1, "{spacing}: {peak:?}");
        }
    }

    #[test]
    fn curves_without_a_peak_are_refused_by_name() {
        let rising = curve(|e| 300.0 + 100.0 * e, 0.01, 0.8).peak().unwrap_err();
        assert!(matches!(&rising, BarCurveError::NoPeak { specimen, .. } if specimen == "A"));
        let coarse = curve(|e| 500.0 - 400.0 * (e - 0.4).powi(2), 0.2, 0.8).peak();
        assert!(matches!(coarse, Err(BarCurveError::NoPeak { readings: 1, .. })), "{coarse:?}");
        let empty = BarCurve { specimen: "B".into(), readings: Vec::new() };
        assert!(empty.peak().is_err() && empty.stress_at(0.1).is_err());
        let short = curve(|e| 300.0 + e, 0.01, 0.5).stress_at(0.7).unwrap_err();
        assert!(short.to_string().contains("strain of 0.7; the curve covers 0 to 0.5"), "{short}");
    }

    /// Compares with the mean and the standard deviation of the largest readings, 83.88 ± 0.51 ksi at strains of 0.610 ±
    /// 0.033, which were computed independently from the file.
    #[test]
    fn the_eight_bars_have_their_peaks() {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/data/matcal_304L_tension.csv");
        let bars = read_bar_curves(&file).unwrap();
        assert_eq!(bars.len(), 8);
        let peaks: Vec<BarPeak> = bars.iter().map(|bar| bar.peak().unwrap()).collect();
        let statistics = |values: Vec<f64>| {
            let mean = values.iter().sum::<f64>() / 8.0;
            let squares: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
            (mean, (squares / 7.0).sqrt())
        };
        let ksi = peaks.iter().map(|peak| peak.stress_mpa / 6.894_757).collect();
        let (mean, sd) = statistics(ksi);
        assert!((mean - 83.88).abs() < 0.005 && (sd - 0.51).abs() < 0.005, "{mean} {sd}");
        let highest = bars.iter().map(|bar| {
            let higher = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
            bar.readings.iter().max_by(higher).unwrap().0
        });
        let (mean, sd) = statistics(highest.collect());
        assert!((mean - 0.610).abs() < 1.5e-3 && (sd - 0.033).abs() < 1.5e-3, "{mean} {sd}");
        let (of_parabola, _) = statistics(peaks.iter().map(|peak| peak.strain).collect());
        println!("strain at peak: {mean} of the largest readings, {of_parabola} of parabolas");
        assert!((of_parabola / mean - 1.0).abs() < 0.03, "{of_parabola}");
        // the first bar was unloaded twice; the stress of the flowing bar is not affected
        let stress = bars[0].stress_at(0.2).unwrap() / 6.894_757;
        assert!((stress - 69.14).abs() < 0.01, "{stress}");
    }
}
