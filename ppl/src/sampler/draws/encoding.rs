//! Serialisation of values that JSON cannot represent: infinite numbers, and maps whose keys are locations.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Mutex, PoisonError},
};

use crate::density::Location;

/// Serialises a number that may be +∞; +∞ becomes `null`, because JSON has no infinity.
pub(crate) mod infinite {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(x: &f64, s: S) -> Result<S::Ok, S::Error> {
        (*x != f64::INFINITY).then_some(*x).serialize(s)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<f64, D::Error> {
        Ok(Option::deserialize(d)?.unwrap_or(f64::INFINITY))
    }
}

/// Serialises counts per location as a list, because the keys of a JSON object must be strings.
pub(crate) mod locations {
    use serde::{Deserialize, Deserializer, Serializer};

    use super::{BTreeMap, Location, intern};

    pub(crate) fn serialize<S: Serializer>(
        counts: &BTreeMap<Location, u64>,
        s: S,
    ) -> Result<S::Ok, S::Error> {
        s.collect_seq(counts.iter().map(|(p, n)| (p.statement, p.file, p.line, n)))
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        d: D,
    ) -> Result<BTreeMap<Location, u64>, D::Error> {
        let list: Vec<(String, String, u32, u64)> = Vec::deserialize(d)?;
        let entry = |(statement, file, line, n)| {
            (Location { statement: intern(statement), file: intern(file), line }, n)
        };
        Ok(list.into_iter().map(entry).collect())
    }
}

/// Leaks the text to get a `'static` string. Each distinct text is leaked only once, so that repeated loading does
/// not increase the leaked memory.
fn intern(text: String) -> &'static str {
    static TEXTS: Mutex<BTreeSet<&str>> = Mutex::new(BTreeSet::new());
    // the lock can be used after a panic of another thread, because a panic cannot leave the set in
    // an inconsistent state
    let mut texts = TEXTS.lock().unwrap_or_else(PoisonError::into_inner);
    match texts.get(text.as_str()) {
        Some(interned) => interned,
        None => {
            let new: &'static str = text.leak();
            texts.insert(new);
            new
        }
    }
}
