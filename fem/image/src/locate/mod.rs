//! Where the specimen stands in the image, and what surrounds it.

pub(crate) mod beside;
pub(crate) mod fit;
pub(crate) mod region;
pub(crate) mod specimen;
pub(crate) mod surroundings;
