//! The plain-Rust interface that `model!` generates code for.

use ppl::prelude::*;
use ppl::{Bound, Context, Datum, Model, Rejection, Role, Site, Workspace};

struct Line<'a> {
    x: &'a [f64],
    y: &'a [f64],
}

impl Model for Line<'_> {
    fn run<C: Context>(&self, cx: &mut C) -> Result<(), Rejection> {
        static SLOPE: Site = Site::new("slope");
        static SD: Site = Site::new("sd");
        static TWICE: Site = Site::new("twice");
        static Y: Site = Site { repeated: true, ..Site::new("y") };
        let slope = cx.unknown(&SLOPE, Normal(0.0, 1.0).array::<2>())?;
        let sd = cx.unknown(&SD, Normal(0.15, 0.25).truncate(0.0..))?;
        let twice = 2.0 * slope[1] + 1.0 - 0.5 * slope[0] / sd;
        cx.track(&TWICE, &twice)?;
        let half = 0.5 * 3.0;
        for (x, y) in self.x.iter().zip(self.y) {
            let mean = slope[0] * x * half + slope[1] - 0.1 * (1.0 - sd);
            cx.observe(&Y, Datum::lift(&y), Normal(mean, sd))?;
        }
        Ok(())
    }
}

#[test]
fn readings_agree() {
    let (x, y) = ([0.0, 1.0, 2.0], [0.1, 0.9, 2.2]);
    let model = Bound::new(Line { x: &x, y: &y });
    let layout = model.layout().unwrap();
    assert_eq!(layout.dim, 3);
    let names: Vec<_> =
        layout.variables.iter().map(|v| (v.name.as_str(), v.shape.clone())).collect();
    assert_eq!(names, [("slope", vec![2]), ("sd", vec![]), ("twice", vec![]), ("y", vec![3])]);
    assert_eq!(layout.with_role(Role::Observed).count(), 1);

    let point = [0.3, -0.2, -1.0];
    let mut w = Workspace::default();
    let value = model.log_density(&point, &mut w).unwrap();
    let (mut reverse, mut forward) = ([0.0; 3], [0.0; 3]);
    approx::assert_relative_eq!(
        model.gradient(&point, &mut reverse, &mut w).unwrap(),
        value,
        max_relative = 1e-14
    );
    approx::assert_relative_eq!(
        model.forward_gradient(&point, &mut forward).unwrap(),
        value,
        max_relative = 1e-14
    );
    for i in 0..3 {
        approx::assert_relative_eq!(reverse[i], forward[i], max_relative = 1e-12);
        let at = |h: f64, w: &mut Workspace| {
            let mut p = point;
            p[i] += h;
            model.log_density(&p, w).unwrap()
        };
        let difference = (at(1e-5, &mut w) - at(-1e-5, &mut w)) / 2e-5;
        approx::assert_relative_eq!(reverse[i], difference, max_relative = 1e-7);
    }

    // the log-density by hand, at the constrained point
    let sd = (-1.0f64).exp();
    let ln_normal = |x: f64, m: f64, s: f64| Normal(m, s).ln_density(&x);
    let mut by_hand =
        ln_normal(0.3, 0.0, 1.0) + ln_normal(-0.2, 0.0, 1.0) + ln_normal(sd, 0.15, 0.25)
            - Normal(0.15, 0.25).sf(0.0).ln();
    for (x, y) in x.iter().zip(&y) {
        by_hand += ln_normal(*y, 0.3 * x * 1.5 - 0.2 - 0.1 * (1.0 - sd), sd);
    }
    approx::assert_relative_eq!(
        model.log_density_without_jacobian(&point, &mut w).unwrap(),
        by_hand,
        max_relative = 1e-13
    );
    approx::assert_relative_eq!(value, by_hand - 1.0, max_relative = 1e-13);

    let record = model.constrain(&point, &mut rand::rng()).unwrap();
    approx::assert_relative_eq!(record.values("sd").unwrap()[0], sd, max_relative = 1e-14);
    for (a, b) in record.unconstrained.iter().zip(point) {
        approx::assert_relative_eq!(*a, b, max_relative = 1e-12);
    }
}
