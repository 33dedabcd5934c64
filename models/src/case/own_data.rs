//! The supplied example of measured specimens, which `breccia init --own-data` writes.

use super::Case;

/// Path of a file within the example's folder, with the contents of the file.
macro_rules! example {
    ($name:literal) => {
        ($name, include_str!(concat!("../../cases/own-data/", $name)))
    };
}

impl Case {
    /// A case for measured specimens, its specimen table and five curves: path within the folder and contents of each
    /// file.
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
