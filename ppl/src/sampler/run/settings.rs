//! Settings common to all samplers.

use std::sync::atomic::AtomicBool;

use crate::model::start::NamedValues;
use crate::sampler::run::error::RunError;
use crate::sampler::run::progress::Progress;

/// Starting points of the chains, in unconstrained space.
#[derive(Clone, Debug)]
pub(crate) enum Starts {
    /// Random points with independent coordinates, uniform on (−r, r). The field is r.
    Uniform(f64),
    /// One given point per chain.
    Points(Vec<Vec<f64>>),
}

/// Largest number of values that one chain may store, 32 GiB. The limit prevents a typing error from exhausting memory.
const MOST_NUMBERS: usize = 1 << 32;
const MOST_CHAINS: usize = 10_000;
const MOST_THREADS: usize = 1024;
/// Number of statistics that are stored per draw, in addition to the coordinates of the draw.
const STATISTICS: usize = 7;

/// Settings common to all samplers.
#[derive(Clone)]
pub(crate) struct Settings<'a> {
    pub(crate) chains: usize,
    pub(crate) warmup: usize,
    pub(crate) draws: usize,
    pub(crate) thin: usize,
    pub(crate) seed: u64,
    pub(crate) threads: Option<usize>,
    pub(crate) init: Starts,
    pub(crate) values: NamedValues,
    pub(crate) progress: Option<&'a dyn Progress>,
    pub(crate) interrupt: Option<&'a AtomicBool>,
}

impl std::fmt::Debug for Settings<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // the field `progress` is omitted, because an observer need not implement `Debug`
        f.debug_struct("Settings")
            .field("chains", &self.chains)
            .field("warmup", &self.warmup)
            .field("draws", &self.draws)
            .field("thin", &self.thin)
            .field("seed", &self.seed)
            .field("threads", &self.threads)
            .field("init", &self.init)
            .field("values", &self.values)
            .finish_non_exhaustive()
    }
}

impl Settings<'_> {
    pub(crate) fn new(warmup: usize, draws: usize) -> Self {
        Self {
            chains: 4,
            warmup,
            draws,
            thin: 1,
            seed: 0,
            threads: None,
            init: Starts::Uniform(2.0),
            values: Vec::new(),
            progress: None,
            interrupt: None,
        }
    }
}

impl Settings<'_> {
    /// Returns an error if a setting is invalid for `dim` coordinates.
    pub(crate) fn validate(&self, dim: usize) -> Result<(), RunError> {
        let refuse = |setting, value: String, help| Err(RunError::Setting { setting, value, help });
        let positive = [
            ("chains", self.chains),
            ("draws", self.draws),
            ("thin", self.thin),
            ("threads", self.threads.unwrap_or(1)),
        ];
        for (setting, value) in positive {
            if value == 0 {
                return refuse(setting, "0".into(), "give at least 1");
            }
        }
        let limits = [
            ("chains", self.chains, MOST_CHAINS, "give at most 10 000"),
            ("threads", self.threads.unwrap_or(1), MOST_THREADS, "give at most 1024"),
        ];
        for (setting, value, most, help) in limits {
            if value > most {
                return refuse(setting, value.to_string(), help);
            }
        }
        if self.draws.checked_mul(self.thin).is_none() {
            return refuse("thin", self.thin.to_string(), "draws × thin must be below 2^64");
        }
        let stored = self.draws.saturating_mul(dim.saturating_add(STATISTICS));
        if stored > MOST_NUMBERS {
            return refuse(
                "draws",
                self.draws.to_string(),
                "a chain stores draws × (unknowns + 7) numbers, at most 2^32; use fewer draws, or thin",
            );
        }
        if self.warmup > MOST_NUMBERS / STATISTICS {
            return refuse("warmup", self.warmup.to_string(), "give at most 2^32 / 7");
        }
        match &self.init {
            Starts::Uniform(radius) if !(radius.is_finite() && *radius >= 0.0) => {
                refuse("init_radius", radius.to_string(), "give a finite number ≥ 0")
            }
            Starts::Points(starts) if starts.len() != self.chains => refuse(
                "init_points",
                format!("{} points", starts.len()),
                "give one starting point for each chain",
            ),
            Starts::Points(starts) => match starts.iter().position(|p| p.len() != dim) {
                Some(chain) => refuse(
                    "init_points",
                    format!("a point with {} coordinates for chain {chain}", starts[chain].len()),
                    "give one number per unconstrained coordinate of the density",
                ),
                None => Ok(()),
            },
            Starts::Uniform(_) => Ok(()),
        }
    }
}
