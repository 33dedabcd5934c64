//! Stage `segment`: segments an image (real or from a virtual scan), or reads labels of the user, and writes labelled
//! grains.

use fem::{Region, StackHeader, VOID, Volume, outlined_slice, tiff};

use super::build::{Image, Scanned, resize};
use super::images::segmented_file;
use super::specimen_grains::SpecimenGrains;
use super::{image_inputs, images};
use crate::pipeline::task::Task;
use crate::progress::{Bar, say};
use crate::report::{Raster, grain_picture, grain_sizes, side_by_side};
use crate::results_folder::error::WorkflowError;

/// Value in `solid.tif` of a voxel that is entirely grain.
pub(crate) const WHOLE: f32 = 65535.0;
/// Number of steps that a segmentation reports to the progress bar.
const STEPS: f64 = 7.0;

pub(crate) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let inputs = &task.inputs;
    inputs.is_built_in();
    let Some(scanned) = image_inputs::scanned(inputs)? else {
        return Ok("the case has no image: nothing to segment".to_owned());
    };
    let bar = Bar::new("segment", "image 1");
    let mut step = 0.0;
    let mut look = |image: &Image| {
        report_reading(task, image.header());
        match image {
            Image::Scan(grey) => write_16_bits(task, "scan.tif", grey, 1.0),
            Image::Stack(_) | Image::Labels(_) => Ok(()),
        }
    };
    let (grey, grains) = scanned.find_grains(inputs.case_path(), &mut look, &mut |name| {
        bar.set(step / STEPS, name);
        step += 1.0;
    })?;
    drop(bar);
    for warning in grains.warnings() {
        task.warn(warning);
    }
    let fractions = grains.fractions();
    write_grains(task, images::FIRST, &grey, &grains, &fractions)?;
    drop(grey);
    write_picture(task, "grains.png", &grain_picture(grains.labels()))?;
    let sizes: Vec<(f64, f64)> =
        grains.solid_grains().map(|grain| (grain.diameter_mm(), grain.volume_mm3)).collect();
    task.write("grain_sizes.svg", grain_sizes(&sizes))?;
    let words = in_words(&grains, &fractions);
    let first = *grains.cylinder();
    drop(grains);
    for (image, scanned) in images::further(inputs)? {
        task.check_interrupt()?;
        further(task, image, &scanned, [first.radius_mm, first.height_mm()])?;
    }
    Ok(words)
}

/// Prints the description of an image stack and its warnings.
fn report_reading(task: &Task<'_>, header: Option<&StackHeader>) {
    let Some(header) = header else { return };
    say("image", &header.in_words());
    header.warnings.iter().for_each(|warning| task.warn(warning));
}

/// Summarises the segmentation, with the fraction of each phase in the meshed cylinder.
fn in_words(result: &SpecimenGrains, fractions: &[(String, f64)]) -> String {
    let (s, part) = (result.statistics(), 100.0 * grain_fraction(fractions));
    let of_image = 100.0 * s.grain_fraction;
    // the fractions differ if the meshed cylinder is only part of the specimen in the image
    let others = match (part - of_image).abs() > 0.1 {
        true => format!(" ({of_image:.1} % of the specimen that the image shows)"),
        false => String::new(),
    };
    let phases = match fractions {
        [_] => String::new(),
        phases => {
            let phase = |(name, part): &(String, f64)| format!("{name} {:.1} %", 100.0 * part);
            format!(": {}", phases.iter().map(phase).collect::<Vec<_>>().join(", "))
        }
    };
    format!("{} grains, {part:.1} % of the cylinder that is meshed{others}{phases}", s.grains)
}

/// Returns the volume fraction of all phases of grains in the cylinder, voids excluded.
fn grain_fraction(fractions: &[(String, f64)]) -> f64 {
    fractions.iter().filter(|(name, _)| name != VOID).map(|(_, part)| part).sum()
}

/// Maximum relative difference between the fitted sizes of the images. Images with a larger difference do not show
/// specimens of equal size.
const LARGEST_DIFFERENCE: f64 = 0.05;

/// Segments the image of a further specimen. Its cylinder gets the radius and height (mm) of the first specimen, so
/// that runs differ only in their grains.
fn further(
    task: &Task<'_>,
    image: usize,
    scanned: &Scanned,
    size_mm: [f64; 2],
) -> Result<(), WorkflowError> {
    let inputs = &task.inputs;
    let Some(path) = scanned.source.path() else { return Ok(()) };
    let bar = Bar::new("segment", &format!("image {image}"));
    let mut step = 0.0;
    let as_fitted = Scanned {
        source: scanned.source.clone(),
        segmentation: scanned.segmentation.clone(),
        size_mm: [None; 2],
    };
    // errors name the path of this image, because image 1, which the case names in
    // `specimen.image`, was segmented without error
    let mut look = |image: &Image| {
        report_reading(task, image.header());
        Ok(())
    };
    let (grey, mut grains) = as_fitted.find_grains(path, &mut look, &mut |name| {
        bar.set(step / STEPS, name);
        step += 1.0;
    })?;
    drop(bar);
    let fitted = [grains.cylinder().radius_mm, grains.cylinder().height_mm()];
    let is_given = scanned.size_mm.iter().all(Option::is_some);
    // if the case gives a size, a cylinder of this size can be cut out of any larger specimen
    let differs = |(fitted, of_first): (&f64, &f64)| match is_given {
        true => fitted / of_first < 1.0 - LARGEST_DIFFERENCE,
        false => (fitted / of_first - 1.0).abs() > LARGEST_DIFFERENCE,
    };
    if fitted.iter().zip(&size_mm).any(differs) {
        let problem = format!(
            "shows a specimen of {:.3} mm radius and {:.3} mm height, to be compared with one of {:.3} and {:.3} mm",
            fitted[0], fitted[1], size_mm[0], size_mm[1]
        );
        let help = "Give specimen.radius_mm and height_mm of a cylinder that fits into all images, or remove this image.";
        return Err(image_inputs::refused_image(inputs, path, &problem, help));
    }
    resize(grains.cylinder_mut(), size_mm.map(Some));
    for warning in grains.warnings() {
        task.warn(&format!("{}: {warning}", path.display()));
    }
    let fractions = grains.fractions();
    write_grains(task, image, &grey, &grains, &fractions)?;
    say("segment", &format!("image {image}: {}", in_words(&grains, &fractions)));
    Ok(())
}

/// Writes the result of the segmentation of an image.
fn write_grains(
    task: &Task<'_>,
    image: usize,
    grey: &Volume<f32>,
    result: &SpecimenGrains,
    fractions: &[(String, f64)],
) -> Result<(), WorkflowError> {
    let name = |file| segmented_file(image, file);
    task.product(&name("labels.tif"), |path| tiff::write_labels(path, result.labels()))?;
    if let Some(solid) = result.solid() {
        write_16_bits(task, &name("solid.tif"), solid, WHOLE)?;
    }
    let grains = result.regions().iter().map(|grain| of_grain(result, grain));
    task.write_csv(&name("grains.csv"), GRAIN_COLUMNS, grains)?;
    let rows = quantities(result, fractions).into_iter().map(|(name, value)| [name, value]);
    task.write_csv(&name("segment.csv"), ["quantity", "value"], rows)?;
    write_picture(task, &name("slices.png"), &slices(grey, result)?)
}

/// Writes the values, multiplied by a factor and rounded, as a 16-bit image.
pub(crate) fn write_16_bits(
    task: &Task<'_>,
    name: &str,
    volume: &Volume<f32>,
    factor: f32,
) -> Result<(), WorkflowError> {
    let number = |&value: &f32| (factor * value).round().clamp(0.0, 65535.0) as u32;
    let values = volume.values.iter().map(number).collect();
    let whole = Volume { shape: volume.shape, voxel_mm: volume.voxel_mm, values };
    task.product(name, |path| tiff::write_labels(path, &whole))
}

/// Writes a picture as PNG.
pub(crate) fn write_picture(
    task: &Task<'_>,
    name: &str,
    picture: &Raster,
) -> Result<(), WorkflowError> {
    let bytes = picture.to_png().map_err(|e| WorkflowError::io(&task.path(name), e))?;
    task.write(name, bytes)
}

/// Draws three central slices, one perpendicular to the axis and two along it, with the outline of the meshed
/// cylinder.
fn slices(grey: &Volume<f32>, grains: &SpecimenGrains) -> Result<Raster, WorkflowError> {
    let mut pictures = Vec::new();
    for axis in [2, 1, 0] {
        let index = grey.shape[axis] / 2;
        let mut slice = outlined_slice(grey, grains.labels(), axis, index)?;
        slice.draw_cylinder(grains.cylinder(), grey.voxel_mm, axis, index);
        pictures.push(Raster::from_bytes(slice.width, &slice.pixels));
    }
    Ok(side_by_side(&pictures))
}

const GRAIN_COLUMNS: [&str; 15] = [
    "id",
    "volume_mm3",
    "x_mm",
    "y_mm",
    "z_mm",
    "voxels",
    "diameter_mm",
    "axis_a_mm",
    "axis_b_mm",
    "axis_c_mm",
    "surface_mm2",
    "touches_boundary",
    "neighbours",
    "phase",
    "label",
];

fn of_grain(grains: &SpecimenGrains, region: &Region) -> [String; 15] {
    let [x, y, z] = region.centroid_mm.map(|c| c.to_string());
    let [a, b, c] = region.axes_mm.map(|c| c.to_string());
    let neighbours: Vec<String> = region.neighbours.iter().map(u32::to_string).collect();
    let (phase, label) = grains.phase_and_label(region);
    [
        region.id.to_string(),
        region.volume_mm3.to_string(),
        x,
        y,
        z,
        region.voxels.to_string(),
        region.diameter_mm().to_string(),
        a,
        b,
        c,
        region.surface_mm2.to_string(),
        u8::from(region.touches_boundary).to_string(),
        neighbours.join(" "),
        phase.to_owned(),
        label.to_string(),
    ]
}

/// Returns the rows of `segment.csv`: quantities of the whole specimen.
fn quantities(result: &SpecimenGrains, fractions: &[(String, f64)]) -> Vec<(String, String)> {
    let (cylinder, s, labels) = (result.cylinder(), result.statistics(), result.labels());
    let number = |x: f64| x.to_string();
    let mut rows = vec![
        ("grains", s.grains.to_string()),
        // grain fraction of the meshed cylinder
        ("grain_fraction", number(grain_fraction(fractions))),
        // grain fraction of the whole specimen in the image
        ("image_grain_fraction", number(s.grain_fraction)),
        ("voxel_fraction", number(s.voxel_fraction)),
        ("radius_mm", number(cylinder.radius_mm)),
        ("height_mm", number(cylinder.height_mm())),
        ("centre_x_mm", number(cylinder.centre_mm[0])),
        ("centre_y_mm", number(cylinder.centre_mm[1])),
        ("bottom_mm", number(cylinder.bottom_mm)),
        ("top_mm", number(cylinder.top_mm)),
        ("lean_x", number(cylinder.lean[0])),
        ("lean_y", number(cylinder.lean[1])),
        ("volume_mm3", number(s.volume_mm3)),
        ("voxel_mm", number(labels.voxel_mm)),
        ("d10_mm", number(s.d10_mm)),
        ("d50_mm", number(s.d50_mm)),
        ("d90_mm", number(s.d90_mm)),
        ("median_diameter_mm", number(s.median_diameter_mm)),
        ("coordination", number(s.coordination)),
        ("block", u8::from(result.is_block()).to_string()),
    ];
    if let SpecimenGrains::Grey(result) = result {
        rows.push(("grain_threshold", number(result.grain_threshold)));
        rows.push(("void_fraction", number(result.void_fraction)));
        rows.push(("rim_over_centre", number(result.rim_over_centre)));
        rows.push(("top_over_bottom", number(result.top_over_bottom)));
        rows.extend(result.void_threshold.map(|grey| ("void_threshold", number(grey))));
    }
    let mut rows: Vec<(String, String)> =
        rows.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    if let SpecimenGrains::Labels(_) = result {
        let of_phase = |(name, part): &(String, f64)| (format!("fraction_{name}"), number(*part));
        rows.extend(fractions.iter().map(of_phase));
    }
    rows
}
