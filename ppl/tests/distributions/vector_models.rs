//! Vector-valued quantities in models: reverse mode compared with forward mode and finite differences.

use ppl::prelude::*;
use ppl::{Workspace, check};

ppl::model! {
    fn vectors(counts: &[[u64; 2]], scale: CholeskyFactor<f64, 2>) {
        let cut ~ Normal(0.0, 3.0).array::<3>().ordered();
        let step ~ Exponential(1.0).iid(2).ordered();
        let within ~ Uniform(0.0, 2.0).array::<2>().ordered();
        let effect ~ Normal(0.0, 1.0).array::<3>();
        for count in counts {
            let (few, many) = (count[0], count[1]);
            few ~ PoissonLog(cut[0] + effect[0]);
            many ~ PoissonLog(cut[1] * within[0] + cut[2] * within[1] + effect[1] * effect[2]);
        }

        let corr ~ LkjCholesky::<2>(1.5);
        let centre ~ MvNormalCholesky([step[0], step[1]], scale);
        let seen = [0.5, -0.2];
        seen ~ MvNormalCholesky(centre, corr.scale_rows([1.0, 2.0]));
        #[predict] let new ~ MvNormalCholesky(centre, scale);
    }
}

#[test]
fn a_model_of_vectors() {
    let scale = CholeskyFactor::new([[1.2, 0.0], [0.4, 0.8]]).unwrap();
    let counts = [[1, 2], [2, 0]];
    let model = vectors(&counts, scale);
    assert_model(&model);
    let shapes: Vec<_> = model
        .layout()
        .unwrap()
        .variables
        .iter()
        .map(|v| (v.name.as_str(), v.shape.clone()))
        .collect();
    for (name, shape) in [("cut", vec![3]), ("step", vec![2]), ("corr", vec![2, 2])] {
        assert!(shapes.contains(&(name, shape.clone())), "{name} {shape:?} in {shapes:?}");
    }
}

/// Compares the gradient with finite differences, and reverse with forward mode to 10⁻¹⁰.
fn assert_model<M: ppl::Model>(model: &ppl::Bound<M>) {
    check::gradient(model, 11);
    let dim = model.layout().unwrap().dim;
    let y: Vec<f64> = (0..dim).map(|i| 0.5 * (1.7 * i as f64).sin()).collect();
    let (mut reverse, mut forward) = (vec![0.0; dim], vec![0.0; dim]);
    let value = model.gradient(&y, &mut reverse, &mut Workspace::default()).unwrap();
    let other = model.forward_gradient(&y, &mut forward).unwrap();
    assert!((other - value).abs() <= 1e-12 * value.abs().max(1.0), "{value} against {other}");
    for (i, (r, f)) in reverse.iter().zip(&forward).enumerate() {
        assert!((r - f).abs() <= 1e-10 * f.abs().max(1.0), "∂{i}: {r} against {f}");
    }
}
