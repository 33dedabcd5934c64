//! The element kernel compared with derivatives of its energy by dual numbers, and SIMD lanes compared with single
//! elements.

use num_dual::HyperDual64;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{Element, Law, cube, materials, mixed};
use fem::Fields;
use fem::element::{DamageRule, Domain, Geometry, Linear, Quadratic, Rule, Space, Tetrahedron};
use fem::material::{
    CrackDensity, Degradation, DrivingHistory, Homogenisation, Irreversibility, LaneLaw, Material,
    MixedPhases, PhaseField, PointMaterial, Split,
};
use fem::operator::DataLayout;
use fem::operator::{Assembly, Coupling, Increment, LANES, Residual, StepContext};
use fem::operator::{Blocks, write_blocks};
use fem::operator::{Buffers, Gather};
use fem::operator::{
    Constants, ElementState, MOST_POINTS, linearise, residual as residual_of, state_len,
};
use fem::{Mixture, TetMesh};

const RULES: [DamageRule; 4] =
    [DamageRule::Absent, DamageRule::Vertex, DamageRule::Consistent, DamageRule::Eleven];

/// Random fields: one part of the mesh in tension and one in compression, with strains of about `size`, and some damage.
fn random_fields<const N: usize>(space: &Space<N>, size: f64, rng: &mut impl Rng) -> Fields {
    let mut random = |size: f64| size * rng.random_range(-1.0..1.0);
    let displacement = space.nodes.iter().map(|x| {
        let pull = 0.1 * (1.0 - 2.0 * x[0]);
        std::array::from_fn(|k| pull * size * x[k] + random(0.015 * size))
    });
    let displacement = displacement.collect();
    let damage = (0..space.nodes.len()).map(|_| 0.5 + random(0.4)).collect();
    Fields { displacement, damage, ..Fields::default() }
}

/// Returns the materials for a damage rule; without a damage rule, no material can be damaged.
fn materials_for(rule: DamageRule, law: Law, field: PhaseField) -> Vec<PointMaterial> {
    let absent = rule == DamageRule::Absent;
    // the stiff region is elastic
    let all = materials(law, field, false).into_iter();
    all.map(|m| PointMaterial { damage: m.damage.filter(|_| !absent), ..m }).collect()
}

fn blocks_of<const N: usize>(rule: &Rule, plain: bool, tangent_data: &[f64]) -> Blocks<f64, N> {
    let mut blocks = [[[[0.0; 4]; 4]; N]; N];
    write_blocks::<_, false, N>(rule, plain, tangent_data, &mut blocks);
    blocks
}

/// Kinds of elements in a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Form {
    /// All elements are straight and have one phase.
    Plain,
    /// Some edges are curved.
    Curved,
    /// Some tetrahedra are mixed, with this homogenisation rule, and some edges are curved.
    Mixed(Homogenisation),
}

impl Form {
    pub(super) const ALL: [Self; 5] = [
        Self::Plain,
        Self::Curved,
        Self::Mixed(Homogenisation::Reuss),
        Self::Mixed(Homogenisation::HashinShtrikman),
        Self::Mixed(Homogenisation::GeometricMean),
    ];

    pub(super) fn rule(self) -> Homogenisation {
        if let Self::Mixed(rule) = self { rule } else { Homogenisation::default() }
    }

    /// Changes a mesh of two regions so that it has elements of this kind.
    pub(super) fn shape(self, mut mesh: TetMesh, rng: &mut impl Rng) -> TetMesh {
        if self == Self::Plain {
            return mesh;
        }
        let mut edges: Vec<[u32; 2]> = Vec::new();
        for tet in &mesh.tets {
            let pairs = Quadratic::EDGES.iter().map(|edge| edge.map(|corner| tet[corner]));
            edges.extend(pairs.map(|[i, j]| [i.min(j), i.max(j)]));
        }
        edges.sort_unstable();
        edges.dedup();
        for edge in edges.into_iter().step_by(3) {
            let [p, q] = edge.map(|node| mesh.nodes[node as usize]);
            let shift = |_| 0.02 * rng.random_range(-1.0..1.0);
            let shift: [f64; 3] = [0, 1, 2].map(shift);
            let point = std::array::from_fn(|k| 0.5 * (p[k] + q[k]) + shift[k]);
            mesh.edge_points.push((edge, point));
        }
        if let Self::Mixed(_) = self {
            let of_tet = |(tet, &region): (usize, &u16)| {
                let fraction = [0.3, 0.0, 0.85, 0.95, 0.6][tet % 5];
                Mixture { fraction: if region == 0 { fraction } else { 0.0 }, ..Mixture::default() }
            };
            mesh.mixture = Some(mesh.region_of.iter().enumerate().map(of_tet).collect());
        }
        mesh.validate().expect("a valid mesh");
        mesh
    }
}

/// Checks that the residual R and the tangent blocks K are the first and second derivatives of the energy. Dual numbers
/// give the exact derivatives R·d and dᵀ K e along two random directions d and e.
fn assert_derivatives<const N: usize, T: Tetrahedron<N>>(
    form: Form,
    rule: DamageRule,
    law: Law,
    field: PhaseField,
) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(31);
    let space = Space::new::<T>(&form.shape(cube(2, &mut rng), &mut rng), rule);
    let materials = materials_for(rule, law, field);
    let fields = random_fields(&space, 1.0, &mut rng);
    let before: Vec<f64> = fields.damage.iter().map(|phi| 0.9 * phi).collect();
    let context = StepContext::new(&before, 0.1);
    let increment = Increment { materials: &materials, fields: &fields, context };
    let gather = Gather::new(&space, form.rule(), &increment);
    for tet in 0..12 {
        let mut buffers = Buffers::new(());
        let element = gather.elements::<f64>((), [tet; LANES], &mut buffers);
        let residual = residual_of(&element, &mut []);
        let mut tangent_data = vec![0.0; DataLayout::new(&space.rule, element.plain).width()];
        assert_eq!(linearise::<_, _, false, N>(&element, true, &mut tangent_data, &mut []), 1.0);
        let blocks = blocks_of::<N>(&space.rule, element.plain, &tangent_data);
        let directions: [[[f64; 4]; N]; 2] = std::array::from_fn(|_| {
            std::array::from_fn(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0)))
        });
        let [d, e] = &directions;
        let dual = |x: f64, a: usize, k: usize| HyperDual64::new(x, d[a][k], e[a][k], 0.0);
        let Constants { law: DrivingHistory { law, .. }, degradation, .. } = &element.constants;
        let phases = law.phases.map(|phases| MixedPhases {
            homogenisation: phases.homogenisation,
            matrix: phases.matrix.map(HyperDual64::from),
            grain: phases.grain.map(HyperDual64::from),
            fraction: phases.fraction.into(),
        });
        let moduli = law.moduli.map(HyperDual64::from);
        let dual_geometry = |point: &Geometry<f64>| Geometry {
            barycentric: point.barycentric.map(|row| row.map(HyperDual64::from)),
            volume: point.volume.into(),
        };
        let geometry: Vec<_> = element.geometry.iter().map(dual_geometry).collect();
        let of_duals = ElementState::<_, _, N> {
            rule: element.rule,
            constants: Constants {
                law: DrivingHistory {
                    law: LaneLaw { laws: law.laws, law: law.law.into(), moduli, phases },
                    active: false,
                },
                degradation: Degradation {
                    soft: degradation.soft.into(),
                    laws: degradation.laws,
                    law: degradation.law.into(),
                },
                local: element.constants.local.into(),
                gradient: element.constants.gradient.into(),
                viscous: element.constants.viscous.into(),
            },
            density: element.density,
            displacement: std::array::from_fn(|a| {
                std::array::from_fn(|k| dual(element.displacement[a][k], a, k))
            }),
            damage: std::array::from_fn(|a| dual(element.damage[a], a, 3)),
            before: element.before.map(HyperDual64::from),
            geometry: &geometry,
            plain: element.plain,
            state: &[],
            duration: element.duration.into(),
        };
        let [elastic, fracture, viscous] = residual_of(&of_duals, &mut []).energies;
        let potential = elastic + fracture + viscous * 0.5;
        let along = |direction: &[[f64; 4]; N]| -> f64 {
            let pairs = residual.nodal.as_flattened().iter().zip(direction.as_flattened());
            pairs.map(|(r, d)| r * d).sum()
        };
        let (mut curvature, mut size) = (0.0, 0.0f64);
        for a in 0..N {
            for b in 0..N {
                for i in 0..4 {
                    for j in 0..4 {
                        let k = if b <= a { blocks[a][b][i][j] } else { blocks[b][a][j][i] };
                        // without damage points, damage is not an unknown
                        let absent = rule == DamageRule::Absent && (i == 3 || j == 3);
                        curvature += if absent { 0.0 } else { d[a][i] * k * e[b][j] };
                        size = size.max(k.abs());
                    }
                }
            }
        }
        let force = residual.nodal.as_flattened().iter().fold(0.0f64, |m, r| m.max(r.abs()));
        for (x, y, size) in [
            (potential.eps1, along(d), force),
            (potential.eps2, along(e), force),
            (potential.eps1eps2, curvature, size),
        ] {
            let close = (x - y).abs() < 1e-11 * size;
            assert!(close, "{x} and {y}: {form:?} {rule:?} {field:?}, {tet}");
        }
    }
}

#[test]
fn the_element_kernel_differentiates_its_own_energy() {
    let at2 = PhaseField::new(0.3);
    let hencky = Material::hencky as Law;
    let forms = [
        (hencky, at2),
        (hencky, PhaseField { split: Split::VolumetricDeviatoric, ..at2 }),
        (hencky, PhaseField { split: Split::Spectral, model: CrackDensity::At1, ..at2 }),
        (Material::neo_hookean, PhaseField { split: Split::VolumetricDeviatoric, ..at2 }),
    ];
    for (k, (law, field)) in forms.into_iter().enumerate() {
        // mixtures are implemented for Hencky's law only
        for form in if k < 3 { &Form::ALL[..] } else { &Form::ALL[..2] } {
            for rule in RULES {
                assert_derivatives::<4, Linear>(*form, rule, law, field);
                assert_derivatives::<10, Quadratic>(*form, rule, law, field);
            }
        }
    }
}

/// Checks that the largest |x − y| is a rounding error of the largest |y|, or of terms of the size `cancelled` that
/// cancel in y.
fn assert_near(pairs: impl Iterator<Item = (f64, f64)>, what: &str, cancelled: f64) {
    let [error, size] = pairs.fold([0.0f64; 2], |[d, m], (x, y)| {
        assert!(x.is_finite());
        [d.max((x - y).abs()), m.max(y.abs())]
    });
    assert!(error <= 1e-12 * size + 1e-15 * cancelled, "{what}: {error:e} of {size:e}");
}

/// Checks that elements computed in SIMD lanes give the results of single elements, also with different laws in one
/// vector, with a history, and with an incomplete last vector.
fn assert_as_alone<const N: usize, T: Element<N>>(
    form: Form,
    rule: DamageRule,
    law: Law,
    field: PhaseField,
) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(32);
    let space = Space::new::<T>(&form.shape(cube(2, &mut rng), &mut rng), rule);
    let elastic_points = space.rule.elastic_points.len();
    let (tets, nodes) = (space.tets.len(), space.nodes.len());
    let operator = T::operator(Assembly::new(space.clone()).homogenised(form.rule()));
    for size in [1.0, 1e-4, 1e-9] {
        let fields = random_fields(&space, size, &mut rng);
        // the energies are of second order in the strains, but they are computed as differences of terms of first order
        let stress = 2000.0 * 0.1 * size;
        let history: Vec<f64> =
            (0..tets * elastic_points).map(|_| 3.0 * size * size * rng.random::<f64>()).collect();
        for irreversibility in [Irreversibility::None, Irreversibility::History] {
            let materials = materials_for(rule, law, PhaseField { irreversibility, ..field });
            let has_history = state_len(&materials) == 1;
            assert_eq!(
                has_history,
                irreversibility == Irreversibility::History && rule != DamageRule::Absent
            );
            let state = if has_history { &history[..] } else { &[] };
            let context = StepContext { state, ..StepContext::new(&fields.damage, 0.1) };
            let increment = Increment { materials: &materials, fields: &fields, context };
            let gather = Gather::new(&space, form.rule(), &increment);
            let mut residual = Residual::new(nodes);
            operator.residual(&increment, &mut residual).expect("no element is inverted");
            let mut driving = vec![0.0; state.len()];
            operator.state(&increment, &mut driving).expect("as before");
            let mut scratch = [0.0];
            let (mut nodal, mut drive) = (vec![[0.0; 4]; nodes], vec![0.0; nodes]);
            let mut energies = [0.0; 3];
            for tet in 0..tets {
                let mut buffers = Buffers::new(());
                let alone = gather.elements::<f64>((), [tet; LANES], &mut buffers);
                let one = residual_of(&alone, &mut scratch);
                for (a, &node) in space.tets[tet].iter().enumerate() {
                    (0..4).for_each(|k| nodal[node as usize][k] += one.nodal[a][k]);
                    drive[node as usize] += one.drive[a];
                }
                (0..3).for_each(|k| energies[k] += one.energies[k]);
                if has_history {
                    let mut single = [0.0; MOST_POINTS];
                    assert_eq!(alone.update(&mut single), 1.0);
                    let range = tet * elastic_points..(tet + 1) * elastic_points;
                    let many = driving[range.clone()].iter().zip(&single[..elastic_points]);
                    assert_near(many.map(|(x, y)| (*x, *y)), "driving energies", stress);
                    assert!(
                        driving[range.clone()].iter().zip(&history[range]).all(|(x, y)| x >= y)
                    );
                }
            }
            for fields in [0..3, 3..4] {
                let pairs = residual
                    .nodal
                    .iter()
                    .zip(&nodal)
                    .flat_map(|(x, y)| fields.clone().map(move |k| (x[k], y[k])));
                assert_near(pairs, "residual", 0.0);
            }
            assert_near(residual.drive.into_iter().zip(drive), "drive", stress);
            let all = [residual.elastic, residual.fracture, residual.viscous];
            all.into_iter()
                .zip(energies)
                .for_each(|pair| assert_near([pair].into_iter(), "energy", stress));
            let chosen: Vec<u32> = (0..tets as u32 - 3).collect();
            let plain = chosen.iter().all(|&tet| space.is_plain(tet as usize));
            let mut compare = |batch: usize, tangent_data: &[[f64; LANES]]| {
                for lane in 0..LANES.min(chosen.len() - batch * LANES) {
                    let tets = [batch * LANES + lane; LANES];
                    let mut buffers = Buffers::new(());
                    let mut alone = gather.elements::<f64>((), tets, &mut buffers);
                    alone.plain = plain;
                    let mut single = vec![0.0; tangent_data.len()];
                    linearise::<_, _, false, N>(&alone, true, &mut single, &mut [0.0]);
                    // for equal principal strains, the order of the principal axes may differ: compare the tangent
                    // blocks, which do not depend on the order
                    let side: Vec<f64> = tangent_data.iter().map(|number| number[lane]).collect();
                    let [side, single]: [Blocks<f64, N>; 2] = [side, single]
                        .map(|tangent_data| blocks_of::<N>(&space.rule, plain, &tangent_data));
                    for part in
                        [|i, j| i < 3 && j < 3, |i, j| (i < 3) != (j < 3), |i, j| i + j == 6]
                    {
                        let part: fn(usize, usize) -> bool = part;
                        let entries = (0..16).filter(|e| part(e / 4, e % 4));
                        let pairs = entries.flat_map(|e| {
                            let (i, j) = (e / 4, e % 4);
                            let all = side.as_flattened().iter().zip(single.as_flattened());
                            all.map(move |(x, y)| (x[i][j], y[i][j]))
                        });
                        assert_near(pairs, "tangent", 0.0);
                    }
                }
            };
            let tangent = operator.point_data(&increment, Coupling::Full, &chosen, &mut compare);
            tangent.expect("no element is inverted");
        }
    }
}

#[test]
fn elements_in_simd_lanes_equal_single_elements() {
    let at2 = PhaseField::new(0.3);
    let forms = [
        (Material::hencky as Law, PhaseField { split: Split::Spectral, ..at2 }),
        (Material::neo_hookean, at2),
        (mixed, PhaseField { split: Split::VolumetricDeviatoric, hybrid: true, ..at2 }),
    ];
    for (k, (law, field)) in forms.into_iter().enumerate() {
        for form in [Form::Plain, Form::ALL[if k == 0 { 4 } else { 1 }]] {
            for rule in RULES {
                assert_as_alone::<4, Linear>(form, rule, law, field);
                assert_as_alone::<10, Quadratic>(form, rule, law, field);
            }
        }
    }
}
