//! Processor time and memory of this process, from Linux; not a number on other systems.

/// Clock ticks in a second, as Linux reports them on all of its usual processors.
const TICKS: f64 = 100.0;

/// Processor seconds of all threads so far.
pub(crate) fn processor_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // the name of the program, in brackets, may contain spaces
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    let ticks: Vec<f64> = fields.skip(11).take(2).filter_map(|field| field.parse().ok()).collect();
    if ticks.len() == 2 { ticks.iter().sum::<f64>() / TICKS } else { f64::NAN }
}

/// Memory in use (bytes); the peak is measured from here on.
pub(crate) fn restart_peak() -> f64 {
    // a system that refuses leaves the peak of the whole process
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    of_status("VmRSS:")
}

/// Peak of the memory in use (bytes).
pub(crate) fn peak() -> f64 {
    of_status("VmHWM:")
}

fn of_status(key: &str) -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(key));
    let kilobytes = line.and_then(|rest| rest.split_whitespace().next()?.parse::<f64>().ok());
    kilobytes.map_or(f64::NAN, |count| 1024.0 * count)
}
