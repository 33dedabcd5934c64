//! Hash of the content of an input or a product, from which changes are detected.

use std::io::{BufRead, BufReader};
use std::path::Path;

/// Number of bytes that are read from a file at once. Files are read in portions because a file may
/// be larger than the memory.
const PORTION: usize = 1 << 20;

/// FNV-1a hash of a sequence of entries, each followed by its length.
///
/// The hash detects stale files; the hash is not cryptographic. Reference: Fowler, Noll & Vo,
/// <http://www.isthe.com/chongo/tech/comp/fnv/>.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ContentHash(u64);

impl ContentHash {
    /// Hash of an empty sequence.
    pub(crate) const EMPTY: Self = Self(0xcbf2_9ce4_8422_2325);

    /// Hash of a text.
    pub(crate) fn of(text: &str) -> Self {
        Self::EMPTY.bytes(text.as_bytes())
    }

    /// Hash of a file with this content.
    pub(crate) fn of_bytes(content: &[u8]) -> Self {
        Self::EMPTY.bytes(content)
    }

    /// Hash of a file, or of a folder with the names and contents of all files in it.
    pub(crate) fn of_path(path: &Path) -> std::io::Result<Self> {
        Self::EMPTY.path(path)
    }

    fn bytes(self, bytes: &[u8]) -> Self {
        self.portion(bytes).end(bytes.len() as u64)
    }

    /// Adds bytes of an entry.
    fn portion(mut self, bytes: &[u8]) -> Self {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        self
    }

    /// Ends an entry by adding its length, which separates it from the next entry.
    fn end(self, length: u64) -> Self {
        self.portion(&length.to_le_bytes())
    }

    fn file(mut self, path: &Path) -> std::io::Result<Self> {
        let mut reader = BufReader::with_capacity(PORTION, fem::open_regular(path)?);
        let mut length = 0;
        loop {
            let portion = reader.fill_buf()?;
            let count = portion.len();
            if count == 0 {
                return Ok(self.end(length));
            }
            self = self.portion(portion);
            length += count as u64;
            reader.consume(count);
        }
    }

    fn path(self, path: &Path) -> std::io::Result<Self> {
        if !path.is_dir() {
            return self.file(path);
        }
        let mut names = std::fs::read_dir(path)?
            .map(|entry| Ok(entry?.file_name()))
            .collect::<std::io::Result<Vec<_>>>()?;
        names.sort();
        names
            .into_iter()
            .try_fold(self, |sum, name| sum.bytes(name.as_encoded_bytes()).path(&path.join(&name)))
    }
}

impl std::fmt::Display for ContentHash {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

impl std::str::FromStr for ContentHash {
    type Err = std::num::ParseIntError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        u64::from_str_radix(text, 16).map(Self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_value_of_fnv_1a() {
        // the empty entry adds only its length, eight zero bytes, i.e. eight multiplications
        let prime = 0x0100_0000_01b3_u64;
        let expected = (0..8).fold(ContentHash::EMPTY.0, |hash, _| hash.wrapping_mul(prime));
        assert_eq!(ContentHash::of("").0, expected);
        // "a" has the published hash af63dc4c8601ec8c before its length is added
        let a = (ContentHash::EMPTY.0 ^ 0x61).wrapping_mul(prime);
        assert_eq!(a, 0xaf63_dc4c_8601_ec8c);
    }

    #[test]
    fn entries_do_not_run_together() {
        let hash_of = |entries: [&str; 2]| {
            entries.iter().fold(ContentHash::EMPTY, |sum, e| sum.bytes(e.as_bytes()))
        };
        assert_ne!(hash_of(["ab", "c"]), hash_of(["a", "bc"]));
        assert_eq!(hash_of(["ab", "c"]), hash_of(["ab", "c"]));
    }

    #[test]
    fn a_file_is_its_bytes_in_whatever_portions() {
        let file = tempfile::NamedTempFile::new().unwrap();
        for length in [0, 1, PORTION - 1, PORTION, 2 * PORTION + 17] {
            let bytes: Vec<u8> = (0..length).map(|n| (n * n % 251) as u8).collect();
            std::fs::write(file.path(), &bytes).unwrap();
            let computed = ContentHash::of_path(file.path()).unwrap();
            assert_eq!(computed, ContentHash::EMPTY.bytes(&bytes), "{length} bytes");
        }
    }

    #[test]
    fn a_folder_is_its_names_and_contents() {
        let dir = tempfile::tempdir().unwrap();
        let hash = || ContentHash::of_path(dir.path()).unwrap();
        std::fs::write(dir.path().join("a"), "1").unwrap();
        std::fs::write(dir.path().join("b"), "2").unwrap();
        let whole = hash();
        std::fs::write(dir.path().join("b"), "3").unwrap();
        assert_ne!(hash(), whole);
        std::fs::write(dir.path().join("b"), "2").unwrap();
        assert_eq!(hash(), whole);
        std::fs::rename(dir.path().join("b"), dir.path().join("c")).unwrap();
        assert_ne!(hash(), whole);
    }
}
