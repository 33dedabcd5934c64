//! Figures of a specimen: sizes of its grains, shapes of its tetrahedra.

use kuva::prelude::*;

use super::style::{ENSEMBLE, POSTERIOR, framed, named_clips, panel, single};

/// Cumulative distribution of grain diameters, by number and by volume. `grains` has (diameter in mm, volume in mm³)
/// for each grain.
pub(crate) fn grain_sizes(grains: &[(f64, f64)]) -> String {
    let mut sorted = grains.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let plots: Vec<Plot> = [
        ("by number", ENSEMBLE, cumulative(sorted.iter().map(|&(d, _)| (d, 1.0)))),
        ("by volume", POSTERIOR, cumulative(sorted.iter().copied())),
    ]
    .into_iter()
    .map(|(name, colour, steps)| {
        let line = LinePlot::new().with_data(steps).with_color(colour).with_stroke_width(2.0);
        line.with_legend(name).into()
    })
    .collect();
    let most = sorted.last().map_or(1.0, |grain| 1.05 * grain.0);
    let layout = panel(&plots, "diameter of an equal sphere (mm)", "fraction up to it")
        .with_legend_position(LegendPosition::InsideBottomRight);
    let figure = single(plots, framed(layout, (0.0, most), (0.0, 1.0)), 460.0, 340.0);
    named_clips(&figure, "grain-sizes")
}

/// Step function of a cumulative distribution, from sorted values with weights.
fn cumulative(values: impl Iterator<Item = (f64, f64)> + Clone) -> Vec<(f64, f64)> {
    let total: f64 = values.clone().map(|(_, weight)| weight).sum();
    let (mut steps, mut below) = (vec![(0.0, 0.0)], 0.0);
    for (value, weight) in values {
        steps.push((value, below / total));
        below += weight;
        steps.push((value, below / total));
    }
    steps
}

/// Histogram of the smallest dihedral angle of each tetrahedron, in degrees.
pub(crate) fn mesh_quality(angles_deg: &[f64]) -> String {
    const BINS: usize = 36;
    const MOST: f64 = 72.0;
    let edges: Vec<f64> = (0..=BINS).map(|i| MOST * i as f64 / BINS as f64).collect();
    let mut counts = vec![0.0; BINS];
    for angle in angles_deg {
        let bin = (angle / MOST * BINS as f64).max(0.0) as usize;
        counts[bin.min(BINS - 1)] += 1.0;
    }
    let top = 1.1 * counts.iter().copied().fold(1.0, f64::max);
    let bars = Histogram::new().with_precomputed(edges, counts).with_color(ENSEMBLE);
    let plots: Vec<Plot> = vec![bars.into()];
    let layout = panel(&plots, "smallest dihedral angle (°)", "tetrahedra");
    let figure = single(plots, framed(layout, (0.0, MOST), (0.0, top)), 460.0, 340.0);
    named_clips(&figure, "mesh-quality")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cumulative_fractions_step_up_to_one() {
        let steps = cumulative([(1.0, 1.0), (2.0, 3.0)].into_iter());
        assert_eq!(steps, [(0.0, 0.0), (1.0, 0.0), (1.0, 0.25), (2.0, 0.25), (2.0, 1.0)]);
    }

    #[test]
    fn figures_are_drawn_of_whatever_there_is() {
        for svg in [grain_sizes(&[]), grain_sizes(&[(0.4, 0.03), (0.2, 0.004)]), mesh_quality(&[])]
        {
            assert!(
                svg.starts_with("<svg") && svg.ends_with("</svg>\n") || svg.ends_with("</svg>")
            );
        }
        assert!(mesh_quality(&[45.0, 60.0, 90.0]).contains("tetrahedra"));
    }
}
