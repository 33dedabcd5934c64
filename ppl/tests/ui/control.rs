//! What a model cannot do. Every model has one mistake, marked by `//~`.
use ppl::prelude::*;

ppl::model! {
    fn returning(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        if mean > y {
            return; //~
        }
        y ~ Normal(mean, 1.0);
    }

    fn value_at_the_end(y: f64) {
        let mean ~ Normal(y, 1.0);
        mean //~
    }

    fn waiting(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        let z = std::future::ready(y).await; //~
        z ~ Normal(mean, 1.0);
    }

    fn this(y: f64) {
        let mean ~ Normal(self.mean, 1.0); //~
        y ~ Normal(mean, 1.0);
    }

    fn broken_header(ys: &[f64]) {
        for y ys { //~
            y ~ Normal(0.0, 1.0);
        }
    }

    fn broken_else(y: f64) {
        if y > 0.0 {
            y ~ Normal(0.0, 1.0);
        } else y ~ Normal(0.0, 2.0); //~
    }

    fn broken_arms(y: f64, kind: u8) {
        match kind {
            0 => ()
            _ => { //~
                y ~ Normal(0.0, 1.0);
            }
        }
    }
}

fn main() {}
