//! Posteriors for users: quantities in their units, specimens with their names.

use ppl::{Group, Posterior, Role, Values, Variable};

use super::Calibration;
use super::specimens::column_means;
use crate::qoi::Quantity;

impl Calibration {
    /// Returns the posterior for users. `mean` and `new_specimen` are in the units of the surrogate's outputs and have
    /// the names of the outputs as labels. Instead of the contrasts and totals of the likelihood, the observed data are
    /// the quantities `qois` of the specimens with the names `ids`. `log_likelihood` still has one term per contrast
    /// and total. `sd` remains relative to the specimens' means. `units` are the units of the parameters.
    ///
    /// # Errors
    /// If `units` do not match the parameters, `outputs` do not match the outputs of the calibration, or the number of
    /// names differs from the number of specimens.
    pub fn in_units(
        &self,
        outputs: &[String],
        ids: &[&str],
        qois: &[Vec<f64>],
        units: &[&str],
    ) -> Result<Posterior, ppl::LabelError> {
        let means = &column_means(qois)[..];
        let mut whole = self.posterior.clone();
        let columns: Vec<&str> = outputs.iter().map(String::as_str).collect();
        whole.label("mean", 0, &columns)?;
        let replicated = |group: &mut Group| {
            group.variables.retain(|values| whole.observed.get(&values.name).is_none());
        };
        replicated(&mut whole.predictive);
        whole.prior_predictive.iter_mut().for_each(replicated);
        let (name, shape) = ("qois".to_owned(), vec![qois.len(), columns.len()]);
        whole.layout.variables.push(Variable {
            name: name.clone(),
            shape: shape.clone(),
            dims: vec!["specimen".to_owned(), "qoi".to_owned()],
            role: Role::Observed,
        });
        whole.observed.variables = vec![Values { name, shape, data: qois.concat() }];
        whole.label("qois", 0, ids)?;
        set_units(&mut whole, units, &columns)?;
        let Posterior { posterior, predictive, prior, prior_predictive, .. } = &mut whole;
        let groups = [Some(posterior), Some(predictive), prior.as_mut(), prior_predictive.as_mut()];
        for values in groups.into_iter().flatten().flat_map(|group| &mut group.variables) {
            if let "mean" | "new_specimen" = values.name.as_str() {
                for row in values.data.chunks_mut(means.len()) {
                    row.iter_mut().zip(means).for_each(|(value, mean)| *value *= mean);
                }
            }
        }
        Ok(whole)
    }
}

/// Sets the units of quantities and parameters. Relative quantities have the unit 1.
fn set_units(
    posterior: &mut Posterior,
    units: &[&str],
    columns: &[&str],
) -> Result<(), ppl::LabelError> {
    let quantity =
        |name: &&str| Quantity::of_column(name).map(|quantity| quantity.unit().to_string());
    if let Some(units) = columns.iter().map(quantity).collect::<Option<Vec<String>>>() {
        for name in ["mean", "new_specimen", "qois"] {
            posterior.set_units(name, &units.iter().map(String::as_str).collect::<Vec<_>>())?;
        }
    }
    posterior.set_units("theta", units)?;
    for name in ["sd", "correlation", "corr"] {
        posterior.set_units(name, &["1"])?;
    }
    Ok(())
}
