//! Toughness of a band, compared with a minimisation by finite elements in one dimension.

use super::*;

/// Minimal crack energy per area of one side of a crack, N/mm, by linear elements: φ = 1 at the start, and the toughness
/// changes from `band` to `bulk` at the distance `width` (relative to ℓ).
fn minimised(density: CrackDensity, band: f64, bulk: f64, width: f64) -> f64 {
    const PER_LENGTH: f64 = 2000.0;
    let c0 = density.normaliser();
    // the grid has a node at the end of the band
    let within = (width * PER_LENGTH).ceil() as usize;
    let beyond = (12.0 * PER_LENGTH) as usize;
    let size = |e: usize| match e < within {
        true => width / within as f64,
        false => 12.0 / beyond as f64,
    };
    let toughness = |e: usize| if e < within { band } else { bulk };
    let elements = within + beyond;
    // energy = ½ φᵀ A φ − bᵀ φ, tridiagonal
    let nodes = elements + 1;
    let (mut diagonal, mut next, mut load) = (vec![0.0; nodes], vec![0.0; nodes], vec![0.0; nodes]);
    for e in 0..elements {
        let (h, g) = (size(e), toughness(e) / c0);
        let [stiff, mass] = match density {
            CrackDensity::At2 => [2.0 * g / h, 2.0 * g * h / 6.0],
            CrackDensity::At1 => [2.0 * g / h, 0.0],
        };
        if density == CrackDensity::At1 {
            load[e] -= 0.5 * g * h;
            load[e + 1] -= 0.5 * g * h;
        }
        diagonal[e] += stiff + 2.0 * mass;
        diagonal[e + 1] += stiff + 2.0 * mass;
        next[e] += mass - stiff;
    }
    // φ is 1 at the first node, and zero at the last node and at all nodes where it would be negative
    let mut free = nodes - 1;
    let mut phi = vec![0.0; nodes];
    loop {
        let (mut pivot, mut right) = (vec![0.0; free], vec![0.0; free]);
        (pivot[1], right[1]) = (diagonal[1], load[1] - next[0]);
        for i in 2..free {
            let factor = next[i - 1] / pivot[i - 1];
            pivot[i] = diagonal[i] - factor * next[i - 1];
            right[i] = load[i] - factor * right[i - 1];
        }
        phi.fill(0.0);
        phi[0] = 1.0;
        for i in (1..free).rev() {
            phi[i] = (right[i] - next[i] * phi[i + 1]) / pivot[i];
        }
        // the profile decreases, so that the negative values are at its end
        match (1..free).find(|&i| phi[i] < 0.0) {
            Some(first) => free = first.max(free - free.div_ceil(50)).min(free - 1),
            None => break,
        }
    }
    let mut energy = 0.0;
    for e in 0..elements {
        let (h, g, [a, b]) = (size(e), toughness(e) / c0, [phi[e], phi[e + 1]]);
        let local = match density {
            CrackDensity::At2 => (a * a + a * b + b * b) / 3.0,
            CrackDensity::At1 => 0.5 * (a + b),
        };
        energy += g * (h * local + (b - a).powi(2) / h);
    }
    energy
}

const DENSITIES: [CrackDensity; 2] = [CrackDensity::At2, CrackDensity::At1];

#[test]
fn the_energy_is_the_minimum_of_the_one_dimensional_problem() {
    for density in DENSITIES {
        for half_width in [0.25, 0.5, 1.0, 2.5] {
            for (toughness, row, two_sided) in
                [(0.2, 0.0, true), (0.5, 0.1, true), (2.0, 0.2, false)]
            {
                let band = Band { bulk: 1.0, half_width, row, two_sided };
                let side = |width| minimised(density, toughness, 1.0, width);
                let other = if two_sided { side(half_width) } else { 0.0 };
                let broken = row * toughness / density.normaliser();
                let minimum = broken + side(half_width - row) + other;
                let formula = band.energy(density, toughness);
                assert!(
                    (formula - minimum).abs() < 1e-4 * minimum,
                    "{density:?} {band:?} {toughness}: {formula} and {minimum}"
                );
            }
        }
    }
}

/// The closed form of G̃ for AT2 without mesh, G̃ = [(G_i − G_b) C + √((G_i − G_b)² C² + 4 S² G_i G_b)]/(2 S), with
/// S = sinh(w/ℓ) and C = cosh(w/ℓ). On one side alone, 2 G_i replaces G_i.
#[test]
fn without_mesh_at2_is_the_closed_form() {
    for (half_width, relative) in [(0.5, 0.5), (0.25, 0.3), (2.0, 2.0)] {
        for two_sided in [true, false] {
            let band = Band { bulk: 1.7, half_width, row: 0.0, two_sided };
            let effective = relative * band.bulk;
            let interface = if two_sided { effective } else { 2.0 * effective };
            let (s, c) = (f64::sinh(half_width), f64::cosh(half_width));
            let difference = (interface - band.bulk) * c;
            let exact = (difference
                + (difference.powi(2) + 4.0 * s * s * interface * band.bulk).sqrt())
                / (2.0 * s);
            let found = band.toughness(CrackDensity::At2, effective);
            assert!((found - exact).abs() < 1e-12 * exact, "{found} and {exact}");
        }
    }
    let band = Band { bulk: 1.0, half_width: 0.5, row: 0.0, two_sided: true };
    assert!((band.toughness(CrackDensity::At2, 0.5) - 0.34933).abs() < 5e-6);
}

#[test]
fn a_crack_has_the_effective_toughness() {
    for density in DENSITIES {
        for bulk in [0.4, 1.0, 5.0] {
            for (half_width, row) in [(0.3, 0.0), (0.8, 0.4), (3.0, 0.2), (20.0, 10.0)] {
                for two_sided in [true, false] {
                    let band = Band { bulk, half_width, row, two_sided };
                    for effective in [0.2, 0.5, 2.0] {
                        let toughness = band.toughness(density, effective);
                        let factor = 1.0 + row / density.normaliser();
                        let energy = band.energy(density, toughness);
                        assert!(
                            toughness > 0.0 && (energy - effective * factor).abs() < 1e-11 * energy,
                            "{density:?} {band:?}: {toughness} has {energy}, not {effective}"
                        );
                    }
                }
            }
        }
    }
}

/// An interface as tough as the regions has a band as tough as the regions, on a mesh too.
#[test]
fn an_interface_as_tough_as_the_regions_changes_nothing() {
    for density in DENSITIES {
        for (half_width, row) in [(0.5, 0.0), (0.5, 0.2), (4.0, 1.0)] {
            let band = Band { bulk: 1.3, half_width, row, two_sided: true };
            let toughness = band.toughness(density, band.bulk);
            assert!((toughness - band.bulk).abs() < 1e-10, "{density:?} {band:?}: {toughness}");
        }
    }
}
