//! TIFF stacks: a file of many pages, or a folder of files with one page each.
//!
//! Read are grey pages of 8, 16, 32 and 64 bits, unsigned, signed and floating, in strips or tiles,
//! uncompressed or by LZW, deflate, PackBits, CCITT or ZSTD, as TIFF or BigTIFF.
//!
//! [`crate::read`] reads other formats too, describes what was read and checks its continuity.

mod describe;
mod page;
mod read;
pub(crate) mod stack;
mod write;
mod zstd;

pub use read::{read, read_binned, read_labels};
pub use write::write_labels;
