//! Specimens that extend beyond their image, or beyond the region given by the user.

use crate::locate::fit::Fit;

/// Distance (voxels) beyond the image up to which an inaccurate fit is the probable cause.
const TOLERANCE: f64 = 0.5;
/// A region that exceeds the specimen by more than this distance (voxels) is reported.
const EXCESS: f64 = 1.0;

/// Returns a warning if a fitted cylinder reaches the first or the last slice, or extends beyond the sides of the image.
/// Then the image shows only a part of the specimen. `has_given_ends` is true if the user gives the slices of the
/// specimen, which may be all slices.
pub(crate) fn beyond_image(fit: &Fit, shape: [usize; 3], has_given_ends: bool) -> Option<String> {
    let [low, high] = extent(fit);
    let mut parts = Vec::new();
    if low[2] <= 0.0 && !has_given_ends {
        parts.push("reaches the first slice".to_owned());
    }
    if high[2] >= shape[2] as f64 && !has_given_ends {
        parts.push("reaches the last slice".to_owned());
    }
    for (axis, name) in [(0, "x"), (1, "y")] {
        let beyond = (-low[axis]).max(high[axis] - shape[axis] as f64);
        if beyond > TOLERANCE {
            parts.push(format!("extends {beyond:.1} voxels beyond the image along {name}"));
        }
    }
    if parts.is_empty() {
        return None;
    }
    let voxels = fit.inside(shape, 0.0).iter().filter(|&&voxel| voxel != 0).count();
    let outside = (1.0 - voxels as f64 / fit.in_mm(1.0).volume_mm3()).max(0.0);
    Some(format!(
        "the height or the grain fraction is wrong if the image shows only a part of the specimen: the fitted cylinder {} \
         ({:.1} % of its volume is outside the image): image the whole specimen, or give the part to be used in \
         [specimen.image.region]",
        parts.join(" and "),
        100.0 * outside
    ))
}

/// Returns the lowest and the highest coordinates of the points of a cylinder along x, y and z (voxels).
fn extent(fit: &Fit) -> [[f64; 3]; 2] {
    let [p, q] = fit.lean;
    let stretch = (1.0 + p * p + q * q).sqrt();
    let axis = [p, q, 1.0].map(|slope| slope / stretch);
    let middle = [fit.centre[0], fit.centre[1], (fit.bottom + fit.top) / 2.0];
    let half = (fit.top - fit.bottom) / 2.0;
    let reach = axis.map(|c: f64| half * c.abs() + fit.radius * (1.0 - c * c).max(0.0).sqrt());
    let at = |sign: f64| [0, 1, 2].map(|k| middle[k] + sign * reach[k]);
    [at(-1.0), at(1.0)]
}

/// Returns a warning if a region given by the user extends beyond the specimen that the image shows. Air in the region
/// is meshed as matrix.
pub(crate) fn region_beyond(region: &Fit, fitted: &Fit) -> Option<String> {
    let off = (region.centre[0] - fitted.centre[0]).hypot(region.centre[1] - fitted.centre[1]);
    let mut parts = Vec::new();
    for (beyond, name) in [
        (off + region.radius - fitted.radius, "beyond the wall (centre_px, radius_px)"),
        (fitted.bottom - region.bottom, "below the specimen (slices)"),
        (region.top - fitted.top, "above the specimen (slices)"),
    ] {
        if beyond > EXCESS {
            parts.push(format!("{beyond:.1} voxels {name}"));
        }
    }
    (!parts.is_empty()).then(|| {
        format!(
            "air is meshed as matrix where [specimen.image.region] is larger than the specimen: the region extends {}; the image \
             shows a specimen of {:.1} voxels in radius around ({:.1}, {:.1}) in slices {:.0} to {:.0}: reduce the region",
            parts.join(" and "),
            fitted.radius,
            fitted.centre[0],
            fitted.centre[1],
            fitted.bottom + 1.0,
            fitted.top
        )
    })
}
