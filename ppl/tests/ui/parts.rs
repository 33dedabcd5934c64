//! Submodels, missing data, named dimensions. Every model has one mistake, marked by `//~`.
use ppl::prelude::*;

ppl::model! {
    fn effect(mu: Real, scale: f64) -> Real {
        let theta ~ Normal(mu, scale);
        theta
    }

    fn no_value(y: f64) -> Real { //~
        y ~ Normal(0.0, 1.0);
    }

    fn value_with_semicolon(y: f64) -> Real { //~
        let x ~ Normal(y, 1.0);
        x;
    }

    fn reference(y: f64) -> &Real { //~
        let x ~ Normal(y, 1.0);
        &x
    }

    fn wrong_value(y: f64) -> Real {
        let x ~ Normal(y, 1.0);
        [x, x] //~
    }

    fn missing_argument(y: f64) {
        let part ~ effect(0.0); //~
        y ~ Normal(part, 1.0);
    }

    fn text_argument(y: f64) {
        let part ~ effect(0.0, "wide"); //~
        y ~ Normal(part, 1.0);
    }

    fn declared_twice(y: f64) {
        let part ~ effect(0.0, 1.0);
        let part ~ effect(part, 1.0); //~
        y ~ Normal(part, 1.0);
    }

    fn observed(y: f64) {
        y ~ effect(0.0, 1.0); //~
    }

    fn assigned(y: f64) {
        let part ~ effect(0.0, 1.0);
        part += 1.0; //~
        y ~ Normal(part, 1.0);
    }

    fn let_imputed(y: Option<f64>) {
        let y.impute() ~ Normal(0.0, 1.0); //~
    }

    fn imputed_with(y: Option<f64>) {
        y.impute(0.0) ~ Normal(0.0, 1.0); //~
    }

    fn imputed_value(y: Option<f64>) {
        let mean ~ Normal(0.0, 1.0);
        let whole = y.impute(); //~
        whole ~ Normal(mean, 1.0);
    }

    fn imputed_expression(y: Option<f64>) {
        y.map(f64::ln).impute() ~ Normal(0.0, 1.0); //~
    }

    fn never_missing(y: f64) {
        y.impute() ~ Normal(0.0, 1.0); //~
    }

    fn imputed_count(y: Option<u64>) {
        y.impute() ~ Poisson(3.0); //~
    }

    fn imputed_prediction(y: Option<f64>) {
        #[predict] y.impute() ~ Normal(0.0, 1.0); //~
    }

    fn imputed_twice(y: Option<f64>) {
        y.impute() ~ Normal(0.0, 1.0);
        y ~ Normal(0.0, 1.0); //~
    }

    fn no_dimension() {
        #[dims] let x ~ Normal(0.0, 1.0).array::<2>(); //~
    }

    fn empty_dimensions() {
        #[dims()] let x ~ Normal(0.0, 1.0).array::<2>(); //~
    }

    fn quoted_dimension() {
        #[dims("side")] let x ~ Normal(0.0, 1.0).array::<2>(); //~
    }

    fn taken_dimension() {
        #[dims(chain)] let x ~ Normal(0.0, 1.0).array::<2>(); //~
    }

    fn repeated_dimension() {
        #[dims(side, side)] let x ~ Normal(0.0, 1.0).array::<2>().array::<2>(); //~
    }

    fn two_attributes() {
        #[dims(row)] #[dims(column)] let x ~ Normal(0.0, 1.0).array::<2>(); //~
    }

    fn two_dimensional_plate(ys: &[f64]) {
        #[dims(row, column)] for y in ys { //~
            y ~ Normal(0.0, 1.0);
        }
    }

    fn unrecorded_dimension(y: f64) {
        #[dims(side)] let pair = [y, 1.0]; //~
        pair ~ Normal(0.0, 1.0).array::<2>();
    }

    fn dimension_of_a_part(y: f64) {
        #[dims(side)] let part ~ effect(y, 1.0); //~
    }

    fn number_for_labels() {
        #[dims(side = 2.0)] let x ~ Normal(0.0, 1.0).array::<2>(); //~
    }

    fn order_of_variations(y: f64) {
        let x ~ Normal(y, 1.0).array::<2>().non_centered(); //~
    }

    fn no_scale(y: f64) {
        let x ~ Beta(y, 1.0).non_centered(); //~
    }
}

fn main() {}
