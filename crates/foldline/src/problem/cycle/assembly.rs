//! The matrix of a cycle, equations (1) to (3) of [`super`] linearised, and its antiperiodic variant.

use super::CycleProblem;
use crate::contract::{Batch, Parameters, Singular};
use crate::linalg::condensed::Condensed;
use crate::linalg::lane::{Eight, Lane};
use crate::linalg::max_abs;
use crate::linalg::system::{System, either};
use crate::problem::gauss::Scheme;
use crate::problem::piecewise::{self, Switched};
use std::sync::Arc;

impl CycleProblem<'_> {
    /// Profile of an antiperiodic null vector of the variational equation at `u` (it changes sign after one period),
    /// which is the direction of period doubling; `None` if the computation fails. The layout is that of the profile.
    pub fn antiperiodic_direction(&mut self, u: &[f64]) -> Option<Vec<f64>> {
        let row = vec![0.0; self.setting.freedom() * u.len()];
        self.local = None;
        self.fill(u, &row).ok()?;
        let q = 1 + self.setting.freedom();
        // A unit corner block freezes the scalars, so that only the profile varies.
        either!(&mut self.system, s => {
            s.border.fill(Default::default());
            (0..q * q).for_each(|k| s.corner[k] = if k % (q + 1) == 0 { 1.0 } else { 0.0 });
        });
        self.system.eliminate(-1.0).ok()?;
        let size = self.profile_size();
        let mut v: Vec<f64> = (0..size + q).map(|k| ((k * k) as f64 * 0.7 + 0.3).sin()).collect();
        let mut next = v.clone();
        for _ in 0..4 {
            v[size..].fill(0.0);
            self.system.solve(&v, &mut next);
            let norm = max_abs(&next);
            if !norm.is_finite() || norm == 0.0 {
                return None;
            }
            v.iter_mut().zip(&next).for_each(|(a, b)| *a = b / norm);
        }
        v.truncate(size);
        Some(v)
    }

    /// Gathers left ends and Gauss points, component-major, with the intervals that the solver treats together side by
    /// side: point i of place t in a lane is number (t m + i) W + lane. Lanes beyond the last interval repeat it.
    pub(super) fn gather(&mut self, u: &[f64]) {
        match self.width {
            1 => self.gather_lanes::<f64>(u),
            _ => self.gather_lanes::<Eight>(u),
        }
    }

    fn gather_lanes<T: Lane>(&mut self, u: &[f64]) {
        let (n, m, length, lanes) = (self.n, self.scheme.degree, self.length, self.lanes());
        let (block, last) = ((m + 1) * n, self.intervals() - 1);
        for t in 0..length {
            let own: [&[f64]; 8] = std::array::from_fn(|lane| {
                let j = (lane % T::COUNT * length + t).min(last);
                &u[j * block..(j + 1) * block]
            });
            for c in 0..n {
                let put = |to: &mut [f64], from: usize| {
                    let x = T::each(|lane| own[lane][from]);
                    to[..T::COUNT].copy_from_slice(x.lanes());
                };
                put(&mut self.ends[(c * length + t) * T::COUNT..], c);
                let states = &mut self.states[c * lanes + t * m * T::COUNT..][..m * T::COUNT];
                states.chunks_exact_mut(T::COUNT).enumerate().for_each(|(k, to)| put(to, (k + 1) * n + c));
            }
        }
    }

    /// Evaluates f and its derivatives at `u`.
    pub(super) fn linearise(&mut self, u: &[f64]) {
        self.gather(u);
        let known = self.setting.at(&u[self.profile_size() + 1..]);
        let (lanes, parameters) = (self.lanes(), Parameters::Shared(&known));
        let batch = Batch { lanes, states: &self.states, parameters, times: &self.times, signs: &[] };
        self.setting.linearise(batch, &mut self.f, &mut self.fx, &mut self.fp);
    }

    /// Fills the blocks after [`CycleProblem::linearise`] and condenses them, each while it is in the cache. Returns the
    /// intervals in which the orbit switches.
    ///
    /// # Errors
    /// [`Singular`] if the block of an interval is.
    pub(super) fn condense_all(&mut self, u: &[f64]) -> Result<Arc<Vec<Switched>>, Singular> {
        let (lanes, size) = (self.lanes(), self.profile_size());
        for (coupled, entry) in self.coupled.iter_mut().zip(self.fx.chunks_exact(lanes)) {
            // Couplings are never removed, so that the order of elimination rarely changes.
            *coupled |= !vanishes(entry);
        }
        let switched = self.switched(u);
        switched.iter().for_each(|found| self.freeze(found.interval));
        either!(&mut self.system, s => s.couple(&self.coupled));
        either!(&mut self.system, s => s.measure_in(self.setting.scales, &self.scale));
        let linear = Linear {
            n: self.n,
            free: self.setting.freedom(),
            scheme: &self.scheme,
            lengths: &self.lengths,
            period: u[size],
            f: &self.f,
            fx: &self.fx,
            fp: &self.fp,
            phase: &self.phase,
            coupled: &self.coupled,
        };
        let trace = either!(&mut self.system, s => write(linear, s)?);
        self.trace = trace + switched.iter().map(Switched::trace).sum::<f64>();
        Ok(switched)
    }

    /// The matrix at `u`, condensed. The `rows` act through [`crate::contract::ZeroProblem::dot`].
    ///
    /// # Errors
    /// [`Singular`] if the block of an interval is.
    pub(super) fn fill(&mut self, u: &[f64], rows: &[f64]) -> Result<(), Singular> {
        self.linearise(u);
        self.assemble(u, rows)
    }

    /// [`CycleProblem::fill`] after [`CycleProblem::linearise`].
    pub(super) fn assemble(&mut self, u: &[f64], rows: &[f64]) -> Result<(), Singular> {
        let size = self.profile_size();
        self.lay_phase();
        let switched = self.condense_all(u)?;
        let known = self.setting.at(&u[size + 1..]);
        let (q, first) = (self.system.shape().1, 1 + self.integrals());
        let corner = either!(&mut self.system, s => &mut s.corner);
        corner.fill(0.0);
        corner[0] = f64::from(u8::from(self.forcing_periods > 0));
        for (r, row) in rows.chunks_exact(u.len()).enumerate() {
            let corner = &mut corner[(first + r) * q..(first + 1 + r) * q];
            corner[0] = row[size] / (self.period_scale * self.period_scale);
            let scaled = corner[1..].iter_mut().zip(&row[size + 1..]).zip(&self.axis_scales);
            scaled.for_each(|((to, x), scale)| *to = x / (scale * scale));
        }
        for (r, row) in rows.chunks_exact(u.len()).enumerate() {
            self.fill_row(first + r, &row[..size]);
        }
        if self.is_open() {
            self.open_ends(u, &known);
        }
        for found in switched.iter() {
            let mut by = found.derivatives(&self.scheme, self.interval(found.interval));
            let width = self.n + q;
            let end = by.split_off(by.len() - self.n * width);
            let left: Vec<f64> = piecewise::identity(self.n, width);
            piecewise::fit(&self.scheme, &left, &mut by, &end);
            self.system.replace(found.interval, &by);
        }
        Ok(())
    }

    /// Makes f constant in an interval whose equations are those of the piecewise flow.
    fn freeze(&mut self, j: usize) {
        let (m, lanes) = (self.scheme.degree, self.lanes());
        let first = j % self.length * m * self.width + j / self.length;
        for values in [&mut self.f, &mut self.fx, &mut self.fp] {
            for own in values.chunks_exact_mut(lanes) {
                (0..m).for_each(|i| own[first + i * self.width] = 0.0);
            }
        }
    }

    /// Writes a border row that acts on the profile through the inner product.
    pub(super) fn fill_row(&mut self, r: usize, row: &[f64]) {
        let (n, m) = (self.n, self.scheme.degree);
        let weights: Vec<f64> = (0..m * n)
            .map(|k| self.scheme.weights[k / n] / (self.scale[k % n] * self.scale[k % n] * n as f64))
            .collect();
        let (lengths, order) = (&self.lengths, m * n);
        either!(&mut self.system, s => {
            let slots: Vec<usize> = (0..order).map(|k| s.slot(k / n, k % n)).collect();
            let size = self.length * (order + n);
            let border = &mut s.border[r * size..(r + 1) * size];
            lay(Row { row, weights: &weights, slots: &slots, lengths, border, n });
        });
    }
}

/// A border row, to be distributed over the lanes.
struct Row<'a, 'b, T> {
    /// `[N][(m + 1) n]`.
    row: &'a [f64],
    /// `[m n]`: weights, and the slot of each.
    weights: &'a [f64],
    slots: &'a [usize],
    /// `[L][W]`, zero beyond the last interval.
    lengths: &'a [f64],
    /// `[L][(m + 1) n]`.
    border: &'b mut [T],
    n: usize,
}

fn lay<T: Lane>(row: Row<T>) {
    T::dispatch(row);
}

impl<T: Lane> pulp::NullaryFnOnce for Row<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Row { row, weights, slots, lengths, border, n } = self;
        let block = weights.len() + n;
        let (length, last) = (border.len() / block, row.len() / block - 1);
        for (t, (own, lengths)) in border.chunks_exact_mut(block).zip(lengths.chunks_exact(T::COUNT)).enumerate() {
            let (ends, inside) = own.split_at_mut(n);
            ends.fill(T::default());
            // Beyond the last interval the length is zero.
            let mut rows = [&row[..block]; 8];
            for lane in 0..T::COUNT {
                let j = (lane * length + t).min(last);
                rows[lane] = &row[j * block..(j + 1) * block];
            }
            let h = T::load(lengths);
            for (k, (weight, slot)) in weights.iter().zip(slots).enumerate() {
                inside[*slot] = h * T::splat(*weight) * T::each(|lane| rows[lane][n + k]);
            }
        }
    }
}

/// A linearised cycle, to be written to the blocks.
struct Linear<'a> {
    n: usize,
    free: usize,
    scheme: &'a Scheme,
    /// `[L][W]`: h_j, zero beyond the last interval.
    lengths: &'a [f64],
    period: f64,
    f: &'a [f64],
    fx: &'a [f64],
    fp: &'a [f64],
    phase: &'a [f64],
    /// `[n × n]`: true for entries of f_x that are not zero everywhere.
    coupled: &'a [bool],
}

/// Writes equation (1) and the phase row, and condenses. Returns ∫ tr f_x dt over the period.
fn write<T: Lane>(linear: Linear, system: &mut Condensed<T>) -> Result<f64, Singular> {
    T::dispatch(Write { linear, system })
}

struct Write<'a, 'b, T> {
    linear: Linear<'a>,
    system: &'b mut Condensed<T>,
}

impl<T: Lane> pulp::NullaryFnOnce for Write<'_, '_, T> {
    type Output = Result<f64, Singular>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        // For common sizes the dimensions are constants, and every block is condensed while it is in the cache. This
        // compiles the whole factorisation once more, so it is not done for all sizes.
        let plain = self.system.shape().1 == 1 + self.linear.free;
        match (self.linear.n, self.linear.scheme.degree, self.linear.free) {
            (4, 4, 1) if T::COUNT > 1 && plain => self.written::<true>(4, 4, 1),
            (n, m, free) => self.written::<false>(n, m, free),
        }
    }
}

impl<T: Lane> Write<'_, '_, T> {
    #[inline(always)]
    fn written<const CONDENSED: bool>(self, n: usize, m: usize, free: usize) -> Result<f64, Singular> {
        let Write { linear, system } = self;
        let Linear { scheme, lengths, period, f, fx, fp, phase, coupled, .. } = linear;
        let (w, length) = (T::COUNT, system.length());
        let width = if CONDENSED { n + 1 + free } else { n + system.shape().1 };
        let (inner, block, lanes) = (m * n, (m + 1) * n, length * m * w);
        let (one, zero) = (T::splat(1.0), T::default());
        let shares: Vec<T> = scheme.integration.iter().map(|a| T::splat(-a)).collect();
        let slots: Vec<usize> = (0..n).map(|c| system.slot(0, c)).collect();
        let mut trace = zero;
        for t in 0..length {
            let h = T::load(&lengths[t * w..]);
            let ht = h * T::splat(period);
            let border = t * block;
            system.border[border..border + n].fill(zero);
            system.clear(t);
            for c in 0..n {
                let first = slots[c];
                let a = &mut system.interior[(t * inner + first) * inner..(t * inner + first + m) * inner];
                for d in (0..n).filter(|d| coupled[c * n + d]) {
                    let column = slots[d];
                    for k in 0..m {
                        let slope = ht * T::load(&fx[(c * n + d) * lanes + (t * m + k) * w..]);
                        for i in 0..m {
                            a[i * inner + column + k] = shares[i * m + k] * slope;
                        }
                        if c == d {
                            trace = trace + T::splat(scheme.weights[k]) * slope;
                        }
                    }
                }
                for i in 0..m {
                    let diagonal = &mut a[i * inner + first + i];
                    *diagonal = *diagonal + one;
                }
                let b = &mut system.coupling[(t * inner + first) * width..(t * inner + first + m) * width];
                b.fill(zero);
                for k in 0..m {
                    let at = (t * m + k) * w;
                    let rate = h * T::load(&f[c * lanes + at..]);
                    for i in 0..m {
                        let right = &mut b[i * width + n];
                        *right = *right + shares[i * m + k] * rate;
                    }
                    for p in 0..free {
                        let slope = ht * T::load(&fp[(c * free + p) * lanes + at..]);
                        for i in 0..m {
                            let right = &mut b[i * width + n + 1 + p];
                            *right = *right + shares[i * m + k] * slope;
                        }
                    }
                    let weight = h * T::splat(scheme.weights[k]);
                    system.border[border + n + first + k] = weight * T::load(&phase[(at * n + c * w)..]);
                }
                for i in 0..m {
                    b[i * width + c] = zero - one;
                }
            }
            if CONDENSED {
                system.condense_at(t, [n, m, 1 + free])?;
            }
        }
        if !CONDENSED {
            system.condense()?;
        }
        Ok(trace.lanes().iter().sum())
    }
}

/// True if all entries are zero.
fn vanishes(entries: &[f64]) -> bool {
    let (blocks, rest) = entries.as_chunks::<8>();
    // No early exit within a block, so that it is a single vector comparison.
    let nothing = |block: &[f64; 8]| block.iter().fold(true, |all, x| all & (*x == 0.0));
    blocks.iter().all(nothing) && rest.iter().all(|x| *x == 0.0)
}

impl System {
    /// Number of places of all lanes, including those beyond the last interval.
    pub(crate) fn places(&self) -> usize {
        self.lanes() * self.length()
    }
}
