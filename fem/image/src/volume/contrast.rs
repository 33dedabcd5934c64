//! Which of the materials of an image is brighter.

/// Which of grains and matrix is brighter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Contrast {
    /// Grains are brighter than the matrix, and the matrix is brighter than air.
    #[default]
    Bright,
    /// Grains are darker than the matrix, and air is darker than grains. Where air surrounds a cylinder and is the brightest,
    /// grey values are inverted: then matrix is darker than air, and grains are darker than matrix.
    Dark,
}
