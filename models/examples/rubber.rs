//! Calibrates three laws of rubber elasticity to Treloar's data, and compares how well each law fits the data and
//! predicts a mode of deformation that was not used in its calibration.
//!
//! ```text
//! cargo run --release -p models --example rubber [picture.png]
//! ```
//! Each law is calibrated to all data and compared by PSIS-LOO. Then each law is calibrated to two modes to predict the
//! third, either with the same moduli for all modes or with separate moduli for each mode that scatter around shared
//! values. The picture shows the predictions of the modes that were left out. `validation.csv`, beside the picture, compares
//! these predictions by Ogden's law with the data, in the form of `[[validation]]` (docs/how-to/validation.md).

use std::path::Path;

use models::calibration::{HeldOutScores, HeldOutValue, Prediction};
use models::hyperelastic::{
    Deformation, HeldOut, StretchTest, held_out, mooney_rivlin, mooney_rivlin_by_mode, neo_hookean,
    neo_hookean_by_mode, ogden, ogden_by_mode, treloar_1944,
};
use models::report::{Chart, Ink};
use ppl::diagnostics::{Loo, loo_compare};
use ppl::prelude::*;
use ppl::{Bound, Model};

type Error = Box<dyn std::error::Error>;

fn main() -> Result<(), Error> {
    let tests = treloar_1944();
    println!("Treloar 1944: {} points in uniaxial, equibiaxial and pure shear\n", tests.len());
    let loos = [
        ("neo-Hookean", calibrate("neo-Hookean", &neo_hookean(&tests))?),
        ("Mooney–Rivlin", calibrate("Mooney–Rivlin", &mooney_rivlin(&tests))?),
        ("Ogden, 3 terms", calibrate("Ogden, 3 terms", &ogden(&tests))?),
    ];
    println!("Expected log predictive density of a new point, best law first\n");
    println!(
        "{}",
        loo_compare(&[(loos[0].0, &loos[0].1), (loos[1].0, &loos[1].1), (loos[2].0, &loos[2].1)])?
    );

    println!(
        "A mode that was not seen: mean log predictive density a point, error, largest R-hat\n"
    );
    let (mut charts, mut held_out_modes) = (Vec::new(), Vec::new());
    for mode in Deformation::ALL {
        let (seen, new): (Vec<_>, Vec<_>) =
            tests.iter().copied().partition(|test| test.mode != mode);
        let sampler = Nuts::default().chains(4).draws(2000).target_accept(0.95).seed(1);
        let show = |name: &str, result: Result<HeldOut, ppl::SampleError>| -> Result<_, Error> {
            let result = result?;
            let HeldOut { ln_density, error, rhat, .. } = &result;
            println!("{mode:?}, {name}: {ln_density:.2}, {:.0} %, {rhat:.3}", 100.0 * error);
            Ok(result)
        };
        let (s, n, nuts) = (&seen[..], &new[..], &sampler);
        show("neo-Hookean", held_out(&neo_hookean(s), &neo_hookean(n), nuts, 1))?;
        let neo_by_mode = held_out(&neo_hookean_by_mode(s), &neo_hookean_by_mode(n), nuts, 1);
        show("neo-Hookean by mode", neo_by_mode)?;
        show("Mooney–Rivlin", held_out(&mooney_rivlin(s), &mooney_rivlin(n), nuts, 1))?;
        let mooney_by_mode =
            held_out(&mooney_rivlin_by_mode(s), &mooney_rivlin_by_mode(n), nuts, 1);
        show("Mooney–Rivlin by mode", mooney_by_mode)?;
        let one = show("Ogden", held_out(&ogden(s), &ogden(n), nuts, 1))?;
        let own = held_out(&ogden_by_mode(s), &ogden_by_mode(n), nuts, 1);
        let own = show("Ogden by mode", own)?;
        held_out_modes.extend([
            PredictedMode::of(&format!("{mode:?}"), &new, &one)?,
            PredictedMode::of(&format!("{mode:?} by mode"), &new, &own)?,
        ]);
        let stretches: Vec<f64> = new.iter().map(|test| test.stretch).collect();
        let last = new.last().map_or((8.0, 7.0), |test| (test.stretch, test.stress_mpa));
        charts.push(
            Chart::new("stretch", "nominal stress (MPa)")
                .titled(&format!("{mode:?}, not seen"))
                .over((1.0, 1.02 * last.0), (0.0, 1.6 * last.1))
                .band("Ogden by mode, 90 %", Ink::Other, &stretches, &own.predicted, 0.9)
                .band("Ogden, 90 %", Ink::Posterior, &stretches, &one.predicted, 0.9)
                .points(
                    "Treloar 1944",
                    Ink::Measured,
                    new.iter().map(|t| (t.stretch, t.stress_mpa)),
                )
                .legend_above_left(),
        );
    }
    let picture = std::env::args().nth(1).unwrap_or_else(|| "rubber.png".to_owned());
    Chart::write_png(picture.as_ref(), charts)?;
    println!("{picture}\n");

    println!("Ogden's law against the mode that was not seen: points inside 50 % and 90 %, CRPS");
    let all: Vec<Vec<HeldOutValue<'_>>> =
        held_out_modes.iter().map(PredictedMode::values).collect();
    for values in &all {
        print_scores(values[0].validation, values);
    }
    let one_law = all.iter().step_by(2).flatten().copied().collect::<Vec<_>>();
    print_scores("all modes", &one_law);
    let own_law = all.iter().skip(1).step_by(2).flatten().copied().collect::<Vec<_>>();
    print_scores("all modes by mode", &own_law);
    let table = Path::new(&picture).with_file_name("validation.csv");
    std::fs::write(&table, HeldOutValue::csv(&all.concat()))?;
    println!("{}", table.display());
    Ok(())
}

/// Predictions of the logarithms of stresses in MPa: their scatter about the law is a constant standard deviation.
struct PredictedMode {
    name: String,
    points: Vec<(String, f64, Prediction)>,
}

impl PredictedMode {
    /// Every eighth draw of the posterior, with its scatter, is a value of the prediction.
    fn of(name: &str, new: &[StretchTest], result: &HeldOut) -> Result<Self, Error> {
        let prediction = |k: usize| {
            let draws = result.predicted.iter().step_by(8).map(|row| row[k].ln());
            let draws: Vec<f64> = draws.collect();
            let sds = vec![0.0; draws.len()];
            Prediction::new(draws, sds, 0.0)
        };
        let point = |(k, test): (usize, &StretchTest)| {
            Ok((format!("stretch {}", test.stretch), test.stress_mpa.ln(), prediction(k)?))
        };
        let points = new.iter().enumerate().map(point).collect::<Result<_, Error>>()?;
        Ok(Self { name: name.to_owned(), points })
    }

    fn values(&self) -> Vec<HeldOutValue<'_>> {
        let value = |(specimen, measured, prediction)| HeldOutValue {
            validation: &self.name,
            quantity: "ln_stress_MPa",
            specimen,
            measured,
            prediction,
        };
        let points = self.points.iter().map(|(point, y, prediction)| (&**point, *y, prediction));
        points.map(value).collect()
    }
}

fn print_scores(name: &str, values: &[HeldOutValue<'_>]) {
    let HeldOutScores { inside50, inside90, mean_crps } = HeldOutScores::of(values);
    let [low, high] = inside90.interval(0.95);
    println!(
        "{name}: {} and {} of {} inside (90 %: {low:.2} to {high:.2} with 95 % confidence), mean CRPS {mean_crps:.3}",
        inside50.inside, inside90.inside, inside90.total
    );
}

fn calibrate<M: Model>(name: &str, model: &Bound<M>) -> Result<Loo, Error> {
    let posterior = Nuts::default().chains(4).draws(2000).seed(1).sample(model)?;
    println!("{name}\n{}", posterior.summary());
    Ok(posterior.loo()?)
}
