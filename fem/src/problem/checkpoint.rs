//! The state of a run on disk, from which it goes on bit by bit as if it had never stopped.
//!
//! A file holds a line `breccia-state 2`, a line of JSON (numbers in shortest round-trip form), the
//! arrays (each its length as u64, then f64, little endian), and a checksum of all that (FNV-1a, u64).
//! What the linear solver keeps from step to step is not in it: a run with a checkpoint forgets that
//! whenever it saves, so that the same steps follow whether or not it was interrupted there.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::curve::CurvePoint;
use super::march::{ArcState, State};
use crate::error::FemError;
use crate::fields::Fields;
use crate::solve::Effort;

/// Where a run keeps its state, and how often it saves.
///
/// # Example
/// ```no_run
/// # fn go(test: fem::CompressionTest) -> Result<(), fem::FemError> {
/// let checkpoint = fem::Checkpoint { path: "run.state".into(), every: 10 };
/// // the first time from the start, after a kill from the last saved step
/// let outcome = test.run_resumable(&checkpoint, &mut ())?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Checkpoint {
    /// The file; it is replaced in one move, never half written.
    pub path: PathBuf,
    /// Load steps from one save to the next, at least 1.
    pub every: u32,
}

const MAGIC: &str = "breccia-state 2";

/// All but the arrays.
#[derive(Serialize, Deserialize)]
struct Header {
    fingerprint: u64,
    curve: Vec<CurvePoint>,
    reactions: BTreeMap<String, Vec<[f64; 3]>>,
    reaction: BTreeMap<String, [f64; 3]>,
    /// The increment that the saved change of the fields belongs to.
    changed_over: Option<f64>,
    point: CurvePoint,
    clock: f64,
    step: f64,
    arc: ArcState,
    recorded: u32,
    peak: f64,
    effort: Effort,
    platens: usize,
}

/// FNV-1a over bytes: enough to notice a damaged file or another test.
#[derive(Clone, Copy)]
pub(crate) struct Fingerprint(u64);

impl Fingerprint {
    pub(crate) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    pub(crate) fn add(mut self, bytes: &[u8]) -> Self {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        self
    }

    pub(crate) fn value(self) -> u64 {
        self.0
    }
}

impl Checkpoint {
    /// Writes a state.
    pub(crate) fn save(&self, state: &State, fingerprint: u64) -> Result<(), FemError> {
        let header = Header {
            fingerprint,
            curve: state.curve.clone(),
            reactions: state.reactions.clone(),
            reaction: state.reaction.clone(),
            changed_over: state.change.as_ref().map(|(_, step)| *step),
            point: state.point,
            clock: state.clock,
            step: state.step,
            arc: state.arc,
            recorded: state.recorded,
            peak: state.peak,
            effort: state.effort,
            platens: state.pressures.len(),
        };
        let json = serde_json::to_string(&header)
            .map_err(|e| self.error(format!("cannot be written: {e}")))?;
        let mut bytes = format!("{MAGIC}\n{json}\n").into_bytes();
        let none = Fields::default();
        let change = state.change.as_ref().map_or(&none, |(change, _)| change);
        let [history, lower] = state.memory.arrays();
        for array in [
            state.fields.displacement.as_flattened(),
            &state.fields.damage,
            change.displacement.as_flattened(),
            &change.damage,
            state.forces.as_flattened(),
            &history,
            &lower,
        ] {
            put(&mut bytes, array);
        }
        state.pressures.iter().for_each(|p| put(&mut bytes, p));
        let sum = Fingerprint::new().add(&bytes).value();
        bytes.extend(sum.to_le_bytes());
        self.replace(&bytes).map_err(|e| self.error(format!("cannot be written: {e}")))
    }

    fn replace(&self, bytes: &[u8]) -> std::io::Result<()> {
        let mut name = self.path.file_name().unwrap_or_default().to_owned();
        name.push(format!(".{}.partial", std::process::id()));
        let partial = self.path.with_file_name(name);
        let mut file = File::create(&partial)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        std::fs::rename(&partial, &self.path)
    }

    /// Reads a state into the fresh one of a run; false if there is no file.
    pub(crate) fn load(&self, fingerprint: u64, state: &mut State) -> Result<bool, FemError> {
        let bytes = match std::fs::read(&self.path) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(false),
            Err(e) => return Err(self.error(format!("cannot be read: {e}"))),
        };
        let damaged = || self.error("is damaged: remove it to start again".into());
        let (body, sum) = bytes.split_last_chunk::<8>().ok_or_else(damaged)?;
        if Fingerprint::new().add(body).value() != u64::from_le_bytes(*sum) {
            return Err(damaged());
        }
        let rest = body
            .strip_prefix(MAGIC.as_bytes())
            .and_then(|rest| rest.strip_prefix(b"\n"))
            .ok_or_else(damaged)?;
        let end = rest.iter().position(|&b| b == b'\n').ok_or_else(damaged)?;
        let header: Header = serde_json::from_slice(&rest[..end]).map_err(|_| damaged())?;
        if header.fingerprint != fingerprint {
            return Err(self.error(
                "is the state of another test: remove it to start this one, or name another file"
                    .into(),
            ));
        }
        let mut rest = &rest[end + 1..];
        let mut next = || take(&mut rest).ok_or_else(damaged);
        let mut fields = || -> Result<Fields, FemError> {
            Ok(Fields { displacement: vectors(&next()?), damage: next()? })
        };
        state.fields = fields()?;
        let change = fields()?;
        state.change = header.changed_over.map(|step| (change, step));
        state.forces = vectors(&next()?);
        state.memory.restore([next()?, next()?]);
        state.pressures = (0..header.platens).map(|_| next()).collect::<Result<_, _>>()?;
        (state.curve, state.reactions, state.reaction) =
            (header.curve, header.reactions, header.reaction);
        (state.point, state.clock, state.step) = (header.point, header.clock, header.step);
        (state.arc, state.recorded) = (header.arc, header.recorded);
        (state.peak, state.effort) = (header.peak, header.effort);
        Ok(true)
    }

    pub(crate) fn validate(&self) -> Result<(), FemError> {
        if self.every > 0 {
            return Ok(());
        }
        Err(FemError::parameter("checkpoint", "every", 0.0, "at least 1 load step"))
    }

    fn error(&self, message: String) -> FemError {
        FemError::Checkpoint { path: Path::display(&self.path).to_string(), message }
    }
}

fn put(bytes: &mut Vec<u8>, values: &[f64]) {
    bytes.extend((values.len() as u64).to_le_bytes());
    bytes.extend(values.iter().flat_map(|x| x.to_le_bytes()));
}

fn take(rest: &mut &[u8]) -> Option<Vec<f64>> {
    let (length, after) = rest.split_first_chunk::<8>()?;
    let bytes = usize::try_from(u64::from_le_bytes(*length)).ok()?.checked_mul(8)?;
    let (array, after) = after.split_at_checked(bytes)?;
    *rest = after;
    let (values, _) = array.as_chunks::<8>();
    Some(values.iter().map(|x| f64::from_le_bytes(*x)).collect())
}

fn vectors(values: &[f64]) -> Vec<[f64; 3]> {
    values.as_chunks::<3>().0.to_vec()
}
