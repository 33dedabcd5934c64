//! Where the specimen stands in the image, and what surrounds it.

pub(crate) mod fit;
pub(crate) mod surroundings;
