//! Formats beside TIFF, and the choice by content.
//!
//! Read are MetaImage (`.mhd`, `.mha`) and NRRD (`.nrrd`, `.nhdr`), plain and compressed by gzip, and folders of PNG
//! and BMP slices. Other formats are recognised, and the error says how they are converted.

mod bmp;
mod detached;
mod folder;
mod kind;
mod metaimage;
mod nrrd;
mod picture_stack;
mod pictures;
mod png;
pub(crate) mod read;
