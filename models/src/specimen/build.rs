//! Builds the mesh of the specimen of a case from a packing, from an image, or from a mesh file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use fem::{
    Cylinder, GrainList, ImageError, ImportedSurfaces, LabelRules, MeshError, MeshReport, Meshed,
    Meshing, Packing, ReadOptions, Reading, Scanner, Segmentation, StackHeader, SurfaceImport,
    SurfaceImportError, TetMesh, Volume, VoxelGrains, gmsh, read_image, read_label_values,
};

use super::block::block_mesh;
use super::specimen_grains::{GrainPhases, SpecimenGrains};
use crate::case::{CaseFile, SpecimenGeometry};
use crate::progress::say;
use crate::results_folder::error::WorkflowError;

/// Origin of grey values or labels.
#[derive(Clone)]
pub(crate) enum Source {
    /// Grey values in a file or a folder.
    Stack { path: PathBuf, options: ReadOptions },
    /// Labels in a file or a folder, and the rules for their interpretation.
    Labels { path: PathBuf, options: ReadOptions, rules: LabelRules },
    /// A virtual scan of a packing in a cylinder of this radius and height (mm).
    Scan(Scanner, Packing, [f64; 2]),
}

impl Source {
    /// Image in a file or a folder: of labels if `labels` contains rules for them, otherwise of grey values.
    pub(crate) fn in_file(path: PathBuf, options: ReadOptions, labels: Option<LabelRules>) -> Self {
        match labels {
            Some(rules) => Self::Labels { path, options, rules },
            None => Self::Stack { path, options },
        }
    }

    /// Path of the file or folder; `None` for a virtual scan.
    pub(crate) fn path(&self) -> Option<&Path> {
        match self {
            Self::Stack { path, .. } | Self::Labels { path, .. } => Some(path),
            Self::Scan(..) => None,
        }
    }
}

/// An image to be segmented.
pub(crate) struct Scanned {
    pub(crate) source: Source,
    pub(crate) segmentation: Segmentation,
    /// Radius and height in mm, each `None` if the case does not specify it.
    pub(crate) size_mm: [Option<f64>; 2],
}

impl Scanned {
    /// Returns the image and the mesher settings of this geometry, if its grains come from an image.
    pub(crate) fn of(geometry: &SpecimenGeometry) -> Option<(Self, Meshing)> {
        match geometry {
            SpecimenGeometry::Image {
                stack,
                labels,
                further: _,
                options,
                segmentation,
                radius_mm,
                height_mm,
                meshing,
            } => {
                let scanned = Self {
                    source: Source::in_file(stack.clone(), options.clone(), labels.clone()),
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

    /// Segments the image. Returns the grey values and the grains. For an image of labels, the grey value of a voxel is
    /// a brightness that is assigned to its phase. `look` is called with the image before the segmentation, and
    /// `progress` with the name of each step.
    pub(crate) fn find_grains(
        &self,
        case: &Path,
        look: &mut dyn FnMut(&Image) -> Result<(), WorkflowError>,
        progress: &mut dyn FnMut(&str),
    ) -> Result<(Volume<f32>, SpecimenGrains), WorkflowError> {
        let failed = |source| WorkflowError::Segmentation { file: case.to_owned(), source };
        let image = self.image(case)?;
        look(&image)?;
        let (grey, mut grains) = match (image, &self.source) {
            (Image::Labels(reading), Source::Labels { rules, .. }) => {
                let mut grains = rules.run(&reading.volume, progress).map_err(failed)?;
                let nothing = Volume { shape: [0; 3], voxel_mm: 1.0, values: Vec::new() };
                let shades = std::mem::replace(&mut grains.shades, nothing);
                (shades, SpecimenGrains::Labels(grains))
            }
            (image, _) => {
                let grey = image.into_grey()?;
                let mask = self.mask(grey.voxel_mm)?;
                let grains = self.segmentation.run_masked(&grey, mask.as_ref(), progress);
                let grains = grains.map_err(failed)?;
                (grey, SpecimenGrains::Grey(grains))
            }
        };
        if self.source.path().is_some() {
            checked_size(grains.cylinder(), self.size_mm, grey.voxel_mm).map_err(failed)?;
        }
        resize(grains.cylinder_mut(), self.size_mm);
        Ok((grey, grains))
    }

    /// Reads the mask of `[specimen.image.region]`. The mask gets the voxel size of the image; the tags of its file are
    /// ignored.
    fn mask(&self, image_voxel_mm: f64) -> Result<Option<Volume<f32>>, WorkflowError> {
        let Some(path) = &self.segmentation.region.mask else { return Ok(None) };
        let bin = match &self.source {
            Source::Stack { options, .. } => options.bin,
            Source::Labels { .. } | Source::Scan(..) => 1,
        };
        let voxel_mm = Some(image_voxel_mm / bin as f64);
        let options = ReadOptions { voxel_mm, bin, dataset: None };
        Ok(Some(read_image(path, &options)?.volume))
    }

    /// Reads the grey values.
    ///
    /// # Errors
    /// If the image cannot be read, or is an image of labels.
    pub(crate) fn grey(&self, case: &Path) -> Result<Volume<f32>, WorkflowError> {
        self.image(case)?.into_grey()
    }

    fn image(&self, case: &Path) -> Result<Image, WorkflowError> {
        match &self.source {
            Source::Stack { path, options } => Ok(Image::Stack(read_image(path, options)?)),
            Source::Labels { path, options, .. } => {
                Ok(Image::Labels(read_label_values(path, options)?))
            }
            Source::Scan(scanner, packing, [radius_mm, height_mm]) => {
                let grains = packed(case, Some(packing), *radius_mm, *height_mm)?;
                let scan = scanner.scan(*radius_mm, *height_mm, &grains);
                let scan = scan.map_err(|source| {
                    let file = case.to_owned();
                    WorkflowError::Scan { file, source }
                })?;
                Ok(Image::Scan(scan.grey))
            }
        }
    }
}

/// Image before the segmentation.
pub(crate) enum Image {
    /// Grey values from files.
    Stack(Reading<f32>),
    /// Labels from files.
    Labels(Reading<i64>),
    /// Grey values of a virtual scan.
    Scan(Volume<f32>),
}

impl Image {
    /// Returns the description of the image files; `None` for a virtual scan.
    pub(crate) fn header(&self) -> Option<&StackHeader> {
        match self {
            Self::Stack(reading) => Some(&reading.header),
            Self::Labels(reading) => Some(&reading.header),
            Self::Scan(_) => None,
        }
    }

    fn into_grey(self) -> Result<Volume<f32>, WorkflowError> {
        match self {
            Self::Stack(reading) => Ok(reading.volume),
            Self::Scan(grey) => Ok(grey),
            Self::Labels(_) => {
                Err(WorkflowError::Unusable("the image holds labels and no grey values".to_owned()))
            }
        }
    }
}

/// Rejects a radius or height in mm that exceeds the specimen in the image by more than a voxel, because the part
/// outside the image would be meshed as matrix.
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

/// Sets the radius and the height (mm) of a cylinder if they are given. The centre of the cylinder does not move.
pub(crate) fn resize(cylinder: &mut Cylinder, [radius, height]: [Option<f64>; 2]) {
    cylinder.radius_mm = radius.unwrap_or(cylinder.radius_mm);
    if let Some(height) = height {
        let middle = 0.5 * (cylinder.bottom_mm + cylinder.top_mm);
        (cylinder.bottom_mm, cylinder.top_mm) = (middle - 0.5 * height, middle + 0.5 * height);
    }
}

/// Generates the grains of a packing, with their exact shapes.
pub(crate) fn packed(
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

/// Builds the mesh of a cylinder [radius, height] in mm with a packing.
pub(crate) fn packed_mesh(
    case: &Path,
    [radius_mm, height_mm]: [f64; 2],
    packing: Option<&Packing>,
    meshing: &Meshing,
) -> Result<Meshed, WorkflowError> {
    let grains = packed(case, packing, radius_mm, height_mm)?;
    let built = meshing.build(radius_mm, height_mm, &grains);
    built.map_err(|source| WorkflowError::Meshing { file: case.to_owned(), source })
}

/// Properties of labelled grains, measured from the grey values of the image.
pub(crate) struct Measured<'a> {
    /// Fraction of each voxel that is grain.
    pub(crate) solid: &'a Volume<f32>,
    /// Number and volume (mm³) of each grain.
    pub(crate) volumes_mm3: Vec<(u32, f64)>,
}

/// Builds the mesh of labelled voxels. `measured` is `None` if the user supplied or edited the labels, because
/// measurements exist only for grains that the program has segmented.
pub(crate) fn labelled_mesh(
    case: &Path,
    labels: &Volume<u32>,
    measured: Option<Measured<'_>>,
    phases: GrainPhases,
    cylinder: &Cylinder,
    meshing: &Meshing,
) -> Result<Meshed, WorkflowError> {
    let solid = measured.as_ref().map(|measured| measured.solid);
    let volumes = measured.as_ref().map(|measured| measured.volumes_mm3.clone());
    let grains = VoxelGrains::new(labels, solid, cylinder)
        .with_volumes(volumes.unwrap_or_default())
        .with_phases(phases.names, phases.of_grains);
    let built = meshing.build(cylinder.radius_mm, cylinder.height_mm(), &grains);
    built.map_err(|source| WorkflowError::Meshing { file: case.to_owned(), source })
}

/// Builds the mesh of a specimen directly from the result of its segmentation.
pub(crate) fn grains_mesh(
    case: &Path,
    grains: &SpecimenGrains,
    meshing: &Meshing,
) -> Result<Meshed, WorkflowError> {
    let volumes_mm3 = grains.volumes_mm3();
    let measured = grains.solid().map(|solid| Measured { solid, volumes_mm3 });
    labelled_mesh(case, grains.labels(), measured, grains.phases(), grains.cylinder(), meshing)
}

/// Reads a mesh file. The result includes the notes of the reader.
pub(crate) fn imported_mesh(
    file: &Path,
    regions: &BTreeMap<String, gmsh::PhysicalGroups>,
    surfaces: &BTreeMap<String, gmsh::PhysicalGroups>,
) -> Result<gmsh::Imported, WorkflowError> {
    let names = gmsh::GmshNames { regions: regions.clone(), surfaces: surfaces.clone() };
    gmsh::import(file, &names).map_err(|e| match e {
        MeshError::File { .. } | MeshError::Io { .. } => e.into(),
        // errors from the check of the mesh do not contain the path of the file
        source => WorkflowError::UnsoundMesh { path: file.to_owned(), source },
    })
}

/// Formats the notes about a mesh file, each with the name of the file.
pub(crate) fn import_notes(file: &Path, notes: &[gmsh::ImportNote]) -> Vec<String> {
    notes.iter().map(|note| format!("{}: {note}", file.display())).collect()
}

/// Reads the grains of STL files in a cylinder of the given radius and height, mm. Fails if a comparison with the
/// element size shows that the unit of the files is wrong.
pub(crate) fn imported_grains(
    case: &Path,
    import: &SurfaceImport,
    size_mm: [Option<f64>; 2],
    meshing: &Meshing,
) -> Result<ImportedSurfaces, WorkflowError> {
    let failed = |source: SurfaceImportError| {
        let file = case.to_owned();
        WorkflowError::Surfaces { file, source: Box::new(source) }
    };
    let imported = import.read(size_mm).map_err(failed)?;
    imported.check_unit(meshing.spacing_mm, import.unit_mm).map_err(failed)?;
    Ok(imported)
}

/// Meshes the grains of STL files.
pub(crate) fn surfaces_mesh(
    case: &Path,
    imported: &ImportedSurfaces,
    meshing: &Meshing,
) -> Result<Meshed, WorkflowError> {
    let grains = imported.grains().map_err(|e| WorkflowError::Unusable(e.to_string()))?;
    let [radius_mm, height_mm] = imported.size_mm();
    let built = meshing.build(radius_mm, height_mm, &grains);
    built.map_err(|source| WorkflowError::Meshing { file: case.to_owned(), source })
}

/// Builds or reads the mesh of a geometry without an image. The report of the mesher is `None` for a mesh file.
pub(crate) fn direct_mesh(
    case: &Path,
    geometry: &SpecimenGeometry,
) -> Result<(TetMesh, Option<MeshReport>), WorkflowError> {
    match geometry {
        SpecimenGeometry::Mesh { file, regions, surfaces } => {
            Ok((imported_mesh(file, regions, surfaces)?.mesh, None))
        }
        SpecimenGeometry::Cylinder { radius_mm, height_mm, grains, meshing, .. } => {
            let size = [*radius_mm, *height_mm];
            let Meshed { mesh, report } = packed_mesh(case, size, grains.as_ref(), meshing)?;
            Ok((mesh, Some(report)))
        }
        SpecimenGeometry::Block { size_mm, notch, planes_mm, meshing } => {
            let built = block_mesh(*size_mm, *notch, planes_mm, meshing.spacing_mm);
            let located = |error| format!("{}: specimen.block_mm: {error}", case.display());
            Ok((built.map_err(|error| WorkflowError::Unusable(located(error)))?, None))
        }
        SpecimenGeometry::Surfaces { import, radius_mm, height_mm, meshing } => {
            let imported = imported_grains(case, import, [*radius_mm, *height_mm], meshing)?;
            let Meshed { mesh, report } = surfaces_mesh(case, &imported, meshing)?;
            Ok((mesh, Some(report)))
        }
        SpecimenGeometry::Image { .. } => {
            Err(WorkflowError::Unusable("the image has not been segmented".to_owned()))
        }
        SpecimenGeometry::Absent => Err(WorkflowError::Unusable(format!(
            "{}: the case has no [specimen] to mesh or to simulate: its runs come from [simulator] or design.import",
            case.display()
        ))),
    }
}

/// Builds the mesh of a case for a single simulation, without intermediate files.
pub(crate) fn mesh_of(file: &CaseFile) -> Result<TetMesh, WorkflowError> {
    let geometry = file.geometry()?;
    if let Some((scanned, meshing)) = Scanned::of(&geometry) {
        let (_, grains) = scanned.find_grains(&file.path, &mut |_| Ok(()), &mut |_| ())?;
        let size = [grains.cylinder().radius_mm, grains.cylinder().height_mm()];
        file.check_spacing("specimen.spacing_mm", meshing.spacing_mm, size[0], size[1])?;
        return Ok(grains_mesh(&file.path, &grains, &meshing)?.mesh);
    }
    if let SpecimenGeometry::Mesh { file: mesh_file, regions, surfaces } = &geometry {
        let imported = imported_mesh(mesh_file, regions, surfaces)?;
        import_notes(mesh_file, &imported.notes).iter().for_each(|note| say("warning", note));
        return Ok(imported.mesh);
    }
    if let SpecimenGeometry::Surfaces { import, radius_mm, height_mm, meshing } = &geometry {
        let size = [*radius_mm, *height_mm];
        let imported = imported_grains(&file.path, import, size, meshing)?;
        let [radius_mm, height_mm] = imported.size_mm();
        file.check_spacing("specimen.spacing_mm", meshing.spacing_mm, radius_mm, height_mm)?;
        say("grains", &imported.in_words());
        imported.warnings().iter().for_each(|warning| say("warning", warning));
        return Ok(surfaces_mesh(&file.path, &imported, meshing)?.mesh);
    }
    Ok(direct_mesh(&file.path, &geometry)?.0)
}
