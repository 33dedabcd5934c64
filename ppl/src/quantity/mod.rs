//! Named quantities of a model: their values, shapes, labels and draws.

pub(crate) mod coordinates;
pub(crate) mod datum;
pub(crate) mod draws;
pub(crate) mod format;
pub(crate) mod layout;
pub(crate) mod record;
pub(crate) mod value_reader;
