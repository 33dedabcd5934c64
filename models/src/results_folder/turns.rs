//! Assignment of specimens to the runs of a design that has fewer specimens than runs.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Constant that makes the random order of the specimens independent of the random numbers of the design, which have the
/// same seed.
const STREAM: u64 = 0x7475_726e;

/// Returns the specimen of each run, counted from 0. In each round every specimen gets one run, in a new random order.
/// The assignment of the first runs does not depend on the number of runs.
///
/// A fixed order in all rounds could coincide with the structure of the design: in a Sobol sequence, all points 4k + i
/// (fixed i) lie in the same half of the first input, so that the effect of this input could not be distinguished from
/// the effect of four specimens in a fixed order.
pub(crate) fn in_turn(runs: usize, specimens: usize, seed: u64) -> Vec<usize> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed ^ STREAM);
    let mut round: Vec<usize> = (0..specimens).collect();
    let mut turns = Vec::with_capacity(runs + specimens);
    while turns.len() < runs && specimens > 0 {
        round.shuffle(&mut rng);
        turns.extend(&round);
    }
    turns.truncate(runs);
    turns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_round_has_every_specimen_and_more_runs_begin_alike() {
        let turns = in_turn(32, 5, 7);
        for round in turns.chunks_exact(5) {
            let mut round = round.to_vec();
            round.sort_unstable();
            assert_eq!(round, [0, 1, 2, 3, 4]);
        }
        assert_eq!(in_turn(13, 5, 7), turns[..13]);
        assert_ne!(in_turn(32, 5, 8), turns);
        assert_eq!(in_turn(3, 1, 7), [0, 0, 0]);
    }

    /// All points 4k + i (fixed i) of a Sobol sequence lie in the same half of the first input.
    #[test]
    fn specimens_are_not_mixed_up_with_the_order_of_a_design() {
        let input = surrogate::Input::new("x", 0.0, 1.0).unwrap();
        let design = surrogate::DesignMethod::Sobol.sample(&[input], 64, 1).unwrap();
        let in_lower_half = |turns: &[usize], specimen: usize| {
            let points_of_specimen =
                design.iter().zip(turns).filter(|(_, turn)| **turn == specimen);
            points_of_specimen.filter(|(x, _)| x[0] < 0.5).count()
        };
        let fixed: Vec<usize> = (0..64).map(|i| i % 4).collect();
        let drawn = in_turn(64, 4, 1);
        for specimen in 0..4 {
            assert!([0, 16].contains(&in_lower_half(&fixed, specimen)));
            // random assignment: of 16 runs, 8 are expected in the lower half, with a standard deviation of 2
            assert!(in_lower_half(&drawn, specimen).abs_diff(8) < 8, "{drawn:?}");
        }
    }
}
