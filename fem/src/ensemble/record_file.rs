//! The file of a run: its record, and a checksum of the record.

use std::io;

use serde::{Deserialize, Serialize};

use super::RunRecord;
use crate::problem::Fingerprint;

/// Content of the file of a run.
#[allow(clippy::large_enum_variant)]
pub(super) enum StoredRun {
    /// There is no file.
    Nothing,
    /// The file is a valid record of the run.
    Record(RunRecord),
    /// The file is not a record of this run; the text gives the reason.
    Damaged(String),
    /// The checksum is missing or does not match the record; the text gives the reason.
    Edited(String),
}

/// Whether records without a checksum are accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Checksums {
    /// Every record must have a checksum.
    Required,
    /// A record may lack a checksum, as in files of earlier versions.
    Optional,
}

/// Serialised content of the file of a run.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RecordFile<R> {
    /// FNV-1a hash of the record as compact JSON, 16 hexadecimal digits. The hash does not depend on white space in the
    /// file.
    checksum: String,
    record: R,
}

/// Serialises a record and its checksum as the content of a file.
pub(super) fn to_bytes(record: &RunRecord) -> io::Result<Vec<u8>> {
    let file = RecordFile { checksum: checksum(record)?, record };
    let mut bytes = serde_json::to_vec_pretty(&file)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// Parses the bytes of the file of run `id`.
pub(super) fn parse(bytes: &[u8], id: usize, checksums: Checksums) -> StoredRun {
    let (record, stored) = match serde_json::from_slice::<RecordFile<RunRecord>>(bytes) {
        Ok(RecordFile { checksum, record }) => (record, Some(checksum)),
        Err(error) => match serde_json::from_slice::<RunRecord>(bytes) {
            Ok(record) => (record, None),
            Err(_) => return StoredRun::Damaged(error.to_string()),
        },
    };
    let computed = match checksum(&record) {
        Ok(computed) => computed,
        Err(error) => return StoredRun::Damaged(error.to_string()),
    };
    match stored {
        Some(stored) if stored != computed => StoredRun::Edited(format!(
            "the stored checksum is {stored}, the checksum of the content is {computed}"
        )),
        None if checksums == Checksums::Required => {
            StoredRun::Edited("it has no checksum".to_owned())
        }
        _ if record.id != id => StoredRun::Damaged(format!("it contains run {}", record.id)),
        _ => StoredRun::Record(record),
    }
}

fn checksum(record: &RunRecord) -> io::Result<String> {
    let bytes = serde_json::to_vec(record)?;
    Ok(format!("{:016x}", Fingerprint::new().add(&bytes).value()))
}
