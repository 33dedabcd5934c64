//! Sample points of a tetrahedron, and the grains that contain them.

use crate::mesh::vector::{Point, mean, norm, sub};
use crate::specimen::grains::GrainField;

/// Number of sample points per tetrahedron.
pub(super) const SAMPLES: usize = 15;
/// Barycentric coordinates of a sample near a corner: the coordinate for this corner and the coordinate for each of the
/// other corners.
const CORNER: [f64; 2] = [0.747_719_8, 0.084_093_4];
/// Barycentric coordinates of a sample near the centre of a face: the coordinate for the opposite corner and the
/// coordinate for each corner of the face.
const FACE: [f64; 2] = [0.04, 0.32];
/// Barycentric coordinates of a sample near the midpoint of an edge: the coordinate for each end of the edge and the
/// coordinate for each of the other corners.
const EDGE: [f64; 2] = [0.42, 0.08];

/// Returns fifteen interior points of equal weight in barycentric coordinates: the centroid, four near the corners,
/// four near the faces, six near the edges. The points and the tetrahedron have equal first and second moments.
/// Therefore, on average, the fraction of the samples on one side of a plane equals the fraction of the volume.
pub(super) fn samples() -> [[f64; 4]; SAMPLES] {
    let mut coordinates = [[0.25; 4]; SAMPLES];
    let mut next = 1;
    for [one, others] in [CORNER, FACE] {
        for corner in 0..4 {
            coordinates[next] = [others; 4];
            coordinates[next][corner] = one;
            next += 1;
        }
    }
    for a in 0..4 {
        for b in 0..a {
            coordinates[next] = [EDGE[1]; 4];
            coordinates[next][a] = EDGE[0];
            coordinates[next][b] = EDGE[0];
            next += 1;
        }
    }
    coordinates
}

/// The sample points of a tetrahedron, and the grains near the tetrahedron.
pub(super) struct Sampled {
    pub(super) positions: [Point; SAMPLES],
    pub(super) grains: Vec<u32>,
    /// Centroid of the tetrahedron (mm).
    centre: Point,
    /// Largest distance of a corner from the centroid (mm).
    size: f64,
}

impl Sampled {
    pub(super) fn new(field: &dyn GrainField, corners: &[Point; 4], band: f64) -> Sampled {
        let centre = mean(corners.iter().copied());
        let size = corners.iter().map(|&p| norm(sub(p, centre))).fold(0.0, f64::max);
        let mut grains = Vec::new();
        field.near(centre, size + band, &mut grains);
        let positions = samples().map(|weights| {
            std::array::from_fn(|k| corners.iter().zip(weights).map(|(p, w)| w * p[k]).sum())
        });
        Sampled { positions, grains, centre, size }
    }

    /// Returns, for each sample point that is closer than `band` mm to a grain, the signed distance to the nearest
    /// grain and the number of this grain. The list is sorted by distance.
    pub(super) fn nearest(&self, field: &dyn GrainField, band: f64) -> Vec<(f64, u32)> {
        let reaches = |grain: &u32| field.reaches(*grain, self.centre, self.size + band);
        let grains: Vec<u32> = self.grains.iter().copied().filter(reaches).collect();
        let nearest = |&point: &Point| {
            let mut nearest = None;
            let mut limit = band;
            for &grain in &grains {
                if let Some(distance) = field.distance_below(grain, point, limit) {
                    (nearest, limit) = (Some((distance, grain)), distance);
                }
            }
            nearest
        };
        let mut near: Vec<(f64, u32)> = match grains.is_empty() {
            true => Vec::new(),
            false => self.positions.iter().filter_map(nearest).collect(),
        };
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near
    }
}

/// Returns the grain that contains most samples. Returns 0 if fewer than half of all samples have a signed distance of
/// less than `offset` mm to a grain. `near` is the result of [`Sampled::nearest`].
pub(super) fn majority(near: &[(f64, u32)], offset: f64) -> u32 {
    let inside = near.partition_point(|&(distance, _)| distance < offset);
    if 2 * inside < SAMPLES {
        return 0;
    }
    let mut grains: Vec<u32> = near[..inside].iter().map(|&(_, grain)| grain).collect();
    grains.sort_unstable();
    let runs = grains.chunk_by(|a, b| a == b);
    // choose the grain with the most sample points: the longest run of equal numbers, or the first of several equally
    // long runs
    runs.rev().max_by_key(|run| run.len()).map_or(0, |run| run[0])
}

#[cfg(test)]
mod tests {
    use super::samples;

    #[test]
    fn samples_have_the_moments_of_the_tetrahedron() {
        let samples = samples();
        let mean = |f: &dyn Fn(&[f64; 4]) -> f64| samples.iter().map(f).sum::<f64>() / 15.0;
        for i in 0..4 {
            assert!((mean(&|p| p[i]) - 0.25).abs() < 1e-7);
            for j in 0..4 {
                let exact = if i == j { 0.1 } else { 0.05 };
                assert!((mean(&|p| p[i] * p[j]) - exact).abs() < 1e-7);
            }
        }
        for point in samples {
            assert!(point.iter().all(|&x| x > 0.0), "{point:?} is not inside");
            assert!((point.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        }
    }
}
