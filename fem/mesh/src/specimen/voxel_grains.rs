//! Labelled voxels as a field of grains.

use rayon::prelude::*;

use super::GrainField;
use super::signed_distance::Patch;
use crate::mesh::Surface;
use crate::mesh::isosurface::isosurface;
use fem_image::{Cylinder, Volume};

/// Voxels around a grain for which its distance is kept.
const MARGIN: usize = 3;

/// Grains of a segmented image: a [`GrainField`] with distances good to a fraction of a voxel.
///
/// A grain takes the solid fraction of its own voxels and of those of the matrix that touch it
/// (shared among the grains that they touch). Distances are kept in a box around each grain; they are zero on
/// a surface that encloses its volume.
#[derive(Debug)]
pub struct VoxelGrains<'a> {
    labels: &'a Volume<u32>,
    /// Where the specimen is in the image.
    cylinder: Cylinder,
    distances: Vec<Patch>,
    volumes_mm3: Vec<f64>,
    /// Volume of each grain, also of what lies outside the cylinder.
    whole_mm3: Vec<f64>,
    /// How much of each grain is in the cylinder.
    inside: Vec<f64>,
    phases: Vec<String>,
    /// Index into `phases` for each grain.
    phase_of: Vec<usize>,
}

impl<'a> VoxelGrains<'a> {
    /// Of labels (0 the matrix, grains from 1) and the share of each voxel that is solid, in [0, 1];
    /// without it, labelled voxels are wholly solid. The cylinder tells where the specimen is: the
    /// centre of its bottom becomes the origin, and grains count as far as they are in it.
    ///
    /// # Panics
    /// If the volumes have different shapes or values are missing.
    pub fn new(
        labels: &'a Volume<u32>,
        solid: Option<&Volume<f32>>,
        cylinder: &Cylinder,
    ) -> VoxelGrains<'a> {
        let count: usize = labels.shape.iter().product();
        assert_eq!(labels.values.len(), count, "one label per voxel");
        if let Some(solid) = solid {
            assert_eq!(solid.shape, labels.shape, "labels and solid fractions of the same voxels");
            assert_eq!(solid.values.len(), count, "one solid fraction per voxel");
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
            let places = patch.voxels();
            for (value, place) in patch.values.iter_mut().zip(places) {
                let at = std::array::from_fn(|k| place[k] + low[k]);
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

    /// The same grains, of several phases: the names of the phases, and number and phase (an index into the names)
    /// of grains. Grains without a number in the list are of the first phase.
    ///
    /// # Panics
    /// If there is no phase, or a grain is of a phase that has no name.
    pub fn with_phases(
        mut self,
        names: Vec<String>,
        phase_of: impl IntoIterator<Item = (u32, usize)>,
    ) -> Self {
        assert!(!names.is_empty(), "grains are of a phase");
        for (grain, phase) in phase_of {
            assert!(phase < names.len(), "grain {grain} is of phase {phase} of {}", names.len());
            if let Some(own) = self.phase_of.get_mut((grain as usize).wrapping_sub(1)) {
                *own = phase;
            }
        }
        self.phases = names;
        self
    }

    /// The same grains, with volumes (mm³) that are known better than by adding up fractions between 0
    /// and 1, such as those of [`Region`](fem_image::Region): blur carries some of a grain beyond the voxels
    /// that touch it, and noise that is cut off at 0 and 1 does not cancel. Of a grain that the cylinder
    /// cuts the same part counts as before; grains without a number in the list keep their volume. Distances
    /// are those to a surface that encloses it.
    pub fn with_volumes(mut self, volumes_mm3: impl IntoIterator<Item = (u32, f64)>) -> Self {
        for (grain, volume) in volumes_mm3 {
            let place = (grain as usize).wrapping_sub(1);
            if let Some(own) = self.volumes_mm3.get_mut(place) {
                *own = volume.max(0.0) * self.inside[place];
                self.whole_mm3[place] = volume.max(0.0);
                self.distances[place].enclose(volume / self.labels.voxel_mm.powi(3));
            }
        }
        self
    }

    /// The closed surface of a grain (mm), in the coordinates of the specimen. All of the grain is enclosed, also what lies
    /// outside the cylinder, with the volume that is known of it. Nothing for a number without voxels.
    pub fn surface(&self, grain: u32) -> Option<Surface> {
        let place = (grain as usize).checked_sub(1)?;
        let patch = self.distances.get(place)?;
        let size = patch.size;
        let index = |at: [usize; 3]| at[0] + size[0] * (at[1] + size[1] * at[2]);
        let mut surface = isosurface(size, &|at| f64::from(patch.values[index(at)]));
        if surface.triangles.is_empty() {
            // of fewer voxels than the smoothing of distances leaves
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
        let ratio = self.whole_mm3[place] / surface.volume();
        match ratio.is_finite() && ratio > 0.0 {
            true => Some(surface.scaled(ratio.cbrt())),
            false => (!surface.triangles.is_empty()).then_some(surface),
        }
    }

    /// In voxels from the corner of the first.
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

    fn near(&self, x: [f64; 3], reach: f64, found: &mut Vec<u32>) {
        // the labels themselves are the index: a grain nearer than this has a voxel there
        let at = self.voxels(x);
        let reach = reach / self.labels.voxel_mm + 1.0;
        let first = found.len();
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
                        if !found[first..].contains(&label) {
                            found.push(label);
                        }
                    }
                }
            }
        }
        found[first..].sort_unstable();
    }

    fn resolution_mm(&self) -> f64 {
        0.5 * self.labels.voxel_mm
    }
}

/// First and last voxel of each label, from 1.
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

/// How much of a voxel belongs to a grain.
fn share(labels: &Volume<u32>, solid: Option<&Volume<f32>>, grain: u32, at: [usize; 3]) -> f32 {
    let [nx, ny, _] = labels.shape;
    let place = at[0] + nx * (at[1] + ny * at[2]);
    let label = labels.values[place];
    let Some(solid) = solid else { return f32::from(u8::from(label == grain)) };
    let fraction = solid.values[place].clamp(0.0, 1.0);
    if label == grain {
        return fraction;
    }
    if label != 0 || fraction == 0.0 {
        return 0.0;
    }
    let (mut own, mut all) = (0, 0);
    let range = |k: usize| at[k].saturating_sub(1)..(at[k] + 2).min(labels.shape[k]);
    for z in range(2) {
        for y in range(1) {
            let row = nx * (y + ny * z);
            for &other in &labels.values[row..][range(0)] {
                own += u32::from(other == grain);
                all += u32::from(other > 0);
            }
        }
    }
    if own == 0 { 0.0 } else { fraction * own as f32 / all as f32 }
}
