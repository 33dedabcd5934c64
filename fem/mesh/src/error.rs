//! Errors of a mesh or a mesh file.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use fem_image::listed;

/// Error of a mesh: the fault, the affected entity and a remedy.
///
/// Tetrahedra and nodes are numbered from 0, as in [`TetMesh`](crate::TetMesh).
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The mesh has no tetrahedra.
    #[error("the mesh has no tetrahedron; check that the volume was meshed and saved")]
    Empty,
    /// A node has a coordinate that is not finite.
    #[error("node {node} has a coordinate that is not finite: {point:?}; mesh the geometry again")]
    NotFinite {
        /// Number of the node.
        node: usize,
        /// Coordinates of the node (mm).
        point: [f64; 3],
    },
    /// A tetrahedron or triangle refers to a node that does not exist.
    #[error("{entity} refers to node {node}, but there are only {nodes} nodes; renumber the nodes")]
    MissingNode {
        /// Description of the tetrahedron or triangle, as text.
        entity: String,
        /// Number of the node that does not exist.
        node: u32,
        /// Number of nodes in the mesh.
        nodes: usize,
    },
    /// A node belongs to no tetrahedron; such a node would make the stiffness matrix singular.
    #[error("node {node} belongs to no tetrahedron; remove the node from `nodes`")]
    UnusedNode {
        /// Number of the node.
        node: usize,
    },
    /// A tetrahedron has a negative volume because of the order of its nodes.
    #[error(
        "tetrahedron {tet} is inverted (volume {volume_mm3:e} mm³); swap two of its nodes, or mesh \
         again if it overlaps its neighbours"
    )]
    Inverted {
        /// Number of the tetrahedron.
        tet: usize,
        /// Signed volume of the tetrahedron (mm³).
        volume_mm3: f64,
    },
    /// A tetrahedron has practically no volume.
    #[error(
        "tetrahedron {tet} is degenerate (volume {volume_mm3:e} mm³, longest edge {longest_edge_mm:e} \
         mm); merge its nodes or mesh again"
    )]
    Degenerate {
        /// Number of the tetrahedron.
        tet: usize,
        /// Signed volume of the tetrahedron (mm³).
        volume_mm3: f64,
        /// Longest edge of the tetrahedron (mm).
        longest_edge_mm: f64,
    },
    /// An array does not have one entry per tetrahedron.
    #[error(
        "`{array}` has {length} entries for {tets} tetrahedra; give every tetrahedron one label"
    )]
    Unlabelled {
        /// Name of the array: `region_of`, `grain_of` or `mixture`.
        array: &'static str,
        /// Length of the array.
        length: usize,
        /// Number of tetrahedra in the mesh.
        tets: usize,
    },
    /// The region index of a tetrahedron is not below the number of regions.
    #[error(
        "tetrahedron {tet} has region index {region}, but the regions are {}; add its name to `regions`",
        listed(regions, ", ")
    )]
    UnknownRegion {
        /// Number of the tetrahedron.
        tet: usize,
        /// Region index of the tetrahedron.
        region: u16,
        /// Names of the regions of the mesh.
        regions: Vec<String>,
    },
    /// A region has no tetrahedra.
    #[error("region `{name}` has no tetrahedron; correct its name or tag, or remove the region")]
    MissingRegion {
        /// Name of the region.
        name: String,
    },
    /// More than two tetrahedra share a face.
    #[error(
        "the face of nodes {face:?} is shared by {count} tetrahedra ({tets:?}), but at most two may \
         share a face; remove the duplicates"
    )]
    NonManifoldFace {
        /// Nodes of the face.
        face: [u32; 3],
        /// Number of tetrahedra that share the face.
        count: usize,
        /// Numbers of the first three tetrahedra that share the face.
        tets: Vec<u32>,
    },
    /// Two tetrahedra lie on the same side of their common face.
    #[error(
        "tetrahedra {first} and {second} lie on the same side of their common face and overlap; \
         mesh again"
    )]
    Overlap {
        /// Number of one tetrahedron.
        first: u32,
        /// Number of the other tetrahedron.
        second: u32,
    },
    /// The mesh consists of parts that share no node.
    #[error(
        "the mesh consists of several parts that share no node (tetrahedra 0 and {tet}); make the geometry \
         conforming before meshing (in Gmsh: Coherence or BooleanFragments)"
    )]
    Disconnected {
        /// Number of the first tetrahedron that is not connected to tetrahedron 0.
        tet: usize,
    },
    /// A triangle of a surface is not a face of the boundary of the mesh.
    #[error(
        "triangle {triangle} of surface `{surface}` (nodes {nodes:?}) is not a boundary face of the \
         tetrahedra; remove the triangle from the surface"
    )]
    NotOnBoundary {
        /// Name of the surface.
        surface: String,
        /// Number of the triangle in the surface.
        triangle: usize,
        /// Nodes of the triangle.
        nodes: [u32; 3],
    },
    /// The normal of a surface triangle points inwards.
    #[error(
        "the normal of triangle {triangle} of surface `{surface}` points inwards; swap two nodes of the triangle"
    )]
    Inward {
        /// Name of the surface.
        surface: String,
        /// Number of the triangle in the surface.
        triangle: usize,
    },
    /// A boundary face is listed twice.
    #[error(
        "the boundary face of nodes {nodes:?} is listed in surface `{first}` and again in `{second}`; \
         keep one"
    )]
    DuplicateTriangle {
        /// Nodes of the face.
        nodes: [u32; 3],
        /// Name of the surface that lists the face first.
        first: String,
        /// Name of the surface that lists the face again.
        second: String,
    },
    /// A surface has no triangles.
    #[error("surface `{name}` has no triangle; correct its name or tag, or remove the surface")]
    EmptySurface {
        /// Name of the surface.
        name: String,
    },
    /// The mid-edge point that defines a curved edge is invalid.
    #[error("the mid-edge point {point_mm:?} of the edge with nodes {edge:?}: {fault}")]
    EdgePoint {
        /// Nodes of the edge.
        edge: [u32; 2],
        /// Coordinates of the mid-edge point (mm).
        point_mm: [f64; 3],
        /// Description of the fault.
        fault: &'static str,
    },
    /// A tetrahedron is folded by its curved edges: its Jacobian determinant is not positive everywhere.
    #[error(
        "tetrahedron {tet} is folded by its curved edges (smallest Jacobian {jacobian_mm3:e} mm³); move \
         the mid-edge points towards the midpoints of the edges (in Gmsh: Mesh.HighOrderOptimize = 1)"
    )]
    Folded {
        /// Number of the tetrahedron.
        tet: usize,
        /// Lower bound of the Jacobian determinant of the tetrahedron (mm³).
        jacobian_mm3: f64,
    },
    /// Several errors that one check of the mesh has found.
    #[error("the mesh has {count} errors: {}{}", all_of(first), if *count > first.len() { "; …" } else { "" })]
    Several {
        /// The first errors.
        first: Vec<MeshError>,
        /// Total number of errors.
        count: usize,
    },
    /// A mixture has a fraction outside [0, 1] or a normal that is neither a unit vector nor zero.
    #[error(
        "tetrahedron {tet} has a grain fraction of {fraction} with the interface normal {normal:?}; \
         give a fraction from 0 to 1 and a unit vector or zeros"
    )]
    Mixture {
        /// Number of the tetrahedron.
        tet: usize,
        /// Grain fraction of the mixture.
        fraction: f32,
        /// Interface normal of the mixture.
        normal: [f32; 3],
    },
    /// The mesh has no region of the requested name.
    #[error("there is no region `{name}`; the mesh has {}", listed(regions, ", "))]
    NoSuchRegion {
        /// The requested name.
        name: String,
        /// Names of the regions of the mesh.
        regions: Vec<String>,
    },
    /// The content of a file is invalid.
    #[error("{}: {place}: {message}", path.display())]
    File {
        /// Path of the file.
        path: PathBuf,
        /// Position in the file: line, or section and byte.
        place: String,
        /// Description of the fault, the value, and a remedy.
        message: String,
    },
    /// The external meshing program failed.
    #[error("{}: {reason}; install Gmsh, or give the path to its program", program.display())]
    Mesher {
        /// Path of the program.
        program: PathBuf,
        /// Message of the operating system or of the meshing program.
        reason: String,
    },
    /// A file cannot be opened, read or written.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// The failed action: `read` or `write`.
        action: &'static str,
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: Arc<io::Error>,
    },
}

impl MeshError {
    pub(crate) fn io(action: &'static str, path: &Path, source: io::Error) -> Self {
        MeshError::Io { action, path: path.into(), source: Arc::new(source) }
    }
}

fn all_of(faults: &[MeshError]) -> String {
    faults.iter().map(MeshError::to_string).collect::<Vec<_>>().join("; ")
}
