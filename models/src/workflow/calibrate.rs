//! Stage `calibrate`: posterior and mode on the surrogate.

use std::sync::Mutex;

use ppl::diagnostics::e_bfmi;
use ppl::{ChainStatus, Nuts, Posterior, Progress, Summary};

use super::ensemble::read_runs;
use super::files::{csv_text, write};
use super::fingerprint::Fingerprint;
use super::laboratory::{read_experiments, truth};
use super::surrogate::{read_error, read_surrogate};
use super::{Stage, Workflow, WorkflowError};
use crate::case::PriorCase;
use crate::fracture::calibrate;
use crate::progress::{Bar, say};
use crate::qoi::{Qois, mean_qois};

pub(super) fn inputs(w: &Workflow) -> Result<Fingerprint, WorkflowError> {
    Ok(Fingerprint::new()
        .file(&w.needed("surrogate.json", Stage::Surrogate)?)?
        .file(&w.needed("surrogate_error.json", Stage::Surrogate)?)?
        .file(&w.needed("experiments.csv", Stage::Laboratory)?)?
        .file(&w.needed("runs.csv", Stage::Ensemble)?)?
        .part(&w.case().prior)
        .part(&w.case().experiments)
        .part(&w.case().calibration))
}

pub(super) fn run(w: &Workflow) -> Result<String, WorkflowError> {
    let pce = read_surrogate(w)?;
    let specimens = read_experiments(w)?;
    let settings = &w.case().calibration;
    let bar = ChainsBar::new(settings.chains);
    let sampler = Nuts::default()
        .chains(settings.chains)
        .warmup(settings.warmup)
        .draws(settings.draws)
        .target_accept(settings.target_accept)
        .seed(settings.seed)
        .threads(w.threads)
        .progress(&bar)
        .interrupt(w.interrupt);
    let result = calibrate(&pce, &specimens, w.prior()?, &sampler, settings.seed);
    drop(bar);
    w.check_interrupt()?;
    let result = result?;
    if !result.mode.converged {
        let mode = &result.mode;
        say(
            "note",
            &format!("the mode is not sharp: {} of {} searches agree", mode.agreeing, mode.starts),
        );
    }
    let posterior = &result.posterior;
    let io = |name: &str| {
        let path = w.path(name);
        move |e: std::io::Error| WorkflowError::io(&path, &e)
    };
    posterior.write_zarr(w.path("posterior.zarr")).map_err(io("posterior.zarr"))?;
    posterior.write_csv(w.path("posterior.csv")).map_err(io("posterior.csv"))?;
    let summary = posterior.summary();
    summary.write_csv(w.path("summary.csv")).map_err(io("summary.csv"))?;
    write(&w.path("summary.txt"), &format!("{summary}\n"))?;
    let mut warnings: Vec<String> = summary.warnings.iter().map(|f| f.to_string()).collect();
    warnings.extend(surrogate_warning(w, &summary, &specimens)?);
    warnings.extend(range_warnings(w, &specimens)?);
    write(
        &w.path("warnings.txt"),
        &warnings.iter().map(|line| format!("{line}\n")).collect::<String>(),
    )?;
    write(&w.path("sampling.csv"), &sampling_table(posterior))?;

    let truth = truth(w).map_or_else(|| [const { String::new() }; 3], |t| t.map(|x| x.to_string()));
    let rows = PriorCase::NAMES.into_iter().zip(result.map).zip(truth);
    let rows = rows.map(|((name, map), truth)| [name.to_owned(), map.to_string(), truth]);
    write(&w.path(Stage::Calibrate.product()), &csv_text("parameter,map,truth", rows))?;
    Ok(format!(
        "{} draws in {} chains, {} divergences",
        summary.draws * summary.chains,
        summary.chains,
        posterior.chains.divergences()
    ))
}

/// Whether the surrogate's own error could matter: n S/Σ above 0.1 for some quantity, with S its
/// leave-one-out variance, Σ the variance between n specimens.
fn surrogate_warning(
    w: &Workflow,
    summary: &Summary,
    specimens: &[Qois],
) -> Result<Option<String>, WorkflowError> {
    let covariance = read_error(w)?.loo_covariance;
    let (n, mean) = (specimens.len() as f64, mean_qois(specimens).to_array());
    let worst = (0..3)
        .filter_map(|m| {
            let sd = summary.row(&format!("sd[{m}]"))?.mean * mean[m];
            Some((n * covariance[m][m] / (sd * sd), Qois::NAMES[m]))
        })
        .max_by(|a, b| a.0.total_cmp(&b.0));
    Ok(worst.filter(|(ratio, _)| *ratio > 0.1).map(|(ratio, name)| {
        format!(
            "The surrogate's error is not small against the scatter of the specimens: n S/Σ = {ratio:.2} \
             for {name}. Intervals may be too narrow: add runs to the design."
        )
    }))
}

/// Experimental means that no simulation of the ensemble reaches: the prior box does not hold the
/// material, and the posterior will lean on its walls.
fn range_warnings(w: &Workflow, specimens: &[Qois]) -> Result<Vec<String>, WorkflowError> {
    let runs = read_runs(&w.needed("runs.csv", Stage::Ensemble)?)?;
    let mean = mean_qois(specimens).to_array();
    let outside = (0..3).filter_map(|m| {
        let values = runs.iter().map(|(_, qois)| qois[m]);
        let (low, high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), q| (a.min(q), b.max(q)));
        (!(low..=high).contains(&mean[m])).then(|| {
            format!(
                "The experimental mean of {} is {:.4}, outside what the ensemble reaches ({low:.4} \
                 to {high:.4}): widen the prior, or look for what the model leaves out.",
                Qois::NAMES[m],
                mean[m]
            )
        })
    });
    Ok(outside.collect())
}

/// How the sampler did, chain by chain.
fn sampling_table(posterior: &Posterior) -> String {
    let rows = posterior.chains.chains.iter().enumerate().map(|(index, chain)| {
        let n = chain.stats.len() as f64;
        let mean = |f: &dyn Fn(&ppl::DrawStats) -> f64| chain.stats.iter().map(f).sum::<f64>() / n;
        let energies: Vec<f64> = chain.stats.iter().map(|s| s.energy).collect();
        [
            index as f64,
            n,
            mean(&|s| f64::from(u8::from(s.divergent))) * n,
            mean(&|s| s.acceptance),
            mean(&|s| s.step_size),
            mean(&|s| f64::from(s.leapfrogs)),
            e_bfmi(&energies),
        ]
        .map(|x| x.to_string())
    });
    csv_text("chain,draws,divergences,acceptance,step_size,leapfrogs,e_bfmi", rows)
}

/// One bar over all chains.
struct ChainsBar {
    bar: Bar,
    shares: Mutex<Vec<(f64, u64)>>,
}

impl ChainsBar {
    fn new(chains: usize) -> Self {
        Self { bar: Bar::new("calibrate"), shares: Mutex::new(vec![(0.0, 0); chains]) }
    }
}

impl Progress for ChainsBar {
    fn update(&self, status: &ChainStatus) {
        let Ok(mut shares) = self.shares.lock() else { return };
        shares[status.chain] = (status.done as f64 / status.total as f64, status.divergences);
        let done = shares.iter().map(|s| s.0).sum::<f64>() / shares.len() as f64;
        let divergences: u64 = shares.iter().map(|s| s.1).sum();
        let rate = status.draws_per_second;
        self.bar.set(done, &format!("{rate:.0} draws/s a chain, {divergences} divergences"));
    }
}
