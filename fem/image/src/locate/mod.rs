//! Location of the specimen in the image, and detection of its surroundings.

pub(crate) mod beside;
pub(crate) mod beyond;
pub(crate) mod fit;
pub(crate) mod region;
pub(crate) mod specimen;
pub(crate) mod surroundings;
