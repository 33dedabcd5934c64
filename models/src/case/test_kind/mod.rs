//! Kinds of tests by name (`test.kind`). A kind expands to boundary conditions on named surfaces and lines of the specimen.
//!
//! A new kind is a file in this folder with a type that implements [`TestKind`], a variant of [`TestKindCase`], and an arm
//! of [`TestKindCase::kind`].

mod brazilian_disc;
mod confined_compression;
mod notched_beam;
mod tension_bar;
#[cfg(test)]
mod tests;

use fem::TetMesh;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::block::NotchCase;
use super::conditions::{ConditionsCase, PrescribeCase};
pub use brazilian_disc::BrazilianDisc;
pub use confined_compression::ConfinedCompression;
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

/// Keys outside `test.kind` on which the conditions of a kind depend.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TestSetting {
    /// `test.displacement_mm`; NaN in a case without this key, which the validation refuses.
    pub(crate) displacement_mm: f64,
    /// Duration of the test in s.
    pub(crate) duration_s: f64,
    /// `specimen.block_mm`.
    pub(crate) block_mm: Option<[f64; 3]>,
    /// `specimen.notch`.
    pub(crate) notch: Option<NotchCase>,
}

/// A wrong or missing key.
#[derive(Clone, Debug)]
pub(crate) struct WrongKey {
    pub(crate) key: String,
    pub(crate) value: String,
    pub(crate) problem: String,
    pub(crate) help: &'static str,
}

/// A kind of test: surfaces, boundary conditions, and the measured force and displacement.
pub(crate) trait TestKind {
    /// Name of the kind in a case.
    fn name(&self) -> &'static str;

    /// Describes the test for `breccia check`; the displacement follows the text.
    fn in_words(&self) -> String;

    /// Surfaces that the specimen must have.
    fn surfaces(&self) -> &'static [&'static str];

    /// Checks the keys of the kind against the specimen and the test.
    ///
    /// # Errors
    /// The first wrong key.
    fn check(&self, setting: &TestSetting) -> Result<(), WrongKey>;

    /// Boundary conditions of the test. The case may be invalid: [`TestKind::check`] reports its mistakes.
    fn conditions(&self, setting: &TestSetting) -> ConditionsCase;

    /// Coordinates along x (mm) where the mesh of a block must have nodes.
    fn planes_mm(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Adds the surfaces of the conditions that the mesh does not have yet.
    ///
    /// # Errors
    /// The reason, if the mesh cannot have such a surface.
    fn add_surfaces(&self, _mesh: &mut TetMesh) -> Result<(), String> {
        Ok(())
    }
}

/// Creates an entry that prescribes the given displacement components (mm) of a surface or line.
fn prescribed(surface: &str, [x_mm, y_mm, z_mm]: [Option<f64>; 3]) -> PrescribeCase {
    let surface = surface.to_owned();
    PrescribeCase { surface, x_mm, y_mm, z_mm, damage: None, table: None }
}
