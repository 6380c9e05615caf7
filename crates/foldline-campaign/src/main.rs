//! `foldline-campaign [COUNT] [OPTIONS]`, the program behind `cargo xtask campaign`.

use foldline_campaign::{LIMIT, campaign, cases, drawn, rescaled, rotor, tori};
use std::process::ExitCode;

const USAGE: &str = "foldline-campaign [COUNT] [--random COUNT] [--classical STARTS] [--from NUMBER] [--only TEXT] [--rescaled [DRAWS]] [--tori COUNT] [--verbose]
  COUNT        how many random rotors, 200 if not said
  --random     how many cases of neurons, kinetics, ecology, coupled cells and forced oscillators with random parameters, 240 if
               not said
  --from       number of the first rotor and the first of the random cases
  --classical  starts for each classical problem, 5 if not said
  --only       only cases whose name contains TEXT
  --tolerance  instead of 1e-6
  --rescaled   instead of that: every case once more with each state, each parameter and the time in units of its own, powers
               of ten from 1e-12 to 1e12, DRAWS times (1 if not said)
  --tori       instead of that: COUNT oscillators with random parameters whose tori are compared with simulation, from number --from on
  --limit      seconds for each case, 300 if not said
  --jobs       threads, one for each core if not said
  --verbose    a line for each case
  --trace      every point of every run";

fn main() -> ExitCode {
    match answer() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(3),
        Err(why) => {
            eprintln!("{why}\n{USAGE}");
            ExitCode::from(2)
        }
    }
}

fn answer() -> Result<bool, String> {
    let (mut count, mut from, mut starts, mut random, mut only) = (200usize, 0usize, 5usize, 240usize, String::new());
    let mut limit = LIMIT;
    let mut jobs = std::thread::available_parallelism().map_or(1, |n| n.get());
    let (mut verbose, mut trace, mut tolerance) = (false, false, None);
    let (mut draws, mut quasi) = (None, None);
    let mut rest = std::env::args().skip(1).peekable();
    while let Some(argument) = rest.next() {
        let mut number =
            |what: &str| rest.next().and_then(|text| text.parse().ok()).ok_or_else(|| format!("{what} needs a number"));
        match argument.as_str() {
            "--from" => from = number("--from")?,
            "--rescaled" => {
                let given = rest.next_if(|text| text.parse::<usize>().is_ok());
                draws = Some(given.and_then(|text| text.parse().ok()).unwrap_or(1));
            }
            "--random" => random = number("--random")?,
            "--limit" => limit = std::time::Duration::from_secs(number("--limit")? as u64),
            "--tori" => quasi = Some(number("--tori")?),
            "--jobs" => jobs = number("--jobs")?,
            "--classical" => starts = number("--classical")?,
            "--only" => only = rest.next().ok_or("--only needs a text")?,
            "--tolerance" => tolerance = rest.next().and_then(|t| t.parse().ok()),
            "--verbose" => verbose = true,
            "--trace" => trace = true,
            other => count = other.parse().map_err(|_| format!("{other}: not a number"))?,
        }
    }
    if let Some(count) = quasi {
        let mut report = tori::Report::default();
        for number in from..from + count {
            let own = tori::examine(number);
            if verbose {
                eprintln!("{}: {} tori", tori::case(number).0, own.points);
            }
            own.wrong.iter().chain(&own.other).chain(&own.undecided).for_each(|line| eprintln!("{line}"));
            report.add(own);
        }
        print!("{report}");
        return Ok(report.good());
    }
    let mut all = rotor::rotors(from..from + count);
    all.extend(cases::classical(starts));
    all.extend(drawn::drawn(from..from + random));
    all.iter_mut()
        .zip(std::iter::repeat(tolerance))
        .for_each(|(case, own)| case.tolerance = own.unwrap_or(case.tolerance));
    all.retain(|case| case.name.contains(&only));
    let start = std::time::Instant::now();
    if let Some(draws) = draws {
        let report = rescaled::rescaled(&all, draws, limit, &|report| {
            report.differences.iter().for_each(|line| eprintln!("{line}"));
        });
        print!("{report}");
        return Ok(report.differences.is_empty());
    }
    let report = campaign(&all, jobs, limit, &|index, report| {
        if verbose {
            eprintln!(
                "{:6.1} s  {}: {} branches, {} points",
                start.elapsed().as_secs_f64(),
                all[index].name,
                report.branches,
                report.points
            );
        }
        for line in report.short.iter().chain(&report.differences).chain(&report.unexplained) {
            eprintln!("{line}");
        }
        if trace {
            report.traces.iter().for_each(|text| println!("{text}"));
        }
        for bad in report.honesty.iter().filter(|h| trace && h.multipliers > h.stated_multipliers) {
            println!("{}: multipliers {:.1e}, stated {:.1e}", bad.place, bad.multipliers, bad.stated_multipliers);
        }
        for bad in report.honesty.iter().filter(|h| h.found > h.stated) {
            eprintln!("{}: error {:.1e}, stated {:.1e}", bad.place, bad.found, bad.stated);
        }
    });
    print!("{report}");
    println!("{:.0} s", start.elapsed().as_secs_f64());
    Ok(report.good() && report.shares()[0] >= 0.99 && report.shares()[1] >= 0.9)
}
