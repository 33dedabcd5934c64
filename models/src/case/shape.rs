//! The geometry that a case describes: a lattice, or a mesh file that replaces it.

use std::collections::BTreeMap;
use std::path::PathBuf;

use fem::Packing;
use fem::gmsh::PhysicalGroup;

use super::CaseFile;
use crate::error::InputError;

/// Geometry of a case: the lattice, or the mesh file that replaces it.
#[derive(Clone, Debug, PartialEq)]
pub enum SpecimenGeometry {
    /// A cylinder on a lattice.
    Lattice {
        /// Radius in mm.
        radius_mm: f64,
        /// Height in mm.
        height_mm: f64,
        /// Edge of the hexahedra in mm.
        spacing_mm: f64,
        /// Packing, if there are grains.
        grains: Option<Packing>,
    },
    /// A Gmsh file.
    Mesh {
        /// The file, its path complete.
        file: PathBuf,
        /// Physical volume of each region.
        regions: BTreeMap<String, PhysicalGroup>,
        /// Physical surfaces.
        surfaces: BTreeMap<String, PhysicalGroup>,
    },
}

impl CaseFile {
    /// The geometry that the case describes.
    ///
    /// # Errors
    /// When lattice and mesh are mixed or neither is complete.
    pub fn shape(&self) -> Result<SpecimenGeometry, InputError> {
        let s = &self.case.specimen;
        let lattice_keys =
            [("radius_mm", s.radius_mm), ("height_mm", s.height_mm), ("spacing_mm", s.spacing_mm)];
        if let Some(mesh) = &s.mesh {
            let shown = mesh.display().to_string();
            let extra = lattice_keys.iter().find(|(_, v)| v.is_some()).map(|(key, _)| *key);
            if let Some(key) = extra.or(s.grains.as_ref().map(|_| "grains")) {
                return Err(self.error(
                    &format!("specimen.{key}"),
                    "",
                    "stands beside specimen.mesh",
                    "A mesh replaces the lattice and the packing: remove one of the two.",
                ));
            }
            let file = self.beside(mesh);
            if !file.is_file() {
                return Err(self.error(
                    "specimen.mesh",
                    shown,
                    "there is no such file",
                    format!("It is sought at {}.", file.display()),
                ));
            }
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
                if let Some((first, second, group)) = named_twice(groups) {
                    return Err(self.error(
                        &format!("specimen.{key}"),
                        "",
                        format!("{first} and {second} both are the physical group {group}"),
                        "Give each its own group of the mesh file.",
                    ));
                }
            }
            return Ok(SpecimenGeometry::Mesh {
                file,
                regions: s.regions.clone(),
                surfaces: s.surfaces.clone(),
            });
        }
        for (key, value) in lattice_keys {
            if value.is_none() {
                return Err(self.error(
                    &format!("specimen.{key}"),
                    "",
                    "is missing",
                    "Give radius_mm, height_mm and spacing_mm, or a mesh.",
                ));
            }
        }
        let [radius_mm, height_mm, spacing_mm] = lattice_keys.map(|(_, v)| v.unwrap_or(f64::NAN));
        Ok(SpecimenGeometry::Lattice { radius_mm, height_mm, spacing_mm, grains: s.grains.clone() })
    }
}

/// Two names of one physical group, and the group.
fn named_twice(
    groups: &BTreeMap<String, PhysicalGroup>,
) -> Option<(&String, &String, &PhysicalGroup)> {
    groups.iter().enumerate().find_map(|(i, (first, group))| {
        let (second, _) = groups.iter().skip(i + 1).find(|(_, other)| *other == group)?;
        Some((first, second, group))
    })
}
