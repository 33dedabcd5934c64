//! Mistakes in names. Every model has one mistake, marked by `//~`.
use ppl::prelude::*;

ppl::model! {
    fn declared_twice(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        let mean ~ Normal(1.0, 1.0); //~
        y ~ Normal(mean, 1.0);
    }

    fn declared_again_after_a_block(y: f64) {
        if y > 0.0 {
            let shift ~ Normal(0.0, 1.0);
            y ~ Normal(shift, 1.0);
        }
        let shift ~ Normal(0.0, 1.0); //~
    }

    fn declared_over_data(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        let y ~ Normal(mean, 1.0); //~
    }

    fn declared_over_plate_variable(ys: &[f64]) {
        let mean ~ Normal(0.0, 1.0);
        for y in ys {
            let y ~ Normal(mean, 1.0); //~
        }
    }

    fn tracked_twice(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        #[track] let mean = 2.0 * mean; //~
        y ~ Normal(mean, 1.0);
    }

    fn observed_twice(y: &[f64]) {
        let mean ~ Normal(0.0, 1.0);
        y ~ Normal(mean, 1.0).iid(2);
        y ~ Normal(mean, 2.0).iid(2); //~
    }

    fn entry_observed_twice(y: &[f64]) {
        let mean ~ Normal(0.0, 1.0);
        y[0] ~ Normal(mean, 1.0);
        y[1] ~ Normal(mean, 2.0);
        y[0] ~ Normal(mean, 1.0); //~
    }

    fn entry_of_what_was_observed(y: &[f64]) {
        let mean ~ Normal(0.0, 1.0);
        y ~ Normal(mean, 1.0).iid(2);
        y[0] ~ Normal(mean, 2.0); //~
    }

    fn unknown_observed(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        mean ~ Normal(1.0, 1.0); //~
        y ~ Normal(mean, 1.0);
    }

    fn unknown_element_observed(y: f64) {
        let mean ~ Normal(0.0, 1.0).array::<2>();
        mean[1] ~ Normal(1.0, 1.0); //~
        y ~ Normal(mean[0], 1.0);
    }

    fn unknown_assigned(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        mean = 1.0; //~
        y ~ Normal(mean, 1.0);
    }

    fn unknown_increased(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        mean += 1.0; //~
        y ~ Normal(mean, 1.0);
    }

    fn unknown_element_assigned(y: f64) {
        let mean ~ Normal(0.0, 1.0).array::<2>();
        if y > 0.0 {
            mean[0] = 1.0; //~
        }
        y ~ Normal(mean[0], 1.0);
    }
}

fn main() {}
