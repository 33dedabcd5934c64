//! Figure of one parameter in several calibrations.

use kuva::prelude::*;

use super::density::density;
use super::draw::line;
use crate::report::results::CalibratedParameter;
use crate::report::style::{MEASURED, SERIES, framed, panel, single};

/// Colour of a case, given its position among all cases.
pub(in crate::report) fn colour_of(case: usize) -> &'static str {
    SERIES[case % SERIES.len()]
}

/// Posterior densities of a parameter, one per case, with priors and true values. Each case has its position among all
/// cases, which determines its colour; the legend is not a part of the figure.
pub(in crate::report) fn overlaid(label: &str, cases: &[(usize, &CalibratedParameter)]) -> String {
    let (lower, upper) = cases.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), (_, p)| {
        (a.min(p.range().0), b.max(p.range().1))
    });
    let mut plots: Vec<Plot> = Vec::new();
    let mut top: f64 = 0.0;
    for &(case, p) in cases {
        let colour = colour_of(case);
        let draws: Vec<f64> = p.draws().collect();
        let prior = p.prior.curve();
        let posterior_curve =
            if draws.is_empty() { Vec::new() } else { density(&draws, p.range()) };
        top = posterior_curve.iter().chain(&prior).map(|point| point.1).fold(top, f64::max);
        plots.push(line(posterior_curve, colour, 2.0).into());
        plots.push(line(prior, colour, 1.2).with_dashed().into());
    }
    let top = 1.05 * top;
    let mut truths: Vec<f64> = cases.iter().filter_map(|(_, p)| p.truth).collect();
    truths.sort_by(f64::total_cmp);
    truths.dedup();
    for truth in truths {
        // green, the usual colour of the truth, is here the colour of a case
        plots.push(line([(truth, 0.0), (truth, top)], MEASURED, 1.8).with_dotted().into());
    }
    let lower = if lower > 0.0 && lower < 0.01 * upper { 0.0 } else { lower };
    let layout = framed(panel(&plots, label, "density"), (lower, upper), (0.0, top)).with_ticks(4);
    single(plots, layout, 460.0, 330.0)
}
