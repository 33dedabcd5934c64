//! Reader of STL files, binary and ASCII.

use std::path::Path;

use crate::error::MeshError;
use crate::mesh::vector::Point;
use fem_file::read_regular;

/// Size (bytes) of the header of a binary file and of the record of one triangle.
const HEAD: usize = 84;
const TRIANGLE: usize = 50;

/// Reads the triangles of an STL file, binary or ASCII, in the unit of the file. The triangles of several solids are
/// returned as one list.
///
/// A file is binary if its length matches its number of triangles, even if its title begins with `solid`.
///
/// # Errors
/// [`MeshError::Io`] if the file cannot be read; [`MeshError::File`], with line or triangle, if it is not an STL
/// file, is truncated, has no triangle, or has a coordinate that is not finite.
///
/// # Example
/// ```
/// use fem_mesh::stl;
///
/// let path = std::env::temp_dir().join("fem-doc-read.stl");
/// stl::write(&path, "one", &[[[0.0; 3], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]]])?;
/// assert_eq!(stl::read(&path)?.len(), 1);
/// # std::fs::remove_file(path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read(path: impl AsRef<Path>) -> Result<Vec<[[f64; 3]; 3]>, MeshError> {
    let path = path.as_ref();
    let bytes = read_regular(path).map_err(|error| MeshError::io("read", path, error))?;
    let triangles = match binary(&bytes) {
        Some(triangles) => triangles,
        None => ascii(&bytes).map_err(|(line, message)| MeshError::File {
            path: path.into(),
            place: format!("line {line}"),
            message,
        })?,
    };
    let fault = |location: String, message: &str| {
        Err(MeshError::File { path: path.into(), place: location, message: message.into() })
    };
    if triangles.is_empty() {
        return fault("file".into(), "the file has no triangle; export the surface again");
    }
    let is_finite = |triangle: &[Point; 3]| triangle.as_flattened().iter().all(|x| x.is_finite());
    match triangles.iter().position(|triangle| !is_finite(triangle)) {
        Some(number) => {
            let message = "a coordinate is not finite; export the surface again";
            fault(format!("triangle {number}"), message)
        }
        None => Ok(triangles),
    }
}

/// Parses the triangles of a binary file; returns `None` if the length of the file does not match its number of
/// triangles.
fn binary(bytes: &[u8]) -> Option<Vec<[Point; 3]>> {
    let count = u32::from_le_bytes(bytes.get(HEAD - 4..HEAD)?.try_into().ok()?) as usize;
    let body = &bytes[HEAD..];
    // some programs append a line break of one or two bytes
    if body.len() < TRIANGLE * count || body.len() > TRIANGLE * count + 2 {
        return None;
    }
    let real = |b: &[u8]| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let triangle = |record: &[u8]| {
        // skip the normal (12 bytes)
        std::array::from_fn(|corner| {
            std::array::from_fn(|k| real(&record[12 + 12 * corner + 4 * k..][..4]))
        })
    };
    Some(body.chunks_exact(TRIANGLE).take(count).map(triangle).collect())
}

/// Parses the triangles of an ASCII file; the error is a line number and a message.
fn ascii(bytes: &[u8]) -> Result<Vec<[Point; 3]>, (usize, String)> {
    let not_stl = "this is not an STL file: neither does its length match its number of triangles (binary), nor \
                   does it begin with `solid` (ASCII); the file may be truncated, export it again";
    let text =
        std::str::from_utf8(bytes).ok().filter(|text| text.trim_start().starts_with("solid"));
    let Some(text) = text else { return Err((1, not_stl.into())) };
    let mut corners: Vec<Point> = Vec::new();
    let mut triangles = Vec::new();
    let mut last = 1;
    for (line, content) in (1..).zip(text.lines()) {
        last = line;
        let mut words = content.split_whitespace();
        match words.next() {
            Some("vertex") => {
                let mut point = [0.0; 3];
                for x in &mut point {
                    let word = words.next().unwrap_or("");
                    *x = word.parse().map_err(|_| {
                        (line, format!("`{word}` is not a coordinate; export the surface again"))
                    })?;
                }
                corners.push(point);
            }
            Some("endfacet") => {
                let triangle = <[Point; 3]>::try_from(std::mem::take(&mut corners));
                let triangle = triangle.map_err(|corners| {
                    (line, format!("a facet has {} corners, but only triangles are supported; export triangles", corners.len()))
                })?;
                triangles.push(triangle);
            }
            _ => {}
        }
    }
    match corners.is_empty()
        && text.trim_end().lines().last().is_some_and(|l| l.trim_start().starts_with("endsolid"))
    {
        true => Ok(triangles),
        false => Err((last, "the file ends before `endsolid`; export it again".into())),
    }
}
