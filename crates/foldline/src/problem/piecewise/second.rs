//! Second derivatives of the piecewise flow along a direction.

use super::{PiecewiseFlow, Switched, identity};
use crate::contract::{Batch, Parameters};
use crate::linalg::{dot, lu};

/// Step of central differences, in scales: the cube root of rounding.
const STEP: f64 = 6e-6;

impl PiecewiseFlow<'_> {
    /// The derivatives of an interval, `[m + 1][n × (n + 1 + k)]` at the Gauss points and at the right end,
    /// differentiated along a direction of its left end and the scalars:
    ///
    /// ```text
    ///   (5)  W_i = W + Σ_k a_ik (δℓ (f_x V_k + f_σ) + ℓ (D²f[V_k, δY_k] + f_x W_k)),   W ← W⁺ + (f_x⁻ V + f_σ⁻ - f_x⁺ V - f_σ⁺) δt
    /// ```
    ///
    /// where the second relation, at a switching, has δt of (4). Where f jumps, by central differences of the flow.
    pub fn varied(&self, own: &Switched, x: &[f64], ends: [f64; 2], dx: &[f64], scalars: &[f64]) -> Option<Vec<f64>> {
        if own.jumps {
            return self.differences(own, x, ends, dx, scalars);
        }
        let (n, m, width, k) = (self.n(), self.scheme.degree, self.width(), self.scalars.len() - 1);
        let direction = [dx, scalars].concat();
        let free_change = self.setting.spread(&scalars[1..]);
        let free_units: Vec<Vec<f64>> = (0..k)
            .map(|p| self.setting.spread(&(0..k).map(|q| f64::from(u8::from(p == q))).collect::<Vec<f64>>()))
            .collect();
        let nothing = vec![0.0; free_change.len()];
        let lanes = |columns: &dyn Fn(usize, usize) -> f64, parameters: &[f64]| -> Vec<f64> {
            let states = (0..n).flat_map(|c| (0..m).map(move |i| (c, i))).map(|(c, i)| columns(c, i));
            states.chain(parameters.iter().flat_map(|p| std::iter::repeat_n(*p, m))).collect()
        };
        let mut start = vec![0.0; n * width];
        let left = identity(n, width);
        for (signs, switch) in &own.at_start {
            let moved = self.shifted(x, &left, ends[0], signs, *switch, &direction);
            start.iter_mut().zip(&moved).for_each(|(w, m)| *w += m);
        }
        let mut all: Vec<Vec<f64>> = Vec::with_capacity(own.parts.len());
        for part in &own.parts {
            let (length, times) = self.course(part.ends);
            let stretched = (part.ends[1] - part.ends[0]) * scalars[0];
            let states = self.lanes(&part.nodes[n..]);
            let signs: Vec<f64> = part.signs.iter().flat_map(|sign| std::iter::repeat_n(*sign, m)).collect();
            let parameters = Parameters::Shared(&self.parameters);
            let batch = Batch { lanes: m, states: &states, parameters, times: &times, signs: &signs };
            let [mut f, mut fx, mut fp] = [n, n * n, n * k].map(|size| vec![0.0; size * m]);
            self.setting.linearise(batch, &mut f, &mut fx, &mut fp);
            // V at Gauss point i.
            let by = |c: usize, i: usize, column: usize| part.by[((i + 1) * n + c) * width + column];
            let change = |c: usize, i: usize| -> f64 {
                dot(&part.by[((i + 1) * n + c) * width..((i + 1) * n + c + 1) * width], &direction)
            };
            let along = lanes(&change, &free_change);
            let mut first = vec![0.0; n * m];
            self.setting.field.directional(batch, &[&along], &mut first);
            let mut rows = vec![0.0; m * n * width];
            for column in 0..width {
                let own_parameters = column.checked_sub(n + 1).map_or(&nothing, |p| &free_units[p]);
                let own = lanes(&|c, i| by(c, i, column), own_parameters);
                let mut second = vec![0.0; n * m];
                self.setting.field.directional(batch, &[&own, &along], &mut second);
                for c in 0..n {
                    let rate = |at: usize| -> f64 {
                        let moved: f64 = (0..n).map(|d| fx[(c * n + d) * m + at] * by(d, at, column)).sum();
                        let forced = column.checked_sub(n + 1).map_or(0.0, |p| fp[(c * k + p) * m + at]);
                        let by_period = if column == n { first[c * m + at] / self.scalars[0] } else { 0.0 };
                        stretched * (moved + forced) + length * (second[c * m + at] + by_period)
                    };
                    let rates: Vec<f64> = (0..m).map(rate).collect();
                    for i in 0..m {
                        let share = dot(&self.scheme.integration[i * m..(i + 1) * m], &rates);
                        rows[(i * n + c) * width + column] = start[c * width + column] + share;
                    }
                }
            }
            let mut matrix = self.matrix(length, &fx);
            let mut pivots = vec![0; n * m];
            lu::factorise_scaled(&mut matrix, n * m, &mut pivots, self.setting.scales).ok()?;
            lu::solve(&matrix, n * m, &pivots, &mut rows, width);
            let nodes = [&start[..], &rows].concat();
            start = self.at_end(&nodes, n * width);
            all.push(nodes);
            if let Some(switch) = part.switch {
                let (x, by) = (self.at_end(&part.nodes, n), self.at_end(&part.by, n * width));
                let moved = self.shifted(&x, &by, part.ends[1], &part.signs, switch, &direction);
                start.iter_mut().zip(&moved).for_each(|(w, m)| *w += m);
            }
        }
        let mut out = own.at_nodes(self.scheme, ends, &all, n * width);
        out.extend(self.at_end(all.last()?, n * width));
        out.iter().all(|value| value.is_finite()).then_some(out)
    }

    /// The second relation of (5), without W⁺: at `x`, with the derivatives `by` `[n × (n + 1 + k)]` there, where the
    /// switch changes sign at normalised time `t`.
    fn shifted(&self, x: &[f64], by: &[f64], t: f64, signs: &[f64], switch: usize, direction: &[f64]) -> Vec<f64> {
        let (n, width, k) = (self.n(), self.width(), self.scalars.len() - 1);
        let (time, parameters) = (self.time(t), Parameters::Shared(&self.parameters));
        let batch = Batch { lanes: 1, states: x, parameters, times: time.as_slice(), signs: &[] };
        let [_, hx, hp, ht] = self.setting.linearise_switches(batch);
        let mut signs = signs.to_vec();
        let sides = [(); 2].map(|()| {
            let [mut f, mut fx, mut fp] = [n, n * n, n * k].map(|size| vec![0.0; size]);
            self.setting.linearise(Batch { signs: &signs, ..batch }, &mut f, &mut fx, &mut fp);
            signs[switch] = -signs[switch];
            (f, fx, fp)
        });
        let gradient = &hx[switch * n..(switch + 1) * n];
        let speed = dot(gradient, &sides[0].0) + ht[switch];
        let moved: f64 = (0..n).map(|c| gradient[c] * dot(&by[c * width..(c + 1) * width], direction)).sum();
        let shift = -(moved + dot(&hp[switch * k..(switch + 1) * k], &direction[n + 1..])) / speed;
        let rate = |(_, fx, fp): &(Vec<f64>, Vec<f64>, Vec<f64>), c: usize, column: usize| -> f64 {
            let moved: f64 = (0..n).map(|d| fx[c * n + d] * by[d * width + column]).sum();
            moved + column.checked_sub(n + 1).map_or(0.0, |p| fp[c * k + p])
        };
        let entries = (0..n).flat_map(|c| (0..width).map(move |column| (c, column)));
        entries.map(|(c, column)| (rate(&sides[0], c, column) - rate(&sides[1], c, column)) * shift).collect()
    }

    /// [`PiecewiseFlow::varied`] by central differences.
    fn differences(&self, own: &Switched, x: &[f64], ends: [f64; 2], dx: &[f64], scalars: &[f64]) -> Option<Vec<f64>> {
        let (n, scales) = (self.n(), self.setting.scales);
        let relative = (0..n).map(|c| (dx[c] / scales[c].max(x[c].abs())).abs());
        let others = scalars.iter().zip(&self.scalars).map(|(d, v)| (d / v.abs().max(1e-3)).abs());
        let size = relative.chain(others).fold(0.0, f64::max);
        if size == 0.0 {
            return Some(vec![0.0; (self.scheme.degree + 1) * n * self.width()]);
        }
        let step = STEP / size;
        let guess = self.guess(own);
        let at = |by: f64| {
            let moved: Vec<f64> = x.iter().zip(dx).map(|(x, d)| x + by * d).collect();
            let there: Vec<f64> = self.scalars.iter().zip(scalars).map(|(v, d)| v + by * d).collect();
            let flow = PiecewiseFlow::new(self.setting, self.scheme, &there, self.forcing_periods);
            Some(flow.along(own.interval, &moved, ends, &guess, &own.sizes).ok()?.derivatives(self.scheme, ends))
        };
        let (more, less) = (at(step)?, at(-step)?);
        Some(more.iter().zip(&less).map(|(a, b)| (a - b) / (2.0 * step)).collect())
    }

    /// A polynomial through the flow at the nodes of its interval, `[m + 1][n]`.
    fn guess(&self, own: &Switched) -> Vec<f64> {
        let ends = [own.parts[0].ends[0], own.parts[own.parts.len() - 1].ends[1]];
        let n = self.n();
        let mut nodes = own.parts[0].nodes[..n].to_vec();
        nodes.extend(own.values(self.scheme, ends));
        nodes
    }
}
