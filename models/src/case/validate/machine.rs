//! Checks of `[machine]`.

use super::super::{CaseFile, Mistakes};

/// Checks compliance and force offset of the testing machine.
pub(super) fn check_machine(file: &CaseFile, mistakes: &mut Mistakes) {
    let machine = file.case.machine;
    if let Some(compliance) = machine.compliance_mm_per_n {
        let help = "It is the displacement of the crosshead per force without specimen: 1e-5 mm/N is usual.";
        let key = "machine.compliance_mm_per_n";
        mistakes.note(file.within(key, compliance, 0.0, 1.0, "mm/N", help));
    }
    if let Some(offset_n) = machine.force_offset_n {
        let help = "It is the force that the load cell shows without load, compression positive.";
        mistakes.note(file.within("machine.force_offset_n", offset_n, -1e6, 1e6, "N", help));
    }
}
