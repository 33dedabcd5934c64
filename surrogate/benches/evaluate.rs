//! Nanoseconds per evaluation, for three inputs, three outputs, and the orders 3 (the surrogate of the paper) and 8.

use divan::{Bencher, black_box};
use surrogate::{Dataset, DesignMethod, FitOptions, Input, OrderRule, Pce, Scale, Scales};

#[global_allocator]
static ALLOCATIONS: divan::AllocProfiler = divan::AllocProfiler::system();

fn main() {
    divan::main();
}

fn runs(n: usize) -> Dataset {
    let inputs: Vec<Input> =
        ["a", "b", "c"].map(|name| Input::new(name, 1.0, 2.0).expect("valid")).into();
    let design = DesignMethod::Sobol.sample(&inputs, n, 1).expect("three inputs");
    let outputs = ["f", "g", "h"].map(str::to_owned).into();
    let mut data = Dataset::new(inputs, outputs, "closed form").expect("distinct names");
    for x in design {
        let y = [(x[0] * x[1]).sqrt(), x[2].ln() * x[0], 1.0 / (x[0] + x[1] * x[2])];
        data.push(&x, &y).expect("inside the box");
    }
    data
}

fn pce(order: usize) -> Pce<3, 3> {
    let (rule, scales) = (OrderRule::Fixed(order), Scales::Linear);
    let options = FitOptions { rule, scales, ..FitOptions::default() };
    Pce::fit(&runs(400), &options).expect("enough rows").pce
}

const X: [f64; 3] = [1.2, 1.7, 1.4];

#[divan::bench(args = [3, 8])]
fn value(bencher: Bencher<'_, '_>, order: usize) {
    let pce = pce(order);
    bencher.bench(|| black_box(&pce).value(black_box(&X)));
}

#[divan::bench(args = [3, 8])]
fn value_and_jacobian(bencher: Bencher<'_, '_>, order: usize) {
    let pce = pce(order);
    bencher.bench(|| black_box(&pce).value_and_jacobian(black_box(&X)));
}

#[divan::bench(args = [3, 8])]
fn value_and_jacobian_on_logarithmic_scales(bencher: Bencher<'_, '_>, order: usize) {
    let pce = pce(order).with_scales([Scale::Log; 3], [Scale::Log; 3]).expect("bounds above 0");
    bencher.bench(|| black_box(&pce).value_and_jacobian(black_box(&X)));
}

#[divan::bench(args = [100, 400])]
fn fit_orders_0_to_8(bencher: Bencher<'_, '_>, rows: usize) {
    let data = runs(rows);
    bencher.bench(|| Pce::<3, 3>::fit(black_box(&data), &FitOptions::default()));
}
