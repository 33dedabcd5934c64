//! Command `breccia surfaces`: writes the surface of each grain as an STL file.

use std::path::PathBuf;

use fem::{
    GrainField, GrainList, Separated, Surface, VOID, VoxelGrains, decimated, least_gap_mm,
    separated, stl,
};
use rayon::prelude::*;

use super::Workflow;
use super::in_place::SURFACES;
use crate::case::SpecimenGeometry;
use crate::pipeline::inputs::Inputs;
use crate::pipeline::stage::Stage;
use crate::progress::say;
use crate::results_folder::error::WorkflowError;
use crate::specimen::build::{direct_mesh, imported_grains, packed};
use crate::specimen::segmented_grains::SegmentedGrains;
use crate::specimen::{image_inputs, images};
use crate::table::to_csv;

/// Name of the command.
const COMMAND: &str = "surfaces";
/// File name of the table that lists the surfaces.
const TABLE: &str = "surfaces.csv";
/// Columns of the table.
const COLUMNS: [&str; 9] =
    ["grain", "file", "phase", "triangles", "volume_mm3", "x_mm", "y_mm", "z_mm", "factor"];

/// Processing of the grains' surfaces before they are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceOptions {
    /// Number of passes of Taubin's smoothing filter.
    pub smoothing_passes: usize,
    /// Factor by which the number of triangles is reduced.
    pub decimation: f64,
    /// Minimum distance between grains (mm), reached by shrinking grains; 0 disables shrinking.
    pub least_distance_mm: f64,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        Self { smoothing_passes: 0, decimation: 1.0, least_distance_mm: 0.0 }
    }
}

/// Surface of a grain, with the grain's number and phase.
struct GrainSurface {
    number: u32,
    phase: String,
    surface: Surface,
}

impl Workflow<'_> {
    /// Writes the surface of each grain to `surfaces/grain-NUMBER.stl`, in mm and in the coordinates of the mesh, and a
    /// table `surfaces.csv`; returns the path of the table. For an image, the grains are read from the results of the
    /// stage `segment`, which is run first if necessary. Voids are omitted.
    ///
    /// # Errors
    /// Fails if the stage `segment` fails, if a file of the user has the path of one of these files, or if a mesh file
    /// has no grains.
    pub fn surfaces(&self, options: &SurfaceOptions) -> Result<PathBuf, WorkflowError> {
        self.folder.claim_all(SURFACES, COMMAND, |_| true)?;
        let inputs = self.inputs();
        if image_inputs::scanned(&inputs)?.is_some()
            && let Some(segment) = Stage::named("segment")
        {
            self.run(segment)?;
        }
        let unworked =
            grain_surfaces(&inputs).map_err(|error| self.copies.named_by_owner(error))?;
        let count = unworked.len();
        let mut grains = worked(unworked, options);
        let surfaces = grains.iter().map(|grain| grain.surface.clone()).collect();
        let Separated { surfaces, factors } = match options.least_distance_mm > 0.0 {
            true => separated(surfaces, options.least_distance_mm).map_err(|source| {
                // errors contain positions in the list of surfaces: replace them by the numbers of the grains
                let number = |label: usize| grains[label - 1].number as usize;
                let (first, second) = (number(source.first), number(source.second));
                let source = fem::SeparateError { first, second, ..source };
                let file = self.file.path.clone();
                self.copies.named_by_owner(WorkflowError::Separation { file, source })
            })?,
            false => Separated { factors: vec![1.0; grains.len()], surfaces },
        };
        let before: f64 = grains.iter().map(|grain| grain.surface.volume()).sum();
        for (grain, surface) in grains.iter_mut().zip(surfaces) {
            grain.surface = surface;
        }
        if grains.len() < count {
            let lost = count - grains.len();
            say(
                "warning",
                &format!("{lost} of {count} grains have no surface that encloses a volume"),
            );
        }
        self.write_surfaces(&grains, &factors)?;
        let after: f64 = grains.iter().map(|grain| grain.surface.volume()).sum();
        say(COMMAND, &in_words(&grains, before, after));
        Ok(self.folder.path(TABLE))
    }

    fn write_surfaces(
        &self,
        grains: &[GrainSurface],
        factors: &[f64],
    ) -> Result<(), WorkflowError> {
        let last = grains.iter().map(|grain| grain.number).max().unwrap_or(0);
        let digits = last.to_string().len().max(3);
        let name = |grain: &GrainSurface| format!("surfaces/grain-{:0digits$}.stl", grain.number);
        let mut rows = Vec::new();
        for (grain, factor) in grains.iter().zip(factors) {
            let (file, surface) = (name(grain), &grain.surface);
            let at = |corner: u32| surface.points[corner as usize];
            let triangles: Vec<stl::Triangle> =
                surface.triangles.iter().map(|triangle| triangle.map(at)).collect();
            let title = format!("grain {}", grain.number);
            self.folder.write_with(&file, COMMAND, |path| stl::write(path, &title, &triangles))?;
            let [x, y, z] = surface.centroid().map(|x| x.to_string());
            rows.push([
                grain.number.to_string(),
                file,
                grain.phase.clone(),
                triangles.len().to_string(),
                surface.volume().to_string(),
                x,
                y,
                z,
                factor.to_string(),
            ]);
        }
        // remove files of an earlier run with more grains
        let is_kept = |file: &str| file == TABLE || rows.iter().any(|row| row[1] == file);
        self.folder.remove_leftovers(&SURFACES, is_kept)?;
        let path = self.folder.path(TABLE);
        let table = to_csv(COLUMNS, rows.iter()).map_err(|e| WorkflowError::io(&path, e))?;
        self.folder.write(TABLE, COMMAND, table.as_ref()).map(drop)
    }
}

/// Smooths and decimates the surfaces; omits surfaces that are not closed or enclose no volume.
fn worked(grains: Vec<GrainSurface>, options: &SurfaceOptions) -> Vec<GrainSurface> {
    let work = |mut grain: GrainSurface| {
        if options.smoothing_passes > 0 {
            grain.surface = grain.surface.smoothed(options.smoothing_passes);
        }
        grain.surface = decimated(&grain.surface, options.decimation);
        let is_solid = grain.surface.open_edges() == 0 && grain.surface.volume() > 0.0;
        is_solid.then_some(grain)
    };
    grains.into_par_iter().filter_map(work).collect()
}

fn in_words(grains: &[GrainSurface], before: f64, after: f64) -> String {
    let triangles: usize = grains.iter().map(|grain| grain.surface.triangles.len()).sum();
    let surfaces: Vec<Surface> = grains.iter().map(|grain| grain.surface.clone()).collect();
    let gap = match least_gap_mm(&surfaces) {
        Some((0.0, _)) => ", grains touch".to_owned(),
        Some((gap, _)) => format!(", least distance {gap:.4} mm"),
        None => String::new(),
    };
    let loss = match after < before {
        true => format!(" ({:.2} % less by shrinking)", 100.0 * (1.0 - after / before)),
        false => String::new(),
    };
    format!("{} grains, {triangles} triangles, {after:.4} mm³{loss}{gap}", grains.len())
}

/// Returns the surfaces of all grains of a case, voids excluded.
fn grain_surfaces(inputs: &Inputs<'_>) -> Result<Vec<GrainSurface>, WorkflowError> {
    let case = inputs.case_path();
    let of_one_phase = |(number, surface): (u32, Surface)| {
        let phase = "grain".to_owned();
        GrainSurface { number, phase, surface }
    };
    if let Some(scanned) = image_inputs::scanned(inputs)? {
        let segmented = SegmentedGrains::read(inputs, images::FIRST, &scanned)?;
        let measured = segmented.measured();
        let solid = measured.as_ref().map(|measured| measured.solid);
        let volumes = measured.as_ref().map(|measured| measured.volumes_mm3.clone());
        let grains = VoxelGrains::new(&segmented.labels, solid, &segmented.cylinder)
            .with_volumes(volumes.unwrap_or_default())
            .with_phases(
                segmented.phases.names.clone(),
                segmented.phases.of_grains.iter().copied(),
            );
        let names = grains.phases();
        let of_grain = |number: u32| {
            let phase = names[grains.phase_of(number)].clone();
            let surface = grains.surface(number).filter(|_| phase != VOID)?;
            Some(GrainSurface { number, phase, surface })
        };
        return Ok((1..=grains.grains() as u32).into_par_iter().filter_map(of_grain).collect());
    }
    let geometry = inputs.geometry()?;
    match &geometry {
        SpecimenGeometry::Surfaces { import, radius_mm, height_mm, meshing } => {
            let imported = imported_grains(case, import, [*radius_mm, *height_mm], meshing)?;
            Ok((1..).zip(imported.surfaces).map(of_one_phase).collect())
        }
        SpecimenGeometry::Cylinder { radius_mm, height_mm, grains, .. } => {
            let list: GrainList = packed(case, grains.as_ref(), *radius_mm, *height_mm)?;
            let grain_numbers = (1..=list.grains() as u32).into_par_iter();
            Ok(grain_numbers.map(|number| of_one_phase((number, list.surface(number)))).collect())
        }
        SpecimenGeometry::Mesh { file, .. } => {
            let mesh = direct_mesh(case, &geometry)?.0;
            let grains = stl::grains(&mesh);
            if grains.is_empty() {
                let message = format!(
                    "{} has no numbers of grains: each tetrahedron has to be in an elementary volume of its grain",
                    file.display()
                );
                return Err(WorkflowError::Unusable(message));
            }
            let surface = |(number, triangles): (u32, Vec<stl::Triangle>)| {
                of_one_phase((number, Surface::new(&triangles)))
            };
            Ok(grains.into_iter().map(surface).collect())
        }
        SpecimenGeometry::Image { .. }
        | SpecimenGeometry::Block { .. }
        | SpecimenGeometry::Absent => Ok(Vec::new()),
    }
}
