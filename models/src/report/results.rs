//! What a report tells, as plain numbers.

/// A curve of displacement in mm and force in N.
pub type Curve = Vec<(f64, f64)>;

/// Everything that the report shows.
#[derive(Clone, Debug, Default)]
pub struct Results {
    /// What was calibrated, for the headline.
    pub title: String,
    /// The effective case, as text.
    pub case_toml: String,
    /// The picture of the mesh, as SVG.
    pub mesh_svg: String,
    /// Facts about the mesh: name and value.
    pub mesh_facts: Vec<(String, String)>,
    /// Measured curves by specimen.
    pub experiments: Vec<(String, Curve)>,
    /// Simulated curves of the ensemble.
    pub ensemble: Vec<Curve>,
    /// Runs of the ensemble that failed, with their reasons.
    pub failures: Vec<(usize, String)>,
    /// Seconds of processor time of the runs, in all.
    pub ensemble_seconds: f64,
    /// The simulation at the MAP.
    pub map_curve: Curve,
    /// Simulations at posterior draws.
    pub posterior_curves: Vec<Curve>,
    /// The quantities of interest.
    pub qois: Vec<Qoi>,
    /// The surrogate, order by order.
    pub orders: Vec<Order>,
    /// The order that was chosen, and the rule.
    pub chosen_order: usize,
    /// In words, how it was chosen.
    pub order_rule: String,
    /// The calibrated parameters.
    pub parameters: Vec<Parameter>,
    /// The summary table, header first.
    pub summary: Vec<Vec<String>>,
    /// Warnings in words; empty if nothing is to be said.
    pub warnings: Vec<String>,
    /// Notes that belong to the reading: scaled displacements, mesh bias and the like.
    pub notes: Vec<String>,
    /// Settings of the run: name and value.
    pub settings: Vec<(String, String)>,
}

/// One quantity of interest.
#[derive(Clone, Debug, Default)]
pub struct Qoi {
    /// Name with unit.
    pub label: String,
    /// One value a specimen.
    pub experiments: Vec<f64>,
    /// One value a run of the ensemble.
    pub ensemble: Vec<f64>,
    /// The simulation at the MAP.
    pub map: f64,
    /// Relative difference of that to the experimental mean, in per cent.
    pub percent_error: f64,
    /// Total Sobol index for every parameter.
    pub sobol_total: Vec<f64>,
}

/// The surrogate at one order.
#[derive(Clone, Debug, Default)]
pub struct Order {
    /// Polynomial order.
    pub order: usize,
    /// Terms of the expansion.
    pub terms: usize,
    /// Relative leave-one-out error, averaged over the outputs; `None`: not estimable.
    pub loo: Option<f64>,
    /// The same, corrected for the sample size.
    pub corrected: Option<f64>,
    /// Relative training error of the 70/30 split.
    pub training: Option<f64>,
    /// Relative validation error of the 70/30 split.
    pub validation: Option<f64>,
}

/// One calibrated parameter.
#[derive(Clone, Debug, Default)]
pub struct Parameter {
    /// Label with unit.
    pub label: String,
    /// Ends of the prior box.
    pub prior: (f64, f64),
    /// Draws by chain.
    pub chains: Vec<Vec<f64>>,
    /// Mean, sd, 5 % and 95 % quantiles.
    pub mean: f64,
    /// Standard deviation.
    pub sd: f64,
    /// 5 % quantile.
    pub q05: f64,
    /// 95 % quantile.
    pub q95: f64,
    /// Joint mode.
    pub map: f64,
    /// 1 − posterior variance / prior variance.
    pub contraction: f64,
    /// The truth, in a virtual laboratory.
    pub truth: Option<f64>,
}

impl Parameter {
    /// All draws, chain after chain.
    pub(super) fn draws(&self) -> impl Iterator<Item = f64> + '_ {
        self.chains.iter().flatten().copied()
    }

    /// What the data said, in words.
    pub(super) fn verdict(&self) -> &'static str {
        match self.contraction {
            c if c < 0.1 => "not identified",
            c if c < 0.5 => "weakly identified",
            _ => "identified",
        }
    }
}
