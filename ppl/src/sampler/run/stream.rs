//! Random number streams of the chains.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Random stream of a chain: a generator that is initialised with the seed and advanced by a jump of 2¹²⁸ numbers for
/// each preceding chain.
pub(crate) type Stream = Xoshiro256PlusPlus;

/// The random streams of all chains.
pub(crate) fn streams(seed: u64, chains: usize) -> Vec<Stream> {
    let mut stream = Stream::seed_from_u64(seed);
    let next = |_| {
        let current = stream.clone();
        stream.jump();
        current
    };
    (0..chains).map(next).collect()
}
