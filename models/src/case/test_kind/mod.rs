//! Kinds of tests by name (`test.kind`). A kind expands to boundary conditions on named surfaces and lines of the specimen.
//!
//! A new kind is a file in this folder with a type that implements [`TestKind`], a variant of [`TestKindCase`], and an arm
//! of [`TestKindCase::kind`].

mod brazilian_disc;
mod confined_compression;
mod definition;
mod notched_beam;
mod tension_bar;
#[cfg(test)]
mod tests;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use brazilian_disc::BrazilianDisc;
pub use confined_compression::ConfinedCompression;
pub(crate) use definition::{TestKind, TestSetting, WrongKey};
pub use notched_beam::NotchedBeam;
use tension_bar::TensionBar;

/// `test.kind`: the kind of a test that is not a compression between platens. The displacement grows in proportion to the
/// time up to `test.displacement_mm`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TestKindCase {
    /// A bar whose ends are gripped; the grip at the top moves up.
    TensionBar,
    /// A disc that two jaws compress across its diameter.
    BrazilianDisc(BrazilianDisc),
    /// A notched beam on two line supports that a third line bends at midspan.
    NotchedBeam(NotchedBeam),
    /// A cylinder under a confining pressure on its side, which is then compressed along its axis.
    ConfinedCompression(ConfinedCompression),
}

impl TestKindCase {
    /// Returns the definition of the kind.
    pub(crate) fn kind(&self) -> &dyn TestKind {
        match self {
            Self::TensionBar => &TensionBar,
            Self::BrazilianDisc(kind) => kind,
            Self::NotchedBeam(kind) => kind,
            Self::ConfinedCompression(kind) => kind,
        }
    }
}
