//! The shipped example of measured specimens: what `breccia init --own-data` writes.

use super::Case;

/// A file of the example, by its place in the folder.
macro_rules! example {
    ($name:literal) => {
        ($name, include_str!(concat!("../../cases/own-data/", $name)))
    };
}

impl Case {
    /// A case for measured specimens with a table and five curves, each by its place in a folder.
    pub const OWN_DATA: [(&str, &str); 7] = [
        example!("case.toml"),
        example!("specimens.csv"),
        example!("curves/S-01.csv"),
        example!("curves/S-02.csv"),
        example!("curves/S-03.csv"),
        example!("curves/S-04.csv"),
        example!("curves/S-05.csv"),
    ];
}
