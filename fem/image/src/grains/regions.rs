//! Measurements of each grain.

use std::collections::BTreeSet;

use nalgebra::{Matrix3, SymmetricEigen};
use rayon::prelude::*;

use crate::volume::{Volume, neighbour_steps};

/// A grain of a segmented image.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Number of the grain in the labels, counted from 1.
    pub id: u32,
    /// Number of voxels of the grain.
    pub voxels: usize,
    /// Volume of the grain, computed from grey values with sub-voxel accuracy (mm³).
    pub volume_mm3: f64,
    /// Centroid of the grain, measured from the corner of the image (mm).
    pub centroid_mm: [f64; 3],
    /// Diameters (mm) of the ellipsoid with the same second moments as the grain, along the principal axes of the
    /// ellipsoid, the longest first.
    pub axes_mm: [f64; 3],
    /// Area of the surface, including contacts with other grains (mm²), by Crofton's formula with 13 directions.
    pub surface_mm2: f64,
    /// Numbers of the grains that share a voxel face with this grain, in ascending order.
    pub neighbours: Vec<u32>,
    /// Whether the grain touches the edge of the specimen or of the image.
    pub touches_boundary: bool,
}

impl Region {
    /// Returns the diameter of the sphere with the grain's volume (mm).
    pub fn diameter_mm(&self) -> f64 {
        (6.0 * self.volume_mm3 / std::f64::consts::PI).cbrt()
    }
}

/// Weights of the directions from a voxel to its neighbours over a face, an edge and a corner. The weight of a
/// direction is the share of the sphere in which this direction is the nearest of all 26 directions.
///
/// Source: J. Ohser, K. Schladitz, 3D Images of Materials Structures, Wiley-VCH 2009, table 5.2
/// (Voronoi cells of the 26 directions).
const WEIGHTS: [f64; 3] = [0.045_777_89, 0.036_980_63, 0.035_195_64];

/// Integer sums over the voxels of a grain.
#[derive(Clone, Debug, Default)]
struct Sums {
    voxels: u64,
    /// Sums of the voxel indices along x, y, z.
    first: [u64; 3],
    /// Sums of the products xx, yy, zz, xy, xz, yz of voxel indices.
    second: [u64; 6],
    /// Numbers of steps from a voxel of the grain to a voxel outside the grain, over a face, an edge and a corner.
    crossings: [u64; 3],
    boundary: bool,
}

impl Sums {
    fn add(&mut self, other: &Sums) {
        self.voxels += other.voxels;
        self.boundary |= other.boundary;
        let pairs = |a: &mut [u64], b: &[u64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        pairs(&mut self.first, &other.first);
        pairs(&mut self.second, &other.second);
        pairs(&mut self.crossings, &other.crossings);
    }
}

/// Measures the grains 1…`volumes.len()` of an image of labels. `volumes` contains the volumes of the grains (voxels),
/// and `inside` marks the voxels of the specimen.
pub(crate) fn measure(labels: &Volume<u32>, inside: &[u8], volumes: &[f64]) -> Vec<Region> {
    let grains = volumes.len();
    let empty = || (vec![Sums::default(); grains + 1], BTreeSet::new());
    let (sums, contacts) = (0..labels.shape[2])
        .into_par_iter()
        .fold(empty, |(mut sums, mut contacts), z| {
            slice_sums(labels, inside, z, &mut sums, &mut contacts);
            (sums, contacts)
        })
        .reduce(empty, |mut a, mut b| {
            a.0.iter_mut().zip(&b.0).for_each(|(a, b)| a.add(b));
            a.1.append(&mut b.1);
            a
        });
    let mut neighbours = vec![Vec::new(); grains + 1];
    for (a, b) in contacts {
        neighbours[a as usize].push(b);
    }
    let numbered = sums.iter().zip(neighbours).enumerate().skip(1);
    numbered
        .map(|(id, (sums, neighbours))| {
            region(labels.voxel_mm, id, sums, neighbours, volumes[id - 1])
        })
        .collect()
}

/// Adds the voxels of a slice to the sums of their grains.
fn slice_sums(
    labels: &Volume<u32>,
    inside: &[u8],
    z: usize,
    sums: &mut [Sums],
    contacts: &mut BTreeSet<(u32, u32)>,
) {
    let [nx, ny, nz] = labels.shape;
    let steps: Vec<([isize; 3], usize)> = neighbour_steps()
        .map(|step| (step, step.iter().filter(|&&s| s != 0).count() - 1))
        .collect();
    let interior = z > 0 && z + 1 < nz;
    for y in 0..ny {
        let from = nx * (y + ny * z);
        for x in 0..nx {
            let label = labels.values[from + x];
            if label == 0 {
                continue;
            }
            let grain = &mut sums[label as usize];
            let at = [x as u64, y as u64, z as u64];
            grain.voxels += 1;
            for axis in 0..3 {
                grain.first[axis] += at[axis];
                grain.second[axis] += at[axis] * at[axis];
            }
            grain.second[3] += at[0] * at[1];
            grain.second[4] += at[0] * at[2];
            grain.second[5] += at[1] * at[2];
            let framed = interior && y > 0 && y + 1 < ny && x > 0 && x + 1 < nx;
            for &([i, j, k], kind) in &steps {
                let to = if framed {
                    Some((from + x).wrapping_add_signed(i + nx as isize * (j + ny as isize * k)))
                } else {
                    let x = x.checked_add_signed(i).filter(|&x| x < nx);
                    let y = y.checked_add_signed(j).filter(|&y| y < ny);
                    let z = z.checked_add_signed(k).filter(|&z| z < nz);
                    x.zip(y).zip(z).map(|((x, y), z)| x + nx * (y + ny * z))
                };
                let other = to.map_or(0, |to| labels.values[to]);
                if other == label {
                    continue;
                }
                grain.crossings[kind] += 1;
                if kind == 0 {
                    grain.boundary |= to.is_none_or(|to| inside[to] == 0);
                    if other != 0 {
                        contacts.insert((label, other));
                    }
                }
            }
        }
    }
}

/// Computes the measurements of a grain from its sums.
fn region(voxel_mm: f64, id: usize, sums: &Sums, neighbours: Vec<u32>, volume: f64) -> Region {
    let count = sums.voxels as f64;
    let mean = sums.first.map(|sum| sum as f64 / count);
    let [xx, yy, zz, xy, xz, yz] = sums.second;
    let moment = |sum: u64, a: usize, b: usize| {
        // the numerator is computed with integers, so that only the division causes a rounding error
        let n = i128::from(sums.voxels);
        let numerator = n * i128::from(sum) - i128::from(sums.first[a]) * i128::from(sums.first[b]);
        // a voxel is a unit cube, and the second moment of a unit cube is 1/12
        numerator as f64 / (count * count) + if a == b { 1.0 / 12.0 } else { 0.0 }
    };
    let (xy, xz, yz) = (moment(xy, 0, 1), moment(xz, 0, 2), moment(yz, 1, 2));
    let tensor = Matrix3::new(
        moment(xx, 0, 0),
        xy,
        xz, //
        xy,
        moment(yy, 1, 1),
        yz, //
        xz,
        yz,
        moment(zz, 2, 2),
    );
    let mut variances: Vec<f64> = SymmetricEigen::new(tensor).eigenvalues.iter().copied().collect();
    variances.sort_by(|a, b| b.total_cmp(a));
    // Crofton's formula: surface = 2 × mean over directions of (crossings × area per line). Only crossings that leave
    // the grain are counted, which are half of all crossings.
    let lengths = [1.0_f64, 2.0_f64.sqrt(), 3.0_f64.sqrt()];
    let area: f64 = (0..3).map(|n| sums.crossings[n] as f64 * WEIGHTS[n] / lengths[n]).sum();
    Region {
        id: id as u32,
        voxels: sums.voxels as usize,
        volume_mm3: volume * voxel_mm.powi(3),
        centroid_mm: mean.map(|c| (c + 0.5) * voxel_mm),
        axes_mm: std::array::from_fn(|n| 2.0 * (5.0 * variances[n].max(0.0)).sqrt() * voxel_mm),
        surface_mm2: 4.0 * area * voxel_mm * voxel_mm,
        neighbours,
        touches_boundary: sums.boundary,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labelled(shape: [usize; 3], label: impl Fn([f64; 3]) -> u32) -> (Volume<u32>, Vec<u8>) {
        let count: usize = shape.iter().product();
        let values: Vec<u32> = (0..count)
            .map(|n| crate::volume::voxel_at(shape, n).map(|c| c as f64 + 0.5))
            .map(label)
            .collect();
        (Volume::new(shape, 0.5, values).unwrap(), vec![1; count])
    }

    #[test]
    fn an_ellipsoid_has_its_axes_and_surface() {
        let half = [18.0_f64, 12.0, 9.0];
        let (labels, inside) = labelled([48, 48, 48], |p| {
            u32::from((0..3).map(|n| ((p[n] - 24.3) / half[n]).powi(2)).sum::<f64>() <= 1.0)
        });
        let voxels = labels.values.iter().filter(|&&label| label == 1).count() as f64;
        let region = &measure(&labels, &inside, &[voxels])[0];
        for axis in 0..3 {
            assert!((region.axes_mm[axis] / half[axis] - 1.0).abs() < 0.01, "{region:?}");
            assert!((region.centroid_mm[axis] - 24.3 / 2.0).abs() < 0.02, "{region:?}");
        }
        // Thomsen's formula for the surface of an ellipsoid, accurate to 1.061 %
        let p: f64 = 1.6075;
        let pair = |a: f64, b: f64| (a * b).powf(p);
        let [a, b, c] = half.map(|h| h / 2.0);
        let mean = (pair(a, b) + pair(a, c) + pair(b, c)) / 3.0;
        let exact = 4.0 * std::f64::consts::PI * mean.powf(1.0 / p);
        assert!((region.surface_mm2 / exact - 1.0).abs() < 0.03, "{} {exact}", region.surface_mm2);
        assert!(!region.touches_boundary && region.neighbours.is_empty());
    }

    #[test]
    fn neighbours_and_contact_with_the_edge_are_detected() {
        let (labels, mut inside) = labelled([12, 6, 6], |p| match p {
            [x, y, z] if (1.0..5.0).contains(&y) && (1.0..5.0).contains(&z) => match x {
                1.0..4.0 => 1,
                4.0..7.0 => 2,
                8.0..11.0 => 3,
                _ => 0,
            },
            _ => 0,
        });
        let touching = |inside: &[u8]| -> Vec<bool> {
            measure(&labels, inside, &[1.0; 3]).iter().map(|r| r.touches_boundary).collect()
        };
        let regions = measure(&labels, &inside, &[1.0; 3]);
        let neighbours: Vec<&[u32]> = regions.iter().map(|r| &r.neighbours[..]).collect();
        assert_eq!(neighbours, [&[2][..], &[1], &[]]);
        assert_eq!(touching(&inside), [false, false, false]);
        inside[labels.index([7, 2, 2])] = 0;
        assert_eq!(touching(&inside), [false, true, true]);
    }
}
