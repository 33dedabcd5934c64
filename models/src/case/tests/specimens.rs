//! Mesh files, surfaces and labels in the place of a packing.

use super::super::{CaseFile, SpecimenGeometry};

#[test]
fn a_mesh_replaces_lattice_and_packing() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("case.toml");
    std::fs::write(dir.path().join("cylinder.msh"), "").unwrap();
    let rest =
        "[material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[test]\ndisplacement_mm = 0.2\n";
    let parse = |specimen: &str| CaseFile::parse(&format!("[specimen]\n{specimen}\n{rest}"), &path);
    let good =
        "mesh = \"cylinder.msh\"\nregions = { matrix = 1 }\nsurfaces = { bottom = 11, top = 12 }";
    let geometry = parse(good).unwrap().geometry().unwrap();
    assert!(
        matches!(geometry, SpecimenGeometry::Mesh { file, .. } if file == dir.path().join("cylinder.msh"))
    );
    for (specimen, part) in [
        (good.replace("cylinder", "missing"), "there is no such file"),
        (format!("{good}\nradius_mm = 2.5"), "cannot be combined with specimen.mesh"),
        (good.replace("regions = { matrix = 1 }", ""), "specimen.regions"),
        (good.replace(", top = 12", ""), "the surface top is missing"),
        (good.replace("{ matrix = 1 }", "{ matrix = 1, void = 3 }"), "material.void"),
        (good.replace("{ matrix = 1 }", "{ matrix = 1, grain = 1 }"), "grain and matrix both"),
        (good.replace("top = 12", "top = 11"), "bottom and top both"),
    ] {
        let message = parse(&specimen).unwrap_err().to_string();
        assert!(message.contains(part), "{part:?} is not in {message:?}");
    }
}

#[test]
fn surfaces_take_the_place_of_a_packing_and_an_image() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("stl")).unwrap();
    let parse = |specimen: &str, stl: &str| {
        let grain = "[material.grain]\nyoung_mpa = 22000\npoisson = 0.25\n";
        let text = format!(
            "[specimen]\n{specimen}\n[specimen.stl]\n{stl}\n[material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n\
             {grain}[test]\ndisplacement_mm = 0.2\nsteps = 2\n"
        );
        CaseFile::parse(&text, &dir.path().join("case.toml"))
    };
    let (specimen, good) = ("spacing_mm = 0.5", "surfaces = \"stl\"");
    let file = parse(specimen, good).unwrap();
    let again = CaseFile::parse(&file.case.to_toml(), &file.path).unwrap();
    assert_eq!(again, file);
    let SpecimenGeometry::Surfaces { import, radius_mm: None, .. } = file.geometry().unwrap()
    else {
        panic!("no surfaces")
    };
    assert_eq!(import, fem::SurfaceImport::new(dir.path().join("stl")));
    let all = "unit_mm = 0.001\naxis = \"x\"\nsmoothing_passes = 3\ndecimation = 20\nleast_distance_mm = 0.01\nmargin_mm = 0.1";
    let SpecimenGeometry::Surfaces { import, height_mm: Some(4.0), .. } =
        parse("spacing_mm = 0.5\nheight_mm = 4.0", &format!("{good}\n{all}"))
            .unwrap()
            .geometry()
            .unwrap()
    else {
        panic!("no surfaces")
    };
    assert_eq!(
        (import.unit_mm, import.axis, import.decimation),
        (0.001, fem::SurfaceAxis::X, 20.0)
    );
    for (specimen, stl, fragments) in [
        (specimen, "surfaces = \"other\"", ["specimen.stl.surfaces", "there is no such file"]),
        (specimen, "unit_mm = 1.0", ["surfaces", "missing"]),
        (
            specimen,
            "surfaces = \"stl\"\nunit_mm = 0.0",
            ["specimen.stl", "unit_mm = 0; give a length"],
        ),
        (specimen, "surfaces = \"stl\"\ndecimation = 0.5", ["specimen.stl", "recommended: 20"]),
        (specimen, "surfaces = \"stl\"\nmargin = 1.0", ["margin", "margin_mm"]),
        (specimen, "surfaces = \"stl\"\naxis = \"q\"", ["axis", "z"]),
        ("radius_mm = 2.5", good, ["specimen.spacing_mm", "is missing"]),
        (
            "spacing_mm = 0.5\ngrains = { fraction = 0.2, seed = 1 }",
            good,
            ["specimen.grains", "cannot be combined with specimen.stl"],
        ),
        (
            "spacing_mm = 0.5\nimage = { stack = \"a.tif\" }",
            good,
            ["specimen.image", "cannot be combined with specimen.stl"],
        ),
        (
            "mesh = \"a.msh\"\nregions = { matrix = 1 }",
            good,
            ["specimen.stl", "cannot be combined with specimen.mesh"],
        ),
    ] {
        let message = parse(specimen, stl).unwrap_err().to_string();
        for fragment in fragments {
            assert!(message.contains(fragment), "{fragment:?} is not in {message:?}");
        }
    }
}

#[test]
fn phases_of_labels_are_regions_with_materials() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("labels.tif"), "II*").unwrap();
    let parse = |image: &str, rest: &str| {
        let text = format!(
            "[specimen]\nspacing_mm = 0.5\n[specimen.image]\n{image}\n[material.matrix]\nyoung_mpa = 275\n\
             poisson = 0.25\n[test]\ndisplacement_mm = 0.2\nsteps = 2\n{rest}\n"
        );
        CaseFile::parse(&text, &dir.path().join("case.toml"))
    };
    let phases = "labels = \"labels.tif\"\nbackground = 255\n\
                  label_phases = { 1 = \"grain\", 20 = \"void\", \"3 to 9\" = \"inclusion\" }";
    let of = |name: &str| format!("[material.{name}]\nyoung_mpa = 22000\npoisson = 0.2\n");
    let both = of("grain") + &of("inclusion");
    let file = parse(phases, &both).unwrap();
    let again = CaseFile::parse(&file.case.to_toml(), &file.path).unwrap();
    assert_eq!(again, file);
    let SpecimenGeometry::Image { labels: Some(rules), .. } = file.geometry().unwrap() else {
        panic!("no labels")
    };
    assert_eq!((rules.background, rules.phases.len()), (Some(255), 3));
    assert_eq!(rules.grain_phases(), ["grain", "inclusion", "void"]);
    // if no phases are given, each label is a grain
    let plain = "labels = \"labels.tif\"";
    assert!(parse(plain, &of("grain")).is_ok());
    let prior = "[prior]\ninclusion.young_mpa = [10000.0, 30000.0]\n";
    assert!(parse(phases, &format!("{both}{prior}")).is_ok());

    for (image, rest, fragments) in [
        (phases.to_owned(), of("grain"), ["material.inclusion", "is missing"]),
        (phases.to_owned(), both.clone() + &of("crust"), ["material.crust", "grain, inclusion"]),
        (phases.to_owned(), both.clone() + &of("void"), ["material.void", "no part of the mesh"]),
        (phases.replace("1 = \"grain\", ", ""), both.clone(), ["material.grain", "belongs to no"]),
        (phases.to_owned(), of("grain") + prior, ["material.inclusion", "is missing"]),
        (phases.replace("255", "5"), both.clone(), ["specimen.image", "also a label of inclusion"]),
        (phases.replace("20", "4"), both.clone(), ["specimen.image", "the label 4 belongs to"]),
        (phases.replace("20", "x"), both.clone(), ["label_phases", "names no label"]),
        (phases.replace("void", "a.b"), both.clone(), ["label_phases", "not the name of a phase"]),
        (format!("{phases}\nbin = 2"), both.clone(), ["specimen.image.bin = 2", "no mean"]),
        (
            format!("{phases}\nstack = \"a.tif\""),
            both.clone(),
            ["image.labels", "cannot be combined"],
        ),
        (
            format!("{plain}\nspecimen = \"cylinder\""),
            of("grain"),
            ["specimen.image", "give background"],
        ),
        (
            plain.replace("labels.tif", "other.tif"),
            of("grain"),
            ["specimen.image.labels", "no such"],
        ),
    ] {
        let message = parse(&image, &rest).unwrap_err().to_string();
        assert!(
            fragments.iter().all(|fragment| message.contains(fragment)),
            "{fragments:?} in {message:?}"
        );
    }
}
