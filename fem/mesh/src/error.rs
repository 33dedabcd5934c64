//! Everything that can be wrong with a mesh or its file.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What is wrong with a mesh, which entity it is, and what helps.
///
/// Numbers of tetrahedra and nodes count from 0, as they stand in [`TetMesh`](crate::TetMesh).
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// No tetrahedra at all.
    #[error("the mesh has no tetrahedron; check that the volume was meshed and saved")]
    Empty,
    /// A coordinate that is not a number.
    #[error("node {node} has a coordinate that is not finite: {point:?}; mesh the geometry again")]
    NotFinite {
        /// Number of the node.
        node: usize,
        /// Its coordinates (mm).
        point: [f64; 3],
    },
    /// A tetrahedron or triangle that refers to a node that is not there.
    #[error("{entity} refers to node {node}, but there are only {nodes} nodes; renumber the nodes")]
    MissingNode {
        /// The tetrahedron or triangle.
        entity: String,
        /// The number it refers to.
        node: u32,
        /// How many nodes there are.
        nodes: usize,
    },
    /// A node that no tetrahedron uses: it would make the stiffness singular.
    #[error("node {node} belongs to no tetrahedron; drop it from `nodes`")]
    UnusedNode {
        /// Number of the node.
        node: usize,
    },
    /// A tetrahedron whose nodes run the wrong way round.
    #[error(
        "tetrahedron {tet} is inverted (volume {volume_mm3:e} mm³); swap two of its nodes, or mesh \
         again if it overlaps its neighbours"
    )]
    Inverted {
        /// Number of the tetrahedron.
        tet: usize,
        /// Its signed volume (mm³).
        volume_mm3: f64,
    },
    /// A tetrahedron without volume.
    #[error(
        "tetrahedron {tet} is degenerate (volume {volume_mm3:e} mm³, longest edge {longest_edge_mm:e} \
         mm); merge its nodes or mesh again"
    )]
    Degenerate {
        /// Number of the tetrahedron.
        tet: usize,
        /// Its signed volume (mm³).
        volume_mm3: f64,
        /// Its longest edge (mm).
        longest_edge_mm: f64,
    },
    /// An array that has not one entry per tetrahedron.
    #[error(
        "`{array}` has {length} entries for {tets} tetrahedra; give every tetrahedron one label"
    )]
    Unlabelled {
        /// `region_of`, `grain_of` or `mixture`.
        array: &'static str,
        /// Its length.
        length: usize,
        /// How many tetrahedra there are.
        tets: usize,
    },
    /// A label that is no region.
    #[error("tetrahedron {tet} has region {region}, but only {regions:?} are named; add its name")]
    UnknownRegion {
        /// Number of the tetrahedron.
        tet: usize,
        /// Its label.
        region: u16,
        /// The named regions.
        regions: Vec<String>,
    },
    /// A region without tetrahedra.
    #[error("region `{name}` has no tetrahedron; correct its name or tag, or leave it out")]
    MissingRegion {
        /// Name of the region.
        name: String,
    },
    /// A face that more than two tetrahedra share.
    #[error(
        "the face of nodes {face:?} is shared by {count} tetrahedra ({tets:?}), at most two can \
         meet there; remove the duplicates"
    )]
    NonManifoldFace {
        /// Nodes of the face.
        face: [u32; 3],
        /// How many tetrahedra share it.
        count: usize,
        /// The first of them.
        tets: Vec<u32>,
    },
    /// Two tetrahedra on the same side of their common face.
    #[error(
        "tetrahedra {first} and {second} lie on the same side of their common face and overlap; \
         mesh again"
    )]
    Overlap {
        /// One tetrahedron.
        first: u32,
        /// The other.
        second: u32,
    },
    /// Parts of the mesh that share no node.
    #[error(
        "the mesh falls into parts that share no node (tetrahedra 0 and {tet}); make the geometry \
         conforming before meshing (in Gmsh: Coherence or BooleanFragments)"
    )]
    Disconnected {
        /// The first tetrahedron that is not connected to tetrahedron 0.
        tet: usize,
    },
    /// A surface triangle inside the body, or away from it.
    #[error(
        "triangle {triangle} of surface `{surface}` (nodes {nodes:?}) is not a boundary face of the \
         tetrahedra; take it out of the surface"
    )]
    NotOnBoundary {
        /// Name of the surface.
        surface: String,
        /// Number of the triangle in the surface.
        triangle: usize,
        /// Its nodes.
        nodes: [u32; 3],
    },
    /// A surface triangle that shows inward.
    #[error("triangle {triangle} of surface `{surface}` shows inward; swap two of its nodes")]
    Inward {
        /// Name of the surface.
        surface: String,
        /// Number of the triangle in the surface.
        triangle: usize,
    },
    /// A boundary face that is listed twice.
    #[error(
        "the boundary face of nodes {nodes:?} is listed in surface `{first}` and again in `{second}`; \
         keep one"
    )]
    DuplicateTriangle {
        /// Nodes of the face.
        nodes: [u32; 3],
        /// Where it is first.
        first: String,
        /// Where it is again.
        second: String,
    },
    /// A surface that has no triangle.
    #[error("surface `{name}` has no triangle; correct its name or tag, or leave it out")]
    EmptySurface {
        /// Name of the surface.
        name: String,
    },
    /// The point of a curved edge that cannot be right.
    #[error("the edge point {point_mm:?} of nodes {edge:?}: {fault}")]
    EdgePoint {
        /// Nodes of the edge.
        edge: [u32; 2],
        /// Its point (mm).
        point_mm: [f64; 3],
        /// What is wrong.
        fault: &'static str,
    },
    /// A tetrahedron that its curved edges fold.
    #[error(
        "tetrahedron {tet} is folded by its curved edges (Jacobian down to {jacobian_mm3:e} mm³); move \
         their points towards the middles of the edges (in Gmsh: Mesh.HighOrderOptimize = 1)"
    )]
    Folded {
        /// Number of the tetrahedron.
        tet: usize,
        /// Lower bound of its Jacobian determinant (mm³).
        jacobian_mm3: f64,
    },
    /// More than one fault of a kind.
    #[error("{count} faults of the mesh: {}{}", listed(first), if *count > first.len() { "; and so on" } else { "" })]
    Several {
        /// The first of them.
        first: Vec<MeshError>,
        /// How many there are.
        count: usize,
    },
    /// A mixture that is no share of grain with a direction.
    #[error(
        "tetrahedron {tet} has a grain fraction of {fraction} with the interface normal {normal:?}; \
         give a fraction from 0 to 1 and a unit vector or zeros"
    )]
    Mixture {
        /// Number of the tetrahedron.
        tet: usize,
        /// Its share of grain.
        fraction: f32,
        /// Its interface normal.
        normal: [f32; 3],
    },
    /// A name that is not in the mesh.
    #[error("there is no region `{name}`; the mesh has {regions:?}")]
    NoSuchRegion {
        /// The name asked for.
        name: String,
        /// The names there are.
        regions: Vec<String>,
    },
    /// A file that is not the mesh it should be.
    #[error("{}: {place}: {message}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Line, or section and byte.
        place: String,
        /// What is wrong, the value, and what helps.
        message: String,
    },
    /// A program that should have made the mesh.
    #[error("{}: {reason}; install Gmsh, or give the path to its program", program.display())]
    Mesher {
        /// The program.
        program: PathBuf,
        /// What the system or the program says.
        reason: String,
    },
    /// A file that cannot be opened, read or written.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// `read` or `write`.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: Arc<io::Error>,
    },
}

impl MeshError {
    pub(crate) fn io(action: &'static str, path: &Path, source: io::Error) -> Self {
        MeshError::Io { action, path: path.into(), source: Arc::new(source) }
    }
}

fn listed(faults: &[MeshError]) -> String {
    faults.iter().map(MeshError::to_string).collect::<Vec<_>>().join("; ")
}
