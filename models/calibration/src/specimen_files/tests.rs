//! Reading of tables of specimens and their curves, without and with mistakes.

use super::*;

const CURVE: &str = "displacement_mm,force_N\n0,0\n0.05,80\n0.1,140\n0.12,147\n0.15,129\n";

fn written(table: &str, curve: &str) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("specimens.csv");
    std::fs::create_dir(dir.path().join("curves")).unwrap();
    std::fs::write(&file, table).unwrap();
    std::fs::write(dir.path().join("curves/S-1.csv"), curve).unwrap();
    (dir, file)
}

#[test]
fn what_is_written_is_read_again() {
    let curve = TestCurve {
        displacement_mm: vec![0.0, 0.1, 1.0 / 3.0, 0.4, 0.5],
        force_n: vec![0.0, 1e-17, 147.103_2, 3.0, 2.0],
        ..TestCurve::default()
    };
    let specimen = |id: &str, slope_fraction| Specimen {
        id: id.into(),
        height_mm: 4.95,
        radius_mm: 2.5,
        group: "50C".into(),
        slope_fraction,
        image: None,
        test: slope_fraction.map(|_| "slow".to_owned()),
        rate_mm_per_s: slope_fraction,
        // the curves must differ, because two specimens with the same curve are an error
        curve: curve.scale_displacement(if id == "S-1" { 1.0 } else { 1.1 }),
    };
    for fraction in [None, Some(0.55)] {
        let mut table =
            SpecimenTable { specimens: vec![specimen("S-1", fraction), specimen("S-2", None)] };
        let dir = tempfile::tempdir().unwrap();
        if fraction.is_some() {
            std::fs::write(dir.path().join("scan.tif"), "").unwrap();
            table.specimens[1].image = Some("scan.tif".into());
        }
        std::fs::create_dir(dir.path().join("curves")).unwrap();
        for (path, text) in table.to_files().unwrap() {
            std::fs::write(dir.path().join(path), text).unwrap();
        }
        let again = SpecimenTable::read(&dir.path().join("specimens.csv")).unwrap();
        assert_eq!(again, table);
    }
}

#[test]
fn columns_in_any_order_with_comments_blanks_and_a_byte_order_mark() {
    let (_dir, file) = written(
        "\u{feff}# pressed in May\ngroup, id ,radius_mm,height_mm,note\n50C,S-1,2.5,4.4,fine\n",
        CURVE,
    );
    let specimen = SpecimenTable::read(&file).unwrap().specimens.remove(0);
    assert_eq!((specimen.height_mm, specimen.radius_mm), (4.4, 2.5));
    assert_eq!(specimen.curve.force_n[3], 147.0);
}

/// The table is in the format of a German spreadsheet.
#[test]
fn a_table_with_semicolons_and_decimal_commas_is_read() {
    let text = "id;height_mm;radius_mm;group\r\nS-1;4,4;2,5;gr\u{fc}n\r\n";
    let (_dir, file) = written("", CURVE);
    std::fs::write(&file, text.chars().map(|c| c as u32 as u8).collect::<Vec<u8>>()).unwrap();
    let read = SpecimenFiles::read(&file, &ReadOptions::default());
    assert_eq!(read.mistakes, []);
    let understood = read.table_understood.unwrap();
    assert_eq!(understood, "separator ;, decimal comma, Latin-1");
    let specimen = &read.table.specimens[0];
    assert_eq!((specimen.height_mm, specimen.radius_mm), (4.4, 2.5));
    assert_eq!(specimen.group, "grün");
}

#[test]
fn every_mistake_names_place_value_and_help() {
    let header = "id,height_mm,radius_mm,group\n";
    let line = "S-1,4.4,2.5,50C\n";
    let good = format!("{header}{line}");
    let cases: Vec<(String, String, &[&str])> = vec![
        (
            format!("{header}S-1,four,2.5,50C\n"),
            CURVE.into(),
            &["specimens.csv", "line 2, column height_mm = four", "number"],
        ),
        (format!("{header}S-1,-4.4,2.5,50C\n"), CURVE.into(), &["height_mm = -4.4", "positive"]),
        (format!("{good}{line}"), CURVE.into(), &["line 3, column id = S-1", "twice"]),
        (format!("{header}../S-1,4.4,2.5,50C\n"), CURVE.into(), &["column id", "plain name"]),
        (
            "id,hight_mm,radius_mm,group\nS-1,4.4,2.5,50C\n".into(),
            CURVE.into(),
            &["height_mm", "missing", "hight_mm"],
        ),
        (
            "id,hieght,radius_mm,group\nS-1,4.4,2.5,50C\n".into(),
            CURVE.into(),
            &["height_mm", "missing", "Did you mean the column \"hieght\"?"],
        ),
        (
            good.replace("group\n", "group,radius_mm\n").replace("50C\n", "50C,2.6\n"),
            CURVE.into(),
            &["column = radius_mm", "occurs twice"],
        ),
        (good.replace(',', "|"), CURVE.into(), &["id is missing"]),
        (format!("{header}S-1,4,4,2.5,50C\n"), CURVE.into(), &["line 2", "decimal point"]),
        (header.into(), CURVE.into(), &["no specimen"]),
        (format!("{header}S-9,4.4,2.5,50C\n"), CURVE.into(), &["S-9.csv", "cannot be read"]),
        (
            good.clone(),
            "displacement_mm,force_N\n0,0\n0.1,nan\n".into(),
            &["S-1.csv", "line 3, column force_N = nan"],
        ),
        (good.clone(), "displacement_mm,force_N\n0,0\n0.1,10\n".into(), &["2 points", "five"]),
        (
            good.clone(),
            CURVE.replace(",1", ",-1").replace(",80", ",-80"),
            &["Compression is positive"],
        ),
        (
            good.replace("group\n", "group,slope_fraction\n").replace("50C\n", "50C,3\n"),
            CURVE.into(),
            &["slope_fraction = 3", "0.1"],
        ),
    ];
    for (table, curve, fragments) in cases {
        let (_dir, file) = written(&table, &curve);
        let message = SpecimenTable::read(&file).unwrap_err().to_string();
        for fragment in fragments {
            assert!(message.contains(fragment), "{fragment:?} is not in {message:?}");
        }
    }
}

/// A plain file whose times have another name or unit is read with its times. A column of times that cannot be read is
/// an error that names the keys.
#[test]
fn every_column_of_times_of_a_plain_file_is_read_or_refused() {
    let table = "id,height_mm,radius_mm,group\nS-1,4.4,2.5,a\n";
    let with = |name: &str, times: [&str; 5]| {
        let cells = [name].into_iter().chain(times);
        let lines = CURVE.lines().zip(cells).map(|(line, cell)| format!("{line},{cell}\n"));
        lines.collect::<String>()
    };
    let seconds = ["0", "110", "220", "264", "330"];
    for (name, times) in [
        ("time_s", seconds),
        ("time (s)", seconds),
        ("t_s", seconds),
        ("Time_s", seconds),
        ("Seconds", seconds),
        ("time_ms", ["0", "110e3", "220e3", "264e3", "330e3"]),
        ("time", ["00:00", "01:50", "03:40", "04:24", "05:30"]),
        ("Zeit", ["10:00:00", "10:01:50.0", "10:03:40", "10:04:24", "10:05:30"]),
    ] {
        let (_dir, file) = written(table, &with(name, times));
        let specimens = SpecimenTable::read(&file).unwrap_or_else(|e| panic!("{name}: {e}"));
        let rate = specimens.specimens[0].rate_mm_per_s.unwrap();
        assert!((rate * 264.0 / 0.12 - 1.0).abs() < 1e-12, "{name}: {rate}");
    }
    for (name, times, fragments) in [
        ("time", seconds, ["column time: has no unit", "time_unit = \"s\"", "time = \"\""]),
        ("time (ticks)", seconds, ["unknown unit", "time_unit", "time = \"\""]),
        ("time_min", ["a", "b", "c", "d", "e"], ["time_min = a", "time_unit", "time = \"\""]),
    ] {
        let (_dir, file) = written(table, &with(name, times));
        let message = SpecimenTable::read(&file).unwrap_err().to_string();
        for fragment in fragments {
            assert!(message.contains(fragment), "{name}: {fragment:?} is not in {message:?}");
        }
        let options = ReadOptions { time: Some(String::new()), ..ReadOptions::default() };
        let (specimens, _) = SpecimenTable::read_as(&file, &options).unwrap();
        assert_eq!(specimens.specimens[0].rate_mm_per_s, None);
    }
}

#[test]
fn one_curve_for_two_specimens_is_refused() {
    let (dir, file) =
        written("id,height_mm,radius_mm,group\nS-1,4.4,2.5,a\nS-2,4.4,2.5,a\n", CURVE);
    std::fs::copy(dir.path().join("curves/S-1.csv"), dir.path().join("curves/S-2.csv")).unwrap();
    let error = SpecimenTable::read(&file).unwrap_err().to_string();
    assert!(error.contains("S-2.csv") && error.contains("is equal to the curve of S-1"), "{error}");
    let in_kn = "displacement_mm,force_kN,time_min\n0,0,0\n0.05,0.08,1\n0.1,0.14,2\n0.12,0.147,3\n0.15,0.129,4\n";
    std::fs::write(dir.path().join("curves/S-2.csv"), in_kn).unwrap();
    let error = SpecimenTable::read(&file).unwrap_err().to_string();
    assert!(error.contains("has the readings of S-1"), "{error}");
}

/// The rate is 0.12 mm in 240 s. The format of the export is described. Two curve files for one specimen are an
/// error.
#[test]
fn exports_have_a_rate_and_are_found_by_their_endings() {
    let (dir, file) = written("id,height_mm,radius_mm,group\nS-1,4.4,2.5,a\n", CURVE);
    let export = "t [s]\tWeg [mm]\tKraft [kN]\n0\t0\t0\n100\t0,05\t0,08\n200\t0,1\t0,14\n240\t0,12\t0,147\n300\t0,15\t0,129\n";
    let options = ReadOptions { time: Some("t".into()), ..ReadOptions::default() };
    std::fs::write(dir.path().join("curves/S-1.txt"), export).unwrap();
    let error = SpecimenTable::read_as(&file, &options).unwrap_err().to_string();
    assert!(error.contains("S-1.csv") && error.contains("S-1.txt"), "{error}");
    std::fs::remove_file(dir.path().join("curves/S-1.csv")).unwrap();
    let (table, understood) = SpecimenTable::read_as(&file, &options).unwrap();
    let rate = table.specimens[0].rate_mm_per_s.unwrap();
    assert!((rate - 0.12 / 240.0).abs() < 1e-12, "{rate}");
    assert_eq!(table.specimens[0].curve.force_n[3], 147.0);
    assert!(understood[0].as_ref().unwrap().contains("load in kN"), "{understood:?}");
    let plain = CURVE
        .replace("force_N", "force_N,time_s")
        .replace('\n', ",0\n")
        .replacen("time_s,0", "time_s", 1);
    std::fs::remove_file(dir.path().join("curves/S-1.txt")).unwrap();
    std::fs::write(dir.path().join("curves/S-1.csv"), plain).unwrap();
    let error = SpecimenTable::read(&file).unwrap_err().to_string();
    assert!(error.contains("column time: passes 0 s"), "{error}");
}

#[test]
fn a_group_is_chosen_or_the_groups_are_named() {
    let (_dir, file) = written("id,height_mm,radius_mm,group\nS-1,4.4,2.5,50C\n", CURVE);
    let table = SpecimenTable::read(&file).unwrap();
    assert_eq!(table.clone().in_group("50C", &file).unwrap(), table);
    let error = table.in_group("90C", &file).unwrap_err();
    assert!(error.help.contains("50C"), "{error}");
}

#[test]
fn all_mistakes_of_a_table_and_its_curves_are_collected() {
    let (dir, file) = written(
        "id,height_mm,radius_mm,group\nS-1,four,-2.5,a\nS-2,4.4,2.5,a\nS-3,4.4,2.5,a\nS-4,4.4,2.5,a\n",
        CURVE,
    );
    std::fs::write(dir.path().join("curves/S-2.csv"), CURVE.replace("80", "eighty")).unwrap();
    std::fs::write(dir.path().join("curves/S-4.csv"), CURVE.replace("80", "81")).unwrap();
    let SpecimenFiles { table, mistakes, .. } = SpecimenFiles::read(&file, &ReadOptions::default());
    let ids: Vec<&str> = table.specimens.iter().map(|specimen| specimen.id.as_str()).collect();
    assert_eq!(ids, ["S-4"]);
    let mistakes: Vec<String> = mistakes.iter().map(ToString::to_string).collect();
    assert_eq!(mistakes.len(), 4, "{mistakes:#?}");
    for (mistake, fragment) in
        mistakes.iter().zip(["height_mm = four", "radius_mm = -2.5", "eighty", "S-3.csv"])
    {
        assert!(mistake.contains(fragment), "{fragment}: {mistake}");
    }
}
