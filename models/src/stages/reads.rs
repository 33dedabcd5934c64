//! What each stage may read: keys of the case, and products of other stages.

use crate::pipeline::stage::Reads;

pub(super) const SEGMENT: Reads = Reads { keys: &[], products: &[] };
pub(super) const MESH: Reads = Reads { keys: &[], products: &[] };
pub(super) const EXPERIMENTS: Reads = Reads { keys: &[], products: &[] };
pub(super) const ENSEMBLE: Reads = Reads { keys: &[], products: &[] };
pub(super) const SURROGATE: Reads = Reads { keys: &[], products: &[] };
pub(super) const CALIBRATE: Reads = Reads { keys: &[], products: &[] };
pub(super) const CONFIRM: Reads = Reads { keys: &[], products: &[] };
pub(super) const VALIDATE: Reads = Reads { keys: &[], products: &[] };
pub(super) const VERDICT: Reads = Reads { keys: &[], products: &[] };
pub(super) const NEXT_TEST: Reads = Reads { keys: &[], products: &[] };
pub(super) const REPORT: Reads = Reads { keys: &[], products: &[] };
pub(super) const JOINT_CALIBRATE: Reads = Reads { keys: &[], products: &[] };
pub(super) const JOINT_VERDICT: Reads = Reads { keys: &[], products: &[] };
pub(super) const JOINT_REPORT: Reads = Reads { keys: &[], products: &[] };
