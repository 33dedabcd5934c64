//! `[specimen.image]`: an image of a specimen, and how its grains are found.

use std::path::PathBuf;

use fem::Segmentation;
use serde::{Deserialize, Serialize};

/// `[specimen.image]`: where grey values come from, and how grains are found in them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImageCase {
    /// A TIFF file of many pages, or a folder of slices; without it `[specimen.scan]` makes the image.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stack: Option<PathBuf>,
    /// Edge of a voxel in mm; without it the file's tags say it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub voxel_mm: Option<f64>,
    /// How grains are found.
    #[serde(flatten)]
    pub segmentation: Segmentation,
}
