//! Where an unknown meets plain numbers. Every model has one mistake, marked by `//~`.
use ppl::prelude::*;

fn drag(speed: f64) -> f64 {
    0.5 * speed * speed
}

fn heat<S: Scalar>(speed: S) -> S {
    speed.square()
}

ppl::model! {
    fn without_let(y: f64) {
        theta ~ Normal(0.0, 1.0); //~
        y ~ Normal(0.0, 1.0);
    }

    fn unknown_index(y: f64, levels: &[f64]) {
        let k ~ Uniform(0.0, 3.0);
        y ~ Normal(levels[k], 1.0); //~
    }

    fn begins_as_data(x: &[f64], y: &[f64]) {
        let b ~ Normal(0.0, 1.0);
        let mut s = x[0]; //~
        for (x, y) in x.iter().zip(y) {
            s += b * x;
            y ~ Normal(s, 1.0);
        }
    }

    fn begins_as_a_converted_number(x: &[f64], y: &[f64]) {
        let b ~ Normal(0.0, 1.0);
        let mut s = Real::from(x[0]);
        for (x, y) in x.iter().zip(y) {
            s += b * x;
            y ~ Normall(s, 1.0); //~
        }
    }

    fn function_of_f64(y: f64) {
        let b ~ Normal(0.0, 1.0);
        y ~ Normal(f64::exp(b), 1.0); //~
    }

    fn own_function_of_f64(y: f64) {
        let b ~ Normal(0.0, 1.0);
        y ~ Normal(heat(b) + drag(b), 1.0); //~
    }

    fn run_time_size_of_a_factor(rows: &[Vec<f64>]) {
        let k = rows.len();
        let factor ~ LkjCholesky::<k>(1.0); //~
    }

    fn run_time_size_of_an_array(rows: &[Vec<f64>], n: usize) {
        let x ~ Normal(0.0, 1.0).array::<{ n }>(); //~
    }

    fn plain_value(y: f64) {
        let a ~ Normal(0.0, 1.0);
        #[track] let sign = a.value().signum();
        y ~ Normal(2.0 * a.value(), 1.0); //~
    }

    fn plain_value_of_a_part(y: &[f64]) {
        let a ~ Normal(0.0, 1.0).array::<2>();
        let both = [2.0 * a[0], a[1]];
        let shift: Vec<f64> = y.iter().map(|y| y - both[0].value()).collect(); //~
        shift[0] ~ Normal(a[1], 1.0);
    }

    fn plain_values_in_a_closure(y: &[f64]) {
        let a ~ Normal(0.0, 1.0).array::<2>();
        let shift: f64 = a.iter().map(|part| part.value()).sum(); //~
        y[0] ~ Normal(shift, 1.0);
    }

    fn plain_values_by_path(y: &[f64]) {
        let a ~ Normal(0.0, 1.0).array::<2>();
        let shift: f64 = a.iter().map(Real::value).sum(); //~
        y[0] ~ Normal(shift, 1.0);
    }

    fn plain_values_in_a_list(y: f64) {
        let a ~ Normal(0.0, 1.0);
        let shifts = vec![a.value(); 2]; //~
        y ~ Normal(shifts[1], 1.0);
    }

    fn plain_value_of_an_argument(level: Real) -> Real {
        let x ~ Normal(level.value(), 1.0); //~
        x
    }

    fn numbers_as_counts(k: &[f64]) {
        let rate ~ Exponential(1.0);
        for k in k {
            k ~ Poisson(rate); //~
        }
    }

    fn number_as_flag(flag: f64) {
        let p ~ Beta(1.0, 1.0);
        flag ~ Bernoulli(p); //~
    }
}

fn main() {}
