//! Figures of predictions for held-out specimens.

use kuva::prelude::*;

use super::curves::{band_of, force_displacement};
use super::draw::{line, round_range, thin};
use crate::report::results::{ValidatedQuantity, ValidationResult};
use crate::report::style::{DRAWS, DRAWS_FILL, MEASURED, POSTERIOR, framed, panel, single};

/// Width and height of the panel of a quantity in units of the drawing.
const SIZE: (f64, f64) = (330.0, 250.0);
/// Half of the width of a band behind the specimens, which have the distance 1.
const MARGIN: f64 = 0.7;

/// One panel per quantity: the measurements as points, one per specimen, over the predicted 50 and 90 % intervals and the
/// median.
pub(in crate::report) fn validated(result: &ValidationResult) -> Vec<String> {
    result
        .quantities
        .iter()
        .filter(|compared| !compared.specimens.is_empty())
        .map(quantity)
        .collect()
}

fn quantity(validated: &ValidatedQuantity) -> String {
    let count = validated.specimens.len() as f64;
    let ends = [1.0 - MARGIN, count + MARGIN];
    let mut plots: Vec<Plot> = Vec::new();
    let [q05, q25, median, q75, q95] = validated.quantiles;
    for (low, high, colour) in [(q05, q95, DRAWS_FILL), (q25, q75, DRAWS)] {
        if let (Some(low), Some(high)) = (low, high) {
            let band = BandPlot::new(ends, [low, low], [high, high]);
            plots.push(band.with_color(colour).with_opacity(1.0).into());
        }
    }
    if let Some(median) = median {
        plots.push(line(ends.map(|x| (x, median)), POSTERIOR, 2.0).into());
    }
    let specimen_values = (1..).zip(&validated.specimens).map(|(k, (_, y))| (f64::from(k), *y));
    let specimen_values: Vec<(f64, f64)> = specimen_values.collect();
    plots.push(
        ScatterPlot::new().with_data(specimen_values).with_color(MEASURED).with_size(4.0).into(),
    );
    let values = validated.specimens.iter().map(|(_, y)| *y);
    let range = round_range(values.chain(validated.quantiles.into_iter().flatten()));
    let layout = panel(&plots, "specimen", &validated.label);
    let layout = framed(layout, (ends[0], ends[1]), range).with_ticks(4);
    single(plots, layout, SIZE.0, SIZE.1)
}

/// Predicted band of the curve with the measured curves; `None` if curves are not compared.
pub(in crate::report) fn validated_curves(result: &ValidationResult) -> Option<String> {
    let mut plots = band_of(result.band.as_ref()?);
    for (k, curve) in result.curves.iter().enumerate() {
        let plot = line(thin(curve, 240), MEASURED, 1.3).with_dashed();
        plots.push(if k == 0 { plot.with_legend("held-out").into() } else { plot.into() });
    }
    Some(force_displacement(plots))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::results::PredictedBand;

    #[test]
    fn each_quantity_has_a_panel_with_its_intervals() {
        let judged = ValidatedQuantity {
            label: "peak force (N)".into(),
            quantiles: [90.0, 97.0, 100.0, 103.0, 110.0].map(Some),
            specimens: vec![("H-1".into(), 99.0), ("H-2".into(), 104.0)],
            ..Default::default()
        };
        let unknown = ValidatedQuantity {
            quantiles: [None, None, Some(100.0), None, None],
            ..judged.clone()
        };
        let mut result =
            ValidationResult { quantities: vec![judged, unknown], ..Default::default() };
        let [with, without] = &validated(&result)[..] else { panic!("two panels") };
        assert!(with.contains("peak force (N)") && with.contains(DRAWS_FILL));
        assert!(without.contains(MEASURED) && !without.contains(DRAWS_FILL));
        assert!(validated_curves(&result).is_none());
        let forces = |scale: f64| vec![0.0, 10.0 * scale];
        let force_n = [0.8, 0.9, 1.0, 1.1, 1.2].map(forces);
        let displacement_mm = vec![0.0, 0.1];
        result.band = Some(PredictedBand { displacement_mm, force_n, end: None });
        result.curves = vec![vec![(0.0, 0.0), (0.1, 9.0)]];
        let svg = validated_curves(&result).unwrap();
        assert!(svg.contains("held-out") && svg.contains("median") && !svg.contains("NaN"));
    }
}
