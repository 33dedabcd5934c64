//! Files for ParaView, which another program reads if it is installed.

use std::process::Command;

use fem::vtu::{self, Field};
use fem::{
    Axis, Block, CompressionTest, Conditions, ConstitutiveLaw, CylinderLattice, ElasticResponse,
    Material, MeshError, Order, Principal, Problem, Response, Scalar, Schedule, TetMesh,
};

fn mesh() -> TetMesh {
    let mut mesh =
        CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build().unwrap();
    mesh.grain_of = Some((0..mesh.tets.len() as u32).map(|tet| tet % 3).collect());
    mesh
}

/// Returns quadratic tetrahedra: the nodes of the mesh, and the midpoints of the edges 01, 12, 20, 03, 13, 23 of each
/// tetrahedron. Adjacent tetrahedra have separate midpoints, which is allowed in a file.
fn quadratic(mesh: &TetMesh) -> (Vec<[f64; 3]>, Vec<[u32; 10]>) {
    let mut positions = mesh.nodes.clone();
    let tets = mesh.tets.iter().map(|tet| {
        let mut ten = [0; 10];
        ten[..4].copy_from_slice(tet);
        for (k, [a, b]) in [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]].iter().enumerate() {
            let [p, q] = [tet[*a], tet[*b]].map(|node| mesh.nodes[node as usize]);
            ten[4 + k] = positions.len() as u32;
            positions.push(std::array::from_fn(|k| 0.5 * (p[k] + q[k])));
        }
        ten
    });
    let tets = tets.collect();
    (positions, tets)
}

/// Returns the bytes of the array with the given name.
fn array(text: &str, name: &str) -> Vec<u8> {
    let start = text.find(&format!("Name=\"{name}\"")).unwrap();
    let code = text[start..].split('>').nth(1).unwrap().split('<').next().unwrap().trim();
    let digit = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let mut bytes = vec![];
    for four in code.as_bytes().chunks(4) {
        let bits = four.iter().fold(0_u32, |bits, &c| (bits << 6) | digit(c) as u32);
        let padding = four.iter().filter(|&&c| c == b'=').count();
        bytes.extend(&bits.to_be_bytes()[1..4 - padding]);
    }
    let (length, data) = bytes.split_at(8);
    assert_eq!(u64::from_le_bytes(length.try_into().unwrap()), data.len() as u64);
    data.to_vec()
}

#[test]
fn arrays_contain_the_mesh_and_the_fields() {
    let (dir, mesh) = (tempfile::tempdir().unwrap(), mesh());
    let path = dir.path().join("a.vtu");
    let height: Vec<f64> = mesh.nodes.iter().map(|p| p[2]).collect();
    vtu::write(&path, &mesh, &[Field::scalar("height <mm>", &height)], &[]).unwrap();
    let text = std::fs::read_to_string(path).unwrap();

    let reals = |name: &str| -> Vec<f64> {
        array(&text, name).chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
    };
    assert_eq!(reals("points_mm"), mesh.nodes.concat());
    assert_eq!(reals("height &lt;mm&gt;"), height);
    let nodes: Vec<u32> = array(&text, "connectivity")
        .chunks(8)
        .map(|b| i64::from_le_bytes(b.try_into().unwrap()) as u32)
        .collect();
    assert_eq!(nodes, mesh.tets.concat());
    assert_eq!(array(&text, "types"), vec![10; mesh.tets.len()]);
}

/// A cylinder in uniaxial compression. In closed form, τ = E ε with ε = ln λ along the axis, J = λ^(1 − 2ν) and ψ = ½ E
/// ε².
#[test]
fn the_written_stress_and_energy_agree_with_the_closed_form() {
    let (young, poisson, stretch) = (275.0, 0.25, 1.0 - 0.22 / 4.4);
    let strain = f64::ln(stretch);
    let stress = young * strain / stretch.powf(1.0 - 2.0 * poisson);
    let dir = tempfile::tempdir().unwrap();
    for order in [Order::Linear, Order::Quadratic] {
        let problem = CompressionTest::new(0.22, Schedule::fixed(1.0, 1))
            .builder(mesh())
            .unwrap()
            .order(order)
            .materials([Material::hencky(young, poisson)])
            .build()
            .unwrap();
        let outcome = problem.run(&mut ());
        let path = dir.path().join("fields.vtu");
        problem.write_vtu(&path, &outcome.fields).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let reals = |name: &str| -> Vec<f64> {
            let bytes = array(&text, name);
            bytes.chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
        };
        let close = |a: f64, b: f64| (a - b).abs() < 1e-6 * young;
        let tensors = reals("stress_mpa");
        assert_eq!(tensors.len(), 6 * problem.mesh().tets.len());
        for six in tensors.chunks(6) {
            assert!(close(six[2], stress), "{order:?}: {six:?} {stress}");
            assert!([0, 1, 3, 4, 5].iter().all(|&k| close(six[k], 0.0)), "{order:?}: {six:?}");
        }
        assert!(reals("von_mises_mpa").iter().all(|&x| close(x, stress.abs())));
        let energy = 0.5 * young * strain * strain;
        assert!(reals("energy_density_mpa").iter().all(|&x| close(x, energy)));
    }
}

/// τ = (K t + H t_n) I + 2 μ dev ε with t = tr ε; the state t_n is t at the start of the increment.
#[derive(Debug)]
struct Lagging;

const K: f64 = 180.0;
const H: f64 = 40.0;
const MU: f64 = 110.0;

impl ConstitutiveLaw for Lagging {
    fn young_and_poisson(&self) -> [f64; 2] {
        [9.0 * K * MU / (3.0 * K + MU), (3.0 * K - 2.0 * MU) / (6.0 * K + 2.0 * MU)]
    }

    fn state_len(&self) -> usize {
        1
    }

    fn respond<T: Scalar>(
        &self,
        trial: &Principal<T>,
        g: T,
        _: T,
        old: &[T],
        new: &mut [T],
    ) -> Response<T> {
        let trace = trial.strains.trace();
        new[0] = trace;
        let pressure = trace * K + old[0] * H;
        let mut out =
            ElasticResponse::volumetric([trace * trace * (0.5 * K), pressure, g.constant(K)]);
        for i in 0..3 {
            let deviator = trial.strains.log[i] - trace / 3.0;
            out.energy += deviator * deviator * MU;
            out.stress[i] += deviator * (2.0 * MU);
            out.shear[i] = trial.strains.coth[i] * MU;
        }
        for (entry, i, j) in [(0, 0, 0), (1, 1, 0), (2, 1, 1), (3, 2, 0), (4, 2, 1), (5, 2, 2)] {
            let share = if i == j { 4.0 / 3.0 } else { -2.0 / 3.0 };
            out.normal[entry] += g.constant(MU * share);
        }
        out.degraded(g)
    }
}

/// A block without lateral strain, compressed in two increments: the stress in the file is the stress at the end of the
/// run.
#[test]
fn the_stress_of_a_law_with_a_state_is_written_with_its_state() {
    let conditions = Conditions::new()
        .fix("left", [Axis::X])
        .fix("right", [Axis::X])
        .fix("front", [Axis::Y])
        .fix("back", [Axis::Y])
        .fix("bottom", [Axis::Z])
        .prescribe("top", [Axis::Z], |_, time_s| [0.0, 0.0, -0.04 * time_s]);
    let problem = Problem::builder(Block::new([1.0; 3], [1; 3]).build().unwrap())
        .materials([Material::with_law(Lagging).unwrap()])
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, 2))
        .build()
        .unwrap();
    let fields = problem.run(&mut ()).fields;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("fields.vtu");
    problem.write_vtu(&path, &fields).unwrap();
    let bytes = array(&std::fs::read_to_string(&path).unwrap(), "stress_mpa");
    let stresses: Vec<f64> =
        bytes.chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
    let [start, end] = [0.98_f64, 0.96].map(f64::ln);
    let pressure = K * end + H * start;
    for six in stresses.chunks(6) {
        let [x, z] = [pressure - 2.0 / 3.0 * MU * end, pressure + 4.0 / 3.0 * MU * end];
        for (stress, exact) in [(six[0], x), (six[1], x), (six[2], z)] {
            let exact = exact / 0.96;
            assert!((stress - exact).abs() < 1e-6 * exact.abs(), "{stress} and {exact} MPa");
        }
    }
}

#[test]
fn the_shear_stress_of_a_sheared_bar_is_in_the_right_component() {
    // in simple shear u_x = γ z, σ_xz = μ γ to first order; the other components are of second order in γ
    let gamma = 1e-4;
    let problem = CompressionTest::new(0.22, Schedule::fixed(1.0, 1))
        .builder(mesh())
        .unwrap()
        .materials([Material::hencky(10.0, 0.25)])
        .build()
        .unwrap();
    let displacement = problem.nodes().iter().map(|x| [gamma * x[2], 0.0, 0.0]).collect();
    let damage = vec![0.0; problem.nodes().len()];
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("fields.vtu");
    let fields = fem::Fields { displacement, damage, ..fem::Fields::default() };
    problem.write_vtu(&path, &fields).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let bytes = array(&text, "stress_mpa");
    let stresses: Vec<f64> =
        bytes.chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
    for six in stresses.chunks(6) {
        for (k, entry) in six.iter().enumerate() {
            let expected = if k == 5 { 4.0 * gamma } else { 0.0 };
            assert!((entry - expected).abs() < 10.0 * gamma * gamma, "{six:?}");
        }
    }
    assert!(text.contains("Name=\"stress_mpa\" NumberOfComponents=\"6\""));
}

#[test]
fn linear_tetrahedra_fill_the_body_for_both_orders() {
    let problem = |order| {
        CompressionTest::new(0.22, Schedule::fixed(1.0, 1))
            .builder(mesh())
            .unwrap()
            .order(order)
            .materials([Material::hencky(10.0, 0.25)])
            .build()
            .unwrap()
    };
    let whole = mesh();
    assert_eq!(problem(Order::Linear).linear_tets(), whole.tets);
    let quadratic = problem(Order::Quadratic);
    let refined = TetMesh {
        nodes: quadratic.nodes().to_vec(),
        tets: quadratic.linear_tets(),
        ..TetMesh::default()
    };
    assert_eq!(refined.tets.len(), 8 * whole.tets.len());
    for (tet, eight) in refined.volumes().chunks(8).enumerate() {
        // if each of the eight tetrahedra has a positive volume of an eighth of the element, they fill the element
        // without overlap
        let part = whole.tet_volume(tet) / 8.0;
        assert!(eight.iter().all(|v| (v - part).abs() < 1e-12), "{eight:?} {part}");
    }
}

#[test]
fn fields_of_the_wrong_length_are_rejected() {
    let (dir, mesh) = (tempfile::tempdir().unwrap(), mesh());
    let path = dir.path().join("a.vtu");
    let error = vtu::write(&path, &mesh, &[], &[Field::scalar("damage", &[0.0])]).unwrap_err();
    assert!(error.to_string().contains("cell field `damage`: 1 values for"), "{error}");
    assert!(!path.exists());
    let nowhere = dir.path().join("none/a.vtu");
    assert!(matches!(vtu::write(nowhere, &mesh, &[], &[]), Err(MeshError::Io { .. })));
}

/// Mesh with one curved edge and some mixed tetrahedra.
fn curved() -> TetMesh {
    let mut mesh = mesh();
    let mut edge = [mesh.tets[7][1], mesh.tets[7][2]];
    edge.sort_unstable();
    let [p, q] = edge.map(|node| mesh.nodes[node as usize]);
    mesh.edge_points = vec![(edge, std::array::from_fn(|k| 0.5 * (p[k] + q[k]) + 0.01))];
    let mixture = |tet: usize| fem::Mixture {
        fraction: 0.25 * (tet % 3) as f32,
        normal: if tet % 3 == 2 { [0.0, 0.6, 0.8] } else { [0.0; 3] },
        region: 1,
    };
    mesh.mixture = Some((0..mesh.tets.len()).map(mixture).collect());
    mesh
}

#[test]
fn curved_meshes_are_written_with_quadratic_tetrahedra() {
    let (dir, mesh) = (tempfile::tempdir().unwrap(), curved());
    let path = dir.path().join("a.vtu");
    let height: Vec<f64> = mesh.nodes.iter().map(|p| p[2]).collect();
    vtu::write(&path, &mesh, &[Field::scalar("height", &height)], &[]).unwrap();
    let text = std::fs::read_to_string(path).unwrap();
    let reals = |name: &str| -> Vec<f64> {
        array(&text, name).chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
    };
    let positions = reals("points_mm");
    let nodes: Vec<usize> = array(&text, "connectivity")
        .chunks(8)
        .map(|b| i64::from_le_bytes(b.try_into().unwrap()) as usize)
        .collect();
    assert_eq!(array(&text, "types"), vec![24; mesh.tets.len()]);
    let at = |node: usize| &positions[3 * node..3 * node + 3];
    for (tet, ten) in nodes.chunks(10).enumerate() {
        let corners = mesh.corners(tet);
        assert!((0..4).all(|k| at(ten[k]) == corners[k]));
        let straight = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]]
            .map(|[a, b]| [0, 1, 2].map(|k| 0.5 * (corners[a][k] + corners[b][k])));
        let middles = mesh.middles(tet).unwrap_or(straight);
        assert!((0..6).all(|k| at(ten[4 + k]) == middles[k]), "tetrahedron {tet}");
    }
    let height = reals("height");
    assert_eq!(height.len(), positions.len() / 3);
    let fraction = reals("grain_fraction");
    assert!(fraction.iter().enumerate().all(|(tet, f)| *f == 0.25 * (tet % 3) as f64));
    assert_eq!(reals("interface_normal")[6..9], [0.0, f64::from(0.6_f32), f64::from(0.8_f32)]);
}

#[test]
fn meshio_reads_the_files() {
    let python = std::env::var("BRECCIA_PYTHON").unwrap_or_else(|_| "python3".into());
    let has = |module: &str| {
        let import = format!("import {module}");
        Command::new(&python).args(["-c", &import]).output().is_ok_and(|o| o.status.success())
    };
    if !has("meshio") {
        eprintln!("SKIPPED: {python} has no meshio; set BRECCIA_PYTHON to a Python with meshio");
        return;
    }
    let (dir, mesh) = (tempfile::tempdir().unwrap(), mesh());
    let (positions, tets) = quadratic(&mesh);
    let volume: Vec<f64> = (0..mesh.tets.len()).map(|tet| mesh.tet_volume(tet)).collect();
    let cells = [Field::scalar("volume_mm3", &volume)];
    vtu::write(dir.path().join("p1.vtu"), &mesh, &[Field::vector("x", &mesh.nodes)], &cells)
        .unwrap();
    let path = dir.path().join("p2.vtu");
    vtu::write_quadratic(path, &mesh, &positions, &tets, &[Field::vector("x", &positions)], &cells)
        .unwrap();
    let curved = curved();
    vtu::write(dir.path().join("curved.vtu"), &curved, &[], &[]).unwrap();
    vtu::write_pvd(dir.path().join("run.pvd"), &[(0.0, "p1.vtu"), (0.5, "p2.vtu")]).unwrap();

    let check = r#"
import sys, meshio, numpy as np, xml.etree.ElementTree as et
for entry in et.parse("run.pvd").getroot().iter("DataSet"):
    mesh = meshio.read(entry.get("file"))
    (block,) = mesh.cells
    corners = mesh.points[block.data[:, :4]]
    edges = corners[:, 1:] - corners[:, :1]
    volume = np.linalg.det(edges) / 6
    assert np.allclose(volume, mesh.cell_data["volume_mm3"][0], rtol=1e-10, atol=0)
    assert (mesh.point_data["x"] == mesh.points).all()
    assert (mesh.cell_data["grain"][0] == np.arange(len(volume)) % 3).all()
    if block.type == "tetra10":
        pairs = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
        for k, (a, b) in enumerate(pairs):
            middle = (corners[:, a] + corners[:, b]) / 2
            assert (mesh.points[block.data[:, 4 + k]] == middle).all()
    print(block.type, len(volume), volume.sum())
mesh = meshio.read("curved.vtu")
(block,) = mesh.cells
assert block.type == "tetra10"
number = np.arange(len(block.data))
assert np.allclose(mesh.cell_data["grain_fraction"][0], 0.25 * (number % 3))
assert np.allclose(mesh.cell_data["interface_normal"][0][number % 3 == 2], [0, 0.6, 0.8])
pairs = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
bent = [
    np.linalg.norm(mesh.points[block.data[:, 4 + k]] - mesh.points[block.data[:, p]].mean(axis=1))
    > 0.01
    for k, p in enumerate(map(list, pairs))
]
assert sum(bent) > 0
"#;
    let output =
        Command::new(&python).args(["-c", check]).current_dir(dir.path()).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("tetra ") && text.contains("tetra10 "), "{text}");
}
