//! Progress reports during a run.

use crate::verbosity::{Verbosity, report, verbosity};
use foldline::contract::Event;
use foldline::diagram::{Branch, Ending, Point, Responses, Shown, SpecialPoint};
use foldline::model::Model;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::collections::HashMap;
use std::io::{IsTerminal, stderr};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Progress on standard error: on a terminal, one live line per branch in progress; otherwise one line per completed
/// branch, and a reminder of those in progress after a period of silence. A quiet command shows nothing.
pub struct Progress {
    lines: MultiProgress,
    terminal: bool,
    parameters: Vec<String>,
    live: Mutex<HashMap<String, Live>>,
    /// Time of the last line.
    said: Mutex<Instant>,
}

/// Longest silence without a terminal: eight seconds, so that with the delays of both ticks a line comes at least every
/// ten.
const SILENCE: Duration = Duration::from_secs(8);

struct Live {
    bar: ProgressBar,
    points: usize,
    special: usize,
    ends: Vec<Ending>,
    /// Its last position.
    place: String,
    since: Instant,
    /// Time when the first cell of a map was done.
    began: Option<Instant>,
}

impl Live {
    fn moved(&mut self, place: String) {
        self.bar.set_message(place.clone());
        self.bar.tick();
        (self.place, self.since) = (place, Instant::now());
    }

    fn still(&self, name: &str) -> String {
        let seconds = self.since.elapsed().as_secs();
        let since = if seconds > 1 { format!(", no new point for {seconds} s") } else { String::new() };
        format!("still at {name}: {}{since}", self.place.trim())
    }
}

impl Progress {
    pub fn new(model: &Model) -> Progress {
        let terminal = stderr().is_terminal();
        Progress {
            lines: MultiProgress::with_draw_target(target(terminal)),
            terminal,
            parameters: model.parameters.iter().map(|p| p.name.clone()).collect(),
            live: Mutex::new(HashMap::new()),
            said: Mutex::new(Instant::now()),
        }
    }

    pub fn show(&self, event: Event) {
        match event {
            Event::Begin(branch) => self.begin(branch),
            Event::Point(branch, point) => self.with(branch, |live| {
                live.points += 1;
                live.moved(self.place(branch, point, live));
            }),
            Event::Special(branch, special) => {
                self.with(branch, |live| live.special += 1);
                self.special(branch, special);
            }
            Event::SideEnded(branch, _, ending) => self.with(branch, |live| live.ends.push(ending.clone())),
            Event::End(branch) => self.end(branch),
            Event::Note(branch, note) | Event::Short(branch, note) => self.say(&format!("{branch}: {note}")),
            Event::Visited(name, value, done, of) => self.visited(name, value, done, of),
            Event::Responses(set) => self.responses(set),
            Event::Mapped(cell, done, of) => self.mapped(&cell.map, done, of),
            Event::Design(design) => {
                let how = if design.answered() { "answered" } else { "not answered" };
                self.say(&format!("{}: {how}", design.name));
            }
        }
    }

    /// Reports a special point if the command is verbose.
    fn special(&self, branch: &Branch, special: &SpecialPoint) {
        if verbosity() == Verbosity::Verbose {
            let form = special.normal_form();
            let form = if form.is_empty() { form } else { format!(", {form}") };
            let at = self.parameters_at(branch, &special.point).join(", ");
            self.say(&format!("{}: {} at {at}{form}", branch.name, special.kind));
        }
    }

    fn begin(&self, branch: &Branch) {
        let live = self.line(&branch.name, branch.points.len(), branch.special.len());
        self.live.lock().unwrap_or_else(PoisonError::into_inner).insert(branch.name.clone(), live);
    }

    fn line(&self, name: &str, points: usize, special: usize) -> Live {
        let bar = self.lines.add(ProgressBar::new_spinner());
        if let Ok(style) = ProgressStyle::with_template("{spinner} {prefix:28!} {wide_msg}") {
            bar.set_style(style);
        }
        bar.set_prefix(name.to_string());
        Live { bar, points, special, ends: Vec::new(), place: "starting".into(), since: Instant::now(), began: None }
    }

    /// Shows the live line of a survey or sweep from its first value on.
    fn visited(&self, name: &str, value: f64, done: usize, of: usize) {
        let mut live = self.live.lock().unwrap_or_else(PoisonError::into_inner);
        let line = live.entry(name.to_string()).or_insert_with(|| self.line(name, 0, 0));
        line.moved(format!("{done:>5} of {of} values   at {:.6}", Shown(value)));
    }

    /// Shows the live line of a map, with an estimate of the time left from the mean time of its cells so far.
    fn mapped(&self, name: &str, done: usize, of: usize) {
        let mut live = self.live.lock().unwrap_or_else(PoisonError::into_inner);
        let line = live.entry(name.to_string()).or_insert_with(|| self.line(name, 0, done.saturating_sub(1)));
        // The number of cells known before, and the time when the first of the others was done.
        let (before, began) = (line.special, *line.began.get_or_insert_with(Instant::now));
        let own = done.saturating_sub(before + 1);
        let left = match own {
            0 => String::new(),
            _ => {
                let seconds = began.elapsed().as_secs_f64() / own as f64 * of.saturating_sub(done) as f64;
                format!("   about {} left", in_words(seconds))
            }
        };
        line.moved(format!("{done:>5} of {of} cells{left}"));
        if done < of {
            return;
        }
        if let Some(line) = live.remove(name) {
            line.bar.finish_and_clear();
        }
        drop(live);
        self.say(&format!("{name:<28} {done:>5} cells"));
    }

    fn responses(&self, set: &Responses) {
        if let Some(live) = self.live.lock().unwrap_or_else(PoisonError::into_inner).remove(&set.name) {
            live.bar.finish_and_clear();
        }
        self.say(&format!("{:<28} {:>5} responses from the {}", set.name, set.responses.len(), set.search.name()));
    }

    fn with(&self, branch: &Branch, change: impl FnOnce(&mut Live)) {
        if let Some(live) = self.live.lock().unwrap_or_else(PoisonError::into_inner).get_mut(&branch.name) {
            change(live);
        }
    }

    fn place(&self, branch: &Branch, point: &Point, live: &Live) -> String {
        let at: Vec<String> = self.parameters_at(branch, point).into_iter().map(|text| format!("{text:<18}")).collect();
        let special = if live.special > 0 { format!(", {} special", live.special) } else { String::new() };
        format!("{:>5} points{special}   {} step size {:.1e}", live.points, at.join(" "), point.step)
    }

    /// Parameters that vary along a branch, with their values at a point.
    fn parameters_at(&self, branch: &Branch, point: &Point) -> Vec<String> {
        let at = |index: usize| {
            let name = self.parameters.get(index).map_or("", String::as_str);
            format!("{name} = {:.6}", Shown(point.parameters.get(index).copied().unwrap_or(f64::NAN)))
        };
        [Some(branch.free), branch.held.map(|(_, follows)| follows)].into_iter().flatten().map(at).collect()
    }

    fn end(&self, branch: &Branch) {
        let live = self.live.lock().unwrap_or_else(PoisonError::into_inner).remove(&branch.name);
        let Some(live) = live else { return };
        live.bar.finish_and_clear();
        // Sides that ended in an earlier run have already been reported.
        let known: Vec<&Ending> = branch.ends.iter().flatten().collect();
        let known = if known.is_empty() { live.ends.iter().collect() } else { known };
        let text = |end: &&Ending| match verbosity() {
            Verbosity::Verbose => end.to_string().replace('\n', "\n  "),
            Verbosity::Normal | Verbosity::Quiet => end.brief(),
        };
        let mut ends: Vec<String> = known.iter().map(text).collect();
        ends.dedup();
        if ends.is_empty() {
            ends.push("unfinished".into());
        }
        self.say(&format!(
            "{:<28} {:>5} points, {} special: {}",
            branch.name,
            live.points,
            live.special,
            ends.join("; ")
        ));
    }

    /// Reports the branches in progress after a period of silence.
    pub fn remind(&self) {
        let quiet = self.said.lock().unwrap_or_else(PoisonError::into_inner).elapsed() >= SILENCE;
        if self.terminal || !quiet {
            return;
        }
        let lines: Vec<String> = {
            let live = self.live.lock().unwrap_or_else(PoisonError::into_inner);
            let mut lines: Vec<String> = live.iter().map(|(name, live)| live.still(name)).collect();
            lines.sort();
            lines
        };
        match lines.is_empty() {
            true => self.say("searching for starting solutions"),
            false => lines.iter().for_each(|line| self.say(line)),
        }
    }

    /// Removes the live lines.
    pub fn finish(&self) {
        let mut live = self.live.lock().unwrap_or_else(PoisonError::into_inner);
        live.drain().for_each(|(_, line)| line.bar.finish_and_clear());
    }

    /// Prints a line that stays.
    fn say(&self, line: &str) {
        *self.said.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
        // A failure to show progress must not stop the computation.
        let _ = if self.terminal { self.lines.println(line) } else { report(line) };
    }
}

/// A time in words, to two digits.
fn in_words(seconds: f64) -> String {
    match seconds {
        s if s < 100.0 => format!("{s:.0} s"),
        s if s < 6000.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.0} h", s / 3600.0),
    }
}

/// Target of the live lines: standard error if it is a terminal and the command is not quiet.
fn target(terminal: bool) -> ProgressDrawTarget {
    match terminal && verbosity() != Verbosity::Quiet {
        true => ProgressDrawTarget::stderr(),
        false => ProgressDrawTarget::hidden(),
    }
}

/// Sign of life during a long silent step: a live line on a terminal, otherwise a line after a period of silence. It
/// ends when dropped.
pub struct SignOfLife {
    bar: ProgressBar,
    terminal: bool,
    /// Time of the last line.
    said: Arc<Mutex<Instant>>,
    /// Dropped to end the thread.
    ended: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl SignOfLife {
    /// Interval between checks of the clock; short compared with the silence allowed.
    const TICK: Duration = Duration::from_millis(500);

    /// Starts to report `what` is being done, such as `verifying`.
    pub fn of(what: &str) -> SignOfLife {
        let terminal = stderr().is_terminal();
        let bar = ProgressBar::with_draw_target(None, target(terminal));
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} {elapsed}") {
            bar.set_style(style);
        }
        bar.set_message(what.to_string());
        let start = Instant::now();
        let said = Arc::new(Mutex::new(start));
        let mut own = SignOfLife { bar, terminal, said: Arc::clone(&said), ended: None, thread: None };
        if terminal {
            own.bar.enable_steady_tick(SignOfLife::TICK);
            return own;
        }
        let (ended, over) = channel();
        let what = what.to_string();
        own.ended = Some(ended);
        own.thread = Some(std::thread::spawn(move || {
            while over.recv_timeout(SignOfLife::TICK) == Err(RecvTimeoutError::Timeout) {
                let mut said = said.lock().unwrap_or_else(PoisonError::into_inner);
                if said.elapsed() >= SILENCE {
                    *said = Instant::now();
                    // A failure to show progress must not stop the computation.
                    let _ = report(format_args!("{what}: {} s so far", start.elapsed().as_secs()));
                }
            }
        }));
        own
    }

    /// Prints a line that stays.
    pub fn say(&self, line: &str) {
        *self.said.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
        // A failure to show progress must not stop the computation.
        let _ = if self.terminal { self.bar.suspend(|| report(line)) } else { report(line) };
    }
}

impl Drop for SignOfLife {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        drop(self.ended.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
