//! Selection of the files in a folder that form the stack.

use std::path::{Path, PathBuf};

use super::kind::{Kind, kind_of};
use crate::ImageError;
use crate::listing::listed;
use crate::slices::names::file_name;

/// Kind of stack that a folder contains, with the files of the stack.
#[derive(Debug)]
pub(super) enum Contents {
    Tiff(Vec<PathBuf>),
    Png(Vec<PathBuf>),
    Bmp(Vec<PathBuf>),
    /// A file that describes a whole volume, and its kind.
    Volume(PathBuf, Kind),
}

/// Selects the slices of a folder; also returns a warning about other images that are ignored.
///
/// # Errors
/// [`ImageError::Io`] if the folder cannot be read; [`ImageError::Empty`], [`ImageError::Series`] or
/// [`ImageError::Format`] if it does not contain exactly one readable stack.
pub(super) fn contents(folder: &Path) -> Result<(Contents, Option<String>), ImageError> {
    let failed = |source| ImageError::io("read", folder, source);
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        paths.push(entry.map_err(failed)?.path());
    }
    paths.sort();
    if paths
        .iter()
        .any(|path| [".zarray", ".zgroup", "zarr.json"].contains(&file_name(path).as_str()))
    {
        let help = format!(
            "write the array as a TIFF stack in Python: import tifffile, zarr; tifffile.imwrite(\"scan.tif\", zarr.open(\"{}\")[...]), and give voxel_mm",
            file_name(folder)
        );
        return Err(ImageError::Format { path: folder.into(), format: "a Zarr array", help });
    }
    let (mut tiff, mut png, mut bmp, mut volumes) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (mut foreign, mut folders) = (None, Vec::new());
    for path in paths {
        if file_name(&path).starts_with('.') {
            continue;
        }
        if path.is_dir() {
            folders.push(file_name(&path));
            continue;
        }
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        // a damaged file still counts as a slice; the reader of the slice reports the damage
        match extension.as_str() {
            "tif" | "tiff" => tiff.push(path),
            "png" => png.push(path),
            "bmp" => bmp.push(path),
            _ => match kind_of(&path)? {
                Kind::Tiff => tiff.push(path),
                Kind::Png => png.push(path),
                Kind::Bmp => bmp.push(path),
                kind @ (Kind::MetaImage | Kind::Nrrd | Kind::Hdf5) => volumes.push((path, kind)),
                Kind::Foreign(format, help) => {
                    foreign.get_or_insert((path, format, help));
                }
                Kind::Unknown => {}
            },
        }
    }
    let ignored = |groups: &[(&str, &Vec<PathBuf>)]| {
        let all = groups.iter().filter(|(_, paths)| !paths.is_empty());
        let all: Vec<String> = all.map(|(name, paths)| format!("{} {name}", paths.len())).collect();
        (!all.is_empty()).then(|| {
            format!(
                "The wrong images are read if the scan is among the ignored images of the folder: {}.",
                all.join(", ")
            )
        })
    };
    if !tiff.is_empty() {
        let note = ignored(&[("PNG", &png), ("BMP", &bmp)]);
        return Ok((Contents::Tiff(tiff), note));
    }
    if !png.is_empty() {
        let note = ignored(&[("BMP", &bmp)]);
        return Ok((Contents::Png(png), note));
    }
    if !bmp.is_empty() {
        return Ok((Contents::Bmp(bmp), None));
    }
    let path = folder.to_owned();
    match (volumes.len(), foreign) {
        (1, _) => {
            let (volume, kind) = volumes.swap_remove(0);
            Ok((Contents::Volume(volume, kind), None))
        }
        (0, Some((path, format, help))) => Err(ImageError::Format { path, format, help }),
        (0, None) if !folders.is_empty() => {
            let help = "give the folder that contains the slices";
            Err(ImageError::Series {
                path,
                message: format!(
                    "the folder contains no slice, only the folders {}",
                    listed(&folders, ", ")
                ),
                help,
            })
        }
        (0, None) => {
            let help = "a folder must contain one .tif, .tiff, .png or .bmp file for each slice";
            Err(ImageError::Empty { path, what: "slice", help })
        }
        (many, _) => {
            let message = format!("the folder contains {many} files of volumes");
            Err(ImageError::Series { path, message, help: "give the path of one file" })
        }
    }
}
