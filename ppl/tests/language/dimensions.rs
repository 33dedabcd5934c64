//! Named dimensions and labels, from the model to the Zarr store that ArviZ opens.

use std::path::Path;

use ppl::prelude::*;
use ppl::{LabelError, ModelError};
use serde_json::{Value, json};

ppl::model! {
    fn schools(names: &[&str], years: std::ops::Range<u32>, effects: &[f64], holes: &[Option<f64>]) {
        let mu ~ Normal(0.0, 5.0);
        #[dims(year = years.clone())]
        let trend ~ Normal(0.0, 1.0).iid(years.len());
        #[dims(school = names)]
        for (y, hole) in effects.iter().zip(holes) {
            let theta ~ Normal(mu, 1.0);
            #[dims(end)] #[track] let ends = [theta - 1.0, theta + 1.0];
            y ~ Normal(theta, 10.0);
            hole.impute() ~ Normal(theta, 1.0);
        }
        factor(-trend[0].square());
        #[predict]
        #[dims(school)]
        for _ in effects {
            let new ~ Normal(mu, 1.0);
        }
    }

    /// Nested plates, with and without a submodel in the inner plate.
    fn panel(groups: &[&str], years: &[u32], y: &[Vec<f64>], holes: &[[Option<f64>; 2]]) {
        let mu ~ Normal(0.0, 5.0);
        #[dims(group = groups)]
        for (row, holes) in y.iter().zip(holes) {
            let shift ~ Normal(0.0, 1.0);
            #[dims(year = years)]
            for v in row {
                #[dims(end)] #[track] let ends = [mu + shift - v, mu + shift + v];
                v ~ Normal(mu + shift, 1.0);
            }
            let series ~ trend(mu, row);
            for hole in holes {
                hole.impute() ~ Normal(shift, 1.0);
            }
        }
    }

    fn trend(mu: Real, row: &[f64]) -> Real {
        let slope ~ Normal(0.0, 1.0);
        #[dims(year)]
        for w in row {
            w ~ Normal(mu + slope, 1.0);
        }
        slope
    }

    fn two_lengths(ys: &[f64]) {
        #[dims(side)] let a ~ Normal(0.0, 1.0).array::<2>();
        #[dims(side)] let b ~ Normal(0.0, 1.0).array::<3>();
        for y in ys {
            y ~ Normal(a[0], b[0].exp());
        }
    }

    fn wrong_labels(names: &[&str]) {
        #[dims(side = names)] let a ~ Normal(0.0, 1.0).array::<2>();
    }

    fn too_many_names() {
        #[dims(row, column)] let a ~ Normal(0.0, 1.0).array::<2>();
    }

    fn name_of_a_quantity() {
        #[dims(a)] let a ~ Normal(0.0, 1.0).array::<2>();
    }

    /// A submodel whose statements add entries along the plate that calls it.
    fn effect(mu: Real) -> Real {
        let theta ~ Normal(mu, 1.0);
        theta
    }

    fn parts(ys: &[f64]) {
        #[dims(school)]
        for y in ys {
            let part ~ effect(0.0);
            y ~ Normal(part, 1.0);
        }
    }
}

fn array(store: &Path, name: &str) -> Value {
    let text = std::fs::read_to_string(store.join(name).join("zarr.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

fn dims(store: &Path, name: &str) -> Value {
    array(store, name)["dimension_names"].clone()
}

#[test]
fn plates_within_plates_have_a_dimension_each() {
    let y = vec![vec![0.1, 0.2, 0.3], vec![1.1, 1.2, 1.3]];
    let holes = [[None, Some(0.4)], [Some(0.5), None]];
    let model = panel(&["a", "b"], &[2001, 2002, 2003], &y, &holes);
    let posterior = Nuts::default().chains(1).warmup(100).draws(30).seed(1).sample(&model).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("panel.zarr");
    posterior.write_zarr(&store).unwrap();
    for (name, own, shape) in [
        (
            "posterior/ends",
            json!(["chain", "draw", "group", "year", "end"]),
            json!([1, 30, 2, 3, 2]),
        ),
        ("posterior/shift", json!(["chain", "draw", "group"]), json!([1, 30, 2])),
        ("log_likelihood/v", json!(["chain", "draw", "group", "year"]), json!([1, 30, 2, 3])),
        (
            "log_likelihood/series.w",
            json!(["chain", "draw", "group", "year"]),
            json!([1, 30, 2, 3]),
        ),
        ("observed_data/v", json!(["group", "year"]), json!([2, 3])),
        ("unconstrained_posterior/y", json!(["chain", "draw", "coordinate"]), json!([1, 30, 7])),
    ] {
        assert_eq!((dims(&store, name), &array(&store, name)["shape"]), (own, &shape), "{name}");
    }
    let observed = posterior.observed.get("v").unwrap();
    assert_eq!(observed.data, [0.1, 0.2, 0.3, 1.1, 1.2, 1.3]);
    assert_eq!(posterior.loo().unwrap().points.len(), 12 + 2);
    assert_eq!(posterior.trace("ends[1,2,0]").unwrap()[0].len(), 30);

    // rows of unequal length have no second dimension
    let ragged = vec![vec![0.1], vec![1.1, 1.2, 1.3]];
    let error = panel(&["a", "b"], &[2001, 2002, 2003], &ragged, &holes).layout().unwrap_err();
    assert!(error.to_string().contains("`year` has 4 entries in `ends` but 3 labels"), "{error}");
}

#[test]
fn dimensions_and_labels_reach_the_store() {
    let names = ["Choate", "Deerfield"];
    let model = schools(&names, 2001..2004, &[28.0, 8.0], &[None, Some(1.0)]);
    let mut posterior =
        Nuts::default().chains(1).warmup(100).draws(20).seed(1).sample(&model).unwrap();
    posterior.label("ends", 1, &["lower", "upper"]).unwrap();
    posterior.set_units("y", &["points"]).unwrap();
    posterior.set_units("ends", &["points", "1"]).unwrap();
    assert!(posterior.set_units("ends", &["a", "b", "c"]).is_err());
    assert!(posterior.set_units("end", &["a"]).is_err());
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("posterior.zarr");
    posterior.write_zarr(&store).unwrap();

    assert_eq!(dims(&store, "posterior/mu"), json!(["chain", "draw"]));
    assert_eq!(dims(&store, "posterior/trend"), json!(["chain", "draw", "year"]));
    assert_eq!(dims(&store, "posterior/theta"), json!(["chain", "draw", "school"]));
    assert_eq!(dims(&store, "posterior/ends"), json!(["chain", "draw", "school", "end"]));
    assert_eq!(dims(&store, "posterior_predictive/new"), json!(["chain", "draw", "school"]));
    assert_eq!(dims(&store, "posterior_predictive/y"), json!(["chain", "draw", "school"]));
    assert_eq!(dims(&store, "log_likelihood/y"), json!(["chain", "draw", "school"]));
    assert_eq!(dims(&store, "observed_data/y"), json!(["school"]));
    assert_eq!(dims(&store, "prior/theta"), json!(["chain", "draw", "school"]));
    let missing = "hole.missing_dim_0";
    assert_eq!(dims(&store, "posterior/hole.missing"), json!(["chain", "draw", missing]));

    // units: observations and tracked quantities have the declared units, log-likelihoods none
    let units = |name: &str| array(&store, name)["attributes"].clone();
    assert_eq!(units("observed_data/y"), json!({"units": "points"}));
    assert_eq!(units("posterior_predictive/y"), json!({"units": "points"}));
    assert_eq!(units("posterior/ends"), json!({"units": ["points", "1"]}));
    assert_eq!((units("log_likelihood/y"), units("posterior/mu")), (json!({}), json!({})));

    // labels are stored as text, or as integers if all of them are integers
    let text = |name: &str| std::fs::read(store.join(name).join("c/0")).unwrap();
    assert_eq!(array(&store, "posterior/school")["data_type"], "string");
    assert!(text("posterior/school").ends_with(b"\x06\0\0\0Choate\x09\0\0\0Deerfield"));
    assert!(text("posterior/end").ends_with(b"\x05\0\0\0lower\x05\0\0\0upper"));
    assert!(text(&format!("posterior/{missing}")).ends_with(b"\x06\0\0\0Choate"));
    assert_eq!(array(&store, "posterior/year")["data_type"], "int64");
    let years: Vec<u8> = [2001_i64, 2002, 2003].iter().flat_map(|y| y.to_le_bytes()).collect();
    assert_eq!(text("posterior/year"), years);
    // the consolidated metadata of the root include the arrays of labels
    let root = array(&store, "");
    let nodes = &root["consolidated_metadata"]["metadata"];
    assert_eq!(nodes["posterior/school"], array(&store, "posterior/school"));
}

#[test]
fn labels_stand_in_the_table_and_indices_still_find_their_rows() {
    let names = ["Choate", "Deerfield"];
    let model = schools(&names, 2001..2004, &[28.0, 8.0], &[Some(1.0), None]);
    let mut posterior =
        Nuts::default().chains(1).warmup(100).draws(20).seed(1).sample(&model).unwrap();
    let shown = |posterior: &ppl::Posterior| -> Vec<String> {
        posterior.summary().rows.into_iter().map(|row| row.name).collect()
    };
    let rows = [
        "mu",
        "trend[2001]",
        "trend[2002]",
        "trend[2003]",
        "theta[Choate]",
        "ends[Choate,0]",
        "ends[Choate,1]",
        "ends[Deerfield,0]",
        "ends[Deerfield,1]",
        "hole.missing[Deerfield]",
    ];
    let found = shown(&posterior);
    for row in rows {
        assert!(found.iter().any(|name| name == row), "no {row} in {found:?}");
    }
    let summary = posterior.summary();
    assert!(summary.to_string().contains("theta[Deerfield]"));
    let by_index = summary.row("theta[1]").expect("a number of the model");
    assert_eq!(by_index.name, "theta[Deerfield]");
    assert_eq!(summary.row("theta[Deerfield]"), Some(by_index));
    assert_eq!(posterior.trace("theta[Deerfield]"), posterior.trace("theta[1]"));
    assert_eq!(posterior.trace("hole.missing[Deerfield]"), posterior.trace("hole.missing[0]"));
    assert_eq!(posterior.trace("new[Choate]"), posterior.trace("new[0]"), "a prediction");
    assert!(posterior.trace("theta[1]").is_some() && posterior.trace("theta[Eton]").is_none());
    assert!(summary.warnings.iter().any(|f| f.what.contains("theta[")), "{summary}");

    // equal labels distinguish nothing, so the summary shows indices
    posterior.label("ends", 1, &["end", "end"]).unwrap();
    assert!(shown(&posterior).contains(&"ends[Choate,1]".to_owned()));
}

#[test]
fn submodels_stack_along_the_plate_around_them() {
    let model = parts(&[1.0, 2.0]);
    let theta = &model.layout().unwrap().variables[0];
    assert_eq!((theta.name.as_str(), &theta.shape[..]), ("part.theta", &[2][..]));
    assert_eq!(theta.dims, ["school"]);
}

#[test]
fn dimensions_that_do_not_fit_are_errors_of_the_model() {
    let said = |layout: Result<&ppl::Layout, ModelError>| {
        let error = layout.expect_err("the dimensions do not fit");
        assert!(matches!(error, ModelError::Invalid(_)), "{error:?}");
        error.to_string()
    };
    let found = said(two_lengths(&[1.0]).layout());
    assert!(found.contains("`side` has 2 entries in `a` and 3 in `b`"), "{found}");
    let found = said(wrong_labels(&["left"]).layout());
    assert!(found.contains("`side` has 2 entries in `a` but 1 labels"), "{found}");
    let found = said(too_many_names().layout());
    assert!(found.contains("2 named dimension(s)") && found.contains("[2]"), "{found}");
    let found = said(name_of_a_quantity().layout());
    assert!(found.contains("`a` is the name of a quantity and of a dimension"), "{found}");
}

#[test]
fn labels_that_fit_nothing_are_errors() {
    let model = two_schools();
    let mut posterior =
        Nuts::default().chains(1).warmup(50).draws(10).seed(1).sample(&model).unwrap();
    let before = posterior.layout.clone();
    let known = "theta".to_owned();
    assert_eq!(
        posterior.label("tehta", 0, &["a", "b"]),
        Err(LabelError::NoQuantity { name: "tehta".into(), known })
    );
    assert_eq!(
        posterior.label("theta", 1, &["a", "b"]),
        Err(LabelError::NoDimension { name: "theta".into(), dimension: 1, dimensions: 1 })
    );
    let error = posterior.label("theta", 0, &["a"]).unwrap_err();
    assert_eq!(error.to_string(), "dimension `theta_dim_0` has 2 entries in `theta` but 1 labels");
    assert_eq!(posterior.layout, before);
    posterior.label("theta", 0, &["a", "b"]).unwrap();
    assert_eq!(posterior.layout.coordinates["theta_dim_0"], ["a", "b"]);
}

ppl::model! {
    fn two_schools() {
        let theta ~ Normal(0.0, 1.0).array::<2>();
    }
}
