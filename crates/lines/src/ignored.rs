//! What the system says of the signals of this process.

/// The signals that this process was told to ignore, such as SIGHUP by `nohup`: a bit for each,
/// from the lowest for signal 1. `None` where the system does not tell.
#[must_use]
pub fn ignored_signals() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let set = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    set.and_then(|set| u64::from_str_radix(set.trim(), 16).ok()).unwrap_or(0)
}
