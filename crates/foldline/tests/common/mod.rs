//! A hand-written overhung rotor for tests of the engine.

use foldline::contract::{Batch, Parameters, VectorField};

pub const OMEGA: usize = 0;
pub const KAPPA: usize = 1;
pub const ZETA: usize = 2;
/// Omega, kappa, zeta, epsilon, gamma, beta, K, J_p, m.
pub const REFERENCE: [f64; 9] = [5.0, 0.0, 0.01, 0.353, 0.25, 10.0, 150.0, 0.143, 0.9];

pub struct Rotor;

fn switch(kk: f64, r: f64) -> (f64, f64) {
    let t = (kk * (r - 1.0)).tanh();
    (0.5 * (t + 1.0), 0.5 * kk * (1.0 - t * t))
}

/// g(r), g'(r), dg/dκ with f = g(r) U.
fn restoring(p: &[f64], r: f64) -> (f64, f64, f64) {
    let (kappa, gamma, beta, kk) = (p[1], p[4], p[5], p[6]);
    let (s, ds) = switch(kk, r);
    let (snub, dsnub) = (s * beta * (1.0 - 1.0 / r), beta * (ds * (1.0 - 1.0 / r) + s / (r * r)));
    (
        (1.0 - kappa) * gamma * r * r + kappa * snub,
        (1.0 - kappa) * 2.0 * gamma * r + kappa * dsnub,
        snub - gamma * r * r,
    )
}

impl VectorField for Rotor {
    fn dim(&self) -> usize {
        4
    }

    fn parameter_count(&self) -> usize {
        9
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        let l = at.lanes;
        let Parameters::Shared(p) = at.parameters else { unimplemented!() };
        let (w, zeta, eps, jp, m) = (p[0], p[2], p[3], p[7], p[8]);
        for k in 0..l {
            let [u, v, du, dv] = [0, 1, 2, 3].map(|i| at.states[i * l + k]);
            let (g, _, _) = restoring(p, u.hypot(v));
            let a = w * w * (jp - 1.0) + 1.0 + g;
            f[k] = du;
            f[l + k] = dv;
            f[2 * l + k] = m * eps * w * w - w * (jp - 2.0) * dv - 2.0 * zeta * du - a * u + 2.0 * zeta * w * v;
            f[3 * l + k] = w * (jp - 2.0) * du - 2.0 * zeta * dv - a * v - 2.0 * zeta * w * u;
        }
    }

    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        self.evaluate(at, f);
        let l = at.lanes;
        let Parameters::Shared(p) = at.parameters else { unimplemented!() };
        let (w, zeta, eps, jp, m) = (p[0], p[2], p[3], p[7], p[8]);
        fx.fill(0.0);
        fp.fill(0.0);
        for k in 0..l {
            let [u, v, du, dv] = [0, 1, 2, 3].map(|i| at.states[i * l + k]);
            let r = u.hypot(v);
            let (g, dg, dk) = restoring(p, r);
            let a = w * w * (jp - 1.0) + 1.0 + g;
            let mut set = |i: usize, j: usize, x: f64| fx[(i * 4 + j) * l + k] = x;
            set(0, 2, 1.0);
            set(1, 3, 1.0);
            set(2, 0, -a - dg * u * u / r);
            set(2, 1, -dg * u * v / r + 2.0 * zeta * w);
            set(2, 2, -2.0 * zeta);
            set(2, 3, -w * (jp - 2.0));
            set(3, 0, -dg * u * v / r - 2.0 * zeta * w);
            set(3, 1, -a - dg * v * v / r);
            set(3, 2, w * (jp - 2.0));
            set(3, 3, -2.0 * zeta);
            for (c, &which) in free.iter().enumerate() {
                let q = free.len();
                let (a2, a3) = match which {
                    OMEGA => (
                        2.0 * m * eps * w - (jp - 2.0) * dv - 2.0 * w * (jp - 1.0) * u + 2.0 * zeta * v,
                        (jp - 2.0) * du - 2.0 * w * (jp - 1.0) * v - 2.0 * zeta * u,
                    ),
                    KAPPA => (-dk * u, -dk * v),
                    ZETA => (-2.0 * du + 2.0 * w * v, -2.0 * dv - 2.0 * w * u),
                    _ => unimplemented!(),
                };
                fp[(2 * q + c) * l + k] = a2;
                fp[(3 * q + c) * l + k] = a3;
            }
        }
    }

    fn directional(&self, _at: Batch, _directions: &[&[f64]], _out: &mut [f64]) {
        unimplemented!()
    }

    fn output_count(&self) -> usize {
        1
    }

    fn outputs(&self, at: Batch, out: &mut [f64]) {
        let l = at.lanes;
        for k in 0..l {
            out[k] = at.states[k].hypot(at.states[l + k]);
        }
    }
}

/// Classical Runge–Kutta over one period from `x`, as a first guess of a profile on a uniform mesh.
pub fn shoot(p: &[f64], x: &[f64], period: f64, intervals: usize, nodes: &[f64]) -> Vec<f64> {
    let rhs = |x: &[f64]| {
        let mut f = vec![0.0; 4];
        Rotor.evaluate(Batch { lanes: 1, states: x, parameters: Parameters::Shared(p) }, &mut f);
        f
    };
    let step = |x: &[f64], h: f64| {
        let add = |k: &[f64], h: f64| -> Vec<f64> { x.iter().zip(k).map(|(a, b)| a + h * b).collect() };
        let k1 = rhs(x);
        let k2 = rhs(&add(&k1, 0.5 * h));
        let k3 = rhs(&add(&k2, 0.5 * h));
        let k4 = rhs(&add(&k3, h));
        (0..4).map(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])).collect::<Vec<f64>>()
    };
    let (mut x, mut t, mut out) = (x.to_vec(), 0.0, Vec::new());
    for j in 0..intervals {
        for c in nodes {
            let target = (j as f64 + c) / intervals as f64 * period;
            for _ in 0..20 {
                x = step(&x, (target - t) / 20.0);
            }
            t = target;
            out.extend_from_slice(&x);
        }
    }
    out
}
