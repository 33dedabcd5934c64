//! STL files of grains as input of a mesh, and surfaces of packings and labels as STL files.

use std::f64::consts::PI;
use std::path::Path;

use fem_mesh::stl::{self, Triangle};
use fem_mesh::{
    GrainField, GrainMode, Meshing, Packing, Surface, SurfaceAxis, SurfaceImport,
    SurfaceImportError, VoxelGrains, least_gap_mm,
};

use super::surfaces::sphere;

fn triangles(surface: &Surface) -> Vec<Triangle> {
    let at = |corner: u32| surface.points[corner as usize];
    surface.triangles.iter().map(|triangle| triangle.map(at)).collect()
}

fn write(dir: &Path, name: &str, triangles: &[Triangle]) {
    stl::write(dir.join(name), "grain", triangles).unwrap();
}

/// Grains of a packing are written to files, smoothed, decimated, shrunk and meshed; the volume of each grain in the
/// mesh is checked.
#[test]
fn a_packing_is_read_back_from_its_files() {
    let packing = Packing { film_mm: 0.1, ..Packing::new(0.2, 3) };
    let truth = fem_mesh::GrainList::new(packing.fill(2.5, 4.4).unwrap(), 2.5, 4.4);
    let dir = tempfile::tempdir().unwrap();
    for (number, grain) in (1..).zip(truth.list()) {
        let surface = truth.surface(number);
        assert_eq!(surface.open_edges(), 0);
        assert!((surface.volume() / grain.volume_mm3() - 1.0).abs() < 1e-9);
        let farthest = surface.points.iter().map(|&p| grain.signed_distance_mm(p).abs());
        let farthest = farthest.fold(0.0, f64::max);
        assert!(farthest < 0.1 * grain.bounding_radius_mm(), "{farthest}");
        // coordinates in µm
        let in_um: Vec<Triangle> = triangles(&surface)
            .into_iter()
            .map(|triangle| {
                triangle.map(|p| [p[0] + 7.0, p[1] - 3.0, p[2] + 11.0].map(|x| 1e3 * x))
            })
            .collect();
        write(dir.path(), &format!("grain-{number}.stl"), &in_um);
    }
    std::fs::write(dir.path().join("notes.txt"), "no surface").unwrap();
    let import = SurfaceImport {
        unit_mm: 1e-3,
        smoothing_passes: 2,
        decimation: 20.0,
        least_distance_mm: 0.11,
        margin_mm: 0.05,
        ..SurfaceImport::new(dir.path().to_owned())
    };
    let found = import.read([None, Some(4.5)]).unwrap();
    assert_eq!(found.surfaces.len(), truth.grains());
    assert!(found.names[9].ends_with("grain-10.stl"), "{:?}", found.names[9]);
    let count: usize = found.surfaces.iter().map(|surface| surface.triangles.len()).sum();
    let ratio = found.triangles_read as f64 / count as f64;
    assert!(ratio > 19.0, "{ratio}");
    let gap = found.least_gap_mm.unwrap();
    assert!(gap > 0.11 * (1.0 - 1e-9) && gap < 0.12, "{gap}");
    assert_eq!(found.overlap_mm3, 0.0);
    // the enclosing cylinder is narrower than the cylinder of the packing; the grains are centred
    let [radius_mm, height_mm] = found.size_mm();
    assert!(radius_mm < 2.55 && radius_mm > 2.2 && height_mm == 4.5, "{radius_mm} {height_mm}");
    let out = found.surfaces.iter().flat_map(|surface| &surface.points);
    let out = out.map(|p| p[0].hypot(p[1])).fold(0.0, f64::max);
    assert!((out - (radius_mm - 0.05)).abs() < 1e-9, "{out}");

    let shrunk: f64 = (1..).zip(&found.factors).map(|(n, f)| f.powi(3) * truth.volume_mm3(n)).sum();
    assert!((found.volume_mm3() / shrunk - 1.0).abs() < 1e-6);
    assert!(shrunk / truth.list().iter().map(|g| g.volume_mm3()).sum::<f64>() > 0.97);
    let meshing = Meshing { mode: GrainMode::Conforming, ..Meshing::new(0.4) };
    let meshed = meshing.build(radius_mm, height_mm, &found.grains().unwrap()).unwrap();
    meshed.mesh.validate().unwrap();
    assert!((meshed.report.achieved_fraction / found.fraction() - 1.0).abs() < 0.01);
    for (number, grain) in (1..).zip(&meshed.report.grains) {
        let expected = found.factors[number as usize - 1].powi(3) * truth.volume_mm3(number);
        let error = grain.achieved_mm3 / expected - 1.0;
        assert!(error.abs() < 0.1, "grain {number}: {error}");
    }
}

#[test]
fn one_file_of_all_grains_and_other_axes_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let places = [([1.0, 20.0, 300.0], 0.9), ([1.5, 25.0, 300.2], 0.5)];
    let inward = |(c, r): ([f64; 3], f64)| -> Vec<Triangle> {
        sphere(c, r, 3).into_iter().map(|[a, b, c]| [a, c, b]).collect()
    };
    let all: Vec<Triangle> = places.into_iter().flat_map(inward).collect();
    let file = dir.path().join("all.STL");
    stl::write(&file, "all", &all).unwrap();
    for (axis, height) in
        [(SurfaceAxis::X, 1.9), (SurfaceAxis::Y, 5.0 + 0.9 + 0.5), (SurfaceAxis::Z, 1.8)]
    {
        let import = SurfaceImport { axis, ..SurfaceImport::new(file.clone()) };
        let found = import.read([None; 2]).unwrap();
        assert_eq!((found.surfaces.len(), found.turned), (2, 2));
        assert!((found.size_mm()[1] - height).abs() < 1e-4, "{axis:?}: {:?}", found.size_mm());
        assert!(found.names[1].ends_with("all.STL, part 2"), "{:?}", found.names);
        assert!(found.surfaces.iter().all(|surface| surface.volume() > 0.0));
        let low = found.surfaces.iter().flat_map(|surface| &surface.points).map(|p| p[2]);
        assert!(low.fold(f64::INFINITY, f64::min).abs() < 1e-9);
        assert!(found.warnings()[0].contains("normals of 2 of 2 surfaces pointed inwards"));
    }
    // the same folder, read as one grain of two parts
    let found = SurfaceImport::new(dir.path().to_owned()).read([None; 2]).unwrap();
    assert_eq!((found.surfaces.len(), found.turned), (1, 1));
    let one = SurfaceImport { axis: SurfaceAxis::X, ..SurfaceImport::new(file) };
    let text = one.read([Some(4.0), Some(3.0)]).unwrap().in_words();
    assert!(text.contains("2 grains") && text.contains("radius 4.0000 mm"), "{text}");
}

/// File names with their triangles.
type Files = Vec<(&'static str, Vec<Triangle>)>;

#[test]
fn errors_of_invalid_grains_name_the_file() {
    let ball = |c: [f64; 3], r: f64| sphere(c, r, 3);
    let turned = |mut all: Vec<Triangle>, from: usize, to: usize| {
        all[from..to].iter_mut().for_each(|triangle| triangle.swap(1, 2));
        all
    };
    let good = ball([0.0; 3], 1.0);
    let cases: [(&str, Files, &[&str]); 7] = [
        ("none", vec![], &["there is no STL file"]),
        (
            "open",
            vec![("a.stl", good.clone()), ("b.stl", good[4..].to_vec())],
            &["b.stl", "open edges", "Close Holes"],
        ),
        (
            "normals",
            vec![("a.stl", turned(good.clone(), 0, 7))],
            &["a.stl", "points inwards and the normal of its neighbour outwards"],
        ),
        (
            "flat",
            vec![("f.stl", vec![good[0], [good[0][0], good[0][2], good[0][1]]])],
            &["f.stl", "encloses no volume"],
        ),
        (
            "twice",
            vec![("a.stl", good.clone()), ("copy.stl", good.clone())],
            &["1 pairs of grains overlap", "copy.stl", "largest overlap, 9"],
        ),
        (
            "overlap",
            vec![("a.stl", good.clone()), ("b.stl", ball([1.2, 0.0, 0.0], 1.0))],
            &["by 10", "largest overlap, 2", "least_distance_mm"],
        ),
        ("far", vec![("a.stl", good.clone())], &[]),
    ];
    for (what, files, fragments) in cases {
        let dir = tempfile::tempdir().unwrap();
        for (name, triangles) in &files {
            write(dir.path(), name, triangles);
        }
        let import = SurfaceImport::new(dir.path().to_owned());
        match import.read([None; 2]) {
            Ok(found) => {
                assert_eq!(what, "far");
                found.check_unit(0.2, 1.0).unwrap();
                for (spacing_mm, likely) in [
                    (2e-4, "unit_mm = 0.001"),
                    (150.0, "unit_mm = 1000"),
                    (1e-30, "probably wrong"),
                ] {
                    let error = found.check_unit(spacing_mm, 1.0).unwrap_err().to_string();
                    assert!(error.contains(likely), "{error}");
                }
            }
            Err(error) => {
                let text = error.to_string();
                for fragment in fragments {
                    assert!(
                        !fragments.is_empty() && text.contains(fragment),
                        "{what}: {fragment:?} is not in {text:?}"
                    );
                }
            }
        }
    }
    // overlapping grains are separated by shrinking if requested; identical grains cannot be separated
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "a.stl", &good);
    write(dir.path(), "b.stl", &ball([1.2, 0.0, 0.0], 1.0));
    let import =
        SurfaceImport { least_distance_mm: 0.02, ..SurfaceImport::new(dir.path().to_owned()) };
    let found = import.read([None; 2]).unwrap();
    assert!(least_gap_mm(&found.surfaces).unwrap().0 >= 0.02 * (1.0 - 1e-9));
    assert!((found.factors[0] - 0.59).abs() < 0.01, "{:?}", found.factors);
    assert!(
        found.warnings()[0].contains("the grain fraction is too small by"),
        "{:?}",
        found.warnings()
    );
    write(dir.path(), "c.stl", &good);
    let error = import.read([None; 2]).unwrap_err();
    assert!(matches!(&error, SurfaceImportError::Inseparable { .. }), "{error}");

    let triangles: Vec<Triangle> =
        good.into_iter().chain(turned(ball([3.0, 0.0, 0.0], 0.5), 0, 512)).collect();
    let file = dir.path().join("parts.stl");
    stl::write(&file, "parts", &triangles).unwrap();
    let error = SurfaceImport::new(file).read([None; 2]).unwrap_err().to_string();
    assert!(error.contains("normals of 1 of 2 parts point inwards"), "{error}");
    for import in [
        SurfaceImport { unit_mm: 0.0, ..import.clone() },
        SurfaceImport { decimation: 0.5, ..import.clone() },
        SurfaceImport { least_distance_mm: f64::NAN, ..import },
    ] {
        assert!(matches!(import.read([None; 2]), Err(SurfaceImportError::Field { .. })));
    }
}

/// Surfaces of labelled balls, and of grains of one to eight voxels, enclose the volume of their voxels.
#[test]
fn labels_have_surfaces_of_their_volume() {
    let n = 40;
    let balls = [([12.3, 14.1, 13.0], 7.0), ([27.5, 26.0, 25.2], 8.5)];
    let mut labels =
        fem_image::Volume { shape: [n; 3], voxel_mm: 0.05, values: vec![0_u32; n * n * n] };
    let voxel = |at: [usize; 3]| at[0] + n * (at[1] + n * at[2]);
    for (label, (centre, radius)) in (1..).zip(balls) {
        for at in (0..n * n * n).map(|c| [c % n, c / n % n, c / n / n]) {
            let square: f64 = (0..3).map(|k| (at[k] as f64 - centre[k]).powi(2)).sum();
            if square < radius * radius {
                labels.values[voxel(at)] = label;
            }
        }
    }
    labels.values[voxel([35, 5, 20])] = 3;
    for at in (0..8).map(|c| [4 + (c & 1), 33 + (c >> 1 & 1), 30 + (c >> 2)]) {
        labels.values[voxel(at)] = 4;
    }
    // a grain at the boundary of the image
    for at in (0..64).map(|c| [c % 4, c / 4 % 4, 36 + c / 16]) {
        labels.values[voxel(at)] = 5;
    }
    let cylinder = fem_image::Cylinder {
        centre_mm: [1.0, 1.0],
        radius_mm: 1.0,
        bottom_mm: 0.2,
        top_mm: 1.9,
        lean: [0.05, -0.02],
    };
    let grains = VoxelGrains::new(&labels, None, &cylinder);
    for (label, voxels) in [(3, 1.0), (4, 8.0)] {
        let surface = grains.surface(label).unwrap();
        assert_eq!((surface.open_edges(), surface.parts().len()), (0, 1));
        assert!((surface.volume() / (voxels * 0.05_f64.powi(3)) - 1.0).abs() < 1e-6);
    }
    assert_eq!(grains.surface(5).unwrap().open_edges(), 0);
    assert!(grains.surface(6).is_none() && grains.surface(0).is_none());
    for (label, (centre, radius)) in (1..).zip(balls) {
        let surface = grains.surface(label).unwrap();
        assert_eq!((surface.open_edges(), surface.parts().len()), (0, 1));
        let count = labels.values.iter().filter(|&&own| own == label).count() as f64;
        assert!((surface.volume() / (count * 0.05_f64.powi(3)) - 1.0).abs() < 1e-6);
        assert!((count / (4.0 / 3.0 * PI * radius.powi(3)) - 1.0).abs() < 0.02);
        // the surface is in the coordinates of the tilted specimen, which the mesh uses
        let middle = cylinder.to_specimen(centre.map(|x| (x + 0.5) * 0.05));
        for point in &surface.points {
            let out = (0..3).map(|k| (point[k] - middle[k]).powi(2)).sum::<f64>().sqrt();
            assert!((out / 0.05 - radius).abs() < 0.7, "{} voxels", out / 0.05);
        }
    }
}
