//! Labelled voxels as a [`GrainField`].

use rayon::prelude::*;

use super::field::GrainField;
use super::signed_distance::Patch;
use crate::mesh::Surface;
use crate::mesh::surface::isosurface;
use fem_image::{Cylinder, Volume};

/// Width of the margin around a grain's bounding box in which distances are also stored (voxels).
const MARGIN: usize = 3;

/// Grains of a segmented image: a [`GrainField`] with distances accurate to a fraction of a voxel.
///
/// The volume of a grain is the sum of the solid fractions of its own voxels and of adjacent matrix voxels. The solid
/// fraction of a matrix voxel is divided among the adjacent grains. Distances are stored in a box around each grain;
/// their zero set is a surface that encloses the grain's volume.
#[derive(Debug)]
pub struct VoxelGrains<'a> {
    labels: &'a Volume<u32>,
    /// Position of the specimen in the image.
    cylinder: Cylinder,
    /// Signed distances (voxels) in a box around each grain.
    distances: Vec<Patch>,
    /// Volume of each grain inside the cylinder (mm³).
    volumes_mm3: Vec<f64>,
    /// Volume of each grain (mm³), including parts outside the cylinder.
    whole_mm3: Vec<f64>,
    /// For each grain, the fraction of its volume that lies inside the cylinder.
    inside: Vec<f64>,
    phases: Vec<String>,
    /// Phase of each grain, an index into `phases`.
    phase_of: Vec<usize>,
}

impl<'a> VoxelGrains<'a> {
    /// Creates grains from labels (0 for the matrix; grains are numbered from 1) and the solid fraction of each voxel,
    /// in [0, 1]. Without solid fractions, labelled voxels count as entirely solid. `cylinder` is the position of the
    /// specimen in the image: the centre of its bottom becomes the origin, and only the part of each grain inside the
    /// cylinder counts.
    ///
    /// # Panics
    /// If the two volumes have different shapes or do not have one value per voxel.
    pub fn new(
        labels: &'a Volume<u32>,
        solid: Option<&Volume<f32>>,
        cylinder: &Cylinder,
    ) -> VoxelGrains<'a> {
        let count: usize = labels.shape.iter().product();
        assert_eq!(
            labels.values.len(),
            count,
            "the number of labels differs from the number of voxels"
        );
        if let Some(solid) = solid {
            assert_eq!(
                solid.shape, labels.shape,
                "labels and solid fractions have different shapes"
            );
            assert_eq!(
                solid.values.len(),
                count,
                "the number of solid fractions differs from the number of voxels"
            );
        }
        let voxel = labels.voxel_mm;
        let is_inside = |at: [usize; 3]| {
            let [x, y, z] = cylinder.to_specimen(at.map(|k| (k as f64 + 0.5) * voxel));
            x.hypot(y) < cylinder.radius_mm && (0.0..cylinder.height_mm()).contains(&z)
        };
        let boxes = boxes(labels);
        let grain = |(k, bounds): (usize, &Option<[[usize; 3]; 2]>)| {
            let number = k as u32 + 1;
            let Some([low, high]) = bounds else {
                return (Patch::new([0; 3], [0; 3]), (0.0, (0.0, 0.0)));
            };
            let low = low.map(|x| x.saturating_sub(MARGIN));
            let size =
                std::array::from_fn(|k| (high[k] + MARGIN + 1).min(labels.shape[k]) - low[k]);
            let mut patch = Patch::new(low, size);
            let (mut voxels, mut all) = (0.0, 0.0);
            let voxels_of_box = patch.voxels();
            for (value, in_box) in patch.values.iter_mut().zip(voxels_of_box) {
                let at = std::array::from_fn(|k| in_box[k] + low[k]);
                *value = share(labels, solid, number, at);
                if *value > 0.0 {
                    all += f64::from(*value);
                    voxels += if is_inside(at) { f64::from(*value) } else { 0.0 };
                }
            }
            patch.fractions_to_distances();
            patch.enclose(all);
            let inside = if all > 0.0 { voxels / all } else { 0.0 };
            (patch, (voxels * voxel.powi(3), (all * voxel.powi(3), inside)))
        };
        let (distances, volumes): (_, Vec<(f64, (f64, f64))>) =
            boxes.par_iter().enumerate().map(grain).unzip();
        let (volumes_mm3, volumes): (_, Vec<(f64, f64)>) = volumes.into_iter().unzip();
        let (whole_mm3, inside) = volumes.into_iter().unzip();
        let (phases, phase_of) = (vec!["grain".into()], vec![0; boxes.len()]);
        VoxelGrains {
            labels,
            cylinder: *cylinder,
            distances,
            volumes_mm3,
            whole_mm3,
            inside,
            phases,
            phase_of,
        }
    }

    /// Assigns phases to the grains. `names` contains the names of the phases; `phase_of` lists pairs of a grain number
    /// and a phase (an index into `names`). A grain that is not listed belongs to the first phase.
    ///
    /// # Panics
    /// If `names` is empty, or a phase index is out of range.
    pub fn with_phases(
        mut self,
        names: Vec<String>,
        phase_of: impl IntoIterator<Item = (u32, usize)>,
    ) -> Self {
        assert!(!names.is_empty(), "the list of phases is empty");
        for (grain, phase) in phase_of {
            assert!(
                phase < names.len(),
                "phase {phase} of grain {grain} is not below the number of phases, {}",
                names.len()
            );
            if let Some(entry) = self.phase_of.get_mut((grain as usize).wrapping_sub(1)) {
                *entry = phase;
            }
        }
        self.phases = names;
        self
    }

    /// Replaces the volumes of grains (mm³) by more accurate volumes, such as the volumes of
    /// [`Region`](fem_image::Region). Sums of solid fractions, which are clipped to [0, 1], are less accurate: blur
    /// spreads part of a grain beyond the adjacent voxels, and clipped noise does not average out. The fraction of a
    /// grain inside the cylinder does not change, and a grain that is not listed keeps its volume. Distances are
    /// shifted so that the surface of each grain encloses the new volume.
    pub fn with_volumes(mut self, volumes_mm3: impl IntoIterator<Item = (u32, f64)>) -> Self {
        for (grain, volume) in volumes_mm3 {
            let index = (grain as usize).wrapping_sub(1);
            if let Some(inside_mm3) = self.volumes_mm3.get_mut(index) {
                *inside_mm3 = volume.max(0.0) * self.inside[index];
                self.whole_mm3[index] = volume.max(0.0);
                self.distances[index].enclose(volume / self.labels.voxel_mm.powi(3));
            }
        }
        self
    }

    /// Returns the closed surface of a grain (mm) in the coordinates of the specimen. The surface encloses the whole
    /// grain, including the part outside the cylinder, and has the volume of the grain. Returns `None` for a grain
    /// without voxels.
    pub fn surface(&self, grain: u32) -> Option<Surface> {
        let number = (grain as usize).checked_sub(1)?;
        let patch = self.distances.get(number)?;
        let size = patch.size;
        let index = |at: [usize; 3]| at[0] + size[0] * (at[1] + size[1] * at[2]);
        let mut surface = isosurface(size, &|at| f64::from(patch.values[index(at)]));
        if surface.triangles.is_empty() {
            // the smoothing of distances has removed this grain, which has few voxels: extract the surface of its
            // labelled voxels instead
            surface = isosurface(size, &|at| {
                let voxel: [usize; 3] = std::array::from_fn(|k| at[k] + patch.low[k]);
                let [nx, ny, _] = self.labels.shape;
                let label = self.labels.values[voxel[0] + nx * (voxel[1] + ny * voxel[2])];
                if label == grain { -0.5 } else { 0.5 }
            });
        }
        let voxel_mm = self.labels.voxel_mm;
        for point in &mut surface.points {
            let at = std::array::from_fn(|k| (point[k] + patch.low[k] as f64 + 0.5) * voxel_mm);
            *point = self.cylinder.to_specimen(at);
        }
        let ratio = self.whole_mm3[number] / surface.volume();
        match ratio.is_finite() && ratio > 0.0 {
            true => Some(surface.scaled(ratio.cbrt())),
            false => (!surface.triangles.is_empty()).then_some(surface),
        }
    }

    /// Converts a point of the specimen (mm) to voxels from the corner of the first voxel.
    fn voxels(&self, x: [f64; 3]) -> [f64; 3] {
        self.cylinder.to_image(x).map(|x| x / self.labels.voxel_mm)
    }
}

impl GrainField for VoxelGrains<'_> {
    fn grains(&self) -> usize {
        self.distances.len()
    }

    fn phases(&self) -> Vec<String> {
        self.phases.clone()
    }

    fn phase_of(&self, grain: u32) -> usize {
        self.phase_of[grain as usize - 1]
    }

    fn grain_at(&self, x: [f64; 3]) -> u32 {
        let at = self.voxels(x);
        let [nx, ny, nz] = self.labels.shape;
        if (0..3).any(|k| at[k] < 0.0 || at[k] >= self.labels.shape[k] as f64) {
            return 0;
        }
        let [a, b, c] = at.map(|x| x as usize);
        self.labels.values[a.min(nx - 1) + nx * (b.min(ny - 1) + ny * c.min(nz - 1))]
    }

    fn distance(&self, grain: u32, x: [f64; 3]) -> f64 {
        let patch = &self.distances[grain as usize - 1];
        if patch.values.is_empty() {
            return f64::INFINITY;
        }
        let at = self.voxels(x);
        let (value, outside) =
            patch.interpolate(std::array::from_fn(|k| at[k] - 0.5 - patch.low[k] as f64));
        (value + outside) * self.labels.voxel_mm
    }

    fn volume_mm3(&self, grain: u32) -> f64 {
        self.volumes_mm3[grain as usize - 1]
    }

    fn near(&self, x: [f64; 3], reach: f64, grains: &mut Vec<u32>) {
        // the labels serve as a spatial index: a grain that is closer than `reach` has a voxel in the box around the
        // point
        let at = self.voxels(x);
        let reach = reach / self.labels.voxel_mm + 1.0;
        let first = grains.len();
        let range = |k: usize| {
            let last = self.labels.shape[k] as f64;
            let low = (at[k] - reach).floor().clamp(0.0, last) as usize;
            low..(at[k] + reach).ceil().clamp(0.0, last) as usize
        };
        let [nx, ny, _] = self.labels.shape;
        let mut last = 0;
        for z in range(2) {
            for y in range(1) {
                let row = nx * (y + ny * z);
                for &label in &self.labels.values[row..][range(0)] {
                    if label != last && label > 0 {
                        last = label;
                        if !grains[first..].contains(&label) {
                            grains.push(label);
                        }
                    }
                }
            }
        }
        grains[first..].sort_unstable();
    }

    fn resolution_mm(&self) -> f64 {
        0.5 * self.labels.voxel_mm
    }
}

/// Returns the bounding box (first and last voxel) of each label from 1; `None` for a label without voxels.
fn boxes(labels: &Volume<u32>) -> Vec<Option<[[usize; 3]; 2]>> {
    let grains = labels.values.par_iter().copied().max().unwrap_or(0) as usize;
    let mut boxes: Vec<Option<[[usize; 3]; 2]>> = vec![None; grains];
    let nx = labels.shape[0].max(1);
    for (row, values) in labels.values.chunks(nx).enumerate() {
        let (y, z) = (row % labels.shape[1], row / labels.shape[1]);
        for (x, &label) in values.iter().enumerate().filter(|(_, label)| **label > 0) {
            let at = [x, y, z];
            let [low, high] = boxes[label as usize - 1].get_or_insert([at, at]);
            for k in 0..3 {
                low[k] = low[k].min(at[k]);
                high[k] = high[k].max(at[k]);
            }
        }
    }
    boxes
}

/// Returns the share of a voxel's solid fraction that counts as volume of a grain.
fn share(labels: &Volume<u32>, solid: Option<&Volume<f32>>, grain: u32, at: [usize; 3]) -> f32 {
    let [nx, ny, _] = labels.shape;
    let index = at[0] + nx * (at[1] + ny * at[2]);
    let label = labels.values[index];
    let Some(solid) = solid else { return f32::from(u8::from(label == grain)) };
    let fraction = solid.values[index].clamp(0.0, 1.0);
    if label == grain {
        return fraction;
    }
    if label != 0 || fraction == 0.0 {
        return 0.0;
    }
    let (mut of_grain, mut all) = (0, 0);
    let range = |k: usize| at[k].saturating_sub(1)..(at[k] + 2).min(labels.shape[k]);
    for z in range(2) {
        for y in range(1) {
            let row = nx * (y + ny * z);
            for &other in &labels.values[row..][range(0)] {
                of_grain += u32::from(other == grain);
                all += u32::from(other > 0);
            }
        }
    }
    if of_grain == 0 { 0.0 } else { fraction * of_grain as f32 / all as f32 }
}
