//! The grains that the stage `segment` has written to the results folder.

use std::collections::BTreeSet;

use fem::{Cylinder, LabelRules, Volume, tiff};

use super::build::{Measured, Scanned, Source};
use super::images::segmented_file;
use super::segment::WHOLE;
use super::specimen_grains::GrainPhases;
use crate::pipeline::freshness::finished_in;
use crate::pipeline::inputs::Inputs;
use crate::results_folder::error::WorkflowError;
use crate::table::{CsvTable, TableRow};

/// Labelled voxels, and the phase and measured volume of each grain.
pub(crate) struct SegmentedGrains {
    pub(crate) labels: Volume<u32>,
    /// Grain fraction of each voxel, 0 to 1, if measured from grey values.
    solid: Option<Volume<f32>>,
    /// Number and volume (mm³) of each grain, if measured from grey values; otherwise empty.
    volumes_mm3: Vec<(u32, f64)>,
    pub(crate) phases: GrainPhases,
    /// Position, size and tilt of the specimen in its image.
    pub(crate) cylinder: Cylinder,
}

impl SegmentedGrains {
    /// Reads the segmentation of an image.
    ///
    /// # Errors
    /// Fails if a file is missing or belongs to another case, or if edited labels have a grain without a phase.
    pub(crate) fn read(
        inputs: &Inputs<'_>,
        image: usize,
        scanned: &Scanned,
    ) -> Result<Self, WorkflowError> {
        let name = segmented_file(image, "labels.tif");
        let cylinder = cylinder(inputs, image)?;
        let voxel_mm = Some(quantity(inputs, image, "voxel_mm")?);
        let labels = tiff::read_labels(&inputs.file(&name)?, voxel_mm)?;
        let phases = match &scanned.source {
            Source::Labels { rules, .. } => phases(inputs, image, rules, &labels)?,
            Source::Stack { .. } | Source::Scan(..) => GrainPhases::default(),
        };
        let (solid, volumes_mm3) = match &scanned.source {
            Source::Labels { .. } => (None, Vec::new()),
            // the labels were edited, but the measurements from grey values belong to the original grains
            _ if is_edited(inputs, &name) => (None, Vec::new()),
            _ => {
                let solid = solid(inputs, image, voxel_mm, labels.shape)?;
                (Some(solid), volumes(inputs, image)?)
            }
        };
        Ok(Self { labels, solid, volumes_mm3, phases, cylinder })
    }

    /// Returns the measurements from grey values; `None` for edited labels and for labels of the user.
    pub(crate) fn measured(&self) -> Option<Measured<'_>> {
        let solid = self.solid.as_ref()?;
        Some(Measured { solid, volumes_mm3: self.volumes_mm3.clone() })
    }
}

/// Phase of each grain, as the segmentation recorded it in `grains.csv`.
///
/// # Errors
/// With several phases, fails if edited labels contain a grain without a row in `grains.csv`.
fn phases(
    inputs: &Inputs<'_>,
    image: usize,
    rules: &LabelRules,
    labels: &Volume<u32>,
) -> Result<GrainPhases, WorkflowError> {
    let names = rules.grain_phases();
    if names.len() == 1 {
        return Ok(GrainPhases { names, of_grains: Vec::new() });
    }
    let path = inputs.file(&segmented_file(image, "grains.csv"))?;
    let table = CsvTable::read(&path, &["id", "phase"])?;
    let mut of_grains = Vec::new();
    for row in table.rows() {
        let phase = names.iter().position(|name| name == row.text("phase"));
        let Some(phase) = phase else {
            return Err(WorkflowError::OtherCase { path: path.clone(), stage: "segment" });
        };
        of_grains.push((row.number("id")? as u32, phase));
    }
    let listed: BTreeSet<u32> = of_grains.iter().map(|(grain, _)| *grain).collect();
    let unknown = labels.values.iter().find(|label| **label > 0 && !listed.contains(label));
    if let Some(label) = unknown {
        let file = segmented_file(image, "labels.tif");
        let message = format!(
            "{file} was edited and has the grain {label}, of which grains.csv has no phase: give new grains in the \
             image that specimen.image.labels names"
        );
        return Err(WorkflowError::Unusable(message));
    }
    Ok(GrainPhases { names, of_grains })
}

/// Whether the user has edited the labels file since the stage `segment` wrote it.
fn is_edited(inputs: &Inputs<'_>, labels: &str) -> bool {
    let records = finished_in(inputs.folder());
    let segmented = records.get("segment").filter(|record| record.has_written(labels));
    segmented.is_some_and(|record| !record.wrote(labels, inputs.folder()))
}

/// Reads the grain fraction of each voxel, 0 to 1.
fn solid(
    inputs: &Inputs<'_>,
    image: usize,
    voxel_mm: Option<f64>,
    shape: [usize; 3],
) -> Result<Volume<f32>, WorkflowError> {
    let path = inputs.file(&segmented_file(image, "solid.tif"))?;
    let mut solid = tiff::read(&path, voxel_mm)?;
    solid.values.iter_mut().for_each(|value| *value /= WHOLE);
    if shape == solid.shape {
        return Ok(solid);
    }
    Err(WorkflowError::OtherCase { path, stage: "segment" })
}

/// Number and volume (mm³) of each grain, measured from grey values.
fn volumes(inputs: &Inputs<'_>, image: usize) -> Result<Vec<(u32, f64)>, WorkflowError> {
    let path = inputs.file(&segmented_file(image, "grains.csv"))?;
    let table = CsvTable::read(&path, &["id", "volume_mm3"])?;
    let grain = |row: TableRow<'_>| Ok((row.number("id")? as u32, row.number("volume_mm3")?));
    table.rows().map(grain).collect()
}

/// Position, size and tilt of the specimen in its image.
fn cylinder(inputs: &Inputs<'_>, image: usize) -> Result<Cylinder, WorkflowError> {
    let number = |name: &str| quantity(inputs, image, name);
    Ok(Cylinder {
        centre_mm: [number("centre_x_mm")?, number("centre_y_mm")?],
        radius_mm: number("radius_mm")?,
        bottom_mm: number("bottom_mm")?,
        top_mm: number("top_mm")?,
        lean: [number("lean_x")?, number("lean_y")?],
    })
}

fn quantity(inputs: &Inputs<'_>, image: usize, name: &str) -> Result<f64, WorkflowError> {
    let path = inputs.file(&segmented_file(image, "segment.csv"))?;
    let table = CsvTable::read(&path, &["quantity", "value"])?;
    Ok(table.named("quantity", name)?.number("value")?)
}
