//! Synthetic specimens: equal spheres in a cylinder, with typical artefacts of laboratory images.
//!
//! Lengths are in voxels. The grain fraction of a voxel is the mean over 5³ points, so that the true volumes are the
//! volumes of the spheres.

use std::f64::consts::PI;

use fem_image::{Contrast, Volume};
use fem_mesh::{GrainForm, Packing, SizeClass};
use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::phantom::{Imaged, VOXEL_MM, blur};

/// Grey values of the virtual scanner: air, and the differences of matrix and grain to air. In an inverted image air
/// has the grey value `WHITE - AIR`.
const AIR: f32 = 8_000.0;
const MATRIX: f32 = 20_000.0;
const GRAIN: f32 = 36_000.0;
const WHITE: f32 = 60_000.0;
/// Standard deviations of the scanner's noise (grey values) and blur (voxels).
const NOISE: f32 = 1_400.0;
const BLUR: f64 = 0.7;
/// Number of points along each axis over which the grain fraction of a voxel is averaged.
const POINTS: usize = 5;

/// Voids in the specimen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Damage {
    None,
    /// The upper edge is broken off along a plane at 45°.
    Chip,
    /// Three planar cracks with a width of 1.5 voxels and twelve pores of radius 2 to 4.
    CracksAndPores,
}

/// Surroundings of the specimen in the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Surroundings {
    Air,
    /// A tube with an inner radius of 49 and an outer radius of 53.
    Tube,
    /// A pedestal of matrix with a radius of 36 below the specimen.
    Pedestal,
    /// The grey value is 0 outside the circle inscribed in the slice.
    Circle,
}

/// Settings of a cylinder with spheres and of its image of `side`³ voxels.
#[derive(Clone, Debug)]
pub(crate) struct Specimen {
    pub(crate) side: usize,
    pub(crate) radius: f64,
    pub(crate) height: f64,
    /// Position (x, y) of the axis at half the height.
    pub(crate) centre: [f64; 2],
    /// Angle between the axis and z (degrees), towards x.
    pub(crate) lean: f64,
    pub(crate) grain_radius: f64,
    /// Volume fraction of the spheres in the cylinder.
    pub(crate) fraction: f64,
    /// Whether spheres may extend beyond the wall and are cut by the wall.
    pub(crate) cut_by_wall: bool,
    /// Whether only the lower half of the specimen contains spheres.
    pub(crate) only_below: bool,
    /// Difference of the grey values of matrix and air.
    pub(crate) matrix: f32,
    /// Difference of the grey values of grains and air.
    pub(crate) grain: f32,
    /// Whether the grey values of the image are inverted.
    pub(crate) inverted: bool,
    /// Standard deviation of the noise (grey values).
    pub(crate) noise: f32,
    /// Relative change of brightness from the bottom to the top.
    pub(crate) drift: f32,
    pub(crate) damage: Damage,
    pub(crate) surroundings: Surroundings,
    pub(crate) seed: u64,
}

impl Specimen {
    /// Creates settings for an undamaged cylinder of radius 44 and height 90 in the centre of 112³ voxels.
    pub(crate) fn new(grain_radius: f64, fraction: f64) -> Self {
        Specimen {
            side: 112,
            radius: 44.0,
            height: 90.0,
            centre: [56.2, 55.7],
            lean: 0.0,
            grain_radius,
            fraction,
            cut_by_wall: false,
            only_below: false,
            matrix: MATRIX,
            grain: GRAIN,
            inverted: false,
            noise: NOISE,
            drift: 0.0,
            damage: Damage::None,
            surroundings: Surroundings::Air,
            seed: 1,
        }
    }

    /// Returns the mean of the grey values of matrix and grain.
    pub(crate) fn middle_grey(&self) -> f64 {
        let middle = AIR + 0.5 * (self.matrix + self.grain);
        f64::from(if self.inverted { WHITE - middle } else { middle })
    }

    /// Returns the contrast (bright or dark grains) for the settings of a case.
    pub(crate) fn contrast(&self) -> Contrast {
        let is_dark = (self.grain < self.matrix) != self.inverted;
        if is_dark { Contrast::Dark } else { Contrast::Bright }
    }

    /// Draws the spheres and computes the image.
    pub(crate) fn take(&self) -> Imaged {
        let n = self.side;
        let frame = Frame::new(self);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.seed ^ 0x5ca7);
        let voids = Voids::new(self, &mut rng);
        let point = |at: usize| [at % n, at / n % n, at / (n * n)].map(|c| c as f64 + 0.5);
        let solid: Vec<f32> = (0..n * n * n)
            .map(|at| {
                let p = frame.to_specimen(point(at));
                let outside = (p[0].hypot(p[1]) - self.radius).max(p[2].abs() - 0.5 * self.height);
                ((0.5 - outside).clamp(0.0, 1.0) * (1.0 - voids.share(p))) as f32
            })
            .collect();

        let mut share = vec![0.0_f32; n * n * n];
        let mut truth = vec![0_u32; n * n * n];
        let mut volumes_mm3 = Vec::new();
        for centre in self.spheres() {
            let middle = frame.to_image(centre);
            let label = volumes_mm3.len() as u32 + 1;
            let mut volume = 0.0;
            for at in near(middle, self.grain_radius, n) {
                let part = ball_share(point(at), middle, self.grain_radius);
                share[at] = (share[at] + part as f32).min(1.0);
                volume += part * f64::from(solid[at]);
                let off: f64 = (0..3).map(|a| (point(at)[a] - middle[a]).powi(2)).sum();
                if off < self.grain_radius.powi(2) && solid[at] >= 0.5 {
                    truth[at] = label;
                }
            }
            if volume > 0.0 {
                volumes_mm3.push(volume * VOXEL_MM.powi(3));
            }
        }

        let mut values: Vec<f32> = (0..n * n * n)
            .map(|at| {
                let height = point(at)[2] / n as f64 - 0.5;
                let material = self.matrix + (self.grain - self.matrix) * share[at];
                let around =
                    self.matrix * self.around(point(at), &frame) as f32 * (1.0 - solid[at]);
                (solid[at] * material + around) * (1.0 + self.drift * height as f32)
            })
            .collect();
        blur(&mut values, n, BLUR);
        for (at, value) in values.iter_mut().enumerate() {
            let noise: f32 = StandardNormal.sample(&mut rng);
            let [x, y, _] = point(at).map(|c| c - 0.5 * n as f64);
            let seen = self.surroundings != Surroundings::Circle || x.hypot(y) < 0.5 * n as f64;
            let shown = (AIR + *value + self.noise * noise).round();
            let shown = if self.inverted { WHITE - shown } else { shown };
            *value = if seen { shown } else { 0.0 };
        }
        let volume = |values| Volume::new([n; 3], VOXEL_MM, values).expect("a volume");
        Imaged {
            image: volume(values),
            truth: Volume::new([n; 3], VOXEL_MM, truth).expect("a volume"),
            volumes_mm3,
            specimen_mm3: solid.iter().map(|&s| f64::from(s)).sum::<f64>() * VOXEL_MM.powi(3),
            radius_mm: self.radius * VOXEL_MM,
            bottom_mm: (0.5 * (n as f64 - self.height)) * VOXEL_MM,
            height_mm: self.height * VOXEL_MM,
            centre_mm: self.centre.map(|c| c * VOXEL_MM),
        }
    }

    /// Returns the centres of the spheres relative to the centre of the specimen.
    fn spheres(&self) -> Vec<[f64; 3]> {
        let beyond = if self.cut_by_wall { 2.0 * self.grain_radius } else { 0.0 };
        let (radius, height) = (self.radius + beyond, self.height + 2.0 * beyond);
        let packing = Packing {
            form: GrainForm::Sphere,
            sizes: vec![SizeClass { median_radius_mm: self.grain_radius, spread: 0.0, share: 1.0 }],
            film_mm: 1.0,
            ..Packing::new(self.whole_spheres(radius, height), self.seed)
        };
        let grains = packing.fill(radius, height).expect("the packing can be made");
        let centre = |[x, y, z]: [f64; 3]| [x, y, z - 0.5 * height];
        let centres = grains.into_iter().map(|grain| centre(grain.centre));
        centres.filter(|[_, _, z]| !self.only_below || *z < -self.grain_radius).collect()
    }

    /// Returns the volume fraction closest to the requested fraction among the fractions of whole numbers of spheres
    /// with exactly this radius.
    fn whole_spheres(&self, radius: f64, height: f64) -> f64 {
        let cylinder = PI * radius * radius * height;
        let ball = 4.0 / 3.0 * PI * self.grain_radius.powi(3);
        (self.fraction * cylinder / ball).round().max(1.0) * ball / cylinder
    }

    /// Returns the brightness of the surroundings at a point, relative to the brightness of the matrix.
    fn around(&self, point: [f64; 3], frame: &Frame) -> f64 {
        let [x, y, z] = frame.to_specimen(point);
        let r = x.hypot(y);
        let within = |inside: f64| (0.5 + inside).clamp(0.0, 1.0);
        match self.surroundings {
            Surroundings::Air | Surroundings::Circle => 0.0,
            Surroundings::Tube => 0.8 * within((r - 49.0).min(53.0 - r)),
            Surroundings::Pedestal => within((36.0 - r).min(-0.5 * self.height - z)),
        }
    }
}

/// Position and orientation of the specimen in the image.
struct Frame {
    middle: [f64; 3],
    sine: f64,
    cosine: f64,
}

impl Frame {
    fn new(specimen: &Specimen) -> Frame {
        let [x, y] = specimen.centre;
        let (sine, cosine) = specimen.lean.to_radians().sin_cos();
        Frame { middle: [x, y, 0.5 * specimen.side as f64], sine, cosine }
    }

    /// Converts a point of the image to coordinates relative to the centre of the specimen, with z along its axis.
    fn to_specimen(&self, point: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = std::array::from_fn(|a| point[a] - self.middle[a]);
        [self.cosine * x - self.sine * z, y, self.sine * x + self.cosine * z]
    }

    fn to_image(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let turned = [self.cosine * x + self.sine * z, y, self.cosine * z - self.sine * x];
        std::array::from_fn(|a| turned[a] + self.middle[a])
    }
}

/// Voids in the specimen, which are filled with air.
struct Voids {
    chip: bool,
    /// Normal and distance of each crack.
    cracks: Vec<([f64; 3], f64)>,
    /// Centre and radius of each pore.
    pores: Vec<([f64; 3], f64)>,
}

impl Voids {
    fn new(specimen: &Specimen, rng: &mut Xoshiro256PlusPlus) -> Voids {
        let mut voids =
            Voids { chip: specimen.damage == Damage::Chip, cracks: Vec::new(), pores: Vec::new() };
        if specimen.damage == Damage::CracksAndPores {
            voids.cracks =
                vec![([0.6, 0.0, 0.8], 5.0), ([0.0, 0.8, 0.6], -12.0), ([0.8, 0.6, 0.0], 20.0)];
            for _ in 0..12 {
                let angle = 2.0 * PI * rng.random::<f64>();
                let out = 0.8 * specimen.radius * rng.random::<f64>().sqrt();
                let z = 0.8 * specimen.height * (rng.random::<f64>() - 0.5);
                let pore = [out * angle.cos(), out * angle.sin(), z];
                voids.pores.push((pore, rng.random_range(2.0..4.0)));
            }
        }
        voids
    }

    /// Returns the void fraction of the voxel at a point.
    fn share(&self, p: [f64; 3]) -> f64 {
        let along = |normal: [f64; 3]| -> f64 { (0..3).map(|a| normal[a] * p[a]).sum() };
        let mut inside = f64::NEG_INFINITY;
        if self.chip {
            inside = inside.max(along([0.5_f64.sqrt(), 0.0, 0.5_f64.sqrt()]) - 40.0);
        }
        for &(normal, distance) in &self.cracks {
            let within = 30.0 - (0..3).map(|a| p[a] * p[a]).sum::<f64>().sqrt();
            inside = inside.max((0.75 - (along(normal) - distance).abs()).min(within));
        }
        for &(centre, radius) in &self.pores {
            let off: f64 = (0..3).map(|a| (p[a] - centre[a]).powi(2)).sum();
            inside = inside.max(radius - off.sqrt());
        }
        (0.5 + inside).clamp(0.0, 1.0)
    }
}

/// Returns the indices of the voxels that may intersect a ball.
fn near(middle: [f64; 3], radius: f64, n: usize) -> impl Iterator<Item = usize> {
    let range = move |a: usize| {
        let first = (middle[a] - radius - 1.0).max(0.0) as usize;
        first..((middle[a] + radius + 2.0).max(0.0) as usize).min(n)
    };
    range(2)
        .flat_map(move |z| range(1).flat_map(move |y| range(0).map(move |x| x + n * (y + n * z))))
}

/// Returns the fraction of the voxel around a point that lies in a ball.
fn ball_share(point: [f64; 3], middle: [f64; 3], radius: f64) -> f64 {
    let off: [f64; 3] = std::array::from_fn(|a| point[a] - middle[a]);
    let distance = off.iter().map(|x| x * x).sum::<f64>().sqrt();
    if (distance - radius).abs() > 0.5 * 3.0_f64.sqrt() {
        return if distance < radius { 1.0 } else { 0.0 };
    }
    let step = |k: usize| (k as f64 + 0.5) / POINTS as f64 - 0.5;
    let sample_positions =
        (0..POINTS.pow(3)).map(|k| [k % POINTS, k / POINTS % POINTS, k / POINTS.pow(2)]);
    let inside = sample_positions
        .filter(|k| (0..3).map(|a| (off[a] + step(k[a])).powi(2)).sum::<f64>() < radius * radius);
    inside.count() as f64 / POINTS.pow(3) as f64
}
