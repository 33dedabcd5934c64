//! Separate modes: they are reported if they exist, and only then.

use ppl::diagnostics::Modes;
use rand::{Rng, SeedableRng};
use rand_distr::{Cauchy, Exp1, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use statrs::function::erf::erfc;

use super::borrow;

fn normals(seed: u64, centre: f64, sd: f64, count: usize) -> Vec<f64> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    (0..count).map(|_| centre + sd * rng.sample::<f64, _>(StandardNormal)).collect()
}

/// Skewed, heavy-tailed, uniform and strongly autocorrelated draws have one mode, and so have chains of normal draws
/// whose means differ by half a standard deviation.
#[test]
fn one_mode_is_not_cut() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let heavy = Cauchy::new(0.0, 1.0).expect("positive scale");
    for seed in 0..20 {
        let normal: Vec<Vec<f64>> = (0..4).map(|c| normals(4 * seed + c, 0.0, 1.0, 300)).collect();
        let draw = |f: &mut dyn FnMut() -> f64| -> Vec<Vec<f64>> {
            (0..4).map(|_| (0..300).map(|_| f()).collect()).collect()
        };
        let cauchy = draw(&mut || rng.sample(heavy));
        let skewed = draw(&mut || rng.sample(Exp1));
        let flat = draw(&mut || rng.random());
        let mut x = 0.0;
        let slow = draw(&mut || {
            x = 0.9 * x + rng.sample::<f64, _>(StandardNormal);
            x
        });
        let apart: Vec<Vec<f64>> =
            (0..4).map(|c| normals(seed, 0.5 * c as f64, 1.0, 300)).collect();
        for (i, chains) in [normal, cauchy, skewed, flat, slow, apart].iter().enumerate() {
            assert_eq!(Modes::find(&borrow(chains)), None, "case {i}, seed {seed}");
        }
    }
    assert_eq!(Modes::find(&[&[2.0; 200]]), None, "a constant");
    assert_eq!(Modes::find(&[&[f64::NAN; 200]]), None);
}

/// Autocorrelated draws from a Cauchy distribution have one mode; two groups of such draws at a
/// distance of 300 have two modes.
#[test]
fn heavy_tails_are_no_modes() {
    let uniform = |x: f64| 0.5 * erfc(-x / 2_f64.sqrt());
    for seed in 0..40 {
        // an AR(1) chain with normal draws, mapped to Cauchy draws through the two distribution functions
        let chains: Vec<Vec<f64>> = (0..4)
            .map(|c| {
                let mut x = 0.0;
                let steps = normals(100 * seed + c, 0.0, 1.0, 1000).into_iter();
                let walk = steps.map(|step| {
                    x = 0.97 * x + (1.0_f64 - 0.97 * 0.97).sqrt() * step;
                    (std::f64::consts::PI * (uniform(x) - 0.5)).tan()
                });
                walk.collect()
            })
            .collect();
        assert_eq!(Modes::find(&borrow(&chains)), None, "seed {seed}");
        let moved = |c: usize, chain: &Vec<f64>| {
            chain.iter().map(|x| x + if c < 2 { 0.0 } else { 300.0 }).collect()
        };
        let apart: Vec<Vec<f64>> =
            chains.iter().enumerate().map(|(c, chain)| moved(c, chain)).collect();
        let modes = Modes::find(&borrow(&apart)).expect("two");
        assert_eq!(modes.centres.len(), 2, "seed {seed}: {modes:?}");
    }
}

/// A chain that jumps away and repeats the same few values does not form a mode; draws that vary around the same
/// values form a mode, however rarely the chain visits them.
#[test]
fn a_heap_where_a_chain_stuck_is_no_mode() {
    for seed in 0..20 {
        let mut chains: Vec<Vec<f64>> =
            (0..4).map(|c| normals(4 * seed + c, 0.0, 1.0, 500)).collect();
        let away = normals(1000 + seed, 12.0, 1.0, 100);
        for (t, x) in chains[3][200..300].iter_mut().enumerate() {
            *x = away[t / 10];
        }
        assert_eq!(Modes::find(&borrow(&chains)), None, "seed {seed}");
        chains[3][200..300].copy_from_slice(&away);
        let modes = Modes::find(&borrow(&chains)).expect("two");
        assert_eq!((modes.centres.len(), &modes.changes[..]), (2, &[0, 0, 0, 2][..]));
    }
}

/// A chain that hardly moves does not set the length scale by which the other chains are separated into modes.
#[test]
fn a_stuck_chain_makes_no_modes_of_scatter() {
    for seed in 0..20 {
        let mut chains: Vec<Vec<f64>> =
            (0..4).map(|c| normals(4 * seed + c, 0.0, 1.0, 300)).collect();
        chains[0] = (0..300).map(|t| 1e-5 * f64::from(t)).collect();
        assert_eq!(Modes::find(&borrow(&chains)), None, "seed {seed}");
    }
}

/// Three narrow modes far apart, of different widths.
#[test]
fn three_modes_and_their_chains() {
    let centres = [100.0, -30.0, 0.0, 100.0];
    let chains: Vec<Vec<f64>> =
        (0..4).map(|c| normals(c as u64, centres[c], [1.0, 3.0, 0.5, 1.0][c], 500)).collect();
    let modes = Modes::find(&borrow(&chains)).expect("three");
    for (centre, exact) in modes.centres.iter().zip([-30.0, 0.0, 100.0]) {
        assert!((centre - exact).abs() < 0.6, "{centre}, {exact}");
    }
    assert_eq!(
        (0..3).map(|m| modes.sitting_in(m)).collect::<Vec<_>>(),
        [vec![1], vec![2], vec![0, 3]]
    );
    assert_eq!(modes.changes, [0; 4]);
}

/// A chain that visits both modes often is mixed; a chain that changed the mode once is not.
#[test]
fn changes_are_counted() {
    let signs = |period: usize, seed| -> Vec<f64> {
        let noise = normals(seed, 0.0, 1.0, 600);
        let sign = |t: usize| if (t / period).is_multiple_of(2) { 6.0 } else { -6.0 };
        noise.iter().enumerate().map(|(t, x)| x + sign(t)).collect()
    };
    let fast: Vec<Vec<f64>> = (0..4).map(|seed| signs(10, seed)).collect();
    let modes = Modes::find(&borrow(&fast)).expect("two");
    assert_eq!(modes.changes, [59; 4]);
    assert!(modes.mixed() && modes.sitting_in(0).is_empty());
    let slow: Vec<Vec<f64>> = (0..4).map(|seed| signs(300, seed)).collect();
    let modes = Modes::find(&borrow(&slow)).expect("two");
    assert_eq!(modes.changes, [1; 4]);
    assert!(!modes.mixed());
    assert!(modes.fractions.iter().flatten().all(|fraction| (fraction - 0.5).abs() < 1e-9));
}
