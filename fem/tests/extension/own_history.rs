//! Assertions on the history of user-defined laws: a correct law passes, and laws with deliberate faults fail.

use fem::{
    ConstitutiveLaw, ElasticResponse, Material, Principal, Response, Scalar, assert_energy_balance,
    assert_material, assert_step_independence,
};

/// Fault of a law.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
    /// The reported dissipation is 10 % too small.
    Dissipation,
    /// The stored energy lacks the spring of the Maxwell body.
    Energy,
    /// The relaxation is the first-order formula of the implicit Euler method.
    Euler,
    /// The strain of an increment counts as a jump at the start of the increment.
    Jump,
}

/// Mean stress p = K (1 − f) t + K f s with t = tr ε and a Maxwell body, ds/dt = dt/dt − s/t₀; elastic shear. The state is
/// (t, s), so that it does not depend on axes. The update of s is exact at a constant rate of t.
#[derive(Clone, Copy, Debug)]
struct Dilating(Fault);

const BULK_MPA: f64 = 180.0;
const SHEAR_MPA: f64 = 110.0;
const FRACTION: f64 = 0.6;
const TIME_S: f64 = 0.2;

impl ConstitutiveLaw for Dilating {
    fn young_and_poisson(&self) -> [f64; 2] {
        let (k, g) = (BULK_MPA, SHEAR_MPA);
        [9.0 * k * g / (3.0 * k + g), (3.0 * k - 2.0 * g) / (6.0 * k + 2.0 * g)]
    }

    fn state_len(&self) -> usize {
        2
    }

    #[inline(always)]
    fn respond<T: Scalar>(
        &self,
        trial: &Principal<T>,
        g: T,
        dt: T,
        old: &[T],
        new: &mut [T],
    ) -> Response<T> {
        let trace = trial.strains.trace();
        let steps = dt / TIME_S;
        let one = g.constant(1.0);
        let (mut decay, mut gain) = ((-steps).exp(), (one - (-steps).exp()) / steps);
        if self.0 == Fault::Euler {
            decay = one / (steps + 1.0);
            gain = decay;
        }
        if self.0 == Fault::Jump {
            gain = decay;
        }
        let spring = decay * old[1] + gain * (trace - old[0]);
        (new[0], new[1]) = (trace, spring);
        let [elastic, relaxing] = [1.0 - FRACTION, FRACTION].map(|share| share * BULK_MPA);
        let stored = spring * spring * (0.5 * relaxing);
        let mut energy = trace * trace * (0.5 * elastic);
        if self.0 != Fault::Energy {
            energy += stored;
        }
        let pressure = trace * elastic + spring * relaxing;
        let mut out = ElasticResponse::volumetric([energy, pressure, gain * relaxing + elastic]);
        for i in 0..3 {
            let deviator = trial.strains.log[i] - trace / 3.0;
            out.energy += deviator * deviator * SHEAR_MPA;
            out.stress[i] += deviator * (2.0 * SHEAR_MPA);
            out.shear[i] += trial.strains.coth[i] * SHEAR_MPA;
        }
        for (entry, i, j) in [(0, 0, 0), (1, 1, 0), (2, 1, 1), (3, 2, 0), (4, 2, 1), (5, 2, 2)] {
            let share = if i == j { 4.0 / 3.0 } else { -2.0 / 3.0 };
            out.normal[entry] += g.constant(SHEAR_MPA * share);
        }
        let mut out = out.degraded(g);
        let reported = if self.0 == Fault::Dissipation { 0.9 } else { 1.0 };
        out.dissipation = g * stored * steps * (2.0 * reported);
        out
    }
}

fn law(fault: Fault) -> Material {
    Material::with_law(Dilating(fault)).expect("a law")
}

/// Returns the message of a failed assertion.
fn failure(assertion: impl FnOnce() + std::panic::UnwindSafe) -> String {
    let payload = std::panic::catch_unwind(assertion).expect_err("the fault must be found");
    payload.downcast::<String>().map_or_else(|_| String::new(), |message| *message)
}

#[test]
fn a_correct_law_balances_energy_and_is_independent_of_the_step() {
    assert_material(&law(Fault::None), None);
    for strain in [1e-5, 0.3] {
        assert_energy_balance(&law(Fault::None), None, strain);
    }
    assert_step_independence(&law(Fault::None));
}

#[test]
fn wrong_energies_are_found() {
    for fault in [Fault::Dissipation, Fault::Energy] {
        // stress and tangent are correct
        assert_step_independence(&law(fault));
        for strain in [1e-5, 0.3] {
            let message = failure(|| assert_energy_balance(&law(fault), None, strain));
            assert!(message.contains("the work of the stress differs"), "{fault:?}: {message}");
        }
    }
}

#[test]
fn an_algorithm_that_depends_on_the_step_is_found() {
    for fault in [Fault::Euler, Fault::Jump] {
        // the energy balance holds in the limit of small steps
        assert_energy_balance(&law(fault), None, 1e-5);
        let message = failure(|| assert_step_independence(&law(fault)));
        assert!(message.contains("in one increment"), "{fault:?}: {message}");
    }
}
