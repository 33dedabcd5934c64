//! The files of a results folder: who wrote a file, and what may be replaced, copied or removed.
//!
//! The modules know neither a material nor statistics. They hash contents, record each written file before its name
//! appears (`written`), lock what one process at a time may write, and share cores between stages that run side by side.

pub(crate) mod content_hash;
pub(crate) mod cores;
pub(crate) mod editable;
pub(crate) mod effort_file;
pub(crate) mod error;
pub(crate) mod files;
pub(crate) mod folder_copies;
pub(crate) mod locks;
pub(crate) mod pattern;
pub(crate) mod product_folder;
pub(crate) mod sources;
pub(crate) mod turns;
pub(crate) mod written;
