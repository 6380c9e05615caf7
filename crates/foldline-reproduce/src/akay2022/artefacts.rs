//! Solutions of a smoothed contact rotor that exist only because of the smoothing.
//!
//! **Idea.** Every point of a branch is continued in K alone to a much larger K. The points whose curve in K turns back
//! before form stretches; between neighbours that differ, the end of the stretch is found by bisection along the
//! branch. Since a curve may turn back at once from a fold, the branch is tested on both sides of each fold.
//!
//! **Fails when** a stretch is shorter than the distance between two neighbouring points and has no fold.

use super::rotor::{OMEGA, max_r};
use crate::runs::{Run, Runs, Table, in_parallel};
use foldline::diagram::{Branch, Kind, Origin, Point};
use foldline::explore::{Persistence, System, growth, known, persistence};

/// Position of K among the parameters.
pub const SHARPNESS: usize = 6;
/// Maximum number of points of a curve in K.
const MOST: usize = 4000;
/// Distance from a fold at which the branch is tested, as a fraction of the way to the next point.
const BESIDE: f64 = 0.02;
/// Number of halvings of the interval between two points, in Ω.
const HALVINGS: usize = 12;

/// Part of a branch whose points vanish.
#[derive(Clone, Debug, Default)]
pub struct Stretch {
    /// Ω and max r, from end to end.
    pub places: Vec<[f64; 2]>,
    /// Smallest and largest K up to which its points exist.
    pub until: [f64; 2],
    /// Number of folds of the branch on it.
    pub folds: usize,
}

impl Stretch {
    /// Smallest and largest Ω (index 0) or max r (index 1).
    pub fn range(&self, index: usize) -> [f64; 2] {
        let values = self.places.iter().map(|place| place[index]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    }

    /// Extent in Ω.
    pub fn width(&self) -> f64 {
        let [low, high] = self.range(0);
        high - low
    }
}

/// Fates of the points of a branch.
#[derive(Clone, Debug, Default)]
pub struct Fates {
    /// Stretches of vanishing points, in the order of the branch.
    pub stretches: Vec<Stretch>,
    /// Number of points tested.
    pub tested: usize,
    /// Number of points whose stability changes.
    pub changed: usize,
    /// Number of points that could not be followed to the end.
    pub undecided: usize,
}

impl Fates {
    /// The stretches in words.
    pub fn in_words(&self) -> String {
        if self.stretches.is_empty() {
            return "none".into();
        }
        let words = |s: &Stretch| {
            let ([a, b], [low, high]) = (s.range(0), s.range(1));
            format!(
                "Ω = {a:.5} to {b:.5} (max r {low:.4} to {high:.4}, up to K = {:.0} to {:.0})",
                s.until[0], s.until[1]
            )
        };
        self.stretches.iter().map(words).collect::<Vec<_>>().join("; ")
    }

    /// Number of points tested, in words.
    pub fn tested_in_words(&self) -> String {
        let others = match (self.changed, self.undecided) {
            (0, 0) => String::new(),
            (changed, undecided) => format!(", {changed} change their stability, {undecided} could not be followed"),
        };
        format!("{} points followed{others}", self.tested)
    }
}

/// Determines the fates of the points of a branch as K goes `to` another value.
///
/// # Errors
/// There is no such branch.
pub fn fates(runs: &Runs, run: &Run, name: &str, to: f64) -> Result<Fates, String> {
    let branch = run.branch(name)?;
    let of = format!("{name} {to} {} {}", run.study.text, run.study.model_text);
    let table =
        runs.table(&format!("fates of {name}"), &of, || Ok(table(&Search::new(run, branch, to), runs.jobs())))?;
    Ok(read(&table))
}

/// Fate of a point, or the mark of a fold in the list of points.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fate {
    Survives,
    Changes,
    Vanishes(f64),
    Undecided,
    /// A fold, between the points next to it.
    Fold,
}

impl Fate {
    fn vanishes(self) -> bool {
        matches!(self, Fate::Vanishes(_))
    }
}

struct Search<'s> {
    system: System<'s>,
    tolerance: f64,
    degree: usize,
    branch: &'s Branch,
    to: f64,
}

impl<'s> Search<'s> {
    fn new(run: &'s Run, branch: &'s Branch, to: f64) -> Search<'s> {
        let system = System::of_plan(&run.study.model, &run.study.plan);
        Search { system, tolerance: run.study.plan.tolerance, degree: run.study.plan.degree, branch, to }
    }

    fn fate(&self, point: &Point) -> Fate {
        match persistence(&self.system, self.tolerance, self.degree, point, SHARPNESS, self.to, MOST) {
            Persistence::Survives(_) => Fate::Survives,
            Persistence::Changes(_) => Fate::Changes,
            Persistence::Vanishes { fold } => Fate::Vanishes(fold),
            Persistence::Undecided(_) => Fate::Undecided,
        }
    }

    /// Solution at that Ω between two points without a fold between them.
    fn between(&self, a: &Point, b: &Point, omega: f64) -> Option<Point> {
        let mut part = Branch::new("part", self.branch.family, self.branch.free, Origin::Seed(String::new()));
        part.points = vec![a.clone(), b.clone()];
        let everywhere = [f64::NEG_INFINITY, f64::INFINITY];
        let settings = growth::settings(&self.system, self.tolerance, everywhere, 0);
        known::solutions_at(&self.system, &settings, &part, omega).pop()
    }

    /// Points and folds of the branch in order, with two additional points next to each fold.
    fn nodes(&self) -> Vec<(Point, bool)> {
        let mut track: Vec<(&Point, bool)> = self.branch.points.iter().map(|p| (p, false)).collect();
        for fold in self.branch.special.iter().filter(|s| s.kind == Kind::Fold) {
            let after = track.partition_point(|(p, _)| p.position <= fold.point.position);
            track.insert(after, (&fold.point, true));
        }
        let mut nodes: Vec<(Point, bool)> = Vec::new();
        for (k, (point, is_fold)) in track.iter().enumerate() {
            let beside = |other: Option<&(&Point, bool)>| {
                let (other, _) = other?;
                let [at, far] = [point, other].map(|p| p.parameters[OMEGA]);
                self.between(other, point, at + BESIDE * (far - at)).map(|p| (p, false))
            };
            if *is_fold {
                nodes.extend(beside(k.checked_sub(1).and_then(|before| track.get(before))));
            }
            nodes.push(((*point).clone(), *is_fold));
            if *is_fold {
                nodes.extend(beside(track.get(k + 1)));
            }
        }
        nodes
    }

    /// Last position at which points vanish on the way from `a`, which vanishes, to `b`, which does not.
    fn end(&self, a: &Point, b: &Point) -> [f64; 2] {
        let (mut inside, mut outside) = (a.clone(), b.clone());
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inside.parameters[OMEGA] + outside.parameters[OMEGA]);
            let Some(point) = self.between(&inside, &outside, middle) else { break };
            if self.fate(&point).vanishes() { inside = point } else { outside = point }
        }
        place(&inside)
    }
}

fn place(point: &Point) -> [f64; 2] {
    [point.parameters[OMEGA], max_r(point)]
}

/// Table of results. The first row holds the counts. Each other row is a point on a stretch: number of the stretch, Ω,
/// max r, K up to which the point exists or NaN, and 1 for a fold.
fn table(search: &Search, jobs: usize) -> Table {
    let nodes = search.nodes();
    let fates = in_parallel(jobs, &nodes, |(point, fold)| if *fold { Fate::Fold } else { search.fate(point) });
    let count = |fate: Fate| fates.iter().filter(|f| **f == fate).count() as f64;
    let folds = count(Fate::Fold);
    let mut rows = vec![vec![fates.len() as f64 - folds, count(Fate::Changes), count(Fate::Undecided)]];
    let mut number = 0.0;
    let mut row = |number: f64, [omega, r]: [f64; 2], k: f64, fold: bool| {
        rows.push(vec![number, omega, r, k, f64::from(u8::from(fold))]);
    };
    // Fate and index of the previous point, and the fold between it and the current one.
    let (mut before, mut fold): (Option<usize>, Option<usize>) = (None, None);
    for k in 0..nodes.len() {
        if fates[k] == Fate::Fold {
            fold = Some(k);
            continue;
        }
        let was = before.is_some_and(|b| fates[b].vanishes());
        let at_fold = fold.map(|f| place(&nodes[f].0));
        let inside = |from: usize, to: usize| at_fold.unwrap_or_else(|| search.end(&nodes[from].0, &nodes[to].0));
        match (before, was, fates[k]) {
            (Some(b), true, fate) if !fate.vanishes() => row(number, inside(b, k), f64::NAN, at_fold.is_some()),
            (b, false, Fate::Vanishes(until)) => {
                number += 1.0;
                if let Some(b) = b {
                    row(number, inside(k, b), f64::NAN, at_fold.is_some());
                }
                row(number, place(&nodes[k].0), until, false);
            }
            (_, true, Fate::Vanishes(until)) => {
                if let Some(at) = at_fold {
                    row(number, at, f64::NAN, true);
                }
                row(number, place(&nodes[k].0), until, false);
            }
            _ => {}
        }
        (before, fold) = (Some(k), None);
    }
    rows
}

fn read(table: &[Vec<f64>]) -> Fates {
    let mut fates = Fates::default();
    for row in table {
        match row[..] {
            [tested, changed, undecided] => {
                [fates.tested, fates.changed, fates.undecided] = [tested, changed, undecided].map(|n| n as usize);
            }
            [number, omega, r, until, fold] => {
                while (fates.stretches.len() as f64) < number {
                    fates.stretches.push(Stretch { until: [f64::INFINITY, f64::NEG_INFINITY], ..Stretch::default() });
                }
                let Some(stretch) = fates.stretches.last_mut() else { continue };
                stretch.places.push([omega, r]);
                stretch.folds += usize::from(fold > 0.5);
                // NaN leaves both unchanged.
                stretch.until = [stretch.until[0].min(until), stretch.until[1].max(until)];
            }
            _ => {}
        }
    }
    fates
}
