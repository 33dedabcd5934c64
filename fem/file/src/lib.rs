//! Atomic writing of files, and reading of regular files only.

use std::fs::{File, FileType};
use std::io::{self, Read, Write};
use std::path::Path;

/// Writes a file atomically: writes a temporary file in the same folder, then renames it to `path`. An existing file is
/// replaced.
///
/// The content is on the disk before the file is renamed, so a killed program or a machine failure leaves either the
/// old file or the complete new file. Several processes may write the same file.
///
/// # Errors
/// The error of the operating system.
///
/// # Example
/// ```
/// # let path = std::env::temp_dir().join(format!("fem-doc-file-{}", std::process::id()));
/// fem_file::write_atomically(&path, b"displacement_mm,force_N\n")?;
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
    // where the system can open a folder as a file, also write the new name of the file to the disk
    match File::open(folder) {
        Ok(folder) => folder.sync_all(),
        Err(_) => Ok(()),
    }
}

fn temporary_in(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".").suffix(".partial");
    // a temporary file can be read only by its owner by default: give this file the permissions of an ordinary new file
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// Opens a regular file for reading.
///
/// Named pipes and devices are rejected: a program that opens a named pipe waits until another program writes to the
/// pipe, and the data of a device may never end. A symbolic link to a regular file is followed.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] for a named pipe, a socket or a device; otherwise the error of the operating
/// system.
///
/// # Example
/// ```
/// # let path = std::env::temp_dir().join(format!("fem-doc-regular-{}", std::process::id()));
/// std::fs::write(&path, "displacement_mm,force_N\n")?;
/// assert_eq!(fem_file::read_regular(&path)?, b"displacement_mm,force_N\n");
/// # std::fs::remove_file(path)?;
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn open_regular(path: &Path) -> io::Result<File> {
    let kind = std::fs::metadata(path)?.file_type();
    match irregularity(kind) {
        // a folder is not rejected here, because reading it returns a clear error of the operating system
        None => File::open(path),
        Some(what) => {
            let message =
                format!("the path names {what}, not a regular file; copy its content to a file");
            Err(io::Error::new(io::ErrorKind::InvalidInput, message))
        }
    }
}

/// Reads the whole content of a regular file.
///
/// # Errors
/// The errors of [`open_regular`].
pub fn read_regular(path: &Path) -> io::Result<Vec<u8>> {
    let mut content = Vec::new();
    open_regular(path)?.read_to_end(&mut content)?;
    Ok(content)
}

/// Reads the whole content of a regular file as UTF-8 text.
///
/// # Errors
/// The errors of [`open_regular`]; [`io::ErrorKind::InvalidData`] for bytes that are not UTF-8.
pub fn read_regular_text(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    open_regular(path)?.read_to_string(&mut text)?;
    Ok(text)
}

/// Returns the name of a file type that is neither a regular file nor a folder, for messages; `None` for regular files
/// and folders.
fn irregularity(kind: FileType) -> Option<&'static str> {
    if kind.is_file() || kind.is_dir() {
        return None;
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt as _;
        if kind.is_fifo() {
            return Some("a named pipe");
        }
        if kind.is_socket() {
            return Some("a socket");
        }
    }
    Some("a device")
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn pipes_and_devices_are_refused_and_a_link_to_a_file_is_followed() {
        let dir = tempfile::tempdir().unwrap();
        let pipe = dir.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        for (path, what) in [(pipe.as_path(), "a named pipe"), (Path::new("/dev/zero"), "a device")]
        {
            let error = read_regular(path).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
            assert!(error.to_string().contains(what), "{error}");
        }
        let [file, link] = ["file", "link"].map(|name| dir.path().join(name));
        std::fs::write(&file, "text").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        assert_eq!(read_regular_text(&link).unwrap(), "text");
        assert_eq!(
            read_regular(&dir.path().join("none")).unwrap_err().kind(),
            io::ErrorKind::NotFound
        );
    }
}
