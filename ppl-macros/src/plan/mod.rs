//! What will be generated: the tree with its expressions as they will be written, and beside it what
//! becomes of its statements.

mod calls;
mod expressions;
mod literals;
mod statements;

use std::collections::{BTreeSet, HashMap, HashSet};

use syn::Ident;

use crate::analyse::{Analysis, Site};
use crate::ast::{Block, Id, Model};

pub(crate) use calls::shared_name;

pub(crate) struct Plan {
    /// The statements; those that are refused are broken.
    pub(crate) body: Block,
    /// The places that they speak of.
    pub(crate) sites: Vec<Site>,
    /// Whether every point runs the same statements.
    pub(crate) is_static: bool,
    numbers: HashMap<Id, usize>,
    plates: HashMap<Id, Plate>,
}

impl Plan {
    /// The number of a statement's place.
    pub(crate) fn site(&self, statement: Id) -> usize {
        self.numbers.get(&statement).copied().unwrap_or_default()
    }

    /// Whether a loop sums up the terms of the observation with this site.
    pub(crate) fn is_summed(&self, site: usize) -> bool {
        self.plates.values().any(|plate| plate.sums.terms.contains(&site))
    }

    /// What becomes of a loop.
    pub(crate) fn plate(&self, statement: Id) -> Option<&Plate> {
        self.plates.get(&statement)
    }
}

/// What becomes of a loop.
#[derive(Default)]
pub(crate) struct Plate {
    /// Whether it conditions on all its data at once.
    pub(crate) is_pooled: bool,
    /// Whether nothing that an iteration computes outlives it.
    pub(crate) unwinds: bool,
    /// What it sums up apart for all loops inside, if it is the outermost.
    pub(crate) sums: Sums,
}

#[derive(Default)]
pub(crate) struct Sums {
    /// Names from outside whose adjoints it sums up.
    pub(crate) names: BTreeSet<Ident>,
    /// The observations in it whose terms it sums up, by their sites.
    pub(crate) terms: Vec<usize>,
}

/// The plan of a model, or of a submodel, whose arithmetic goes over a tape.
pub(crate) fn plan(model: &Model, analysis: &Analysis) -> Plan {
    let mut body = model.body.clone();
    let mut planner = Planner {
        analysis,
        formulas: model.value.is_none(),
        sites: Vec::new(),
        numbers: HashMap::new(),
        plates: HashMap::new(),
        at: Id(0),
        sums: None,
        shared: HashSet::new(),
        closures: 0,
    };
    planner.block(&mut body);
    let Planner { sites, numbers, plates, .. } = planner;
    Plan { body, sites, is_static: analysis.is_static, numbers, plates }
}

/// Writes expressions anew on the way through the tree.
struct Planner<'a> {
    analysis: &'a Analysis,
    /// Whether arithmetic becomes formulas.
    formulas: bool,
    sites: Vec<Site>,
    numbers: HashMap<Id, usize>,
    plates: HashMap<Id, Plate>,
    /// The statement around.
    at: Id,
    /// What the outermost loop around sums up apart.
    sums: Option<Sums>,
    /// Active names from outside of it that are the same in every iteration; none where a name may
    /// have come to mean something else.
    shared: HashSet<Ident>,
    /// Closures around in the statement.
    closures: usize,
}

impl Planner<'_> {
    /// The place of the statement: those that never say where they are have none.
    fn site(&mut self) -> usize {
        let (sites, site) = (&mut self.sites, self.analysis.site(self.at));
        *self.numbers.entry(self.at).or_insert_with(|| {
            sites.extend(site.cloned());
            sites.len().saturating_sub(1)
        })
    }
}
