//! TIFF stacks: a file of many pages, or a folder of files with one page each.
//!
//! Supported pages: grey, with 8, 16, 32 or 64 bits, unsigned, signed or floating-point, in strips or tiles,
//! uncompressed or compressed by LZW, deflate, PackBits, CCITT or ZSTD, as TIFF or BigTIFF.
//!
//! [`crate::read`] also supports other formats, describes the stack and checks its continuity.

mod describe;
mod page;
mod read;
pub(crate) mod stack;
mod write;
mod zstd;

pub use read::{read, read_binned, read_labels};
pub use write::write_labels;
