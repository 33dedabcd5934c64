//! Models that must compile without a warning.
#![deny(warnings)]
use ppl::prelude::*;

ppl::model! {
    /// A model without statements.
    fn empty() {}

    /// Arguments and unknowns with names that the generated code uses.
    fn hygiene(cx: f64, site: f64, data: &[f64]) {
        let this ~ Normal(cx, 1.0);
        let lp ~ Normal(site, 1.0);
        for self_ in data {
            self_ ~ Normal(this, lp.exp());
        }
    }

    /// Unknowns that no other statement uses.
    fn prior() {
        let a ~ Normal(0.0, 1.0);
        let b ~ Beta(2.0, 2.0).array::<3>();
    }

    /// A submodel, a named dimension and a datum that may be missing, none of whose values is used.
    fn part(level: Real, _unused: f64) -> Real {
        let x ~ Normal(level, 1.0);
        x
    }

    fn whole(labels: &[&str], y: Option<f64>) {
        let p ~ part(0.0, 1.0);
        #[dims(side = labels)] let q ~ Normal(0.0, 1.0).non_centered().array::<2>();
        y.impute() ~ Normal(0.0, 1.0);
        #[predict] let r ~ part(0.0, 1.0);
    }

    /// A raw identifier.
    fn raw(r#type: f64) {
        let r#match ~ Normal(0.0, 1.0);
        r#type ~ Normal(r#match, 1.0);
    }

    /// An unused argument, and a lint that an attribute allows.
    fn unused(_weights: &[f64], y: f64) {
        #[allow(unused_variables)]
        let spare = 2.0;
        y ~ Normal(0.0, 1.0);
    }

    /// Bounds in the parameter list and in the `where` clause, and calls of function arguments.
    fn generic<F: Fn(f64) -> f64, G>(f: F, g: &G, ys: &[f64])
    where
        G: Fn(&f64) -> f64,
    {
        let mean ~ Normal(f(1.0), 1.0);
        for y in ys {
            let z = g(y);
            z ~ Normal(mean, 1.0);
        }
    }

    /// Items, loops, labels and closures of plain Rust.
    fn plain(ys: &[f64]) {
        const HALF: f64 = 0.5;
        fn twice<S: Scalar>(x: S) -> S {
            x * 2.0
        }
        let mean ~ Normal(0.0, 1.0);
        let mut total = Real::from(0.0);
        let mut i = 0;
        while i < 3 {
            total += twice(mean) * HALF;
            i += 1;
        }
        let mut steps = vec![mean; ys.len()];
        for t in 1..ys.len() {
            #[allow(unused_parens)]
            steps[t] += (total * (steps[t - 1] - 1.0));
        }
        let mut names = [String::new(), String::from("a")];
        names[0] += &*names[1].clone();
        let mut halve = |t: usize| steps[t] *= steps[t - 1] * 0.5;
        halve(1);
        'data: for y in ys {
            for limit in [1.0, 2.0] {
                if *y > limit {
                    continue 'data;
                }
            }
            y ~ Normal(total, 1.0);
        }
    }
}

/// Lints about code style, even if denied, do not apply to the generated code.
#[deny(single_use_lifetimes, unused_braces)]
mod written {
    use ppl::prelude::*;

    ppl::model! {
        #[rustfmt::skip]
        pub fn on_one_line(y: &[[f64; 2]]) {
            let m ~ Normal(0.0, 1.0).array::<2>();
            for y in y { for k in 0..2 { y[k] ~ Normal(m[k], 1.0); } }
        }
    }
}

#[test]
fn models_compile_without_warnings() {
    let data = [1.0, 2.0];
    assert!(empty().layout().is_ok());
    assert!(hygiene(0.0, 0.0, &data).layout().is_ok());
    assert!(prior().layout().is_ok());
    assert!(whole(&["left", "right"], None).layout().is_ok());
    assert!(raw(1.0).layout().is_ok());
    assert!(unused(&data, 1.0).layout().is_ok());
    assert!(generic(|x| x + 1.0, &|y: &f64| y.ln(), &data).layout().is_ok());
    assert!(plain(&data).layout().is_ok());
    assert!(written::on_one_line(&[data]).layout().is_ok());
}
