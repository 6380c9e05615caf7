//! Parts of the intervals in which an orbit switches, and the orbit with a mesh interval for each of them.

use super::Scheme;
use crate::diagram::Mesh;
use crate::linalg::{dot, larger};

/// A part of an interval between switchings.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    /// Normalised times of its ends.
    pub ends: [f64; 2],
    /// `[m + 1][n]`: left end and Gauss points.
    pub nodes: Vec<f64>,
    /// `[m + 1][n × (n + 1 + k)]`: derivatives in the left end of the interval and in T, λ₁ … λ_k.
    pub by: Vec<f64>,
    /// Signs of the switches.
    pub signs: Vec<f64>,
    /// The switch that changes sign at the right end, and true if f jumps there.
    pub(super) switch: Option<usize>,
    pub(super) jumps: bool,
    /// ∫ tr f_x dt, with the logarithm of the determinant of (4).
    pub(super) trace: f64,
}

/// An interval in which the orbit switches.
#[derive(Clone, Debug)]
pub(crate) struct Switched {
    /// Number of the interval.
    pub interval: usize,
    /// The parts, in order.
    pub parts: Vec<Part>,
    /// True if f jumps at a switching.
    pub jumps: bool,
    /// True if it is cut where the orbit comes close to a surface.
    pub(super) nears: bool,
    /// Largest value of every switch along the orbit.
    pub(super) sizes: Vec<f64>,
    /// Switchings at the left end, which have no part: signs before each, and the switch.
    pub(super) at_start: Vec<(Vec<f64>, usize)>,
    /// Logarithm of the determinants of (4) at the left end.
    pub(super) trace: f64,
    /// `[n]` and `[n × (n + 1 + k)]`: the right end and its derivatives.
    pub end: Vec<f64>,
    pub end_by: Vec<f64>,
}

impl Switched {
    /// ∫ tr f_x dt over the interval.
    pub fn trace(&self) -> f64 {
        self.trace + self.parts.iter().map(|part| part.trace).sum::<f64>()
    }

    /// True if the orbit switches in the interval or nearly does; parts may also be the pieces of one that is divided.
    pub(super) fn switches(&self) -> bool {
        self.nears || !self.at_start.is_empty() || self.parts.iter().any(|part| part.signs != self.parts[0].signs)
    }

    /// The largest error of the stretches between switchings, each as if it were not divided, from the errors of the
    /// parts. Errors grow with the power m + 1 of the length.
    pub fn undivided(&self, errors: &[f64], degree: usize) -> f64 {
        let (mut most, mut first) = (0.0, 0);
        for stretch in self.parts.chunk_by(|one, next| one.signs == next.signs) {
            let own = &errors[first..first + stretch.len()];
            first += stretch.len();
            let length = |part: &Part| part.ends[1] - part.ends[0];
            let longest = stretch.iter().map(length).fold(0.0, f64::max);
            let whole: f64 = stretch.iter().map(length).sum();
            // The shortest parts have errors of rounding.
            let own = stretch.iter().zip(own).filter(|(part, _)| length(part) > 0.5 * longest);
            let error = own.map(|(part, error)| error * (whole / length(part)).powi(degree as i32 + 1));
            most = error.fold(most, larger);
        }
        most
    }

    /// Signs of the switches at the left end that give the flow there: those before its switchings, or, of an orbit that
    /// slides, those with which it does.
    pub fn signs_at_left(&self) -> &[f64] {
        match self.at_start.first() {
            Some((before, _)) if !self.parts[0].signs.contains(&0.0) => before,
            _ => &self.parts[0].signs,
        }
    }

    /// Signs of the switches at the right end.
    pub fn signs_at_right(&self) -> &[f64] {
        &self.parts[self.parts.len() - 1].signs
    }

    /// True if the orbit slides at the right end.
    pub fn slides_at_right(&self) -> bool {
        self.signs_at_right().contains(&0.0)
    }

    /// The part and the place in it of a place in the interval.
    fn part(&self, t: f64) -> (usize, f64) {
        let last = self.parts.len() - 1;
        let own = self.parts.iter().position(|part| t <= part.ends[1]).unwrap_or(last);
        let part = &self.parts[own];
        (own, ((t - part.ends[0]) / (part.ends[1] - part.ends[0])).clamp(0.0, 1.0))
    }

    /// The flow at the Gauss points of the interval, `[m][n]`.
    pub(super) fn values(&self, scheme: &Scheme, ends: [f64; 2]) -> Vec<f64> {
        let n = self.end.len();
        let mut out = vec![0.0; scheme.degree * n];
        for (x, c) in out.chunks_exact_mut(n).zip(&scheme.nodes[1..]) {
            let (part, s) = self.part(ends[0] + c * (ends[1] - ends[0]));
            scheme.value_into(s, &self.parts[part].nodes, x);
        }
        out
    }

    /// Values that the flow requires at the inner nodes, `[m][n]`: its values there, but at the last node what gives
    /// its right end.
    pub fn inner(&self, scheme: &Scheme, ends: [f64; 2]) -> Vec<f64> {
        let n = self.end.len();
        let mut out = self.values(scheme, ends);
        fit(scheme, &self.parts[0].nodes[..n], &mut out, &self.end);
        out
    }

    /// Derivatives of the flow at the Gauss points and at the right end, `[m + 1][n × (n + 1 + k)]`.
    pub fn derivatives(&self, scheme: &Scheme, ends: [f64; 2]) -> Vec<f64> {
        let of_parts: Vec<&[f64]> = self.parts.iter().map(|part| &part.by[..]).collect();
        let mut out = self.at_nodes(scheme, ends, &of_parts, self.end_by.len());
        out.extend_from_slice(&self.end_by);
        out
    }

    /// Polynomials `[m + 1][size]` on the parts, at the Gauss points of the interval.
    pub(super) fn at_nodes(
        &self,
        scheme: &Scheme,
        ends: [f64; 2],
        of_parts: &[impl AsRef<[f64]>],
        size: usize,
    ) -> Vec<f64> {
        let mut out = vec![0.0; scheme.degree * size];
        for (to, c) in out.chunks_exact_mut(size).zip(&scheme.nodes[1..]) {
            let (part, s) = self.part(ends[0] + c * (ends[1] - ends[0]));
            for (weight, own) in scheme.interpolation(s).iter().zip(of_parts[part].as_ref().chunks_exact(size)) {
                to.iter_mut().zip(own).for_each(|(o, v)| *o += weight * v);
            }
        }
        out
    }
}

/// Mesh and profile of an orbit with an interval for each part between switchings; `block` is the size of an interval.
pub(crate) fn cut(profile: &[f64], mesh: &Mesh, switched: &[Switched], block: usize) -> (Mesh, Vec<f64>) {
    if switched.is_empty() {
        return (mesh.clone(), profile.to_vec());
    }
    let (mut nodes, mut out) = (vec![0.0], Vec::with_capacity(profile.len() + 4 * switched.len() * block));
    let mut next = switched.iter().peekable();
    for (j, own) in profile.chunks_exact(block).enumerate() {
        match next.next_if(|found| found.interval == j) {
            Some(found) => {
                out.extend(found.parts.iter().flat_map(|part| &part.nodes));
                let inner = &found.parts[..found.parts.len() - 1];
                nodes.extend(inner.iter().map(|part| part.ends[1]));
            }
            None => out.extend_from_slice(own),
        }
        nodes.push(mesh[j + 1]);
    }
    (nodes.into(), out)
}

/// A direction (profile, T, λ …) at that orbit, on the mesh with an interval for each part.
pub(crate) fn cut_direction(along: &[f64], intervals: usize, switched: &[Switched], block: usize) -> Vec<f64> {
    let (profile, scalars) = along.split_at(intervals * block);
    let mut out = Vec::with_capacity(along.len() + 4 * switched.len() * block);
    let mut next = switched.iter().peekable();
    for (j, own) in profile.chunks_exact(block).enumerate() {
        let Some(found) = next.next_if(|found| found.interval == j) else {
            out.extend_from_slice(own);
            continue;
        };
        let direction: Vec<f64> = own[..found.end.len()].iter().chain(scalars).copied().collect();
        let rows = found.parts.iter().flat_map(|part| part.by.chunks_exact(direction.len()));
        out.extend(rows.map(|row| dot(row, &direction)));
    }
    out.extend_from_slice(scalars);
    out
}

/// The first `width` columns of the identity, and zeros, `[n × width]`.
pub(crate) fn identity(n: usize, width: usize) -> Vec<f64> {
    (0..n * width).map(|at| if at % width == at / width { 1.0 } else { 0.0 }).collect()
}

/// Replaces the value at the last node, so that the polynomial from `left` through the nodes `[m][size]` ends at `end`.
pub(crate) fn fit(scheme: &Scheme, left: &[f64], nodes: &mut [f64], end: &[f64]) {
    let (m, size) = (scheme.degree, end.len());
    let (others, last) = nodes.split_at_mut((m - 1) * size);
    for (k, to) in last.iter_mut().enumerate() {
        let rest = (0..m - 1).map(|i| scheme.end[i + 1] * others[i * size + k]).sum::<f64>();
        *to = (end[k] - scheme.end[0] * left[k] - rest) / scheme.end[m];
    }
}
