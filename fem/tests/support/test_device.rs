//! The device on which device tests run.

use fem::ComputeDevice;

/// Returns the first NVIDIA graphics card if `BRECCIA_TEST_DEVICE=cuda`, otherwise this machine as a device. Without a C
/// compiler, prints that the test is skipped and returns `None`.
pub(crate) fn test_device() -> Option<ComputeDevice> {
    if std::env::var("BRECCIA_TEST_DEVICE").is_ok_and(|name| name == "cuda") {
        return Some(ComputeDevice::cuda().expect("BRECCIA_TEST_DEVICE asks for a card"));
    }
    ComputeDevice::host().inspect_err(|error| println!("SKIPPED: {error}")).ok()
}
