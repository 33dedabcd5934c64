//! Checks of quantities of interest, design, surrogate and sampler.

use ::surrogate::OrderRule;

use super::super::{CaseFile, DesignCase, DiscrepancyCase, Likelihood, Mistakes, SequentialCase};
use super::program::check_branches;
use crate::error::InputError;
use crate::qoi::{Extent, Quantity, RelativeForce};

/// Smallest number of load steps of a run with a peak. The window of a slope is a fifth of the displacement at peak and
/// should contain two points of the curve.
const LEAST_STEPS: f64 = 10.0;
/// Smallest number of load steps of a run if no quantity needs the peak: a curve has at least five points.
const LEAST_STEPS_WITHOUT_PEAK: f64 = 4.0;

impl CaseFile {
    pub(super) fn check_calibration(&self, mistakes: &mut Mistakes) {
        let (case, whole) = (&self.case, "a whole number");
        let (key, unit) = ("qoi.slope_fraction", "of the displacement at peak");
        let fraction = case.qoi.slope_fraction;
        mistakes.note(self.within(key, fraction, 0.1, 0.9, unit, "The paper takes 0.3."));
        mistakes.note(self.check_quantities(&case.qoi.quantities));
        mistakes.note(self.check_curve_percent(&case.qoi.curve_percent));
        mistakes.note(self.check_reach());
        mistakes.note(check_branches(self));
        if let Some(prior) = &case.prior {
            let mut of_prior = Mistakes::default();
            self.check_prior(prior, &mut of_prior);
            let of_prior = of_prior.into_vec();
            if of_prior.is_empty() {
                mistakes.note(self.check_fractions());
                mistakes.note(self.check_strengths());
            }
            of_prior.into_iter().for_each(|mistake| mistakes.note(Err(mistake)));
        }
        mistakes.note(self.check_extensions());
        let help = "The paper uses 100; order 3 in three parameters needs more than 20.";
        let runs = case.design.runs as f64;
        mistakes.note(self.within(
            "design.runs",
            runs,
            DesignCase::LEAST_RUNS as f64,
            1e6,
            "runs",
            help,
        ));
        self.check_sequential(mistakes);
        let max_order = case.surrogate.max_order as f64;
        let help = "Orders up to this order are tried. Order 0 alone is a constant, which \
                    determines no parameter; the paper uses 3.";
        mistakes.note(self.within("surrogate.max_order", max_order, 1.0, 8.0, whole, help));
        if let OrderRule::Fixed(order) = case.surrogate.rule {
            let (key, help) =
                ("surrogate.rule.fixed", "Write rule = { fixed = 3 }, at most max_order.");
            mistakes.note(self.within(key, order as f64, 1.0, max_order.max(1.0), whole, help));
        }
        self.check_sampler(mistakes);
        mistakes.note(self.check_discrepancy(&case.calibration.discrepancy));
        let (key, help) = ("confirm.draws", "A few show the posterior's spread.");
        let draws = case.confirm.draws as f64;
        mistakes.note(self.within(key, draws, 0.0, 1000.0, "simulations", help));
    }

    fn check_sampler(&self, mistakes: &mut Mistakes) {
        let c = &self.case.calibration;
        let settings = [
            (
                "chains",
                c.chains as f64,
                1.0,
                64.0,
                "chains",
                "Four chains show whether they agree.",
            ),
            ("warmup", c.warmup as f64, 20.0, 1e6, "draws", "1000 are ample for nine parameters."),
            (
                "draws",
                c.draws as f64,
                20.0,
                1e7,
                "draws",
                "2000 a chain give quantiles to a few per cent.",
            ),
            ("thin", c.thin as f64, 1.0, 1e4, "", "1 keeps every step, 10 every tenth."),
            (
                "burn_in",
                c.burn_in as f64,
                0.0,
                1e7,
                "",
                "Number of steps after the warmup that are discarded.",
            ),
            (
                "target_accept",
                c.target_accept,
                0.5,
                0.999,
                "",
                "0.95 follows the posterior's narrow parts; 0.8 is faster.",
            ),
        ];
        for (key, value, lower, upper, unit, help) in settings {
            let key = format!("calibration.{key}");
            mistakes.note(self.within(&key, value, lower, upper, unit, help));
        }
        let all_draws = c.chains as f64 * c.draws as f64;
        if c.draws <= 10_000_000 && all_draws > 1e7 {
            let (unit, help) = ("draws of all chains together", "All draws are kept in memory.");
            mistakes.note(self.within("calibration.draws", all_draws, 20.0, 1e7, unit, help));
        }
    }

    /// Refuses a number of load steps that is too small for quantities of interest. A single simulation may have fewer
    /// steps, so that [`CaseFile::read`] does not call this check.
    ///
    /// # Errors
    /// If the number is too small. The error names the key and an allowed value.
    pub(crate) fn check_steps(&self) -> Result<(), InputError> {
        // not every segment of a load program needs a peak
        let steps = self.case.test.steps.filter(|_| self.case.test.program.is_none());
        steps.map_or(Ok(()), |steps| self.check_number_of_steps("test.steps", steps))
    }

    /// Refuses a number of load steps, given by `key`, that is too small for the compared quantities.
    pub(crate) fn check_number_of_steps(&self, key: &str, steps: u32) -> Result<(), InputError> {
        let needs_peak =
            self.case.compared_quantities().iter().any(|quantity| quantity.needs_peak());
        let (least, help) = match needs_peak {
            true => (
                LEAST_STEPS,
                "Slope and peak need points of the curve on both sides of the peak: the paper uses 44 steps. Remove \
                 this key for adaptive steps.",
            ),
            false => (
                LEAST_STEPS_WITHOUT_PEAK,
                "A curve has at least five points, of which the first is the unloaded start. Remove this key for \
                 adaptive steps.",
            ),
        };
        self.within(key, f64::from(steps), least, 1e9, "steps", help)
    }

    fn check_quantities(&self, quantities: &[Quantity]) -> Result<(), InputError> {
        let shown = quantities.iter().map(Quantity::to_string).collect::<Vec<_>>().join(", ");
        let refuse = |problem: &str| {
            let help = "Name each once, as in quantities = [\"slope\", \"peak-force\"].";
            Err(self.error("qoi.quantities", format!("[{shown}]"), problem, help))
        };
        if quantities.is_empty() {
            return refuse("no quantity is compared");
        }
        if (1..quantities.len()).any(|i| quantities[..i].contains(&quantities[i])) {
            return refuse("a quantity is named twice");
        }
        Ok(())
    }

    /// Refuses a test that ends before the last point of the curve that is compared. The decrease of the force beyond
    /// the peak is not known before the run. It is estimated from viscous damage: at x times the displacement at peak,
    /// the force is x e^((1 − x³)/3) times the peak force. This force decreases faster than with rate-independent
    /// damage.
    fn check_reach(&self) -> Result<(), InputError> {
        let (test, compared) = (&self.case.test, self.case.compared_quantities());
        let reach = |quantity: &Quantity| match quantity.extent() {
            Extent::Fraction(fraction) if fraction > 1.0 => Some(fraction),
            _ => None,
        };
        let farthest = compared.iter().filter_map(|quantity| Some((reach(quantity)?, quantity)));
        let farthest = farthest.max_by(|a, b| a.0.total_cmp(&b.0));
        if let (Some((reach, quantity)), Some(stop)) = (farthest, test.stop_below_peak) {
            let fall = 1.0 - reach * ((1.0 - reach.powi(3)) / 3.0).exp();
            if stop < fall {
                let named = match self.case.calibration.likelihood {
                    Likelihood::Quantities => "qoi.quantities",
                    Likelihood::Curve => "qoi.curve_percent",
                };
                let problem = format!(
                    "ends curves before {:.0} % of their displacement at peak, where {named} needs them for \
                     {quantity}",
                    100.0 * reach
                );
                let enough = (100.0 * fall + 2.0).ceil().min(99.0) / 100.0;
                let help = format!(
                    "Viscous damage is {:.0} % below its peak there: write {enough} or more, or leave the key out.",
                    100.0 * fall
                );
                return Err(self.error("test.stop_below_peak", stop.to_string(), problem, help));
            }
        }
        let program = test.load_program().ok().flatten();
        // the displacement under a prescribed force is a result
        let program = program.filter(|program| !program.prescribes_force());
        let program_end = program.map(|program| program.largest_mm());
        let Some(end) = test.displacement_mm.or(program_end) else { return Ok(()) };
        let is_beyond = |quantity: &&Quantity| match quantity.extent() {
            Extent::Displacement(displacement_mm) => displacement_mm > end.abs(),
            _ => false,
        };
        compared.iter().find(is_beyond).map_or(Ok(()), |quantity| {
            let key = if program_end.is_some() {
                "largest displacement of test.program"
            } else {
                "test.displacement_mm"
            };
            let problem = format!("lies beyond the end of the test, {key} = {end}");
            let help = "Name a displacement before all peaks, which every run reaches.";
            Err(self.error("qoi.quantities", quantity.to_string(), problem, help))
        })
    }

    fn check_curve_percent(&self, percent: &[u8]) -> Result<(), InputError> {
        let key = "qoi.curve_percent";
        let help = "Write them in order, as in curve_percent = [25, 50, 75]; the peak itself is \
                    compared besides.";
        for &one in percent {
            let most = f64::from(RelativeForce::LARGEST_PERCENT);
            self.within(key, f64::from(one), 1.0, most, "% of the displacement at peak", help)?;
        }
        let ascends = percent.windows(2).all(|pair| pair[0] < pair[1]);
        if ascends && !percent.is_empty() && !percent.contains(&100) {
            return Ok(());
        }
        let problem = match ascends {
            true if percent.is_empty() => "names no part of the curve",
            true => "at 100 % the force is that of the peak",
            false => "are not in ascending order",
        };
        Err(self.error(key, format!("{percent:?}"), problem, help))
    }

    fn check_discrepancy(&self, discrepancy: &DiscrepancyCase) -> Result<(), InputError> {
        let compared = self.case.compared_quantities();
        for (quantity, &percent) in &discrepancy.percent {
            let key = format!("calibration.discrepancy.percent.{quantity}");
            if !compared.contains(quantity) {
                let names: Vec<String> = compared.iter().map(Quantity::to_string).collect();
                let help = format!("The compared quantities are: {}.", names.join(", "));
                return Err(self.error(&key, percent.to_string(), "is not compared", help));
            }
            let help = "It is the standard deviation of the model's error in %: 3.0 for an error of 3 %. \
                        Remove quantities without an error.";
            self.within(&key, percent, 1e-3, 100.0, "%", help)?;
        }
        Ok(())
    }

    fn check_sequential(&self, mistakes: &mut Mistakes) {
        let Some(SequentialCase { share, batch, most }) = self.case.sequential.as_ref() else {
            return;
        };
        let help = "0.1: a tenth of the variance of a parameter may come from the surrogate.";
        mistakes.note(self.within("sequential.share", *share, 1e-3, 1.0, "of the variance", help));
        let help = "Each batch needs a calibration: use several runs per batch.";
        mistakes.note(self.within("sequential.batch", *batch as f64, 2.0, 100.0, "runs", help));
        let help = "Largest number of runs of all batches together: at least one batch.";
        let batch = *batch as f64;
        mistakes.note(self.within("sequential.most", *most as f64, batch, 1e6, "runs", help));
    }
}
