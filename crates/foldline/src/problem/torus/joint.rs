//! The linear system of a torus: eliminated segments, joined.
//!
//! **Equations.** With the relation F_k x_k(0) + E_k x_k(1) + g_k σ = h_k that each segment leaves, the border rows summed
//! over the segments, and R(ρ) the shift by ρ with the rate R':
//!
//! ```text
//!   (1)  E_k (Σ_l R_kl x_l(0) + w_k δρ) + F_k x_k(0) + g_k σ = h_k,      w_k = Σ_l R'_kl X_l(0)
//!   (2)  Σ_k (P_k x_k(0) + Q_k x_k(1) + D_k σ) / K + (scalar part) = s
//! ```
//!
//! **Fails when** (1) and (2) are singular to working precision.

use super::TorusProblem;
use super::phases;
use crate::contract::Singular;
use foldline_general::{Factored, Mat};

/// The factorised system (1) and (2).
#[derive(Debug)]
pub(super) struct Joint {
    factors: Factored,
    /// R and w.
    table: Vec<f64>,
    rate: Vec<f64>,
}

impl TorusProblem<'_> {
    /// Number of border rows that act on the profile besides those of a call: the phase conditions.
    pub(super) fn phase_count(&self) -> usize {
        match (self.second, self.forcing_periods) {
            (Some(_), _) => 0,
            (None, 0) => 2,
            _ => 1,
        }
    }

    /// Factorises (1) and (2) from the eliminated segments, with `rows` `[k][unknowns]`.
    ///
    /// # Errors
    /// [`Singular`] if the system is.
    pub(super) fn join(&mut self, u: &[f64], rows: &[f64]) -> Result<(), Singular> {
        let (n, count, size) = (self.n, self.phases, self.profile_size());
        let q = self.segments.first().map_or(1, |own| own.scalars());
        let (base, order) = (count * n, count * n + q + 1);
        let rotation = u[size + 1];
        let [table, rates] = phases::shift(count, rotation);
        let mut rate = vec![0.0; base];
        phases::shifted(&rates, &u[..base], n, &mut rate);
        let mut a: Mat<f64> = Mat::zeros(order, order);
        let (free, share) = (self.setting.freedom(), 1.0 / count as f64);
        let borders = self.phase_count() + rows.len() / u.len();
        for (k, segment) in self.segments.iter().enumerate() {
            let Some(rest) = segment.remainder() else { return Err(Singular) };
            for i in 0..n {
                let row = k * n + i;
                for c in 0..n {
                    let e = rest.right[i * n + c];
                    for l in 0..count {
                        a[(row, l * n + c)] += table[(k + count - l) % count] * e;
                    }
                    a[(row, k * n + c)] += rest.left[i * n + c];
                    a[(row, base + q)] += e * rate[k * n + c];
                }
                (0..q).for_each(|c| a[(row, base + c)] = rest.scalars[i * q + c]);
            }
            for r in 0..borders {
                for c in 0..n {
                    let beyond = share * rest.last[r * n + c];
                    for l in 0..count {
                        a[(base + r, l * n + c)] += table[(k + count - l) % count] * beyond;
                    }
                    a[(base + r, k * n + c)] += share * rest.first[r * n + c];
                    a[(base + r, base + q)] += beyond * rate[k * n + c];
                }
                (0..q).for_each(|c| a[(base + r, base + c)] += share * rest.corner[r * q + c]);
            }
        }
        for (r, row) in rows.chunks_exact(u.len()).enumerate() {
            let at = base + self.phase_count() + r;
            a[(at, base)] += row[size] / (self.period_scale * self.period_scale);
            a[(at, base + q)] += row[size + 1];
            (0..free).for_each(|c| a[(at, base + 1 + c)] += row[size + 2 + c]);
        }
        // Prescribed scalars: T under forcing, ρ if it is held, and scalars that only make room.
        let forced = (self.forcing_periods > 0).then_some(0);
        let prescribed = forced.into_iter().chain(self.held.map(|_| q)).chain(1 + free..q);
        let mut at = base + borders;
        if self.second.is_some() {
            // ρ of the second forcing.
            let (_, slopes) = self.setting.field.second_turns(&self.setting.at(&u[size + 2..]));
            let own = |c: usize| -> f64 {
                let unknown: Vec<f64> = (0..free).map(|k| f64::from(u8::from(k == c))).collect();
                self.setting.spread(&unknown).iter().zip(&slopes).map(|(a, b)| a * b).sum()
            };
            a[(at, base + q)] = 1.0;
            (0..free).for_each(|c| a[(at, base + 1 + c)] = -own(c));
            at += 1;
        }
        for (at, scalar) in (at..order).zip(prescribed) {
            a[(at, base + scalar)] = 1.0;
        }
        let factors = Factored::new(a.as_ref());
        if !factors.log_determinant().is_finite() {
            return Err(Singular);
        }
        self.joint = Some(Joint { factors, table, rate });
        Ok(())
    }

    /// Solves with the last factorisation: residuals of the profile and of the phase conditions and prescribed scalars,
    /// then of the rows.
    pub(super) fn solve_joined(&self, rhs: &[f64], x: &mut [f64]) {
        let (n, count, size) = (self.n, self.phases, self.profile_size());
        let Some(joint) = &self.joint else { return x.fill(f64::NAN) };
        let q = self.segments.first().map_or(1, |own| own.scalars());
        let (base, order, free) = (count * n, count * n + q + 1, self.setting.freedom());
        let (scalars, share) = (2 + free, 1.0 / count as f64);
        let conditions = self.conditions();
        let borders = self.phase_count() + scalars - conditions;
        let mut b: Mat<f64> = Mat::zeros(order, 1);
        let own: Vec<Vec<f64>> = (0..count).map(|k| self.chain(rhs, k)).collect();
        for (k, (segment, own)) in self.segments.iter().zip(&own).enumerate() {
            let ends = segment.segment_forward(own);
            (0..n).for_each(|i| b[(k * n + i, 0)] = ends[i]);
            (0..borders).for_each(|r| b[(base + r, 0)] += share * ends[n + r]);
        }
        // The residuals behind the profile: T or the phase in time, the phase, ρ if it is held, the rows.
        let behind = &rhs[size..];
        let mut at = base + borders;
        match self.second {
            None => b[(base, 0)] += behind[1],
            Some(_) => {
                b[(at, 0)] += behind[1];
                at += 1;
            }
        }
        match self.forcing_periods {
            0 => b[(base + 1, 0)] += behind[0],
            _ => {
                b[(at, 0)] += behind[0];
                at += 1;
            }
        }
        if self.held.is_some() {
            b[(at, 0)] += behind[2];
        }
        for (r, row) in behind[conditions..].iter().enumerate() {
            b[(base + self.phase_count() + r, 0)] += row;
        }
        let found = joint.factors.solve(&b);
        let first: Vec<f64> = (0..base).map(|k| found[(k, 0)]).collect();
        let sigma: Vec<f64> = (0..q).map(|c| found[(base + c, 0)]).collect();
        let turn = found[(base + q, 0)];
        let mut last = vec![0.0; base];
        phases::shifted(&joint.table, &first, n, &mut last);
        last.iter_mut().zip(&joint.rate).for_each(|(x, w)| *x += turn * w);
        for (k, (segment, own)) in self.segments.iter().zip(&own).enumerate() {
            let known = [&first[k * n..(k + 1) * n], &last[k * n..(k + 1) * n], &sigma].concat();
            self.put(&segment.segment_backward(own, &known), k, x);
        }
        x[size] = sigma[0];
        x[size + 1] = turn;
        x[size + 2..].copy_from_slice(&sigma[1..1 + free]);
    }
}
