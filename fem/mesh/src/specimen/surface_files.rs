//! STL files as named closed surfaces, and what can be wrong with them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::error::MeshError;
use crate::mesh::{Surface, stl};

/// A grain as it was read.
pub(super) struct NamedSurface {
    /// The name of the file, with the number of the part where a file has several.
    pub(super) name: String,
    /// The surface, outward.
    pub(super) surface: Surface,
    /// Whether it showed inward in the file.
    pub(super) is_turned: bool,
}

/// Why STL files are no grains.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceImportError {
    /// A setting out of its range.
    #[error("{field} = {value}; give {requirement}")]
    Field {
        /// Name of the setting.
        field: &'static str,
        /// Its value.
        value: f64,
        /// What it should be.
        requirement: &'static str,
    },
    /// A folder without STL files.
    #[error("{}: there is no STL file (*.stl); name the folder of the grains, a file each, or one file with all", path.display())]
    NoFile {
        /// The folder.
        path: PathBuf,
    },
    /// A file that cannot be read.
    #[error(transparent)]
    File(#[from] MeshError),
    /// A surface with holes.
    #[error(
        "{name}: the surface of {triangles} triangles has {open} open edges, so it encloses no grain; close its holes \
         (MeshLab: Close Holes; PyVista: fill_holes) and export it again"
    )]
    Open {
        /// The file.
        name: String,
        /// Number of its triangles.
        triangles: usize,
        /// Number of its open edges.
        open: usize,
    },
    /// Triangles of one surface that show to both sides.
    #[error(
        "{name}: at {edges} edges one triangle shows inward and its neighbour outward; orient all triangles alike (MeshLab: \
         Re-Orient all faces coherently; PyVista: compute_normals(consistent_normals=True)) and export it again"
    )]
    Normals {
        /// The file.
        name: String,
        /// Number of edges between triangles of opposite orientation.
        edges: usize,
    },
    /// A part that shows inward where others show outward.
    #[error(
        "{name}: {inward} of {parts} parts show inward and the others outward; turn them, or write each grain to a file of \
         its own where they are cavities"
    )]
    InvertedParts {
        /// The file.
        name: String,
        /// Number of parts that show inward.
        inward: usize,
        /// Number of all parts.
        parts: usize,
    },
    /// A surface without volume.
    #[error("{name}: the surface of {triangles} triangles encloses no volume; remove the file")]
    Flat {
        /// The file.
        name: String,
        /// Number of its triangles.
        triangles: usize,
    },
    /// Grains that overlap too much.
    #[error(
        "{pairs} pairs of grains overlap, by {:.1} % of the volume of all grains; the worst are {first} and {second}, which \
         share {:.0} % of the smaller one: remove grains that are there twice, or set least_distance_mm, to which \
         overlapping grains are shrunk",
        100.0 * share,
        100.0 * share_of_smaller
    )]
    Overlap {
        /// Number of pairs that overlap.
        pairs: usize,
        /// Their common volume over the volume of all grains.
        share: f64,
        /// A grain of the worst pair.
        first: String,
        /// The other grain of it.
        second: String,
        /// What they share over the smaller one.
        share_of_smaller: f64,
    },
    /// Two grains that shrinking does not separate.
    #[error(
        "shrinking to a fifth of their size does not bring {first} and {second} {least_mm} mm apart: remove one of the two \
         if it lies in the other, or take a smaller least_distance_mm"
    )]
    Inseparable {
        /// One grain.
        first: String,
        /// The other one.
        second: String,
        /// The distance that was asked for (mm).
        least_mm: f64,
    },
    /// A specimen that is far too large or too small for the spacing of its mesh.
    #[error(
        "the grains extend over {size_mm:.4e} mm at unit_mm = {unit_mm}, where spacing_mm = {spacing_mm}: the unit of the \
         files is probably another one{}",
        likely_mm.map(|unit| format!("; unit_mm = {unit} fits")).unwrap_or_default()
    )]
    Unit {
        /// Extent of the specimen (mm).
        size_mm: f64,
        /// Spacing of the mesh (mm).
        spacing_mm: f64,
        /// The unit that was given (mm).
        unit_mm: f64,
        /// A unit that would fit (mm).
        likely_mm: Option<f64>,
    },
}

/// The STL files of a folder in the order of the numbers in their names, or the file itself.
///
/// # Errors
/// A folder that cannot be read or has no STL file.
pub(super) fn files(path: &Path) -> Result<Vec<PathBuf>, SurfaceImportError> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let failed = |error| MeshError::io("read", path, error);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(failed)? {
        let file = entry.map_err(failed)?.path();
        let is_stl = file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("stl"));
        let is_hidden =
            file.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if is_stl && !is_hidden && file.is_file() {
            files.push(file);
        }
    }
    if files.is_empty() {
        return Err(SurfaceImportError::NoFile { path: path.to_owned() });
    }
    files.sort_by_cached_key(|file| {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        (last_number(&name), name)
    });
    Ok(files)
}

/// The last number in a name without its ending.
fn last_number(name: &str) -> u64 {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let digits = stem.split(|c: char| !c.is_ascii_digit()).rfind(|word| !word.is_empty());
    digits.and_then(|word| word.parse().ok()).unwrap_or(0)
}

/// Reads grains, each point moved by `place`: a file each in a folder, or each connected part of one file.
///
/// # Errors
/// [`SurfaceImportError`] for the first file that is no grain.
pub(super) fn read_surfaces(
    path: &Path,
    place: &(dyn Fn([f64; 3]) -> [f64; 3] + Sync),
) -> Result<Vec<NamedSurface>, SurfaceImportError> {
    let read = |file: &PathBuf| -> Result<Surface, SurfaceImportError> {
        let mut surface = Surface::new(&stl::read(file)?);
        surface.points.iter_mut().for_each(|point| *point = place(*point));
        check_edges(&surface, file)?;
        Ok(surface)
    };
    let checked = |name: String, surface: Surface| {
        let (volume, triangles) = (surface.volume(), surface.triangles.len());
        if !volume.is_finite() || volume.abs() <= f64::MIN_POSITIVE || is_flat(&surface) {
            return Err(SurfaceImportError::Flat { name, triangles });
        }
        Ok(NamedSurface { name, surface: surface.outward(), is_turned: volume < 0.0 })
    };
    let files = files(path)?;
    if path.is_dir() {
        let one = |file: &PathBuf| checked(file.display().to_string(), read(file)?);
        return files.par_iter().map(one).collect();
    }
    let mut grains = Vec::new();
    for file in &files {
        let parts = read(file)?.parts();
        let inward = parts.iter().filter(|part| part.volume() < 0.0).count();
        if inward > 0 && inward < parts.len() {
            let (name, parts) = (file.display().to_string(), parts.len());
            return Err(SurfaceImportError::InvertedParts { name, inward, parts });
        }
        for (number, part) in (1..).zip(parts) {
            grains.push(checked(format!("{}, part {number}", file.display()), part)?);
        }
    }
    Ok(grains)
}

/// Whether a surface is thinner than a part in 10⁹ of its extent.
fn is_flat(surface: &Surface) -> bool {
    let extent = |k: usize| {
        let along = surface.points.iter().map(|point| point[k]);
        let low = along.clone().fold(f64::INFINITY, f64::min);
        along.fold(f64::NEG_INFINITY, f64::max) - low
    };
    let longest = (0..3).map(extent).fold(0.0, f64::max);
    surface.volume().abs() <= 1e-9 * longest.powi(3)
}

/// Refuses surfaces with holes and surfaces whose triangles show to both sides.
fn check_edges(surface: &Surface, file: &Path) -> Result<(), SurfaceImportError> {
    let mut passes: BTreeMap<[u32; 2], [u32; 2]> = BTreeMap::new();
    for &[a, b, c] in &surface.triangles {
        for [p, q] in [[a, b], [b, c], [c, a]] {
            passes.entry([p.min(q), p.max(q)]).or_default()[usize::from(p > q)] += 1;
        }
    }
    let name = file.display().to_string();
    let open = passes.values().filter(|[forth, back]| (forth + back) % 2 == 1).count();
    if open > 0 {
        return Err(SurfaceImportError::Open { name, triangles: surface.triangles.len(), open });
    }
    let edges = passes.values().filter(|[forth, back]| forth != back).count();
    if edges > 0 {
        return Err(SurfaceImportError::Normals { name, edges });
    }
    Ok(())
}
