//! First connecting orbits between given saddles.
//!
//! **Idea.** If the unstable manifold of the first saddle is a curve, each half of it is a trajectory. It passes the
//! second saddle and leaves it along the unstable direction, to one side or the other. Between two parameter values at
//! which the sides differ lies a connection, which is located by bisection. If instead the stable manifold of the
//! second saddle is a curve, the search runs backwards in time.
//!
//! **Equations.** With y = x - x_1, H of `problem::connecting`, and the left eigenvector l of the unstable eigenvalue:
//!
//! ```text
//!   (1)  ⟨H y, f⟩ = 0, rising                      closest approach
//!   (2)  side = sign ⟨l, y⟩
//! ```
//!
//! **Source.** beyn1990, §5 (starting orbits); kuznetsov2004, §6.
//!
//! **Fails when** both manifolds have dimension two or more, or the trajectory passes other saddles so closely that its
//! side changes within the resolution of the scan.

use super::System;
use crate::contract::{Parameters, Verdict};
use crate::diagram::{Branch, Cycle, Point, Solution};
use crate::linalg::dot;
use crate::problem::connecting::{ConnectingField, Split};
use crate::problem::gauss::Scheme;
use crate::simulation::{Direction, Integrator, Passage, Section, Tolerance};

/// Number of parameter values compared on a branch. Connections closer to each other are missed in pairs.
const VALUES: usize = 80;
/// Distance from the first saddle at which trajectories begin, in units of the sizes of the states.
const BEGIN: f64 = 1e-5;
/// Number of closest approaches that are compared.
const PASSES: usize = 3;
/// Bisections: the values then differ by the errors of the trajectories.
const BISECTIONS: usize = 48;
/// Relative accuracy of the trajectories that are compared …
const COARSE: f64 = 1e-8;
/// … and of those that lead to the orbit, on which its closest approach depends.
const ACCURACY: f64 = 1e-12;
/// Time that no trajectory takes, in units of the model.
const LONGEST: f64 = 1e9;
/// Share of the largest speed below which a trajectory has come to rest.
const AT_REST: f64 = 1e-8;
/// Distance at which a trajectory is given up, in units of the sizes of the states.
const GONE: f64 = 1e3;
/// Limit on the steps of a trajectory.
const STEPS: usize = 4_000;
/// Ratio by which the closest approach must shrink in the bisection; it would not at a jump.
const SHRINKS: f64 = 0.5;
/// Largest closest approach of a connection, relative to the largest distance on it.
const CLOSE: f64 = 0.2;

/// A connecting orbit found, on a finite interval.
pub(super) struct Shot {
    pub parameters: Vec<f64>,
    /// The saddles, one after the other; the first alone if they are the same.
    pub places: Vec<f64>,
    pub cycle: Cycle,
}

/// The two saddles at one parameter value.
#[derive(Clone)]
struct Saddles {
    parameters: Vec<f64>,
    at: [Vec<f64>; 2],
}

/// Closest approach: distance, (2) with its size, and time.
#[derive(Clone, Copy)]
struct Pass {
    distance: f64,
    across: f64,
    time: f64,
    farthest: f64,
}

/// Neighbouring values between which a half of the manifold changes sides at a passage.
struct Bracket {
    /// Distance from the value wanted, or the number on the branch.
    off: f64,
    pass: usize,
    half: usize,
    saddles: [Saddles; 2],
    passes: [Pass; 2],
    /// Vectors to which the signs refer; see [`Search::passes`].
    refer: Option<[Vec<f64>; 2]>,
}

/// A search on a branch of equilibria.
pub(super) struct Search<'s> {
    pub system: &'s System<'s>,
    pub free: usize,
    pub range: [f64; 2],
    /// Value near which the connection is requested.
    pub near: Option<f64>,
    /// State near the second saddle; `None` for a homoclinic orbit.
    pub to: Option<Vec<f64>>,
    pub degree: usize,
}

impl Search<'_> {
    fn equilibrium(&self, x: &[f64], parameters: &[f64]) -> Option<Vec<f64>> {
        super::connections::equilibrium(self.system, x, parameters)
    }

    /// Pairs of saddles along the branch, in its order.
    fn along(&self, branch: &Branch) -> Vec<Option<Saddles>> {
        let points: Vec<(&Point, &Vec<f64>)> = branch
            .points
            .iter()
            .filter_map(|point| match &point.solution {
                Solution::Equilibrium(x) => Some((point, x)),
                _ => None,
            })
            .collect();
        let pieces = VALUES.div_ceil(points.len().max(1));
        let mut there = self.to.clone();
        let mut all = Vec::new();
        for pair in points.windows(2) {
            for k in 0..pieces {
                let share = k as f64 / pieces as f64;
                let mixed =
                    |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect() };
                let parameters = mixed(&pair[0].0.parameters, &pair[1].0.parameters);
                let value = parameters[self.free];
                if value < self.range[0] || value > self.range[1] {
                    all.push(None);
                    continue;
                }
                let here = self.equilibrium(&mixed(pair[0].1, pair[1].1), &parameters);
                let other = match &there {
                    Some(x) => {
                        let found = self.equilibrium(x, &parameters);
                        if let Some(found) = &found {
                            there = Some(found.clone());
                        }
                        found
                    }
                    None => here.clone(),
                };
                all.push(here.zip(other).map(|(a, b)| Saddles { parameters, at: [a, b] }));
            }
        }
        all
    }

    fn splits(&self, saddles: &Saddles) -> Option<[Split; 2]> {
        let field = ConnectingField::new(self.system.field, &self.system.scales, 2, 1);
        let probe = field.parameters(&saddles.parameters, 1.0, &saddles.at.concat(), [1.0; 2], &[]);
        Some([field.split(0, &probe)?, field.split(1, &probe)?])
    }

    /// Closest approaches of both halves of the manifold of dimension one; `forwards` in time from the first saddle, or
    /// backwards from the second; of one half if `only` is given. `refer` `[2][n]` are the direction and l of another value, to which signs refer.
    fn passes(
        &self,
        saddles: &Saddles,
        forwards: bool,
        only: Option<usize>,
        refer: &mut Option<[Vec<f64>; 2]>,
    ) -> Option<[Vec<Pass>; 2]> {
        let splits = self.splits(saddles)?;
        let n = self.system.field.dim();
        let side = if forwards { 1.0 } else { -1.0 };
        let [from, to] = if forwards { [0, 1] } else { [1, 0] };
        let single = |split: &Split| if forwards { split.unstable() == 1 } else { split.unstable() + 1 == n };
        if !splits.iter().all(single) {
            return None;
        }
        let (mut u, mut l) = (splits[from].direction(side), splits[to].covector(side));
        if let Some([u0, l0]) = refer {
            for (own, known) in [(&mut u, u0), (&mut l, l0)] {
                if dot(own, known) < 0.0 {
                    own.iter_mut().for_each(|x| *x = -*x);
                }
            }
        }
        *refer = Some([u.clone(), l.clone()]);
        let of = |half: usize| {
            let accuracy = if only.is_some() { ACCURACY } else { COARSE };
            if only.is_some_and(|only| only != half) {
                return Vec::new();
            }
            let start = self.begin(saddles, from, &u, if half == 0 { 1.0 } else { -1.0 });
            self.followed(saddles, &splits[to], &l, [from, to], &start, [side, accuracy]).0
        };
        Some([of(0), of(1)])
    }

    fn tolerance(&self, accuracy: f64) -> Tolerance {
        let absolute = self.system.scales.iter().map(|scale| BEGIN * accuracy * scale).collect();
        Tolerance { relative: accuracy, absolute }
    }

    fn begin(&self, saddles: &Saddles, from: usize, u: &[f64], half: f64) -> Vec<f64> {
        let own = saddles.at[from].iter().zip(u).zip(&self.system.scales);
        own.map(|((x, u), scale)| x + half * BEGIN * u * scale).collect()
    }

    /// Closest approaches of a trajectory to the saddle `places[1]`, and its states at the ends of steps and halfway
    /// with their times.
    fn followed(
        &self,
        saddles: &Saddles,
        split: &Split,
        l: &[f64],
        places: [usize; 2],
        start: &[f64],
        [side, accuracy]: [f64; 2],
    ) -> (Vec<Pass>, Vec<(f64, Vec<f64>)>) {
        let system = self.system;
        let (n, target) = (system.field.dim(), &saddles.at[places[1]]);
        let deviation = |x: &[f64]| -> Vec<f64> { (0..n).map(|c| (x[c] - target[c]) / system.scales[c]).collect() };
        let approach = |_: f64, x: &[f64]| {
            let mut f = vec![0.0; n];
            let parameters = Parameters::Shared(&saddles.parameters);
            let at = crate::contract::Batch { lanes: 1, states: x, parameters, times: &[], signs: &[] };
            system.field.evaluate(at, &mut f);
            f.iter_mut().zip(&system.scales).for_each(|(f, scale)| *f *= side / scale);
            dot(&split.covector_of(&deviation(x)), &f)
        };
        let section = [Section { value: &approach, direction: Direction::Rising }];
        let tolerance = self.tolerance(accuracy);
        let integrator = Integrator::new(system.field, &saddles.parameters, tolerance).with_step_limit(STEPS);
        let (mut passes, mut path): (Vec<Pass>, Vec<(f64, Vec<f64>)>) = (Vec::new(), vec![(0.0, start.to_vec())]);
        let (mut farthest, mut fastest) = (0.0f64, 0.0f64);
        let mut x = vec![0.0; n];
        integrator.trajectory(start, [0.0, side * LONGEST], &section, &mut |passage| match passage {
            Passage::Crossing(crossing) => {
                let y = deviation(&crossing.state);
                let distance = split.size(&y);
                // The beginning of a homoclinic orbit is no approach.
                if farthest > 1e3 * BEGIN {
                    passes.push(Pass { distance, across: dot(l, &y), time: crossing.time, farthest });
                }
                if passes.len() < PASSES { Verdict::Continue } else { Verdict::Stop }
            }
            Passage::Step(step) => {
                for theta in [0.5, 1.0] {
                    step.state_into(theta, &mut x);
                    path.push((step.time_at(theta), x.clone()));
                }
                farthest = farthest.max(split.size(&deviation(&x)));
                let speed = (0..n).map(|c| (step.end_slope(c) / system.scales[c]).abs()).fold(0.0, f64::max);
                fastest = fastest.max(speed);
                // At rest elsewhere, or gone.
                match speed < AT_REST * fastest || farthest > GONE {
                    true => Verdict::Stop,
                    false => Verdict::Continue,
                }
            }
        });
        (passes, path)
    }

    /// The connection nearest to the value wanted, or the first on the branch.
    ///
    /// # Errors
    /// A sentence that says why there is none.
    pub(super) fn found(&self, branch: &Branch) -> Result<Shot, String> {
        let all = self.along(branch);
        let n = self.system.field.dim();
        let counts: Vec<[usize; 2]> = all
            .iter()
            .flatten()
            .filter_map(|saddles| self.splits(saddles))
            .map(|splits| [splits[0].unstable(), splits[1].unstable()])
            .collect();
        let fits = |forwards: bool| counts.contains(&if forwards { [1, 1] } else { [n - 1, n - 1] });
        let forwards = fits(true);
        if !forwards && !fits(false) {
            return Err(no_saddles(&counts, n));
        }
        let mut refer = None;
        let mut before: Option<(&Saddles, [Vec<Pass>; 2])> = None;
        let mut brackets: Vec<Bracket> = Vec::new();
        for saddles in &all {
            let own = saddles.as_ref().and_then(|own| Some((own, self.passes(own, forwards, None, &mut refer)?)));
            if let (Some((a, first)), Some((b, second))) = (&before, &own) {
                for half in 0..2 {
                    for (k, (p, q)) in first[half].iter().zip(&second[half]).enumerate() {
                        if p.across * q.across <= 0.0 {
                            let value = 0.5 * (a.parameters[self.free] + b.parameters[self.free]);
                            let off = self.near.map_or(brackets.len() as f64, |near| (value - near).abs());
                            let saddles = [(*a).clone(), (*b).clone()];
                            let refer = refer.clone();
                            brackets.push(Bracket { off, pass: k, half, saddles, passes: [*p, *q], refer });
                        }
                    }
                }
            }
            before = own;
        }
        // Simple passages first, but for a value asked for.
        match self.near {
            Some(_) => brackets.sort_by(|a, b| a.off.total_cmp(&b.off).then(a.pass.cmp(&b.pass))),
            None => brackets.sort_by(|a, b| a.pass.cmp(&b.pass).then(a.off.total_cmp(&b.off))),
        }
        let tried = brackets.len();
        if let Some(shot) = brackets.into_iter().find_map(|bracket| self.bisected(forwards, bracket)) {
            return Ok(shot);
        }
        Err(match tried {
            0 => "no value of the parameter on the branch was found at which the manifold of the first saddle changes sides at \
                  the second\nlikely cause: there is no connection in this range, or two close to each other\nwhat to do: widen \
                  or narrow the range of the branch"
                .into(),
            count => format!(
                "the manifold of the first saddle changes sides at the second at {count} values of the parameter, but does \
                 not come close to it there\nlikely cause: there is no connection in this range\nwhat to do: widen or \
                 narrow the range of the branch, or give `near`"
            ),
        })
    }

    fn bisected(&self, forwards: bool, bracket: Bracket) -> Option<Shot> {
        let Bracket { pass, half, saddles: [mut a, mut b], passes: [mut low, mut high], mut refer, .. } = bracket;
        let first = low.distance.min(high.distance);
        for _ in 0..BISECTIONS {
            let parameters: Vec<f64> = a.parameters.iter().zip(&b.parameters).map(|(a, b)| 0.5 * (a + b)).collect();
            let value = parameters[self.free];
            if value == a.parameters[self.free] || value == b.parameters[self.free] {
                break;
            }
            let at = [0, 1].map(|k| {
                let guess: Vec<f64> = a.at[k].iter().zip(&b.at[k]).map(|(a, b)| 0.5 * (a + b)).collect();
                self.equilibrium(&guess, &parameters)
            });
            let [Some(x0), Some(x1)] = at else { return None };
            let middle = Saddles { parameters, at: [x0, x1] };
            let Some(own) = self.passes(&middle, forwards, Some(half), &mut refer)?[half].get(pass).copied() else {
                break;
            };
            if own.across * low.across > 0.0 {
                (a, low) = (middle, own);
            } else {
                (b, high) = (middle, own);
            }
        }
        let (saddles, best) = if low.distance < high.distance { (a, low) } else { (b, high) };
        let shrunk = best.distance < SHRINKS * first || best.distance < 1e-3 * best.farthest;
        if !shrunk || best.distance > CLOSE * best.farthest {
            return None;
        }
        self.recorded(&saddles, forwards, half, best, refer)
    }

    fn recorded(
        &self,
        saddles: &Saddles,
        forwards: bool,
        half: usize,
        best: Pass,
        refer: Option<[Vec<f64>; 2]>,
    ) -> Option<Shot> {
        let splits = self.splits(saddles)?;
        let side = if forwards { 1.0 } else { -1.0 };
        let [from, to] = if forwards { [0, 1] } else { [1, 0] };
        let [u, l] = refer?;
        let start = self.begin(saddles, from, &u, if half == 0 { 1.0 } else { -1.0 });
        let (_, mut path) = self.followed(saddles, &splits[to], &l, [from, to], &start, [side, ACCURACY]);
        path.retain(|(t, _)| t.abs() <= best.time.abs());
        if !forwards {
            path.reverse();
        }
        let (t0, t1) = (path.first()?.0, path.last()?.0);
        let tolerance = self.tolerance(ACCURACY);
        let integrator = Integrator::new(self.system.field, &saddles.parameters, tolerance).with_step_limit(STEPS);
        let scheme = Scheme::new(self.degree);
        let mut profile = Vec::new();
        for pair in path.windows(2) {
            let mut x = pair[0].1.clone();
            let mut t = pair[0].0;
            for c in &scheme.nodes {
                let next = pair[0].0 + c * (pair[1].0 - pair[0].0);
                if next != t {
                    x = integrator.state_after(&x, [t, next])?;
                    t = next;
                }
                profile.extend_from_slice(&x);
            }
        }
        let mesh: Vec<f64> = path.iter().map(|(t, _)| (t - t0) / (t1 - t0)).collect();
        let gain: Vec<f64> = path.last()?.1.iter().zip(&path.first()?.1).map(|(b, a)| b - a).collect();
        let cycle = Cycle {
            points: crate::problem::gauss::Points::Gauss,
            period: t1 - t0,
            forcing_periods: 0,
            mesh: mesh.into(),
            degree: self.degree,
            profile,
            gain,
        };
        let places = if self.to.is_some() { saddles.at.concat() } else { saddles.at[0].clone() };
        Some(Shot { parameters: saddles.parameters.clone(), places, cycle })
    }
}

/// A sentence about saddles between which there is nothing to search for.
fn no_saddles(counts: &[[usize; 2]], n: usize) -> String {
    let Some([a, b]) = counts.first() else {
        return "the equilibria of the branch and of `to` were not found, or are next to bifurcations everywhere"
            .into();
    };
    let what = if a != b {
        "such orbits exist for all values of the parameter, or need more than one parameter"
    } else if *a == 0 || *a == n {
        "they are not saddles"
    } else {
        "orbits are searched for only where the unstable or the stable manifold is a curve"
    };
    format!(
        "the equilibria have {a} and {b} unstable eigenvalues of {n}: {what}\nwhat to do: start `of` a branch of cycles whose \
         period grows without bound"
    )
}
