//! Reading of exports of testing machines, correct ones and ones with mistakes.

use std::path::PathBuf;

use super::*;

const SIZE: SpecimenSize = SpecimenSize { height_mm: 4.0, radius_mm: 2.5 };

fn write(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join(name);
    std::fs::write(&file, bytes).unwrap();
    (dir, file)
}

fn read(bytes: &[u8], options: &str) -> Result<Record, InputError> {
    let (_dir, file) = write("S-1.csv", bytes);
    Record::read(&file, &toml::from_str(options).unwrap(), SIZE)
}

/// Export of Bluehill: quotes, `;`, decimal commas, a row of units, Latin-1, CRLF, compression negative.
const BLUEHILL: &str = "\"Prüfung\";\"Druck\"\r\n\"Probe\";\"S-1\"\r\n\"Durchmesser\";\"5,0\";\"mm\"\r\n\r\n\
    \"Zeit\";\"Weg\";\"Kraft\"\r\n\"(s)\";\"(mm)\";\"(kN)\"\r\n\
    \"0,0\";\"0,000\";\"0,000\"\r\n\"1,0\";\"-0,050\";\"-0,080\"\r\n\"2,0\";\"-0,100\";\"-0,140\"\r\n\
    \"2,4\";\"-0,120\";\"-0,147\"\r\n\"3,0\";\"-0,150\";\"-0,129\"\r\n";

fn latin1(text: &str) -> Vec<u8> {
    text.chars().map(|character| u8::try_from(u32::from(character)).unwrap()).collect()
}

fn assert_is_the_curve(record: &Record) {
    let close = |a: &[f64], b: &[f64]| {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).for_each(|(a, b)| assert!((a - b).abs() < 1e-9, "{a} {b}"));
    };
    close(&record.displacement_mm, &[0.0, 0.05, 0.1, 0.12, 0.15]);
    close(&record.force_n, &[0.0, 80.0, 140.0, 147.0, 129.0]);
}

#[test]
fn an_export_is_read_as_it_is_and_says_how() {
    let record = read(&latin1(BLUEHILL), "").unwrap();
    assert_is_the_curve(&record);
    assert_eq!(record.time_s, Some(vec![0.0, 1.0, 2.0, 2.4, 3.0]));
    for part in [
        "separator ;",
        "decimal comma",
        "Latin-1",
        "6 header lines",
        "displacement in mm (\"Weg\")",
        "load in kN (\"Kraft\")",
        "time in s",
        "compression negative",
        "displacement negative",
    ] {
        assert!(record.understood.contains(part), "{part:?}: {}", record.understood);
    }
}

#[test]
fn separators_decimal_signs_encodings_and_units_of_one_curve() {
    let utf16: Vec<u8> = [0xff, 0xfe]
        .into_iter()
        .chain(BLUEHILL.encode_utf16().flat_map(u16::to_le_bytes))
        .collect();
    let tabs = "Extension [mm]\tLoad [N]\n0\t0\n0,05\t80\n0,1\t140\n0,12\t147\n0,15\t129\n";
    let area = std::f64::consts::PI * 6.25;
    let stress = [0.0, 80.0, 140.0, 147.0, 129.0].map(|force| force / area);
    let strain = [0.0, 1.25, 2.5, 3.0, 3.75];
    let rows = strain.iter().zip(&stress).map(|(e, s)| format!("{e},{s}\n"));
    let stress_strain = format!("Strain (%),Stress (MPa)\n{}", rows.collect::<String>());
    let lbf = [0.0, 80.0, 140.0, 147.0, 129.0].map(|force| force / 4.448_221_615_260_5);
    let inches = [0.0, 0.05, 0.1, 0.12, 0.15].map(|u| u / 25.4);
    let rows = inches.iter().zip(&lbf).map(|(u, f)| format!("{u} {f}\n"));
    let imperial = format!("# with blanks\nStroke/in Force/lbf\n{}", rows.collect::<String>());
    let cases: [(&[u8], &str); 8] = [
        (BLUEHILL.as_bytes(), ""),
        (&[b"\xef\xbb\xbf", BLUEHILL.as_bytes()].concat(), ""),
        (&utf16, ""),
        (tabs.as_bytes(), ""),
        (b"displacement_mm,force_kN\r\n0,0\r\n0.05,0.08\r\n0.1,0.14\r\n0.12,0.147\r\n0.15,0.129\r\n", ""),
        (stress_strain.as_bytes(), ""),
        (imperial.as_bytes(), ""),
        (
            b"A;B;C\n0;1;0\n50;1;0\n100;1;0\n120;1;0\n150;1;0\n".as_slice(),
            "displacement = \"A\"\ndisplacement_factor = 0.001\nforce = \"C\"\nforce_unit = \"N\"",
        ),
    ];
    for (i, (bytes, options)) in cases.iter().enumerate() {
        let record = read(bytes, options).unwrap_or_else(|e| panic!("{i}: {e}"));
        if options.is_empty() {
            assert_is_the_curve(&record);
        } else {
            assert!(
                (record.displacement_mm[4] - 0.15).abs() < 1e-12,
                "{:?}",
                record.displacement_mm
            );
        }
    }
}

/// `tests/fixtures/compression.xlsx`: the first sheet has notes, the second the readings in kN, written by openpyxl.
#[test]
fn a_workbook_is_read_from_the_sheet_that_is_named() {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../fixtures/compression.xlsx");
    let options = |text: &str| toml::from_str::<ReadOptions>(text).unwrap();
    let record = Record::read(&file, &options("sheet = \"Readings\""), SIZE).unwrap();
    assert_is_the_curve(&record);
    assert!(record.understood.contains("sheet \"Readings\""), "{}", record.understood);
    let error = Record::read(&file, &options("sheet = \"Data\""), SIZE).unwrap_err();
    assert!(error.help.contains("Notes, Readings"), "{error}");
    let (_dir, file) = write("S-1.xlsx", b"no workbook");
    let error = Record::read(&file, &ReadOptions::default(), SIZE).unwrap_err();
    assert!(error.problem.contains("not a readable workbook"), "{error}");
}

#[test]
fn zeros_are_taken_from_the_first_readings_on_request() {
    let text = "u (mm),F (N)\n0.3,-20\n0.35,60\n0.4,120\n0.42,127\n0.45,109\n";
    let record = read(
        text.as_bytes(),
        "zero_force = true\nzero_displacement = true\ndisplacement = \"u\"\nforce = \"F\"",
    );
    let record = record.unwrap();
    assert_is_the_curve(&record);
    assert!(record.understood.contains("load counted from -20.0000 N"), "{}", record.understood);
}

#[test]
fn mistakes_name_file_line_value_and_fix() {
    let cases: [(&str, &str, &[&str]); 9] = [
        (
            &BLUEHILL.replace("-0,140", "abc"),
            "",
            &["S-1.csv", "line 9, column Kraft = abc", "finite number"],
        ),
        (
            &BLUEHILL.replace("(kN)", "(furlong)"),
            "",
            &["line 5, column Kraft = (furlong)", "kgf", "force_factor"],
        ),
        (
            &BLUEHILL.replace("(kN)", "(mm)"),
            "force = \"Kraft\"",
            &["Kraft = (mm)", "not a unit of force"],
        ),
        (
            "u,F\n0,0\n1,2\n2,3\n",
            "displacement = \"u\"\nforce = \"F\"",
            &["column u: has no unit", "displacement_unit"],
        ),
        (
            &BLUEHILL.replace("Kraft", "Weg"),
            "displacement = \"Wegg\"",
            &["Wegg: is missing", "Did you mean \"Weg\"?"],
        ),
        (
            "Weg (mm);Traversenweg (mm);Kraft (N)\n0;0;0\n1;1;1\n2;2;2\n",
            "",
            &["2 columns may contain the displacement"],
        ),
        (
            "Load (N),Extension (mm)\n0,0,0,0\n80,0,0,05\n140,0,0,1\n",
            "",
            &["line 2", "has 4 fields", "decimal signs"],
        ),
        ("0,0\n0.1,3\n0.2,5\n", "", &["line 1", "no names of columns"]),
        ("nothing\nhere\n", "", &["no line with two numbers"]),
    ];
    for (text, options, parts) in cases {
        let message = read(text.as_bytes(), options).unwrap_err().to_string();
        for part in parts {
            assert!(message.contains(part), "{part:?} is not in {message:?}");
        }
    }
}
