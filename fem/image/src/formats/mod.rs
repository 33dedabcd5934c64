//! Image formats other than TIFF, and the choice of the reader by the content of a file.
//!
//! Supported formats: MetaImage (`.mhd`, `.mha`) and NRRD (`.nrrd`, `.nhdr`), plain and compressed by gzip, HDF5, and
//! folders of PNG and BMP slices. Other formats are recognised, and the error explains how to convert them.

mod bmp;
mod detached;
mod folder;
mod hdf5;
mod kind;
mod metaimage;
mod nrrd;
mod picture_stack;
mod pictures;
mod png;
pub(crate) mod read;
