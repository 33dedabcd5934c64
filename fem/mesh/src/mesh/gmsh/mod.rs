//! Gmsh's MSH files: versions 2.2 and 4.1 are read, ASCII and binary; 4.1 ASCII is written.
//!
//! Gmsh is an external program; nothing of it is linked. Of second-order meshes the corners are read and
//! the edges that are not straight, since a simulation raises the order itself.
//!
//! # Reference
//! C. Geuzaine and J.-F. Remacle, Gmsh reference manual, "MSH file format" and "MSH file format
//! version 2 (Legacy)".

mod data;
mod elements;
mod external;
mod grains;
mod import;
mod names;
mod second_order;
mod source;
mod straighten;
mod v2;
mod v4;
mod write;

use std::path::Path;

use super::TetMesh;
use crate::error::MeshError;
use elements::Contents;
pub use external::SphereModel;
use fem_file::read_regular;
pub use import::{ImportNote, Imported};
pub use names::{GmshNames, PhysicalGroup, PhysicalGroups};
use source::Source;
pub use write::write;

/// Reads a MSH file and checks the mesh, as [`import`] does, without its notes.
///
/// # Errors
/// As [`import`].
///
/// # Example
/// ```no_run
/// use fem_mesh::gmsh::{self, GmshNames};
///
/// let names = GmshNames::new([("matrix", 1), ("grain", 2)], [("bottom", 11), ("top", 12)]);
/// let mesh = gmsh::read("cylinder.msh", &names)?;
/// println!("{} tetrahedra", mesh.tets.len());
/// # Ok::<(), fem_mesh::MeshError>(())
/// ```
pub fn read(path: impl AsRef<Path>, names: &GmshNames) -> Result<TetMesh, MeshError> {
    Ok(import(path, names)?.mesh)
}

/// Reads a MSH file, mends what can be mended, checks the mesh, and notes what its author should know.
///
/// Tetrahedra of order 1 and 2 (types 4 and 11) in the physical volumes that `names` gives, and
/// triangles (types 2 and 9) in its physical surfaces; `regions` come in the order of their names.
/// Nodes keep the file's order; those that no tetrahedron uses are dropped. Tetrahedra come in the order of
/// their tags. Orientations are corrected: positive volumes, outward triangles. Edges of second-order
/// tetrahedra that are not straight become [`TetMesh::edge_points`]; tetrahedra that these edges fold are
/// straightened ([`ImportNote::Straightened`]). Grain numbers are read from elementary tags that are as
/// [`write()`] gives them, mixtures from element data.
///
/// # Errors
/// [`MeshError::Io`] if the file cannot be read, [`MeshError::File`] with line (ASCII) or section
/// and byte (binary) if its content is wrong, and whatever [`TetMesh::validate`] finds.
pub fn import(path: impl AsRef<Path>, names: &GmshNames) -> Result<Imported, MeshError> {
    import_with(path.as_ref(), names, Contents::grains)
}

/// As [`import`], with the grain numbers that a function finds in the file.
fn import_with(
    path: &Path,
    names: &GmshNames,
    grains: impl Fn(&Contents) -> Option<Vec<u32>>,
) -> Result<Imported, MeshError> {
    let bytes = read_regular(path).map_err(|error| MeshError::io("read", path, error))?;
    let mut contents = read_contents(&mut Source::new(&bytes)).map_err(|fault| {
        MeshError::File { path: path.into(), place: fault.place, message: fault.message }
    })?;
    contents.sort();
    let unsaved = contents.unsaved_volumes();
    let (mesh, straightened) = contents.into_mesh(names, grains).map_err(|message| {
        MeshError::File { path: path.into(), place: "physical groups".into(), message }
    })?;
    mesh.validate()?;
    Ok(Imported::new(mesh, straightened, unsaved))
}

fn read_contents(source: &mut Source) -> Result<Contents, source::Fault> {
    let version = source.format()?;
    let mut contents = Contents::default();
    while let Some(section) = source.section()? {
        match (section.as_str(), version) {
            ("PhysicalNames", _) => elements::physical_names(source, &mut contents)?,
            ("Nodes", source::Version::V2) => v2::nodes(source, &mut contents)?,
            ("ParametricNodes", source::Version::V2) => {
                v2::parametric_nodes(source, &mut contents)?
            }
            ("Elements", source::Version::V2) => v2::elements(source, &mut contents)?,
            ("Entities", source::Version::V4) => v4::entities(source, &mut contents)?,
            ("Nodes", source::Version::V4) => v4::nodes(source, &mut contents)?,
            ("Elements", source::Version::V4) => v4::elements(source, &mut contents)?,
            ("ElementData", _) => {
                if !data::read(source, &mut contents.data)? {
                    source.skip_section()?;
                    continue;
                }
            }
            ("PartitionedEntities", _) => {
                return Err(source.fault(
                    "the mesh is partitioned, which is not read; save it unpartitioned".into(),
                ));
            }
            _ => {
                source.skip_section()?;
                continue;
            }
        }
        source.end_section()?;
    }
    Ok(contents)
}
