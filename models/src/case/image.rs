//! `[specimen.image]`: an image of a specimen, and the settings of its segmentation.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use fem::{ReadOptions, Segmentation};
use schemars::JsonSchema;
use serde::de::value::{MapAccessDeserializer, StringDeserializer};
use serde::de::{DeserializeSeed, IntoDeserializer, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

/// `[specimen.image]`: grey values of a specimen and the settings of their segmentation, or labels supplied by the
/// user.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct ImageCase {
    /// Grey values: a file (multi-page TIFF, MetaImage, NRRD, HDF5) or a folder of slices (TIFF, PNG, BMP). Without
    /// `stack`, `[specimen.scan]` computes the image.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stack: Option<PathBuf>,
    /// Labels instead of grey values: a multi-page TIFF file, or a folder of slices.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub labels: Option<PathBuf>,
    /// Phase of each label; the key `1 to 500` stands for several labels. Without `label_phases`, each label is a
    /// grain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub label_phases: Option<BTreeMap<String, String>>,
    /// Label of the surroundings of the specimen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background: Option<i64>,
    /// Images of further specimens. The runs of the design are distributed over all specimens.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub further_stacks: Option<Vec<PathBuf>>,
    /// Edge of a voxel in mm. Without `voxel_mm`, the edge is read from the tags of the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-9, max = 1e2))]
    pub voxel_mm: Option<f64>,
    /// Number of voxels along the edge of the blocks that are averaged while the file is read.
    #[schemars(range(min = 1, max = 1000))]
    pub bin: usize,
    /// Path of the dataset in HDF5 files.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dataset: Option<String>,
    /// Settings of the segmentation.
    #[serde(flatten)]
    pub segmentation: Segmentation,
}

impl Default for ImageCase {
    fn default() -> Self {
        Self::from_keys(ImageKeys::default(), Segmentation::default())
    }
}

impl ImageCase {
    /// Options for reading the image and further images of the case.
    pub(crate) fn read_options(&self) -> ReadOptions {
        ReadOptions { voxel_mm: self.voxel_mm, bin: self.bin, dataset: self.dataset.clone() }
    }

    fn from_keys(settings: ImageKeys, segmentation: Segmentation) -> Self {
        let ImageKeys {
            stack,
            labels,
            label_phases,
            background,
            further_stacks,
            voxel_mm,
            bin,
            dataset,
        } = settings;
        let bin = bin.unwrap_or(1);
        ImageCase {
            stack,
            labels,
            label_phases,
            background,
            further_stacks,
            voxel_mm,
            bin,
            dataset,
            segmentation,
        }
    }
}

/// Keys of `[specimen.image]` that do not belong to [`Segmentation`].
pub(super) const IMAGE_KEYS: [&str; 8] = [
    "stack",
    "labels",
    "label_phases",
    "background",
    "further_stacks",
    "voxel_mm",
    "bin",
    "dataset",
];

/// Values of the [`IMAGE_KEYS`] that are given in the table.
#[derive(Default)]
struct ImageKeys {
    stack: Option<PathBuf>,
    labels: Option<PathBuf>,
    label_phases: Option<BTreeMap<String, String>>,
    background: Option<i64>,
    further_stacks: Option<Vec<PathBuf>>,
    voxel_mm: Option<f64>,
    bin: Option<usize>,
    dataset: Option<String>,
}

/// Implemented by hand, because the derived code for `flatten` collects the whole table before it reads any value.
/// Error messages would then name the table, but neither the key nor the value.
impl<'de> Deserialize<'de> for ImageCase {
    fn deserialize<D: Deserializer<'de>>(table: D) -> Result<Self, D::Error> {
        table.deserialize_map(Table)
    }
}

struct Table;

impl<'de> Visitor<'de> for Table {
    type Value = ImageCase;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table")
    }

    fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<ImageCase, M::Error> {
        let mut image_keys = ImageKeys::default();
        let others = Others { map, image_keys: &mut image_keys };
        let segmentation = Segmentation::deserialize(MapAccessDeserializer::new(others))?;
        Ok(ImageCase::from_keys(image_keys, segmentation))
    }
}

/// Access to a table without the [`IMAGE_KEYS`]: the deserializer sees only the other keys. The values of the
/// [`IMAGE_KEYS`] are stored in `image_keys` while the table is read.
struct Others<'a, M> {
    map: M,
    image_keys: &'a mut ImageKeys,
}

impl<'de, M: MapAccess<'de>> MapAccess<'de> for Others<'_, M> {
    type Error = M::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        mut seed: K,
    ) -> Result<Option<K::Value>, M::Error> {
        loop {
            match self.map.next_key_seed(KeySeed(seed))? {
                None => return Ok(None),
                Some(Key::Other(key)) => return Ok(Some(key)),
                Some(Key::Stack(again)) => {
                    self.image_keys.stack = Some(self.map.next_value()?);
                    seed = again;
                }
                Some(Key::Labels(again)) => {
                    self.image_keys.labels = Some(self.map.next_value()?);
                    seed = again;
                }
                Some(Key::Phases(again)) => {
                    self.image_keys.label_phases = Some(self.map.next_value()?);
                    seed = again;
                }
                Some(Key::Background(again)) => {
                    self.image_keys.background = Some(self.map.next_value()?);
                    seed = again;
                }
                Some(Key::Further(again)) => {
                    self.image_keys.further_stacks = Some(self.map.next_value()?);
                    seed = again;
                }
                Some(Key::Voxel(again)) => {
                    self.image_keys.voxel_mm = Some(self.map.next_value()?);
                    seed = again;
                }
                Some(Key::Bin(again)) => {
                    self.image_keys.bin = Some(self.map.next_value()?);
                    seed = again;
                }
                Some(Key::Dataset(again)) => {
                    self.image_keys.dataset = Some(self.map.next_value()?);
                    seed = again;
                }
            }
        }
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, M::Error> {
        self.map.next_value_seed(seed)
    }
}

/// A key of the table: one of the [`IMAGE_KEYS`], or a key of [`Segmentation`] (`Other`). For one of the [`IMAGE_KEYS`],
/// the unused seed is returned, so that it can read the next key.
enum Key<K, V> {
    Stack(K),
    Labels(K),
    Phases(K),
    Background(K),
    Further(K),
    Voxel(K),
    Bin(K),
    Dataset(K),
    Other(V),
}

/// Seed that reads a key at its position in the text, so that errors about the key report this position.
struct KeySeed<K>(K);

impl<'de, K: DeserializeSeed<'de>> DeserializeSeed<'de> for KeySeed<K> {
    type Value = Key<K, K::Value>;

    fn deserialize<D: Deserializer<'de>>(self, key: D) -> Result<Self::Value, D::Error> {
        let name = String::deserialize(key)?;
        match name.as_str() {
            "stack" => Ok(Key::Stack(self.0)),
            "labels" => Ok(Key::Labels(self.0)),
            "label_phases" => Ok(Key::Phases(self.0)),
            "background" => Ok(Key::Background(self.0)),
            "further_stacks" => Ok(Key::Further(self.0)),
            "voxel_mm" => Ok(Key::Voxel(self.0)),
            "bin" => Ok(Key::Bin(self.0)),
            "dataset" => Ok(Key::Dataset(self.0)),
            _ => {
                let name: StringDeserializer<D::Error> = name.into_deserializer();
                self.0.deserialize(name).map(Key::Other)
            }
        }
    }
}
