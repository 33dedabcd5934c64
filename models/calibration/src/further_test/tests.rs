//! Comparison with closed forms of linear and Gaussian tests.

use super::*;

/// Belief from draws of independent uniform priors.
fn prior_alone(prior: &[[f64; 2]]) -> Belief {
    // a lattice with irrational steps fills the box uniformly
    let place = |k: usize, i: usize| {
        let step = [0.754_877_666, 0.569_840_291, 0.445_041_868][i];
        (0.5 + k as f64 * step).fract()
    };
    let draw = |k: usize| {
        prior.iter().enumerate().map(|(i, [low, high])| low + (high - low) * place(k, i)).collect()
    };
    let priors: Vec<Prior> = prior.iter().map(|&[a, b]| Prior::uniform(a, b)).collect();
    Belief::of_draws(&priors, &(0..20_000).map(draw).collect::<Vec<_>>()).unwrap()
}

/// Compares with the inverse of the normal equations, (P⁻¹ + n Jᵀ Σ⁻¹ J)⁻¹, where P contains the prior variances.
#[test]
fn two_parameters_and_three_quantities_have_the_closed_form() {
    let prior = [[250.0, 300.0], [1e-5, 5e-3]];
    let belief = prior_alone(&prior);
    let jacobian = vec![vec![0.0036, 3.0], vec![0.0024, 80.0], vec![-0.0012, 75.0]];
    let scatter = vec![vec![9e-4, 4e-4, 0.0], vec![4e-4, 16e-4, -2e-4], vec![0.0, -2e-4, 4e-4]];
    let draw = TestAtDraw { jacobian: jacobian.clone(), scatter: scatter.clone() };
    let test = FurtherTest {
        draws: vec![draw],
        shared: vec![vec![0.0; 3]; 3],
        seen: Vec::new(),
        alike: None,
    };
    for n in [1, 5, 40] {
        let j = matrix(&jacobian);
        let inverse = matrix(&scatter).try_inverse().unwrap();
        let mut precision = j.transpose() * inverse * j * n as f64;
        for (i, [low, high]) in prior.iter().enumerate() {
            precision[(i, i)] += 12.0 / (high - low).powi(2);
        }
        let exact = precision.try_inverse().unwrap();
        for (i, found) in test.expected(&belief, n).unwrap().iter().enumerate() {
            let width = prior[i][1] - prior[i][0];
            let contraction = 1.0 - exact[(i, i)] / (width * width / 12.0);
            // the moments of 20 000 lattice points differ from the moments of the box by about 1e-4
            assert!((found.contraction - contraction).abs() < 1e-3, "{n} {found:?}");
            let interval = 2.0 * HALF_90 * exact[(i, i)].sqrt();
            assert!((found.width90 - interval.min(0.9 * width)).abs() < 2e-3 * width);
        }
    }
}

/// The peak stress of a homogeneous body (AT2) in a slow test is σ_c = (3/16) √(3 E Gc/l0), so that ∂ ln σ_c/∂ ln E and ∂ ln σ_c/∂
/// ln Gc are ½. If E is known, n peak forces with relative scatter s carry the Fisher information n/(2 s Gc)² on Gc.
#[test]
fn a_rate_independent_peak_tells_the_toughness_and_a_viscous_one_does_not() {
    let prior = [[250.0, 300.0], [0.001, 0.004]];
    let (young, scatter, n) = (275.0, 0.1, 6);
    // E is known almost exactly
    let draws: Vec<Vec<f64>> = (0..4000)
        .map(|k| vec![young + 1e-3 * f64::from(k % 7), 0.001 + 0.003 * f64::from(k) / 3999.0])
        .collect();
    let belief = Belief::of_draws(&prior.map(|[a, b]| Prior::uniform(a, b)), &draws).unwrap();
    let peak = |x: &[f64]| 3.0 / 16.0 * (3.0 * x[0] * x[1] / 0.06).sqrt();
    let at = |x: &[f64], slow: bool| {
        let slope = |i: usize| {
            let h = 1e-6 * x[i];
            let mut moved = x.to_vec();
            moved[i] += h;
            (peak(&moved) / peak(x) - 1.0) / h
        };
        // the peak force of a fast test, in which viscosity dominates, is proportional to E^(2/3)
        let fast = vec![2.0 / (3.0 * x[0]), 0.0];
        let jacobian = if slow { vec![slope(0), slope(1)] } else { fast };
        TestAtDraw { jacobian: vec![jacobian], scatter: vec![vec![scatter * scatter]] }
    };
    let test = |slow: bool| FurtherTest {
        draws: draws.iter().step_by(10).map(|x| at(x, slow)).collect(),
        shared: vec![vec![0.0]],
        seen: Vec::new(),
        alike: None,
    };
    let variance = 0.003f64.powi(2) / 12.0;
    let gc = |k: usize| draws[k][1];
    let exact = (0..4000).step_by(10).map(|k| {
        let information = n as f64 / (2.0 * scatter * gc(k)).powi(2);
        1.0 - 1.0 / (1.0 + variance * information)
    });
    let exact = exact.sum::<f64>() / 400.0;
    let found = test(true).expected(&belief, n).unwrap()[1];
    assert!((found.contraction - exact).abs() < 2e-3, "{found:?} {exact}");
    assert!(found.contraction > 0.5 && found.range[0] < found.range[1]);

    let none = test(false).specimens_for(&belief, 1, Goal::Contraction(0.1)).unwrap();
    assert_eq!(none.specimens, None);
    assert!(none.limit.abs() < 1e-3, "{none:?}");
}

#[test]
fn more_specimens_teach_more_until_what_they_share_is_left() {
    let belief = prior_alone(&[[0.0, 1.0], [2.0, 3.0]]);
    let draw = |k: usize| TestAtDraw {
        jacobian: vec![vec![1.0, 0.2 * k as f64], vec![0.3, 1.0]],
        scatter: vec![vec![0.04, 0.01], vec![0.01, 0.09]],
    };
    let shared = vec![vec![4e-3, 1e-3], vec![1e-3, 2e-3]];
    for seen in [vec![], vec![vec![0, 1]; 5], vec![vec![0, 1], vec![1], vec![0]]] {
        let draws = (0..7).map(draw).collect();
        let test = FurtherTest { draws, shared: shared.clone(), seen: seen.clone(), alike: None };
        let mut before = belief.now();
        for n in [1, 2, 3, 10, 100, 10_000] {
            let now = test.expected(&belief, n).unwrap();
            for (now, before) in now.iter().zip(&before) {
                assert!(now.contraction > before.contraction, "{seen:?} {n}");
                assert!(now.width90 <= before.width90);
            }
            before = now;
        }
        // the goal is the width after nine specimens, so that nine specimens are needed; a width below the limit is
        // never reached
        let at = |n: usize| test.expected(&belief, n).unwrap()[0].width90;
        let needed = test.specimens_for(&belief, 0, Goal::Width90(at(9))).unwrap();
        assert_eq!(needed.specimens, Some(9));
        assert!((needed.limit - at(MANY)).abs() < 1e-12 && needed.limit < at(9));
        let never = test.specimens_for(&belief, 0, Goal::Width90(0.9 * needed.limit)).unwrap();
        assert_eq!((never.specimens, never.limit), (None, needed.limit));
    }
}

/// Tested and further specimens share one error: 4 further specimens after 4 tested specimens give the same
/// contraction as 8 further specimens without tested specimens.
#[test]
fn specimens_seen_before_share_their_error_with_further_ones() {
    let prior = [[0.0, 1.0]];
    let draw = TestAtDraw { jacobian: vec![vec![1.0]], scatter: vec![vec![0.02]] };
    let test = |seen: usize| FurtherTest {
        draws: vec![draw.clone()],
        shared: vec![vec![0.003]],
        seen: vec![vec![0]; seen],
        alike: None,
    };
    let whole = test(0).expected(&prior_alone(&prior), 8).unwrap()[0].contraction;
    let half = test(0).expected(&prior_alone(&prior), 4).unwrap()[0].contraction;
    // draws with the posterior variance after four specimens
    let half_width = (1.0 - half).sqrt() / 2.0;
    let draws: Vec<Vec<f64>> =
        (0..20_001).map(|k| vec![0.5 + half_width * (f64::from(k) / 1e4 - 1.0)]).collect();
    let belief = Belief::of_draws(&prior.map(|[a, b]| Prior::uniform(a, b)), &draws).unwrap();
    assert!((belief.now()[0].contraction - half).abs() < 1e-3);
    let after = test(4).expected(&belief, 4).unwrap()[0].contraction;
    assert!((after - whole).abs() < 1e-3, "{after} {whole}");
    // if the errors of tested and further specimens were independent, the contraction would be too large
    assert!(test(0).expected(&belief, 4).unwrap()[0].contraction > whole + 0.005);
}

/// Compares the information that further specimens add to tested specimens, some of which lack quantities, with the
/// information of all recorded quantities as one normal vector.
#[test]
fn specimens_that_lack_quantities_have_the_information_of_the_others() {
    let belief = prior_alone(&[[0.0, 1.0], [2.0, 3.0]]);
    let draw = TestAtDraw {
        jacobian: vec![vec![1.0, 0.4], vec![0.3, 1.0]],
        scatter: vec![vec![0.04, 0.01], vec![0.01, 0.09]],
    };
    let shared = [[4e-3, 1e-3], [1e-3, 2e-3]];
    let seen = vec![vec![0, 1], vec![1], vec![0], vec![1]];
    let test = FurtherTest {
        draws: vec![draw.clone()],
        shared: shared.map(Vec::from).to_vec(),
        seen: seen.clone(),
        alike: None,
    };
    let information = |specimens: &[Vec<usize>]| {
        let places: Vec<(usize, usize)> = specimens
            .iter()
            .enumerate()
            .flat_map(|(k, recorded)| recorded.iter().map(move |&m| (k, m)))
            .collect();
        let size = places.len();
        let covariance = DMatrix::from_fn(size, size, |a, b| {
            let ((k, m), (l, n)) = (places[a], places[b]);
            shared[m][n] + if k == l { draw.scatter[m][n] } else { 0.0 }
        });
        let jacobian =
            DMatrix::from_fn(size, 2, |a, i| draw.jacobian[places[a].1][i] * belief.prior_sd[i]);
        jacobian.transpose() * covariance.try_inverse().unwrap() * jacobian
    };
    for more in [1, 3] {
        let all = [&seen[..], &vec![vec![0, 1]; more]].concat();
        let exact = information(&all) - information(&seen);
        let found = test.gained(&draw, &matrix(&test.shared), &belief, more).unwrap();
        assert!((&found - &exact).amax() < 1e-10 * exact.amax(), "{found} {exact}");
    }
}

/// A further test that equals the present test contracts the posterior as much as a repetition of the present test. The
/// error of the surrogate of the further test has no effect.
#[test]
fn a_test_that_equals_the_present_one_has_the_value_of_a_repetition() {
    let belief = prior_alone(&[[0.0, 1.0], [2.0, 3.0]]);
    let draw = |change: f64| TestAtDraw {
        jacobian: vec![vec![1.0 + change, 0.4], vec![0.3, 1.0 - change]],
        scatter: vec![vec![0.04, 0.01], vec![0.01, 0.09]],
    };
    let shared = vec![vec![4e-3, 1e-3], vec![1e-3, 2e-3]];
    for seen in [vec![vec![0, 1]; 8], vec![vec![0, 1], vec![1], vec![0], vec![1]]] {
        let (draws, shared) = (vec![draw(0.0)], shared.clone());
        let repeated =
            FurtherTest { draws, shared: shared.clone(), seen: seen.clone(), alike: None };
        let other = |change: f64, own: f64| FurtherTest {
            draws: vec![draw(change)],
            shared: shared.iter().map(|row| row.iter().map(|x| own * x).collect()).collect(),
            seen: Vec::new(),
            alike: Some(AlikeTest {
                draws: vec![draw(0.0)],
                shared: shared.clone(),
                seen: seen.clone(),
                quantities: vec![0, 1],
            }),
        };
        for n in [1, 4, 100] {
            let expected = |test: &FurtherTest| test.expected(&belief, n).unwrap();
            let exact = expected(&repeated);
            for own in [0.0, 0.5, 1.0] {
                for (found, exact) in expected(&other(0.0, own)).iter().zip(&exact) {
                    let difference = (found.contraction - exact.contraction).abs();
                    assert!(difference < 1e-9, "{n} {own} {found:?} {exact:?}");
                }
                // the contraction is continuous: a test that hardly differs from the present test contracts the
                // posterior hardly more than the present test
                for (found, exact) in expected(&other(1e-4, own)).iter().zip(&exact) {
                    assert!(found.contraction < exact.contraction + 1e-3, "{found:?} {exact:?}");
                }
            }
            // if the errors were independent, the same test would contract the posterior more than a repetition of the
            // present test
            let independent = FurtherTest { alike: None, ..other(0.0, 0.5) };
            assert!(expected(&independent)[0].contraction > exact[0].contraction + 1e-3);
            // errors of the further test count if they are larger than the errors of the present test
            let worse = expected(&other(0.0, 100.0));
            assert!(worse[0].contraction < exact[0].contraction);
        }
    }
}

/// Compares the information of a test that shares the error of the present test in one of two quantities with the
/// information of all specimens of both tests as one normal vector.
#[test]
fn a_test_alike_has_the_information_of_one_normal_vector() {
    let belief = prior_alone(&[[0.0, 1.0], [2.0, 3.0]]);
    let present = TestAtDraw {
        jacobian: vec![vec![1.0, 0.4], vec![0.3, 1.0]],
        scatter: vec![vec![0.04, 0.01], vec![0.01, 0.09]],
    };
    let other = TestAtDraw { jacobian: vec![vec![0.2, 1.5]], scatter: vec![vec![0.05]] };
    let shared = vec![vec![4e-3, 1e-3], vec![1e-3, 2e-3]];
    let (tested, more) = (3, 2);
    let alike = AlikeTest {
        draws: vec![present.clone()],
        shared: shared.clone(),
        seen: vec![vec![0, 1]; tested],
        quantities: vec![1],
    };
    let information = |more: usize| {
        // specimen, quantity of the present test, index in the quantities of its own test
        let of_present = (0..tested).flat_map(|k| (0..2).map(move |m| (k, m, m)));
        let of_other = (0..more).map(|k| (tested + k, 1, 0));
        let rows: Vec<(usize, usize, usize)> = of_present.chain(of_other).collect();
        let test = |k: usize| if k < tested { &present } else { &other };
        let covariance = DMatrix::from_fn(rows.len(), rows.len(), |a, b| {
            let ((k, m, i), (l, n, j)) = (rows[a], rows[b]);
            shared[m][n] + if k == l { test(k).scatter[i][j] } else { 0.0 }
        });
        let jacobian = DMatrix::from_fn(rows.len(), 2, |a, parameter| {
            let (k, _, i) = rows[a];
            test(k).jacobian[i][parameter] * belief.prior_sd[parameter]
        });
        jacobian.transpose() * covariance.try_inverse().unwrap() * jacobian
    };
    let exact = information(more) - information(0);
    let found = alike.gained(0, &other, &belief, more).unwrap();
    assert!((&found - &exact).amax() < 1e-10 * exact.amax(), "{found} {exact}");
}

#[test]
fn what_does_not_fit_together_is_said() {
    let belief = prior_alone(&[[0.0, 1.0], [0.0, 1.0]]);
    let draw = TestAtDraw { jacobian: vec![vec![1.0]], scatter: vec![vec![1.0]] };
    let test =
        FurtherTest { draws: vec![draw], shared: vec![vec![0.0]], seen: Vec::new(), alike: None };
    let error = test.expected(&belief, 1).unwrap_err().to_string();
    assert_eq!(error, "the jacobian has 1 entries, expected 2");
    let draws = vec![vec![0.3, 0.4]; 5];
    let error = Belief::of_draws(&[Prior::uniform(0.0, 1.0); 2], &draws).unwrap_err();
    assert_eq!(error, FurtherTestError::Draws(5));
    let draw = TestAtDraw { jacobian: vec![vec![1.0, 1.0]], scatter: vec![vec![-1.0]] };
    let test =
        FurtherTest { draws: vec![draw], shared: vec![vec![0.0]], seen: Vec::new(), alike: None };
    assert_eq!(test.expected(&belief, 1), Err(FurtherTestError::Covariance));
}
