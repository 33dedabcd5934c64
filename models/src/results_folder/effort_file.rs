//! `effort.csv`: computing effort of the load steps of a simulation, continued when the simulation is resumed.

use std::path::Path;

use fem::CurvePoint;

const HEADER: &str = "step,newton,linear,processor_s,memory_GB";

/// Content of `effort.csv`: a row per load step with its Newton and linear iterations, the processor seconds since the
/// previous step, and the peak memory of the program so far in GB. For the first step after the program was started or
/// resumed, the seconds include the set-up. Seconds and memory depend on the machine; they are empty if the operating
/// system does not provide them.
#[derive(Default)]
pub(crate) struct EffortFile {
    rows: Vec<String>,
    before_s: f64,
}

impl EffortFile {
    /// Reads the rows of an earlier part of the simulation from `file`, for the first `steps` steps.
    pub(crate) fn resumed(&mut self, file: &Path, steps: usize) {
        let text = fem::read_regular_text(file).unwrap_or_default();
        self.rows = text.lines().skip(1).take(steps).map(str::to_owned).collect();
    }

    /// Adds the row of a load step and returns the content of the file.
    pub(crate) fn push(&mut self, step: usize, point: &CurvePoint) -> String {
        let spent = processor_s();
        let seconds = spent.map_or(String::new(), |s| format!("{:.2}", s - self.before_s));
        let memory = peak_memory_gb().map_or(String::new(), |gb| format!("{gb:.3}"));
        self.before_s = spent.unwrap_or(0.0);
        let CurvePoint { newton, linear, .. } = point;
        self.rows.push(format!("{step},{newton},{linear},{seconds},{memory}"));
        format!("{HEADER}\n{}\n", self.rows.join("\n"))
    }
}

/// Processor seconds of all threads of this process, including threads that have ended.
fn processor_s() -> Option<f64> {
    const TICKS_PER_S: f64 = 100.0;
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // skip the fields up to the program name, which is in brackets and may contain spaces
    let mut fields = text.rsplit(')').next()?.split_whitespace().skip(11);
    let [user, system] = [fields.next()?, fields.next()?].map(|x| x.parse::<f64>().ok());
    Some((user? + system?) / TICKS_PER_S)
}

/// Peak memory of this process, GB.
fn peak_memory_gb() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(1024.0 * kilobytes / 1e9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_later_sitting_goes_on_behind_the_steps_that_it_keeps() {
        let dir = tempfile::tempdir().unwrap();
        let point = |newton| CurvePoint { newton, linear: 2 * newton, ..CurvePoint::default() };
        let file = dir.path().join("effort.csv");
        let mut first = EffortFile::default();
        (1..=3).for_each(|step| {
            std::fs::write(&file, first.push(step, &point(step as u32))).unwrap();
        });
        let mut second = EffortFile::default();
        second.resumed(&file, 2);
        let text = second.push(3, &point(7));
        let rows: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
        assert_eq!(rows[0].join(","), HEADER);
        assert_eq!(
            rows[1..].iter().map(|r| r[..3].join(",")).collect::<Vec<_>>(),
            ["1,1,2", "2,2,4", "3,7,14"]
        );
        for row in &rows[1..] {
            assert_eq!(row.len(), 5);
            if cfg!(target_os = "linux") {
                assert!(row[3].parse::<f64>().unwrap() >= 0.0, "{row:?}");
                let memory: f64 = row[4].parse().unwrap();
                assert!(memory > 0.001 && memory < 1000.0, "{row:?}");
            }
        }
    }
}
