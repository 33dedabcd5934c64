//! Misspelt names: rustc reports one error for each name, at the user's token. Marked by `//~`.
use ppl::prelude::*;

ppl::model! {
    fn data_name(heights: &[f64]) {
        let mean ~ Normal(0.0, 1.0);
        for height in hieghts { //~
            height ~ Normal(mean, 1.0);
        }
    }

    fn observed_name(height: f64) {
        let mean ~ Normal(0.0, 1.0);
        hieght ~ Normal(mean, 1.0); //~
    }

    fn unknown_name(height: f64) {
        let mean ~ Normal(0.0, 1.0);
        height ~ Normal(maen, 1.0); //~
    }

    fn distribution_name(height: f64) {
        let mean ~ Normall(0.0, 1.0); //~
        height ~ Normal(mean, 1.0);
    }

    fn submodel_name(height: f64) {
        let mean ~ everyone(); //~
        height ~ Normal(mean, 1.0);
    }

    fn label_name(height: f64, sides: &[&str]) {
        #[dims(side = sidse)] let mean ~ Normal(0.0, 1.0).array::<2>(); //~
        height ~ Normal(mean[0], 1.0);
    }

    fn imputed_name(height: Option<f64>) {
        let mean ~ Normal(0.0, 1.0);
        hieght.impute() ~ Normal(mean, 1.0); //~
    }

    fn type_name(height: Hieght) { //~
        let mean ~ Normal(0.0, 1.0);
        height ~ Normal(mean, 1.0);
    }
}

fn main() {}
