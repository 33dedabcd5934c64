//! Schedule of the warmup: the transitions after which the mass matrix is estimated, and the draws from which it is
//! estimated.

use std::mem::discriminant;

use serde::{Deserialize, Serialize};

use crate::sampler::draws::report::{DrawStats, MapSwitch, WarmupReport};
use crate::sampler::hamiltonian::metric::{Choice, Diagonal, Metric, Sample, choose};
use crate::sampler::hamiltonian::step_size::DualAveraging;
use crate::sampler::hamiltonian::system::Position;

/// Rule by which the warmup adapts the mass matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Adaptation {
    /// Stan's rule: variances of the draws in doubling windows.
    Stan,
    /// Default rule: frequent fits to draws and scores (gradients of the log density), which minimise the Fisher
    /// divergence.
    Fisher,
}

/// Window `start..end` of warmup draws from which one mass matrix is estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Window {
    start: usize,
    end: usize,
    /// Whether, after the window, a new initial step size is searched and dual averaging is restarted.
    restart: bool,
}

/// Shortest warmup that adapts the mass matrix; a shorter warmup adapts the step size only.
const SHORTEST: usize = 20;
/// Windows of the default schedule: length of the early windows, length of the first later window, and growth factor
/// of the lengths.
const EARLY_WINDOW: usize = 10;
const FIRST_WINDOW: usize = 80;
const WINDOW_GROWTH: f64 = 1.5;
/// Length of the first window of Metropolis, whose draws are more correlated.
const FIRST_WALK: usize = 100;
/// Target acceptance after a divergence in the final part of the warmup, which tunes only the step size.
const RAISED_TARGET: f64 = 0.9;
/// Target acceptance after frequent divergences in the later half of the warmup.
const CAREFUL_TARGET: f64 = 0.95;
/// Divergences are frequent if there is at least one per `OFTEN` transitions, and at least `A_FEW` in total.
const OFTEN: usize = 75;
const A_FEW: usize = 3;
/// Number of transitions after a restart during which divergences are ignored, because the step size varies strongly.
const SETTLING: f64 = 20.0;

/// Windows of Stan's warmup: 75 draws without a window, doubling windows from 25 draws, 50 draws without a window. In
/// a warmup shorter than 150 draws, the three parts are 15 %, 75 % and 10 % of the warmup.
pub(crate) fn stan_windows(warmup: usize) -> Vec<Window> {
    let (first, length, last) = if warmup >= 150 {
        (75, 25, warmup - 50)
    } else {
        let (first, rest) = (warmup * 15 / 100, warmup / 10);
        (first, warmup - first - rest, warmup - rest)
    };
    growing(first, last, length, 2.0)
}

/// Windows of the default warmup. In the first 30 %, a window ends every 10 draws and covers the later half of all
/// draws so far. Windows of 80 · 1.5ⁿ draws follow. The last 15 % of the warmup have no window.
pub(crate) fn fisher_windows(warmup: usize) -> Vec<Window> {
    let early = warmup * 3 / 10 / EARLY_WINDOW;
    let mut windows: Vec<Window> = (0..early)
        .map(|k| {
            let end = (k + 1) * EARLY_WINDOW;
            // the first estimate can change the scale by orders of magnitude; the following early estimates change it
            // little
            Window { start: if k == 0 { 0 } else { end / 2 }, end, restart: k == 0 }
        })
        .collect();
    let last = warmup - (warmup * 15).div_ceil(100);
    windows.extend(growing(early * EARLY_WINDOW, last, FIRST_WINDOW, WINDOW_GROWTH));
    windows
}

/// Windows of the Metropolis warmup: the first tenth has no window, doubling windows follow, and the last quarter,
/// which only tunes the scale, has no window.
pub(crate) fn walk_windows(warmup: usize) -> Vec<Window> {
    growing(warmup / 10, warmup - warmup / 4, FIRST_WALK, 2.0)
}

/// Contiguous windows whose lengths grow by the factor `growth`. The last window is extended to `last`.
fn growing(first: usize, last: usize, length: usize, growth: f64) -> Vec<Window> {
    let (mut windows, mut start, mut length) = (Vec::new(), first, length as f64);
    while start < last {
        let end = start + length as usize;
        length *= growth;
        let end = if end + length as usize > last { last } else { end };
        windows.push(Window { start, end, restart: true });
        start = end;
    }
    windows
}

/// Position of a warmup transition relative to the windows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Moment {
    /// Before the first window.
    Before,
    /// Inside a window: the draw is used in the estimate.
    Inside,
    /// Last draw of a window: the mass matrix is replaced.
    Last {
        /// Whether a new initial step size is searched and dual averaging is restarted.
        restart: bool,
    },
    /// After the last window: only the step size is adapted.
    After,
}

/// Windows of a warmup, with the number of completed transitions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct WindowSchedule {
    windows: Vec<Window>,
    /// Index of the last draw of each completed window.
    pub(crate) passed: Vec<usize>,
    draw: usize,
}

impl WindowSchedule {
    pub(crate) fn new(warmup: usize, windows: fn(usize) -> Vec<Window>) -> Self {
        let windows = if warmup < SHORTEST { Vec::new() } else { windows(warmup) };
        Self { passed: Vec::with_capacity(windows.len()), windows, draw: 0 }
    }

    /// First draw of the current or next window.
    fn next_start(&self) -> Option<usize> {
        self.windows.get(self.passed.len()).map(|window| window.start)
    }

    /// Whether the number of completed transitions is `transitions`.
    pub(crate) fn has_passed(&self, transitions: usize) -> bool {
        self.draw == transitions
    }

    /// Advances the schedule by one transition. Returns the position of the transition relative to the windows.
    pub(crate) fn pass(&mut self) -> Moment {
        let draw = self.draw;
        self.draw += 1;
        match self.windows.get(self.passed.len()) {
            None => Moment::After,
            Some(window) if draw < window.start => Moment::Before,
            Some(window) if draw + 1 < window.end => Moment::Inside,
            Some(window) => {
                self.passed.push(draw);
                Moment::Last { restart: window.restart }
            }
        }
    }
}

/// Instruction of the warmup to the sampler after a transition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Advice {
    /// Continue with the current step size.
    Continue,
    /// Search a new step size, because the mass matrix has changed.
    SearchStep,
}

/// Adaptation of a Hamiltonian chain during its warmup.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Warmup {
    pub(crate) step: DualAveraging,
    pub(crate) schedule: WindowSchedule,
    adaptation: Adaptation,
    /// Whether the mass matrix has been estimated from draws.
    learnt: bool,
    sample: Sample,
    switches: Vec<MapSwitch>,
    /// Index of the first transition of the later half of the warmup.
    half: usize,
    /// Number of divergences in the later half of the warmup; divergences shortly after a restart of the step size
    /// adaptation are not counted.
    divergences: usize,
    raised: Option<usize>,
}

impl Warmup {
    pub(crate) fn new(adaptation: Adaptation, dim: usize, warmup: usize, target: f64) -> Self {
        let windows = match adaptation {
            Adaptation::Stan => stan_windows,
            Adaptation::Fisher => fisher_windows,
        };
        Self {
            step: DualAveraging::new(target, 1.0),
            schedule: WindowSchedule::new(warmup, windows),
            adaptation,
            learnt: false,
            sample: Sample::new(dim),
            switches: Vec::new(),
            half: warmup / 2,
            divergences: 0,
            raised: None,
        }
    }

    /// Whether a start that is far from the posterior is moved closer to the posterior before the first transition.
    pub(crate) fn approaches(&self) -> bool {
        self.adaptation == Adaptation::Fisher && !self.schedule.windows.is_empty()
    }

    /// Sets the mass matrix before the first draw. The default rule estimates the variances `σ² = 1/|∂ ln p|` from
    /// the score (gradient of the log density) at the starting point. This is the Fisher estimate √(var x/var ∂ ln p)
    /// for draws of unit scale.
    pub(crate) fn first_metric(&self, metric: &mut Metric, point: &Position) {
        if self.adaptation == Adaptation::Fisher {
            let variance = |i: usize| 1.0 / point.gradient[i].abs();
            *metric = Metric::Diagonal(Diagonal::renewed(metric.variances(), variance));
        }
    }

    pub(crate) fn learn(
        &mut self,
        stats: &DrawStats,
        point: &Position,
        metric: &mut Metric,
    ) -> Advice {
        self.step.learn(stats.acceptance);
        let moment = self.schedule.pass();
        let settled = self.step.count() > SETTLING;
        if self.adaptation == Adaptation::Fisher && stats.divergent && settled {
            self.raise_target(moment);
        }
        match moment {
            Moment::Before => Advice::Continue,
            Moment::Inside => {
                self.sample.add(&point.y, &point.gradient);
                Advice::Continue
            }
            Moment::Last { restart } => {
                self.sample.add(&point.y, &point.gradient);
                self.switch(metric, restart)
            }
            Moment::After => Advice::Continue,
        }
    }

    /// Raises the target acceptance after a divergence in the later half of the warmup. The new target depends on the
    /// number of divergences so far.
    ///
    /// Divergences indicate regions of high curvature ("necks"). The mass matrix fits the bulk of the density, not
    /// its necks. A chain that enters a neck with a step size for the bulk can stay in the neck for hundreds of
    /// transitions.
    fn raise_target(&mut self, moment: Moment) {
        let draw = self.schedule.draw - 1;
        if draw < self.half {
            return;
        }
        self.divergences += 1;
        let target = if self.divergences >= A_FEW.max(self.half.div_ceil(OFTEN)) {
            CAREFUL_TARGET
        } else if moment == Moment::After {
            RAISED_TARGET
        } else {
            return;
        };
        if target > self.step.target {
            self.step.target = target;
            self.raised = Some(draw);
        }
    }

    /// Replaces the mass matrix at the end of a window.
    fn switch(&mut self, metric: &mut Metric, restart: bool) -> Advice {
        let draw = self.schedule.draw - 1;
        let choice = match self.adaptation {
            // the current matrix is compared only if it was estimated from draws that do not belong to this window
            Adaptation::Fisher => choose(&self.sample, metric, restart && self.learnt),
            Adaptation::Stan => {
                let window = self.sample.all();
                let variance = |i: usize| window.shrunk_variance(i);
                let renewed = Diagonal::renewed(metric.variances(), variance);
                Choice { metric: Some(Metric::Diagonal(renewed)), divergences: Vec::new() }
            }
        };
        let before = metric.kind();
        let metric_is_kept = choice.metric.is_none();
        if let Some(new) = choice.metric {
            *metric = new;
        }
        self.learnt = true;
        let map = metric.kind();
        // restart at the first matrix with correlations, too: it can change the scale as much as the first estimate of
        // the variances
        let restarted = !metric_is_kept && (restart || discriminant(&map) != discriminant(&before));
        let divergences = choice.divergences;
        self.switches.push(MapSwitch { draw, map, kept: metric_is_kept, restarted, divergences });
        let next = self.schedule.next_start().unwrap_or(draw + 1);
        self.sample.keep_last((draw + 1).saturating_sub(next));
        if restarted { Advice::SearchStep } else { Advice::Continue }
    }

    /// Whether the adaptation has `dim` coordinates and has completed `transitions` transitions.
    pub(crate) fn fits(&self, dim: usize, transitions: usize) -> bool {
        self.schedule.has_passed(transitions) && self.sample.fits(dim)
    }

    /// Writes the decisions of the warmup to the report of the chain.
    pub(crate) fn report(&mut self, report: &mut WarmupReport) {
        report.target_acceptance = self.step.target;
        report.target_raised = self.raised;
        report.windows = std::mem::take(&mut self.schedule.passed);
        report.switches = std::mem::take(&mut self.switches);
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/sampler_warmup.rs"]
mod tests;
