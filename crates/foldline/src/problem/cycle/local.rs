//! Cycles of fields that are linear but for a few local forces: the structure, found in the Jacobians themselves.
//!
//! **Idea.** Along an orbit only some columns of f_x vary, and the variations span few directions. Both are read off the
//! Jacobians at the collocation points, so that a model needs no declaration. The rest of f_x is constant and is treated in
//! modal coordinates ([`crate::linalg::local`]).
//!
//! **Equations.** With J the Jacobian at the point that is typical for the entry that varies most, and D⁻¹ the scales of
//! the components:
//!
//! ```text
//!   (1)  f_x(k) - J = P c_k E,   E selects the columns that vary, P = D Q with orthonormal Q
//! ```
//!
//! **Departures.** Exact up to 1e-12 of the largest variation.
//!
//! **Fails when** more than a quarter of the columns vary, or the variations span more than [`MOST`] directions; the
//! general system is then used.

use super::CycleProblem;
use crate::contract::{Batch, Parameters};
use crate::linalg::dense::MANY;
use crate::linalg::local::interval::{Common, Interval, Weights};
use crate::linalg::local::modes::Modes;
use crate::linalg::local::{Link, LocalSystem, Parts, carry, changed};
use crate::linalg::span::spanned;
use crate::linalg::{axpy, dot, panel};
use crate::problem::gauss::Scheme;
use crate::problem::piecewise::{self, Switched};
use crate::stability::floquet::{self, Course, Floquet, Frames};
use num_complex::Complex64;

/// Largest number of local forces.
const MOST: usize = 12;

/// Number of intervals whose Jacobians are evaluated together.
const FEW: usize = 8;

/// (1): what varies.
pub(super) struct Structure {
    /// J, row-major.
    reference: Vec<f64>,
    /// Columns that vary.
    columns: Vec<usize>,
    /// `[r][n]`: columns of Q.
    basis: Vec<f64>,
    /// `[n]`: D.
    sizes: Vec<f64>,
}

impl Structure {
    /// Structure of Jacobians `[n·n × lanes]` for components of the given sizes, and the derivatives c `[lanes][r × s]`.
    fn of(fx: &[f64], lanes: usize, sizes: &[f64]) -> Option<(Structure, Vec<f64>)> {
        let n = sizes.len();
        let entry = |i: usize, k: usize| &fx[(i * n + k) * lanes..(i * n + k + 1) * lanes];
        let mut columns = Vec::new();
        let (mut widest, mut typical) = (0.0, 0);
        for k in 0..n {
            let mut varies = false;
            for i in 0..n {
                let own = entry(i, k);
                if own.iter().all(|x| *x == own[0]) {
                    continue;
                }
                varies = true;
                let [low, high] =
                    own.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(*x), b.max(*x)]);
                let width = (high - low) * sizes[k] / sizes[i];
                if width > widest {
                    (widest, typical) = (width, i * n + k);
                }
            }
            if varies {
                columns.push(k);
            }
        }
        if 4 * columns.len() > n || !widest.is_finite() {
            return None;
        }
        let mut order: Vec<usize> = (0..lanes).collect();
        let own = &fx[typical * lanes..(typical + 1) * lanes];
        order.sort_by(|a, b| own[*a].total_cmp(&own[*b]));
        let lane = order[lanes / 2];
        let reference: Vec<f64> = (0..n * n).map(|k| fx[k * lanes + lane]).collect();
        let mut structure = Structure { reference, columns, basis: Vec::new(), sizes: sizes.to_vec() };
        structure.span(fx, lanes)?;
        let slopes = (0..lanes).flat_map(|lane| structure.slopes(fx, lanes, lane)).collect();
        Some((structure, slopes))
    }

    /// Scaled variation of column k in a lane, `[n]`.
    fn variation(&self, fx: &[f64], lanes: usize, lane: usize, k: usize) -> Vec<f64> {
        let n = self.sizes.len();
        let at =
            |i: usize| (fx[(i * n + k) * lanes + lane] - self.reference[i * n + k]) * self.sizes[k] / self.sizes[i];
        (0..n).map(at).collect()
    }

    /// Finds Q by orthogonalisation, the largest variation first.
    fn span(&mut self, fx: &[f64], lanes: usize) -> Option<()> {
        let mut left: Vec<Vec<f64>> = Vec::new();
        for k in &self.columns {
            left.extend(
                (0..lanes).map(|lane| self.variation(fx, lanes, lane, *k)).filter(|v| v.iter().any(|x| *x != 0.0)),
            );
        }
        self.basis = spanned(left, MOST)?;
        Some(())
    }

    fn forces(&self) -> usize {
        self.basis.len() / self.sizes.len()
    }

    /// c `[r × s]` in a lane.
    fn slopes(&self, fx: &[f64], lanes: usize, lane: usize) -> Vec<f64> {
        let (n, r, s) = (self.sizes.len(), self.forces(), self.columns.len());
        let mut out = vec![0.0; r * s];
        for (c, k) in self.columns.iter().enumerate() {
            let own = self.variation(fx, lanes, lane, *k);
            for (f, q) in self.basis.chunks_exact(n).enumerate() {
                // Local coordinates are in units of their sizes.
                out[f * s + c] = dot(q, &own);
            }
        }
        out
    }

    /// Modal form.
    fn common(&self) -> Option<Common> {
        let n = self.sizes.len();
        let modes = Modes::of(&self.reference, &self.sizes)?;
        let pair = |at: usize, size: usize, of: &dyn Fn(usize) -> f64| {
            Complex64::new(of(at), if size == 2 { of(at + 1) } else { 0.0 })
        };
        let (mut pushed, mut seen) = (Vec::new(), Vec::new());
        for mode in &modes.list {
            for q in self.basis.chunks_exact(n) {
                let of = |row: usize| (0..n).map(|i| modes.to[row * n + i] * self.sizes[i] * q[i]).sum();
                pushed.push(pair(mode.at, mode.size, &of));
            }
            for k in &self.columns {
                seen.push(pair(mode.at, mode.size, &|c| modes.from[k * n + c] / self.sizes[*k]));
            }
        }
        Some(Common { modes, forces: self.forces(), coordinates: self.columns.len(), pushed, seen })
    }
}

/// The factorised system and the structure behind it.
pub(super) struct Localised {
    pub(super) system: LocalSystem,
    structure: Structure,
}

impl CycleProblem<'_> {
    /// Uses the general system whatever the structure of the field, for comparison.
    pub fn without_structure(mut self) -> Self {
        self.structured = false;
        self
    }

    /// True if the last factorisation made use of local forces.
    pub fn is_localised(&self) -> bool {
        self.local.is_some()
    }

    /// Factorises with local forces at `u`, where f is linearised; `None` if the field does not have this structure or the result would not be
    /// accurate.
    pub(super) fn localised(&mut self, u: &[f64], rows: &[f64]) -> Option<Localised> {
        if !self.structured || self.n < MANY || self.width != 1 || self.is_open() {
            return None;
        }
        let (lanes, size, n, m) = (self.lanes(), self.profile_size(), self.n, self.scheme.degree);
        let (structure, slopes) = Structure::of(&self.fx, lanes, &self.scale)?;
        let common = structure.common()?;
        let switched = self.switched(u);
        let (count, each) = (self.intervals(), m * structure.forces() * structure.columns.len());
        let weights = Weights { integration: &self.scheme.integration, end: &self.scheme.end };
        let mut links = Vec::with_capacity(count);
        for j in 0..count {
            links.push(match switched.iter().find(|found| found.interval == j) {
                Some(found) => self.given(found, &common),
                None => {
                    let own = Interval::new(&common, weights, self.h(j) * u[size], &slopes[j * each..(j + 1) * each]);
                    Link::Low(Box::new(own.ok()?))
                }
            });
        }
        let frozen = |j: usize| switched.iter().any(|found| found.interval == j);
        let trace_at = |lane: usize| (0..n).map(|i| self.fx[i * (n + 1) * lanes + lane]).sum::<f64>();
        let smooth: f64 = (0..count)
            .filter(|j| !frozen(*j))
            .map(|j| {
                let mean: f64 = (0..m).map(|k| self.scheme.weights[k] * trace_at(j * m + k)).sum();
                self.h(j) * u[size] * mean
            })
            .sum();
        let trace = smooth + switched.iter().map(Switched::trace).sum::<f64>();
        let parts = Parts {
            common,
            scheme: weights,
            links,
            columns: self.columns_of_scalars(u[size], &frozen),
            border: self.border(rows, u.len()),
            corner: self.corner(rows, u.len()),
            closure: 1.0,
        };
        let system = LocalSystem::new(parts).ok()?;
        self.trace = trace;
        Some(Localised { system, structure })
    }

    /// `[q][N][m][n]`: derivatives of (1) of [`super`] with respect to the period and λ.
    fn columns_of_scalars(&self, period: f64, frozen: &dyn Fn(usize) -> bool) -> Vec<f64> {
        let (n, m, count, lanes, free) =
            (self.n, self.scheme.degree, self.intervals(), self.lanes(), self.setting.freedom());
        let mut out = vec![0.0; (1 + free) * count * m * n];
        for q in 0..=free {
            for j in (0..count).filter(|j| !frozen(*j)) {
                let h = if q == 0 { self.h(j) } else { self.h(j) * period };
                for i in 0..m {
                    let to = &mut out[((q * count + j) * m + i) * n..][..n];
                    for k in 0..m {
                        let share = -h * self.scheme.integration[i * m + k];
                        let at = j * m + k;
                        for (c, to) in to.iter_mut().enumerate() {
                            let value =
                                if q == 0 { self.f[c * lanes + at] } else { self.fp[(c * free + q - 1) * lanes + at] };
                            *to += share * value;
                        }
                    }
                }
            }
        }
        out
    }

    /// `[q][N][(m + 1) n]`: the phase condition and the rows of the continuation.
    fn border(&self, rows: &[f64], unknowns: usize) -> Vec<f64> {
        let (n, m, count, block) = (self.n, self.scheme.degree, self.intervals(), self.block());
        let mut out = vec![0.0; (1 + self.setting.freedom()) * count * block];
        for j in 0..count {
            for i in 0..m {
                let weight = self.h(j) * self.scheme.weights[i];
                let at = |q: usize| (q * count + j) * block + (i + 1) * n;
                let own = &self.phase[(j * m + i) * n..][..n];
                out[at(0)..at(0) + n].iter_mut().zip(own).for_each(|(to, x)| *to = weight * x);
                for (r, row) in rows.chunks_exact(unknowns).enumerate() {
                    let own = &row[j * block + (i + 1) * n..][..n];
                    let to = &mut out[at(r + 1)..at(r + 1) + n];
                    for ((to, x), scale) in to.iter_mut().zip(own).zip(&self.scale) {
                        *to = weight * x / (scale * scale * n as f64);
                    }
                }
            }
        }
        out
    }

    /// `[q × q]`: the scalars in the border.
    fn corner(&self, rows: &[f64], unknowns: usize) -> Vec<f64> {
        let (size, q) = (self.profile_size(), 1 + self.setting.freedom());
        let mut corner = vec![0.0; q * q];
        corner[0] = f64::from(u8::from(self.forcing_periods > 0));
        for (r, row) in rows.chunks_exact(unknowns).enumerate() {
            let corner = &mut corner[(1 + r) * q..(2 + r) * q];
            corner[0] = row[size] / (self.period_scale * self.period_scale);
            let scaled = corner[1..].iter_mut().zip(&row[size + 1..]).zip(&self.axis_scales);
            scaled.for_each(|((to, x), scale)| *to = x / (scale * scale));
        }
        corner
    }

    /// An interval in which the orbit switches.
    fn given(&self, found: &Switched, common: &Common) -> Link {
        let (n, m) = (self.n, self.scheme.degree);
        let width = n + 1 + self.setting.freedom();
        let mut by = found.derivatives(&self.scheme, self.interval(found.interval));
        let end = by.split_off(by.len() - n * width);
        piecewise::fit(&self.scheme, &piecewise::identity(n, width), &mut by, &end);
        let mut inner = vec![0.0; m * n * width];
        let mut transition = vec![0.0; n * n];
        (0..n).for_each(|i| transition[i * (n + 1)] = self.scheme.end[0]);
        for (k, (by, to)) in by.chunks_exact(n * width).zip(inner.chunks_exact_mut(n * width)).enumerate() {
            let states: Vec<f64> = by.chunks_exact(width).flat_map(|row| &row[..n]).copied().collect();
            let scalars: Vec<f64> = by.chunks_exact(width).flat_map(|row| &row[n..]).copied().collect();
            let states = modal(common, &states, n);
            axpy(self.scheme.end[k + 1], &states, &mut transition);
            for (i, row) in to.chunks_exact_mut(width).enumerate() {
                row[..n].copy_from_slice(&states[i * n..(i + 1) * n]);
                for (c, to) in row[n..].iter_mut().enumerate() {
                    *to = (0..n).map(|l| common.modes.to[i * n + l] * scalars[l * (width - n) + c]).sum();
                }
            }
        }
        Link::Given { inner, transition }
    }

    /// Multipliers from the product of all transitions.
    pub(super) fn local_floquet(&self, u: &[f64], local: &Localised) -> Floquet {
        let own = self.of_product(u, local, local.system.product());
        Floquet { log_product: local.system.log_determinant(), ..own }
    }

    /// Multipliers of a product in modal coordinates along the orbit `u`.
    fn of_product(&self, u: &[f64], local: &Localised, product: &[f64]) -> Floquet {
        let n = self.n;
        let frames = (!self.is_forced()).then(|| {
            let flow = self.flow_at_nodes(u);
            let first: Vec<f64> = flow[..n].iter().zip(&self.scale).map(|(f, scale)| f * scale).collect();
            let to = &local.system.common().modes.to;
            let own: Vec<f64> = to.chunks_exact(n).map(|row| dot(row, &first)).collect();
            Frames::along(&own, n)
        });
        floquet::one(Course { transitions: [product; 2], frames: frames.as_ref() }, &vec![1.0; n])
    }

    /// [`CycleProblem::corrected_multipliers`] with local forces: transitions by collocation of the next higher degree.
    pub(super) fn locally_corrected(
        &self,
        u: &[f64],
        better: &[f64],
        within: &[f64],
        switched: &[Switched],
    ) -> Option<[Vec<Complex64>; 4]> {
        let local = self.local.as_ref()?;
        let (n, common) = (self.n, local.system.common());
        let mut own = self.finer_links(u, None, local)?;
        let mut other = self.finer_links(better, Some(within), local)?;
        let block = self.block();
        for (links, orbit) in [(&mut own, u), (&mut other, better)] {
            let flow = self.flow(orbit);
            for found in switched {
                let j = found.interval;
                let nodes = &orbit[j * block..(j + 1) * block];
                let [_, refined] = flow.refined(found, &nodes[..n], self.interval(j), nodes)?;
                links[j] = Link::Given { inner: Vec::new(), transition: modal(common, &refined, n) };
            }
        }
        let plain = local.system.links();
        let courses = [([&own[..], plain], u), ([&own, &own], u), ([&other, &own], u), ([&other, &other], better)];
        let found = courses.map(|(links, orbit)| {
            let mut product: Vec<f64> = (0..n * n).map(|k| f64::from(u8::from(k % (n + 1) == 0))).collect();
            (0..self.intervals()).for_each(|j| carry(common, &links[j % 2][j], &mut product, n));
            self.of_product(orbit, local, &product).multipliers
        });
        found.iter().flatten().all(|z| z.re.is_finite() && z.im.is_finite()).then_some(found)
    }

    /// Intervals by collocation of degree m + 1 along a profile, with errors subtracted within intervals as in
    /// [`super::errors`].
    fn finer_links(&self, u: &[f64], without: Option<&[f64]>, local: &Localised) -> Option<Vec<Link>> {
        let (n, m, block, size) = (self.n, self.scheme.degree, self.block(), self.profile_size());
        let finer = Scheme::at(m + 1, self.scheme.points);
        let weights = Weights { integration: &finer.integration, end: &finer.end };
        let (common, structure) = (local.system.common(), &local.structure);
        // The parameters are those of the solution: J belongs to them.
        let known = self.setting.at(&self.anchored_scalars(u));
        let mut links = Vec::with_capacity(self.intervals());
        let mut first = 0;
        while first < self.intervals() {
            let count = FEW.min(self.intervals() - first);
            let lanes = count * (m + 1);
            let [mut own, mut states, mut f] = [(); 3].map(|()| vec![0.0; n * lanes]);
            let mut fx = vec![0.0; n * n * lanes];
            panel::by_component(&u[first * block..(first + count) * block], m + 1, n, &mut own);
            for (c, (states, own)) in states.chunks_exact_mut(lanes).zip(own.chunks_exact(lanes)).enumerate() {
                self.sampling.sampled(own, count, states);
                for (g, states) in states.chunks_exact_mut(count).enumerate().take(without.map_or(0, |_| m + 1)) {
                    let within = &without.unwrap_or(&[])[(c * (m + 1) + g) * self.intervals()..][first..first + count];
                    states.iter_mut().zip(within).for_each(|(x, w)| *x -= w);
                }
            }
            let times = self.sampling.times(&self.mesh[first..=first + count], self.forcing_periods);
            let parameters = Parameters::Shared(&known);
            let batch = Batch { lanes, states: &states, parameters, times: &times, signs: &[] };
            self.setting.field.linearise(batch, &[], &mut f, &mut fx, &mut []);
            for j in 0..count {
                let at = |g: usize| structure.slopes(&fx, lanes, g * count + j);
                let slopes: Vec<f64> = (0..=m).flat_map(at).collect();
                let interval = Interval::new(common, weights, self.h(first + j) * u[size], &slopes);
                links.push(Link::Low(Box::new(interval.ok()?)));
            }
            first += count;
        }
        Some(links)
    }

    /// The unknowns λ of the solution itself, or of `u` if there is none.
    fn anchored_scalars(&self, u: &[f64]) -> Vec<f64> {
        let known = self.measured.borrow();
        let size = self.profile_size();
        known.as_ref().map_or_else(|| u[size + 1..].to_vec(), |known| known.scalars(size).to_vec())
    }
}

/// A matrix `[n × n]` in modal coordinates.
fn modal(common: &Common, a: &[f64], n: usize) -> Vec<f64> {
    changed(&changed(&common.modes.to, a, n), &common.modes.from, n)
}
