//! Windows of the warmup, and the conditions for raising the target acceptance.

use super::*;

fn last_draws(windows: fn(usize) -> Vec<Window>, warmup: usize) -> Vec<usize> {
    WindowSchedule::new(warmup, windows).windows.iter().map(|w| w.end - 1).collect()
}

/// Ends of the windows in Stan's manual and program for warmups of these lengths.
#[test]
fn stan_window_ends() {
    assert_eq!(last_draws(stan_windows, 1000), [99, 149, 249, 449, 949]);
    assert_eq!(last_draws(stan_windows, 500), [99, 149, 249, 449]);
    assert_eq!(last_draws(stan_windows, 150), [99]);
    assert_eq!(last_draws(stan_windows, 149), [134]);
    assert_eq!(last_draws(stan_windows, 100), [89]);
    assert_eq!(last_draws(stan_windows, 20), [17]);
    assert!(last_draws(stan_windows, 19).is_empty());
    assert!(last_draws(stan_windows, 0).is_empty());
}

#[test]
fn metropolis_window_ends() {
    assert_eq!(last_draws(walk_windows, 5000), [599, 799, 1199, 1999, 3749]);
}

#[test]
fn default_window_ends() {
    let mut expected: Vec<usize> = (0..30).map(|k| 10 * k + 9).collect();
    expected.extend([379, 499, 849]);
    assert_eq!(last_draws(fisher_windows, 1000), expected);
    let mut expected: Vec<usize> = (0..12).map(|k| 10 * k + 9).collect();
    expected.extend([199, 339]);
    assert_eq!(last_draws(fisher_windows, 400), expected);
    assert_eq!(last_draws(fisher_windows, 20), [16]);
    assert!(last_draws(fisher_windows, 19).is_empty());
}

#[test]
fn windows_leave_no_gap_and_room_for_the_step() {
    for windows in [stan_windows, fisher_windows, walk_windows] {
        for warmup in SHORTEST..1200 {
            let windows = WindowSchedule::new(warmup, windows).windows;
            assert!(!windows.is_empty());
            assert!(windows.windows(2).all(|w| w[1].start <= w[0].end && w[0].end < w[1].end));
            // only the early windows, which do not restart the adaptation, overlap
            assert!(windows.windows(2).all(|w| !w[1].restart || w[0].end == w[1].start));
            assert!(windows.iter().all(|w| w.start + 2 <= w.end));
            assert!(windows.last().is_some_and(|w| w.end < warmup));
        }
    }
}

/// Runs a warmup of 200 transitions, of which the transitions in `divergent` diverge. Returns the final target, and the
/// transition after which it was last raised.
fn raised(rule: Adaptation, target: f64, divergent: &[usize]) -> (f64, Option<usize>) {
    let mut warmup = Warmup::new(rule, 1, 200, target);
    let mut metric = Metric::identity(1);
    let point = Position { y: vec![0.0], gradient: vec![0.0], log_density: 0.0 };
    for draw in 0..200 {
        let stats = DrawStats {
            log_density: 0.0,
            energy: 0.0,
            acceptance: 0.8,
            step_size: 1.0,
            depth: 1,
            leapfrogs: 1,
            divergent: divergent.contains(&draw),
            tuning: true,
        };
        if warmup.learn(&stats, &point, &mut metric) == Advice::SearchStep {
            warmup.step.restart(1.0);
        }
    }
    (warmup.step.target, warmup.raised)
}

/// Windows end after the transitions 59 (the last early window) and 169; the later half begins with transition 100.
#[test]
fn divergences_raise_the_target_by_how_late_and_how_many_they_are() {
    let early: Vec<usize> = (0..100).collect();
    assert_eq!(raised(Adaptation::Fisher, 0.8, &early), (0.8, None));
    assert_eq!(raised(Adaptation::Fisher, 0.8, &[120, 140]), (0.8, None));
    assert_eq!(raised(Adaptation::Fisher, 0.8, &[120, 195]), (0.9, Some(195)));
    assert_eq!(raised(Adaptation::Fisher, 0.8, &[195, 196]), (0.9, Some(195)));
    assert_eq!(raised(Adaptation::Fisher, 0.8, &[101, 120, 140, 195]), (0.95, Some(140)));
    assert_eq!(raised(Adaptation::Fisher, 0.8, &[120, 195, 197]), (0.95, Some(197)));
    // divergences shortly after a restart are ignored
    assert_eq!(raised(Adaptation::Fisher, 0.8, &[171, 175, 180, 185]), (0.8, None));
    // the target is never lower than the setting, and Stan's rule does not raise it
    assert_eq!(raised(Adaptation::Fisher, 0.99, &[120, 130, 140, 195]), (0.99, None));
    assert_eq!(raised(Adaptation::Stan, 0.8, &[120, 130, 140, 195]), (0.8, None));
}
