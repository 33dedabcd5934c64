//! The kinds of elements for which the product is compiled.

use crate::element::Rule;

/// What is done with the product of a kind of element.
pub(super) trait OfKind {
    type Output;

    /// `PLAIN` elements or not, of `N` nodes with `C` fields, `D` damage points and `L` numbers of their
    /// local part.
    fn of_kind<const PLAIN: bool, const N: usize, const C: usize, const D: usize, const L: usize>(
        self,
    ) -> Self::Output;
}

/// Does it for the elements of a rule.
#[inline(always)]
pub(super) fn of_kind<W: OfKind>(rule: &Rule, plain: bool, work: W) -> W::Output {
    let damage = rule.damage.len();
    // without damage nothing else is read of curved elements or mixtures
    if plain || damage == 0 {
        match (rule.nodes, damage) {
            (4, 0) => work.of_kind::<true, 4, 3, 0, 0>(),
            (4, _) => work.of_kind::<true, 4, 4, 4, 1>(),
            (_, 0) => work.of_kind::<true, 10, 3, 0, 0>(),
            (_, 10) => work.of_kind::<true, 10, 4, 10, 10>(),
            (_, 11) => work.of_kind::<true, 10, 4, 11, 11>(),
            _ => work.of_kind::<true, 10, 4, 14, 14>(),
        }
    } else {
        match (rule.nodes, damage) {
            (4, _) => work.of_kind::<false, 4, 4, 4, 1>(),
            (_, 10) => work.of_kind::<false, 10, 4, 10, 10>(),
            (_, 11) => work.of_kind::<false, 10, 4, 11, 11>(),
            _ => work.of_kind::<false, 10, 4, 14, 14>(),
        }
    }
}
