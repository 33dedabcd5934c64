//! Checks of the distribution of grains in a cylinder: a layer of grain at the wall, and ends without grains.

use rayon::prelude::*;

use crate::Volume;
use crate::locate::fit::Fit;
use crate::volume::voxel_at;

/// Depth (voxels) up to which a layer at the wall is searched.
const LAYERS: usize = 5;
/// Distance from the ends (voxels) within which voxels do not count as part of a layer at the wall.
const END: f64 = 6.0;
/// Smallest share of grain in a layer that counts as a skin.
const SKIN: f64 = 0.75;
/// Smallest ratio of the share of grain in a skin to the share of grain in the interior.
const SKIN_RATIO: f64 = 1.4;
/// Share of the height above which an end without grains is reported.
const EMPTY: f64 = 0.1;
/// An end without grains is reported only if its probability is below this value for grains at random positions.
const CHANCE: f64 = 0.01;

/// Returns a warning if a layer below the wall consists mainly of grain and the interior does not, as in an image of a
/// specimen with a bright skin (for dark grains: with a dark skin).
pub(super) fn skin_in_words(labels: &Volume<u32>, inside: &[u8], fit: &Fit) -> Option<String> {
    let area = labels.shape[0] * labels.shape[1];
    // numbers of voxels and of grain voxels for each depth below the wall; the last entry is the interior
    let of_slice = |z: usize| {
        let mut counts = [[0_u64; 2]; LAYERS + 1];
        for at in (area * z..area * (z + 1)).filter(|&at| inside[at] != 0) {
            let [square, height] = fit.radius_squared_and_height(voxel_at(labels.shape, at));
            if (height - fit.bottom).min(fit.top - height) < END {
                continue;
            }
            let depth = (fit.radius - square.sqrt()).max(0.0) as usize;
            let count = &mut counts[depth.min(LAYERS)];
            count[0] += 1;
            count[1] += u64::from(labels.values[at] != 0);
        }
        counts
    };
    let counts = (0..labels.shape[2]).into_par_iter().map(of_slice).reduce(
        || [[0; 2]; LAYERS + 1],
        |a, b| std::array::from_fn(|n| [a[n][0] + b[n][0], a[n][1] + b[n][1]]),
    );
    let share = |[all, grain]: [u64; 2]| grain as f64 / all.max(1) as f64;
    let interior = share(counts[LAYERS]);
    let (depth, skin) = (counts[..LAYERS].iter().map(|&count| share(count)).enumerate())
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    (skin > SKIN && skin > SKIN_RATIO * interior).then(|| {
        format!(
            "the grain fraction is too large if the specimen has a skin: {:.0} % of the layer {} to {} voxels below the wall \
             counts as grain, but {:.0} % of the interior: exclude the skin by radius_px in [specimen.image.region]",
            100.0 * skin,
            depth,
            depth + 1,
            100.0 * interior
        )
    })
}

/// Returns a warning if an end of the cylinder has no grains, as a pedestal with the radius and the grey value of the
/// specimen.
pub(super) fn empty_end_in_words(labels: &Volume<u32>, grains: usize, fit: &Fit) -> Option<String> {
    let heights = labels.values.par_iter().enumerate().filter(|(_, label)| **label != 0);
    let [lowest, highest] = heights
        .map(|(at, _)| [fit.radius_squared_and_height(voxel_at(labels.shape, at))[1]; 2])
        .reduce(|| [f64::INFINITY, f64::NEG_INFINITY], |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    let height = fit.top - fit.bottom;
    let ends = [("lower", lowest - fit.bottom), ("upper", fit.top - highest)];
    let empty = ends.into_iter().filter(|(_, length)| {
        let share = (length / height).clamp(0.0, 1.0);
        share > EMPTY && (1.0 - share).powi(grains.min(10_000) as i32) < CHANCE
    });
    let parts: Vec<String> = empty
        .map(|(end, length)| {
            format!("the {end} {length:.1} voxels ({:.0} % of the height)", 100.0 * length / height)
        })
        .collect();
    (!parts.is_empty()).then(|| {
        format!(
            "the height and the grain fraction are wrong if another body counts as part of the specimen: {} contain no grain, as \
             a pedestal with the radius and the grey value of the specimen: check the slices, or give slices in \
             [specimen.image.region]",
            parts.join(" and ")
        )
    })
}
