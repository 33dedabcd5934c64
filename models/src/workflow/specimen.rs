//! From a case to the mesh of its specimen: a packing, an image of one, or a mesh file.

use std::path::{Path, PathBuf};

use fem::{
    Cylinder, GrainField, GrainList, ImageError, MeshError, MeshReport, Meshed, Meshing, Packing,
    Scanner, Segmentation, Segmented, TetMesh, Volume, VoxelGrains, gmsh, tiff,
};

use super::WorkflowError;
use crate::case::{CaseFile, SpecimenGeometry};

/// Where grey values come from.
pub(super) enum Source {
    /// A file or a folder, the edge of a voxel if its tags do not say it, and how many voxels along the
    /// edge of a block are averaged.
    Stack { path: PathBuf, voxel_mm: Option<f64>, bin: usize },
    /// A virtual scan of a packing in a cylinder of this radius and height (mm).
    Scan(Scanner, Packing, [f64; 2]),
}

/// An image to be segmented.
pub(super) struct Scanned {
    pub(super) source: Source,
    pub(super) segmentation: Segmentation,
    /// Radius and height in mm, where the case gives them.
    pub(super) size_mm: [Option<f64>; 2],
}

impl Scanned {
    /// What is scanned and how it is meshed, if the grains of this geometry come from an image.
    pub(super) fn of(geometry: &SpecimenGeometry) -> Option<(Self, Meshing)> {
        match geometry {
            SpecimenGeometry::Image {
                stack,
                further: _,
                voxel_mm,
                bin,
                segmentation,
                radius_mm,
                height_mm,
                meshing,
            } => {
                let scanned = Self {
                    source: Source::Stack { path: stack.clone(), voxel_mm: *voxel_mm, bin: *bin },
                    segmentation: segmentation.clone(),
                    size_mm: [*radius_mm, *height_mm],
                };
                Some((scanned, *meshing))
            }
            SpecimenGeometry::Cylinder {
                radius_mm,
                height_mm,
                grains: Some(packing),
                scan: Some((scanner, segmentation)),
                meshing,
            } => {
                let size = [*radius_mm, *height_mm];
                let scanned = Self {
                    source: Source::Scan(*scanner, packing.clone(), size),
                    segmentation: segmentation.clone(),
                    size_mm: size.map(Some),
                };
                Some((scanned, *meshing))
            }
            _ => None,
        }
    }

    /// The grey values.
    pub(super) fn image(&self, case: &Path) -> Result<Volume<f32>, WorkflowError> {
        match &self.source {
            Source::Stack { path, voxel_mm, bin } => Ok(tiff::read_binned(path, *voxel_mm, *bin)?),
            Source::Scan(scanner, packing, [radius_mm, height_mm]) => {
                let grains = packed(case, Some(packing), *radius_mm, *height_mm)?;
                let scan = scanner.scan(*radius_mm, *height_mm, &grains);
                let scan = scan.map_err(|source| {
                    let file = case.to_owned();
                    WorkflowError::Scan { file, source }
                })?;
                Ok(scan.grey)
            }
        }
    }

    /// The grains in these grey values; `progress` is told each step.
    pub(super) fn segment(
        &self,
        case: &Path,
        grey: &Volume<f32>,
        progress: &mut dyn FnMut(&str),
    ) -> Result<Segmented, WorkflowError> {
        let refused = |source| WorkflowError::Segmentation { file: case.to_owned(), source };
        let (bin, is_stack) = match self.source {
            Source::Stack { bin, .. } => (bin, true),
            Source::Scan(..) => (1, false),
        };
        let mask = self.segmentation.region.mask.as_ref();
        // the voxels of a mask have the size of the image's, whatever its tags say
        let read = |path| tiff::read_binned(path, Some(grey.voxel_mm / bin as f64), bin);
        let mask = mask.map(|path| read(path)).transpose()?;
        let found = self.segmentation.run_masked(grey, mask.as_ref(), progress);
        let mut found = found.map_err(refused)?;
        if is_stack {
            checked_size(&found.cylinder, self.size_mm, grey.voxel_mm).map_err(refused)?;
        }
        resize(&mut found.cylinder, self.size_mm);
        Ok(found)
    }
}

/// Refuses a radius or height in mm that is more than a voxel larger than the image shows: what is outside would be
/// meshed as matrix.
fn checked_size(
    cylinder: &Cylinder,
    size_mm: [Option<f64>; 2],
    voxel_mm: f64,
) -> Result<(), ImageError> {
    let shown = [cylinder.radius_mm, cylinder.height_mm()];
    for (key, given, shown_mm) in
        [("radius_mm", size_mm[0], shown[0]), ("height_mm", size_mm[1], shown[1])]
    {
        if let Some(given_mm) = given.filter(|&given| given > shown_mm + voxel_mm) {
            return Err(ImageError::Larger { key, given_mm, shown_mm });
        }
    }
    Ok(())
}

/// Gives a cylinder the radius and height in mm that are given; the middle stays where it was found.
pub(super) fn resize(cylinder: &mut Cylinder, [radius, height]: [Option<f64>; 2]) {
    cylinder.radius_mm = radius.unwrap_or(cylinder.radius_mm);
    if let Some(height) = height {
        let middle = 0.5 * (cylinder.bottom_mm + cylinder.top_mm);
        (cylinder.bottom_mm, cylinder.top_mm) = (middle - 0.5 * height, middle + 0.5 * height);
    }
}

/// The grains of a packing, each known exactly.
fn packed(
    case: &Path,
    packing: Option<&Packing>,
    radius_mm: f64,
    height_mm: f64,
) -> Result<GrainList, WorkflowError> {
    let grains = match packing.filter(|packing| packing.fraction > 0.0) {
        Some(packing) => packing
            .fill(radius_mm, height_mm)
            .map_err(|source| WorkflowError::Packing { file: case.to_owned(), source })?,
        None => Vec::new(),
    };
    Ok(GrainList::new(grains, radius_mm, height_mm))
}

/// The mesh of a cylinder [radius, height] in mm with a packing.
pub(super) fn packed_mesh(
    case: &Path,
    [radius_mm, height_mm]: [f64; 2],
    packing: Option<&Packing>,
    meshing: &Meshing,
) -> Result<Meshed, WorkflowError> {
    let grains = packed(case, packing, radius_mm, height_mm)?;
    let built = meshing.build(radius_mm, height_mm, &grains);
    built.map_err(|source| WorkflowError::Meshing { file: case.to_owned(), source })
}

/// What the grey values of an image say of its labelled grains.
pub(super) struct Measured<'a> {
    /// The part of each voxel that is grain.
    pub(super) solid: &'a Volume<f32>,
    /// Number and volume (mm³) of each grain.
    pub(super) volumes_mm3: Vec<(u32, f64)>,
}

/// The mesh of labelled voxels, with what grey values say of the grains where these are the grains that were found.
pub(super) fn labelled_mesh(
    case: &Path,
    labels: &Volume<u32>,
    measured: Option<Measured<'_>>,
    cylinder: &Cylinder,
    meshing: &Meshing,
) -> Result<Meshed, WorkflowError> {
    let solid = measured.as_ref().map(|measured| measured.solid);
    let volumes = measured.as_ref().map(|measured| measured.volumes_mm3.clone());
    let grains =
        VoxelGrains::new(labels, solid, cylinder).with_volumes(volumes.unwrap_or_default());
    let built = meshing.build(cylinder.radius_mm, cylinder.height_mm(), &grains);
    built.map_err(|source| WorkflowError::Meshing { file: case.to_owned(), source })
}

/// Volume of the grains in the cylinder that is meshed over its volume, as the mesher counts it.
pub(super) fn grain_fraction(found: &Segmented) -> f64 {
    let Segmented { labels, solid, cylinder, regions, .. } = found;
    let volumes = regions.iter().map(|grain| (grain.id, grain.volume_mm3));
    let grains = VoxelGrains::new(labels, Some(solid), cylinder).with_volumes(volumes);
    let volumes = (1..).take(grains.grains()).map(|grain| grains.volume_mm3(grain));
    volumes.sum::<f64>() / cylinder.volume_mm3()
}

/// The mesh of a geometry that needs no image, with the mesher's report unless it is a mesh file.
pub(super) fn direct_mesh(
    case: &Path,
    geometry: &SpecimenGeometry,
) -> Result<(TetMesh, Option<MeshReport>), WorkflowError> {
    match geometry {
        SpecimenGeometry::Mesh { file, regions, surfaces } => {
            let names = gmsh::GmshNames { regions: regions.clone(), surfaces: surfaces.clone() };
            let mesh = gmsh::read(file, &names).map_err(|e| match e {
                MeshError::File { .. } | MeshError::Io { .. } => e.into(),
                // what the mesh's own check finds does not know of the file
                source => WorkflowError::UnsoundMesh { path: file.clone(), source },
            })?;
            Ok((mesh, None))
        }
        SpecimenGeometry::Cylinder { radius_mm, height_mm, grains, meshing, .. } => {
            let size = [*radius_mm, *height_mm];
            let Meshed { mesh, report } = packed_mesh(case, size, grains.as_ref(), meshing)?;
            Ok((mesh, Some(report)))
        }
        SpecimenGeometry::Image { .. } => {
            Err(WorkflowError::Unusable("the image has not been segmented".to_owned()))
        }
    }
}

/// The mesh of a case without any file in between, for a single simulation.
pub(super) fn mesh_of(file: &CaseFile) -> Result<TetMesh, WorkflowError> {
    let geometry = file.geometry()?;
    if let Some((scanned, meshing)) = Scanned::of(&geometry) {
        let grey = scanned.image(&file.path)?;
        let found = scanned.segment(&file.path, &grey, &mut |_| ())?;
        drop(grey);
        let Segmented { labels, solid, cylinder, .. } = &found;
        let size = [cylinder.radius_mm, cylinder.height_mm()];
        file.check_spacing("specimen.spacing_mm", meshing.spacing_mm, size[0], size[1])?;
        let volumes_mm3 = found.regions.iter().map(|grain| (grain.id, grain.volume_mm3)).collect();
        let measured = Some(Measured { solid, volumes_mm3 });
        return Ok(labelled_mesh(&file.path, labels, measured, cylinder, &meshing)?.mesh);
    }
    Ok(direct_mesh(&file.path, &geometry)?.0)
}
