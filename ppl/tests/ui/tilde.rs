//! Mistakes around `~`. Every model has one mistake, marked by `//~`.
use ppl::prelude::*;

ppl::model! {
    fn missing_semicolon(ys: &[f64]) {
        let mean ~ Normal(0.0, 1.0) //~
        let sd ~ Normal(0.0, 1.0).truncate(0.0..);
        for y in ys {
            y ~ Normal(mean, sd);
        }
    }

    fn missing_semicolon_before_observation(y: f64, z: f64) {
        let mean ~ Normal(0.0, 1.0);
        y ~ Normal(mean, 1.0) //~
        z ~ Normal(mean, 1.0);
    }

    fn missing_last_semicolon(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        y ~ Normal(mean, 1.0) //~
    }

    fn nothing_on_the_right(y: f64) {
        let mean ~ ; //~
        y ~ Normal(mean, 1.0);
    }

    fn nothing_before_the_next(y: f64) {
        let mean ~ //~
        let sd ~ Normal(0.0, 1.0).truncate(0.0..);
        y ~ Normal(mean, sd);
    }

    fn no_name(y: f64) {
        let ~ Normal(0.0, 1.0); //~
        y ~ Normal(0.0, 1.0);
    }

    fn tilde_equals(y: f64) {
        let mean ~= Normal(0.0, 1.0); //~
        y ~ Normal(mean, 1.0);
    }

    fn equals_tilde(y: f64) {
        let mean = ~Normal(0.0, 1.0); //~
        y ~ Normal(mean, 1.0);
    }

    fn equals_tilde_without_let(y: f64) {
        y = ~Normal(0.0, 1.0); //~
    }

    fn missing_comma(y: f64) {
        let mean ~ Normal(0.0 1.0); //~
        y ~ Normal(mean, 1.0);
    }

    fn typed_unknown(y: f64) {
        let mean: f64 ~ Normal(0.0, 1.0); //~
        y ~ Normal(mean, 1.0);
    }

    fn mutable_unknown(y: f64) {
        let mut mean ~ Normal(0.0, 1.0); //~
        y ~ Normal(mean, 1.0);
    }

    fn tuple_unknown(y: f64) {
        let (mean, sd) ~ Normal(0.0, 1.0).array::<2>(); //~
        y ~ Normal(mean, sd);
    }

    fn unnamed_unknown(y: f64) {
        let _ ~ Normal(0.0, 1.0); //~
        y ~ Normal(0.0, 1.0);
    }

    fn number_observed(y: f64) {
        let mean ~ Normal(y, 1.0);
        3.0 ~ Normal(mean, 1.0); //~
    }

    fn expression_observed(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        y.ln() ~ Normal(mean, 1.0); //~
    }

    fn in_a_closure(ys: &[f64]) {
        ys.iter().for_each(|y| { y ~ Normal(0.0, 1.0); }); //~
    }

    fn in_a_macro(y: f64) {
        println!("{}", y ~ Normal(0.0, 1.0)); //~
    }

    fn in_while(ys: &[f64]) {
        let mut i = 0;
        while i < ys.len() { //
            ys[i] ~ Normal(0.0, 1.0); //~
            i += 1;
        }
    }

    fn in_loop(y: f64) {
        loop {
            y ~ Normal(0.0, 1.0); //~
            break;
        }
    }

    fn bare_arm(kind: usize, y: f64) {
        match kind {
            0 => y ~ Normal(0.0, 1.0), //~
            _ => {}
        }
    }
}

fn main() {}
