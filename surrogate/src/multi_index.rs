//! Truncations: the sets of multi-indices of an expansion.

use std::cmp::Reverse;

use serde::{Deserialize, Serialize};

/// The set of multi-indices a of an expansion of order p.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Truncation {
    /// Total degree Σ a_j at most p: C(p + d, d) terms in d inputs.
    #[default]
    TotalDegree,
    /// Hyperbolic norm (Σ a_j^q)^(1/q) at most p, with 0 < q < 1. This set has fewer interaction terms than
    /// `TotalDegree`.
    Hyperbolic {
        /// Exponent q of the norm: a smaller q gives fewer interaction terms.
        q: f64,
    },
    /// Total degree Σ a_j at most p, and degree a_i at most r in one input i. This set is suitable if input i has only
    /// few distinct values in the runs.
    Limited {
        /// Index i of the input whose degree is limited, counted from 0.
        input: usize,
        /// Highest degree r in the limited input.
        order: u8,
    },
}

impl Truncation {
    /// The multi-indices of an order in `d` inputs, sorted by total degree. Multi-indices of equal degree are
    /// in decreasing lexicographic order.
    pub(crate) fn indices(self, d: usize, order: usize) -> Vec<Vec<u8>> {
        let mut indices = Vec::new();
        self.visit(d, order, &mut |index| indices.push(index.to_vec()));
        indices.sort_by(|a, b| graded(a).cmp(&graded(b)));
        indices
    }

    /// Number of multi-indices of an order in `d` inputs, computed without a list of the multi-indices if possible.
    pub(crate) fn count(self, d: usize, order: usize) -> usize {
        match self {
            Self::TotalDegree => {
                // C(d + p, p); the intermediate result is an integer after every step
                let count =
                    (1..=order).fold(1u128, |c, j| c.saturating_mul((d + j) as u128) / j as u128);
                count.try_into().unwrap_or(usize::MAX)
            }
            Self::Hyperbolic { .. } | Self::Limited { .. } => {
                let mut count = 0;
                self.visit(d, order, &mut |_| count += 1);
                count
            }
        }
    }

    /// Returns the multi-indices of `order`, sorted so that the multi-indices of each lower order are a prefix of the
    /// list.
    pub(crate) fn nested(self, d: usize, order: usize) -> Vec<Vec<u8>> {
        let mut indices = self.indices(d, order);
        indices.sort_by_key(|index| self.first_order(index));
        indices
    }

    /// Returns the lowest order whose set contains the multi-index.
    fn first_order(self, index: &[u8]) -> usize {
        match self {
            Self::TotalDegree => index.iter().map(|&a| usize::from(a)).sum(),
            Self::Hyperbolic { q } => {
                let sum: f64 = index.iter().map(|&a| f64::from(a).powf(q)).sum();
                // the tolerance absorbs the rounding error of the root
                (sum.powf(1.0 / q) - 1e-10).ceil().max(0.0) as usize
            }
            Self::Limited { input, order } => match index.get(input) {
                Some(&a) if a > order => usize::MAX,
                _ => Self::TotalDegree.first_order(index),
            },
        }
    }

    fn visit(self, d: usize, order: usize, call: &mut impl FnMut(&[u8])) {
        self.descend(&mut vec![0; d], 0, order, call);
    }

    /// Visits the multi-indices depth first over the inputs. The sets are downward closed, so a branch ends
    /// at the first multi-index outside the set.
    fn descend(self, index: &mut [u8], input: usize, order: usize, call: &mut impl FnMut(&[u8])) {
        if input == index.len() {
            return call(index);
        }
        while self.first_order(index) <= order {
            self.descend(index, input + 1, order, call);
            index[input] += 1;
        }
        index[input] = 0;
    }
}

/// Sort key of terms: total degree, then decreasing lexicographic order. Do not change this order, because results
/// depend on it.
pub(crate) fn graded(index: &[u8]) -> (usize, Reverse<&[u8]>) {
    (index.iter().map(|&a| usize::from(a)).sum(), Reverse(index))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_of_terms_is_the_frozen_one() {
        let expected =
            "000 100 010 001 200 110 101 020 011 002 300 210 201 120 111 102 030 021 012 003";
        let listed: Vec<String> = Truncation::TotalDegree
            .indices(3, 3)
            .iter()
            .map(|a| a.iter().map(u8::to_string).collect())
            .collect();
        assert_eq!(listed.join(" "), expected);
    }

    #[test]
    fn the_counts_are_binomial() {
        assert_eq!(Truncation::TotalDegree.indices(3, 8).len(), 165);
        assert_eq!(Truncation::TotalDegree.indices(8, 3).len(), 165);
        for order in 0..=8 {
            let t = Truncation::TotalDegree;
            assert_eq!(t.count(4, order), t.indices(4, order).len());
        }
        assert_eq!(
            Truncation::TotalDegree.count(100, 16),
            usize::try_from(binomial(116, 16)).unwrap()
        );
    }

    fn binomial(n: u128, k: u128) -> u128 {
        (1..=k).fold(1, |c, j| c * (n - k + j) / j)
    }

    #[test]
    fn an_input_may_be_limited() {
        let limited = Truncation::Limited { input: 2, order: 1 };
        let all = Truncation::TotalDegree.indices(3, 4);
        let expected: Vec<Vec<u8>> = all.into_iter().filter(|index| index[2] < 2).collect();
        assert_eq!(limited.indices(3, 4), expected);
        assert_eq!(limited.count(3, 4), expected.len());
        assert_eq!(limited.nested(3, 4), expected);
    }

    #[test]
    fn hyperbolic_sets_drop_interactions_and_nest() {
        let half = Truncation::Hyperbolic { q: 0.5 };
        // (√1 + √1)² = 4: the first interaction enters at order 4
        assert_eq!(half.indices(2, 3).len(), 7);
        assert!(half.indices(2, 4).contains(&vec![1, 1]));
        assert_eq!(half.count(2, 4), 10);
        let all = half.nested(3, 7);
        for order in 0..=7 {
            let mut prefix = all[..half.count(3, order)].to_vec();
            prefix.sort_by(|a, b| graded(a).cmp(&graded(b)));
            assert_eq!(prefix, half.indices(3, order));
        }
        assert_eq!(
            Truncation::Hyperbolic { q: 1.0 }.nested(3, 6),
            Truncation::TotalDegree.nested(3, 6)
        );
    }
}
