//! Synthetic laboratories with several tests of one material.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::emulated::{Emulated, EmulatedTest};
use super::study::{JointLaboratory, JointSetting, Setting};
use crate::fracture::CalibrationError;

/// Synthetic models of several tests of one material, which share all parameters.
#[derive(Clone, Debug)]
pub struct EmulatedTests {
    /// Names and models of the tests.
    tests: Vec<(String, Emulated)>,
}

impl EmulatedTests {
    /// Creates the models, and checks that all tests have the same parameters with the same ranges.
    ///
    /// # Errors
    /// If there is no test, the parameters of two tests differ, or the stiffness ratio is an input of a test.
    pub fn new(tests: Vec<(String, Emulated)>) -> Result<Self, CalibrationError> {
        let [(_, first), ..] = &tests[..] else { return Err(CalibrationError::TooFew(0)) };
        let differs = |test: &Emulated| test.parameters() != first.parameters();
        if let Some((name, _)) = tests.iter().find(|(_, test)| differs(test)) {
            return Err(CalibrationError::Group {
                group: name.clone(),
                problem: "has other parameters than the tests before it".to_owned(),
            });
        }
        if let Some((name, _)) = tests.iter().find(|(_, test)| test.stiffness.is_some()) {
            return Err(CalibrationError::Group {
                group: name.clone(),
                problem: "has the stiffness ratio as an input".to_owned(),
            });
        }
        Ok(Self { tests })
    }

    /// Names and models of the tests; there is at least one.
    pub(super) fn tests(&self) -> &[(String, Emulated)] {
        &self.tests
    }

    /// Draws a laboratory: true parameters, and the specimens and the ensemble of each test. Each test has its own
    /// packings. The settings of the joint calibration are:
    /// 1. `exact`: the exact response of each test;
    /// 2. `packing per run`: for each test, a surrogate of runs that have a separate packing each, with the shared errors of
    ///    this surrogate and of the correction between meshes;
    /// 3. `no error`: these surrogates, assumed to be exact. The intervals of this setting are too narrow.
    ///
    /// # Errors
    /// The errors of [`Emulated::laboratory`].
    pub fn laboratory(&self, seed: u64) -> Result<JointLaboratory, CalibrationError> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let truth = self.tests[0].1.truth(&mut rng);
        let setting = |name: &str| JointSetting { name: name.to_owned(), tests: Vec::new() };
        let mut settings = ["exact", "packing per run", "no error"].map(setting);
        for (name, test) in &self.tests {
            let EmulatedTest { laboratory, exact, per_run, .. } =
                test.test(truth.clone(), test.specimens, &mut rng)?;
            let no_error = per_run.clone().without_error("no error");
            let of_test: [Setting; 3] = [exact, per_run, no_error];
            for (setting, of_test) in settings.iter_mut().zip(of_test) {
                setting.tests.push(of_test.joint_test(name, &laboratory));
            }
        }
        Ok(JointLaboratory { truth, settings: settings.into() })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use surrogate::{Dataset, DesignMethod, DynPce, Input};

    use super::super::closed_form::{INPUTS, inputs, study, world};
    use super::super::{CoverageRow, CoverageStudy, MeshRatio};
    use super::*;

    fn at<'a>(rows: &'a [CoverageRow], setting: &str, nominal: f64) -> Vec<&'a CoverageRow> {
        let is = |row: &&CoverageRow| row.setting == setting && row.nominal == nominal;
        rows.iter().filter(is).collect()
    }

    /// The exact forward model covers all three parameters at the nominal rates. Surrogates with their errors cover as
    /// often as the exact model. The same surrogates without their errors cover less often, and the study detects this.
    #[test]
    fn two_tests_cover_with_the_errors_of_their_surrogates_and_not_without() {
        // many specimens and few runs, so that the surrogate's error is larger than the error of the specimens' mean
        let (world, n) = (world(24, 24), 20);
        let rows = study().run_joint(n, |k| world.laboratory(k as u64), |_| ()).unwrap();
        assert_eq!(rows.len(), 3 * 3 * 3);
        for nominal in [0.5, 0.9] {
            // three binomial standard errors, because six fractions are tested
            let error = 3.0 * (nominal * (1.0 - nominal) / n as f64).sqrt();
            for row in at(&rows, "exact", nominal) {
                assert!((row.covered - nominal).abs() <= error, "{row:?}");
                assert_eq!(row.difference, 0.0);
            }
            for row in at(&rows, "packing per run", nominal) {
                assert!(row.difference.abs() <= error, "{row:?}");
            }
        }
        let exact_and_shared =
            at(&rows, "exact", 0.9).into_iter().zip(at(&rows, "packing per run", 0.9));
        for (exact, shared) in exact_and_shared {
            assert!(shared.mean_width > exact.mean_width, "{exact:?} {shared:?}");
            // both tests together identify the parameter: the interval is narrower than half of the prior's
            let (_, [low, high]) =
                INPUTS.into_iter().find(|(name, _)| *name == exact.parameter).unwrap();
            assert!(exact.mean_width < 0.5 * 0.9 * (high - low), "{exact:?}");
        }
        let narrow = at(&rows, "no error", 0.9);
        for row in &narrow {
            assert!(row.difference < -2.0 * row.difference_error, "{row:?}");
        }
    }

    /// A correction between meshes with a large scatter and few repeated runs widens the intervals.
    #[test]
    fn the_error_of_a_correction_between_meshes_belongs_to_the_intervals() {
        let mut world = world(8, 40);
        let without = world.clone();
        for (_, test) in &mut world.tests {
            let outputs = test.response.outputs().to_vec();
            let mut ratios = Dataset::new(inputs(), outputs, "ratios").unwrap();
            for x in DesignMethod::Sobol.sample(&inputs(), 32, 1).unwrap() {
                let ratio = 0.9 * (x[2] / 0.3).powf(0.02);
                ratios.push(&x, &[ratio, ratio * ratio]).unwrap();
            }
            let mesh = MeshRatio::of(&ratios, 5).unwrap();
            let packings = vec![vec![4e-4, 0.0], vec![0.0, 4e-4]];
            test.mesh = Some(MeshRatio { packings, ..mesh });
        }
        let widths = |world: &EmulatedTests| -> Vec<f64> {
            let rows = study().run_joint(4, |k| world.laboratory(k as u64), |_| ()).unwrap();
            at(&rows, "packing per run", 0.9).iter().map(|row| row.mean_width).collect()
        };
        let (with, without) = (widths(&world), widths(&without));
        assert!(with[0] > 1.1 * without[0] && with[2] > 1.05 * without[2], "{with:?} {without:?}");
    }

    /// A study on one thread calibrates one laboratory after the other.
    #[test]
    fn one_thread_calibrates_one_laboratory_at_a_time() {
        let (world, study) = (world(4, 24), study());
        let study = CoverageStudy { sampler: study.sampler.warmup(20).draws(10), ..study };
        let (begun, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let make = |k: usize| {
            most.fetch_max(begun.fetch_add(1, Ordering::Relaxed) + 1, Ordering::Relaxed);
            world.laboratory(k as u64)
        };
        let finished = |_: usize| {
            begun.fetch_sub(1, Ordering::Relaxed);
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        pool.install(|| study.run_joint(4, make, finished)).unwrap();
        assert_eq!(most.into_inner(), 1);
    }

    #[test]
    fn tests_with_other_ranges_are_refused() {
        let EmulatedTests { mut tests } = world(8, 40);
        let narrower = Input::new(INPUTS[0].0, 240.0, 330.0).unwrap();
        let inputs: Vec<Input> =
            [narrower].into_iter().chain(inputs().into_iter().skip(1)).collect();
        let outputs = tests[1].1.response.outputs().to_vec();
        let constant = vec![(vec![0, 0, 0], vec![1.0, 1.0])];
        tests[1].1.response = DynPce::from_terms(inputs, outputs, constant).unwrap();
        let refused = EmulatedTests::new(tests).unwrap_err().to_string();
        assert!(refused.starts_with("slow has other parameters"), "{refused}");
        assert!(EmulatedTests::new(Vec::new()).is_err());
    }
}
