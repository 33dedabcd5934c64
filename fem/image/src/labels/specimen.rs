//! Conversion of labels to a specimen with grains.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::corners::empty_corners;
use super::parts::numbered_parts;
use super::rules::{LabelRules, MATRIX, Role, VOID};
use crate::grains::regions::measure;
use crate::grains::statistics::SpecimenStatistics;
use crate::locate::beyond::beyond_image;
use crate::locate::fit::{Fit, fit};
use crate::locate::surroundings::{checked_filling, filling};
use crate::volume::cylinder::Cylinder;
use crate::{ImageError, Region, SpecimenForm, Volume};

/// A specimen as labelled by the user.
#[derive(Clone, Debug)]
pub struct LabelledSpecimen {
    /// Number of the grain to which a voxel belongs, counted from 1; 0 in the matrix and outside the specimen. Voids
    /// are grains of the phase `void`.
    pub labels: Volume<u32>,
    /// Label of each grain in the user's image.
    pub label_of: Vec<i64>,
    /// Names of the phases of grains.
    pub phases: Vec<String>,
    /// Phase of each grain, as an index into `phases`.
    pub phase_of: Vec<usize>,
    /// The grains, in the order of their numbers; their volumes are sums of whole voxels.
    pub regions: Vec<Region>,
    /// Cylinder of the specimen; for a block the largest upright cylinder in the block.
    pub cylinder: Cylinder,
    /// Whether the image shows a part of a specimen, without background around it.
    pub block: bool,
    /// Statistics of the whole specimen; voids do not count as grains.
    pub statistics: SpecimenStatistics,
    /// Grey value of each voxel for pictures: 0 outside the specimen, 0.5 in voids, 1 in the matrix, 2 and more in the
    /// phases of grains.
    pub shades: Volume<f32>,
    /// Messages about doubtful results, which the user should check.
    pub warnings: Vec<String>,
}

/// Label that voxels outside the region get if the user gives no label of the background.
const OUTSIDE_REGION: i64 = i64::MIN;
/// Grey value of the specimen's voxels in the image to which a cylinder is fitted.
const SPECIMEN: u16 = 1000;
/// Grey level of the wall in the image to which a cylinder is fitted: half the grey value of the specimen.
const EDGE: f64 = 500.0;
/// Background voxels within this distance from the wall (voxels) do not count as background in the specimen.
const WALL: f64 = 1.5;
/// Share of background in the specimen above which a warning is added.
const MOST_BACKGROUND: f64 = 0.002;

impl LabelledSpecimen {
    /// Returns the volume fraction of a phase in the specimen, from whole voxels.
    pub fn fraction_of(&self, phase: usize) -> f64 {
        let of_phase = self.regions.iter().zip(&self.phase_of).filter(|(_, p)| **p == phase);
        of_phase.map(|(region, _)| region.volume_mm3).sum::<f64>() / self.statistics.volume_mm3
    }
}

impl LabelRules {
    /// Finds the specimen and its grains in an image of labels. `progress` is called with the name of each step when
    /// the step begins.
    ///
    /// Grains are numbered from 1, ordered by label and then by their first voxel.
    ///
    /// # Errors
    /// [`ImageError`]: rules that contradict each other, labels without a phase, no grains, or no cylinder although one
    /// is required.
    pub fn run(
        &self,
        image: &Volume<i64>,
        progress: &mut dyn FnMut(&str),
    ) -> Result<LabelledSpecimen, ImageError> {
        self.check()?;
        image.check()?;
        self.region.check_in(image)?;
        let background = self.background.unwrap_or(OUTSIDE_REGION);
        if let Some(cut) = self.region.with_outside(image, background) {
            let rules = LabelRules { background: Some(background), ..self.clone() };
            return rules.run_cut(&cut, progress);
        }
        self.run_cut(image, progress)
    }

    /// Finds specimen and grains like [`run`](Self::run), in an image whose voxels outside the region have the label of
    /// the background.
    fn run_cut(
        &self,
        image: &Volume<i64>,
        progress: &mut dyn FnMut(&str),
    ) -> Result<LabelledSpecimen, ImageError> {
        progress("labels");
        let roles = self.roles(&counts(&image.values))?;
        let number_of: BTreeMap<i64, u32> =
            (0..).zip(&roles).map(|(n, (&label, _))| (label, n)).collect();
        let of_number: Vec<(i64, Role)> = roles.into_iter().collect();
        let numbers: Vec<u32> = image.values.par_iter().map(|label| number_of[label]).collect();
        let role = |number: u32| of_number[number as usize].1;

        progress("specimen");
        let mut warnings = self.absent_phases(&of_number);
        let outside: Vec<bool> = of_number.iter().map(|(_, role)| *role == Role::Outside).collect();
        let fitted = self.locate(image, &numbers, &outside, &mut warnings)?;
        let inside = match &fitted {
            Some(fit) => fit.inside(image.shape, 0.0),
            None => vec![1; image.values.len()],
        };

        progress("grains");
        // the value 0 marks voxels outside grains
        let values: Vec<u32> = numbers
            .par_iter()
            .map(|&number| if let Role::Grain { .. } = role(number) { number + 1 } else { 0 })
            .collect();
        let is_one = |value: u32| matches!(role(value - 1), Role::Grain { is_one: true, .. });
        let (mut labels, part_values) = numbered_parts(image.shape, &values, is_one);
        drop(values);
        let order = by_value(&part_values);
        labels.par_iter_mut().filter(|label| **label > 0).for_each(|label| {
            *label = order.number_of[*label as usize - 1];
        });
        let grains: Vec<(i64, Role)> =
            order.parts.iter().map(|&part| of_number[part_values[part] as usize - 1]).collect();
        if grains.is_empty() {
            return Err(ImageError::Labels {
                what: "no voxel belongs to a grain".into(),
                help: "check that the file contains labels, and which labels label_phases and background list",
            });
        }
        let mut volumes = vec![0.0_f64; grains.len()];
        for &label in labels.iter().filter(|label| **label > 0) {
            volumes[label as usize - 1] += 1.0;
        }
        let labels = image.with(labels);
        let regions = measure(&labels, &inside, &volumes);
        let phases = self.grain_phases();
        let phase_of: Vec<usize> = grains
            .iter()
            .map(|(_, role)| if let Role::Grain { phase, .. } = role { *phase } else { 0 })
            .collect();
        warnings.extend(self.small_grains(&regions, &phase_of, &phases));
        if self.background.is_none() && fitted.is_none() && self.specimen == SpecimenForm::Auto {
            warnings.extend(empty_corners(&labels, regions.len()));
        }

        let voxel_mm = image.voxel_mm;
        let (cylinder, volume_mm3) = match &fitted {
            Some(fit) => (fit.in_mm(voxel_mm), fit.in_mm(voxel_mm).volume_mm3()),
            None => (Cylinder::within(image), image.size_mm().iter().product()),
        };
        // voids do not count as neighbours of grains
        let is_solid = |grain: u32| phases[phase_of[grain as usize - 1]] != VOID;
        let mut solid = regions.clone();
        solid.retain(|region| is_solid(region.id));
        solid.iter_mut().for_each(|region| region.neighbours.retain(|&grain| is_solid(grain)));
        let shade = |&number: &u32| match role(number) {
            Role::Outside => 0.0,
            Role::Matrix => 1.0,
            Role::Grain { phase, .. } if phases[phase] == VOID => 0.5,
            Role::Grain { phase, .. } => 2.0 + phase as f32,
        };
        let shades = image.with(numbers.par_iter().map(shade).collect());
        Ok(LabelledSpecimen {
            label_of: grains.iter().map(|(label, _)| *label).collect(),
            statistics: SpecimenStatistics::of(&solid, voxel_mm, volume_mm3),
            labels,
            phases,
            phase_of,
            regions,
            cylinder,
            block: fitted.is_none(),
            shades,
            warnings,
        })
    }

    /// Fits the cylinder of the specimen; returns `None` for a block.
    fn locate(
        &self,
        image: &Volume<i64>,
        numbers: &[u32],
        outside: &[bool],
        warnings: &mut Vec<String>,
    ) -> Result<Option<Fit>, ImageError> {
        let is_outside = |number: u32| outside[number as usize];
        let has_background = outside.contains(&true);
        if let (Some(label), false) = (self.background, has_background) {
            let what = format!("no voxel has the label {label}, which is given as the background");
            if self.specimen == SpecimenForm::Cylinder {
                let help = "correct background, or set specimen = \"block\"";
                return Err(ImageError::Labels { what, help });
            }
            warnings.push(format!("the image is treated as a block: {what}"));
        }
        let fitted = match self.specimen {
            SpecimenForm::Block => None,
            SpecimenForm::Auto if !has_background => None,
            SpecimenForm::Auto | SpecimenForm::Cylinder => {
                let grey = |&number: &u32| if is_outside(number) { 0 } else { SPECIMEN };
                let grey = image.with(numbers.par_iter().map(grey).collect());
                let fitted = match self.region.fit() {
                    Some(fit) => fit,
                    None => self.region.overriding(fit(&grey, EDGE, self.follow_lean)?),
                };
                warnings.extend(beyond_image(&fitted, image.shape, self.region.slices.is_some()));
                if let Err(error) = checked_filling(filling(&grey, &fitted, EDGE)) {
                    match self.specimen {
                        SpecimenForm::Cylinder => warnings.push(error.to_string()),
                        _ => return Err(error),
                    }
                }
                Some(fitted)
            }
        };
        if has_background {
            let within = match &fitted {
                Some(fit) => fit.inside(image.shape, WALL),
                None => vec![1; numbers.len()],
            };
            let all = within.par_iter().filter(|voxel| **voxel == 1).count();
            let pairs = within.par_iter().zip(numbers);
            let background = pairs.filter(|(w, n)| **w == 1 && is_outside(**n)).count();
            let share = background as f64 / all.max(1) as f64;
            if share > MOST_BACKGROUND {
                warnings.push(format!(
                    "{:.1} % of the voxels in the specimen have the label of the background and count as matrix: give \
                     pores a separate label with the phase \"void\"",
                    100.0 * share
                ));
            }
        }
        Ok(fitted)
    }

    /// Returns warnings about phases that have no voxels in the image.
    fn absent_phases(&self, roles: &[(i64, Role)]) -> Vec<String> {
        let is_present = |name: &str| {
            let names = self.grain_phases();
            roles.iter().any(|(_, role)| match role {
                Role::Grain { phase, .. } => names[*phase] == name,
                Role::Matrix => name == MATRIX,
                Role::Outside => false,
            })
        };
        let mut names: Vec<&str> = self.phases.iter().map(|phase| phase.name.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        names.retain(|name| !is_present(name));
        let absent = |name| {
            format!("the image has no voxel of the phase {name}: check its labels in label_phases")
        };
        names.into_iter().map(absent).collect()
    }

    /// Returns a warning about grains that are so small that they may be errors of the labelling.
    fn small_grains(
        &self,
        regions: &[Region],
        phase_of: &[usize],
        phases: &[String],
    ) -> Option<String> {
        let solid = || regions.iter().zip(phase_of).filter(|(_, phase)| phases[**phase] != VOID);
        let small = solid().filter(|(region, _)| region.voxels < self.small_grain_voxels);
        let (count, all) = (small.clone().count(), solid().count());
        (count > 0).then(|| {
            let voxels = small.map(|(region, _)| region.voxels).sum::<usize>() as f64;
            let total = solid().map(|(region, _)| region.voxels).sum::<usize>() as f64;
            format!(
                "statistics of grains include specks: {count} of {all} grains have fewer than {} voxels (min_grain_voxels; \
                 {:.2} % of the grains' volume) and stay in the mesh; if these grains are noise, remove them from the image",
                self.small_grain_voxels,
                100.0 * voxels / total
            )
        })
    }
}

/// Returns the number of voxels of each label.
fn counts(values: &[i64]) -> BTreeMap<i64, usize> {
    let add = |mut counts: BTreeMap<i64, usize>, portion: &[i64]| {
        for run in portion.chunk_by(|a, b| a == b) {
            *counts.entry(run[0]).or_default() += run.len();
        }
        counts
    };
    let sum = |mut a: BTreeMap<i64, usize>, b: BTreeMap<i64, usize>| {
        b.into_iter().for_each(|(label, count)| *a.entry(label).or_default() += count);
        a
    };
    values.par_chunks(1 << 20).fold(BTreeMap::new, add).reduce(BTreeMap::new, sum)
}

/// The order of parts that are sorted by their values; parts with equal values keep their order.
struct Order {
    /// Indices of the parts in the sorted order.
    parts: Vec<usize>,
    /// New number of each part, counted from 1.
    number_of: Vec<u32>,
}

/// Sorts parts by their values.
fn by_value(part_values: &[u32]) -> Order {
    let mut parts: Vec<usize> = (0..part_values.len()).collect();
    parts.sort_by_key(|&part| part_values[part]);
    let mut number_of = vec![0; parts.len()];
    for (number, &part) in (1..).zip(&parts) {
        number_of[part] = number;
    }
    Order { parts, number_of }
}
