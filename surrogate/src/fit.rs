//! From a dataset to an expansion of the order, and with the terms, that leave out the least.

use serde::{Deserialize, Serialize};

use crate::coefficients::CoefficientPosterior;
use crate::dataset::{Dataset, check_count};
use crate::design_matrix::Regression;
use crate::dyn_pce::DynPce;
use crate::error::SurrogateError;
use crate::legendre::MAX_ORDER;
use crate::multi_index::Truncation;
use crate::orders::{Fitted, Orders, all_terms};
use crate::pce::Pce;
use crate::report::{FitReport, covariance, mean_products};
use crate::scale_choice::{Scales, choose};
use crate::select::{Holdout, OrderRule, Truth, by_loo, by_split};
use crate::sparse::sparse;

/// Most inputs for which the 2^d corners of the box are visited.
const MAX_CORNER_INPUTS: usize = 10;

/// Which terms of an order an expansion has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Terms {
    /// All of them: for few inputs, and where runs scatter.
    #[default]
    All,
    /// Those that matter, of which there may be more than runs: for many inputs or high orders.
    ///
    /// Terms are added one after the other, each the one that leaves the least of the outputs
    /// (orthogonal least squares: Chen, Billings & Luo 1989, doi:10.1080/00207178908953472). Of each order
    /// hyperbolic truncations of several exponents are tried, from main effects to its total degree, as
    /// Blatman & Sudret do (2011, doi:10.1016/j.jcp.2010.12.021). Number of terms, truncation and order are those
    /// of the least error of tenfold cross-validation in which each fold chooses its own terms: to leave
    /// out a run behind terms that it has helped to choose says little.
    Sparse,
}

/// What [`DynPce::fit`] may do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitOptions {
    /// Highest order looked at, up to [`MAX_ORDER`].
    pub max_order: usize,
    /// The terms that an order stands for.
    pub truncation: Truncation,
    /// Whether an order has all of them, or those that matter.
    pub terms: Terms,
    /// How the order is chosen.
    pub rule: OrderRule,
    /// Which inputs and outputs are expanded in logarithms.
    pub scales: Scales,
    /// The split into training and validation rows, reported whatever the rule.
    pub split: Holdout,
}

impl Default for FitOptions {
    /// Orders 0 to 8, total degree, corrected leave-one-out for the order and the scales.
    fn default() -> Self {
        Self {
            max_order: 8,
            truncation: Truncation::TotalDegree,
            terms: Terms::All,
            rule: OrderRule::CorrectedLoo,
            scales: Scales::Auto,
            split: Holdout::default(),
        }
    }
}

/// A fitted surrogate with its error.
#[derive(Clone, Debug)]
pub struct PceFit<P = DynPce> {
    /// The expansion, fitted to all rows.
    pub pce: P,
    /// How its order was chosen and how good it is.
    pub report: FitReport,
    /// What the runs leave open of its coefficients.
    pub coefficients: CoefficientPosterior,
    /// Leave-one-out residuals (a row each, outputs beside each other) on the outputs' scales.
    left_out: Vec<Vec<f64>>,
}

impl<const D: usize, const M: usize> Pce<D, M> {
    /// [`DynPce::fit`] for sizes known at compile time.
    ///
    /// # Errors
    /// As [`DynPce::fit`]; a dataset with other than `D` inputs and `M` outputs.
    pub fn fit(data: &Dataset, options: &FitOptions) -> Result<PceFit<Pce<D, M>>, SurrogateError> {
        check_count("inputs in the dataset", D, data.inputs().len())?;
        check_count("outputs in the dataset", M, data.outputs().len())?;
        let PceFit { pce, report, coefficients, left_out } = DynPce::fit(data, options)?;
        Ok(PceFit { pce: pce.try_into()?, report, coefficients, left_out })
    }
}

impl DynPce {
    /// Fits an expansion to a dataset by least squares and chooses its order.
    ///
    /// Both order rules are worked out, the one in the options decides, and the chosen order is
    /// fitted to all rows. An order needs more rows than terms; the others are reported as not
    /// estimable.
    ///
    /// Where the dataset [has derivatives](Dataset::with_derivatives), they are fitted with the values in
    /// one weighted least squares problem: a run counts as one row for its value and one for each input, so
    /// that fewer runs than terms may do. Leaving a run out leaves out all its rows.
    ///
    /// # Errors
    /// A dataset with fewer than two rows or a constant output; an option out of range; a fixed order
    /// that the rows do not determine.
    ///
    /// ```
    /// use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, Input};
    /// let inputs = vec![Input::new("a", 0.0, 1.0)?, Input::new("b", -1.0, 1.0)?];
    /// let mut runs = Dataset::new(inputs.clone(), vec!["f".into()], "closed form")?;
    /// for x in DesignMethod::Sobol.sample(&inputs, 64, 1)? {
    ///     runs.push(&x, &[x[0] * x[1] * x[1]])?;
    /// }
    /// let fit = DynPce::fit(&runs, &FitOptions::default())?;
    /// assert_eq!(fit.report.order, 3);
    /// assert!((fit.pce.mean()[0] - 1.0 / 6.0).abs() < 1e-12);
    /// # Ok::<(), surrogate::SurrogateError>(())
    /// ```
    pub fn fit(data: &Dataset, options: &FitOptions) -> Result<PceFit, SurrogateError> {
        check(options)?;
        let regression = Regression::new(data, options.truncation, options.max_order)?;
        let scales = choose(&regression, &options.scales, options.rule)?;
        let truth =
            Truth { y: &regression.y, scales: &scales.outputs, variance: &regression.variance };
        let (n, m) = truth.y.shape();
        let looks = (options.rule, &options.split);
        let Orders { reports: orders, fitted, train, weights } = match options.terms {
            Terms::All => all_terms(&regression, &scales, &truth, looks)?,
            Terms::Sparse => sparse(&regression, &scales, &truth, looks)?,
        };

        let not_estimable = |order: usize| SurrogateError::NotEstimable {
            order,
            terms: orders.get(order).map_or(1, |o| o.terms),
            rows: n,
        };
        let order_by_loo = by_loo(&orders).ok_or_else(|| not_estimable(0))?;
        let order_by_split =
            by_split(&orders, options.split.tolerance).ok_or_else(|| not_estimable(0))?;
        let order = match options.rule {
            OrderRule::CorrectedLoo => order_by_loo,
            OrderRule::Split => order_by_split,
            OrderRule::Fixed(order) => order,
        };
        let Fitted { fit, prefix, columns, cross_validated } =
            fitted.get(order).ok_or_else(|| not_estimable(order))?;
        let left_out = prefix.left_out().ok_or_else(|| not_estimable(order))?;

        let terms = prefix.terms;
        let coefficients = fit.coefficients(terms);
        let term = |j: usize| (columns[j].clone(), (0..m).map(|m| coefficients[(j, m)]).collect());
        let (inputs, outputs) = (data.inputs().to_vec(), data.outputs().to_vec());
        let pce = DynPce::from_terms(inputs, outputs, (0..terms).map(term))?
            .with_scales(&scales.inputs, &scales.outputs)?;
        let residuals = cross_validated.as_ref().unwrap_or(&left_out);
        let residuals = residuals.get(..n, ..).to_owned();
        let mut report = FitReport {
            rows: n,
            train_rows: train,
            outputs: data.outputs().to_vec(),
            logarithmic: pce.logarithmic(),
            linear_error: scales.linear_error,
            orders,
            rule: options.rule,
            order,
            order_by_loo,
            order_by_split,
            loo_covariance: covariance(&residuals),
            residual_covariance: mean_products(&prefix.value_residuals(), prefix.freedom()),
            mean_covariance: (data.inputs_with_derivatives() > 0)
                .then(|| fit.jackknife(prefix, &left_out)),
            derivative_weights: weights,
            mean_leverage: prefix.trace,
            largest_leverage: prefix.leverages().fold(0.0, f64::max),
            largest_corner_leverage: None,
        };
        let scatter = match (&report.mean_covariance, cross_validated) {
            (Some(mean), _) => {
                let row = |row: &Vec<f64>| row.iter().map(|c| c / prefix.trace).collect();
                mean.iter().map(row).collect()
            }
            (None, Some(_)) => report.loo_covariance.clone(),
            (None, None) => report.residual_covariance.clone(),
        };
        let r_inverse = fit.r_inverse(terms);
        let row = |i: usize| (0..terms).map(|j| r_inverse[(i, j)]).collect();
        let rows = (0..terms).map(|i| (columns[i].clone(), row(i)));
        let coefficients = CoefficientPosterior::new(&pce, rows, scatter, prefix.freedom())?;
        report.largest_corner_leverage = largest_corner_leverage(&coefficients);
        let left_out = (0..n).map(|i| residuals.row(i).iter().copied().collect()).collect();
        Ok(PceFit { pce, report, coefficients, left_out })
    }
}

impl<P> PceFit<P> {
    /// The leverage h(x) = ψ(x)ᵀ(ΨᵀΨ)⁻¹ψ(x): the variance of the fit at `x` per variance of a row's error.
    ///
    /// Above [`FitReport::largest_leverage`] the fit extrapolates from its rows, even inside the box.
    ///
    /// # Errors
    /// A point outside the box by more than the tolerance, NaN, or one of another length.
    pub fn leverage(&self, x: &[f64]) -> Result<f64, SurrogateError> {
        self.coefficients.leverage(x)
    }

    /// The report with the leave-one-out error of these rows alone, counted from 0: those that were run
    /// where the surrogate will be used. What it misses there is not what it misses all over the box.
    ///
    /// # Errors
    /// No rows; a row that the dataset does not have.
    pub fn about(&self, rows: &[usize]) -> Result<FitReport, SurrogateError> {
        if rows.is_empty() {
            return check_count("rows, at least", 1, 0).map(|()| self.report.clone());
        }
        let outputs = self.report.outputs.len();
        let mut covariance = vec![vec![0.0; outputs]; outputs];
        for &row in rows {
            let Some(r) = self.left_out.get(row) else {
                let (what, found) = ("rows of the dataset", row + 1);
                return Err(SurrogateError::Count { what, expected: self.left_out.len(), found });
            };
            // about 0: that it is off on average is an error too
            for (line, a) in covariance.iter_mut().zip(r) {
                line.iter_mut().zip(r).for_each(|(c, b)| *c += a * b / rows.len() as f64);
            }
        }
        Ok(FitReport { loo_covariance: covariance, ..self.report.clone() })
    }
}

/// None where there are too many corners.
fn largest_corner_leverage(coefficients: &CoefficientPosterior) -> Option<f64> {
    let d = coefficients.estimate().inputs().len();
    let corner = |bits: usize| -> Vec<f64> {
        (0..d).map(|i| if bits >> i & 1 == 1 { 1.0 } else { -1.0 }).collect()
    };
    let leverage = |bits| coefficients.leverage_at_unit(&corner(bits));
    (d <= MAX_CORNER_INPUTS).then(|| (0..1 << d).map(leverage).fold(0.0, f64::max))
}

fn check(options: &FitOptions) -> Result<(), SurrogateError> {
    let refuse = |option, value: String, allowed: String| {
        Err(SurrogateError::Option { option, value, allowed })
    };
    if options.max_order > MAX_ORDER {
        return refuse("max_order", options.max_order.to_string(), format!("at most {MAX_ORDER}"));
    }
    if let OrderRule::Fixed(order) = options.rule
        && order > options.max_order
    {
        return refuse(
            "order",
            order.to_string(),
            format!("at most max_order = {}", options.max_order),
        );
    }
    if let Truncation::Hyperbolic { q } = options.truncation
        && !(q > 0.0 && q <= 1.0)
    {
        return refuse(
            "q of the hyperbolic truncation",
            q.to_string(),
            "above 0, at most 1".to_owned(),
        );
    }
    options.split.check()
}
