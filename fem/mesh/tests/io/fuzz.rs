//! Fuzz test of the reader of MSH files: damaged files give an error or a mesh, with limited memory.
//!
//! The files are read in a separate process, so that the peak memory of this process measures the reader only.

use std::process::Command;

use fem_mesh::gmsh::{self, GmshNames};
use fem_mesh::{CylinderLattice, Mixture};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

const CHILD: &str = "BRECCIA_FUZZ_CHILD";
/// Maximum additional memory compared with undamaged files (MB). The files have about 100 kB.
const MOST_MB: f64 = 64.0;

/// Returns undamaged files of both versions, ASCII and binary, of first and second order.
fn sound_files() -> Vec<Vec<u8>> {
    let mut mesh =
        CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build().unwrap();
    let file = tempfile::NamedTempFile::new().unwrap();
    let write = |mesh: &_| {
        gmsh::write(file.path(), mesh).unwrap();
        std::fs::read(file.path()).unwrap()
    };
    let mut files = vec![write(&mesh)];
    mesh.regions.push("grain".into());
    mesh.mixture = Some(vec![Mixture { fraction: 0.5, ..Mixture::default() }; mesh.tets.len()]);
    // an edge point slightly off the midpoint makes the file second-order
    let mut edge = [mesh.tets[0][0], mesh.tets[0][1]];
    edge.sort_unstable();
    let [p, q] = edge.map(|node| mesh.nodes[node as usize]);
    mesh.edge_points.push((edge, std::array::from_fn(|k| 0.5 * (p[k] + q[k]) + 1e-6)));
    files.push(write(&mesh));
    files.extend([binary_v2(&mesh), binary_v4(&mesh)]);
    files
}

fn binary_v2(mesh: &fem_mesh::TetMesh) -> Vec<u8> {
    let mut out = b"$MeshFormat\n2.2 1 8\n\x01\0\0\0\n$EndMeshFormat\n$Nodes\n".to_vec();
    out.extend(format!("{}\n", mesh.nodes.len()).bytes());
    for (tag, p) in (1_i32..).zip(&mesh.nodes) {
        out.extend(tag.to_le_bytes());
        p.iter().for_each(|x| out.extend(x.to_le_bytes()));
    }
    out.extend(format!("\n$EndNodes\n$Elements\n{}\n", mesh.tets.len()).bytes());
    [4, mesh.tets.len() as i32, 2].iter().for_each(|x| out.extend(x.to_le_bytes()));
    for (tag, tet) in (1_i32..).zip(&mesh.tets) {
        [tag, 1, 1].iter().for_each(|x| out.extend(x.to_le_bytes()));
        tet.iter().for_each(|&node| out.extend((node as i32 + 1).to_le_bytes()));
    }
    out.extend(b"\n$EndElements\n");
    out
}

fn binary_v4(mesh: &fem_mesh::TetMesh) -> Vec<u8> {
    let mut out = b"$MeshFormat\n4.1 1 8\n\x01\0\0\0\n$EndMeshFormat\n$Entities\n".to_vec();
    let sizes =
        |out: &mut Vec<u8>, all: &[u64]| all.iter().for_each(|x| out.extend(x.to_le_bytes()));
    let ints =
        |out: &mut Vec<u8>, all: &[i32]| all.iter().for_each(|x| out.extend(x.to_le_bytes()));
    sizes(&mut out, &[0, 0, 0, 1]);
    ints(&mut out, &[1]);
    [0.0_f64; 6].iter().for_each(|x| out.extend(x.to_le_bytes()));
    sizes(&mut out, &[1]);
    ints(&mut out, &[1]);
    sizes(&mut out, &[0]);
    out.extend(b"\n$EndEntities\n$Nodes\n");
    let (nodes, tets) = (mesh.nodes.len() as u64, mesh.tets.len() as u64);
    sizes(&mut out, &[1, nodes, 1, nodes]);
    ints(&mut out, &[3, 1, 0]);
    sizes(&mut out, &[nodes]);
    (1..=nodes).for_each(|tag| sizes(&mut out, &[tag]));
    mesh.nodes.iter().flatten().for_each(|x| out.extend(x.to_le_bytes()));
    out.extend(b"\n$EndNodes\n$Elements\n");
    sizes(&mut out, &[1, tets, 1, tets]);
    ints(&mut out, &[3, 1, 4]);
    sizes(&mut out, &[tets]);
    for (tag, tet) in (1..).zip(&mesh.tets) {
        sizes(&mut out, &[tag]);
        tet.iter().for_each(|&node| sizes(&mut out, &[u64::from(node) + 1]));
    }
    out.extend(b"\n$EndElements\n");
    out
}

/// Introduces one to four faults: truncation, flipped bits, huge counts, strange text, missing or repeated lines.
fn damage(bytes: &mut Vec<u8>, rng: &mut impl Rng) {
    const TEXTS: [&[u8]; 10] = [
        b"18446744073709551615",
        b"4294967296",
        b"2147483647",
        b"-1",
        b"1e308",
        b"NaN",
        b"$End",
        b"\n",
        b"$Nodes\n",
        b"\xff\xfe",
    ];
    for _ in 0..rng.random_range(1..=4) {
        // half of the faults are in the first 600 bytes, which contain the counts
        let head = bytes.len().min(600);
        let reach = if rng.random_bool(0.5) { head } else { bytes.len() };
        if reach == 0 {
            return;
        }
        let at = rng.random_range(0..reach);
        match rng.random_range(0..6) {
            0 => bytes.truncate(at),
            1 => bytes[at] ^= 1 << rng.random_range(0..8),
            2 => bytes[at] = b'9',
            3 => {
                let end = (at + 8).min(bytes.len());
                bytes[at..end].fill(0x7f);
            }
            4 => {
                let text = TEXTS[rng.random_range(0..TEXTS.len())];
                bytes.splice(at..at, text.iter().copied());
            }
            _ => {
                let end = (at + rng.random_range(1..60)).min(bytes.len());
                let part = bytes[at..end].to_vec();
                bytes.splice(
                    at..end,
                    if rng.random_bool(0.5) { [&part[..], &part].concat() } else { vec![] },
                );
            }
        }
    }
}

fn peak_mb() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with("VmHWM"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

/// Reads the files in the separate process; does nothing if it is run as an ordinary test.
#[test]
fn fuzz_child() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    let file = tempfile::NamedTempFile::new().unwrap();
    let read = |bytes: &[u8]| {
        std::fs::write(file.path(), bytes).unwrap();
        gmsh::read(file.path(), &GmshNames::default())
    };
    let files = sound_files();
    files.iter().for_each(|bytes| drop(read(bytes).unwrap()));
    let before = peak_mb();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(20);
    let mut refused = 0;
    for round in 0..2000 {
        let mut bytes = files[round % files.len()].clone();
        damage(&mut bytes, &mut rng);
        if let Err(error) = read(&bytes) {
            refused += 1;
            assert!(error.to_string().len() < 2000, "{error}");
        }
    }
    println!("{refused} of 2000 refused");
    assert!(refused > 1000);
    if let (Some(before), Some(after)) = (before, peak_mb()) {
        assert!(after - before < MOST_MB, "from {before} to {after} MB");
    }
}

#[test]
fn damaged_mesh_files_are_refused_in_little_memory() {
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "fuzz::fuzz_child", "--nocapture", "--test-threads", "1"])
        .env(CHILD, "1")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("of 2000 refused"), "the separate process did not run: {said}");
}
