//! Defining systems of folds, period doublings, torus points and grazings of both kinds of cycles with events.
//!
//! **Idea.** A perturbation of such a cycle is carried through each flight, and through the jump at its end by the
//! saltation matrix. Where it returns to itself, to its opposite, or turned by an angle, the cyclic system of all flights
//! is singular. Bordered by approximate null vectors it is regular, and the border component g of its solution is the
//! number that must vanish. At an impact grazing, g is the maximum of the switch of an event during a flight, which is
//! regular on cycles without that event; at a grazing, the extremum of another switch.
//!
//! **Equations.** With A_i = S_i Φ_i the transition and the saltation matrix of flight i = 1 … k, σ the sign of the change
//! of a switch h:
//!
//! ```text
//!   fold              (1)  v_{i+1} = A_i v_i,   A_k v_k = v_1 - T₁ f,   ⟨f, v_1⟩ = 0     T₁ = 0 for a forced field
//!   period doubling   (2)  v_{i+1} = A_i v_i,   A_k v_k = -v_1
//!   torus             (3)  v_{i+1} = A_i v_i,   A_k v_k = e^{iθ} v_1                     v complex
//!   grazing           (4)  g = max σ h
//! ```
//!
//! **Source.** govaerts2000, §3 and §7; leine2004, §7; nordmark1991.
//!
//! **Departures.** Derivatives of g are central differences: second derivatives of switches, resets and of f in time
//! are not available. They only guide Newton's method, and g itself is computed to rounding.
//!
//! **Fails when** a curve of torus points approaches a 1:1 or 1:2 resonance, where it ends with a message.

use super::grazing;
use super::impact::{Highest, highest};
use crate::contract::{Condition, ZeroProblem};
use crate::diagram::{Cycle, Kind, Mesh, Point};
use crate::linalg::{dot, lu, max_abs};
use crate::problem::Setting;
use crate::problem::impact::stored::{hard, impacts};
use crate::problem::impact::{ImpactProblem, Returns};
use num_complex::Complex64;

/// Relative size of the steps of differences.
const STEP: f64 = 2e-5;
/// |sin θ| at a strong resonance: there (3) is singular, since the period doublings that meet the curve satisfy it too.
const STRONG: f64 = 0.02;
/// Half the width of the part of a flight in which a maximum is sought, samples of each half, and rounds of parabolas.
const BESIDE: f64 = 0.05;
const SAMPLES: i32 = 8;
const ROUNDS: usize = 6;

/// A place on a flight: its number, the share of its duration, the switch and the sign σ.
#[derive(Clone, Copy, Debug)]
struct Place {
    flight: usize,
    share: f64,
    switch: usize,
    sign: f64,
}

/// Defining system of a bifurcation of cycles with events.
pub struct OnImpacts<'a> {
    problem: ImpactProblem<'a>,
    scales: Vec<f64>,
    kind: Kind,
    autonomous: bool,
    /// Borders, of the size of (1) to (3).
    left: Vec<f64>,
    right: Vec<f64>,
    /// Null vectors of the last evaluation.
    null: Vec<f64>,
    adjoint: Vec<f64>,
    /// The maximum (4), and the size of the switch.
    place: Option<Place>,
    size: f64,
    /// Last point, and the extra unknowns there.
    at: Vec<f64>,
    extra: Vec<f64>,
}

impl<'a> OnImpacts<'a> {
    /// Defining system of a kind for cycles with the events of `cycle`, but for one without speed if `kind` is impact
    /// grazing; `None` if there are none, or for other kinds.
    pub fn new(kind: Kind, setting: Setting<'a>, cycle: &Cycle) -> Option<OnImpacts<'a>> {
        let known =
            matches!(kind, Kind::Fold | Kind::PeriodDoubling | Kind::Torus | Kind::ImpactGrazing | Kind::Grazing);
        let (scales, autonomous) = (setting.scales.to_vec(), cycle.forcing_periods == 0);
        let problem = match kind {
            Kind::ImpactGrazing => ImpactProblem::besides_grazing(setting.clone(), cycle),
            _ => ImpactProblem::like(setting.clone(), cycle),
        }
        .filter(|_| known)?;
        let (place, size) = match kind {
            Kind::ImpactGrazing => {
                let Highest { size, time, event, .. } = highest(setting.field, &setting.parameters, cycle);
                // The special point may have the event that grazes, or not.
                let [all, others] = [impacts, hard].map(|find| find(setting.field, &setting.parameters, cycle));
                let grazes = all.iter().find(|own| others.iter().all(|other| other.interval != own.interval));
                let (time, event) = grazes.map_or((time, event), |own| (own.time, own.event));
                let sign = setting.field.event_direction(event);
                let sign = if sign == 0.0 { problem.side(event) } else { sign };
                let (flight, share) = problem.place(time);
                let switch = setting.field.switch_count() - setting.field.event_count() + event;
                (Some(Place { flight, share, switch, sign }), size)
            }
            Kind::Grazing => {
                let grazed = grazing::nearest(setting.field, &setting.parameters, cycle)?;
                let (flight, share) = problem.place(grazed.extremum.time);
                let sign = if grazed.extremum.maximum { 1.0 } else { -1.0 };
                (Some(Place { flight, share, switch: grazed.switch, sign }), grazed.size)
            }
            _ => (None, 1.0),
        };
        Some(OnImpacts {
            problem,
            scales,
            kind,
            autonomous,
            left: Vec::new(),
            right: Vec::new(),
            null: Vec::new(),
            adjoint: Vec::new(),
            place,
            size,
            at: Vec::new(),
            extra: Vec::new(),
        })
    }

    /// Number of real parts of v, and of g.
    fn parts(&self) -> usize {
        if self.kind == Kind::Torus { 2 } else { 1 }
    }

    /// The bordered system `[width × width]` for given transitions.
    fn system(&mut self, found: &Returns, angle: f64) -> (Vec<f64>, usize) {
        let (n, k, parts) = (self.scales.len(), found.transitions.len(), self.parts());
        let shift = self.kind == Kind::Fold && self.autonomous;
        let core = parts * k * n + usize::from(shift);
        let width = core + parts;
        let mut a = vec![0.0; width * width];
        let row = |part: usize, flight: usize, c: usize| (part * k + flight) * n + c;
        for part in 0..parts {
            for (i, own) in found.transitions.iter().enumerate() {
                let next = (i + 1) % k;
                for c in 0..n {
                    let line = &mut a[row(part, next, c) * width..][..width];
                    for d in 0..n {
                        line[row(part, i, d)] -= own[c * n + d] * self.scales[d] / self.scales[c];
                    }
                    // The value at the beginning of the next flight, turned at the end of the period.
                    let turned = match (next, self.kind) {
                        (0, Kind::PeriodDoubling) => [-1.0, 0.0],
                        (0, Kind::Torus) => [angle.cos(), angle.sin()],
                        _ => [1.0, 0.0],
                    };
                    line[row(part, next, c)] += turned[0];
                    if parts == 2 {
                        line[row(1 - part, next, c)] += if part == 0 { -turned[1] } else { turned[1] };
                    }
                }
            }
        }
        if shift {
            let size = found.rate.iter().zip(&self.scales).fold(0.0, |most: f64, (f, s)| most.max((f / s).abs()));
            for c in 0..n {
                let own = found.rate[c] / (self.scales[c] * size);
                a[row(0, 0, c) * width + core - 1] = -own;
                a[(core - 1) * width + row(0, 0, c)] = own;
            }
        }
        if self.left.len() != core {
            let wave = |by: f64| (0..core).map(|j| 0.4 + (0.3 + by * (j as f64 + 1.0)).sin()).collect::<Vec<f64>>();
            (self.left, self.right) = (wave(1.3), wave(0.7));
        }
        let half = parts * k * n / 2;
        for j in 0..core {
            a[j * width + core] = self.left[j];
            a[core * width + j] = self.right[j];
            if parts == 2 {
                // i times the borders.
                let (other, sign) = if j < half { (j + half, -1.0) } else { (j - half, 1.0) };
                a[j * width + core + 1] = sign * self.left[other];
                a[(core + 1) * width + j] = sign * self.right[other];
            }
        }
        (a, width)
    }

    /// g of (1) to (3), with the null vectors.
    fn bordered(&mut self, u: &[f64], angle: f64, g: &mut [f64], vectors: bool) -> Option<()> {
        let found = self.problem.returns(u)?;
        let (a, width) = self.system(&found, angle);
        let core = width - self.parts();
        let solved = |mut a: Vec<f64>| -> Option<Vec<f64>> {
            let (mut x, mut pivots) = (vec![0.0; width], vec![0; width]);
            x[core] = 1.0;
            lu::factorise(&mut a, width, &mut pivots).ok()?;
            lu::solve(&a, width, &pivots, &mut x, 1);
            Some(x)
        };
        let transposed = vectors.then(|| (0..width * width).map(|at| a[at % width * width + at / width]).collect());
        let null = solved(a)?;
        g.copy_from_slice(&null[core..]);
        if let Some(transposed) = transposed {
            self.adjoint = solved(transposed)?[..core].to_vec();
            self.null = null[..core].to_vec();
        }
        g.iter().all(|g| g.is_finite()).then_some(())
    }

    /// g of (4), and the share of the flight at which the maximum lies.
    fn touch(&self, u: &[f64], place: Place) -> Option<(f64, f64)> {
        let switches = self.problem.switches_on(u, place.flight);
        let at = |share: f64| place.sign * switches(share)[place.switch];
        let step = BESIDE / f64::from(SAMPLES);
        let around = (-SAMPLES..=SAMPLES).map(|k| place.share + step * f64::from(k));
        let mut best = around
            .filter(|share| (0.0..=1.0).contains(share))
            .map(|share| (share, at(share)))
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        let mut h = step;
        for _ in 0..ROUNDS {
            let t = [best.0 - h, best.0, best.0 + h];
            let v = t.map(at);
            let (slope, bend) = ((v[2] - v[0]) / (2.0 * h), (v[2] - 2.0 * v[1] + v[0]) / (h * h));
            let there = best.0 - slope / bend;
            if !(bend < 0.0 && (0.0..=1.0).contains(&there)) {
                break;
            }
            best = (there, at(there));
            h = (0.1 * h).max(1e-4);
        }
        best.1.is_finite().then_some((best.1 / self.size, best.0))
    }

    fn value(&mut self, u: &[f64], extra: &[f64], g: &mut [f64], vectors: bool) -> Option<()> {
        if let Some(place) = self.place {
            let (value, share) = self.touch(u, place)?;
            g[0] = value;
            if vectors {
                self.place = Some(Place { share, ..place });
            }
            return Some(());
        }
        self.bordered(u, extra.first().copied().unwrap_or(0.0), g, vectors)
    }
}

impl Condition for OnImpacts<'_> {
    fn kind(&self) -> Kind {
        self.kind
    }

    fn extra(&self) -> usize {
        self.parts() - 1
    }

    fn guess(&self, point: &Point) -> Vec<f64> {
        let complex = point.free_spectrum().iter().filter(|z| z.im > 0.0);
        let nearest = complex.min_by(|a, b| a.norm().ln().abs().total_cmp(&b.norm().ln().abs()));
        (0..self.extra()).map(|_| nearest.map_or(1.0, |z| z.arg())).collect()
    }

    fn anchor(&mut self) {
        let unit = |v: &[f64]| -> Option<Vec<f64>> {
            let size = dot(v, v).sqrt();
            (size > 0.0 && size.is_finite()).then(|| v.iter().map(|x| x / size).collect())
        };
        if let (Some(left), Some(right)) = (unit(&self.adjoint), unit(&self.null)) {
            (self.left, self.right) = (left, right);
        }
    }

    fn set_mesh(&mut self, mesh: &Mesh) {
        self.problem.set_mesh(mesh);
    }

    fn evaluate(&mut self, u: &[f64], extra: &[f64], g: &mut [f64]) -> bool {
        (self.at, self.extra) = (u.to_vec(), extra.to_vec());
        self.obstacle(extra).is_none() && self.value(u, extra, g, true).is_some()
    }

    fn obstacle(&self, extra: &[f64]) -> Option<&'static str> {
        let at_resonance = extra.iter().any(|angle| angle.sin().abs() < STRONG);
        at_resonance.then_some(
            "the curve of torus points approaches a 1:1 or 1:2 resonance, near which torus points of cycles with events are \
             not computed",
        )
    }

    fn derivative(&mut self, du: &[f64], extra: &[f64], dg: &mut [f64]) {
        let (u, own) = (self.at.clone(), self.extra.clone());
        let along = self.problem.relative_size(du, &u).max(max_abs(extra));
        if along == 0.0 {
            return dg.fill(0.0);
        }
        let step = STEP / along;
        let mut ends = [vec![0.0; dg.len()], vec![0.0; dg.len()]];
        for (end, sign) in ends.iter_mut().zip([-1.0, 1.0]) {
            let moved =
                |x: &[f64], d: &[f64]| -> Vec<f64> { x.iter().zip(d).map(|(x, d)| x + sign * step * d).collect() };
            if self.value(&moved(&u, du), &moved(&own, extra), end, false).is_none() {
                return dg.fill(f64::NAN);
            }
        }
        dg.iter_mut().enumerate().for_each(|(i, d)| *d = (ends[1][i] - ends[0][i]) / (2.0 * step));
    }

    fn held(&self, extra: &[f64]) -> Vec<Complex64> {
        match self.kind {
            Kind::Fold => vec![Complex64::new(1.0, 0.0)],
            Kind::PeriodDoubling => vec![Complex64::new(-1.0, 0.0)],
            Kind::Torus => [1.0, -1.0].map(|sign| Complex64::from_polar(1.0, sign * extra[0])).to_vec(),
            _ => Vec::new(),
        }
    }

    fn distance(&self, z: Complex64) -> f64 {
        match self.kind {
            Kind::Fold => (z - 1.0).norm(),
            Kind::PeriodDoubling => (z + 1.0).norm(),
            Kind::Torus if z.im == 0.0 => f64::INFINITY,
            _ => z.norm().ln().abs(),
        }
    }
}
