//! The function that declares a model. Every one has one mistake, marked by `//~`; the calls at
//! the end add none.
use ppl::prelude::*;

ppl::model! {
    fn no_type(y) { //~
        y ~ Normal(0.0, 1.0);
    }

    fn pattern((a, b): (f64, f64)) { //~
        a ~ Normal(b, 1.0);
    }

    fn mutable(mut y: f64) { //~
        y ~ Normal(0.0, 1.0);
    }

    fn mutable_reference(ys: &mut [f64]) { //~
        for y in ys {
            y ~ Normal(0.0, 1.0);
        }
    }

    fn implicit(f: impl Differentiable<1, 1>, y: f64) { //~
        y ~ Normal(f.at([1.0])[0], 1.0);
    }

    fn method(&self, y: f64) { //~
        y ~ Normal(0.0, 1.0);
    }

    fn returning(y: f64) -> f64 { //~
        y ~ Normal(0.0, 1.0);
    }

    fn real_data(mu: Real) { //~
        let x ~ Normal(mu, 1.0);
    }

    async fn waiting(y: f64) { //~
        y ~ Normal(0.0, 1.0);
    }

    fn no_body(y: f64); //~

    struct Model; //~
}

ppl::model! {} //~

fn main() {
    pattern((1.0, 2.0));
    mutable(1.0);
    mutable_reference(&mut [1.0]);
    method(1.0);
    waiting(1.0);
    no_body(1.0);
}
