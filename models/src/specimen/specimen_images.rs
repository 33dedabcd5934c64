//! Scans of specimens: generation of scans of virtual specimens, and computation of stiffness ratios from scans.

use std::cell::Cell;
use std::path::{Path, PathBuf};

use fem::{Packing, Scanner};

use super::build::{Scanned, Source, grains_mesh};
use super::levels::Level;
use super::segment::write_16_bits;
use super::{image_inputs, images};
use crate::case::SpecimenGeometry;
use crate::experiment::{Specimen, SpecimenTable};
use crate::pipeline::run_key::RunKey;
use crate::pipeline::task::Task;
use crate::progress::Bar;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::files::SPECIMENS;
use crate::simulation::stiffness::stiffness_ratio;
use crate::virtual_specimen::VirtualSpecimen;

/// Generates the scans of virtual specimens in a cylinder [radius, height] (mm), each with independent
/// noise.
///
/// # Errors
/// Fails for a case without a scanner or without grains.
pub(crate) fn scan(
    task: &Task<'_>,
    specimens: &[VirtualSpecimen],
    packing: Option<&Packing>,
    size_mm: [f64; 2],
) -> Result<(), WorkflowError> {
    let geometry = task.inputs.geometry()?;
    let (SpecimenGeometry::Cylinder { scan: Some((scanner, segmentation)), .. }, Some(packing)) =
        (geometry, packing)
    else {
        let message = "experiments.virtual.scans = true needs specimen.grains and [specimen.scan]";
        return Err(WorkflowError::Unusable(message.to_owned()));
    };
    for specimen in specimens {
        let seed = specimen.packing_seed;
        let packing = Packing { seed, ..packing.clone() };
        let scanned = Scanned {
            source: Source::Scan(Scanner { seed, ..scanner }, packing, size_mm),
            segmentation: segmentation.clone(),
            size_mm: size_mm.map(Some),
        };
        let grey = scanned.grey(task.inputs.case_path())?;
        write_16_bits(task, &format!("experiments/scans/{}.tif", specimen.id), &grey, 1.0)?;
    }
    Ok(())
}

/// Computes the stiffness ratio of each specimen on the cheapest mesh of the case, as for the packings of runs; `None`
/// for a specimen without an image.
///
/// # Errors
/// Fails if an image cannot be read, segmented or meshed.
pub(crate) fn stiffness_ratios(
    task: &Task<'_>,
    table: &SpecimenTable,
) -> Result<Vec<Option<f64>>, WorkflowError> {
    let inputs = &task.inputs;
    let seen = table.specimens.iter().filter(|specimen| specimen.image.is_some()).count();
    if seen == 0 {
        return Ok(vec![None; table.specimens.len()]);
    }
    let (meshing, of_design, labels) = match inputs.geometry()? {
        SpecimenGeometry::Cylinder { meshing, .. } | SpecimenGeometry::Surfaces { meshing, .. } => {
            (meshing, Vec::new(), None)
        }
        SpecimenGeometry::Image { stack, labels, further, meshing, .. } => {
            let all = [stack].into_iter().chain(further).take(images::count(inputs)?);
            (meshing, all.map(|path| canonical(&path)).collect(), labels)
        }
        SpecimenGeometry::Mesh { .. }
        | SpecimenGeometry::Block { .. }
        | SpecimenGeometry::Absent => {
            return Ok(vec![None; table.specimens.len()]);
        }
    };
    let level = Level::all(inputs, &RunKey::of_simulations(inputs, &[], &[])).swap_remove(0);
    let meshing = level.meshing(&meshing);
    let image_case = image_inputs::image_settings(inputs);
    let (segmentation, options) = (&image_case.segmentation, image_case.read_options());
    let (setup, table_file) = (level.setup, task.path(SPECIMENS));
    let bar = Bar::new(task.stage(), "images of specimens");
    let images = table.specimens.iter().filter(|specimen| specimen.image.is_some()).count();
    let measured_images = Cell::new(0);
    let ratio = |specimen: &Specimen| -> Result<Option<f64>, WorkflowError> {
        let Some(image) = &specimen.image else { return Ok(None) };
        let image = table_file.with_file_name(image);
        bar.set(measured_images.get() as f64 / images as f64, &specimen.id);
        measured_images.set(measured_images.get() + 1);
        // the image is also an image of the design: use the mesh of the runs, so that run and specimen have the same
        // stiffness ratio
        let index = of_design.iter().position(|path| *path == canonical(&image));
        if let Some(index) = index.filter(|_| of_design.len() > images::FIRST) {
            let mesh = level.mesh(inputs, images::FIRST + index)?;
            return Ok(Some(stiffness_ratio(&level.setup, mesh)?));
        }
        let scanned = Scanned {
            source: Source::in_file(image.clone(), options.clone(), labels.clone()),
            segmentation: segmentation.clone(),
            size_mm: [None; 2],
        };
        // errors name this image, because image 1, which the case names in `specimen.image`, may be
        // correct
        let (grey, grains) = scanned.find_grains(&image, &mut |_| Ok(()), &mut |_| ())?;
        drop(grey);
        let mesh = grains_mesh(&image, &grains, &meshing)?.mesh;
        Ok(Some(stiffness_ratio(&setup, mesh)?))
    };
    // computed sequentially: an image may fill the memory, and its segmentation uses all processors
    table.specimens.iter().map(ratio).collect()
}

/// Canonical path of a file; different paths of the same file have the same canonical path.
fn canonical(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}
