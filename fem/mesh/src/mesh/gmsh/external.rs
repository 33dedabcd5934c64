//! Meshing with Gmsh as an external program; models and meshes are exchanged as files.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use super::elements::Contents;
use super::names::GmshNames;
use crate::error::MeshError;
use crate::mesh::TetMesh;

/// Names of the regions and surfaces of the model, with the numbers of their physical groups.
const REGIONS: [(&str, i32); 2] = [("matrix", 1), ("grain", 2)];
const SURFACES: [(&str, i32); 3] = [("bottom", 11), ("top", 12), ("side", 13)];
/// Volume number of the first sphere; the cylinder is volume 1.
const FIRST_SPHERE: usize = 2;

/// A cylinder with spherical grains, to be meshed by Gmsh with its OpenCASCADE geometry. The grains must neither
/// overlap nor touch the wall.
///
/// # Example
/// ```
/// use fem_mesh::gmsh::SphereModel;
///
/// let model = SphereModel {
///     radius_mm: 2.5,
///     height_mm: 4.4,
///     spheres: vec![([0.5, 0.25, 1.5], 0.7)],
///     spacing_mm: 0.7,
///     curved: true,
/// };
/// assert!(model.geo().contains("Sphere(2) = {0.5, 0.25, 1.5, 0.7};"));
/// let folder = std::env::temp_dir().join("fem-doc-gmsh");
/// match model.mesh("gmsh".as_ref(), &folder) {
///     Ok(mesh) => println!("{} tetrahedra", mesh.tets.len()),
///     Err(error) => println!("without Gmsh: {error}"),
/// }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SphereModel {
    /// Radius of the cylinder (mm); its axis is z and its bottom is at z = 0.
    pub radius_mm: f64,
    /// Height of the cylinder (mm).
    pub height_mm: f64,
    /// Centre and radius of each grain (mm); grains are numbered from 1.
    pub spheres: Vec<([f64; 3], f64)>,
    /// Largest edge length (mm).
    pub spacing_mm: f64,
    /// Whether edges are curved to follow the surfaces of spheres and cylinder.
    pub curved: bool,
}

impl SphereModel {
    /// Returns the model as a Gmsh script (`.geo`).
    pub fn geo(&self) -> String {
        let Self { radius_mm: r, height_mm: h, spheres, spacing_mm, .. } = self;
        let mut out = format!(
            "SetFactory(\"OpenCASCADE\");\nMesh.MeshSizeMax = {spacing_mm:?};\n\
             Mesh.MeshSizeFromCurvature = 12;\nMesh.HighOrderOptimize = 1;\nCylinder(1) = {{0, 0, 0, 0, 0, {h:?}, {r:?}}};\n"
        );
        for (number, ([x, y, z], radius)) in (FIRST_SPHERE..).zip(spheres) {
            let sphere = format!("{x:?}, {y:?}, {z:?}, {radius:?}");
            writeln!(out, "Sphere({number}) = {{{sphere}}};")
                .expect("writing to a string cannot fail");
        }
        if spheres.is_empty() {
            out.push_str("v() = {1};\nmatrix() = {1};\n");
        } else {
            let grains = format!("{FIRST_SPHERE}:{}", FIRST_SPHERE + spheres.len() - 1);
            // Gmsh's command BooleanFragments preserves the volume numbers of the spheres
            out.push_str(&format!(
                "v() = BooleanFragments{{ Volume{{1}}; Delete; }}{{ Volume{{{grains}}}; Delete; }};\n\
                 matrix() = v();\nmatrix() -= {{{grains}}};\n\
                 Physical Volume(\"grain\", 2) = {{{grains}}};\n"
            ));
        }
        let (wide, thin) = (1.01 * r, 1e-3 * h);
        for (name, level) in [("bottom", 0.0), ("top", *h)] {
            let (low, high) = (level - thin, level + thin);
            out.push_str(&format!(
                "{name}() = Surface In BoundingBox{{-{wide:?}, -{wide:?}, {low:?}, {wide:?}, {wide:?}, \
                 {high:?}}};\n"
            ));
        }
        out.push_str(
            "side() = Abs(CombinedBoundary{ Volume{v()}; });\nside() -= bottom();\nside() -= top();\n\
             Physical Volume(\"matrix\", 1) = {matrix()};\n",
        );
        for (name, number) in SURFACES {
            out.push_str(&format!("Physical Surface(\"{name}\", {number}) = {{{name}()}};\n"));
        }
        out
    }

    /// Meshes the model with the program at `program` (the system searches the path for a plain `gmsh`). The model and
    /// the mesh are exchanged through the files `model.geo` and `model.msh` in `folder`, which is created if necessary.
    ///
    /// # Errors
    /// [`MeshError::Mesher`] if the program cannot be started or fails, [`MeshError::Io`] for file errors, and every
    /// error of [`read`](super::read).
    pub fn mesh(&self, program: &Path, folder: &Path) -> Result<TetMesh, MeshError> {
        let failed = |reason: String| MeshError::Mesher { program: program.into(), reason };
        let (model, mesh) = (folder.join("model.geo"), folder.join("model.msh"));
        std::fs::create_dir_all(folder).map_err(|error| MeshError::io("write", folder, error))?;
        std::fs::write(&model, self.geo())
            .map_err(|error| MeshError::io("write", &model, error))?;
        let order = if self.curved { "2" } else { "1" };
        let output = Command::new(program)
            .arg(&model)
            .args(["-3", "-order", order, "-format", "msh41", "-v", "2", "-o"])
            .arg(&mesh)
            .output()
            .map_err(|error| failed(error.to_string()))?;
        if !output.status.success() || !mesh.exists() {
            let printed = [output.stdout, output.stderr].concat();
            let printed = String::from_utf8_lossy(&printed);
            let first =
                printed.lines().find(|line| line.contains("Error")).unwrap_or("no error message");
            return Err(failed(format!("{} ({first})", output.status)));
        }
        let names = GmshNames::new(
            REGIONS.into_iter().take(1 + usize::from(!self.spheres.is_empty())),
            SURFACES,
        );
        let imported = super::import_with(&mesh, &names, |contents: &Contents| {
            let grain = |entity: i32| match usize::try_from(entity) {
                Ok(volume)
                    if (FIRST_SPHERE..FIRST_SPHERE + self.spheres.len()).contains(&volume) =>
                {
                    (volume + 1 - FIRST_SPHERE) as u32
                }
                _ => 0,
            };
            (!self.spheres.is_empty()).then(|| contents.entities().map(grain).collect())
        })?;
        Ok(imported.mesh)
    }
}
