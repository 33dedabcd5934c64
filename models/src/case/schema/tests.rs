//! The schema and the reader of cases accept the same keys, names and ranges.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::OnceLock;

use serde_json::{Value, json};

use super::super::target::InelasticConstant;
use super::super::{Case, CaseFile};
use super::validator::check;
use super::{CHANGES, DEFINITIONS, schema_of};

/// Checks the text of a case with the schema.
///
/// # Errors
/// What does not conform to the schema.
pub(crate) fn check_case(text: &str) -> Result<(), String> {
    static SCHEMA: OnceLock<Value> = OnceLock::new();
    let schema = SCHEMA.get_or_init(|| schema_of::<Case>("case"));
    let table: toml::Table = text.parse().map_err(|e: toml::de::Error| e.to_string())?;
    check(schema, schema, &serde_json::to_value(table).expect("JSON"), "")
}

/// Units at the ends of keys, and the same units in descriptions.
const UNITS: [(&str, &str); 14] = [
    ("_n_per_mm", "N/mm"),
    ("_mm_per_n", "mm/N"),
    ("_mpa_s_per_mm", "MPa s/mm"),
    ("_mm_per_s", "mm/s"),
    ("_mpa_s", "MPa s"),
    ("_per_s", "1/s"),
    ("_n_mm", "N mm"),
    ("_n_per_mm3", "N/mm³"),
    ("_mpa", "MPa"),
    ("_mm", "mm"),
    ("_deg", "degree"),
    ("_celsius", "°C"),
    ("_percent", "%"),
    ("_s", " s"),
];

/// Returns the keys whose descriptions are empty or lack the unit that is the end of the key.
pub(crate) fn undescribed(schema: &Value) -> Vec<String> {
    let mut found = Vec::new();
    let mut visit = |place: &str, key: &str, value: &Value| {
        let text = value["description"].as_str().unwrap_or_default();
        let unit = UNITS.into_iter().find(|(end, _)| key.ends_with(end));
        let has_unit = unit.is_none_or(|(_, unit)| {
            [unit, "per cent", " °"].iter().any(|unit| text.contains(unit))
        });
        let reference = value["$ref"].as_str().and_then(|path| schema.pointer(&path[1..]));
        let is_described =
            !text.is_empty() || reference.is_some_and(|to| to["description"].is_string());
        if !(is_described && (text.is_empty() || has_unit)) {
            found.push(format!("{place}.{key}: {text}"));
        }
    };
    visit_properties(schema, "", &mut visit);
    for (name, definition) in schema["definitions"].as_object().into_iter().flatten() {
        visit_properties(definition, name, &mut visit);
    }
    found
}

fn visit_properties(schema: &Value, place: &str, visit: &mut dyn FnMut(&str, &str, &Value)) {
    let properties = schema["properties"].as_object().into_iter().flatten();
    // the only key of a variant needs no description, because the variant has one
    let is_variant = properties.clone().count() == 1 && schema["description"].is_string();
    for (key, value) in properties {
        if !(is_variant && schema["required"] == json!([key])) {
            visit(place, key, value);
        }
        visit_properties(value, &format!("{place}.{key}"), visit);
    }
    for inner in
        ["oneOf", "anyOf", "allOf"].into_iter().filter_map(|key| schema[key].as_array()).flatten()
    {
        visit_properties(inner, place, visit);
    }
    for inner in ["additionalProperties", "items"].into_iter().filter_map(|key| schema.get(key)) {
        visit_properties(inner, place, visit);
    }
}

#[test]
fn every_key_is_described_with_its_unit() {
    assert_eq!(undescribed(&schema_of::<Case>("case")), [""; 0]);
}

#[test]
fn descriptions_are_plain_text() {
    let text = schema_of::<Case>("case").to_string();
    for code in ["](", "[`", "# Example", "`None`", "\"null\""] {
        assert!(
            !text.contains(code),
            "{code}: {:?}",
            text.find(code).map(|at| &text[at.saturating_sub(90)..at + 20])
        );
    }
}

/// Keys and names that the schema allows at one place.
#[derive(Default)]
struct Allowed {
    /// Names of keys and of values.
    words: BTreeSet<String>,
    is_table: bool,
    /// Whether other keys or names are allowed too.
    is_open: bool,
}

/// Collects the allowed words at all places of a schema. The place of an item of a list ends with `[]`.
fn collect(
    root: &Value,
    schema: &Value,
    at: &str,
    inside: &[&str],
    places: &mut BTreeMap<String, Allowed>,
) {
    if let Some(name) = schema["$ref"].as_str().map(|path| path.trim_start_matches(DEFINITIONS)) {
        // keys of `set` are read with the case that they change
        if !name.contains(CHANGES) && !inside.contains(&name) {
            collect(root, &root["definitions"][name], at, &[inside, &[name]].concat(), places);
        }
        return;
    }
    if schema["type"].as_array().is_some_and(|types| types[0] == "array") {
        // the value of a free parameter is not compared
        return;
    }
    let place = places.entry(at.to_owned()).or_default();
    let words = schema["enum"].as_array().into_iter().flatten().chain(schema.get("const"));
    place.words.extend(words.filter_map(Value::as_str).map(str::to_owned));
    place.is_open |= !schema["pattern"].is_null() || !schema["patternProperties"].is_null();
    if let Some(properties) = schema["properties"].as_object() {
        place.is_table = true;
        place.is_open |= schema["additionalProperties"] != json!(false);
        place.words.extend(properties.keys().cloned());
    }
    for (key, inner) in schema["properties"].as_object().into_iter().flatten() {
        collect(root, inner, &format!("{at}.{key}"), inside, places);
    }
    if schema["additionalProperties"].is_object() {
        let name = if at == ".interface" { "matrix-grain" } else { "matrix" };
        collect(root, &schema["additionalProperties"], &format!("{at}.{name}"), inside, places);
    }
    if schema["items"].is_object() {
        collect(root, &schema["items"], &format!("{at}[]"), inside, places);
    }
    for inner in
        ["oneOf", "anyOf", "allOf"].into_iter().filter_map(|key| schema[key].as_array()).flatten()
    {
        collect(root, inner, at, inside, places);
    }
}

/// A case, or a study, that contains only an unknown word at a place.
pub(crate) fn with_unknown_word(place: &str, is_table: bool) -> toml::Table {
    let word = toml::Value::from("zzz");
    let table =
        |key: &str, value| toml::Value::Table([(key.to_owned(), value)].into_iter().collect());
    let mut value = if is_table { table("zzz", 1.into()) } else { word };
    for step in place.split('.').skip(1).collect::<Vec<_>>().into_iter().rev() {
        let key = step.trim_end_matches("[]");
        for _ in 0..step.matches("[]").count() {
            value = toml::Value::Array(vec![value]);
        }
        value = table(key, value);
    }
    match value {
        toml::Value::Table(table) => table,
        _ => unreachable!("a place begins with a key"),
    }
}

/// Compares the words of a schema with the words that `words_of_reader` returns for a file with an unknown word.
pub(crate) fn compare(
    schema: &Value,
    words_of_reader: impl Fn(&str, &toml::Table) -> Option<BTreeSet<String>>,
) {
    let mut places = BTreeMap::new();
    collect(schema, schema, "", &[], &mut places);
    let mut compared = 0;
    for (place, allowed) in places {
        // the keys of `set` are read with the case that they change
        if allowed.is_open || allowed.words.is_empty() || place.ends_with(".set") {
            continue;
        }
        let file = with_unknown_word(&place, allowed.is_table);
        if let Some(words) = words_of_reader(&place, &file) {
            assert_eq!(allowed.words, words, "{place}: words of the schema and of the reader");
            compared += 1;
        }
    }
    assert!(compared >= 4, "{compared} places");
}

#[test]
fn the_schema_has_the_keys_and_names_of_the_reader() {
    let schema = schema_of::<Case>("case");
    compare(&schema, |place, file| {
        // these values may be written in several ways, and the reader's message does not list all of them
        let several = ["between_tests", "hardening.table[]", "read.separator", "read.decimal"];
        let is_inelastic = |table: &&str| place.contains(&format!(".{table}"));
        let is_parameter = !place.starts_with(".material");
        if several.iter().any(|key| place.contains(key))
            || is_parameter && InelasticConstant::TABLES.iter().any(is_inelastic)
        {
            return None;
        }
        let (_, mistakes) = CaseFile::parse_all(&file.to_string(), Path::new("case.toml"));
        let unknown = |problem: &str| problem.starts_with("un") && problem.contains("zzz");
        let mistake = mistakes.iter().find(|mistake| unknown(&mistake.problem));
        let mistake =
            mistake.unwrap_or_else(|| panic!("{place}: {file} is not refused: {mistakes:?}"));
        let text = format!("{} {}", mistake.problem, mistake.help);
        let starts = ["available keys: ", "Keys here: ", "Choose one of: "];
        let list = starts.into_iter().find_map(|start| text.split_once(start));
        let list = list.unwrap_or_else(|| panic!("{place}: {text}")).1;
        let list = list.split(" breccia init").next().unwrap_or_default().trim_end_matches('.');
        let mut words: BTreeSet<String> = list.split(", ").map(str::to_owned).collect();
        if place.starts_with(".interface") {
            // this key is read only to reject it with a helpful message
            words.remove("strength");
        }
        if words.contains("young_mpa") && !place.starts_with(".material") {
            words.extend(InelasticConstant::TABLES.map(str::to_owned));
        }
        Some(words)
    });
}

/// A case with the tables that the default case does not have.
const OTHER: &str = r#"
[specimen]
radius_mm = 2.5
height_mm = 4.4
spacing_mm = 0.7
grains = { fraction = 0.2, seed = 1, sizes = [{ median_radius_mm = 0.5, spread = 0.15, share = 1.0 }] }
[material.matrix]
young_mpa = 275.0
poisson = 0.25
toughness_n_per_mm = 0.0025
viscoelastic.shear = [{ fraction = 0.3, time_s = 0.1 }, { fraction = 0.2, time_s = 1.0 }]
viscoelastic.shift.wlf = { c1 = 17.0, c2_kelvin = 51.0, reference_celsius = 20.0 }
[material.grain]
young_mpa = 2e5
poisson = 0.27
plastic.yield_mpa = 233.2
plastic.hardening.voce = { saturation_mpa = 1101.0, rate = 1.95 }
plastic.rate.johnson-cook = { c = 0.04, reference_per_s = 1e-5 }
plastic.criterion.drucker-prager = { friction_deg = 20.0, dilatancy_deg = 10.0 }
[interface.matrix-grain]
toughness_n_per_mm = 0.001
width_mm = 0.4
[phase_field]
length_mm = 0.06
[test]
temperature_celsius = 50.0
adaptive = { first = 0.01, largest = 0.05 }
program = [{ time_s = 1.0, displacement_mm = 0.1, steps = 4 }, { time_s = 2.0, force_n = 3.0 }]
[machine]
compliance_mm_per_n = 1e-5
force_offset_n = 0.5
[sequential]
share = 0.1
[design]
packings = 10
[prior]
matrix.young_mpa = [250.0, 300.0]
"#;

/// Numbers of a table: their places, and whether they are whole.
fn numbers(value: &toml::Value, at: &str, all: &mut Vec<(String, bool)>) {
    match value {
        toml::Value::Table(table) => {
            table.iter().for_each(|(key, inner)| numbers(inner, &format!("{at}/{key}"), all))
        }
        toml::Value::Array(list) => {
            list.iter().enumerate().for_each(|(k, inner)| numbers(inner, &format!("{at}/{k}"), all))
        }
        toml::Value::Integer(_) => all.push((at.to_owned(), true)),
        toml::Value::Float(_) => all.push((at.to_owned(), false)),
        _ => {}
    }
}

fn with_value(case: &toml::Value, place: &str, new: toml::Value) -> String {
    let mut case = case.clone();
    let mut at = &mut case;
    for key in place.split('/').skip(1) {
        at = match at {
            toml::Value::Array(list) => &mut list[key.parse::<usize>().expect("an index")],
            other => &mut other[key],
        };
    }
    *at = new;
    toml::to_string(&case).expect("a table")
}

/// Bounds that depend on other keys, so that the schema cannot state them.
const DEPENDENT: [&str; 7] = [
    "/design/packings",
    "/fidelity/levels/0/repeats",
    "/further_tests/width90",
    "/experiments/virtual/truth",
    "/prior",
    "/test/program",
    "/material/grain/plastic/criterion/drucker-prager/dilatancy_deg",
];

#[test]
fn the_schema_states_the_ranges_that_the_reader_checks() {
    let (mut missing, mut refused) = (Vec::new(), 0);
    let other = CaseFile::parse(OTHER, Path::new("case.toml")).unwrap();
    for case in [CaseFile::default_case().case, other.case] {
        let case = toml::Value::try_from(&case).unwrap();
        let unchanged = toml::to_string(&case).unwrap();
        assert_eq!(CaseFile::parse_all(&unchanged, Path::new("case.toml")).1, []);
        let mut places = Vec::new();
        numbers(&case, "", &mut places);
        for (place, is_whole) in places {
            let whole = [-1, 0, 1, 100_000, 2_000_000_000].map(toml::Value::from);
            let real = [-1e300, -1e-3, 0.0, 1e13, 1e300].map(toml::Value::from);
            for new in if is_whole { whole } else { real } {
                let text = with_value(&case, &place, new.clone());
                let (_, mistakes) = CaseFile::parse_all(&text, Path::new("case.toml"));
                let of_schema = check_case(&text);
                refused += usize::from(of_schema.is_err());
                // the reader must reject every value that the schema rejects
                assert!(
                    of_schema.is_ok() || !mistakes.is_empty(),
                    "{place} = {new}: {of_schema:?}"
                );
                let key =
                    place.rsplit('/').find(|key| key.parse::<usize>().is_err()).unwrap_or_default();
                let is_range = |text: &str| {
                    ["must be", "must lie", "expected a whole number"]
                        .iter()
                        .any(|part| text.contains(part))
                };
                let range =
                    mistakes.iter().find(|one| one.place.ends_with(key) && is_range(&one.problem));
                if let (Ok(()), Some(mistake)) = (&of_schema, range) {
                    missing.push(format!("{place} = {new}: {}", mistake.problem));
                }
            }
        }
    }
    missing.retain(|one| !DEPENDENT.iter().any(|known| one.starts_with(known)));
    assert_eq!(missing, [""; 0]);
    assert!(refused > 200, "{refused} values");
}

#[test]
fn bad_cases_are_refused_by_reader_and_schema() {
    let default = Case::TEMPLATE;
    for (from, to) in [
        ("radius_mm = 2.5", "radius_mm = \"2.5\""),
        ("radius_mm = 2.5", "radus_mm = 2.5"),
        ("radius_mm = 2.5", "radius_mm = -2.5"),
        ("order = 2", "order = 3"),
        ("fraction = 0.2,", "fraction = 20,"),
        ("fraction = 0.2,", ""),
        ("voxel_mm = 0.05", "voxle_mm = 0.05"),
        ("law = \"hencky\" ", "law = \"henky\" "),
        (
            "law = \"hencky\" ",
            "law = { mooney-rivlin = { c10_mp = 1.0, c01_mpa = 0.1, bulk_mpa = 9.0 } } ",
        ),
        ("length_mm = 0.06", ""),
        ("steps = 44", "steps = 8.5"),
        ("platens = \"sliding\"", "platens = \"slidin\""),
        ("tolerance = 1e-8", "tolerance = 1.0"),
        ("[phase_field]", "[phasefield]"),
        ("[250.0, 300.0]", "[250.0, 300.0, 1.0]"),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "young_mpa = { distribution = \"normal\", mean = 280.0, sd = 3.0 }",
        ),
        ("matrix.young_mpa = [250.0, 300.0]", "matrix.yuong_mpa = [250.0, 300.0]"),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "matrix.young_mpa = { distribution = \"lognorml\", median = 280.0, factor = 1.1 }",
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "matrix.young_mpa = { distribution = \"lognormal\", median = 280.0, sd = 1.1 }",
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "matrix.young_mpa = { distribution = \"normal\", mean = 280.0 }",
        ),
        ("matrix.young_mpa = [250.0, 300.0]", "matrix.young_mpa = { distribution = \"uniform\" }"),
        ("[\"slope\", \"peak-force\"", "[\"slpe\", \"peak-force\""),
        ("rule = \"corrected-loo\"", "rule = \"fixed\""),
        ("chains = 4", "chains = 0"),
        ("# sampling = \"paper\"", "sampling = \"papers\""),
        ("median = true", "median = \"yes\""),
        ("percent = { slope = 1.5", "percent = { slope = 1000.0"),
        ("set.test = { duration_s = 30.0", "set.test = { duration = 30.0"),
        ("set.test = { duration_s = 30.0, displacement_mm = 0.11 }", "set.calibration.draws = 30"),
    ] {
        assert!(default.contains(from), "{from}");
        let text = default.replacen(from, to, 1);
        let reader = CaseFile::parse(&text, Path::new("case.toml"));
        assert!(reader.is_err(), "the reader accepts {to}");
        assert!(check_case(&text).is_err(), "the schema accepts {to}");
    }
    check_case(default).unwrap();
}

#[test]
fn the_schema_accepts_every_way_to_write_a_value() {
    let lines = [
        "specimen.image.label_phases = { \"1 to 500\" = \"grain\" }",
        "specimen.regions = { matrix = 1, grain = [2, \"stones\"] }",
        "material.x.law = { ogden = { terms = [{ mu_mpa = 0.4, alpha = 1.3 }], bulk_mpa = 2.0 } }",
        "material.x.plastic = { yield_mpa = 2, hardening = { table = \"h.csv\" } }",
        "phase_field = { length_mm = 1, drive = [\"elastic\", \"plastic\"] }",
        "conditions = { measure = { surface = \"a\", direction = [0, 0, 1] }, table = [[0.0, 1.0]] }",
        "qoi.quantities = [\"energy_to_peak\", \"force-at-0.05-mm\", \"column:deflection_mm\"]",
        "prior = { k1 = [0, 1], interface.a-b.toughness_n_per_mm = [0, 1], test.friction = [0, 1] }",
        "prior.m.viscoelastic.shear.0 = { fraction = [0.1, 0.2] }",
        "prior.m.plastic = { rate.johnson-cook.c = [0, 1], hardening.voce.rate = [0, 1] }",
        "prior.m.poisson = { distribution = \"beta\", a = 2.0, b = 2, range = [0.1, 0.4] }",
        "surrogate.rule = { fixed = 3 }",
        "calibration = { sampling = \"paper\", between_tests.m.poisson = \"own\" }",
        "calibration.between_tests.m = { poisson = { varies-percent = 5.0 }, young_mpa = { trend = \"rate\" } }",
        "experiments.read = { separator = \"semicolon\", decimal = \"point\", encoding = \"latin-1\" }",
        "tests = [{ name = \"a\", set.experiments.virtual.seed = 2, prior.m.poisson = [0, 0.1] }]",
        "validation = [{ name = \"a\", set.specimen.grains.fraction = 0.1, scatter_percent = { slope = 1 } }]",
    ];
    for line in lines {
        toml::from_str::<Case>(line).unwrap_or_else(|e| panic!("{line}: {e}"));
        check_case(line).unwrap_or_else(|e| panic!("{line}: {e}"));
    }
}
