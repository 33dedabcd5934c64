//! TIFF stacks: a file of many pages, or a folder of files with one page each.
//!
//! Read are grey pages of 8, 16, 32 and 64 bits, unsigned, signed and floating, in strips or tiles,
//! uncompressed or by LZW, deflate, PackBits or CCITT, as TIFF or BigTIFF.

mod page;
mod read;
mod resolution;
mod stack;
mod write;

pub use read::{StackHeader, read, read_binned, read_label_values, read_labels};
pub use write::write_labels;
