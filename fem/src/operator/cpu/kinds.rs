//! Kinds of elements for which the product with the tangent is compiled.

use crate::element::Rule;

/// Computation that is compiled for each kind of element.
pub(crate) trait PerKind {
    type Output;

    /// Runs the computation that is compiled for elements with `N` nodes, `C` fields per node, `D` damage points
    /// and `L` stored entries of the damage terms without gradients. `PLAIN` elements are straight, are not
    /// mixtures, and have no tangent terms of viscoelastic and plastic laws.
    fn for_kind<const PLAIN: bool, const N: usize, const C: usize, const D: usize, const L: usize>(
        self,
    ) -> Self::Output;
}

/// Selects the kind of element (plain or not, number of nodes, fields and damage points) from a
/// quadrature rule, and runs the computation for this kind.
#[inline(always)]
pub(crate) fn for_kind<W: PerKind>(rule: &Rule, plain: bool, work: W) -> W::Output {
    let damage = rule.damage.len();
    // without damage and without tangent terms of inelastic laws, elements that are not plain store the
    // same data as plain elements
    if plain || (damage == 0 && !rule.extra.stored) {
        match (rule.nodes, damage) {
            (4, 0) => work.for_kind::<true, 4, 3, 0, 0>(),
            (4, _) => work.for_kind::<true, 4, 4, 4, 1>(),
            (_, 0) => work.for_kind::<true, 10, 3, 0, 0>(),
            (_, 10) => work.for_kind::<true, 10, 4, 10, 10>(),
            (_, 11) => work.for_kind::<true, 10, 4, 11, 11>(),
            _ => work.for_kind::<true, 10, 4, 14, 14>(),
        }
    } else {
        match (rule.nodes, damage) {
            (4, 0) => work.for_kind::<false, 4, 3, 0, 0>(),
            (10, 0) => work.for_kind::<false, 10, 3, 0, 0>(),
            (4, _) => work.for_kind::<false, 4, 4, 4, 1>(),
            (_, 10) => work.for_kind::<false, 10, 4, 10, 10>(),
            (_, 11) => work.for_kind::<false, 10, 4, 11, 11>(),
            _ => work.for_kind::<false, 10, 4, 14, 14>(),
        }
    }
}
