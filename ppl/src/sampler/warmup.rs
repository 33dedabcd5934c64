//! When the warmup learns the mass matrix, and from which draws.

use std::mem::discriminant;

use serde::{Deserialize, Serialize};

use super::{
    hamiltonian::Position,
    metric::{Choice, Diagonal, Metric, Sample, choose},
    report::{DrawStats, MapSwitch, WarmupReport},
    step_size::DualAveraging,
};

/// Adaptation by which a run adapts its mass matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Adaptation {
    /// Variance of the draws in doubling windows, as Stan does.
    Stan,
    /// Maps of least Fisher divergence from draws and scores, replaced early and often.
    Fisher,
}

/// Draws `start..end` of the warmup from which one mass matrix is estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Window {
    start: usize,
    end: usize,
    /// The step search and dual averaging begin anew with the new mass matrix.
    restart: bool,
}

/// Below this length only the step size is adapted.
const SHORTEST: usize = 20;
/// Length and growth of the windows of the default schedule.
const EARLY_WINDOW: usize = 10;
const FIRST_WINDOW: usize = 80;
const WINDOW_GROWTH: f64 = 1.5;
/// First window of Metropolis, whose draws tell less each.
const FIRST_WALK: usize = 100;
/// The target of a run that diverged while only the step was tuned.
const RAISED_TARGET: f64 = 0.9;
/// The target of a run whose later half of the warmup diverged often.
const CAREFUL_TARGET: f64 = 0.95;
/// Often is once in so many transitions, and a few times at least.
const OFTEN: usize = 75;
const A_FEW: usize = 3;
/// Transitions after a restart whose steps are still wild, so that a divergence tells nothing.
const SETTLING: f64 = 20.0;

/// 75 draws without, doubling windows from 25, 50 draws without; below 150 draws 15 / 75 / 10 %.
pub(super) fn stan_windows(warmup: usize) -> Vec<Window> {
    let (first, length, last) = if warmup >= 150 {
        (75, 25, warmup - 50)
    } else {
        let (first, rest) = (warmup * 15 / 100, warmup / 10);
        (first, warmup - first - rest, warmup - rest)
    };
    growing(first, last, length, 2.0)
}

/// Every 10 draws in the first 30 %, from the later half of the draws so far; then windows of
/// 80 · 1.5ⁿ draws, the last 15 % without.
pub(super) fn fisher_windows(warmup: usize) -> Vec<Window> {
    let early = warmup * 3 / 10 / EARLY_WINDOW;
    let mut windows: Vec<Window> = (0..early)
        .map(|k| {
            let end = (k + 1) * EARLY_WINDOW;
            // the first map from draws may change the scale by orders; later early ones hardly
            Window { start: if k == 0 { 0 } else { end / 2 }, end, restart: k == 0 }
        })
        .collect();
    let last = warmup - (warmup * 15).div_ceil(100);
    windows.extend(growing(early * EARLY_WINDOW, last, FIRST_WINDOW, WINDOW_GROWTH));
    windows
}

/// For Metropolis: doubling windows, with much time for the scale.
pub(super) fn walk_windows(warmup: usize) -> Vec<Window> {
    growing(warmup / 10, warmup - warmup / 4, FIRST_WALK, 2.0)
}

/// Adjoining windows that grow by `growth`; one is stretched to `last` if the next would not fit.
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

/// What a warmup transition means for the estimate of the mass matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Moment {
    /// Before the first window.
    Before,
    /// Inside a window: the draw belongs to the estimate.
    Inside,
    /// Last draw of a window: replace the mass matrix, and search the step anew if `restart`.
    Last {
        /// The step search and dual averaging begin anew.
        restart: bool,
    },
    /// Only the step size is adapted any more.
    After,
}

/// The windows of one warmup, passed one by one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct WindowSchedule {
    windows: Vec<Window>,
    /// Last draws of the windows passed.
    pub(super) passed: Vec<usize>,
    draw: usize,
}

impl WindowSchedule {
    pub(super) fn new(warmup: usize, windows: fn(usize) -> Vec<Window>) -> Self {
        let windows = if warmup < SHORTEST { Vec::new() } else { windows(warmup) };
        Self { passed: Vec::with_capacity(windows.len()), windows, draw: 0 }
    }

    /// First draw of the window that comes next, or is not over.
    fn next_start(&self) -> Option<usize> {
        self.windows.get(self.passed.len()).map(|window| window.start)
    }

    /// Whether that many transitions are over.
    pub(super) fn has_passed(&self, transitions: usize) -> bool {
        self.draw == transitions
    }

    /// Passes one transition.
    pub(super) fn pass(&mut self) -> Moment {
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

/// What the warmup asks of the sampler after a transition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Advice {
    /// Go on with the current step.
    GoOn,
    /// The mass matrix has changed: search a new step.
    SearchStep,
}

/// The adaptation of a Hamiltonian chain during its warmup.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Warmup {
    pub(super) step: DualAveraging,
    pub(super) schedule: WindowSchedule,
    rule: Adaptation,
    /// The mass matrix comes from draws.
    learnt: bool,
    sample: Sample,
    switches: Vec<MapSwitch>,
    /// First transition of the later half.
    half: usize,
    /// Divergences of settled steps since then.
    divergences: usize,
    raised: Option<usize>,
}

impl Warmup {
    pub(super) fn new(rule: Adaptation, dim: usize, warmup: usize, target: f64) -> Self {
        let windows = match rule {
            Adaptation::Stan => stan_windows,
            Adaptation::Fisher => fisher_windows,
        };
        Self {
            step: DualAveraging::new(target, 1.0),
            schedule: WindowSchedule::new(warmup, windows),
            rule,
            learnt: false,
            sample: Sample::new(dim),
            switches: Vec::new(),
            half: warmup / 2,
            divergences: 0,
            raised: None,
        }
    }

    /// Whether a start far from the posterior is left for a nearer one first.
    pub(super) fn approaches(&self) -> bool {
        self.rule == Adaptation::Fisher && !self.schedule.windows.is_empty()
    }

    /// The mass matrix before any draw: with unit scale assumed for the draws, the Fisher rule
    /// reads `σ² = 1/|∂ ln p|` from the first score.
    pub(super) fn first_metric(&self, metric: &mut Metric, point: &Position) {
        if self.rule == Adaptation::Fisher {
            let variance = |i: usize| 1.0 / point.gradient[i].abs();
            *metric = Metric::Diagonal(Diagonal::renewed(metric.variances(), variance));
        }
    }

    pub(super) fn learn(
        &mut self,
        stats: &DrawStats,
        point: &Position,
        metric: &mut Metric,
    ) -> Advice {
        self.step.learn(stats.acceptance);
        let moment = self.schedule.pass();
        let settled = self.step.count() > SETTLING;
        if self.rule == Adaptation::Fisher && stats.divergent && settled {
            self.raise_target(moment);
        }
        match moment {
            Moment::Before => Advice::GoOn,
            Moment::Inside => {
                self.sample.add(&point.y, &point.gradient);
                Advice::GoOn
            }
            Moment::Last { restart } => {
                self.sample.add(&point.y, &point.gradient);
                self.switch(metric, restart)
            }
            Moment::After => Advice::GoOn,
        }
    }

    /// After a divergence: a target is tuned to that suits how often they come.
    ///
    /// Where the density is as curved as that, the map fits its bulk and not its necks, and a chain
    /// that enters one with steps for the bulk may not come out for hundreds of transitions.
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
        let choice = match self.rule {
            // a map from draws competes where the window is new to it
            Adaptation::Fisher => choose(&self.sample, metric, restart && self.learnt),
            Adaptation::Stan => {
                let window = self.sample.all();
                let variance = |i: usize| window.shrunk_variance(i);
                let renewed = Diagonal::renewed(metric.variances(), variance);
                Choice { metric: Some(Metric::Diagonal(renewed)), divergences: Vec::new() }
            }
        };
        let before = metric.kind();
        let kept = choice.metric.is_none();
        if let Some(new) = choice.metric {
            *metric = new;
        }
        self.learnt = true;
        let map = metric.kind();
        // the first correlations change the scale as much as the first variances
        let restarted = !kept && (restart || discriminant(&map) != discriminant(&before));
        let divergences = choice.divergences;
        self.switches.push(MapSwitch { draw, map, kept, restarted, divergences });
        let next = self.schedule.next_start().unwrap_or(draw + 1);
        self.sample.keep_last((draw + 1).saturating_sub(next));
        if restarted { Advice::SearchStep } else { Advice::GoOn }
    }

    /// Whether it is of a density of `dim` coordinates, after so many transitions.
    pub(super) fn fits(&self, dim: usize, transitions: usize) -> bool {
        self.schedule.has_passed(transitions) && self.sample.fits(dim)
    }

    /// Writes down what was decided.
    pub(super) fn report(&mut self, report: &mut WarmupReport) {
        report.target_acceptance = self.step.target;
        report.target_raised = self.raised;
        report.windows = std::mem::take(&mut self.schedule.passed);
        report.switches = std::mem::take(&mut self.switches);
    }
}

#[cfg(test)]
#[path = "../../tests/unit/sampler_warmup.rs"]
mod tests;
