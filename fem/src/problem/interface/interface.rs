//! Input data of an interface.

use crate::error::{FemError, Unsupported};

/// Surface between two regions, with the toughness of a crack along this surface.
///
/// The elements within half of the width from the surface get another toughness, so that a crack along the surface has
/// the effective toughness of the interface, whatever the width and ℓ₀ are; for the equations see
/// [`equations`](crate::equations). If one of the regions has no toughness, the band exists in the other region only.
///
/// # Example
/// ```
/// use fem::{Block, Fracture, Interface, Material, PhaseField, Problem, Schedule};
///
/// let mesh = Block::new([4.0, 1.0, 1.0], [8, 2, 2]).build()?;
/// let mesh = mesh.with_regions(&["matrix", "grain"], |[x, ..]| u16::from(x > 2.0));
/// let matrix = Material::hencky(275.0, 0.25).with_fracture(Fracture::new(0.0025));
/// let problem = Problem::builder(mesh)
///     .materials([matrix, Material::hencky(22_000.0, 0.25)])
///     .phase_field(PhaseField::new(0.5))
///     .interfaces([Interface::new(["matrix", "grain"], 0.001, 2.0)])
///     .conditions(fem::Conditions::new().fix("left", [fem::Axis::X]).remove_rigid_motions())
///     .schedule(Schedule::fixed(1.0, 1))
///     .build()?;
/// assert!(problem.warnings().is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Interface {
    /// Names of the two regions.
    pub regions: [String; 2],
    /// Effective toughness of a crack along the interface, N/mm.
    pub toughness_n_per_mm: f64,
    /// Total width of the band, mm: half of the width on each side of the surface.
    pub width_mm: f64,
}

impl Interface {
    /// Creates an interface between two regions.
    pub fn new(regions: [impl Into<String>; 2], toughness_n_per_mm: f64, width_mm: f64) -> Self {
        Self { regions: regions.map(Into::into), toughness_n_per_mm, width_mm }
    }

    /// Returns the name of the interface in messages.
    pub(crate) fn entity(&self) -> String {
        format!("interface.{}", self.regions.join("-"))
    }

    /// Checks that toughness and width are positive, and that the regions differ.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] with the name of the value; [`FemError::Unsupported`] for two equal regions.
    pub fn validate(&self) -> Result<(), FemError> {
        let checks = [
            (
                "toughness_n_per_mm",
                self.toughness_n_per_mm,
                1e-9..=1e3,
                "a positive toughness in N/mm, from 1e-9 to 1e3",
            ),
            (
                "width_mm",
                self.width_mm,
                1e-9..=1e3,
                "a positive width in mm, from 1e-9 to 1e3, such as four elements",
            ),
        ];
        for (field, value, allowed, requirement) in checks {
            if !allowed.contains(&value) {
                return Err(FemError::parameter(&self.entity(), field, value, requirement));
            }
        }
        if self.regions[0] == self.regions[1] {
            return Err(FemError::unsupported(self.entity(), Unsupported::InterfaceOfOneRegion));
        }
        Ok(())
    }
}

/// Returns whether two lists have interfaces between the same regions with the same widths, in the same order.
pub(crate) fn have_same_bands(one: &[Interface], other: &[Interface]) -> bool {
    one.len() == other.len()
        && one.iter().zip(other).all(|(a, b)| a.regions == b.regions && a.width_mm == b.width_mm)
}
