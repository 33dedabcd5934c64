//! Check of the mask of an image.

use std::path::Path;

use fem::{ReadOptions, StackHeader};

use crate::case::CaseFile;

/// Reads the header of the mask `region.mask`, which must have the size of the image, and describes the mask. The voxel size
/// of its file is not used. `image` is the header of the image, if the image can be read.
///
/// # Errors
/// The message of the error, if the mask cannot be read or has another size than the image.
pub(crate) fn mask_in_words(
    file: &CaseFile,
    mask: &Path,
    image: Option<&StackHeader>,
) -> Result<String, String> {
    let bin = image.map_or(1, |image| image.bin);
    let voxel_mm = image.map_or(1.0, |image| image.voxel_mm / bin as f64);
    let options = ReadOptions { voxel_mm: Some(voxel_mm), bin, dataset: None };
    let header = StackHeader::read(mask, &options).map_err(|error| error.to_string())?;
    let in_voxels = |[nx, ny, nz]: [usize; 3]| format!("{nx} × {ny} × {nz} voxels");
    let shape = in_voxels(header.shape);
    match image.filter(|image| image.shape != header.shape) {
        Some(image) => {
            let problem = format!("has {shape}, but the image has {}", in_voxels(image.shape));
            let help = "Give one value to each voxel of the image.";
            let key = "specimen.image.region.mask";
            Err(file.error(key, mask.display().to_string(), problem, help).to_string())
        }
        None => Ok(format!("{}: {}; {shape}", mask.display(), header.contents)),
    }
}
