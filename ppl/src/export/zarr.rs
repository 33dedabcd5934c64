//! Minimal subset of Zarr v3 that stores labelled arrays: one chunk per array, no compression.
//!
//! Reference: Zarr core specification 3.0, zarr-specs.readthedocs.io.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

/// Elements of an array, row-major.
pub(super) enum ZarrArray {
    Real(Vec<f64>),
    Integer(Vec<i64>),
    Flag(Vec<bool>),
    Text(Vec<String>),
}

impl ZarrArray {
    fn data_type(&self) -> &'static str {
        match self {
            Self::Real(_) => "float64",
            Self::Integer(_) => "int64",
            Self::Flag(_) => "bool",
            Self::Text(_) => "string",
        }
    }

    fn fill_value(&self) -> Value {
        match self {
            Self::Real(_) => json!("NaN"),
            Self::Integer(_) => json!(0),
            Self::Flag(_) => json!(false),
            Self::Text(_) => json!(""),
        }
    }

    fn codec(&self) -> Value {
        match self {
            Self::Text(_) => json!({"name": "vlen-utf8", "configuration": {}}),
            Self::Flag(_) => json!({"name": "bytes"}),
            _ => json!({"name": "bytes", "configuration": {"endian": "little"}}),
        }
    }

    fn bytes(&self) -> Vec<u8> {
        match self {
            Self::Real(values) => values.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Self::Integer(values) => values.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Self::Flag(values) => values.iter().map(|&x| u8::from(x)).collect(),
            Self::Text(values) => {
                let mut bytes = (values.len() as u32).to_le_bytes().to_vec();
                for text in values {
                    bytes.extend((text.len() as u32).to_le_bytes());
                    bytes.extend(text.as_bytes());
                }
                bytes
            }
        }
    }
}

/// A store to which groups and arrays are written. Their metadata are collected and finally written
/// to the root of the store.
pub(super) struct ZarrStore {
    root: PathBuf,
    metadata: Map<String, Value>,
}

impl ZarrStore {
    pub(super) fn create(root: &Path) -> io::Result<Self> {
        fs::create_dir_all(root)?;
        Ok(Self { root: root.to_owned(), metadata: Map::new() })
    }

    pub(super) fn group(&mut self, name: &str) -> io::Result<()> {
        let attributes = json!({
            "inference_library": "ppl",
            "inference_library_version": env!("CARGO_PKG_VERSION"),
        });
        self.node(name, json!({"zarr_format": 3, "node_type": "group", "attributes": attributes}))
    }

    pub(super) fn array(
        &mut self,
        group: &str,
        name: &str,
        dimensions: &[(String, usize)],
        data: ZarrArray,
    ) -> io::Result<()> {
        self.described(group, name, dimensions, data, json!({}))
    }

    /// Writes an array with attributes.
    pub(super) fn described(
        &mut self,
        group: &str,
        name: &str,
        dimensions: &[(String, usize)],
        data: ZarrArray,
        attributes: Value,
    ) -> io::Result<()> {
        let names: Vec<&str> = dimensions.iter().map(|(name, _)| name.as_str()).collect();
        let shape: Vec<usize> = dimensions.iter().map(|&(_, size)| size).collect();
        let chunk: Vec<usize> = shape.iter().map(|&size| size.max(1)).collect();
        let node = format!("{group}/{name}");
        self.node(
            &node,
            json!({
                "zarr_format": 3,
                "node_type": "array",
                "shape": shape,
                "data_type": data.data_type(),
                "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": chunk}},
                "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
                "fill_value": data.fill_value(),
                "codecs": [data.codec()],
                "attributes": attributes,
                "dimension_names": names,
            }),
        )?;
        if shape.contains(&0) {
            return Ok(());
        }
        // the index of the only chunk is 0 along every dimension: c/0/0
        let mut file = self.root.join(node).join("c");
        file.extend(shape.iter().map(|_| "0"));
        if let Some(folder) = file.parent() {
            fs::create_dir_all(folder)?;
        }
        fs::write(file, data.bytes())
    }

    /// Writes the root with the metadata of all nodes (consolidated metadata), so that a reader can open the store with
    /// one read.
    pub(super) fn finish(self) -> io::Result<()> {
        let root = json!({
            "zarr_format": 3,
            "node_type": "group",
            "attributes": {},
            "consolidated_metadata": {
                "kind": "inline",
                "must_understand": false,
                "metadata": self.metadata,
            },
        });
        fs::write(self.root.join("zarr.json"), to_text(&root)?)
    }

    fn node(&mut self, name: &str, metadata: Value) -> io::Result<()> {
        let folder = self.root.join(name);
        fs::create_dir_all(&folder)?;
        fs::write(folder.join("zarr.json"), to_text(&metadata)?)?;
        self.metadata.insert(name.to_owned(), metadata);
        Ok(())
    }
}

fn to_text(value: &Value) -> io::Result<String> {
    serde_json::to_string_pretty(value).map_err(io::Error::other)
}

/// Writes to a temporary path beside `path` and renames it at the end, so that a reader never finds an incomplete
/// store.
pub(super) fn replace(path: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
    if path.exists() && !path.join("zarr.json").is_file() {
        return Err(io::Error::new(
            io::ErrorKind::AlreadyExists,
            "it exists and is not a Zarr store; remove it or choose another name",
        ));
    }
    let name = path
        .file_name()
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "the path has no file name"))?;
    let mut temporary = name.to_owned();
    temporary.push(".partial");
    let temporary = path.with_file_name(temporary);
    if temporary.exists() {
        fs::remove_dir_all(&temporary)?; // left by a run that was killed
    }
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent)?;
    }
    write(&temporary)?;
    if path.exists() {
        fs::remove_dir_all(path)?;
    }
    fs::rename(temporary, path)
}
