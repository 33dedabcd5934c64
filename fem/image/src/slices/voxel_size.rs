//! Voxel sizes in files: checks of plausibility, and selection of the edge length that is used.

use std::path::Path;

use crate::ImageError;

/// Resolutions (pixels per inch) that programs write by default, without any measurement.
const SCREENS: [f64; 18] = [
    72.0, 75.0, 90.0, 96.0, 100.0, 120.0, 144.0, 150.0, 180.0, 200.0, 240.0, 300.0, 360.0, 400.0,
    600.0, 720.0, 1200.0, 2400.0,
];
/// Relative tolerance for the comparison of a resolution with [`SCREENS`], because some programs round pixels per
/// centimetre or metre to whole numbers.
const ROUNDING: f64 = 6e-4;
/// Range of plausible voxel sizes of tomograms (mm). A size outside this range is probably a default value (1 pixel per
/// unit) or has another unit.
const PLAUSIBLE_MM: [f64; 2] = [1e-5, 1.0];
/// Two edges of a voxel count as equal if their relative difference is at most this value.
const CUBIC: f64 = 1e-3;
/// A warning is added if the edge given by the user and the edge stated in the file differ by more than this relative
/// amount.
const AGREES: f64 = 0.01;

/// Voxel size as stated in the files of a stack.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum VoxelSize {
    Stated {
        /// Edges along x, y, z (mm).
        size_mm: [f64; 3],
        /// Name of the tag, key or standard from which the size comes.
        origin: String,
    },
    /// The files state no usable voxel size; the text is the reason.
    Unknown(String),
}

impl VoxelSize {
    /// Creates a voxel size stated in a file, or `Unknown` if the size is implausible.
    pub(crate) fn stated(size_mm: [f64; 3], origin: impl Into<String>) -> Self {
        let (origin, [least, most]) = (origin.into(), PLAUSIBLE_MM);
        let is_plausible = |edge: &f64| (least..most).contains(edge);
        if size_mm.iter().all(is_plausible) {
            return VoxelSize::Stated { size_mm, origin };
        }
        let [x, y, z] = size_mm;
        VoxelSize::Unknown(format!(
            "voxels of {x} × {y} × {z} mm ({origin}) are not plausible (allowed: {least} to {most} mm); \
             programs write such values by default"
        ))
    }

    /// Creates a voxel size from resolutions within a slice (pixels per inch); the edge along z is assumed to equal the
    /// edge along x.
    pub(crate) fn per_inch(x: f64, y: f64, origin: &str) -> Self {
        if is_screen(x) {
            let x = x.round();
            let message = format!(
                "a resolution of {x} per inch ({origin}) is typical of a screen or printer"
            );
            return VoxelSize::Unknown(message);
        }
        VoxelSize::stated([25.4 / x, 25.4 / y, 25.4 / x], origin)
    }
}

/// Returns whether a resolution is a default value of screens, printers or office scanners.
pub(crate) fn is_screen(per_inch: f64) -> bool {
    SCREENS.iter().any(|screen| (per_inch / screen - 1.0).abs() < ROUNDING)
}

/// The selected edge of a voxel, and the source of this value.
pub(super) struct Resolved {
    pub(super) edge_mm: f64,
    pub(super) origin: String,
    pub(super) warning: Option<String>,
}

/// Selects the edge of a voxel: the given value, or else the value stated in the file.
///
/// # Errors
/// [`ImageError`] for voxels of unknown size, and for voxels that are not cubes.
pub(super) fn resolve(
    path: &Path,
    stated: &VoxelSize,
    given: Option<f64>,
) -> Result<Resolved, ImageError> {
    if let Some(value) = given {
        if !(value.is_finite() && value > 0.0) {
            let requirement = "a length above 0 (mm)";
            return Err(ImageError::Parameter { field: "voxel_mm", value, requirement });
        }
        let origin = "voxel_mm as given".to_owned();
        let warning = match stated {
            VoxelSize::Stated { size_mm: [x, y, z], origin }
                if [x, y, z].into_iter().any(|edge| (edge / value - 1.0).abs() > AGREES) =>
            {
                Some(format!(
                    "Volumes and lengths are computed with voxel_mm = {value}, but {} states voxels of {x} × {y} × {z} mm ({origin}).",
                    path.display()
                ))
            }
            _ => None,
        };
        return Ok(Resolved { edge_mm: value, origin, warning });
    }
    match stated {
        VoxelSize::Unknown(message) => {
            Err(ImageError::NoVoxelSize { path: path.into(), message: message.clone() })
        }
        VoxelSize::Stated { size_mm: [x, y, z], origin } => {
            let equal = |a: f64, b: f64| (a - b).abs() <= CUBIC * a.max(b);
            if equal(*x, *y) && equal(*x, *z) {
                return Ok(Resolved { edge_mm: *x, origin: origin.clone(), warning: None });
            }
            Err(ImageError::Anisotropic { path: path.into(), size_mm: [*x, *y, *z] })
        }
    }
}

/// Returns the length of a unit (mm), or `None` for an unknown unit.
pub(crate) fn millimetres(name: &str) -> Option<f64> {
    Some(match name.trim().trim_matches('"') {
        "m" | "meter" | "metre" | "meters" | "metres" => 1000.0,
        "cm" | "centimeter" | "centimetre" => 10.0,
        "mm" | "millimeter" | "millimetre" | "millimeters" | "millimetres" => 1.0,
        "um" | "µm" | "μm" | "\\u00B5m" | "\\u00b5m" | "micron" | "microns" | "micrometer"
        | "micrometre" | "micrometers" | "micrometres" => 1e-3,
        "nm" | "nanometer" | "nanometre" => 1e-6,
        "\u{c5}" | "\u{212b}" | "angstrom" => 1e-7,
        "pm" => 1e-9,
        "inch" | "in" | "inches" => 25.4,
        _ => return None,
    })
}
