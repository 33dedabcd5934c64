//! `#[track]`, `#[predict]` and `factor`. Every model has one mistake, marked by `//~`.
use ppl::prelude::*;

ppl::model! {
    fn misspelt(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        #[trak] let twice = 2.0 * mean; //~
        y ~ Normal(twice, 1.0);
    }

    fn with_arguments(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        #[track(always)] let twice = 2.0 * mean; //~
        y ~ Normal(twice, 1.0);
    }

    fn both(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        #[track] #[predict] let twice = 2.0 * mean; //~
        y ~ Normal(mean, 1.0);
    }

    fn unknown_tracked(y: f64) {
        #[track] let mean ~ Normal(0.0, 1.0); //~
        y ~ Normal(mean, 1.0);
    }

    fn observation_tracked(y: f64) {
        #[track] y ~ Normal(0.0, 1.0); //~
    }

    fn plate_tracked(ys: &[f64]) {
        #[track] for y in ys { //~
            y ~ Normal(0.0, 1.0);
        }
    }

    fn tuple_tracked(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        #[track] let (a, b) = (mean, 2.0 * mean); //~
        y ~ Normal(a, b);
    }

    fn tracked_without_value(y: f64) {
        #[track] let mean; //~
        mean = 2.0 * y;
        y ~ Normal(mean, 1.0);
    }

    fn data_predicted(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        #[predict] y ~ Normal(mean, 1.0); //~
    }

    fn factor_predicted(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        y ~ Normal(mean, 1.0);
        #[predict] factor(mean); //~
    }

    fn observed_after_prediction(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        #[predict] let new ~ Normal(mean, 1.0);
        y ~ Normal(mean, 1.0); //~
    }

    fn observed_inside_prediction(ys: &[f64]) {
        let mean ~ Normal(0.0, 1.0);
        #[predict] for y in ys {
            y ~ Normal(mean, 1.0); //~
        }
    }

    fn weighed_inside_prediction(ys: &[f64]) {
        let mean ~ Normal(0.0, 1.0);
        #[predict] for y in ys {
            factor(mean * y); //~
        }
    }

    fn two_weights(y: f64) {
        factor(y, 1.0); //~
    }

    fn weight_inside(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        let value = factor(mean); //~
        y ~ Normal(mean, value);
    }

    fn silent_rejection(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        if mean > y {
            reject!(); //~
        }
    }

    fn rejection_in_closure(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        let check = |limit: f64| if mean > limit { reject!("above {limit}") }; //~
        check(y);
    }

    fn lost_derivatives(y: &[f64]) {
        let mean ~ Normal(0.0, 1.0);
        #[track] let beyond = Normal(mean, 1.0).sf(2.0);
        for y in y {
            factor(Normal(mean, 1.0).truncate(0.0..).sf(*y).ln()); //~
        }
    }

    fn lost_quantile(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        let median = Normal(mean, 1.0).quantile(0.5); //~
        y ~ Normal(median, 1.0);
    }
}

fn main() {}
