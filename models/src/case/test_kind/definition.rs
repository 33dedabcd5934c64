//! What a kind of test defines: its surfaces, its boundary conditions, and the check of its keys.

use fem::TetMesh;

use super::super::block::NotchCase;
use super::super::conditions::{ConditionsCase, PrescribeCase};

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
pub(super) fn prescribed(surface: &str, [x_mm, y_mm, z_mm]: [Option<f64>; 3]) -> PrescribeCase {
    let surface = surface.to_owned();
    PrescribeCase { surface, x_mm, y_mm, z_mm, damage: None, table: None }
}
