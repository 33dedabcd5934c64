//! Many simulations with a bar, resumed after an interruption.

use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

use fem::{Campaign, CampaignProgress, CurvePoint, FemError, Fields, Outcome, RunInput, RunRecord};

use super::fingerprint::Fingerprint;
use super::simulation::share_done;
use super::{Workflow, WorkflowError};
use crate::case::PriorCase;
use crate::progress::Bar;

/// A simulation of one run that reports to the observer.
type Job<'a> = &'a (dyn Fn(&RunInput, &mut dyn fem::Observer) -> Result<Outcome, FemError> + Sync);

/// Runs what is not finished yet of a campaign in `name/<fingerprint>`.
///
/// Every campaign has a folder of its own: a changed case starts a new one and loses nothing, and
/// a case changed back finds its runs again.
pub(super) fn run_campaign(
    w: &Workflow,
    title: &str,
    name: &str,
    inputs: Fingerprint,
    runs: &[RunInput],
    job: Job<'_>,
) -> Result<Vec<RunRecord>, WorkflowError> {
    let inputs = inputs.to_string();
    let campaign = Campaign::open(w.path(name).join(&inputs), &inputs)?;
    let bar = CampaignBar(Bar::new(title));
    let records = campaign.run(
        runs,
        &PriorCase::NAMES,
        w.threads,
        &|run, done| {
            job(run, &mut |point: &CurvePoint, _: &Fields| {
                done(share_done(point, w.case()));
                if w.interrupt.load(Ordering::Relaxed) {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            })
        },
        &bar,
        w.interrupt,
    )?;
    w.check_interrupt()?;
    Ok(records)
}

struct CampaignBar(Bar);

impl CampaignProgress for CampaignBar {
    fn update(&self, finished: usize, total: usize, share: f64) {
        self.0.set(share, &format!("{finished} of {total} runs"));
    }

    fn warning(&self, message: &str) {
        self.0.note(message);
    }
}
