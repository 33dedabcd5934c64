//! List of the synthetic specimens by name: a grid of sphere sizes and volume fractions, and one specimen for each
//! typical difficulty of laboratory images.

use super::specimen::{Damage, Specimen, Surroundings};

/// Radii (voxels) and volume fractions of the spheres.
const RADII: [f64; 4] = [3.0, 4.0, 6.0, 9.0];
const FRACTIONS: [f64; 5] = [0.02, 0.05, 0.1, 0.2, 0.3];

/// Returns all specimens with their names.
pub(crate) fn specimens() -> Vec<(String, Specimen)> {
    let mut all = Vec::new();
    for radius in RADII {
        for fraction in FRACTIONS {
            all.push((format!("r{radius}-{fraction}"), Specimen::new(radius, fraction)));
        }
    }
    let plain = Specimen::new(6.0, 0.25);
    // dark grains: the grey values of matrix and grain are exchanged
    let dark = Specimen { matrix: plain.grain, grain: plain.matrix, ..plain.clone() };
    let hard = [
        ("narrow", Specimen { radius: 18.0, ..plain.clone() }),
        ("off-centre", Specimen { radius: 30.0, centre: [40.0, 72.0], ..plain.clone() }),
        ("wall", Specimen { cut_by_wall: true, ..plain.clone() }),
        ("chip", Specimen { damage: Damage::Chip, ..plain.clone() }),
        ("cracks", Specimen { damage: Damage::CracksAndPores, ..plain.clone() }),
        ("faint", Specimen { grain: 22_500.0, noise: 833.0, ..plain.clone() }),
        ("drift", Specimen { drift: 0.2, ..plain.clone() }),
        ("tube", Specimen { surroundings: Surroundings::Tube, ..plain.clone() }),
        ("pedestal", Specimen { surroundings: Surroundings::Pedestal, ..plain.clone() }),
        ("circle", Specimen { surroundings: Surroundings::Circle, ..plain.clone() }),
        ("lean", Specimen { radius: 34.0, height: 76.0, lean: 12.0, ..plain.clone() }),
        ("below", Specimen { only_below: true, ..plain.clone() }),
        ("below-drift", Specimen { only_below: true, drift: 0.2, ..plain.clone() }),
        ("dark", dark.clone()),
        ("dark-cracks", Specimen { damage: Damage::CracksAndPores, ..dark.clone() }),
        ("dark-chip", Specimen { damage: Damage::Chip, ..dark }),
        ("dark-bright-air", Specimen { inverted: true, ..plain }),
    ];
    all.extend(hard.map(|(name, specimen)| (name.to_owned(), specimen)));
    all
}
