//! Signs that grains and matrix are exchanged: the material that counts as grain is hollow, and the other material
//! consists of separate parts.

use rayon::prelude::*;

use crate::Volume;
use crate::classify::curvature::relative_curvature;
use crate::volume::components::largest_component;
use crate::volume::filter::erode;

/// Relative curvature of the interface below which the brighter material is hollow, whatever its connections are.
const HOLLOW: f64 = -0.3;
/// Relative curvature below which the brighter material is hollow if the darker material consists of separate parts and
/// fills most of the specimen.
const SLIGHTLY_HOLLOW: f64 = -0.1;
/// Largest share of the brighter material in the volume for which a slight curvature counts. Separate dark grains with
/// less than 40 % of the volume have a stronger curvature, but the gaps between touching bright grains have a slight
/// curvature and consist of separate parts.
const DENSE: f64 = 0.6;
/// Largest share of the darker material, without its outermost voxels, in its largest connected part.
const SEPARATE: f64 = 0.5;
/// Smallest share of the brighter material in its largest connected part.
const CONNECTED: f64 = 0.8;

/// Shapes of two materials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shapes {
    /// Relative curvature of the interface, see [`relative_curvature`].
    pub(crate) curvature: f64,
    /// Share of the darker material, without its outermost voxels, in its largest connected part.
    pub(crate) dark_part: f64,
    /// Share of the brighter material in its largest connected part.
    pub(crate) bright_part: f64,
    /// Share of the brighter material in the volume of both materials.
    pub(crate) bright_share: f64,
}

impl Shapes {
    /// Measures the shapes in a filtered image. `sample` are the voxels away from walls and voids, and `materials` the
    /// grey values of the darker and the brighter material. Returns `None` if there is hardly any interface.
    pub(crate) fn of(smooth: &Volume<u16>, sample: &[u8], materials: [f64; 2]) -> Option<Self> {
        let curvature = relative_curvature(smooth, sample, materials)?;
        let middle = (materials[0] + materials[1]) / 2.0;
        let shape = smooth.shape;
        let class = |is_bright: bool| -> Vec<u8> {
            let voxels = smooth.values.par_iter().zip(sample);
            voxels
                .map(|(&value, &voxel)| u8::from((f64::from(value) >= middle) == is_bright) & voxel)
                .collect()
        };
        let share = |set: &[u8]| {
            let all: usize = set.par_iter().map(|&voxel| usize::from(voxel)).sum();
            largest_component(shape, set) as f64 / all.max(1) as f64
        };
        let voxels =
            |set: &[u8]| set.par_iter().map(|&voxel| usize::from(voxel)).sum::<usize>() as f64;
        let (dark, bright) = (class(false), class(true));
        let bright_share = voxels(&bright) / (voxels(&dark) + voxels(&bright)).max(1.0);
        let dark_part = share(&erode(shape, &dark));
        Some(Shapes { curvature, dark_part, bright_part: share(&bright), bright_share })
    }

    /// Returns whether the brighter material probably surrounds grains of the darker material.
    pub(crate) fn is_exchanged(&self) -> bool {
        let is_separate = self.dark_part < SEPARATE && self.bright_part > CONNECTED;
        let is_dense = self.bright_share < DENSE;
        self.curvature < HOLLOW || (self.curvature < SLIGHTLY_HOLLOW && is_separate && is_dense)
    }
}
