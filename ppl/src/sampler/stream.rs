//! Random numbers of chains.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Random stream of a chain: the seed's generator after one jump of 2¹²⁸ per chain before it.
pub(super) type Stream = Xoshiro256PlusPlus;

/// The random streams of all chains.
pub(super) fn streams(seed: u64, chains: usize) -> Vec<Stream> {
    let mut stream = Stream::seed_from_u64(seed);
    let next = |_| {
        let own = stream.clone();
        stream.jump();
        own
    };
    (0..chains).map(next).collect()
}
