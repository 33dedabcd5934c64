//! Control of a run: settings, progress, random streams, rejected points, errors.

pub(crate) mod error;
pub(crate) mod progress;
pub(crate) mod rejections;
pub(crate) mod settings;
pub(crate) mod stream;
