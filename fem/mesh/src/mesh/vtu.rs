//! ParaView files: VTK unstructured grids (`.vtu`) and time series of such grids (`.pvd`).
//!
//! Arrays are written inline as base64 of little-endian values, uncompressed.
//!
//! # Reference
//! Kitware, "VTK XML formats", VTK User's Guide.

use std::fmt::{self, Write as _};
use std::path::Path;

use super::TetMesh;
use super::topology::{EDGES, edge_index};
use crate::error::MeshError;

/// Numbers of the VTK cell types: linear tetrahedron and quadratic tetrahedron.
const TETRA: u8 = 10;
const QUADRATIC_TETRA: u8 = 24;

/// A named field with one value per point or per cell.
#[derive(Clone, Copy, Debug)]
pub struct Field<'a> {
    /// Name of the field; include the unit, as in `displacement_mm`.
    pub name: &'a str,
    /// Values of the field.
    pub values: Values<'a>,
}

/// Values of a field.
#[derive(Clone, Copy, Debug)]
pub enum Values<'a> {
    /// Scalars.
    Scalar(&'a [f64]),
    /// Vectors.
    Vector(&'a [[f64; 3]]),
    /// Symmetric tensors with the components xx, yy, zz, xy, yz, xz.
    Tensor(&'a [[f64; 6]]),
    /// Integer labels.
    Label(&'a [u32]),
}

impl<'a> Field<'a> {
    /// Creates a scalar field.
    pub fn scalar(name: &'a str, values: &'a [f64]) -> Field<'a> {
        Field { name, values: Values::Scalar(values) }
    }

    /// Creates a vector field.
    pub fn vector(name: &'a str, values: &'a [[f64; 3]]) -> Field<'a> {
        Field { name, values: Values::Vector(values) }
    }

    /// Creates a field of symmetric tensors: xx, yy, zz, xy, yz, xz.
    pub fn tensor(name: &'a str, values: &'a [[f64; 6]]) -> Field<'a> {
        Field { name, values: Values::Tensor(values) }
    }

    /// Creates a field of integer labels.
    pub fn label(name: &'a str, values: &'a [u32]) -> Field<'a> {
        Field { name, values: Values::Label(values) }
    }
}

/// Writes the mesh with its regions, the given fields and, if present, grain numbers, grain fractions and interface
/// normals.
///
/// A mesh with curved edges is written with quadratic tetrahedra. Point fields have one value per node of the mesh. The
/// value at a mid-edge node is the mean of the values at the two ends of the edge.
///
/// # Errors
/// [`MeshError::File`] if a field does not have one value per node or tetrahedron, [`MeshError::Io`] if the file
/// cannot be written.
///
/// # Example
/// ```
/// use fem_mesh::{CylinderLattice, vtu};
///
/// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build()?;
/// let height: Vec<f64> = mesh.nodes.iter().map(|p| p[2]).collect();
/// let path = std::env::temp_dir().join("fem-doc-mesh.vtu");
/// vtu::write(&path, &mesh, &[vtu::Field::scalar("height_mm", &height)], &[])?;
/// # std::fs::remove_file(path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write(
    path: impl AsRef<Path>,
    mesh: &TetMesh,
    point_fields: &[Field],
    cell_fields: &[Field],
) -> Result<(), MeshError> {
    let path = path.as_ref();
    if mesh.edge_points.is_empty() {
        return write_straight(path, mesh, point_fields, cell_fields);
    }
    check(path, "point", point_fields, mesh.nodes.len())?;
    let edges = mesh.all_edges();
    let mut points = mesh.nodes.clone();
    points.extend(edges.iter().map(|(_, point)| point));
    let mid_edge_node = |ends: [u32; 2]| (mesh.nodes.len() + edge_index(&edges, ends)) as u32;
    let ten = |tet: &[u32; 4]| -> [u32; 10] {
        let middles = EDGES.map(|ends| mid_edge_node(ends.map(|end| tet[end])));
        std::array::from_fn(|k| if k < 4 { tet[k] } else { middles[k - 4] })
    };
    let tets: Vec<[u32; 10]> = mesh.tets.iter().map(ten).collect();
    let ends = || edges.iter().map(|(ends, _)| ends.map(|end| end as usize));
    let extended: Vec<ExtendedValues> =
        point_fields.iter().map(|field| field.extended(ends())).collect();
    let fields: Vec<Field> =
        extended.iter().zip(point_fields).map(|(o, f)| o.named(f.name)).collect();
    write_grid(path, mesh, &points, QUADRATIC_TETRA, &tets, &fields, cell_fields)
}

/// Writes a mesh as linear tetrahedra, even if it has curved edges.
///
/// # Errors
/// The errors of [`write()`].
pub fn write_straight(
    path: impl AsRef<Path>,
    mesh: &TetMesh,
    point_fields: &[Field],
    cell_fields: &[Field],
) -> Result<(), MeshError> {
    write_grid(path.as_ref(), mesh, &mesh.nodes, TETRA, &mesh.tets, point_fields, cell_fields)
}

/// Values of a field at the nodes of the mesh and at the mid-edge nodes.
enum ExtendedValues {
    Scalar(Vec<f64>),
    Vector(Vec<[f64; 3]>),
    Tensor(Vec<[f64; 6]>),
    Label(Vec<u32>),
}

impl Field<'_> {
    /// Extends the nodal values to the mid-edge nodes: the value at a mid-edge node is the mean of the values at both
    /// ends, or the label of the first end.
    fn extended(&self, ends: impl Iterator<Item = [usize; 2]>) -> ExtendedValues {
        match self.values {
            Values::Scalar(v) => {
                let middles = ends.map(|[a, b]| 0.5 * (v[a] + v[b]));
                ExtendedValues::Scalar(v.iter().copied().chain(middles).collect())
            }
            Values::Vector(v) => ExtendedValues::Vector(with_middles(v, ends)),
            Values::Tensor(v) => ExtendedValues::Tensor(with_middles(v, ends)),
            Values::Label(v) => {
                ExtendedValues::Label(v.iter().copied().chain(ends.map(|[a, _]| v[a])).collect())
            }
        }
    }
}

fn with_middles<const K: usize>(
    values: &[[f64; K]],
    ends: impl Iterator<Item = [usize; 2]>,
) -> Vec<[f64; K]> {
    let middle = |[a, b]: [usize; 2]| -> [f64; K] {
        std::array::from_fn(|k| 0.5 * (values[a][k] + values[b][k]))
    };
    values.iter().copied().chain(ends.map(middle)).collect()
}

impl ExtendedValues {
    fn named<'a>(&'a self, name: &'a str) -> Field<'a> {
        match self {
            ExtendedValues::Scalar(values) => Field::scalar(name, values),
            ExtendedValues::Vector(values) => Field::vector(name, values),
            ExtendedValues::Tensor(values) => Field::tensor(name, values),
            ExtendedValues::Label(values) => Field::label(name, values),
        }
    }
}

/// Writes the mesh like [`write()`], with given nodes of quadratic tetrahedra.
///
/// `points` has one row per node of the quadratic space (mm). `tets` has, for every tetrahedron of the mesh, ten row
/// indices into `points`: the four corners, then the middles of the edges 01, 12, 20, 03, 13, 23.
///
/// # Errors
/// The errors of [`write()`]; here, point fields have one value per row of `points`.
pub fn write_quadratic(
    path: impl AsRef<Path>,
    mesh: &TetMesh,
    points: &[[f64; 3]],
    tets: &[[u32; 10]],
    point_fields: &[Field],
    cell_fields: &[Field],
) -> Result<(), MeshError> {
    write_grid(path.as_ref(), mesh, points, QUADRATIC_TETRA, tets, point_fields, cell_fields)
}

/// Writes a `.pvd` file that lists `.vtu` files by time (s); the paths are relative to the directory of the `.pvd`
/// file.
///
/// # Errors
/// [`MeshError::Io`] if the file cannot be written.
///
/// # Example
/// ```
/// let path = std::env::temp_dir().join("fem-doc-run.pvd");
/// fem_mesh::vtu::write_pvd(&path, &[(0.0, "step-0.vtu"), (0.1, "step-1.vtu")])?;
/// # std::fs::remove_file(path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_pvd(path: impl AsRef<Path>, steps: &[(f64, &str)]) -> Result<(), MeshError> {
    let mut out = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" \
         byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<Collection>\n",
    );
    for (time, file) in steps {
        let file = escape(file);
        out.push_str(&format!("<DataSet timestep=\"{time:?}\" part=\"0\" file=\"{file}\"/>\n"));
    }
    out.push_str("</Collection>\n</VTKFile>\n");
    save(path.as_ref(), out)
}

fn write_grid<const N: usize>(
    path: &Path,
    mesh: &TetMesh,
    points: &[[f64; 3]],
    kind: u8,
    tets: &[[u32; N]],
    point_fields: &[Field],
    cell_fields: &[Field],
) -> Result<(), MeshError> {
    let region: Vec<u32> = mesh.region_of.iter().map(|&region| region as u32).collect();
    let mut cells = vec![Field::label("region", &region)];
    cells.extend(mesh.grain_of.iter().map(|grains| Field::label("grain", grains)));
    let mixture = mesh.mixture.as_deref().unwrap_or_default();
    let fraction: Vec<f64> = mixture.iter().map(|m| m.fraction.into()).collect();
    let normal: Vec<[f64; 3]> = mixture.iter().map(|m| m.normal.map(f64::from)).collect();
    if mesh.mixture.is_some() {
        cells.push(Field::scalar("grain_fraction", &fraction));
        cells.push(Field::vector("interface_normal", &normal));
    }
    cells.extend_from_slice(cell_fields);
    check(path, "point", point_fields, points.len())?;
    check(path, "cell", &cells, tets.len())?;
    save(
        path,
        grid(points, kind, tets, point_fields, &cells).expect("writing to a string cannot fail"),
    )
}

fn grid<const N: usize>(
    points: &[[f64; 3]],
    kind: u8,
    tets: &[[u32; N]],
    point_fields: &[Field],
    cell_fields: &[Field],
) -> Result<String, fmt::Error> {
    let mut out = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" \
         byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>\n",
    );
    let (rows, cells) = (points.len(), tets.len());
    writeln!(out, "<Piece NumberOfPoints=\"{rows}\" NumberOfCells=\"{cells}\">")?;
    out.push_str("<Points>\n");
    field(&mut out, &Field::vector("points_mm", points))?;
    out.push_str("</Points>\n<Cells>\n");
    array(
        &mut out,
        "Int64",
        "connectivity",
        1,
        tets.iter().flatten().map(|&n| (n as i64).to_le_bytes()),
    )?;
    array(&mut out, "Int64", "offsets", 1, (1..=cells).map(|n| ((n * N) as i64).to_le_bytes()))?;
    array(&mut out, "UInt8", "types", 1, std::iter::repeat_n([kind], cells))?;
    out.push_str("</Cells>\n<PointData>\n");
    point_fields.iter().try_for_each(|one| field(&mut out, one))?;
    out.push_str("</PointData>\n<CellData>\n");
    cell_fields.iter().try_for_each(|one| field(&mut out, one))?;
    out.push_str("</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n");
    Ok(out)
}

fn check(path: &Path, what: &str, fields: &[Field], expected: usize) -> Result<(), MeshError> {
    for Field { name, values } in fields {
        let length = match values {
            Values::Scalar(values) => values.len(),
            Values::Vector(values) => values.len(),
            Values::Tensor(values) => values.len(),
            Values::Label(values) => values.len(),
        };
        if length != expected {
            return Err(MeshError::File {
                path: path.into(),
                place: format!("{what} field `{name}`"),
                message: format!(
                    "{length} values for {expected} {what}s; give one value per {what}"
                ),
            });
        }
    }
    Ok(())
}

fn field(out: &mut String, field: &Field) -> fmt::Result {
    match field.values {
        Values::Scalar(values) => {
            array(out, "Float64", field.name, 1, values.iter().map(|x| x.to_le_bytes()))
        }
        Values::Vector(values) => {
            array(out, "Float64", field.name, 3, values.iter().flatten().map(|x| x.to_le_bytes()))
        }
        Values::Tensor(values) => {
            array(out, "Float64", field.name, 6, values.iter().flatten().map(|x| x.to_le_bytes()))
        }
        Values::Label(values) => {
            array(out, "UInt32", field.name, 1, values.iter().map(|x| x.to_le_bytes()))
        }
    }
}

fn array<const B: usize>(
    out: &mut String,
    kind: &str,
    name: &str,
    components: usize,
    values: impl Iterator<Item = [u8; B]>,
) -> fmt::Result {
    let data: Vec<u8> = values.flatten().collect();
    // the base64 stream begins with the number of bytes of the data
    let mut bytes = (data.len() as u64).to_le_bytes().to_vec();
    bytes.extend(data);
    let name = escape(name);
    write!(out, "<DataArray type=\"{kind}\" Name=\"{name}\"")?;
    // omit the default value of 1: with an explicit 1, some readers return a matrix of one column
    if components > 1 {
        write!(out, " NumberOfComponents=\"{components}\"")?;
    }
    writeln!(out, " format=\"binary\">")?;
    base64(out, &bytes);
    out.push_str("\n</DataArray>\n");
    Ok(())
}

fn base64(out: &mut String, bytes: &[u8]) {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for three in bytes.chunks(3) {
        let bits = three.iter().fold(0_u32, |bits, &byte| (bits << 8) | byte as u32);
        let bits = bits << (8 * (3 - three.len()));
        for digit in 0..4 {
            let value = (bits >> (18 - 6 * digit)) & 63;
            let is_padding = digit > three.len();
            out.push(if is_padding { '=' } else { DIGITS[value as usize] as char });
        }
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn save(path: &Path, text: String) -> Result<(), MeshError> {
    std::fs::write(path, text).map_err(|error| MeshError::io("write", path, error))
}
