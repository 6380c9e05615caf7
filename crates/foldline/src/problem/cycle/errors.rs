//! Error estimates of a cycle, from its defect and the last factorisation.

use super::CycleProblem;
use crate::contract::{Batch, Parameters, VectorField, ZeroProblem};
use crate::diagram::{FLAT, STANDS};
use crate::linalg::condensed::Condensed;
use crate::linalg::dense::MANY;
use crate::linalg::system::System;
use crate::linalg::{larger, panel, same};
use crate::problem::back_along;
use crate::problem::defect::{self, Course, Defect, TOGETHER};
use crate::problem::piecewise::{OneBranch, Switched};
use crate::stability::floquet;
use num_complex::Complex64;
use std::ops::Range;

/// Ratio of the stated to the estimated error of multipliers.
const SPECTRUM_SAFE: f64 = 4.0;

/// Largest difference between two spectra, relative to the larger of 1 and the modulus. Each multiplier, the largest
/// first, is compared with the nearest of the other list that has not been used yet.
pub(in crate::problem) fn spectrum_difference(spectrum: &[Complex64], other: &[Complex64]) -> f64 {
    let mut own: Vec<Complex64> = spectrum.to_vec();
    own.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    let mut left = other.to_vec();
    let mut most = 0.0f64;
    for z in own {
        let distance = |w: &Complex64| (w - z).norm();
        let nearest = (0..left.len()).min_by(|a, b| distance(&left[*a]).total_cmp(&distance(&left[*b])));
        let Some(nearest) = nearest else { return f64::NAN };
        most = most.max(distance(&left.remove(nearest)) / z.norm().max(1.0));
    }
    most
}

/// Number of intervals with many components that are processed together; the Jacobians of more would need more memory
/// than the system itself.
const FEW: usize = 8;

/// Relative rounding error of a single interval. Those of all intervals add up.
const ROUNDING: f64 = 0.5 * f64::EPSILON;

/// A profile along which Jacobians are evaluated.
struct Profile<'a> {
    u: &'a [f64],
    /// Error subtracted within intervals, as [`Measured::within`].
    without: Option<&'a [f64]>,
}

/// Workspace for a number of intervals.
#[derive(Default)]
pub(super) struct Room {
    measure: defect::Room,
    /// `[n][m + 1][count]`, at the nodes.
    own: Vec<f64>,
    /// `[n][m + 1][count]`, at the sample points.
    states: Vec<f64>,
    f: Vec<f64>,
    /// Arguments of [`defect::correct`].
    nodes: Vec<f64>,
    jacobians: [Vec<f64>; 2],
    gains: [Vec<f64>; 2],
}

impl Room {
    fn resize(&mut self, n: usize, m: usize, count: usize) {
        let (square, lanes) = (n * n, count * (m + 1));
        self.own.resize(n * lanes, 0.0);
        self.states.resize(n * lanes, 0.0);
        self.f.resize(n * lanes, 0.0);
        self.jacobians.iter_mut().for_each(|fx| fx.resize(square * lanes, 0.0));
        self.gains.iter_mut().for_each(|gains| gains.resize(square * count, 0.0));
    }
}

/// Error estimates and the unknowns to which they belong.
pub(super) struct Measured {
    at: Vec<f64>,
    errors: Vec<f64>,
    /// Part of the errors that rounding alone may cause.
    rounding: f64,
    /// Part of the error that propagates between intervals, in the layout of the unknowns.
    shift: Vec<f64>,
    /// Part of the error within intervals, `[n][m + 1][N]` at the sample points.
    within: Vec<f64>,
    /// For a boundary-value problem, the relative error of the number that it has in place of multipliers.
    degeneracy: f64,
}

impl Measured {
    /// The unknowns λ, after a profile of the given size.
    pub(super) fn scalars(&self, size: usize) -> &[f64] {
        &self.at[size + 1..]
    }
}

impl CycleProblem<'_> {
    /// Estimated relative error on every interval. The estimate for the last point is reused: its factorisation, which
    /// must belong to the current mesh, was close enough to the point then.
    pub(super) fn errors(&self, u: &[f64]) -> Vec<f64> {
        if let Some(known) = self.measured.borrow().as_ref().filter(|known| same(&known.at, u)) {
            return known.errors.clone();
        }
        let measured = self.measured_errors(u);
        let errors = measured.errors.clone();
        self.measured.replace(Some(measured));
        errors
    }

    /// Error at `u` that finer meshes do not reduce: rounding of single intervals, amplified next to a singular matrix.
    pub(super) fn rounding(&self, u: &[f64]) -> f64 {
        self.errors(u);
        self.measured.borrow().as_ref().map_or(0.0, |known| known.rounding)
    }

    /// Part of dλ/ds that may be rounding: [`STANDS`] if f_λ is as large as f, and inversely proportional to f_λ if it
    /// is smaller. If f does not depend on λ at all, the branch runs along λ.
    pub(super) fn slope_error(&self) -> f64 {
        if self.is_open() {
            // The parameter may enter through the conditions alone.
            return STANDS;
        }
        let (n, k) = (self.n, self.setting.freedom());
        let lanes = self.f.len() / n;
        let largest = |values: &[f64], row: usize, c: usize| {
            values[row * lanes..(row + 1) * lanes].iter().fold(0.0, |most: f64, v| larger(most, v.abs()))
                / self.scale[c]
        };
        let f = (0..n).fold(0.0, |most, c| larger(most, largest(&self.f, c, c)));
        let by_parameter = (0..n).fold(f64::MIN_POSITIVE, |most, c| larger(most, largest(&self.fp, c * k + k - 1, c)));
        (STANDS * f / by_parameter).clamp(STANDS, FLAT)
    }

    /// Estimated error of the multipliers `spectrum` at `u`: their change if the transitions of all intervals are
    /// improved, and again if the Jacobian is evaluated along the profile without its estimated error. The two changes
    /// can cancel, and so can the errors of neighbouring intervals. Every second interval is therefore changed first,
    /// then the others, and the sizes of all changes are added. Identities between multipliers reveal little of this
    /// error, which is large where the Jacobian changes sharply.
    pub(super) fn multiplier_error(&self, u: &[f64], tangent: &[f64], spectrum: &[Complex64]) -> f64 {
        self.errors(u);
        let switched = self.switched(u);
        let better = self.without_error(u, tangent);
        if self.is_planar() && switched.is_empty() {
            // Error of exp(∫ tr f_x), relative to the larger of 1 and its value, plus that of the trivial multiplier,
            // if any.
            let (own, off) = (self.trace.exp(), self.divergence_error(&better));
            let trivial = spectrum[..spectrum.len() - 1].iter().fold(0.0, |most: f64, z| most.max((z - 1.0).norm()));
            return SPECTRUM_SAFE * (off.exp_m1() * own / own.max(1.0) + trivial) + floquet::ROUNDING;
        }
        let Some(spectra) = self.corrected_multipliers([u, &better], &switched) else { return f64::NAN };
        let before = std::iter::once(spectrum).chain(spectra.iter().map(Vec::as_slice));
        let apart: f64 = before.zip(&spectra).map(|(one, next)| spectrum_difference(one, next)).sum();
        SPECTRUM_SAFE * apart + floquet::ROUNDING
    }

    /// `u` without its estimated error: the nearest solution of the branch or, with switches and away from folds, the one at the
    /// same value of the parameter. Only beside grazings do multipliers change so steeply that the difference matters.
    fn without_error(&self, u: &[f64], tangent: &[f64]) -> Vec<f64> {
        let known = self.measured.borrow();
        let Some(known) = known.as_ref() else { return vec![f64::NAN; u.len()] };
        let alone = self.setting.freedom() == 1 && self.setting.field.switch_count() > 0;
        let back = if alone { back_along(self, &known.shift, tangent) } else { 0.0 };
        u.iter().zip(&known.shift).zip(tangent).map(|((u, e), t)| u - e + back * t).collect()
    }

    /// Error of ∫ tr f_x: its difference from the integral over other points of the intervals, along the profile
    /// without its estimated error.
    fn divergence_error(&self, better: &[f64]) -> f64 {
        let known = self.measured.borrow();
        let Some(known) = known.as_ref() else { return f64::NAN };
        let (n, size, intervals) = (self.n, self.profile_size(), self.intervals());
        let (points, lanes) = (self.scheme.degree + 1, intervals * (self.scheme.degree + 1));
        let (mut own, mut states) = (vec![0.0; n * lanes], vec![0.0; n * lanes]);
        panel::by_component(&better[..size], points, n, &mut own);
        for (states, own) in states.chunks_exact_mut(lanes).zip(own.chunks_exact(lanes)) {
            self.sampling.sampled(own, intervals, states);
        }
        states.iter_mut().zip(&known.within).for_each(|(x, w)| *x -= w);
        let (parameters, times) =
            (self.setting.at(&better[size + 1..]), self.sampling.times(&self.mesh, self.forcing_periods));
        let batch =
            Batch { lanes, states: &states, parameters: Parameters::Shared(&parameters), times: &times, signs: &[] };
        let (mut f, mut fx) = (vec![0.0; n * lanes], vec![0.0; n * n * lanes]);
        self.setting.field.linearise(batch, &[], &mut f, &mut fx, &mut []);
        let trace = |lane: usize| (0..n).map(|i| fx[(i * n + i) * lanes + lane]).sum::<f64>();
        let mean = |j: usize| (0..points).map(|g| self.sampling.weight(g) * trace(g * intervals + j)).sum::<f64>();
        let total: f64 = (0..intervals).map(|j| (self.mesh[j + 1] - self.mesh[j]) * mean(j)).sum();
        (better[size] * total - self.trace).abs()
    }

    /// The multipliers from more accurate transitions, with the Jacobian along the profile, and along the profile
    /// without its error; before either of them those where every second interval is so.
    fn corrected_multipliers(&self, [u, better]: [&[f64]; 2], switched: &[Switched]) -> Option<[Vec<Complex64>; 4]> {
        let known = self.measured.borrow();
        let known = known.as_ref()?;
        if self.is_localised() {
            return self.locally_corrected(u, better, &known.within, switched);
        }
        let plain = self.transitions();
        if self.is_damped() {
            let finer = [self.finer_transitions(u, None)?, self.finer_transitions(better, Some(&known.within))?];
            return self.spectra_of(&plain, &finer, [u, better]);
        }
        let mut transitions = [plain.clone(), plain.clone()];
        let profiles = [Profile { u, without: None }, Profile { u: better, without: Some(&known.within) }];
        let room = &mut *self.room.borrow_mut();
        let mut first = 0;
        while first < self.intervals() {
            // Avoids a short piece at the end.
            let left = self.intervals() - first;
            let together = if self.in_columns().is_some() { FEW } else { TOGETHER };
            let count = if left < 3 * together / 2 { left } else { together };
            self.correct(first..first + count, &profiles, &mut transitions, room);
            first += count;
        }
        let [mut own, mut other] = transitions;
        let (square, block) = (self.n * self.n, self.block());
        for (transitions, orbit) in [(&mut own, u), (&mut other, better)] {
            let flow = self.flow(orbit);
            for found in switched {
                let j = found.interval;
                let nodes = &orbit[j * block..(j + 1) * block];
                let [_, refined] = flow.refined(found, &nodes[..self.n], self.interval(j), nodes)?;
                transitions[j * square..(j + 1) * square].copy_from_slice(&refined);
            }
        }
        self.spectra_of(&plain, &[own, other], [u, better])
    }

    /// Multipliers from given transitions and those improved in two ways, in the even intervals first.
    fn spectra_of(
        &self,
        plain: &[f64],
        [own, other]: &[Vec<f64>; 2],
        profiles: [&[f64]; 2],
    ) -> Option<[Vec<Complex64>; 4]> {
        let [frames, others] = profiles.map(|u| self.frames(u));
        let (own, other) = (&own[..], &other[..]);
        // Transitions of the even and of the odd intervals, and frames.
        let courses = [(own, plain, &frames), (own, own, &frames), (other, own, &frames), (other, other, &others)];
        let courses =
            courses.map(|(even, odd, frames)| floquet::Course { transitions: [even, odd], frames: frames.as_ref() });
        let found = floquet::several(courses, &self.scale)?.map(|found| found.multipliers);
        found.iter().flatten().all(|z| z.re.is_finite() && z.im.is_finite()).then_some(found)
    }

    /// Improves the transitions of a range of intervals, with the Jacobian along each of the profiles.
    fn correct(&self, piece: Range<usize>, profiles: &[Profile; 2], transitions: &mut [Vec<f64>; 2], room: &mut Room) {
        let (n, m, block, count) = (self.n, self.scheme.degree, self.block(), piece.len());
        let (square, lanes, size) = (n * n, count * (m + 1), self.profile_size());
        room.resize(n, m, count);
        let Room { own, states, f, nodes, jacobians, gains, .. } = room;
        let mesh = &self.mesh[piece.start..=piece.end];
        let times = self.sampling.times(mesh, self.forcing_periods);
        for (Profile { u, without }, fx) in profiles.iter().zip(&mut *jacobians) {
            panel::by_component(&u[piece.start * block..piece.end * block], m + 1, n, own);
            for (c, (states, own)) in states.chunks_exact_mut(lanes).zip(own.chunks_exact(lanes)).enumerate() {
                self.sampling.sampled(own, count, states);
                for (g, states) in states.chunks_exact_mut(count).enumerate().take(without.map_or(0, |_| m + 1)) {
                    let within = &without.unwrap_or(&[])[(c * (m + 1) + g) * self.intervals()..][piece.clone()];
                    states.iter_mut().zip(within).for_each(|(x, w)| *x -= w);
                }
            }
            let parameters = self.setting.at(&u[size + 1..]);
            let batch = Batch { lanes, states, parameters: Parameters::Shared(&parameters), times: &times, signs: &[] };
            self.setting.field.linearise(batch, &[], f, fx, &mut []);
        }
        let lengths = profiles
            .each_ref()
            .map(|profile| -> Vec<f64> { mesh.windows(2).map(|pair| (pair[1] - pair[0]) * profile.u[size]).collect() });
        let ([own, other], [more, less]) = (transitions, gains);
        let courses = &mut [
            Course { jacobians: &jacobians[0], lengths: &lengths[0], gains: more },
            Course { jacobians: &jacobians[1], lengths: &lengths[1], gains: less },
        ];
        if let Some(system) = self.in_columns() {
            defect::correct_in_columns(&self.sampling, system, piece.clone(), courses, n);
        } else {
            nodes.resize(m * square * count, 0.0);
            self.system.inner(piece.clone(), count, nodes);
            defect::correct(&self.sampling, nodes, courses, n);
        }
        for (transitions, gains) in [(own, more), (other, less)] {
            let own = transitions[piece.start * square..piece.end * square].chunks_exact_mut(square);
            for (j, own) in own.enumerate() {
                own.iter_mut().zip(gains[j..].iter().step_by(count)).for_each(|(g, gain)| *g += gain);
            }
        }
    }

    /// The system, if intervals are so large that each is corrected column by column.
    fn in_columns(&self) -> Option<&Condensed<f64>> {
        match &self.system {
            System::One(system) if self.n >= MANY => Some(system),
            _ => None,
        }
    }

    fn measured_errors(&self, u: &[f64]) -> Measured {
        let size = self.profile_size();
        let scale = self.relative_scale(u);
        let parameters = self.setting.at(&u[size + 1..]);
        let measure = |field: &dyn VectorField, profile: &[f64], mesh: &[f64]| {
            self.defect(field, &parameters, profile, mesh, u[size], &scale)
        };
        let mut whole = measure(self.setting.field, &u[..size], &self.mesh);
        if self.is_damped() {
            self.damp(u, &scale, &mut whole);
        }
        let Defect { mut local, mut within, mut ends, mut sources, mut misses } = whole;
        // An interval in which the orbit switches has the defects of its parts, but where a part is divided, the error
        // of the whole: the divisions are no part of the mesh, and without them the interval may be too long.
        let (n, inner, count, block) = (self.n, self.scheme.degree * self.n, self.intervals(), self.block());
        let flow = self.flow(u);
        for found in self.switched(u).iter() {
            let j = found.interval;
            within.iter_mut().skip(j).step_by(count).for_each(|w| *w = 0.0);
            sources[j * inner..(j + 1) * inner].fill(0.0);
            let (mut errors, mut missed) = (Vec::with_capacity(found.parts.len()), vec![0.0; n]);
            for part in &found.parts {
                let field = OneBranch { field: self.setting.field, signs: &part.signs };
                let own = measure(&field, &part.nodes, &part.ends);
                errors.push(own.local[0]);
                missed.iter_mut().zip(&own.misses).for_each(|(all, own)| *all += own);
            }
            local[j] = found.undivided(&errors, self.scheme.degree);
            // The defects of the parts add up to the size of what the interval misses; those of a part grow or cancel in
            // the parts after it.
            let nodes = &u[j * block..(j + 1) * block];
            let miss = flow
                .refined(found, &nodes[..n], self.interval(j), nodes)
                .map(|[end, _]| found.end.iter().zip(end).map(|(own, finer)| own - finer).collect::<Vec<_>>());
            ends[j * n..(j + 1) * n].copy_from_slice(miss.as_ref().unwrap_or(&missed));
            misses[j * n..(j + 1) * n].copy_from_slice(&missed);
        }
        let rhs = self.defects_of(&ends, &sources, u.len());
        let mut shift = vec![0.0; u.len()];
        match self.is_open() {
            true => self.solve_defects(&rhs, &mut shift),
            false => self.solve_closed(&rhs, &mut shift),
        }
        let response = self.relative_size(&shift, u);
        let sizes: Vec<f64> = misses
            .chunks_exact(self.n)
            .map(|e| e.iter().zip(&scale).map(|(v, s)| (v / s).abs()).fold(0.0, f64::max))
            .collect();
        let largest = sizes.iter().fold(f64::MIN_POSITIVE, |m: f64, s| m.max(*s));
        let gain = if response.is_finite() { response / largest } else { 1.0 };
        let mut errors: Vec<f64> = local.iter().zip(&sizes).map(|(l, s)| l + gain * s).collect();
        let (mut degeneracy, mut amplified) = (0.0, gain);
        if self.is_open() && self.setting.field.saddles(&parameters).is_none() {
            let (others, off, growth) = self.errors_of_response(u, &scale);
            errors.iter_mut().zip(others).for_each(|(own, other)| *own = own.max(other));
            degeneracy = off;
            amplified = amplified.max(growth);
        }
        let rounding = ROUNDING * self.intervals() as f64 * amplified;
        Measured { at: u.to_vec(), errors, rounding, shift, within, degeneracy }
    }

    /// Estimated error of the number that a boundary-value problem has in place of multipliers.
    pub(super) fn degeneracy_error(&self, u: &[f64], spectrum: &[Complex64]) -> f64 {
        /// Of the sign of the slope, next to a branch point, where the matrix is nearly singular.
        const ROUNDING: f64 = 100.0 * f64::EPSILON;
        self.errors(u);
        let off = self.measured.borrow().as_ref().map_or(f64::NAN, |known| known.degeneracy);
        let size = spectrum.first().map_or(f64::NAN, |z| (z - 1.0).norm());
        SPECTRUM_SAFE * off * size + ROUNDING
    }

    /// Defect of a profile.
    pub(super) fn defect(
        &self,
        field: &dyn VectorField,
        parameters: &[f64],
        profile: &[f64],
        mesh: &[f64],
        period: f64,
        scale: &[f64],
    ) -> Defect {
        let (room, periods) = (&mut self.room.borrow_mut().measure, self.forcing_periods);
        defect::measure(field, parameters, profile, period, periods, mesh, &self.scheme, &self.sampling, scale, room)
    }

    /// Defects as right-hand sides, `[unknowns]`.
    pub(super) fn defects_of(&self, ends: &[f64], sources: &[f64], unknowns: usize) -> Vec<f64> {
        let (block, inner) = (self.block(), self.scheme.degree * self.n);
        let mut rhs = vec![0.0; unknowns];
        for (own, (end, source)) in
            rhs.chunks_exact_mut(block).zip(ends.chunks_exact(self.n).zip(sources.chunks_exact(inner)))
        {
            own[..self.n].copy_from_slice(end);
            own[self.n..].copy_from_slice(source);
        }
        rhs
    }

    /// `[N][n]`: the flow at the left ends of intervals, relative to the scales.
    pub(super) fn flow_at_nodes(&self, u: &[f64]) -> Vec<f64> {
        let (n, count, block) = (self.n, self.intervals(), (self.scheme.degree + 1) * self.n);
        if self.is_damped() {
            // The polynomials satisfy the equations there, and f itself is not accurate where it is stiff.
            let m = self.scheme.degree;
            let slopes = &self.scheme.derivative[(m - 1) * (m + 1)..];
            let at = |j: usize, i: usize| {
                let before = (j + count - 1) % count;
                let rise: f64 = slopes.iter().enumerate().map(|(k, d)| d * u[before * block + k * n + i]).sum();
                rise / (self.h(before) * u[self.profile_size()] * self.scale[i])
            };
            return (0..count * n).map(|k| at(k / n, k % n)).collect();
        }
        let mut states = vec![0.0; n * count];
        for j in 0..count {
            for i in 0..n {
                states[i * count + j] = u[j * block + i];
            }
        }
        let mut f = vec![0.0; n * count];
        let parameters = self.setting.at(&u[self.profile_size() + 1..]);
        let batch = Batch {
            lanes: count,
            states: &states,
            parameters: Parameters::Shared(&parameters),
            times: &[],
            signs: &[],
        };
        self.setting.field.evaluate(batch, &mut f);
        let switched = self.switched(u);
        let at_left = switched.iter().map(|found| (found.interval, found.signs_at_left()));
        // A slide that reaches a node goes on there.
        let slides = switched.iter().filter(|found| found.slides_at_right());
        let at_right = slides.map(|found| ((found.interval + 1) % count, found.signs_at_right()));
        for (j, signs) in at_left.chain(at_right) {
            let batch = Batch { lanes: 1, states: &u[j * block..j * block + n], signs, ..batch };
            let mut own = vec![0.0; n];
            self.setting.field.evaluate(batch, &mut own);
            own.iter().enumerate().for_each(|(i, own)| f[i * count + j] = *own);
        }
        let mut flow = vec![0.0; n * count];
        for j in 0..count {
            for i in 0..n {
                flow[j * n + i] = f[i * count + j] / self.scale[i];
            }
        }
        flow
    }
}
