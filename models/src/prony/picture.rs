//! Figure of measured moduli and of the fitted Prony series.

use std::io;

use super::data::MeasuredModuli;
use super::fit::PronyFit;
use crate::report::{Chart, Ink};

/// Number of points of a curve.
const POINTS: u32 = 200;

/// Returns a figure of the data and the fit as bytes of a PNG file. Both axes are decimal logarithms.
///
/// # Errors
/// If the figure cannot be drawn.
pub fn prony_picture(data: &MeasuredModuli, fit: &PronyFit) -> io::Result<Vec<u8>> {
    let series = &fit.series;
    let log = |x: f64| x.log10();
    let curve = |[low, high]: [f64; 2], value: &dyn Fn(f64) -> f64| -> Vec<(f64, f64)> {
        let at = |k| low * (high / low).powf(f64::from(k) / f64::from(POINTS));
        (0..=POINTS).map(at).map(|x| (log(x), log(value(x)))).collect()
    };
    let [shortest, longest] = data.times_s();
    let terms = format!("Prony series, {} terms", series.terms.len());
    let chart = match data {
        MeasuredModuli::Relaxation(rows) => {
            let readings = rows.iter().map(|&[t, modulus]| (log(t), log(modulus)));
            Chart::new("log10 of time (s)", "log10 of relaxation modulus (MPa)")
                .points("measured", Ink::Measured, readings)
                .line(
                    &terms,
                    Ink::Posterior,
                    curve([shortest, longest], &|t| series.relaxation_mpa(t)),
                )
                .legend_above_right()
        }
        MeasuredModuli::Dynamic(rows) => {
            let range = [1.0 / longest, 1.0 / shortest];
            let part = |k: usize| rows.iter().map(move |row| (log(row[0]), log(row[k + 1])));
            let line = |k: usize| curve(range, &|omega| series.complex_mpa(omega)[k]);
            Chart::new("log10 of angular frequency (1/s)", "log10 of modulus (MPa)")
                .points("storage modulus, measured", Ink::Measured, part(0))
                .points("loss modulus, measured", Ink::Prior, part(1))
                .line(&terms, Ink::Posterior, line(0))
                .line("", Ink::Posterior, line(1))
                .legend_above_left()
        }
    };
    Chart::to_png(vec![chart])
}
