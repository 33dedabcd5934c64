//! Compilation of kernels for graphics cards by NVRTC.

/// Checks that NVRTC compiles the kernels for a graphics card. Skips the check if Python has no NVRTC package.
pub(crate) fn assert_compiles_for_a_card(source: &str) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("kernels.cu");
    std::fs::write(&path, source).expect("it is written");
    let python = std::env::var("BRECCIA_PYTHON").unwrap_or_else(|_| "python3".into());
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../python/nvrtc.py");
    match std::process::Command::new(&python).arg(script).arg(&path).output() {
        Ok(output) if output.status.success() => {}
        Ok(output) if output.status.code() == Some(1) => {
            panic!("{}", String::from_utf8_lossy(&output.stderr));
        }
        _ => println!("SKIPPED: {python} has no NVRTC; set BRECCIA_PYTHON to a Python with NVRTC"),
    }
}
