//! Geometry of a case: a cylinder with a packing, a block, an image of a specimen, surfaces of its grains, or a mesh file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use fem::gmsh::{PhysicalGroup, PhysicalGroups};
use fem::{
    Contrast, LabelRules, Meshing, Order, Packing, ReadOptions, Scanner, Segmentation,
    SpecimenRegion, SurfaceImport,
};

use super::{CaseFile, ImageCase, NotchCase, SpecimenCase};
use crate::error::{InputError, absence};

/// Geometry of a case.
#[derive(Clone, Debug, PartialEq)]
pub enum SpecimenGeometry {
    /// No specimen: the runs come from outside this program.
    Absent,
    /// A cylinder of matrix, with or without a packing of grains.
    Cylinder {
        /// Radius in mm.
        radius_mm: f64,
        /// Height in mm.
        height_mm: f64,
        /// Packing of grains; `None` for a cylinder without grains.
        grains: Option<Packing>,
        /// Settings of a virtual scan of the packing and of the segmentation of this scan, if the mesh is made from
        /// the scan.
        scan: Option<(Scanner, Segmentation)>,
        /// Settings of the mesher.
        meshing: Meshing,
    },
    /// A block of matrix, with or without a notch. It stands on z = 0, in the middle of x and y.
    Block {
        /// Length along x, width along y and depth along z in mm.
        size_mm: [f64; 3],
        /// Notch at the bottom; `None` for a block without a notch.
        notch: Option<NotchCase>,
        /// Coordinates along x in mm where the mesh needs nodes.
        planes_mm: Vec<f64>,
        /// Settings of the mesher, of which a block uses the spacing.
        meshing: Meshing,
    },
    /// An image of a specimen.
    Image {
        /// Complete path of a file or folder of grey values or labels.
        stack: PathBuf,
        /// Interpretation of labels; `None` for an image of grey values.
        labels: Option<LabelRules>,
        /// Complete paths of the images of further specimens.
        further: Vec<PathBuf>,
        /// Voxel size, averaging and dataset, for reading the images.
        options: ReadOptions,
        /// Settings of the segmentation.
        segmentation: Segmentation,
        /// Radius in mm; `None` for the radius found in the image.
        radius_mm: Option<f64>,
        /// Height in mm; `None` for the height found in the image.
        height_mm: Option<f64>,
        /// Settings of the mesher.
        meshing: Meshing,
    },
    /// Grains given by their surfaces in STL files.
    Surfaces {
        /// Settings of the import, with a complete path.
        import: SurfaceImport,
        /// Radius in mm; `None` for the radius of the smallest cylinder around the grains.
        radius_mm: Option<f64>,
        /// Height in mm; `None` for the height of the smallest cylinder around the grains.
        height_mm: Option<f64>,
        /// Settings of the mesher.
        meshing: Meshing,
    },
    /// A mesh in a Gmsh file.
    Mesh {
        /// Complete path of the file.
        file: PathBuf,
        /// Physical volumes of each region.
        regions: BTreeMap<String, PhysicalGroups>,
        /// Physical surfaces of each named surface.
        surfaces: BTreeMap<String, PhysicalGroups>,
    },
}

impl CaseFile {
    /// Returns the geometry of the specimen.
    ///
    /// # Errors
    /// If keys of different kinds of geometry are mixed, if required keys are missing, or if a file does not exist.
    pub fn geometry(&self) -> Result<SpecimenGeometry, InputError> {
        if !self.case.is_built_in() {
            return Ok(SpecimenGeometry::Absent);
        }
        let s = &self.case.specimen;
        if s.is_absent() {
            let help = "Add a table [specimen]; breccia init writes a case that explains every key. Runs of another \
                        program need no specimen: add [simulator] in its place.";
            return Err(self.error("specimen", "", "is missing", help));
        }
        if let Some(mesh) = &s.mesh {
            return self.mesh_file(s, mesh);
        }
        let Some(spacing_mm) = s.spacing_mm else { return Err(self.missing("spacing_mm")) };
        let meshing = Meshing {
            mode: s.grain_mode,
            elements_across: s.elements_across,
            min_dihedral_deg: s.min_dihedral_deg,
            curved: s.order == Order::Quadratic,
            ..Meshing::new(spacing_mm)
        };
        if let Some(size_mm) = s.block_mm {
            return self.block(s, size_mm, meshing);
        }
        if s.notch.is_some() {
            let help = "A block has a notch: block_mm = [length, width, depth] in place of radius_mm and height_mm.";
            return Err(self.error("specimen.notch", "", "needs specimen.block_mm", help));
        }
        if let Some(import) = &s.stl {
            return self.surfaces(s, import, meshing);
        }
        let mut image = s.image.clone().unwrap_or_default();
        let region = &mut image.segmentation.region;
        if *region != SpecimenRegion::default() && image.further_stacks.is_some() {
            let help = "A region belongs to a single image: crop the stacks instead.";
            return Err(self.beside_error("image.region", "image.further_stacks", help));
        }
        if let Some(mask) = &mut region.mask {
            *mask = self.existing("image.region.mask", mask, |path| path.exists())?;
        }
        if let Some((key, stack)) = self.image_file(&image)? {
            let extra = [("grains", s.grains.is_some()), ("scan", s.scan.is_some())];
            if let Some((extra, _)) = extra.iter().find(|(_, given)| *given) {
                let help = "The image shows the grains: remove one of the two.";
                return Err(self.beside_error(extra, key, help));
            }
            let stack = self.existing(key, stack, |path| path.exists())?;
            let further = self.further_stacks(key, &stack, image.further_stacks.as_deref())?;
            let labels = match image.labels {
                Some(_) => Some(self.label_rules(&image)?),
                None => None,
            };
            return Ok(SpecimenGeometry::Image {
                stack,
                labels,
                further,
                options: image.read_options(),
                segmentation: image.segmentation,
                radius_mm: s.radius_mm,
                height_mm: s.height_mm,
                meshing,
            });
        }
        if image.further_stacks.is_some() {
            let help = "Name the first image as stack; further_stacks names the images of further specimens.";
            return Err(self.error("specimen.image.stack", "", "is missing", help));
        }
        let scan = match (&s.scan, &s.image, &s.grains) {
            (None, None, _) => None,
            (None, Some(_), _) => {
                return Err(self.error(
                    "specimen.image.stack",
                    "",
                    "is missing",
                    "Name the file or the folder of the image, or add a table [specimen.scan] that makes one.",
                ));
            }
            (Some(_), _, None) => {
                let help = "A virtual scan shows a packing: add specimen.grains.";
                return Err(self.error("specimen.grains", "", "is missing", help));
            }
            (Some(scan), ..) => Some((*scan, image.segmentation)),
        };
        let Some(radius_mm) = s.radius_mm else { return Err(self.missing("radius_mm")) };
        let Some(height_mm) = s.height_mm else { return Err(self.missing("height_mm")) };
        let grains = s.grains.clone();
        Ok(SpecimenGeometry::Cylinder { radius_mm, height_mm, grains, scan, meshing })
    }

    /// Returns the key and the path of the image of grey values or labels, if the case has an image.
    fn image_file<'a>(
        &self,
        image: &'a ImageCase,
    ) -> Result<Option<(&'static str, &'a Path)>, InputError> {
        let Some(labels) = &image.labels else {
            let only = [
                ("label_phases", image.label_phases.is_some()),
                ("background", image.background.is_some()),
            ];
            if let Some((key, _)) = only.iter().find(|(_, given)| *given) {
                let help = "This key describes labels: name their file in specimen.image.labels, or remove the key.";
                let problem = "needs specimen.image.labels";
                return Err(self.error(&format!("specimen.image.{key}"), "", problem, help));
            }
            return Ok(image.stack.as_deref().map(|stack| ("image.stack", stack)));
        };
        if image.stack.is_some() {
            let help = "Labels take the place of grey values: remove one of the two.";
            return Err(self.beside_error("image.labels", "image.stack", help));
        }
        if image.bin != 1 {
            let problem = "is for grey values: labels have no mean";
            let help = "Remove it, or coarsen the labels in the program that made them.";
            return Err(self.error("specimen.image.bin", image.bin.to_string(), problem, help));
        }
        if let Some(key) = for_grey_values(&image.segmentation) {
            let help = "Remove it: labels are used without changes.";
            let problem = "is for grey values and cannot be combined with specimen.image.labels";
            return Err(self.error(&format!("specimen.image.{key}"), "", problem, help));
        }
        Ok(Some(("image.labels", labels)))
    }

    /// Returns the paths of the images of further specimens. All these images must differ from each other and from
    /// the image of the key `own_key`.
    fn further_stacks(
        &self,
        own_key: &str,
        first_image: &Path,
        named: Option<&[PathBuf]>,
    ) -> Result<Vec<PathBuf>, InputError> {
        let (key, Some(named)) = ("image.further_stacks", named) else { return Ok(Vec::new()) };
        let refuse = |name: &Path, problem: &str, help: &str| {
            let name = name.display().to_string();
            Err(self.error(&format!("specimen.{key}"), name, problem, help))
        };
        if named.is_empty() {
            let help = format!(
                "Name images of other specimens, or leave the key out: one image is specimen.{own_key}."
            );
            return refuse(Path::new("[]"), "names no image", &help);
        }
        let canonical = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let mut seen = vec![canonical(first_image)];
        let mut further_images = Vec::new();
        for name in named {
            let path = self.existing(key, name, |path| path.exists())?;
            if seen.contains(&canonical(&path)) {
                let help = format!(
                    "Name each image once, and not the image of specimen.{own_key}: \
                     a repeated image does not show the scatter between specimens."
                );
                return refuse(name, "is named twice", &help);
            }
            seen.push(canonical(&path));
            further_images.push(path);
        }
        Ok(further_images)
    }

    fn block(
        &self,
        s: &SpecimenCase,
        size_mm: [f64; 3],
        meshing: Meshing,
    ) -> Result<SpecimenGeometry, InputError> {
        let extra = [
            ("radius_mm", s.radius_mm.is_some()),
            ("height_mm", s.height_mm.is_some()),
            ("grains", s.grains.is_some()),
            ("scan", s.scan.is_some()),
            ("image", s.image.is_some()),
            ("stl", s.stl.is_some()),
        ];
        if let Some((key, _)) = extra.iter().find(|(_, given)| *given) {
            let help = "A block consists of matrix only: remove one of the two. For a block with grains, give a mesh file.";
            return Err(self.beside_error(key, "block_mm", help));
        }
        let kind = self.case.test.kind;
        let planes_mm = kind.map_or_else(Vec::new, |kind| kind.kind().planes_mm());
        Ok(SpecimenGeometry::Block { size_mm, notch: s.notch, planes_mm, meshing })
    }

    fn surfaces(
        &self,
        s: &SpecimenCase,
        import: &SurfaceImport,
        meshing: Meshing,
    ) -> Result<SpecimenGeometry, InputError> {
        let extra = [
            ("grains", s.grains.is_some()),
            ("scan", s.scan.is_some()),
            ("image", s.image.is_some()),
        ];
        if let Some((key, _)) = extra.iter().find(|(_, given)| *given) {
            let help = "The STL files are the grains: remove one of the two.";
            return Err(self.beside_error(key, "stl", help));
        }
        let path = self.existing("stl.surfaces", &import.surfaces, |path| path.exists())?;
        let import = SurfaceImport { surfaces: path, ..import.clone() };
        let (radius_mm, height_mm) = (s.radius_mm, s.height_mm);
        Ok(SpecimenGeometry::Surfaces { import, radius_mm, height_mm, meshing })
    }

    fn mesh_file(&self, s: &SpecimenCase, mesh: &Path) -> Result<SpecimenGeometry, InputError> {
        let extra = [
            ("radius_mm", s.radius_mm.is_some()),
            ("height_mm", s.height_mm.is_some()),
            ("spacing_mm", s.spacing_mm.is_some()),
            ("block_mm", s.block_mm.is_some()),
            ("notch", s.notch.is_some()),
            ("grains", s.grains.is_some()),
            ("scan", s.scan.is_some()),
            ("image", s.image.is_some()),
            ("stl", s.stl.is_some()),
        ];
        if let Some((key, _)) = extra.iter().find(|(_, given)| *given) {
            let help =
                "A mesh replaces the lattice, the packing and the image: remove one of the two.";
            return Err(self.beside_error(key, "mesh", help));
        }
        let file = self.existing("mesh", mesh, |path| path.is_file())?;
        if s.regions.is_empty() {
            return Err(self.error(
                "specimen.regions",
                "",
                "is missing",
                "Name the mesh's physical volumes: regions = { matrix = 1, grain = 2 }.",
            ));
        }
        let platens = self.case.conditions.is_none();
        for surface in ["bottom", "top"] {
            if platens && !s.surfaces.contains_key(surface) {
                return Err(self.error(
                    "specimen.surfaces",
                    "",
                    format!("the surface {surface} is missing"),
                    "Name the mesh's physical surfaces: surfaces = { bottom = 11, top = 12 }.",
                ));
            }
        }
        for (key, groups) in [("regions", &s.regions), ("surfaces", &s.surfaces)] {
            if let Some(name) = named_never(groups) {
                return Err(self.error(
                    &format!("specimen.{key}"),
                    "",
                    format!("{name} has no physical group"),
                    "Name the groups of the mesh file: one as 10, several as [10, 11].",
                ));
            }
            if let Some((first, second, group)) = named_twice(groups) {
                return Err(self.error(
                    &format!("specimen.{key}"),
                    "",
                    format!("{first} and {second} both are the physical group {group}"),
                    "Give each its own group of the mesh file.",
                ));
            }
        }
        let (regions, surfaces) = (s.regions.clone(), s.surfaces.clone());
        Ok(SpecimenGeometry::Mesh { file, regions, surfaces })
    }

    /// Returns the path of a file named by a key of `[specimen]`; fails if the file does not exist.
    fn existing(
        &self,
        key: &str,
        name: &Path,
        is_there: fn(&Path) -> bool,
    ) -> Result<PathBuf, InputError> {
        let path = self.beside(name);
        if is_there(&path) {
            return Ok(path);
        }
        Err(self.error(
            &format!("specimen.{key}"),
            name.display().to_string(),
            absence(&path),
            format!("The program looks for it at {}.", path.display()),
        ))
    }

    fn missing(&self, key: &str) -> InputError {
        self.error(
            &format!("specimen.{key}"),
            "",
            "is missing",
            "Give radius_mm, height_mm and spacing_mm, or block_mm and spacing_mm, or an image or STL files with spacing_mm, or a mesh.",
        )
    }

    fn beside_error(&self, key: &str, other: &str, help: &str) -> InputError {
        let problem = format!("cannot be combined with specimen.{other}");
        self.error(&format!("specimen.{key}"), "", problem, help)
    }
}

/// Returns the first key that is set although it applies to grey values only.
fn for_grey_values(given: &Segmentation) -> Option<&'static str> {
    let is_set = [
        ("region.mask", given.region.mask.is_some()),
        ("contrast", given.contrast != Contrast::default()),
        ("void_threshold", given.void_threshold.is_some()),
        ("grain_threshold", given.grain_threshold.is_some()),
    ];
    is_set.into_iter().find(|(_, is_set)| *is_set).map(|(key, _)| key)
}

/// Finds a physical group that is listed twice; returns both names (equal if one name lists the group twice) and the
/// group.
fn named_twice(
    groups: &BTreeMap<String, PhysicalGroups>,
) -> Option<(&String, &String, &PhysicalGroup)> {
    let all: Vec<(&String, &PhysicalGroup)> = groups
        .iter()
        .flat_map(|(name, groups)| groups.groups().iter().map(move |group| (name, group)))
        .collect();
    all.iter().enumerate().find_map(|(i, &(first, group))| {
        let (second, _) = all[i + 1..].iter().find(|(_, other)| *other == group)?;
        Some((first, *second, group))
    })
}

/// Returns the first name whose list of physical groups is empty.
fn named_never(groups: &BTreeMap<String, PhysicalGroups>) -> Option<&String> {
    groups.iter().find(|(_, groups)| groups.groups().is_empty()).map(|(name, _)| name)
}
