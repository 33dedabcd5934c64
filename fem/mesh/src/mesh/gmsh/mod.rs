//! Reader and writer of Gmsh's MSH files: reads versions 2.2 and 4.1, ASCII and binary, and writes 4.1 ASCII.
//!
//! Gmsh is an external program; none of its code is linked. From a second-order mesh, only the corners and the mid-edge
//! nodes of curved edges are read, because a simulation adds the other mid-edge nodes.
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

/// Reads a MSH file and checks the mesh like [`import`], but discards the notes.
///
/// # Errors
/// The errors of [`import`].
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

/// Reads a MSH file, repairs it where possible, checks the mesh, and returns notes for the author of the file.
///
/// The mesh contains the tetrahedra of order 1 and 2 (types 4 and 11) in the physical volumes that `names` lists, and
/// the triangles (types 2 and 9) in the physical surfaces that `names` lists. The regions of the mesh are sorted by
/// name. Nodes keep the order of the file; nodes without a tetrahedron are removed. Tetrahedra are sorted by their
/// tags. Orientations are corrected to positive volumes and outward triangles. Edges of second-order tetrahedra that
/// are not straight become [`TetMesh::edge_points`]; tetrahedra folded by these edges are straightened
/// ([`ImportNote::Straightened`]). Grain numbers are read from elementary tags if these follow the scheme of
/// [`write()`], and mixtures from element data; a mixture with the fraction 1 becomes a tetrahedron of its second phase.
///
/// # Errors
/// [`MeshError::Io`] if the file cannot be read; [`MeshError::File`], with line (ASCII) or section and byte (binary),
/// if its content is invalid; and every error of [`TetMesh::validate`].
pub fn import(path: impl AsRef<Path>, names: &GmshNames) -> Result<Imported, MeshError> {
    import_with(path.as_ref(), names, Contents::grains)
}

/// Imports a file like [`import`]. `grains` is a function that derives the grain number of each tetrahedron from the
/// contents of the file.
fn import_with(
    path: &Path,
    names: &GmshNames,
    grains: impl Fn(&Contents) -> Option<Vec<u32>>,
) -> Result<Imported, MeshError> {
    let bytes = read_regular(path).map_err(|error| MeshError::io("read", path, error))?;
    let mut contents = read_contents(&mut Source::new(&bytes)).map_err(|fault| {
        MeshError::File { path: path.into(), place: fault.location, message: fault.message }
    })?;
    contents.sort();
    let unsaved = contents.unsaved_volumes();
    let (mesh, straightened) = contents.into_mesh(names, grains).map_err(|message| {
        MeshError::File { path: path.into(), place: "physical groups".into(), message }
    })?;
    mesh.validate()?;
    Ok(Imported::new(mesh.with_pure_tetrahedra(), straightened, unsaved))
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
                    "partitioned meshes are not supported; save the mesh without partitions".into(),
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
