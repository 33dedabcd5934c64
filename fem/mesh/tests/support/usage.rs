//! Processor time and memory of this process on Linux; NaN on other systems.

/// Clock ticks per second in `/proc` (100 on all common processors).
const TICKS: f64 = 100.0;

/// Returns the processor time that all threads have used until now (s).
pub(crate) fn processor_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // the program name, in parentheses, may contain spaces
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    let ticks: Vec<f64> = fields.skip(11).take(2).filter_map(|field| field.parse().ok()).collect();
    if ticks.len() == 2 { ticks.iter().sum::<f64>() / TICKS } else { f64::NAN }
}

/// Resets the peak memory of the process and returns the memory in use (bytes).
pub(crate) fn restart_peak() -> f64 {
    // if the system does not allow the reset, `peak` returns the peak since the start of the process
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    of_status("VmRSS:")
}

/// Returns the peak memory since the last reset (bytes).
pub(crate) fn peak() -> f64 {
    of_status("VmHWM:")
}

fn of_status(key: &str) -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(key));
    let kilobytes = line.and_then(|rest| rest.split_whitespace().next()?.parse::<f64>().ok());
    kilobytes.map_or(f64::NAN, |count| 1024.0 * count)
}
