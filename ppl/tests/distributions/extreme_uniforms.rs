//! Draws at the ends of the uniform numbers: a generator whose first word has only bits 0 or only bits 1.

use ppl::prelude::*;
use ppl::rand::{RngCore, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Random bits that begin with a given word.
struct FirstWord {
    word: Option<u64>,
    rest: Xoshiro256PlusPlus,
}

impl RngCore for FirstWord {
    fn next_u32(&mut self) -> u32 {
        self.next_u64() as u32
    }

    fn next_u64(&mut self) -> u64 {
        self.word.take().unwrap_or_else(|| self.rest.next_u64())
    }

    fn fill_bytes(&mut self, dst: &mut [u8]) {
        self.rest.fill_bytes(dst);
    }
}

fn generators() -> [FirstWord; 2] {
    let rest = Xoshiro256PlusPlus::seed_from_u64(5);
    [0, u64::MAX].map(|word| FirstWord { word: Some(word), rest: rest.clone() })
}

/// Checks that both draws lie between the bounds, which are far inside the range of `f64`.
fn assert_between(name: &str, distribution: impl Distribution<f64, Value = f64>, bounds: [f64; 2]) {
    for mut rng in generators() {
        let (word, draw) = (rng.word, distribution.draw(&mut rng));
        assert!(bounds[0] <= draw && draw <= bounds[1], "{name}: {draw:e} for the word {word:?}");
    }
}

/// A uniform number from the closed interval would give the quantiles at 0 and 1, which are infinite. The quantiles at 2⁻⁵³
/// and 1 − 2⁻⁵³ are below 1e16 for the heaviest tail.
#[test]
fn draws_by_quantiles_are_quantiles_of_the_open_interval() {
    assert_between("Cauchy", Cauchy(0.0, 1.0), [-1e16, 1e16]);
    assert_between("HalfCauchy", HalfCauchy(1.0), [1e-17, 1e16]);
    assert_between("Gumbel", Gumbel(0.0, 1.0), [-4.0, 40.0]);
    assert_between("Triangular", Triangular(-1.0, 0.5, 2.0), [-1.0, 2.0]);
    assert_between("Uniform", Uniform(-1.0, 2.0), [-1.0, 2.0]);
    assert_between("truncated above", Normal(0.0, 1.0).truncate(..1.0), [-9.0, 1.0]);
    assert_between("truncated below", Normal(0.0, 1.0).truncate(-1.0..), [-1.0, 9.0]);
    assert_between("truncated tail", StudentT(2.0, 0.0, 1.0).truncate(3.0..), [3.0, 1e9]);
}
