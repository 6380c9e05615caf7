//! The system with low rank beside the general one.

use super::*;
use crate::linalg::condensed::Condensed;
use crate::problem::gauss::Scheme;
use modes::Modes;

fn number(k: usize, seed: f64) -> f64 {
    2.0 * ((k * k) as f64 * 0.618 + seed * (1.0 + 0.37 * k as f64)).sin().abs().fract() - 1.0
}

/// A chain of oscillators with forces on two velocities that depend on four coordinates, the same cycle for both systems.
struct Case {
    n: usize,
    count: usize,
    q: usize,
    scheme: Scheme,
    linear: Vec<f64>,
    pushed: Vec<f64>,
    seen: Vec<usize>,
    slopes: Vec<f64>,
    columns: Vec<f64>,
    border: Vec<f64>,
    corner: Vec<f64>,
    step: f64,
}

fn case(count: usize) -> Case {
    let (n, q, r, s) = (40, 2, 2, 4);
    let half = n / 2;
    let scheme = Scheme::new(4);
    let m = 4;
    let mut linear = vec![0.0; n * n];
    for i in 0..half {
        linear[i * n + half + i] = 1.0;
        for k in 0..half {
            let entry = if i == k {
                2.1
            } else if i.abs_diff(k) == 1 {
                -1.0
            } else {
                0.0
            };
            linear[(half + i) * n + k] = -entry * (1.0 + 0.02 * i as f64) * 9.0;
            linear[(half + i) * n + half + k] = -0.01 * entry + 0.05 * number(i * half + k, 0.3) / half as f64;
        }
    }
    let mut pushed = vec![0.0; n * r];
    for i in half..n {
        pushed[i * r] = number(i, 0.7);
        pushed[i * r + 1] = number(i, 0.2);
    }
    // Contact during half of the intervals.
    let slopes =
        (0..count * m * r * s).map(|k| if k / (m * r * s) % 4 < 2 { 0.0 } else { 2.0 * number(k, 0.9) }).collect();
    Case {
        n,
        count,
        q,
        columns: (0..q * count * m * n).map(|k| 0.1 * number(k, 0.11)).collect(),
        border: (0..q * count * (m + 1) * n).map(|k| number(k, 0.77)).collect(),
        corner: vec![1.0, 0.3, -0.2, 0.8],
        scheme,
        linear,
        pushed,
        seen: vec![0, 3, half, half + 3],
        slopes,
        step: 0.11,
    }
}

impl Case {
    fn weights(&self) -> Weights<'_> {
        Weights { integration: &self.scheme.integration, end: &self.scheme.end }
    }

    fn jacobian(&self, at: usize) -> Vec<f64> {
        let (n, r, s) = (self.n, 2, 4);
        let mut own = self.linear.clone();
        for i in 0..n {
            for c in 0..s {
                for f in 0..r {
                    own[i * n + self.seen[c]] += self.pushed[i * r + f] * self.slopes[(at * r + f) * s + c];
                }
            }
        }
        own
    }

    fn low(&self, closure: f64) -> LocalSystem {
        let n = self.n;
        let modes = Modes::of(&self.linear, &vec![1.0; n]).unwrap();
        let modal =
            |row: usize, k: usize| -> f64 { (0..n).map(|i| modes.to[row * n + i] * self.pushed[i * 2 + k]).sum() };
        let pair = |at: usize, size: usize, of: &dyn Fn(usize) -> f64| {
            Complex64::new(of(at), if size == 2 { of(at + 1) } else { 0.0 })
        };
        let mut pushed = Vec::new();
        let mut seen = Vec::new();
        for mode in &modes.list {
            (0..2).for_each(|f| pushed.push(pair(mode.at, mode.size, &|row| modal(row, f))));
            self.seen.iter().for_each(|c| seen.push(pair(mode.at, mode.size, &|k| modes.from[c * n + k])));
        }
        let common = Common { modes, forces: 2, coordinates: 4, pushed, seen };
        let own = |j: usize| {
            let slopes = &self.slopes[j * 4 * 8..(j + 1) * 4 * 8];
            Link::Low(Box::new(Interval::new(&common, self.weights(), self.step, slopes).unwrap()))
        };
        let links = (0..self.count).map(own).collect();
        LocalSystem::new(Parts {
            common: common.clone(),
            scheme: self.weights(),
            links,
            columns: self.columns.clone(),
            border: self.border.clone(),
            corner: self.corner.clone(),
            closure,
        })
        .unwrap()
    }

    fn general(&self, closure: f64) -> Condensed<f64> {
        let (n, m, q, count) = (self.n, 4, self.q, self.count);
        let mut s = Condensed::<f64>::new(n, &self.scheme.end, q);
        s.resize(count);
        let (inner, width) = (m * n, n + q);
        s.interior.fill(0.0);
        s.coupling.fill(0.0);
        for j in 0..count {
            for k in 0..m {
                let jacobian = self.jacobian(j * m + k);
                for i in 0..m {
                    let share = self.step * self.scheme.integration[i * m + k];
                    for c in 0..n {
                        let row = (j * inner + s.slot(i, c)) * inner;
                        for d in 0..n {
                            let unit = f64::from(u8::from(i == k && c == d));
                            let at = row + s.slot(k, d);
                            s.interior[at] += unit - share * jacobian[c * n + d];
                        }
                    }
                }
            }
            for i in 0..m {
                for c in 0..n {
                    let row = (j * inner + s.slot(i, c)) * width;
                    s.coupling[row + c] = -1.0;
                    for p in 0..q {
                        s.coupling[row + n + p] = self.columns[((p * count + j) * m + i) * n + c];
                    }
                    for p in 0..q {
                        let from = (p * count + j) * (m + 1) * n;
                        let to = (p * count + j) * (m + 1) * n;
                        let slot = n + s.slot(i, c);
                        s.border[to + slot] = self.border[from + (i + 1) * n + c];
                        s.border[to + c] = self.border[from + c];
                    }
                }
            }
        }
        s.corner.copy_from_slice(&self.corner);
        s.condense().unwrap();
        s.eliminate(closure).unwrap();
        s
    }
}

fn farthest(a: &[f64], b: &[f64]) -> f64 {
    let size = crate::linalg::max_abs(b);
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size
}

#[test]
fn solutions_agree_with_those_of_the_general_system() {
    for (count, closure) in [(1, 1.0), (12, 1.0), (12, -1.0)] {
        let case = case(count);
        let (low, general) = (case.low(closure), case.general(closure));
        let size = count * 5 * case.n + case.q;
        let rhs: Vec<f64> = (0..size).map(|k| number(k, 0.5)).collect();
        let [mut own, mut other] = [vec![0.0; size], vec![0.0; size]];
        low.solve(&rhs, &mut own);
        general.solve(&rhs, &mut other);
        assert!(farthest(&own, &other) < 1e-10, "{count} {closure}: {:e}", farthest(&own, &other));
    }
}

#[test]
fn the_product_of_transitions_has_the_eigenvalues_and_the_determinant_of_the_general_one() {
    let case = case(12);
    let (low, general) = (case.low(1.0), case.general(1.0));
    let n = case.n;
    let mut product: Vec<f64> = (0..n * n).map(|k| f64::from(u8::from(k % (n + 1) == 0))).collect();
    let mut g = vec![0.0; n * n];
    for j in 0..12 {
        general.transition(j, &mut g);
        product = changed(&g, &product, n);
    }
    let eigenvalues = |a: &[f64]| {
        let a = foldline_general::MatRef::from_row_major_slice(a, n, n);
        foldline_general::eigenvalues(a).unwrap()
    };
    let (own, other) = (eigenvalues(low.product()), eigenvalues(&product));
    for z in &own {
        let nearest = other.iter().map(|w| (w - z).norm()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-10, "{z}: {nearest:e}");
    }
    let log: f64 = other.iter().map(|z| z.norm().ln()).sum();
    assert!((low.log_determinant() - log).abs() < 1e-9 * log.abs().max(1.0), "{} {log}", low.log_determinant());
}

#[test]
fn an_interval_that_is_given_explicitly_counts_like_any_other() {
    let case = case(12);
    let general = case.general(1.0);
    let (n, m) = (case.n, 4);
    let mut low = case.low(1.0);
    // Interval 7 from its own columns.
    let mut inner = vec![0.0; m * n * n];
    let mut transition = vec![0.0; n * n];
    for k in 0..n {
        let mut unit = vec![0.0; n];
        unit[k] = 1.0;
        let mut column = vec![0.0; m * n];
        low.add_inside(7, &unit, &mut column);
        (0..m * n).for_each(|i| inner[i * n + k] = column[i]);
        low.carry(7, &mut unit, 1);
        (0..n).for_each(|i| transition[i * n + k] = unit[i]);
    }
    let solved = low.solved.clone();
    low.links[7] = Link::Given { inner, transition };
    // Its scalars act through the columns of the given part, here none.
    let mut columns = case.columns.clone();
    for p in 0..case.q {
        columns[(p * 12 + 7) * m * n..(p * 12 + 8) * m * n].fill(0.0);
    }
    drop(solved);
    let with = |columns: Vec<f64>, links: Vec<Link>| {
        LocalSystem::new(Parts {
            common: low.common.clone(),
            scheme: case.weights(),
            links,
            columns,
            border: case.border.clone(),
            corner: case.corner.clone(),
            closure: 1.0,
        })
        .unwrap()
    };
    let plain = case.low(1.0);
    let [one, other] = [with(columns.clone(), low.links.clone()), with(columns, plain.links.clone())];
    let size = 12 * 5 * n + case.q;
    // Equations of the inner nodes of a given interval are those of the nodes alone.
    let rhs: Vec<f64> =
        (0..size).map(|k| if (7 * 5 * n + n..8 * 5 * n).contains(&k) { 0.0 } else { number(k, 0.5) }).collect();
    let [mut a, mut b] = [vec![0.0; size], vec![0.0; size]];
    one.solve(&rhs, &mut a);
    other.solve(&rhs, &mut b);
    assert!(farthest(&a, &b) < 1e-10, "{:e}", farthest(&a, &b));
    drop(general);
}
