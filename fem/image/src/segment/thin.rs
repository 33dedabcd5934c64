//! Materials of a thin cylinder.

use crate::Volume;
use crate::classify::refine::Materials;
use crate::segment::even::GreyCorrection;
use crate::volume::contrast::Contrast;
use crate::volume::grey::Scale;

/// Radius (voxels) below which a cylinder is thin. The fractions of thicker cylinders do not change if their wall is
/// refined.
const THIN: f64 = 24.0;
/// Number of corrections of a thin cylinder before the last correction. More corrections do not change the fraction.
const PASSES: usize = 2;

/// Finds the materials of a thin cylinder. Each pass corrects the image with the materials of the previous pass, moves
/// the wall, and finds the materials again. Returns `None` for any other specimen, or if there are not two materials.
pub(super) fn materials(
    correction: &mut GreyCorrection<'_>,
    grey: &Volume<u16>,
    smooth: &Volume<u16>,
    scale: Scale,
) -> Option<Materials> {
    if correction.specimen.fit.is_none_or(|fit| fit.radius >= THIN) {
        return None;
    }
    let is_dark = correction.contrast == Contrast::Dark;
    let mut known = None;
    for _ in 0..PASSES {
        let pass = correction.run(grey.clone(), smooth.clone(), scale, known.as_ref());
        let sets: [&[u8]; 2] = [&pass.solid, &pass.sample];
        known = Some(Materials::find(&pass.smooth, &pass.grey, sets, is_dark)?);
        correction.specimen = pass.specimen;
    }
    known
}
