//! What will be generated, as data: every expression as it will be written, and what becomes of every
//! statement.

mod calls;
mod expressions;
mod literals;
mod refusals;
mod statements;
mod steps;

pub(crate) use calls::shared_name;
pub(crate) use statements::plan;
pub(crate) use steps::{Action, Arm, ArmBody, Body, Flow, Init, Observation, Plan, Plate, Step};
