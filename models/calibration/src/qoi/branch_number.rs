//! Number of a branch in the name of a quantity.

/// Largest number of a branch that a name can state.
const MOST: u32 = 1000;

/// Number of a branch among the branches of its kind in the order of time, from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BranchNumber(u32);

impl BranchNumber {
    /// The first branch of its kind.
    pub(super) const FIRST: Self = Self(1);

    /// Creates a number from 1 to 1000.
    pub(super) fn new(number: u32) -> Option<Self> {
        (1..=MOST).contains(&number).then_some(Self(number))
    }

    /// Parses the number between `before` and `after`.
    pub(super) fn between(text: &str, before: &str, after: &str) -> Option<Self> {
        let number = text.strip_prefix(before)?.strip_suffix(after)?;
        let is_plain = number.bytes().all(|byte| byte.is_ascii_digit());
        Self::new(number.parse().ok().filter(|_| is_plain)?)
    }

    pub(super) fn get(self) -> u32 {
        self.0
    }

    /// Number of earlier branches of this kind.
    pub(super) fn earlier(self) -> usize {
        self.0 as usize - 1
    }

    /// The number behind `joint` in a name; nothing for the first branch.
    pub(super) fn suffix(self, joint: char) -> String {
        if self == Self::FIRST { String::new() } else { format!("{joint}{}", self.0) }
    }
}
