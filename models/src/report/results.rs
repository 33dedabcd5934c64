//! What a report tells, as plain numbers.

use ppl::diagnostics::Identification;

/// A curve of displacement in mm and force in N.
pub(super) type Curve = Vec<(f64, f64)>;

/// Everything that the report shows.
#[derive(Clone, Debug, Default)]
pub(super) struct Results {
    /// What was calibrated, for the headline.
    pub(super) title: String,
    /// The effective case, as text.
    pub(super) case_toml: String,
    /// The picture of the mesh, as SVG.
    pub(super) mesh_svg: String,
    /// Facts about the mesh: name and value.
    pub(super) mesh_facts: Vec<(String, String)>,
    /// Measured curves by specimen.
    pub(super) experiments: Vec<(String, Curve)>,
    /// Simulated curves of the ensemble.
    pub(super) ensemble: Vec<Curve>,
    /// Runs of the ensemble that failed, with their reasons.
    pub(super) failures: Vec<(usize, String)>,
    /// Seconds of processor time of the runs, in all.
    pub(super) ensemble_seconds: f64,
    /// The simulation at the MAP.
    pub(super) map_curve: Curve,
    /// Simulations at posterior draws.
    pub(super) posterior_curves: Vec<Curve>,
    /// The quantities of interest.
    pub(super) qois: Vec<Qoi>,
    /// The surrogate, order by order.
    pub(super) orders: Vec<Order>,
    /// The order that was chosen, and the rule.
    pub(super) chosen_order: usize,
    /// In words, how it was chosen.
    pub(super) order_rule: String,
    /// The calibrated parameters.
    pub(super) parameters: Vec<Parameter>,
    /// The summary table, header first.
    pub(super) summary: Vec<Vec<String>>,
    /// Warnings in words; empty if nothing is to be said.
    pub(super) warnings: Vec<String>,
    /// Notes that belong to the reading: scaled displacements, mesh bias and the like.
    pub(super) notes: Vec<String>,
    /// Settings of the run: name and value.
    pub(super) settings: Vec<(String, String)>,
}

/// One quantity of interest.
#[derive(Clone, Debug, Default)]
pub(super) struct Qoi {
    /// Name with unit.
    pub(super) label: String,
    /// One value a specimen.
    pub(super) experiments: Vec<f64>,
    /// One value a run of the ensemble.
    pub(super) ensemble: Vec<f64>,
    /// The simulation at the MAP.
    pub(super) map: f64,
    /// Relative difference of that to the experimental mean, in per cent.
    pub(super) percent_error: f64,
    /// Total Sobol index for every parameter.
    pub(super) sobol_total: Vec<f64>,
}

/// The surrogate at one order.
#[derive(Clone, Debug, Default)]
pub(super) struct Order {
    /// Polynomial order.
    pub(super) order: usize,
    /// Relative leave-one-out error, averaged over the outputs; `None`: not estimable.
    pub(super) loo: Option<f64>,
    /// The same, corrected for the sample size.
    pub(super) corrected: Option<f64>,
    /// Relative training error of the 70/30 split.
    pub(super) training: Option<f64>,
    /// Relative validation error of the 70/30 split.
    pub(super) validation: Option<f64>,
}

/// One calibrated parameter.
#[derive(Clone, Debug, Default)]
pub(super) struct Parameter {
    /// Label with unit.
    pub(super) label: String,
    /// Ends of the prior box.
    pub(super) prior: (f64, f64),
    /// Draws by chain.
    pub(super) chains: Vec<Vec<f64>>,
    /// Mean, sd, 5 % and 95 % quantiles.
    pub(super) mean: f64,
    /// Standard deviation.
    pub(super) sd: f64,
    /// 5 % quantile.
    pub(super) q05: f64,
    /// 95 % quantile.
    pub(super) q95: f64,
    /// Joint mode.
    pub(super) map: f64,
    /// 1 − posterior variance / prior variance.
    pub(super) contraction: f64,
    /// The truth, in a virtual laboratory.
    pub(super) truth: Option<f64>,
}

impl Parameter {
    /// All draws, chain after chain.
    pub(super) fn draws(&self) -> impl Iterator<Item = f64> + '_ {
        self.chains.iter().flatten().copied()
    }

    /// What the data said.
    pub(super) fn verdict(&self) -> Identification {
        Identification::of(self.contraction)
    }
}
