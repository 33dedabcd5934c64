//! Incomplete statements, as they occur while code is typed: other statements can still use the
//! names that these statements declare. Every model has one mistake, marked by `//~`.
use ppl::prelude::*;

ppl::model! {
    fn method_to_come(y: f64) {
        let mean ~ Normal(0.0, 1.0).; //~
        y ~ Normal(mean.exp(), 1.0);
    }

    fn field_to_come(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        #[track] let twice = mean.; //~
        y ~ Normal(twice + mean, 1.0);
    }

    fn distribution_to_come(x: Option<f64>, y: f64) {
        x.impute() ~ ; //~
        y ~ Normal(2.0 * x, 1.0);
    }

    fn header_to_come(ys: &[f64]) {
        let mean ~ Normal(0.0, 1.0);
        for y in ys. { //~
            let theta ~ Normal(mean, 1.0);
            y ~ Normal(theta, 1.0);
        }
    }

    fn value_to_come(y: f64) -> Real {
        let mean ~ Normal(y, 1.0);
        mean. } //~

    fn block_to_come(x: Option<f64>) {
        let Some(y) = x else return; //~
        y ~ Normal(0.0, 1.0);
    }
}

fn main() {}
