//! The device that tests compute on.

use fem::ComputeDevice;

/// The first NVIDIA card where `BRECCIA_TEST_DEVICE=cuda` asks for it, otherwise this machine in the place of a
/// card. `None` without a C compiler: the test is skipped and says so.
pub(crate) fn test_device() -> Option<ComputeDevice> {
    if std::env::var("BRECCIA_TEST_DEVICE").is_ok_and(|name| name == "cuda") {
        return Some(ComputeDevice::cuda().expect("BRECCIA_TEST_DEVICE asks for a card"));
    }
    ComputeDevice::host().inspect_err(|error| println!("SKIPPED: {error}")).ok()
}
