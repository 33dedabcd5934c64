//! Random packings of grains in a cylinder, reproducible by a seed.

mod relax;
mod shape;

use std::f64::consts::PI;

use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, LogNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::specimen::grains::Grain;
use relax::Spheres;
use shape::{draw_facets, grow};

/// Largest deviation of the logarithm of a drawn radius from its median, in standard deviations.
const TAIL: f64 = 2.5;
/// Largest number of relaxation sweeps. If spheres overlap after these sweeps, the packing fails.
const SWEEPS: usize = 5000;
/// Largest volume fraction at which spheres are relaxed if polyhedra will replace them. The polyhedra then grow to the
/// requested fraction.
const RELAXED: f64 = 0.45;
/// Largest number of grains of a packing; a larger number is reported as a likely error in the units.
const MAX_GRAINS: f64 = 1e5;
/// Maximum number of facets; a polyhedron with more facets hardly differs from a sphere.
const MAX_FACETS: usize = 200;

/// Settings of a random microstructure: volume fraction, sizes, shape, and seed.
///
/// Sizes are lognormal in each class: one class gives a unimodal, two classes a bimodal distribution. Spheres are
/// placed at random and pushed apart. For polyhedra, each sphere is then replaced by a polyhedron bounded by random
/// facets and by the radical planes to its neighbours, each moved towards the sphere by half the film thickness. All
/// grains lie entirely inside the cylinder. All radii are scaled by one factor to reach the volume fraction.
///
/// The same seed gives the same grains (generator: xoshiro256++).
///
/// # Example
/// ```
/// use fem_mesh::{Grain, Packing};
///
/// let grains = Packing::new(0.2, 7).fill(2.5, 4.4)?;
/// let volume: f64 = grains.iter().map(Grain::volume_mm3).sum();
/// let cylinder = std::f64::consts::PI * 2.5 * 2.5 * 4.4;
/// assert!((volume / cylinder - 0.2).abs() < 1e-6);
/// # Ok::<(), fem_mesh::PackingError>(())
/// ```
///
/// # References
/// Radical planes: F. Aurenhammer, "Power diagrams", SIAM J. Comput. 16 (1987) 78–96,
/// doi:10.1137/0216006.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Packing {
    /// Volume of the grains divided by the volume of the cylinder, in (0, 1).
    #[schemars(range(min = 0, max = 0.5))]
    pub fraction: f64,
    /// Seed of the random generator.
    pub seed: u64,
    /// Shape of the grains.
    #[serde(default)]
    pub form: GrainForm,
    /// Number of random facets per polyhedron, from 6 to 200.
    #[serde(default = "default_facets")]
    #[schemars(range(min = 6, max = MAX_FACETS))]
    pub facets: usize,
    /// Size classes.
    #[serde(default = "default_sizes")]
    pub sizes: Vec<SizeClass>,
    /// Minimum thickness of matrix between two grains (mm); between a grain and the surface of the cylinder, the
    /// minimum is half this thickness.
    #[serde(default = "default_film")]
    #[schemars(range(min = 0))]
    pub film_mm: f64,
}

/// Shape of the grains of a packing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum GrainForm {
    /// Convex polyhedra.
    #[default]
    Polyhedron,
    /// Spheres.
    Sphere,
}

/// A class of grains with lognormal radii.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SizeClass {
    /// Median radius of the spheres (mm), before all radii are scaled to reach the volume fraction.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub median_radius_mm: f64,
    /// Standard deviation of the logarithm of the radius; radii beyond 2.5 standard deviations are redrawn.
    #[schemars(range(min = 0, max = 1))]
    pub spread: f64,
    /// Weight of the class in the total volume of the grains, relative to the weights of the other classes.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1e9))]
    pub share: f64,
}

fn default_facets() -> usize {
    14
}

fn default_sizes() -> Vec<SizeClass> {
    vec![SizeClass { median_radius_mm: 0.5, spread: 0.15, share: 1.0 }]
}

fn default_film() -> f64 {
    0.05
}

/// Error of a packing that cannot be generated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PackingError {
    /// A field of the settings is out of range.
    #[error("{field} = {value}; {help}")]
    Field {
        /// Name of the field.
        field: &'static str,
        /// Value of the field.
        value: f64,
        /// Allowed values.
        help: &'static str,
    },
    /// A grain does not fit into the cylinder.
    #[error(
        "a grain of radius {radius_mm:.4} mm does not fit into a cylinder of radius {cylinder_mm} mm \
         and height {height_mm} mm; reduce median_radius_mm or spread"
    )]
    TooLarge {
        /// Radius of the grain (mm).
        radius_mm: f64,
        /// Radius of the cylinder (mm).
        cylinder_mm: f64,
        /// Height of the cylinder (mm).
        height_mm: f64,
    },
    /// The sizes are so small that too many grains would be required.
    #[error("the sizes require about {count:.1e} grains, more than 1e5; increase median_radius_mm")]
    TooMany {
        /// Approximate number of grains.
        count: f64,
    },
    /// The volume fraction cannot be reached with these grains.
    #[error(
        "a grain fraction of {fraction} cannot be packed: without overlap, only {reached:.3} was reached; reduce \
         fraction or film_mm, or use smaller or more varied grains"
    )]
    CannotPack {
        /// The requested volume fraction.
        fraction: f64,
        /// The volume fraction reached without overlap.
        reached: f64,
    },
}

impl Packing {
    /// Creates settings for polyhedra with one size class (median radius 0.5 mm, spread 0.15) and films of at least
    /// 0.05 mm.
    pub fn new(fraction: f64, seed: u64) -> Packing {
        Packing {
            fraction,
            seed,
            form: GrainForm::default(),
            facets: default_facets(),
            sizes: default_sizes(),
            film_mm: default_film(),
        }
    }

    /// Draws the grains of a cylinder (mm) with its bottom at z = 0 and its axis on z.
    ///
    /// # Errors
    /// [`PackingError`] if a field is out of range or the fraction cannot be packed.
    pub fn fill(&self, radius_mm: f64, height_mm: f64) -> Result<Vec<Grain>, PackingError> {
        self.validate(radius_mm, height_mm)?;
        let cylinder = PI * radius_mm * radius_mm * height_mm;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.seed);

        let relaxed = match self.form {
            GrainForm::Sphere => self.fraction,
            GrainForm::Polyhedron => self.fraction.min(RELAXED),
        };
        let radii = self.draw_radii(relaxed * cylinder, &mut rng)?;
        let largest = radii.iter().copied().fold(0.0, f64::max);
        let largest_allowed = radius_mm.min(0.5 * height_mm) - 0.5 * self.film_mm;
        if largest >= largest_allowed {
            let (cylinder_mm, radius_mm) = (radius_mm, largest);
            return Err(PackingError::TooLarge { radius_mm, cylinder_mm, height_mm });
        }

        let centres = radii
            .iter()
            .map(|radius| {
                let margin = radius + 0.5 * self.film_mm;
                let out = (radius_mm - margin) * rng.random::<f64>().sqrt();
                let angle = 2.0 * PI * rng.random::<f64>();
                let z = rng.random_range(margin..height_mm - margin);
                [out * angle.cos(), out * angle.sin(), z]
            })
            .collect();
        let mut spheres = Spheres {
            centres,
            radii,
            gap: self.film_mm,
            cylinder_radius: radius_mm,
            cylinder_height: height_mm,
        };
        let cannot = |reached| PackingError::CannotPack { fraction: self.fraction, reached };
        if !spheres.relax(SWEEPS) {
            return Err(cannot(relaxed * spheres.shrinkage().powi(3)));
        }
        match self.form {
            GrainForm::Sphere => {
                let Spheres { centres, radii, .. } = spheres;
                Ok(centres.into_iter().zip(radii).map(|(c, r)| Grain::sphere(c, r)).collect())
            }
            GrainForm::Polyhedron => {
                let facets = draw_facets(&spheres.radii, self.facets, &mut rng);
                grow(&spheres, &facets, self.fraction * cylinder)
                    .map_err(|most| cannot(most / cylinder))
            }
        }
    }

    /// Checks the settings for a cylinder (mm) without drawing grains.
    ///
    /// # Errors
    /// [`PackingError`] if a field is out of range or the sizes require too many grains.
    pub fn validate(&self, radius_mm: f64, height_mm: f64) -> Result<(), PackingError> {
        let positive = "give a positive length";
        let mut rules = vec![
            ("radius_mm", radius_mm, radius_mm > 0.0, positive),
            ("height_mm", height_mm, height_mm > 0.0, positive),
            (
                "fraction",
                self.fraction,
                self.fraction > 0.0 && self.fraction < 1.0,
                "give a number between 0 and 1",
            ),
            ("film_mm", self.film_mm, self.film_mm >= 0.0, "give 0 or a positive length"),
            (
                "facets",
                self.facets as f64,
                (6..=MAX_FACETS).contains(&self.facets),
                "give 6 to 200 facets",
            ),
            ("sizes", 0.0, !self.sizes.is_empty(), "give at least one class of sizes"),
        ];
        for class in &self.sizes {
            let (median, spread) = (class.median_radius_mm, class.spread);
            rules.push(("median_radius_mm", median, median > 0.0, positive));
            let narrow = (0.0..=1.0).contains(&spread);
            rules.push(("spread", spread, narrow, "give a number between 0 and 1"));
            let sound = class.share > 0.0 && class.share <= 1e9;
            rules.push(("share", class.share, sound, "give a positive share, at most 1e9"));
        }
        let broken = rules.into_iter().find(|&(_, value, holds, _)| !(holds && value.is_finite()));
        if let Some((field, value, _, help)) = broken {
            return Err(PackingError::Field { field, value, help });
        }
        let cylinder = PI * radius_mm * radius_mm * height_mm;
        let volumes = self.volumes(self.fraction * cylinder);
        let count: f64 = volumes
            .zip(&self.sizes)
            .map(|(volume, class)| volume / ball(class.median_radius_mm))
            .sum();
        if count > MAX_GRAINS { Err(PackingError::TooMany { count }) } else { Ok(()) }
    }

    /// Divides a total volume among the size classes in proportion to their shares.
    fn volumes(&self, all: f64) -> impl Iterator<Item = f64> {
        let shares: f64 = self.sizes.iter().map(|class| class.share).sum();
        self.sizes.iter().map(move |class| all * (class.share / shares))
    }

    /// Draws radii class by class, then scales all radii by one factor so that the total volume equals `volume`.
    fn draw_radii<R: Rng>(&self, volume: f64, rng: &mut R) -> Result<Vec<f64>, PackingError> {
        let mut radii = Vec::new();
        for (class, wanted) in self.sizes.iter().zip(self.volumes(volume)) {
            let logarithm = class.median_radius_mm.ln();
            let field = |_| PackingError::Field {
                field: "spread",
                value: class.spread,
                help: "give a number between 0 and 1",
            };
            let lognormal = LogNormal::new(logarithm, class.spread).map_err(field)?;
            let mut drawn = 0.0;
            loop {
                let radius = lognormal.sample(rng);
                if (radius.ln() - logarithm).abs() > TAIL * class.spread + 1e-12 {
                    continue;
                }
                // add the last grain only if the grain reduces the error of the volume
                if !radii.is_empty() && drawn + 0.5 * ball(radius) > wanted {
                    break;
                }
                radii.push(radius);
                drawn += ball(radius);
            }
        }
        let drawn: f64 = radii.iter().copied().map(ball).sum();
        let factor = (volume / drawn).cbrt();
        Ok(radii.into_iter().map(|radius| radius * factor).collect())
    }
}

/// Returns the volume of a sphere with the given radius.
fn ball(radius: f64) -> f64 {
    4.0 / 3.0 * PI * radius.powi(3)
}
