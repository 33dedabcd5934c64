//! Everything vector-valued in models: reverse against forward mode and differences.

use ppl::prelude::*;
use ppl::{Workspace, check};

ppl::model! {
    fn vectors(counts: &[[u64; 2]], alpha: Vec<f64>, scale: CholeskyFactor<f64, 2>) {
        let cut ~ Normal(0.0, 3.0).array::<3>().ordered();
        let step ~ Exponential(1.0).iid(2).ordered();
        let within ~ Uniform(0.0, 2.0).array::<2>().ordered();
        let effect ~ Normal(0.0, 1.0).array::<3>();
        let share ~ Dirichlet(alpha);
        let weights ~ Dirichlet([step[0] + 0.5, step[1], effect[0].exp()]);
        for count in counts {
            let (kind, colour) = (count[0], count[1]);
            kind ~ CategoricalLogit(&share);
            colour ~ Categorical(weights);
            let grade = count[1];
            grade ~ CategoricalLogit([cut[0], cut[1] * within[0], cut[2] * within[1]]);
        }

        let eta ~ Gamma(2.0, 1.0);
        let corr ~ LkjCholesky::<2, _>(eta);
        let centre ~ MvNormalCholesky([step[0], step[1]], scale);
        let seen = [0.5, -0.2];
        seen ~ MvNormalCholesky(centre, corr.scale_rows([1.0, 2.0]));
        #[predict] let new ~ Dirichlet(weights);
    }
}

#[test]
fn a_model_of_vectors() {
    let scale = CholeskyFactor::new([[1.2, 0.0], [0.4, 0.8]]).unwrap();
    let counts = [[1, 2], [2, 0]];
    let model = vectors(&counts, vec![1.0, 2.0, 3.0, 1.0], scale);
    assert_model(&model);
    let shapes: Vec<_> = model
        .layout()
        .unwrap()
        .variables
        .iter()
        .map(|v| (v.name.as_str(), v.shape.clone()))
        .collect();
    for (name, shape) in
        [("cut", vec![3]), ("step", vec![2]), ("share", vec![4]), ("corr", vec![2, 2])]
    {
        assert!(shapes.contains(&(name, shape.clone())), "{name} {shape:?} in {shapes:?}");
    }
}

/// Differences, then forward against reverse mode to 10⁻¹⁰.
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

ppl::model! {
    /// Poisson counts around a latent process, with 11 inputs and 13 unknowns.
    fn poisson_process(x: &[f64], k: &[u64], new: &[f64]) {
        let length ~ Gamma(25.0, 4.0);
        let amplitude ~ Normal(0.0, 2.0).truncate(0.0..);
        let process = GaussianProcess::new(x, SquaredExponential(amplitude, length));
        let f ~ process;
        for (f, k) in f.iter().zip(k) {
            k ~ Poisson(f.exp());
        }
        #[predict] let rate ~ process.predict(&f, new);
    }
}

ppl::model! {
    /// A line whose discrepancy is a process, seen with noise.
    fn discrepancy(x: &[[f64; 1]], y: &[f64], new: &[[f64; 1]]) {
        let slope ~ Normal(0.0, 2.0);
        let amplitude ~ HalfNormal(1.0);
        let length ~ LogNormal(0.0, 0.5);
        let sd ~ HalfNormal(0.3);
        let line = x.iter().map(|x| slope * x[0]).collect::<Vec<_>>();
        let process = GaussianProcess::new(x, Matern32(amplitude, [length])).mean(&line).noise(sd);
        y ~ process;
        #[predict] let line_new = new.iter().map(|x| slope * x[0]).collect::<Vec<_>>();
        #[predict] let f ~ process.predict(y, new).mean(&line_new);
    }
}

#[test]
fn models_of_processes() {
    // so far apart that the smooth kernel stays well conditioned for length scales up to e²:
    // differences of an ill-conditioned factor say nothing
    let x: Vec<f64> = (0..11).map(|i| 4.0 * (f64::from(i) - 5.0)).collect();
    let k = [40, 37, 29, 12, 4, 3, 9, 19, 77, 82, 33];
    let model = poisson_process(&x, &k, &[0.5]);
    assert_eq!(model.layout().unwrap().dim, 13);
    assert_model(&model);
    let x = [[0.0], [0.4], [1.0], [1.7]];
    let model = discrepancy(&x, &[0.1, 0.6, 0.9, 2.2], &[[0.7], [3.0]]);
    assert_eq!(model.layout().unwrap().dim, 4);
    assert_model(&model);
    // the conditional draw of a latent process at its own inputs is that process
    let run = poisson_process(&[0.0, 1.0, 2.0], &[3, 5, 4], &[1.0]);
    let posterior = Nuts::default().chains(1).warmup(150).draws(50).seed(4).sample(&run).unwrap();
    let f = posterior.values("f").unwrap();
    let predicted = posterior.values("rate").unwrap();
    for (f, rate) in f.data.chunks(3).zip(&predicted.data) {
        assert!((f[1] - rate).abs() < 1e-3, "{} at an input, {rate} predicted there", f[1]);
    }
}
