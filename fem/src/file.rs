//! Writing a file so that at every moment there is the whole of it or none.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

/// Writes a file by way of a temporary one beside it, in place of one that is there.
///
/// The content is on the disk before it gets its name, so a program that is killed, or a machine that
/// stops, leaves the file of before or the new one. Several processes may write the same file.
///
/// # Errors
/// What the operating system says.
///
/// # Example
/// ```
/// # let path = std::env::temp_dir().join(format!("fem-doc-file-{}", std::process::id()));
/// fem::write_atomically(&path, b"displacement_mm,force_N\n")?;
/// assert_eq!(std::fs::read(&path)?, b"displacement_mm,force_N\n");
/// # std::fs::remove_file(path)?;
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn write_atomically(path: &Path, content: &[u8]) -> io::Result<()> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut file = temporary_in(folder)?;
    file.write_all(content)?;
    file.as_file().sync_all()?;
    file.persist(path)?;
    // where directories can be opened, make the name durable too
    match File::open(folder) {
        Ok(folder) => folder.sync_all(),
        Err(_) => Ok(()),
    }
}

fn temporary_in(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".").suffix(".partial");
    // as any other new file, not the private one that a temporary file would be
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}
