//! Reading of exports of testing machines, without and with mistakes.

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
    let utf16_without_mark: Vec<u8> = BLUEHILL.encode_utf16().flat_map(u16::to_be_bytes).collect();
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
    let cases: [(&[u8], &str); 10] = [
        (BLUEHILL.as_bytes(), ""),
        (&[b"\xef\xbb\xbf", BLUEHILL.as_bytes()].concat(), ""),
        (&utf16, ""),
        (&utf16[2..], ""),
        (&utf16_without_mark, "encoding = \"utf-16\""),
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

/// `tests/fixtures/clock-times.xlsx`: times in cells with the format of a clock time, which a workbook stores in days.
#[test]
fn times_of_a_workbook_are_clock_times() {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../fixtures/clock-times.xlsx");
    let record = Record::read(&file, &ReadOptions::default(), SIZE).unwrap();
    assert_is_the_curve(&record);
    let times = record.time_s.unwrap();
    for (time, expected) in times.iter().zip([0.0, 110.0, 220.0, 264.0, 330.0]) {
        assert!((time - times[0] - expected).abs() < 1e-4, "{times:?}");
    }
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

/// Lines after the readings are omitted if they start with a word. Other lines are errors. `stop_at` ends the readings.
#[test]
fn readings_end_before_the_summary_of_the_machine() {
    let summary = "\"Maximum\";\"-0,150\";\"-0,147\"\r\n\r\nEnde der Prüfung\r\n";
    let record = read(&latin1(&format!("{BLUEHILL}{summary}")), "").unwrap();
    assert_is_the_curve(&record);
    let omitted = "2 lines after the readings omitted, from line 12 (\"Maximum\")";
    assert!(record.understood.contains(omitted), "{}", record.understood);

    // rows of numbers after the readings could be further readings
    let results = "Results\r\n1;-0,150;-0,147\r\n";
    let text = latin1(&format!("{BLUEHILL}{results}"));
    let error = read(&text, "").unwrap_err();
    assert!(error.to_string().contains("line 12") && error.help.contains("stop_at"), "{error}");
    let record = read(&text, "stop_at = \"results\"").unwrap();
    assert_is_the_curve(&record);
    assert!(record.understood.contains("2 lines after the readings"), "{}", record.understood);
    // a file that does not contain the text of `stop_at` is read to its end
    let record = read(&latin1(BLUEHILL), "stop_at = \"results\"").unwrap();
    assert_is_the_curve(&record);
    assert!(!record.understood.contains("after the readings"), "{}", record.understood);
    // a last row without a force is an error, and not a summary after the readings
    let error = read(&latin1(&BLUEHILL.replace("-0,129", "n/a")), "").unwrap_err();
    assert!(error.to_string().contains("line 11, column Kraft = n/a"), "{error}");
}

#[test]
fn separators_of_thousands_are_recognised_unless_they_may_be_decimal_signs() {
    let newtons = [0.0, 800.5, 1400.25, 1470.0, 1290.0];
    let assert_read = |text: &str, options: &str| {
        let record = read(text.as_bytes(), options).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert_eq!(record.force_n, newtons, "{text}");
    };
    let table = |header: &str, rows: [[&str; 2]; 5], separator: &str| {
        let rows = rows.map(|row| row.join(separator) + "\n").concat();
        format!("{}\n{rows}", header.replace(';', separator))
    };
    let header = "Extension (mm);Load (N)";
    let u = ["0.00", "0.05", "0.10", "0.12", "0.15"];
    let with = |u: [&'static str; 5], f: [&'static str; 5]| [0, 1, 2, 3, 4].map(|i| [u[i], f[i]]);
    let point = with(u, ["0", "800.5", "1,400.25", "1,470", "1,290"]);
    assert_read(&table(header, point, "\t"), "");
    let swiss = with(u, ["0", "800.5", "1'400.25", "1'470", "1'290"]);
    assert_read(&table(header, swiss, ";"), "");
    let u_comma = ["0,00", "0,05", "0,10", "0,12", "0,15"];
    let comma = with(u_comma, ["0", "800,5", "1.400,25", "1.470", "1.290"]);
    assert_read(&table(header, comma, ";"), "");
    let french = with(u_comma, ["0", "800,5", "1\u{202f}400,25", "1\u{a0}470", "1 290,0"]);
    assert_read(&table(header, french, ";"), "");

    // no cell shows which of the two signs is the decimal sign
    let microns = ["0", "50", "100", "120", "150"];
    let unclear = with(microns, ["0", "800", "1,400", "1,470", "1,290"]);
    let text = table("Extension (µm);Load (N)", unclear, ";");
    let error = read(text.as_bytes(), "").unwrap_err();
    let message = error.to_string();
    assert!(message.contains("column 2 = 1,400") && message.contains("decimal = "), "{message}");
    let record = read(text.as_bytes(), "decimal = \".\"").unwrap();
    assert_eq!(record.force_n, [0.0, 800.0, 1400.0, 1470.0, 1290.0]);
}

/// Times in several units and as clock times. A column of times that cannot be read is an error, and so are two columns
/// of times.
#[test]
fn columns_of_times_are_read_or_refused() {
    let with = |name: &str, times: [&str; 5]| {
        let readings = ["0;0", "0.05;80", "0.1;140", "0.12;147", "0.15;129"];
        let rows = times.iter().zip(readings).map(|(time, rest)| format!("{time};{rest}\n"));
        format!("{name};Displacement (mm);Load (N)\n{}", rows.collect::<String>())
    };
    let clock = ["00:00", "01:50", "03:40", "04:24", "05:30"];
    for (text, options) in [
        (with("Time (s)", ["0", "110", "220", "264", "330"]), ""),
        (with("Time", ["0", "110", "220", "264", "330"]), "time_unit = \"s\""),
        (with("Time (mm:ss)", clock), ""),
        (with("Zeit", clock), ""),
        (with("Time", clock.map(|c| if c == "00:00" { "0:00:00.0" } else { c })), ""),
        (with("Clock", clock), "time = \"Clock\""),
    ] {
        let record = read(text.as_bytes(), options).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert_is_the_curve(&record);
        assert_eq!(record.time_s, Some(vec![0.0, 110.0, 220.0, 264.0, 330.0]), "{text}");
        assert!(record.understood.contains("time in "), "{}", record.understood);
    }
    let hours = with("Time (hh:mm)", ["10:00", "10:01", "10:02", "10:03", "10:04"]);
    let record = read(hours.as_bytes(), "").unwrap();
    assert_eq!(record.time_s.unwrap()[4], 36_240.0);
    let twice = with("Time (s);Cycle time (s)", ["0;0", "1;1", "2;2", "3;3", "4;4"]);
    for (text, fragments) in [
        (
            with("Time", ["0", "1", "2", "3", "4"]),
            ["column Time: has no unit", "time_unit = \"s\""],
        ),
        (with("Time (furlong)", ["0", "1", "2", "3", "4"]), ["unknown unit", "time_unit"]),
        (with("Time (s)", ["0", "1", "x", "3", "4"]), ["line 4, column Time (s) = x", "time_unit"]),
        (
            with("Time (s)", ["a", "b", "c", "d", "e"]),
            ["line 2, column Time (s) = a", "time = \"\""],
        ),
        (with("Time", ["00:00", "00:01", "2", "00:03", "00:04"]), ["clock time", "time = \"\""]),
        (twice, ["2 columns may contain the time", "time = \"Time (s)\""]),
    ] {
        let message = read(text.as_bytes(), "").unwrap_err().to_string();
        for fragment in fragments {
            assert!(message.contains(fragment), "{fragment:?} is not in {message:?}");
        }
        let record = read(text.as_bytes(), "time = \"\"").unwrap();
        assert_is_the_curve(&record);
        assert_eq!(record.time_s, None);
    }
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
    for (text, options, fragments) in cases {
        let message = read(text.as_bytes(), options).unwrap_err().to_string();
        for fragment in fragments {
            assert!(message.contains(fragment), "{fragment:?} is not in {message:?}");
        }
    }
}
