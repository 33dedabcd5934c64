//! Rows that stand for normal observations about linear predictors: what the density and its
//! gradient are with them, against all data over a tape and over dual numbers.

mod sums;

use std::sync::atomic::{AtomicUsize, Ordering};

use ppl::prelude::*;
use ppl::{Bound, Model, Workspace};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

struct House {
    county: usize,
    floor: f64,
    size: f64,
}

ppl::model! {
    fn line(x: &[f64], y: &[f64]) {
        let a ~ Normal(0.0, 3.0);
        let b ~ Normal(0.0, 3.0);
        let sd ~ HalfNormal(2.0);
        for i in 0..x.len() {
            y[i] ~ Normal(a + b * x[i], sd);
        }
    }

    /// Every kind of summand: signs, quotients, data alone, the same column twice.
    fn summands(x: &[f64], w: &[f64], y: &[f64], centre: f64) {
        let a ~ Normal(0.0, 3.0);
        let b ~ Normal(0.0, 3.0).array::<2>();
        let c ~ HalfNormal(1.0);
        for (i, (x, w)) in x.iter().zip(w.iter()).enumerate() {
            let shifted = x - centre;
            let away = *w * 2.0;
            let slope = b[0] - c * 0.5;
            y[i] ~ Normal(-(a - 3.0 * c.exp()) / 2.0 + slope * shifted / (1.0 + away) - away * b[1]
                + 0.25 * shifted - (b[0] + b[1] * x), (c + 1.0).sqrt());
        }
    }

    fn dots(rows: &[[f64; 3]], others: &[Vec<f64>], y: &[f64]) {
        let b ~ Normal(0.0, 2.0).array::<3>();
        let d ~ Normal(0.0, 2.0).iid(2);
        let sd ~ HalfNormal(2.0);
        for ((row, other), y) in rows.iter().zip(others).zip(y) {
            y ~ Normal(dot(row, &b) - 2.0 * dot(other, &d) + d[0], sd);
        }
    }

    /// Unknowns by group, not centred, and a slope for every group.
    fn grouped(counties: usize, houses: &[House], y: &[f64]) {
        let mu ~ Normal(0.0, 3.0);
        let tau ~ HalfNormal(1.0).array::<2>();
        let z ~ Normal(0.0, 1.0).iid(counties);
        let s ~ Normal(0.0, 1.0).iid(counties);
        let b ~ Normal(0.0, 3.0);
        let sd ~ HalfNormal(2.0);
        for (house, y) in houses.iter().zip(y) {
            let level = mu + tau[0] * z[house.county];
            let mean = level + (b + tau[1] * s[house.county]) * house.floor + b * house.size;
            y ~ Normal(mean, sd);
        }
    }

    /// Two places an observation, and a row of an array for each of them.
    fn crossed(pairs: &[(usize, usize)], y: &[f64], x: &[[f64; 2]]) {
        let a ~ Normal(0.0, 1.0).iid(3);
        let b ~ Normal(0.0, 1.0).array::<2>().iid(2);
        let sd ~ HalfNormal(2.0);
        for (i, &(g, h)) in pairs.iter().enumerate() {
            y[i] ~ Normal(a[g] + dot(&x[i], &b[h]), sd);
        }
    }

    fn nested(x: &[Vec<f64>], y: &[Vec<f64>]) {
        let a ~ Normal(0.0, 1.0).iid(x.len());
        let b ~ Normal(0.0, 1.0);
        let sd ~ HalfNormal(2.0);
        for g in 0..x.len() {
            for (x, y) in x[g].iter().zip(&y[g]) {
                y ~ Normal(a[g] + b * x, sd);
            }
        }
        for first in &y[0] {
            first ~ Normal(b, 1.0);
        }
        for (x, second) in x[1].iter().zip(&y[1]) {
            second ~ Normal(a[0] * x, 2.0);
        }
    }

    // what rows cannot stand for

    fn scaled(x: &[f64], y: &[f64]) {
        let a ~ Normal(0.0, 3.0);
        let sd ~ HalfNormal(2.0);
        for (x, y) in x.iter().zip(y) {
            y ~ Normal(a * x, sd * (1.0 + x * x));
        }
    }

    fn scaled_before(x: &[f64], y: &[f64]) {
        let a ~ Normal(0.0, 3.0);
        let sd ~ HalfNormal(2.0);
        for (x, y) in x.iter().zip(y) {
            let spread = sd + (a * x).square();
            let centre = a * x;
            y ~ Normal(centre, spread);
        }
    }

    fn curved(x: &[f64], y: &[f64]) {
        let a ~ Normal(0.0, 1.0);
        let b ~ Normal(0.0, 1.0);
        for (x, y) in x.iter().zip(y) {
            y ~ Normal(a + (b * x).tanh(), 1.0);
        }
    }

    fn products(x: &[f64], y: &[f64]) {
        let a ~ Normal(0.0, 1.0);
        for (x, y) in x.iter().zip(y) {
            y ~ Normal((a + x) * (a - x), 1.0);
        }
    }

    fn observed_unknowns(x: &[f64], y: &[f64]) {
        let a ~ Normal(0.0, 1.0);
        let sd ~ HalfNormal(2.0);
        for (x, y) in x.iter().zip(y) {
            let residual = a * x - y;
            residual ~ Normal(a, sd);
        }
    }

    fn consumed(x: &[f64], y: &[f64]) {
        let a ~ Normal(0.0, 1.0);
        let b ~ Normal(0.0, 1.0);
        let mut pairs = x.iter().zip(y);
        for (x, first) in pairs.by_ref().take(20) {
            first ~ Normal(a + b * x, 1.0);
        }
        for (x, second) in pairs.by_ref().take(20) {
            second ~ Normal(a - b * x, 2.0);
        }
        let mut rest = pairs.map(|(_, y)| y);
        for third in &mut rest {
            third ~ Normal(b, 1.0);
        }
    }

    fn counted(data: &Counted<(f64, f64)>) {
        let a ~ Normal(0.0, 3.0);
        let b ~ Normal(0.0, 3.0);
        for (x, y) in data.iter() {
            y ~ Normal(a + b * x, 1.0);
        }
    }

    /// Names for what depends on unknowns, one after another.
    fn chained(data: &Counted<(f64, f64)>) {
        let a ~ Normal(0.0, 3.0);
        let b ~ Normal(0.0, 3.0).array::<2>();
        for (x, y) in data.iter() {
            let first = b[0];
            let level = a * 2.0 - first;
            let shifted = level + x;
            y ~ Normal(shifted + first * x + b[1], 1.0);
        }
    }

    fn of_another_length(rows: &[Vec<f64>], y: &[f64]) {
        let b ~ Normal(0.0, 2.0).array::<2>();
        for (row, y) in rows.iter().zip(y) {
            y ~ Normal(dot(row, &b), 1.0);
        }
    }
}

/// Data that count how often they are looked at.
struct Counted<T> {
    data: Vec<T>,
    looks: AtomicUsize,
}

impl<T> Counted<T> {
    fn new(data: Vec<T>) -> Self {
        Self { data, looks: AtomicUsize::new(0) }
    }

    fn iter(&self) -> impl Iterator<Item = &T> {
        self.data.iter().inspect(|_| {
            self.looks.fetch_add(1, Ordering::Relaxed);
        })
    }

    /// How often they are looked at for a gradient of the model.
    fn looks(&self, model: &Bound<impl Model>) -> usize {
        let dim = model.layout().unwrap().dim;
        let (mut gradient, mut w) = (vec![0.0; dim], Workspace::default());
        let mut count = || {
            self.looks.store(0, Ordering::Relaxed);
            model.gradient(&vec![0.2; dim], &mut gradient, &mut w).unwrap();
            self.looks.load(Ordering::Relaxed)
        };
        count().max(count())
    }
}

fn wave(i: usize, k: usize) -> f64 {
    (0.3 + i as f64 * (0.9 + 0.37 * k as f64)).sin()
}

fn waves(n: usize, k: usize) -> Vec<f64> {
    (0..n).map(|i| wave(i, k)).collect()
}

fn assert_derivatives(model: &Bound<impl Model>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(9);
    let dim = model.layout().unwrap().dim;
    let mut w = Workspace::default();
    let [mut ours, mut tape, mut dual] = [vec![0.0; dim], vec![0.0; dim], vec![0.0; dim]];
    for _ in 0..20 {
        let y = model.draw_prior(&mut rng).unwrap().unconstrained;
        let value = model.gradient(&y, &mut ours, &mut w).unwrap();
        let others = [
            model.tape_gradient(&y, &mut tape, &mut w).unwrap(),
            model.forward_gradient(&y, &mut dual).unwrap(),
            model.log_density(&y, &mut w).unwrap(),
        ];
        for other in others {
            approx::assert_relative_eq!(value, other, max_relative = 1e-12);
        }
        let size = dual.iter().fold(1.0f64, |size, g| size.max(g.abs()));
        for (i, our) in ours.iter().enumerate() {
            assert!((our - tape[i]).abs() < 1e-12 * size, "{i}: {our} and {}", tape[i]);
            assert!((our - dual[i]).abs() < 1e-12 * size, "{i}: {our} and {}", dual[i]);
        }
    }
}

#[test]
fn rows_say_what_all_observations_say() {
    let (x, w, y) = (waves(60, 0), waves(60, 1), waves(60, 2));
    let w: Vec<f64> = w.iter().map(|w| w.abs()).collect();
    assert_derivatives(&line(&x, &y));
    assert_derivatives(&summands(&x, &w, &y, 0.3));
    let rows: Vec<[f64; 3]> = (0..60).map(|i| [0, 3, 4].map(|k| wave(i, k))).collect();
    let others: Vec<Vec<f64>> = (0..60).map(|i| vec![wave(i, 5), 1.0]).collect();
    assert_derivatives(&dots(&rows, &others, &y));
    let house = |i: usize| House { county: i * i % 7, floor: wave(i, 6).round(), size: wave(i, 1) };
    let houses: Vec<House> = (0..60).map(house).collect();
    assert_derivatives(&grouped(7, &houses, &y));
    let pairs: Vec<(usize, usize)> = (0..60).map(|i| (i % 3, i / 7 % 2)).collect();
    let both: Vec<[f64; 2]> = (0..60).map(|i| [0, 3].map(|k| wave(i, k))).collect();
    assert_derivatives(&crossed(&pairs, &y, &both));
    let split = |x: &[f64]| vec![x[..35].to_vec(), x[35..37].to_vec(), x[37..].to_vec()];
    assert_derivatives(&nested(&split(&x), &split(&y)));
}

#[test]
fn what_rows_cannot_stand_for_is_looked_at_one_by_one() {
    let (x, y) = (waves(60, 0), waves(60, 2));
    assert_derivatives(&scaled(&x, &y));
    assert_derivatives(&scaled_before(&x, &y));
    assert_derivatives(&curved(&x, &y));
    assert_derivatives(&products(&x, &y));
    assert_derivatives(&consumed(&x, &y));
    assert_derivatives(&observed_unknowns(&x, &y));
}

#[test]
fn data_are_not_looked_at_again() {
    let pairs = |n: usize| Counted::new(waves(n, 0).into_iter().zip(waves(n, 1)).collect());
    let looks = |n: usize| {
        let data = pairs(n);
        data.looks(&counted(&data))
    };
    // one group: its first iteration
    assert_eq!((looks(50), looks(500)), (1, 1));
    // no fewer rows than observations
    assert_eq!(looks(2), 2);
    let data = pairs(60);
    assert_derivatives(&chained(&data));
    assert_eq!(data.looks(&chained(&data)), 1);
}

#[test]
fn rows_of_another_length_have_no_density() {
    let rows = vec![vec![1.0, 2.0, 3.0]; 20];
    let model = of_another_length(&rows, &[0.5; 20]);
    assert!(model.log_density(&[0.1, 0.2], &mut Workspace::default()).is_err());
}
