//! Scrambled Sobol points: a digital sequence in base 2.

use rand::Rng;

/// Largest dimension for which direction numbers are tabulated.
pub(crate) const MAX_DIMENSION: usize = 21;

/// Binary digits of a coordinate; `f64` represents all multiples of 2^−52 in [0, 1) exactly.
const BITS: u32 = 52;

/// Number of columns of the generating matrices. With 40 columns, the sequence ends after 2^40 points.
const COLUMNS: usize = 40;

/// Primitive polynomials and initial direction numbers of the dimensions 2, 3, …. An entry is (`a`, `m`): the
/// polynomial x^s + a_1 x^(s−1) + … + a_(s−1) x + 1 has the inner coefficients a_1 … a_(s−1) as the bits of
/// `a`, and `m` has s initial numbers. From the table "new-joe-kuo-6.21201" of Joe & Kuo, SIAM J. Sci.
/// Comput. 30 (2008) 2635–2654, doi:10.1137/070709359. Dimension 1 is the van der Corput sequence.
const TABLE: [(u64, &[u64]); MAX_DIMENSION - 1] = [
    (0, &[1]),
    (1, &[1, 3]),
    (1, &[1, 3, 1]),
    (2, &[1, 1, 1]),
    (1, &[1, 1, 3, 3]),
    (4, &[1, 3, 5, 13]),
    (2, &[1, 1, 5, 5, 17]),
    (4, &[1, 1, 5, 5, 5]),
    (7, &[1, 1, 7, 11, 19]),
    (11, &[1, 1, 5, 1, 1]),
    (13, &[1, 1, 1, 3, 11]),
    (14, &[1, 3, 5, 5, 31]),
    (1, &[1, 3, 3, 9, 7, 49]),
    (13, &[1, 1, 1, 15, 21, 21]),
    (16, &[1, 3, 1, 13, 27, 49]),
    (19, &[1, 1, 1, 15, 7, 5]),
    (22, &[1, 3, 1, 15, 13, 25]),
    (25, &[1, 1, 5, 5, 19, 61]),
    (1, &[1, 3, 7, 11, 23, 15, 103]),
    (4, &[1, 3, 7, 13, 13, 15, 69]),
];

/// Returns the columns of the generating matrix of one dimension. Each column is a number of [`BITS`] binary digits;
/// the first row of the matrix is the most significant digit.
fn direction_numbers(dimension: usize) -> [u64; COLUMNS] {
    let mut m = [1u64; COLUMNS];
    if dimension > 0 {
        let (a, initial) = TABLE[dimension - 1];
        let s = initial.len();
        m[..s].copy_from_slice(initial);
        for k in s..COLUMNS {
            m[k] = m[k - s] ^ (m[k - s] << s);
            for i in 1..s {
                if a >> (s - 1 - i) & 1 == 1 {
                    m[k] ^= m[k - i] << i;
                }
            }
        }
    }
    std::array::from_fn(|k| m[k] << (BITS - 1 - k as u32))
}

/// Iterator over the points of a Sobol sequence, randomised once.
///
/// Each dimension's generating matrix is multiplied by a random lower triangular matrix with unit diagonal (linear
/// matrix scramble). Then a random number is added digit by digit (digital shift). Scramble and shift preserve the
/// equidistribution of the sequence (the net property); the shift makes each point uniform on the cube.
pub(crate) struct ScrambledSobol {
    columns: Vec<[u64; COLUMNS]>,
    state: Vec<u64>,
    index: u64,
}

impl ScrambledSobol {
    pub(crate) fn new<R: Rng>(dimension: usize, rng: &mut R) -> Self {
        let (mut columns, mut state) = (Vec::new(), Vec::new());
        for d in 0..dimension {
            // row r of the scramble matrix depends on digits 0..=r, counted from the most significant
            let rows: [u64; BITS as usize] = std::array::from_fn(|r| {
                let digit = 1u64 << (BITS - 1 - r as u32);
                let above = ((1u64 << BITS) - 1) & !(2 * digit - 1);
                (rng.random::<u64>() & above) | digit
            });
            columns.push(direction_numbers(d).map(|v| {
                rows.iter()
                    .fold(0, |digits, row| digits << 1 | u64::from((row & v).count_ones() & 1))
            }));
            state.push(rng.random::<u64>() >> (64 - BITS));
        }
        Self { columns, state, index: 0 }
    }
}

impl Iterator for ScrambledSobol {
    type Item = Vec<f64>;

    fn next(&mut self) -> Option<Vec<f64>> {
        let point = self.state.iter().map(|&s| s as f64 / (1u64 << BITS) as f64).collect();
        self.index += 1;
        // in Gray-code order consecutive points differ by one column of the generating matrix
        let changed = self.index.trailing_zeros() as usize;
        for (state, columns) in self.state.iter_mut().zip(&self.columns) {
            *state ^= columns.get(changed)?;
        }
        Some(point)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use rand::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    fn sequence(dimension: usize, n: usize, seed: u64) -> Vec<Vec<f64>> {
        ScrambledSobol::new(dimension, &mut Xoshiro256PlusPlus::seed_from_u64(seed))
            .take(n)
            .collect()
    }

    /// Compares the first ten points in three dimensions with the points that the authors of the table published.
    #[test]
    fn without_scramble_the_points_are_the_published_ones() {
        let published = [
            [0.0, 0.0, 0.0],
            [0.5, 0.5, 0.5],
            [0.75, 0.25, 0.25],
            [0.25, 0.75, 0.75],
            [0.375, 0.375, 0.625],
            [0.875, 0.875, 0.125],
            [0.625, 0.125, 0.875],
            [0.125, 0.625, 0.375],
            [0.1875, 0.3125, 0.9375],
            [0.6875, 0.8125, 0.4375],
        ];
        let columns = (0..3).map(direction_numbers).collect();
        let plain = ScrambledSobol { columns, state: vec![0; 3], index: 0 };
        assert_eq!(plain.take(10).collect::<Vec<_>>(), published);
    }

    /// Returns all ways to distribute `total` digits over `coordinates` coordinates.
    fn splits(total: u32, coordinates: usize) -> Vec<Vec<u32>> {
        if coordinates == 1 {
            return vec![vec![total]];
        }
        (0..=total)
            .flat_map(|first| {
                splits(total - first, coordinates - 1).into_iter().map(move |mut rest| {
                    rest.insert(0, first);
                    rest
                })
            })
            .collect()
    }

    /// Tests the definition of a (t, m, s)-net: each elementary interval of volume 2^(t−m) contains 2^t points. For
    /// Sobol sequences t ≤ Σ (degree − 1) over the primitive polynomials: 0, 0, 1, 3, 5 for 1 to 5 dimensions.
    #[test]
    fn the_points_are_nets_of_the_known_quality() {
        let m = 9;
        for (dimension, t) in [(1, 0), (2, 0), (3, 1), (4, 3), (5, 5)] {
            let sequence = sequence(dimension, 1 << m, 17);
            for split in splits(m - t, dimension) {
                let mut counts = vec![0; 1 << (m - t)];
                for p in &sequence {
                    let cell = p.iter().zip(&split).fold(0, |cell, (x, &digits)| {
                        (cell << digits) + (x * f64::from(1u32 << digits)) as usize
                    });
                    counts[cell] += 1;
                }
                assert!(counts.iter().all(|&c| c == 1 << t), "{dimension} {split:?}");
            }
        }
    }

    #[test]
    fn every_dimension_is_stratified() {
        let m = 10;
        let sequence = sequence(MAX_DIMENSION, 1 << m, 2);
        for d in 0..MAX_DIMENSION {
            let cells: HashSet<usize> =
                sequence.iter().map(|p| (p[d] * f64::from(1 << m)) as usize).collect();
            assert_eq!(cells.len(), 1 << m, "dimension {d}");
        }
    }

    /// Tests property A of the Joe–Kuo numbers in s dimensions: each of the 2^s orthants contains one of the first
    /// 2^s points.
    #[test]
    fn the_first_points_visit_every_orthant() {
        for dimension in [2, 5, 10, 16, 18] {
            let orthants: HashSet<usize> = sequence(dimension, 1 << dimension, 23)
                .iter()
                .map(|p| p.iter().fold(0, |bits, x| bits << 1 | usize::from(*x >= 0.5)))
                .collect();
            assert_eq!(orthants.len(), 1 << dimension, "{dimension} dimensions");
        }
    }

    /// Tests that each polynomial x^s + … + 1 is primitive, that is, that the order of x modulo this polynomial is
    /// 2^s − 1.
    #[test]
    fn the_polynomials_are_primitive_and_the_numbers_admissible() {
        for (a, m) in TABLE {
            let s = m.len();
            let polynomial = 1 << s | a << 1 | 1;
            let mut power = 1u64;
            let mut order = 0;
            loop {
                power <<= 1;
                if power >> s & 1 == 1 {
                    power ^= polynomial;
                }
                order += 1;
                if power == 1 {
                    break;
                }
            }
            // for degree 1 the order is 2^1 − 1 = 1, because x equals 1 modulo x + 1
            assert_eq!(order, (1 << s) - 1, "{polynomial:b}");
            for (k, &m) in m.iter().enumerate() {
                assert!(m % 2 == 1 && m < 2 << k);
            }
        }
    }
}
