//! Checks of `[machine]`.

use super::super::{CaseFile, Mistakes};

impl CaseFile {
    pub(super) fn check_machine(&self, mistakes: &mut Mistakes) {
        let machine = self.case.machine;
        if let Some(compliance) = machine.compliance_mm_per_n {
            let help = "It is the displacement of the crosshead per force without specimen: 1e-5 mm/N is usual.";
            let key = "machine.compliance_mm_per_n";
            mistakes.note(self.within(key, compliance, 0.0, 1.0, "mm/N", help));
        }
        if let Some(offset_n) = machine.force_offset_n {
            let help =
                "It is the force that the load cell shows without load, compression positive.";
            mistakes.note(self.within("machine.force_offset_n", offset_n, -1e6, 1e6, "N", help));
        }
    }
}
