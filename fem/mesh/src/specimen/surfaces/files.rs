//! Reader of STL files as named closed surfaces, with checks and errors.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::error::MeshError;
use crate::mesh::{Surface, stl};

/// A grain read from a file.
pub(super) struct NamedSurface {
    /// Name of the file, followed by the number of the part if the file has several parts.
    pub(super) name: String,
    /// Surface of the grain, with normals pointing outwards.
    pub(super) surface: Surface,
    /// Whether the normals in the file pointed inwards, so that all triangles were reversed.
    pub(super) is_turned: bool,
}

/// Error of the import of grains from STL files.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceImportError {
    /// A setting is out of range.
    #[error("{field} = {value}; give {requirement}")]
    Field {
        /// Name of the setting.
        field: &'static str,
        /// Value of the setting.
        value: f64,
        /// Allowed values.
        requirement: &'static str,
    },
    /// A folder contains no STL file.
    #[error("{}: there is no STL file (*.stl); give a folder with one file per grain, or one file with all grains", path.display())]
    NoFile {
        /// Path of the folder.
        path: PathBuf,
    },
    /// A file cannot be read.
    #[error(transparent)]
    File(#[from] MeshError),
    /// A surface has holes.
    #[error(
        "{name}: the surface of {triangles} triangles has {open} open edges, so it encloses no grain; close its holes \
         (MeshLab: Close Holes; PyVista: fill_holes) and export it again"
    )]
    Open {
        /// Name of the file.
        name: String,
        /// Number of triangles of the surface.
        triangles: usize,
        /// Number of open edges of the surface.
        open: usize,
    },
    /// Triangles of one surface have inconsistent orientations.
    #[error(
        "{name}: at {edges} edges the normal of one triangle points inwards and the normal of its neighbour outwards; orient \
         all triangles consistently (MeshLab: Re-Orient all faces coherently; PyVista: compute_normals(consistent_normals=True)) and export it again"
    )]
    Normals {
        /// Name of the file.
        name: String,
        /// Number of edges between triangles of opposite orientation.
        edges: usize,
    },
    /// Some parts of a file have normals pointing inwards, others outwards.
    #[error(
        "{name}: the normals of {inward} of {parts} parts point inwards, the normals of the other parts outwards; reverse \
         the normals of these parts, or, if the parts are cavities, write each grain to a separate file"
    )]
    InvertedParts {
        /// Name of the file.
        name: String,
        /// Number of parts with normals pointing inwards.
        inward: usize,
        /// Number of all parts.
        parts: usize,
    },
    /// A surface encloses no volume.
    #[error("{name}: the surface of {triangles} triangles encloses no volume; remove the file")]
    Flat {
        /// Name of the file.
        name: String,
        /// Number of triangles of the surface.
        triangles: usize,
    },
    /// Grains overlap too much.
    #[error(
        "{pairs} pairs of grains overlap, by {:.1} % of the volume of all grains; the largest overlap, {:.0} % of the smaller \
         grain, is between {first} and {second}: remove duplicate grains, or set least_distance_mm, which shrinks \
         overlapping grains",
        100.0 * share,
        100.0 * share_of_smaller
    )]
    Overlap {
        /// Number of pairs that overlap.
        pairs: usize,
        /// Total volume of the overlaps, divided by the volume of all grains.
        share: f64,
        /// Name of one grain of the pair with the largest overlap.
        first: String,
        /// Name of the other grain of the pair with the largest overlap.
        second: String,
        /// Overlap volume of the pair with the largest overlap, divided by the volume of the smaller grain.
        share_of_smaller: f64,
    },
    /// Two grains are too close to each other, and shrinking does not separate them.
    #[error(
        "shrinking to a fifth of their size does not bring {first} and {second} {least_mm} mm apart: if one grain lies inside \
         the other grain, remove one of them; otherwise use a smaller least_distance_mm"
    )]
    Inseparable {
        /// Name of one grain.
        first: String,
        /// Name of the other grain.
        second: String,
        /// The required minimum distance (mm).
        least_mm: f64,
    },
    /// The specimen is far too large or too small for the spacing of its mesh.
    #[error(
        "with unit_mm = {unit_mm} the specimen has a size of {size_mm:.4e} mm, which does not agree with spacing_mm = {spacing_mm}: \
         unit_mm is probably wrong{}",
        likely_mm.map(|unit| format!("; unit_mm = {unit} would agree")).unwrap_or_default()
    )]
    Unit {
        /// Extent of the specimen (mm).
        size_mm: f64,
        /// Spacing of the mesh (mm).
        spacing_mm: f64,
        /// The setting `unit_mm`: the length of one unit of the files (mm).
        unit_mm: f64,
        /// A length of the unit that would be plausible (mm), if any.
        likely_mm: Option<f64>,
    },
}

/// Returns the STL files of a folder, sorted by the last number in their names, or the file itself if `path` is a
/// file.
///
/// # Errors
/// [`SurfaceImportError`] if a folder cannot be read or has no STL file.
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

/// Returns the last number in a file name without its extension; 0 for a name without a number.
fn last_number(name: &str) -> u64 {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let digits = stem.split(|c: char| !c.is_ascii_digit()).rfind(|word| !word.is_empty());
    digits.and_then(|word| word.parse().ok()).unwrap_or(0)
}

/// Reads grains and transforms each point by `transform`. In a folder each file is a grain; in a single file each
/// connected part is a grain.
///
/// # Errors
/// [`SurfaceImportError`] for the first file that is not a valid grain.
pub(super) fn read_surfaces(
    path: &Path,
    transform: &(dyn Fn([f64; 3]) -> [f64; 3] + Sync),
) -> Result<Vec<NamedSurface>, SurfaceImportError> {
    let read = |file: &PathBuf| -> Result<Surface, SurfaceImportError> {
        let mut surface = Surface::new(&stl::read(file)?);
        surface.points.iter_mut().for_each(|point| *point = transform(*point));
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
        let components = read(file)?.parts();
        let inward = components.iter().filter(|part| part.volume() < 0.0).count();
        if inward > 0 && inward < components.len() {
            let (name, parts) = (file.display().to_string(), components.len());
            return Err(SurfaceImportError::InvertedParts { name, inward, parts });
        }
        for (number, part) in (1..).zip(components) {
            grains.push(checked(format!("{}, part {number}", file.display()), part)?);
        }
    }
    Ok(grains)
}

/// Returns whether the volume of a surface is at most 10⁻⁹ times the cube of its largest extent.
fn is_flat(surface: &Surface) -> bool {
    let extent = |k: usize| {
        let along = surface.points.iter().map(|point| point[k]);
        let low = along.clone().fold(f64::INFINITY, f64::min);
        along.fold(f64::NEG_INFINITY, f64::max) - low
    };
    let longest = (0..3).map(extent).fold(0.0, f64::max);
    surface.volume().abs() <= 1e-9 * longest.powi(3)
}

/// Checks that a surface has no holes and that its triangles have consistent orientations.
fn check_edges(surface: &Surface, file: &Path) -> Result<(), SurfaceImportError> {
    let mut passes: BTreeMap<[u32; 2], [u32; 2]> = BTreeMap::new();
    for &[a, b, c] in &surface.triangles {
        for [p, q] in [[a, b], [b, c], [c, a]] {
            passes.entry([p.min(q), p.max(q)]).or_default()[usize::from(p > q)] += 1;
        }
    }
    let name = file.display().to_string();
    let open_edges = passes.values().filter(|[forth, back]| (forth + back) % 2 == 1).count();
    if open_edges > 0 {
        return Err(SurfaceImportError::Open {
            name,
            triangles: surface.triangles.len(),
            open: open_edges,
        });
    }
    let edges = passes.values().filter(|[forth, back]| forth != back).count();
    if edges > 0 {
        return Err(SurfaceImportError::Normals { name, edges });
    }
    Ok(())
}
