//! Synthetic scenes of balls with known volumes in a specimen, and images of these scenes.

use fem_image::Volume;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Edge of a voxel (mm).
pub(crate) const VOXEL_MM: f64 = 0.01;
/// Grey values of air, matrix and grains, as in the virtual scanner.
pub(crate) const AIR: f32 = 8_000.0;
pub(crate) const MATRIX: f32 = 28_000.0;
pub(crate) const GRAIN: f32 = 44_000.0;
/// Standard deviations of blur (voxels) and of noise (grey values), as in the virtual scanner.
pub(crate) const BLUR: f64 = 0.7;
pub(crate) const NOISE: f32 = 1_400.0;
/// Number of sampling points along the edge of a voxel that a surface intersects.
const SAMPLES: usize = 4;

/// An upright cylinder (voxels).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pillar {
    pub(crate) centre: [f64; 2],
    pub(crate) radius: f64,
    pub(crate) ends: [f64; 2],
}

impl Pillar {
    /// Returns a cylinder in the middle of an image of a given shape.
    pub(crate) fn amid(shape: [usize; 3], radius: f64, height: f64) -> Self {
        let [x, y, z] = shape.map(|side| side as f64 / 2.0);
        Pillar { centre: [x, y], radius, ends: [z - height / 2.0, z + height / 2.0] }
    }

    /// Returns the signed distance of a point from the surface; negative inside.
    pub(crate) fn distance(&self, [x, y, z]: [f64; 3]) -> f64 {
        let radial = (x - self.centre[0]).hypot(y - self.centre[1]) - self.radius;
        radial.max(self.ends[0] - z).max(z - self.ends[1])
    }

    pub(crate) fn volume(&self) -> f64 {
        std::f64::consts::PI * self.radius.powi(2) * (self.ends[1] - self.ends[0])
    }
}

/// Grey values without blur and noise, and the balls in the scene.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    pub(crate) shape: [usize; 3],
    pub(crate) grey: Vec<f32>,
    /// Number of the ball that contains the centre of each voxel, or 0.
    pub(crate) truth: Vec<u32>,
    /// Volume of each ball (voxels).
    pub(crate) volumes: Vec<f64>,
    centres: Vec<([f64; 3], f64)>,
}

impl Scene {
    /// Returns a scene with one grey value.
    pub(crate) fn filled(shape: [usize; 3], grey: f32) -> Self {
        let count = shape.iter().product();
        Scene {
            shape,
            grey: vec![grey; count],
            truth: vec![0; count],
            volumes: Vec::new(),
            centres: Vec::new(),
        }
    }

    /// Returns a cylinder of matrix in air, with balls of one radius at a given volume fraction.
    pub(crate) fn specimen(shape: [usize; 3], pillar: Pillar, radius: f64, fraction: f64) -> Self {
        let mut scene = Scene::filled(shape, AIR);
        scene.paint(|p| pillar.distance(p), MATRIX);
        scene.add_balls(&pillar, radius, fraction, GRAIN);
        scene
    }

    /// Sets the grey value inside a surface; `distance` is signed and negative inside.
    pub(crate) fn paint(&mut self, distance: impl Fn([f64; 3]) -> f64, grey: f32) {
        self.paint_box([[0; 3], self.shape], distance, grey);
    }

    fn paint_box(
        &mut self,
        [from, to]: [[usize; 3]; 2],
        distance: impl Fn([f64; 3]) -> f64,
        grey: f32,
    ) -> f64 {
        let [nx, ny, _] = self.shape;
        let mut painted = 0.0;
        for z in from[2]..to[2] {
            for y in from[1]..to[1] {
                for x in from[0]..to[0] {
                    let corner = [x as f64, y as f64, z as f64];
                    let off = distance(corner.map(|c| c + 0.5));
                    let share = if off > 1.0 {
                        continue;
                    } else if off < -1.0 {
                        1.0
                    } else {
                        let samples = (0..SAMPLES.pow(3)).filter(|n| {
                            let step = [n % SAMPLES, n / SAMPLES % SAMPLES, n / SAMPLES.pow(2)];
                            let at = |k: usize| corner[k] + (step[k] as f64 + 0.5) / SAMPLES as f64;
                            distance([at(0), at(1), at(2)]) < 0.0
                        });
                        samples.count() as f32 / SAMPLES.pow(3) as f32
                    };
                    let value = &mut self.grey[x + nx * (y + ny * z)];
                    *value += share * (grey - *value);
                    painted += f64::from(share);
                }
            }
        }
        painted
    }

    /// Adds balls at random positions, completely inside a cylinder and at least one voxel apart.
    pub(crate) fn add_balls(&mut self, pillar: &Pillar, radius: f64, fraction: f64, grey: f32) {
        let ball = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        let count = (fraction * pillar.volume() / ball).round() as usize;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        let mut misses = 0;
        while self.volumes.len() < count && misses < 300_000 {
            let [x, y] = pillar.centre;
            let reach = pillar.radius;
            let at = [
                x + rng.random_range(-reach..reach),
                y + rng.random_range(-reach..reach),
                rng.random_range(pillar.ends[0]..pillar.ends[1]),
            ];
            let is_free = |&(other, r): &([f64; 3], f64)| {
                let square: f64 = (0..3).map(|k| (at[k] - other[k]).powi(2)).sum();
                square > (r + radius + 1.0).powi(2)
            };
            if pillar.distance(at) < -radius - 0.5 && self.centres.iter().all(is_free) {
                self.add_ball(at, radius, grey);
            } else {
                misses += 1;
            }
        }
    }

    /// Adds balls at random positions in the whole image until they have a given volume fraction. The distance of two
    /// centres is at least 1.1 times the radius, so that balls touch and overlap. Returns the fraction.
    pub(crate) fn add_touching_balls(&mut self, radius: f64, fraction: f64, grey: f32) -> f64 {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(13);
        let all = self.truth.len() as f64;
        let painted =
            |scene: &Self| scene.truth.iter().filter(|label| **label != 0).count() as f64 / all;
        while painted(self) < fraction {
            let at = self.shape.map(|side| rng.random_range(0.0..side as f64));
            let square = |other: &[f64; 3]| (0..3).map(|k| (at[k] - other[k]).powi(2)).sum::<f64>();
            if self.centres.iter().all(|(other, _)| square(other) > (1.1 * radius).powi(2)) {
                self.add_ball(at, radius, grey);
            }
        }
        painted(self)
    }

    /// Makes the specimen brighter towards its wall, as beam hardening does.
    pub(crate) fn cup(&mut self, pillar: &Pillar, rise: f64) {
        let [nx, ny, _] = self.shape;
        for (n, grey) in self.grey.iter_mut().enumerate() {
            let [x, y] =
                [(n % nx, 0), (n / nx % ny, 1)].map(|(c, k)| c as f64 + 0.5 - pillar.centre[k]);
            let s = (x * x + y * y) / pillar.radius.powi(2);
            *grey = AIR + (*grey - AIR) * (1.0 + rise * (s.min(1.0) - 0.5)) as f32;
        }
    }

    /// Adds one ball.
    pub(crate) fn add_ball(&mut self, centre: [f64; 3], radius: f64, grey: f32) {
        let from = centre.map(|c| (c - radius - 2.0).max(0.0) as usize);
        let to = [0, 1, 2].map(|k| ((centre[k] + radius + 3.0) as usize).min(self.shape[k]));
        let distance =
            |p: [f64; 3]| (0..3).map(|k| (p[k] - centre[k]).powi(2)).sum::<f64>().sqrt() - radius;
        let volume = self.paint_box([from, to], distance, grey);
        self.volumes.push(volume);
        self.centres.push((centre, radius));
        let [nx, ny, _] = self.shape;
        for z in from[2]..to[2] {
            for y in from[1]..to[1] {
                for x in from[0]..to[0] {
                    if distance([x, y, z].map(|c| c as f64 + 0.5)) < 0.0 {
                        self.truth[x + nx * (y + ny * z)] = self.volumes.len() as u32;
                    }
                }
            }
        }
    }

    /// Returns an image of the scene, with the blur and noise of the virtual scanner.
    pub(crate) fn image(&self) -> Volume<f32> {
        self.image_with(BLUR, NOISE)
    }

    /// Returns an image of the scene with given standard deviations of blur (voxels) and of noise (grey values).
    pub(crate) fn image_with(&self, blur: f64, noise: f32) -> Volume<f32> {
        let mut values = self.grey.clone();
        blurred(&mut values, self.shape, blur);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(12);
        for pair in values.chunks_mut(2) {
            // Box–Muller transform
            let length = (-2.0 * (1.0 - rng.random::<f32>()).ln()).sqrt();
            let (sin, cos) = (std::f32::consts::TAU * rng.random::<f32>()).sin_cos();
            for (value, normal) in pair.iter_mut().zip([length * cos, length * sin]) {
                *value = (*value + noise * normal).round();
            }
        }
        Volume::new(self.shape, VOXEL_MM, values).unwrap()
    }

    pub(crate) fn labels(&self) -> Volume<u32> {
        Volume::new(self.shape, VOXEL_MM, self.truth.clone()).unwrap()
    }

    /// Returns the volume of the balls divided by the volume of a specimen.
    pub(crate) fn fraction(&self, volume: f64) -> f64 {
        self.volumes.iter().sum::<f64>() / volume
    }
}

/// Applies a Gaussian filter along each axis; positions beyond the edge have the value of the outermost voxel.
pub(crate) fn blurred(values: &mut [f32], shape: [usize; 3], deviation: f64) {
    let reach = (4.0 * deviation).ceil() as usize;
    let weight = |d: f64| (-0.5 * (d / deviation).powi(2)).exp();
    let kernel: Vec<f64> = (0..=2 * reach).map(|k| weight(k as f64 - reach as f64)).collect();
    let all: f64 = kernel.iter().sum();
    let kernel: Vec<f32> = kernel.iter().map(|w| (w / all) as f32).collect();
    let mut stride = 1;
    for side in shape {
        let mut line = vec![0.0_f32; side + 2 * reach];
        for start in (0..values.len()).filter(|at| at / stride % side == 0) {
            for (n, value) in line.iter_mut().enumerate() {
                let at = n.saturating_sub(reach).min(side - 1);
                *value = values[start + at * stride];
            }
            for n in 0..side {
                let window = line[n..].iter().zip(&kernel);
                values[start + n * stride] = window.map(|(value, w)| value * w).sum();
            }
        }
        stride *= side;
    }
}
