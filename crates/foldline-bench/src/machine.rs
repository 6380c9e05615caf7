//! Machine, date and source version of a report.

use crate::workplace::Workplace;
use std::process::Command;

/// Returns a Markdown list that describes the machine and the source version.
pub fn described(place: &Workplace) -> String {
    let said = |program: &str, arguments: &[&str]| {
        let out = Command::new(program).args(arguments).current_dir(&place.root).output();
        out.map_or(String::new(), |out| String::from_utf8_lossy(&out.stdout).trim().to_string())
    };
    let processors = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let field = |name: &str| {
        let line = processors.lines().find(|line| line.starts_with(name));
        line.and_then(|line| line.split_once(':')).map_or("unknown", |(_, value)| value.trim()).to_string()
    };
    let flags = field("flags");
    let wanted = ["sse4_2", "avx", "fma", "avx2", "avx512f"];
    let sets: Vec<&str> = wanted.into_iter().filter(|set| flags.split(' ').any(|flag| flag == *set)).collect();
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let changed = if said("git", &["status", "--porcelain"]).is_empty() { "" } else { ", with changes not committed" };
    format!(
        "* processor: {}, {cores} cores, {}\n* load when it began: {} (above 1 others used the machine in the minute before, or it was being built on)\n* {}, release \
         build\n* commit {}{changed}\n",
        field("model name"),
        sets.join(" "),
        load.split(' ').next().unwrap_or("unknown"),
        said("rustc", &["--version"]),
        said("git", &["rev-parse", "--short", "HEAD"]),
    )
}

/// Returns today's date in the form 2026-03-01.
pub fn date() -> Option<String> {
    let out = Command::new("date").arg("+%F").output().ok()?;
    Some(String::from_utf8_lossy(&out.stdout).trim().to_string()).filter(|date| date.len() == 10)
}
