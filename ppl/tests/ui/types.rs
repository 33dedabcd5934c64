//! Types that do not fit. Every model has one mistake, marked by `//~`.
use ppl::prelude::*;

fn counts() -> Poisson<f64> {
    Poisson(3.0)
}

ppl::model! {
    fn discrete_unknown(y: f64) {
        let k ~ Poisson(3.0); //~
        y ~ Normal(0.0, 1.0);
    }

    fn discrete_from_a_function(y: f64) {
        let k ~ counts(); //~
        y ~ Normal(0.0, 1.0);
    }

    fn not_a_distribution(y: f64) {
        let mean ~ 3.0; //~
        y ~ Normal(mean, 1.0);
    }

    fn integer_parameter(y: f64) {
        let mean ~ Normal(0, 1.0); //~
        y ~ Normal(mean, 1.0);
    }

    fn text_parameter(y: f64, name: &str) {
        let mean ~ Normal(0.0, name); //~
        y ~ Normal(mean, 1.0);
    }

    fn text_observed(name: &str) {
        let mean ~ Normal(0.0, 1.0);
        name ~ Normal(mean, 1.0); //~
    }

    fn count_observed_as_number(count: u64) {
        let mean ~ Normal(0.0, 1.0);
        count ~ Normal(mean, 1.0); //~
    }

    fn array_for_a_number(ys: &[f64; 3]) {
        let mean ~ Normal(0.0, 1.0);
        ys ~ Normal(mean, 1.0); //~
    }

    fn wrong_length(ys: &[f64; 3]) {
        let mean ~ Normal(0.0, 1.0);
        ys ~ Normal(mean, 1.0).array::<4>(); //~
    }

    fn missing_parameter(y: f64) {
        let mean ~ Normal(0.0); //~
        y ~ Normal(mean, 1.0);
    }

    fn missing_method(y: f64) {
        let mean ~ Normal(0.0, 1.0).truncated(0.0..); //~
        y ~ Normal(mean, 1.0);
    }

    fn unknown_end(y: f64) {
        let least ~ Normal(0.0, 1.0);
        y ~ Normal(0.0, 1.0).truncate(least..); //~
    }

    fn locations_in_place_of_one(mu: [f64; 3], y: f64) {
        let theta ~ Normal(mu, 1.0); //~
        y ~ Normal(0.0, 1.0);
    }

    fn ends_of_integers(y: f64) {
        let mean ~ Normal(0.0, 1.0).truncate(0..); //~
        y ~ Normal(mean, 1.0);
    }

    fn literal_beside_a_reference(y: f64) {
        let all ~ Normal(0.0, 1.0).array::<2>();
        for one in &all {
            let both = [0.5, one]; //~
            factor(*both[1]);
        }
    }

    fn text_weight(name: &str) {
        factor(name); //~
    }

    fn unrecordable(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        #[track] let text = format!("{mean}"); //~
        y ~ Normal(mean, 1.0);
    }

    fn option_propagated(y: Option<f64>) {
        let mean ~ Normal(0.0, 1.0);
        let value = y?; //~
        value ~ Normal(mean, 1.0);
    }

    fn foreign_error(y: &str) {
        let mean ~ Normal(0.0, 1.0);
        let value = y.parse::<f64>()?; //~
        value ~ Normal(mean, 1.0);
    }

    fn unshared(y: std::rc::Rc<f64>) { //~
        let mean ~ Normal(0.0, 1.0);
        let value = **y;
        value ~ Normal(mean, 1.0);
    }
}

fn main() {}
