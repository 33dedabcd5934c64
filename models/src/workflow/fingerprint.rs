//! What a stage was made from, as one number: a stage is done again when it changes.

use std::path::Path;

use serde::Serialize;

use super::WorkflowError;

/// FNV-1a over everything that decides a stage's result.
///
/// Reference: Fowler, Noll & Vo, <http://www.isthe.com/chongo/tech/comp/fnv/>. It guards against
/// stale files, not against malice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Fingerprint(u64);

impl Fingerprint {
    /// Starts from the program's version: another version may compute something else.
    pub(crate) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325).bytes(env!("CARGO_PKG_VERSION").as_bytes())
    }

    fn bytes(mut self, bytes: &[u8]) -> Self {
        // the length separates one entry from the next
        for byte in bytes.iter().copied().chain((bytes.len() as u64).to_le_bytes()) {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        self
    }

    /// Adds a part of the case.
    pub(crate) fn part(self, part: &impl Serialize) -> Self {
        let text = serde_json::to_string(part).expect("parts of a case are plain data");
        self.bytes(text.as_bytes())
    }

    /// Adds a file's content.
    pub(crate) fn file(self, path: &Path) -> Result<Self, WorkflowError> {
        std::fs::read(path).map(|bytes| self.bytes(&bytes)).map_err(|e| WorkflowError::io(path, &e))
    }
}

impl std::fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_value_of_fnv_1a() {
        // the empty entry leaves only its length, eight zero bytes: eight multiplications
        let start = Fingerprint(0xcbf2_9ce4_8422_2325);
        let prime = 0x0100_0000_01b3_u64;
        let expected = (0..8).fold(start.0, |hash, _| hash.wrapping_mul(prime));
        assert_eq!(start.bytes(b"").0, expected);
        // "a" has the published hash af63dc4c8601ec8c before its length is added
        let a = (start.0 ^ 0x61).wrapping_mul(prime);
        assert_eq!(a, 0xaf63_dc4c_8601_ec8c);
    }

    #[test]
    fn entries_do_not_run_together() {
        let start = Fingerprint::new();
        assert_ne!(start.part(&"ab").part(&"c"), start.part(&"a").part(&"bc"));
        assert_eq!(start.part(&"ab"), start.part(&"ab"));
    }
}
