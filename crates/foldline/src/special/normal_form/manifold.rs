//! Centre manifolds and the motion on them, order by order.
//!
//! **Idea.** With z the coordinates along the critical eigenvectors, solutions near the equilibrium move on x = H(z) as
//! z' = G(z). Invariance of the manifold determines H and G monomial by monomial; G keeps only terms that no choice of
//! H can remove.
//!
//! **Equations.** A monomial is the list m of its coordinates, for example 0 0 1 for z₀² z₁; h_m `[n]` and g_m
//! `[coordinates]` are derivatives of H and G, so the coefficient of z₀² z₁ is h₀₀₁ / 2!. With λ_i, q_i, p_i of
//! coordinate i, h_i = q_i, and Λ_m the sum of the λ over m:
//!
//! ```text
//!   (1)  f(H(z)) = H_z(z) G(z)
//!   (2)  r_m = Σ_π Dᵏf(h_B, B ∈ π) - Σ_S Σ_i g_S,i h_(m∖S)i        partitions π of m into k ≥ 2 lists B, and parts S ≠ m of at least two
//!   (3)  (A - Λ_m) h_m = Σ_i g_m,i q_i - r_m
//!   (4)  g_m,i = ⟨p_i, r_m⟩, ⟨p_i, h_m⟩ = 0   where m and i turn alike;   g_m,i = 0   elsewhere
//! ```
//!
//! The lists distinguish equal coordinates, which gives every term of (2) its factor.
//!
//! **Source.** kuznetsov1999, §2 (the homological equation); the lists are ours.
//!
//! **Fails when** a combination of frequencies of the order requested equals another frequency (a strong resonance), or
//! another eigenvalue makes (3) singular.

use super::local::{Local, hermitian};
use num_complex::Complex64;
use std::collections::BTreeMap;

/// Coordinate on the manifold.
pub(super) struct Coordinate {
    eigenvalue: Complex64,
    right: Vec<Complex64>,
    left: Vec<Complex64>,
    /// Pair it belongs to, and sense of rotation: 1 or -1 for the first or second of the pair.
    turns: Option<(usize, i32)>,
    /// Index of the conjugate coordinate.
    conjugate: usize,
}

/// Coefficient, and the sum of the moduli of its terms.
#[derive(Clone, Copy)]
pub(super) struct Sized {
    pub(super) value: Complex64,
    pub(super) size: f64,
}

/// Centre manifold, computed as far as needed.
pub(super) struct Manifold<'a> {
    local: &'a Local<'a>,
    coordinates: Vec<Coordinate>,
    shapes: BTreeMap<Vec<usize>, Vec<Complex64>>,
    rests: BTreeMap<Vec<usize>, (Vec<Complex64>, Vec<f64>)>,
}

/// Relative difference below which two frequencies are equal.
const SAME: f64 = 1e-6;

impl<'a> Manifold<'a> {
    /// Creates a coordinate for an eigenvalue 0 if `zero`, then two for each frequency; `None` if the eigenvectors are
    /// not found.
    pub(super) fn new(local: &'a Local<'a>, zero: bool, frequencies: &[f64]) -> Option<Manifold<'a>> {
        let mut coordinates = Vec::new();
        if zero {
            let [q, p] = local.null_vectors()?;
            let size: f64 = q.iter().zip(&p).map(|(q, p)| q * p).sum();
            let right = q.into_iter().map(Complex64::from).collect();
            let left = p.into_iter().map(|p| Complex64::from(p / size)).collect();
            coordinates.push(Coordinate { eigenvalue: 0.0.into(), right, left, turns: None, conjugate: 0 });
        }
        for (pair, omega) in frequencies.iter().enumerate() {
            let eigenvalue = Complex64::new(0.0, *omega);
            let [right, left] = local.eigenvectors(eigenvalue)?;
            let (first, turned) = (coordinates.len(), |v: &[Complex64]| v.iter().map(Complex64::conj).collect());
            let other = Coordinate {
                eigenvalue: eigenvalue.conj(),
                right: turned(&right),
                left: turned(&left),
                turns: Some((pair, -1)),
                conjugate: first,
            };
            coordinates.push(Coordinate { eigenvalue, right, left, turns: Some((pair, 1)), conjugate: first + 1 });
            coordinates.push(other);
        }
        Some(Manifold { local, coordinates, shapes: BTreeMap::new(), rests: BTreeMap::new() })
    }

    /// g_m,i of (4) for the list `m`, in ascending order; `None` at a resonance.
    pub(super) fn motion(&mut self, i: usize, m: &[usize]) -> Option<Sized> {
        if !self.turns_alike(i, m) {
            return Some(Sized { value: 0.0.into(), size: 0.0 });
        }
        let (rest, sizes) = self.rest(m)?;
        let left = &self.coordinates[i].left;
        let size = left.iter().zip(&sizes).map(|(p, s)| p.norm() * s).sum();
        Some(Sized { value: hermitian(left, &rest), size })
    }

    /// h_m.
    fn shape(&mut self, m: &[usize]) -> Option<Vec<Complex64>> {
        if let [one] = m {
            return Some(self.coordinates[*one].right.clone());
        }
        let mut conjugate: Vec<usize> = m.iter().map(|i| self.coordinates[*i].conjugate).collect();
        conjugate.sort_unstable();
        if conjugate.as_slice() < m {
            return Some(self.shape(&conjugate)?.iter().map(Complex64::conj).collect());
        }
        if let Some(known) = self.shapes.get(m) {
            return Some(known.clone());
        }
        let (mut right, _) = self.rest(m)?;
        right.iter_mut().for_each(|r| *r = -*r);
        let alike: Vec<usize> = (0..self.coordinates.len()).filter(|i| self.turns_alike(*i, m)).collect();
        for i in &alike {
            let g = self.motion(*i, m)?.value;
            right.iter_mut().zip(&self.coordinates[*i].right).for_each(|(r, q)| *r += g * q);
        }
        let sum = self.speed(m);
        let largest = self.coordinates.iter().fold(0.0f64, |most, own| most.max(own.eigenvalue.norm()));
        let near = |i: usize| (sum - self.coordinates[i].eigenvalue).norm() < SAME * largest;
        if (0..self.coordinates.len()).any(|i| !alike.contains(&i) && near(i)) {
            return None;
        }
        let [columns, rows] = [true, false].map(|right| -> Vec<&[Complex64]> {
            let of = |i: &usize| match right {
                true => self.coordinates[*i].right.as_slice(),
                false => self.coordinates[*i].left.as_slice(),
            };
            alike.iter().map(of).collect()
        });
        let found = self.local.shifted(sum, &columns, &rows)?.solve(&right);
        self.shapes.insert(m.to_vec(), found.clone());
        Some(found)
    }

    /// r_m, and the sum of the moduli of the terms of each component.
    fn rest(&mut self, m: &[usize]) -> Option<(Vec<Complex64>, Vec<f64>)> {
        if let Some(known) = self.rests.get(m) {
            return Some(known.clone());
        }
        let n = self.local.n;
        let (mut sum, mut sizes) = (vec![Complex64::new(0.0, 0.0); n], vec![0.0; n]);
        let mut add = |factor: Complex64, term: &[Complex64]| {
            for (i, z) in term.iter().enumerate() {
                sum[i] += factor * z;
                sizes[i] += (factor * z).norm();
            }
        };
        for (partition, count) in counted(partitions(m)) {
            if partition.len() > 1 {
                let shapes: Option<Vec<_>> = partition.iter().map(|block| self.shape(block)).collect();
                let shapes = shapes?;
                let along: Vec<&[Complex64]> = shapes.iter().map(Vec::as_slice).collect();
                add(count.into(), &self.local.multilinear(&along));
            }
        }
        for ((part, others), count) in counted(parts(m)) {
            if part.len() < 2 || others.is_empty() {
                continue;
            }
            for i in (0..self.coordinates.len()).filter(|i| self.turns_alike(*i, &part)).collect::<Vec<_>>() {
                let g = self.motion(i, &part)?.value;
                let mut with = [others.as_slice(), &[i]].concat();
                with.sort_unstable();
                add(-count * g, &self.shape(&with)?);
            }
        }
        self.rests.insert(m.to_vec(), (sum.clone(), sizes.clone()));
        Some((sum, sizes))
    }

    /// Λ_m.
    fn speed(&self, m: &[usize]) -> Complex64 {
        m.iter().map(|i| self.coordinates[*i].eigenvalue).sum()
    }

    /// True if every pair rotates equally often in m and in coordinate i.
    fn turns_alike(&self, i: usize, m: &[usize]) -> bool {
        let mut balance: BTreeMap<usize, i32> = BTreeMap::new();
        let all = m.iter().map(|k| (*k, 1)).chain([(i, -1)]);
        for ((pair, way), sign) in all.filter_map(|(k, sign)| Some((self.coordinates[k].turns?, sign))) {
            *balance.entry(pair).or_default() += sign * way;
        }
        balance.values().all(|turns| *turns == 0)
    }
}

/// All partitions of a list into lists; equal entries are distinguished.
fn partitions(list: &[usize]) -> Vec<Vec<Vec<usize>>> {
    let Some((first, others)) = list.split_first() else { return vec![Vec::new()] };
    let mut all = Vec::new();
    for smaller in partitions(others) {
        for at in 0..=smaller.len() {
            let mut larger = smaller.clone();
            match larger.get_mut(at) {
                Some(block) => block.insert(0, *first),
                None => larger.push(vec![*first]),
            }
            larger.sort();
            all.push(larger);
        }
    }
    all
}

/// All sublists of a list with their complements.
fn parts(list: &[usize]) -> Vec<(Vec<usize>, Vec<usize>)> {
    let taken = |choice: usize, own: usize| {
        let chosen = list.iter().enumerate().filter(move |(k, _)| choice >> k & 1 == own);
        chosen.map(|(_, i)| *i).collect::<Vec<_>>()
    };
    (0..1 << list.len()).map(|choice| (taken(choice, 1), taken(choice, 0))).collect()
}

/// Distinct elements with their multiplicities.
fn counted<T: Ord>(all: Vec<T>) -> BTreeMap<T, f64> {
    let mut counts = BTreeMap::new();
    all.into_iter().for_each(|one| *counts.entry(one).or_insert(0.0) += 1.0);
    counts
}
