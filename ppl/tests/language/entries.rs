//! Entries of one array that several statements observe.

use ppl::prelude::*;
use ppl::{Bound, Model};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::densities::{assert_gradient, assert_same};

ppl::model! {
    /// The autoregression of Stan's manual: the first value has the stationary distribution, and each later value
    /// depends on the previous value.
    fn autoregression(y: &[f64]) {
        let phi ~ Uniform(-1.0, 1.0);
        let sd ~ HalfNormal(1.0);
        y[0] ~ Normal(0.0, sd / (1.0 - phi * phi).sqrt());
        #[dims(time = 0..y.len())]
        for t in 1..y.len() {
            y[t] ~ Normal(phi * y[t - 1], sd);
        }
    }

    fn in_one_statement(y: &[f64]) {
        let phi ~ Uniform(-1.0, 1.0);
        let sd ~ HalfNormal(1.0);
        for t in 0..y.len() {
            let mean = if t == 0 { 0.0 * phi } else { phi * y[t - 1] };
            let own = if t == 0 { sd / (1.0 - phi * phi).sqrt() } else { sd };
            y[t] ~ Normal(mean, own);
        }
    }

    /// A change point, an array of pairs, and two arms that observe the same entry.
    fn parts(first: usize, wide: bool, y: &[f64], pair: &[[f64; 2]; 2], one: &[f64; 1]) {
        let level ~ Normal(0.0, 1.0).array::<2>();
        for i in 0..first {
            y[i] ~ Normal(level[0], 1.0);
        }
        for i in first..y.len() {
            if wide {
                y[i] ~ StudentT(4.0, level[1], 2.0);
            } else {
                y[i] ~ Normal(level[1], 1.0);
            }
        }
        pair[0] ~ Normal(level[0], 1.0).array::<2>();
        pair[1] ~ Normal(level[1], 1.0).array::<2>();
        if wide {
            one[0] ~ Normal(level[0], 2.0);
        } else {
            one[0] ~ Normal(level[0], 1.0);
        }
    }

    /// Missing entries in an array that two statements observe.
    fn gaps(y: &[Option<f64>]) {
        let mean ~ Normal(0.0, 1.0);
        y[0].impute() ~ Normal(mean, 2.0);
        for t in 1..y.len() {
            y[t].impute() ~ Normal(mean, 1.0);
        }
    }

    fn outer(y: &[f64]) {
        let own ~ series(y);
        factor(-own);
    }

    fn series(y: &[f64]) -> Real {
        let mean ~ Normal(0.0, 1.0);
        y[0] ~ Normal(mean, 2.0);
        for t in 1..y.len() {
            y[t] ~ Normal(mean, 1.0);
        }
        mean
    }
}

const Y: [f64; 5] = [0.3, -0.2, 1.1, 0.4, 0.6];

fn record(model: &Bound<impl Model>) -> ppl::Record {
    model.draw_prior(&mut Xoshiro256PlusPlus::seed_from_u64(1)).unwrap()
}

#[test]
fn entries_stack_in_the_order_of_their_statements() {
    let model = autoregression(&Y);
    assert_gradient("autoregression", &model);
    assert_same(&model, &in_one_statement(&Y));
    let record = record(&model);
    let y = record.get("y").unwrap();
    assert_eq!((&y.variable.shape, &y.variable.dims), (&vec![5], &vec!["time".to_owned()]));
    assert_eq!(y.values, Y);
    assert_eq!((y.replicate.len(), y.log_likelihood.len()), (5, 5));
    assert_eq!(record.coordinates.get("time").unwrap().len(), 5);
}

#[test]
fn loops_and_single_entries_share_a_name() {
    let pair = [[0.1, 0.2], [0.3, 0.4]];
    for wide in [false, true] {
        let record = record(&parts(2, wide, &Y, &pair, &[0.7]));
        let shape = |name: &str| record.get(name).unwrap().variable.shape.clone();
        assert_eq!(record.values("y").unwrap(), Y);
        assert_eq!(record.values("pair").unwrap(), pair.as_flattened());
        assert_eq!((shape("y"), shape("pair")), (vec![5], vec![2, 2]));
        // only one of the two arms observes `one`
        assert_eq!(shape("one"), Vec::<usize>::new());
        assert_eq!(record.get("pair").unwrap().log_likelihood.len(), 2);
    }
}

#[test]
fn missing_entries_know_where_they_are() {
    let record = record(&gaps(&[None, Some(0.5), None, Some(-0.5)]));
    assert_eq!(record.values("y").unwrap(), [0.5, -0.5]);
    assert_eq!(*record.coordinates.get("y_dim_0").unwrap(), ["1", "3"]);
    assert_eq!(*record.coordinates.get("y.missing_dim_0").unwrap(), ["0", "2"]);
}

#[test]
fn submodels_have_such_names_too() {
    assert_eq!(record(&outer(&Y)).values("own.y").unwrap(), Y);
}
