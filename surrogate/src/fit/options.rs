//! Fits an expansion to a dataset. The scales, the order and the terms with the smallest estimated prediction error
//! are chosen.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::coefficients::posterior::CoefficientPosterior;
use crate::dataset::{Dataset, check_count};
use crate::dyn_pce::DynPce;
use crate::error::SurrogateError;
use crate::fit::design_matrix::Regression;
use crate::fit::orders::{Fitted, Orders, all_terms};
use crate::fit::report::{FitReport, covariance, mean_products};
use crate::fit::scale_choice::{Scales, choose};
use crate::fit::select::{Holdout, OrderRule, Truth, by_loo, by_split};
use crate::fit::sparse::sparse;
use crate::legendre::MAX_ORDER;
use crate::multi_index::Truncation;
use crate::pce::Pce;

/// Largest number of inputs for which all 2^d corners of the box are evaluated.
const MAX_CORNER_INPUTS: usize = 10;

/// Selection of the terms of an order: all terms, or a sparse subset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Terms {
    /// All terms of the order. All terms are best for few inputs, and for runs whose outputs scatter.
    #[default]
    All,
    /// A sparse subset of candidate terms; there can be more candidates than runs. Sparse terms are suitable for many
    /// inputs or high orders.
    ///
    /// Forward selection adds one term at a time, each time the term that reduces the residuals of the outputs most
    /// (orthogonal least squares: Chen, Billings & Luo 1989, doi:10.1080/00207178908953472). For each order several
    /// hyperbolic truncations are tried, from few interactions to the requested truncation of the order, as in
    /// Blatman & Sudret (2011, doi:10.1016/j.jcp.2010.12.021). The number of terms, the truncation and the order
    /// minimise the error of tenfold cross-validation, in which the terms are selected separately for each fold. The
    /// leave-one-out error would be too small, because the run that is left out has influenced the selection of the
    /// terms.
    Sparse,
}

/// Options of [`DynPce::fit`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitOptions {
    /// Highest order tried, at most [`MAX_ORDER`].
    pub max_order: usize,
    /// The candidate terms of an order.
    pub truncation: Truncation,
    /// Whether the expansion has all candidate terms or a sparse subset.
    pub terms: Terms,
    /// Rule by which the order is chosen.
    pub rule: OrderRule,
    /// Rule by which a linear or a logarithmic scale is chosen for each input and output.
    pub scales: Scales,
    /// The split into training and validation rows. The report contains the errors of this split even if another rule
    /// chooses the order.
    pub split: Holdout,
}

impl Default for FitOptions {
    /// Default options: orders 0 to 8, total degree, all terms; order and scales are chosen by the corrected
    /// leave-one-out error.
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

/// A fitted surrogate with its error estimates.
#[derive(Clone, Debug)]
pub struct PceFit<P = DynPce> {
    /// The expansion, fitted to all rows.
    pub pce: P,
    /// Report with the errors of every order, the chosen order and the rule that chose it.
    pub report: FitReport,
    /// The posterior of the coefficients.
    pub coefficients: CoefficientPosterior,
    /// Leave-one-out residuals on the linear or logarithmic scales of the outputs, one row per run and one column per
    /// output. For sparse terms, these are the residuals of cross-validation.
    left_out: Vec<Vec<f64>>,
}

impl<const D: usize, const M: usize> Pce<D, M> {
    /// Fits an expansion as [`DynPce::fit`] does, with sizes known at compile time.
    ///
    /// # Errors
    /// The errors of [`DynPce::fit`], and an error if the dataset does not have `D` inputs and `M` outputs.
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
    /// The report contains the leave-one-out errors and the training and validation errors of every order.
    /// `options.rule` chooses the order, and the chosen order is fitted to all rows. An order needs more rows than
    /// terms; the report marks an order with too many terms as not estimable.
    ///
    /// If the dataset [has derivatives](Dataset::with_derivatives), values and derivatives are fitted in one weighted
    /// least squares problem. A run then has one row for its value and one row per derivative, so that there may be
    /// fewer runs than terms. For leave-one-out errors, all rows of a run are left out together.
    ///
    /// # Errors
    /// If the dataset has fewer than two rows or a constant output, an option is out of range, or the rows do
    /// not determine a fixed order.
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
    /// The leverage h(x) = ψ(x)ᵀ(ΨᵀΨ)⁻¹ψ(x): ratio of the variance of the fit at `x` to the variance of the error of
    /// a single row. ψ(x) contains the values of the basis polynomials at `x`.
    ///
    /// At points where the leverage exceeds [`FitReport::largest_leverage`], the fit extrapolates from the rows of
    /// the dataset, even inside the box.
    ///
    /// # Errors
    /// If `x` lies outside the box by more than the tolerance, contains NaN, or has the wrong length.
    pub fn leverage(&self, x: &[f64]) -> Result<f64, SurrogateError> {
        self.coefficients.leverage(x)
    }

    /// Returns the report with the leave-one-out error of the given rows only (counted from 0), for example of rows
    /// that were run near the points where the surrogate will be used. The lack of fit at these points may differ
    /// from the lack of fit over the whole box.
    ///
    /// # Errors
    /// If `rows` is empty or contains a row that the dataset does not have.
    pub fn about(&self, rows: &[usize]) -> Result<FitReport, SurrogateError> {
        if rows.is_empty() {
            return check_count("or more rows", 1, 0).map(|()| self.report.clone());
        }
        let outputs = self.report.outputs.len();
        let mut covariance = vec![vec![0.0; outputs]; outputs];
        for &row in rows {
            let Some(r) = self.left_out.get(row) else {
                let (what, count) = ("rows of the dataset", row + 1);
                return Err(SurrogateError::Count {
                    what,
                    expected: self.left_out.len(),
                    found: count,
                });
            };
            // second moment about 0, not about the mean: a bias is an error too
            for (line, a) in covariance.iter_mut().zip(r) {
                line.iter_mut().zip(r).for_each(|(c, b)| *c += a * b / rows.len() as f64);
            }
        }
        Ok(FitReport { loo_covariance: covariance, ..self.report.clone() })
    }
}

/// Returns the largest leverage at a corner of the box; None for more than 10 inputs, because there are too many
/// corners.
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
