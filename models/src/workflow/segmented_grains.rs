//! Grains as the stage `segment` has left them in the folder of the results.

use std::collections::BTreeSet;

use fem::{Cylinder, LabelRules, Volume, tiff};

use super::WorkflowError;
use super::found::GrainPhases;
use super::freshness::finished_in;
use super::images::segmented_file;
use super::inputs::Inputs;
use super::segment::WHOLE;
use super::specimen::{Measured, Scanned, Source};
use crate::table::{CsvTable, TableRow};

/// Labelled voxels with what is known of their grains.
pub(super) struct SegmentedGrains {
    pub(super) labels: Volume<u32>,
    /// The part of each voxel that is grain, where grey values say it.
    solid: Option<Volume<f32>>,
    /// Number and volume (mm³) of each grain, where grey values say it.
    volumes_mm3: Vec<(u32, f64)>,
    pub(super) phases: GrainPhases,
    /// Where the specimen stands in its image.
    pub(super) cylinder: Cylinder,
}

impl SegmentedGrains {
    /// Reads what was segmented of an image.
    ///
    /// # Errors
    /// Files that are missing or belong to another case; edited labels with a grain of which no phase is known.
    pub(super) fn read(
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
            // grey values have been measured for the grains as they were found
            _ if is_edited(inputs, &name) => (None, Vec::new()),
            _ => {
                let solid = solid(inputs, image, voxel_mm, labels.shape)?;
                (Some(solid), volumes(inputs, image)?)
            }
        };
        Ok(Self { labels, solid, volumes_mm3, phases, cylinder })
    }

    /// What grey values say of the grains.
    pub(super) fn measured(&self) -> Option<Measured<'_>> {
        let solid = self.solid.as_ref()?;
        Some(Measured { solid, volumes_mm3: self.volumes_mm3.clone() })
    }
}

/// The phase of each grain as the segmentation found them.
///
/// # Errors
/// Edited labels with a grain that has no row, where there are several phases.
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
    let known: BTreeSet<u32> = of_grains.iter().map(|(grain, _)| *grain).collect();
    let unknown = labels.values.iter().find(|label| **label > 0 && !known.contains(label));
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

/// Whether the user has edited labels.
fn is_edited(inputs: &Inputs<'_>, labels: &str) -> bool {
    let records = finished_in(inputs.folder());
    let segmented = records.get("segment").filter(|record| record.has_written(labels));
    segmented.is_some_and(|record| !record.wrote(labels, inputs.folder()))
}

/// The part of each voxel that is grain.
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

/// Number and volume (mm³) of each grain, as grey values gave them.
fn volumes(inputs: &Inputs<'_>, image: usize) -> Result<Vec<(u32, f64)>, WorkflowError> {
    let path = inputs.file(&segmented_file(image, "grains.csv"))?;
    let table = CsvTable::read(&path, &["id", "volume_mm3"])?;
    let grain = |row: TableRow<'_>| Ok((row.number("id")? as u32, row.number("volume_mm3")?));
    table.rows().map(grain).collect()
}

/// Where the specimen stands in its image.
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
