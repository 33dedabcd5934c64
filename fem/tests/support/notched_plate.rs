//! Single-edge notched plate: 1 mm square, one element thick, with a slit from the left side to the middle.

use fem::{
    Axis, Conditions, CurvePoint, Fracture, Irreversibility, Material, PhaseField, Problem,
    Schedule, SolverOptions, Split, TetMesh,
};

/// Direction in which the upper side moves.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Mode {
    /// Up: the crack runs straight to the right side.
    Tension,
    /// To the right, at constant height: the crack turns down.
    Shear,
}

/// Test of the plate in plane strain. The lower side is fixed; the upper side is moved along x or y and fixed along the
/// other axis. The damage model is AT2 with ℓ₀ = 0.015 mm and the spectral split.
pub(crate) struct NotchedPlate {
    pub(crate) mode: Mode,
    /// Whether the split acts on the driving force only; otherwise it acts on the stress too.
    pub(crate) hybrid: bool,
    /// Size of the elements around the crack path, mm.
    pub(crate) size_mm: f64,
    /// Successive loading stages: displacement at the end of the stage (mm), number of equal steps.
    pub(crate) steps: Vec<(f64, u32)>,
}

impl NotchedPlate {
    pub(crate) fn mesh(&self) -> TetMesh {
        notched_plate(self.mode, self.size_mm)
    }

    pub(crate) fn problem(&self, tolerance: f64) -> Problem {
        let (lame, shear) = (121_150.0, 80_770.0);
        let young = shear * (3.0 * lame + 2.0 * shear) / (lame + shear);
        let steel = Material::hencky(young, 0.5 * lame / (lame + shear))
            .with_fracture(Fracture { residual_stiffness: 1e-7, ..Fracture::new(2.7) });
        let field = PhaseField {
            split: Split::Spectral,
            hybrid: self.hybrid,
            irreversibility: Irreversibility::History,
            ..PhaseField::new(0.015)
        };
        // each step lasts 1 s
        let mut at = vec![0.0];
        for &(to, count) in &self.steps {
            let from = *at.last().expect("a start");
            at.extend((1..=count).map(|k| from + (to - from) * f64::from(k) / f64::from(count)));
        }
        let steps = at.len() as u32 - 1;
        let path = move |time_s: f64| {
            let k = (time_s.floor() as usize).min(at.len() - 2);
            at[k] + (time_s - k as f64) * (at[k + 1] - at[k])
        };
        let direction = match self.mode {
            Mode::Tension => [0.0, 1.0, 0.0],
            Mode::Shear => [1.0, 0.0, 0.0],
        };
        let conditions = Conditions::new()
            .fix("front", [Axis::Z])
            .fix("back", [Axis::Z])
            .fix("bottom", [Axis::X, Axis::Y])
            .prescribe("top", [Axis::X, Axis::Y], move |_, time_s| {
                direction.map(|d| path(time_s) * d)
            })
            .measure("top", direction);
        let schedule = Schedule::fixed(f64::from(steps), steps).stop_below_peak(0.5);
        let options = SolverOptions { tolerance, alternations: 2000, ..SolverOptions::default() };
        Problem::builder(self.mesh())
            .materials([steel])
            .phase_field(field)
            .conditions(conditions)
            .schedule(schedule)
            .options(options)
            .build()
            .expect("valid input")
    }
}

/// Force scaled to a plate of 1 mm thickness, kN.
pub(crate) fn kilonewton(point: &CurvePoint, plate: &NotchedPlate) -> f64 {
    point.force_n / plate.size_mm / 1000.0
}

/// Mesh of the plate with elements of size `h` (mm) around the crack path; the size grows with the distance from the
/// path. The slit is open: nodes on the slit are doubled. Surfaces: bottom, top, front and back. The thickness is `h`.
fn notched_plate(mode: Mode, h: f64) -> TetMesh {
    // along x, fine from just left of the slit tip to the right side; along y in shear, fine from just above the slit to
    // the lower side
    let along = fine_behind_the_middle(h);
    let across = match mode {
        Mode::Tension => graded(0.5, 0.04_f64.max(2.0 * h), h),
        Mode::Shear => along.iter().rev().map(|x| 1.0 - x).collect(),
    };
    let (nx, ny) = (along.len(), across.len());
    let middle =
        across.iter().position(|&y| (y - 0.5).abs() < 0.1 * h).expect("a line at the slit");
    let slit = along.iter().filter(|&&x| x < 0.5 - 0.1 * h).count();
    let mut mesh = TetMesh { regions: vec!["plate".into()], ..TetMesh::default() };
    for z in [0.0, h] {
        for &y in &across {
            mesh.nodes.extend(along.iter().map(|&x| [x, y, z]));
        }
        // the nodes of the upper lip of the slit
        mesh.nodes.extend(along[..slit].iter().map(|&x| [x, 0.5, z]));
    }
    let layer = nx * ny + slit;
    let node = |i: usize, j: usize, k: usize, above: bool| {
        let doubled = above && j == middle && i < slit;
        (k * layer + if doubled { nx * ny + i } else { i + nx * j }) as u32
    };
    let mut surface: [Vec<[u32; 3]>; 4] = Default::default();
    for j in 0..ny - 1 {
        for i in 0..nx - 1 {
            let corner = |c: usize| node(i + (c & 1), j + (c >> 1 & 1), c >> 2, j >= middle);
            for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
                mesh.tets.push([corner(0), corner(a), corner(b), corner(7)]);
                mesh.region_of.push(0);
            }
            let mut face = |name: usize, [a, b, c, d]: [usize; 4]| {
                let [a, b, c, d] = [a, b, c, d].map(corner);
                surface[name].extend([[a, b, d], [a, d, c]]);
            };
            if j == 0 {
                face(0, [0, 1, 4, 5]);
            }
            if j + 2 == ny {
                face(1, [2, 6, 3, 7]);
            }
            face(2, [0, 2, 1, 3]);
            face(3, [4, 5, 6, 7]);
        }
    }
    for (name, triangles) in ["bottom", "top", "front", "back"].into_iter().zip(surface) {
        mesh.surfaces.insert(name.into(), triangles);
    }
    mesh
}

/// Coordinates in [0, 1] mm with spacing `h` from just below the middle to 1; below, the spacing grows towards 0.
fn fine_behind_the_middle(h: f64) -> Vec<f64> {
    let half = (0.5 / h).round() as usize;
    graded(0.5, 0.03_f64.max(2.0 * h), h)
        .into_iter()
        .filter(|&x| x < 0.5 - 0.1 * h)
        .chain((0..=half).map(|i| 0.5 + 0.5 * i as f64 / half as f64))
        .collect()
}

/// Coordinates in [0, 1] mm: spacing `h` up to a distance `fine` from `centre`; beyond, the spacing grows by the factor
/// 1.3 up to 0.06 mm.
fn graded(centre: f64, fine: f64, h: f64) -> Vec<f64> {
    let half = |room: f64| {
        let mut at = vec![0.0];
        let mut step = h;
        let mut last = 0.0;
        while last < room - 1e-9 {
            if last > fine {
                step = f64::min(1.3 * step, 0.06);
            }
            last += step;
            at.push(last);
        }
        // scale the graded steps so that the last point is on the side of the plate
        let start = at.iter().position(|&x| x > fine).unwrap_or(at.len() - 1);
        let (from, to) = (at[start], last);
        for x in &mut at[start..] {
            *x = from + (*x - from) * (room - from) / (to - from);
        }
        at
    };
    let below = half(centre);
    let above = half(1.0 - centre);
    let mut coordinates: Vec<f64> = below.iter().skip(1).rev().map(|d| centre - d).collect();
    coordinates.extend(above.iter().map(|d| centre + d));
    coordinates
}
