//! Linear system of collocation: condensed per interval, then eliminated block by block with a border.
//!
//! **Idea.** On every interval the m·n interior unknowns depend only on the left end x_j and on a few scalars σ common
//! to all intervals (period, parameters). Condensing them leaves a recurrence between interval ends: a chain. The
//! intervals are distributed over the lanes in contiguous pieces, so that condensation and elimination run in all lanes
//! at once; a last, short chain connects the pieces. A piece is compactified if errors do not grow in it, and otherwise
//! eliminated as a chain.
//!
//! **Equations.** N intervals; unknowns x_j (n), X_j (m·n), σ (q):
//!
//! ```text
//!   (1)  A_j X_j + B_j x_j + C_j σ = r_j                     interior,   m·n rows per interval
//!   (2)  x_{j+1} - e_0 x_j - Σ_k e_k X_{j,k} = c_j           continuity, n rows per interval
//!   (3)  x_N = κ x_0                                         closure: κ = 1 periodic, κ = -1 antiperiodic, or
//!                                                            conditions on both ends ([`Ends`])
//!   (4)  Σ_j ⟨p_j, (x_j, X_j)⟩ + D σ = s                     border,     q rows
//! ```
//!
//! Components of very different sizes would be rounded, and pivots chosen, as if all had the same size. With D a
//! diagonal matrix of powers of two near the sizes of the components, D⁻¹ A D is factorised, and the other parts are
//! scaled accordingly; no rounding is involved.
//!
//! Condensed: x_{j+1} = G_j x_j + g_j σ + h_j, the links of a [`Chain`]. With W lanes and L = ⌈N / W⌉, interval j is in
//! lane ⌊j / L⌋ at place j mod L; intervals beyond N have length zero, so that their ends coincide.
//!
//! **Source.** Condensation of parameters as in ascher1995, §7; division into pieces as in wright1992.
//!
//! **Fails when** an interior block or the final matrix is singular to working precision.

use super::apart::Remainder;
use super::chain::{Chain, Links};
use super::compound::Compound;
use super::dense::MANY;
use super::ends::Ends;
use super::lane::{Eight, Lane, add, dot, intact, subtract};
use super::shape::Shape;
use super::{block, lu, tile};
use crate::contract::Singular;

/// The system, its factorisation and workspace.
#[derive(Clone, Debug, Default)]
pub struct Condensed<T> {
    n: usize,
    m: usize,
    q: usize,
    intervals: usize,
    length: usize,
    closure: f64,
    end: Vec<f64>,
    shape: Shape,
    /// True if `interior` is zero wherever the shape requires, except at places with exchanged rows.
    tidy: bool,
    /// Positions of the left end and the slots of an interval in the layout of the unknowns, `[(m + 1) · n]`.
    order: Vec<usize>,
    /// `[L][m·n × m·n]`: A_j, factorised in place; rows and columns in slots.
    pub interior: Vec<T>,
    /// `[L][m·n × (n + q)]`: (B_j, C_j), overwritten by A_j⁻¹(B_j, C_j); rows in slots.
    pub coupling: Vec<T>,
    /// `[q][L][(m + 1) · n]`: border rows; the left end, then slots.
    pub border: Vec<T>,
    /// `[q × q]`: D.
    pub corner: Vec<f64>,
    pivots: Vec<u32>,
    exchanged: Vec<bool>,
    /// Workspace for the factorisation of a block.
    tiles: Vec<T>,
    /// `[(m + 1) · n]`: zeros for lanes without an interval.
    nothing: Vec<f64>,
    step: Vec<T>,
    condensed_border: Vec<T>,
    pieces: Chain<T>,
    /// `[n]`: sizes of the components over D, for the growth of errors.
    scale: Vec<f64>,
    /// `[(m + 1) · n]`: D for the left end and the slots of an interval; empty if it is the identity.
    units: Vec<f64>,
    /// `[n]`: D.
    own_units: Vec<f64>,
    /// Compactified pieces, used instead of `pieces` if errors do not grow within them; below, true if that is so.
    products: Compound<T>,
    gentle: bool,
    whole: Chain<f64>,
    /// Conditions that replace (3), if any.
    open: Option<Ends>,
    /// Without (3): what the elimination leaves of the ends.
    apart: Option<Remainder>,
    last: Vec<f64>,
    last_pivots: Vec<usize>,
}

impl<T: Lane> Condensed<T> {
    /// System for dimension n, interval weights `end` (m + 1 of them), q scalars.
    pub fn new(n: usize, end: &[f64], q: usize) -> Condensed<T> {
        let m = end.len() - 1;
        let mut system = Condensed {
            n,
            m,
            q,
            closure: 1.0,
            end: end.to_vec(),
            nothing: vec![0.0; (m + 1) * n],
            scale: vec![1.0; n],
            own_units: vec![1.0; n],
            ..Condensed::default()
        };
        let every = vec![true; n * n];
        system.arrange(block::shape::<T>(&every, &every, m, n + q));
        system
    }

    /// Sets the sizes of the components: characteristic ones `[n]`, constant for a model, which determine D, and
    /// `present` ones `[n]`.
    pub fn measure_in(&mut self, characteristic: &[f64], present: &[f64]) {
        self.own_units.iter_mut().zip(characteristic).for_each(|(unit, size)| *unit = size.log2().round().exp2());
        self.scale.iter_mut().zip(present.iter().zip(&self.own_units)).for_each(|(to, (size, unit))| *to = size / unit);
        self.lay_units();
    }

    /// Computes D for the layout of an interval.
    fn lay_units(&mut self) {
        self.units.clear();
        if self.own_units.iter().any(|unit| *unit != 1.0) {
            self.units.extend(self.order.iter().map(|at| self.own_units[at % self.n]));
        }
    }

    /// Sets the sparsity pattern: component c depends on component d if `pattern[c n + d]`. A is the identity except at
    /// such (i, c), (k, d), and B is zero unless c = d. The slots may change. Without this call every entry may be
    /// nonzero.
    pub fn couple(&mut self, pattern: &[bool]) {
        let n = self.n;
        if pattern != self.shape.pattern() {
            let ends: Vec<bool> = (0..n * n).map(|k| k % (n + 1) == 0).collect();
            self.arrange(block::shape::<T>(pattern, &ends, self.m, n + self.q));
        }
    }

    fn arrange(&mut self, shape: Shape) {
        let (n, m) = (self.n, self.m);
        self.order = (0..n * (m + 1)).collect();
        for i in 0..m {
            (0..n).for_each(|c| self.order[n + shape.slot(i, c)] = (i + 1) * n + c);
        }
        self.shape = shape;
        self.tidy = false;
        self.lay_units();
    }

    /// Sets A to zero at a place, except for the entries that [`Condensed::couple`] allows to differ from the identity;
    /// these must be written afterwards.
    #[inline(always)]
    pub fn clear(&mut self, t: usize) {
        let inner = self.m * self.n;
        if !self.tidy {
            self.interior.fill(T::default());
            self.tidy = true;
        }
        let a = &mut self.interior[t * inner * inner..(t + 1) * inner * inner];
        if self.exchanged[t] || self.shape.is_plain() {
            a.fill(T::default());
            return;
        }
        let m = self.m;
        for [p, q] in &self.shape.fresh {
            for row in a[p * m * inner..(p + 1) * m * inner].chunks_exact_mut(inner) {
                row[q * m..(q + 1) * m].fill(T::default());
            }
        }
    }

    /// Row and column of component c at interior node i of an interval.
    #[inline(always)]
    pub fn slot(&self, i: usize, c: usize) -> usize {
        self.shape.slot(i, c)
    }

    /// Resizes for a number of intervals; the contents are then undefined.
    pub fn resize(&mut self, intervals: usize) {
        let (n, q, inner) = (self.n, self.q, self.m * self.n);
        let length = intervals.div_ceil(T::COUNT);
        (self.intervals, self.length) = (intervals, length);
        room(&mut self.interior, length * inner * inner);
        room(&mut self.coupling, length * inner * (n + q));
        room(&mut self.border, q * length * (inner + n));
        room(&mut self.corner, q * q);
        room(&mut self.pivots, length * inner * T::COUNT);
        room(&mut self.exchanged, length);
        room(&mut self.step, length * n * (n + q));
        room(&mut self.condensed_border, length * q * n);
        self.pieces.resize(n, q, length);
        self.products.resize(n, q, length);
        self.whole.resize(n, q, T::COUNT);
        self.last.resize((n + q) * (n + q), 0.0);
        self.last_pivots.resize(n + q, 0);
    }

    /// n and q.
    pub fn shape(&self) -> (usize, usize) {
        (self.n, self.q)
    }

    /// L, the number of places per lane.
    pub fn length(&self) -> usize {
        self.length
    }

    /// Writes the transition matrix G_j, `[n × n]`, from the left to the right end of interval j.
    pub fn transition(&self, j: usize, to: &mut [f64]) {
        let (n, width) = (self.n, self.n + self.q);
        let (lane, place) = (j / self.length, j % self.length);
        let step = &self.step[place * n * width..(place + 1) * n * width];
        for (row, line) in to.chunks_exact_mut(n).zip(step.chunks_exact(width)) {
            row.iter_mut().zip(line).for_each(|(x, g)| *x = g.lanes()[lane]);
        }
        if !self.units.is_empty() {
            to.iter_mut().enumerate().for_each(|(k, x)| *x *= self.units[k / n] / self.units[k % n]);
        }
    }

    /// Writes the dependence of the inner nodes on the left end for the intervals in `piece`, `[m][n × n][stride]` with
    /// one interval per entry of a line. The intervals must be condensed.
    pub fn inner(&self, piece: std::ops::Range<usize>, stride: usize, to: &mut [f64]) {
        let (n, width, inner) = (self.n, self.n + self.q, self.m * self.n);
        for (k, line) in to.chunks_exact_mut(stride).enumerate() {
            let (row, column) = (k / n, k % n);
            let own = self.slot(row / n, row % n) * width + column;
            let unit = if self.units.is_empty() { -1.0 } else { -self.units[row % n] / self.units[column] };
            let mut j = piece.start;
            while j < piece.end {
                let (lane, place) = (j / self.length, j % self.length);
                let places = self.coupling[own + place * inner * width..].iter().step_by(inner * width);
                let count = (self.length - place).min(piece.end - j);
                let to = &mut line[j - piece.start..][..count];
                to.iter_mut().zip(places).for_each(|(x, c)| *x = unit * c.lanes()[lane]);
                j += count;
            }
        }
    }

    /// Condenses every interval. `interior`, `coupling` and `border` must be filled.
    ///
    /// # Errors
    /// [`Singular`] if an interior block is.
    pub fn condense(&mut self) -> Result<(), Singular> {
        T::dispatch(Condense(self))
    }

    /// Makes the equations of the inner nodes of interval j those of the nodes alone, X_j = …, before it is condensed:
    /// A = 1, and B and the first `scalars` columns of C are zero. [`Condensed::replace`] says what they depend on.
    pub fn isolate(&mut self, j: usize, scalars: usize) {
        let (inner, width) = (self.m * self.n, self.n + self.q);
        let (lane, t) = (j / self.length, j % self.length);
        for row in 0..inner {
            let a = &mut self.interior[(t * inner + row) * inner..(t * inner + row + 1) * inner];
            a.iter_mut().enumerate().for_each(|(k, x)| x.lanes_mut()[lane] = if k == row { 1.0 } else { 0.0 });
            let b = &mut self.coupling[(t * inner + row) * width..][..self.n + scalars];
            b.iter_mut().for_each(|x| x.lanes_mut()[lane] = 0.0);
        }
    }

    /// Says how the inner nodes of an isolated interval j follow from its left end and the first scalars, once it is
    /// condensed: `by` is `[m][n][n + scalars]`.
    pub fn replace(&mut self, j: usize, by: &[f64]) {
        let (n, m, width) = (self.n, self.m, self.n + self.q);
        let (lane, t) = (j / self.length, j % self.length);
        let columns = by.len() / (m * n);
        let unit = |c: usize| if self.units.is_empty() { 1.0 } else { self.own_units[c] };
        for (k, row) in by.chunks_exact(columns).enumerate() {
            let own = &mut self.coupling[(t * m * n + self.shape.slot(k / n, k % n)) * width..][..columns];
            for (c, (x, value)) in own.iter_mut().zip(row).enumerate() {
                x.lanes_mut()[lane] = -value * if c < n { unit(c) } else { 1.0 } / unit(k % n);
            }
        }
        for i in 0..n {
            for c in 0..width {
                let own = |k: usize| self.coupling[(t * m * n + self.shape.slot(k, i)) * width + c].lanes()[lane];
                let inner: f64 = (0..m).map(|k| self.end[k + 1] * own(k)).sum();
                let step = if c == i { self.end[0] } else { 0.0 } - inner;
                self.step[(t * n + i) * width + c].lanes_mut()[lane] = step;
            }
        }
    }

    /// Eliminates the interval ends, once after each [`Condensed::condense`]. `closure` is κ of (3).
    ///
    /// # Errors
    /// [`Singular`] if the remaining matrix is.
    pub fn eliminate(&mut self, closure: f64) -> Result<(), Singular> {
        self.closure = closure;
        T::dispatch(Eliminate(self))
    }

    /// Replaces (3) by conditions on both ends until the next call. The right-hand sides of a solution then contain those
    /// of the conditions behind the others.
    pub fn open(&mut self, ends: Option<Ends>) {
        self.open = ends;
    }

    /// Leaves the ends free: elimination stops at the relation between them, which [`Condensed::remainder`] returns.
    pub fn leave_apart(&mut self) {
        self.apart = Some(Remainder::default());
    }

    /// The relation between free ends that the last elimination left.
    pub fn remainder(&self) -> Option<&Remainder> {
        self.apart.as_ref()
    }

    /// Carries right-hand sides, as for [`Condensed::solve`], to the free ends: `to` receives h (n) of the remaining
    /// relation and s (q) of the border.
    pub fn forward(&self, rhs: &[f64], to: &mut [f64]) {
        T::dispatch(Solve { system: self, rhs, x: to, stage: Stage::Forward });
    }

    /// The solution for right-hand sides `rhs` where the free ends and the scalars are `known`, x_0, x_N (n each) and
    /// σ (q).
    pub fn backward(&self, rhs: &[f64], known: &[f64], x: &mut [f64]) {
        T::dispatch(Solve { system: self, rhs, x, stage: Stage::Backward(known) });
    }

    /// The conditions on both ends that replace (3), if any.
    pub fn ends(&self) -> Option<&Ends> {
        self.open.as_ref()
    }

    /// Solves (1)–(4). `rhs` contains c_j (n) and r_j (m·n) for each interval, then s (q); the solution contains x_j
    /// and X_j for each interval, then σ.
    pub fn solve(&self, rhs: &[f64], x: &mut [f64]) {
        T::dispatch(Solve { system: self, rhs, x, stage: Stage::Whole });
    }

    /// Solves the transposed system. `z` has the layout of the unknowns (x_j, X_j per interval, then σ), `y` that of
    /// the equations (c_j, r_j per interval, then s).
    pub fn solve_transposed(&self, z: &[f64], y: &mut [f64]) {
        T::dispatch(SolveTransposed { system: self, z, y });
    }

    /// Converts the layout per interval, `[N][block]` with block = (m + 1) · n, to lanes, `[L][block]` in slots; zero
    /// beyond N.
    #[inline(always)]
    fn deal(&self, from: &[f64], block: usize) -> Vec<T> {
        let mut out = vec![T::default(); self.length * block];
        for (t, out) in out.chunks_exact_mut(block).enumerate() {
            let mut own = [&self.nothing[..]; 8];
            for lane in 0..T::COUNT {
                let j = lane * self.length + t;
                if j < self.intervals {
                    own[lane] = &from[j * block..(j + 1) * block];
                }
            }
            for (to, source) in out.iter_mut().zip(&self.order[..block]) {
                *to = T::each(|lane| own[lane][*source]);
            }
        }
        out
    }

    /// Multiplies a vector in lanes by D, or by its inverse.
    #[inline(always)]
    fn convert(&self, dealt: &mut [T], inverse: bool) {
        if self.units.is_empty() {
            return;
        }
        for own in dealt.chunks_exact_mut(self.units.len()) {
            for (x, unit) in own.iter_mut().zip(&self.units) {
                *x = *x * T::splat(if inverse { 1.0 / unit } else { *unit });
            }
        }
    }

    /// Inverse of [`Condensed::deal`].
    #[inline(always)]
    fn collect(&self, from: &[T], to: &mut [f64], block: usize) {
        let order = &self.order[..block];
        for (t, from) in from.chunks_exact(block).enumerate() {
            for lane in 0..T::COUNT {
                let j = lane * self.length + t;
                if let Some(x) = (j < self.intervals).then(|| &mut to[j * block..(j + 1) * block]) {
                    for (from, target) in from.iter().zip(order) {
                        x[*target] = from.lanes()[lane];
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn lines(&self, t: usize) -> &[T] {
        let size = self.m * self.n * (self.n + self.q);
        &self.coupling[t * size..(t + 1) * size]
    }

    /// `[L][n × (n + q)]`: (G_j, g_j).
    #[inline(always)]
    fn links(&self) -> &[T] {
        &self.step[..self.length * self.n * (self.n + self.q)]
    }

    /// `[L][q × n]`: the border in terms of the interval ends alone.
    #[inline(always)]
    fn border_at_ends(&self) -> &[T] {
        &self.condensed_border[..self.length * self.q * self.n]
    }

    /// x = A_t⁻¹ x, or x = A_t⁻ᵀ x.
    #[inline(always)]
    fn interior_solve(&self, t: usize, transposed: bool, x: &mut [T]) {
        let inner = self.m * self.n;
        let a = &self.interior[t * inner * inner..(t + 1) * inner * inner];
        let pivots = &self.pivots[t * inner * T::COUNT..(t + 1) * inner * T::COUNT];
        let solve = if transposed { block::solve_transposed } else { block::solve };
        solve(a, inner, pivots, self.exchanged[t], x, &self.shape);
    }
}

/// Grows a vector to a length, but never shrinks it, so that meshes that alternate do not cause repeated
/// initialisation.
fn room<X: Copy + Default>(v: &mut Vec<X>, length: usize) {
    if v.len() < length {
        // The old contents are not needed. They are freed first, and no excess capacity is allocated.
        *v = Vec::new();
        *v = vec![X::default(); length];
    }
}

/// Sum over the lanes, in order.
#[inline(always)]
fn total<T: Lane>(x: T) -> f64 {
    x.lanes().iter().sum()
}

/// Splits vectors of n components into their lanes, one after the other.
#[inline(always)]
fn unzipped<T: Lane>(x: &[T]) -> Vec<f64> {
    let mut out = vec![0.0; T::COUNT * x.len()];
    for (l, part) in out.chunks_exact_mut(x.len().max(1)).enumerate() {
        for (o, x) in part.iter_mut().zip(x) {
            intact::<T>();
            *o = x.lanes()[l];
        }
    }
    out
}

struct Condense<'a, T>(&'a mut Condensed<T>);

impl<T: Lane> pulp::NullaryFnOnce for Condense<'_, T> {
    type Output = Result<(), Singular>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Condensed { n, m, q, length, .. } = *self.0;
        // Without a closure, which would be compiled separately, without the vector instructions.
        for t in 0..length {
            self.0.condense_at(t, [n, m, q])?;
        }
        Ok(())
    }
}

impl<T: Lane> Condensed<T> {
    /// Condenses the intervals at place t alone, from within [`Lane::dispatch`], so that a caller can do so while they
    /// are in the cache. The dimensions n, m and q are passed again, so that a caller can make them constants.
    ///
    /// # Errors
    /// [`Singular`] if an interior block is.
    #[inline(always)]
    pub fn condense_at(&mut self, t: usize, [n, m, q]: [usize; 3]) -> Result<(), Singular> {
        let (inner, width) = (m * n, n + q);
        if !self.units.is_empty() {
            self.convert_at(t, [n, m, q]);
        }
        let Condensed { interior, coupling, pivots, exchanged, step, shape, end, tiles, .. } = self;
        let a = &mut interior[t * inner * inner..(t + 1) * inner * inner];
        let w = &mut coupling[t * inner * width..(t + 1) * inner * width];
        let p = &mut pivots[t * inner * T::COUNT..(t + 1) * inner * T::COUNT];
        // If the factorisation fails, every entry may have changed.
        exchanged[t] = true;
        exchanged[t] = block::factorise(a, inner, p, w, width, shape, m, tiles)?;
        let step = &mut step[t * n * width..(t + 1) * n * width];
        step.fill(T::default());
        for i in 0..n {
            let row = &mut step[i * width..(i + 1) * width];
            row[i] = T::splat(end[0]);
            for k in 0..m {
                let at = shape.slot(k, i) * width;
                subtract(T::splat(end[k + 1]), &w[at..at + width], row);
            }
        }
        Ok(())
    }
}

impl<T: Lane> Condensed<T> {
    /// Computes D⁻¹ A D and D⁻¹ (B D, C) for the intervals at place t.
    fn convert_at(&mut self, t: usize, [n, m, q]: [usize; 3]) {
        let (inner, width) = (m * n, n + q);
        let Condensed { interior, coupling, units, shape, own_units, .. } = self;
        let ends = &units[..n];
        for c in 0..n {
            let (own, first) = (own_units[c], shape.slot(0, c));
            let rows = &mut interior[(t * inner + first) * inner..][..m * inner];
            let others = (0..n).filter(|d| *d != c && own_units[*d] != own && shape.pattern()[c * n + d]);
            for (d, unit) in others.map(|d| (shape.slot(0, d), own_units[d] / own)) {
                let entries = rows.chunks_exact_mut(inner).flat_map(|row| &mut row[d..d + m]);
                entries.for_each(|x| *x = *x * T::splat(unit));
            }
            for row in coupling[(t * inner + first) * width..][..m * width].chunks_exact_mut(width) {
                let columns = ends.iter().copied().chain(std::iter::repeat(1.0));
                row.iter_mut().zip(columns).for_each(|(x, unit)| *x = *x * T::splat(unit / own));
            }
        }
    }
}

impl Condensed<f64> {
    /// Eight columns, from `first` on, of the dependence of the inner nodes of interval j on its left end, `[m][n]`.
    /// The interval must be condensed.
    #[inline(always)]
    pub fn inner_columns(&self, j: usize, first: usize, to: &mut [Eight]) {
        let (n, width, inner) = (self.n, self.n + self.q, self.m * self.n);
        let rows = &self.coupling[j * inner * width..(j + 1) * inner * width];
        for (k, to) in to.iter_mut().enumerate() {
            let (slot, own) = (self.slot(k / n, k % n), self.own_units[k % n]);
            let row = &rows[slot * width + first..slot * width + n];
            *to = Eight::default();
            for ((to, x), unit) in to.lanes_mut().iter_mut().zip(row).zip(&self.own_units[first..]) {
                *to = -x * (own / unit);
            }
        }
    }

    /// Solves with the interior of interval j for eight right-hand sides, `[m][n]`, in place.
    #[inline(always)]
    pub fn solve_inner_columns(&self, j: usize, x: &mut [Eight]) {
        let (n, inner) = (self.n, self.m * self.n);
        let mut slots = vec![Eight::default(); inner];
        for (k, x) in x.iter().enumerate() {
            slots[self.slot(k / n, k % n)] = *x * Eight::splat(1.0 / self.own_units[k % n]);
        }
        let a = &self.interior[j * inner * inner..(j + 1) * inner * inner];
        let pivots = &self.pivots[j * inner..(j + 1) * inner];
        block::solve_columns(a, inner, pivots, self.exchanged[j], &mut slots, &self.shape);
        for (k, x) in x.iter_mut().enumerate() {
            *x = slots[self.slot(k / n, k % n)] * Eight::splat(self.own_units[k % n]);
        }
    }
}

struct Eliminate<'a, T>(&'a mut Condensed<T>);

/// Condensed intervals as links, in every lane, with E = 1.
struct Steps<'a, T> {
    step: &'a [T],
    n: usize,
    q: usize,
}

impl<T: Lane> Links<T> for Steps<'_, T> {
    #[inline(always)]
    fn write(&self, t: usize, rows: &mut [T]) {
        let Steps { step, n, q } = *self;
        let (width, full) = (n + q, 3 * n + q);
        for i in 0..n {
            let g = &step[(t * n + i) * width..(t * n + i + 1) * width];
            let row = &mut rows[i * full..(i + 1) * full];
            for c in 0..n {
                intact::<T>();
                row[c] = T::default() - g[c];
            }
            row[n + i] = T::splat(1.0);
            for c in 0..q {
                intact::<T>();
                row[3 * n + c] = T::default() - g[n + c];
            }
        }
    }
}

/// Pieces as links between their ends, with x_L in the second column block and x_0 in the third.
struct Pieces<'a, T> {
    relation: &'a [T],
    n: usize,
    q: usize,
}

impl<T: Lane> Links<f64> for Pieces<'_, T> {
    #[inline(always)]
    fn write(&self, l: usize, rows: &mut [f64]) {
        let Pieces { relation, n, q } = *self;
        let full = 3 * n + q;
        for (row, line) in rows.chunks_exact_mut(full).zip(relation.chunks_exact(full)) {
            for c in 0..n {
                intact::<T>();
                row[c] = line[2 * n + c].lanes()[l];
                row[n + c] = line[n + c].lanes()[l];
            }
            for c in 0..q {
                intact::<T>();
                row[3 * n + c] = line[3 * n + c].lanes()[l];
            }
        }
    }
}

impl<T: Lane> pulp::NullaryFnOnce for Eliminate<'_, T> {
    type Output = Result<(), Singular>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        let mut corner = self.0.corner.clone();
        let (used, block) = (self.0.q * self.0.length * (self.0.m + 1) * self.0.n, (self.0.m + 1) * self.0.n);
        let Condensed { border, units, .. } = &mut *self.0;
        for row in border[..used].chunks_exact_mut(block) {
            row.iter_mut().zip(&*units).for_each(|(x, unit)| *x = *x * T::splat(*unit));
        }
        let taken = self.0.condense_border();
        corner.iter_mut().zip(&taken).for_each(|(d, t)| *d += total(*t));
        // A single lane contains the whole cycle, and with few components compactification does not pay.
        if (T::COUNT > 1 || self.0.n >= MANY) && self.0.reduced(&corner, true).is_ok() && self.0.is_settled() {
            return Ok(());
        }
        self.0.reduced(&corner, false)
    }
}

/// Ratio of the largest to the smallest pivot of the last matrix up to which pieces may be compactified. Close to
/// singularity, next to branches that cross or nearly do, the digits lost by this are needed.
const REGULAR: f64 = 1e6;

impl<T: Lane> Condensed<T> {
    /// Reduces the system to the last matrix, by compactification if `together`, else by chains.
    ///
    /// # Errors
    /// [`Singular`] if the last matrix is, or if errors grow too much for compactification.
    #[inline(always)]
    fn reduced(&mut self, corner: &[f64], together: bool) -> Result<(), Singular> {
        let Condensed { n, q, closure, length, .. } = *self;
        let (width, full) = (n + q, 3 * n + q);
        let Condensed {
            step, condensed_border, pieces, scale, products, gentle, whole, open, apart, own_units, ..
        } = self;
        let (step, condensed_border) = (&step[..length * n * width], &condensed_border[..length * q * n]);
        *gentle = together;
        if together {
            // Common sizes as constants.
            let safe = match (n, q) {
                (4, 2) => compounded(products, step, condensed_border, pieces, scale, [4, 2]),
                (n, q) => compounded(products, step, condensed_border, pieces, scale, [n, q]),
            };
            if !safe {
                return Err(Singular);
            }
        } else {
            pieces.eliminate(Steps { step, n, q }, condensed_border)?;
        }
        let mut border = unzipped(&pieces.first);
        let beyond = unzipped(&pieces.last);
        add(1.0, &beyond[..(T::COUNT - 1) * q * n], &mut border[q * n..]);
        whole.eliminate(Pieces { relation: &pieces.relation, n, q }, &border)?;
        add(1.0, &beyond[(T::COUNT - 1) * q * n..], &mut whole.last);
        if let Some(apart) = apart {
            let sum = |k: usize| corner[k] + total(pieces.corner[k]) + whole.corner[k];
            let corner: Vec<f64> = (0..q * q).map(sum).collect();
            apart.take(whole, corner, own_units, [n, q]);
            return Ok(());
        }
        if let Some(ends) = open {
            let sum = |k: usize| corner[k] + total(pieces.corner[k]) + whole.corner[k];
            let corner: Vec<f64> = (0..q * q).map(sum).collect();
            let [own, of_pieces] = [whole.orientation(), if together { 1.0 } else { product(pieces.orientation()) }];
            return ends.factorise(whole, &corner, own_units, own * of_pieces, [n, q]);
        }
        let Condensed { last, last_pivots, pieces, whole, .. } = self;
        for i in 0..n {
            let line = &whole.relation[i * full..(i + 1) * full];
            for c in 0..n {
                last[i * width + c] = closure * line[n + c] + line[2 * n + c];
            }
            last[i * width + n..(i + 1) * width].copy_from_slice(&line[3 * n..]);
        }
        for r in 0..q {
            for c in 0..n {
                last[(n + r) * width + c] = whole.first[r * n + c] + closure * whole.last[r * n + c];
            }
            for c in 0..q {
                let k = r * q + c;
                last[(n + r) * width + n + c] = corner[k] + total(pieces.corner[k]) + whole.corner[k];
            }
        }
        lu::factorise_even(last, width, last_pivots)
    }

    /// True if the last matrix is far from singular.
    fn is_settled(&self) -> bool {
        // Conditions on the ends have units of their own, which pivots would have to be compared in.
        if self.open.is_some() || self.apart.is_some() {
            return true;
        }
        let width = self.n + self.q;
        let pivots = self.last.iter().step_by(width + 1).take(width).map(|pivot| pivot.abs());
        let [least, most] = pivots.fold([f64::INFINITY, 0.0], |[least, most], x| [x.min(least), x.max(most)]);
        most <= REGULAR * least
    }
}

/// Product over the lanes.
fn product<T: Lane>(x: T) -> f64 {
    x.lanes().iter().product()
}

/// Compactifies every piece and writes the result where the elimination of a chain would; false if errors grow.
#[inline(always)]
fn compounded<T: Lane>(
    products: &mut Compound<T>,
    step: &[T],
    border: &[T],
    pieces: &mut Chain<T>,
    scale: &[f64],
    [n, q]: [usize; 2],
) -> bool {
    let (full, width) = (3 * n + q, n + q);
    if q == 0 || !products.multiply(step, scale, n, q) {
        return false;
    }
    [&mut pieces.relation, &mut pieces.first, &mut pieces.last, &mut pieces.corner]
        .into_iter()
        .for_each(|part| part.fill(T::default()));
    for (i, (row, product)) in
        pieces.relation.chunks_exact_mut(full).zip(products.whole(n, q).chunks_exact(width)).enumerate()
    {
        row[n + i] = T::splat(1.0);
        for c in 0..n {
            intact::<T>();
            row[2 * n + c] = T::default() - product[c];
        }
        for c in 0..q {
            intact::<T>();
            row[3 * n + c] = T::default() - product[n + c];
        }
    }
    products.carry_border(border, &mut pieces.first, &mut pieces.corner, n, q);
    true
}

impl<T: Lane> Condensed<T> {
    /// Expresses the border rows by the interval ends alone; returns `[q × q]`, the contribution to D.
    #[inline(always)]
    fn condense_border(&mut self) -> Vec<T> {
        let Condensed { n, m, q, length, .. } = *self;
        let (inner, width) = (m * n, n + q);
        let block = inner + n;
        let mut taken = vec![T::default(); q * q];
        let Condensed { coupling, border, condensed_border, .. } = self;
        for t in 0..length {
            let w = &coupling[t * inner * width..(t + 1) * inner * width];
            for c in 0..q {
                let row = &border[(c * length + t) * block..(c * length + t + 1) * block];
                let p = &mut condensed_border[(t * q + c) * n..(t * q + c + 1) * n];
                p.copy_from_slice(&row[..n]);
                let own = &mut taken[c * q..(c + 1) * q];
                tile::subtract_combination(p, &row[n..], w, width, 0);
                tile::subtract_combination(own, &row[n..], w, width, n);
            }
        }
        taken
    }
}

/// The part of the solution that is asked for.
enum Stage<'a> {
    Whole,
    /// To the relation between the ends and the border.
    Forward,
    /// From x_0, x_N and σ.
    Backward(&'a [f64]),
}

struct Solve<'a, T> {
    system: &'a Condensed<T>,
    rhs: &'a [f64],
    x: &'a mut [f64],
    stage: Stage<'a>,
}

impl<T: Lane> pulp::NullaryFnOnce for Solve<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Condensed { n, m, q, .. } = *self.system;
        // Common sizes as constants.
        match (n, m, q) {
            (4, 4, 2) if T::COUNT > 1 => self.solved([4, 4, 2]),
            (n, m, q) => self.solved([n, m, q]),
        }
    }
}

impl<T: Lane> Solve<'_, T> {
    /// Solves; the dimensions are passed again, so that they can be constants.
    #[inline(always)]
    fn solved(self, [n, m, q]: [usize; 3]) {
        let Solve { system, rhs, x, stage } = self;
        let Condensed { intervals, length, closure, .. } = *system;
        let (width, block) = (n + q, (m + 1) * n);
        let size = intervals * block;
        // For a tangent only the border has a nonzero right-hand side, and nothing is propagated through the intervals.
        let idle = rhs[..size].iter().all(|r| *r == 0.0);
        let mut z = match idle {
            true => vec![T::default(); length * block],
            false => system.deal(&rhs[..size], block),
        };
        system.convert(&mut z, true);
        // A single allocation.
        let mut room = vec![T::default(); length * n + 2 * n + 2 * q];
        let (h, rest) = room.split_at_mut(length * n);
        let (taken, rest) = rest.split_at_mut(q);
        let (scalars, rest) = rest.split_at_mut(q);
        let (left, right) = rest.split_at_mut(n);
        for t in 0..if idle { 0 } else { length } {
            let own = &mut z[t * block..(t + 1) * block];
            system.interior_solve(t, false, &mut own[n..]);
            let target = &mut h[t * n..(t + 1) * n];
            target.copy_from_slice(&own[..n]);
            for (c, target) in target.iter_mut().enumerate() {
                for k in 0..m {
                    *target = *target + T::splat(system.end[k + 1]) * own[n + system.slot(k, c)];
                }
            }
            for c in 0..q {
                let row = &system.border[(c * length + t) * block + n..(c * length + t + 1) * block];
                taken[c] = taken[c] - dot(row, &own[n..]);
            }
        }
        match system.gentle {
            _ if idle => {}
            true => system.products.forward(system.links(), system.border_at_ends(), h, taken, [n, q]),
            false => system.pieces.forward(h, taken, [n, q]),
        }
        let mut ends = unzipped(&h[(length - 1) * n..]);
        // The last system, then the ends of the pieces, starting at x_0 and at the one after it.
        let mut room = vec![0.0; width + (T::COUNT + 1) * n];
        let (tail, nodes) = room.split_at_mut(width);
        system.whole.forward(&mut ends, &mut tail[n..], [n, q]);
        for c in 0..q {
            tail[n + c] += rhs[size + c] + total(taken[c]);
        }
        let (beginning, closing) = nodes.split_at_mut(T::COUNT * n);
        match (stage, &system.open) {
            (Stage::Forward, _) => {
                x[..n].copy_from_slice(&ends[(T::COUNT - 1) * n..]);
                x[n..n + q].copy_from_slice(&tail[n..]);
                return;
            }
            (Stage::Backward(known), _) => {
                let in_units = |k: usize| known[k] / system.own_units[k % n];
                (0..n).for_each(|k| (tail[k], closing[k]) = (in_units(k), in_units(n + k)));
                tail[n..].copy_from_slice(&known[2 * n..]);
            }
            (Stage::Whole, None) => {
                tail[..n].copy_from_slice(&ends[(T::COUNT - 1) * n..]);
                lu::solve(&system.last, width, &system.last_pivots, tail, 1);
                closing.iter_mut().zip(&tail[..n]).for_each(|(to, v)| *to = closure * v);
            }
            (Stage::Whole, Some(open)) => {
                let found = open.solve(&ends[(T::COUNT - 1) * n..], &tail[n..], &rhs[size + q..]);
                tail[..n].copy_from_slice(&found[..n]);
                tail[n..].copy_from_slice(&found[2 * n..]);
                closing.copy_from_slice(&found[n..2 * n]);
            }
        }
        let (first, sigma) = tail.split_at(n);
        system.whole.backward(&mut ends, first, closing, sigma, [n, q]);
        beginning[..n].copy_from_slice(first);
        beginning[n..].copy_from_slice(&ends[..(T::COUNT - 1) * n]);
        zip(&nodes[..T::COUNT * n], left);
        zip(&nodes[n..], right);
        scalars.iter_mut().zip(sigma).for_each(|(to, s)| *to = T::splat(*s));
        match system.gentle {
            true => system.products.backward(h, left, scalars, [n, q]),
            false => system.pieces.backward(h, left, right, scalars, [n, q]),
        }
        for t in 0..length {
            let (end, inside) = z[t * block..(t + 1) * block].split_at_mut(n);
            end.copy_from_slice(if t == 0 { left } else { &h[(t - 1) * n..t * n] });
            for (zi, line) in inside.iter_mut().zip(system.lines(t).chunks_exact(width)) {
                *zi = *zi - dot(&line[..n], &end[..n]) - dot(&line[n..], &scalars[..q]);
            }
        }
        system.convert(&mut z, false);
        system.collect(&z, x, block);
        x[size..].copy_from_slice(sigma);
    }
}

/// Distributes vectors, one after the other, over the lanes.
#[inline(always)]
fn zip<T: Lane>(x: &[f64], out: &mut [T]) {
    for (l, part) in x.chunks_exact(out.len()).enumerate() {
        for (o, v) in out.iter_mut().zip(part) {
            intact::<T>();
            o.lanes_mut()[l] = *v;
        }
    }
}

struct SolveTransposed<'a, T> {
    system: &'a Condensed<T>,
    z: &'a [f64],
    y: &'a mut [f64],
}

impl<T: Lane> pulp::NullaryFnOnce for SolveTransposed<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let SolveTransposed { system, z, y } = self;
        let Condensed { n, m, q, intervals, length, closure, .. } = *system;
        let (width, block) = (n + q, (m + 1) * n);
        let size = intervals * block;
        let mut own = system.deal(&z[..size], block);
        system.convert(&mut own, false);
        // Interior columns first: their contributions to the interval ends and the scalars.
        let mut ends = vec![T::default(); length * n];
        let mut sigma = vec![T::default(); q];
        for t in 0..length {
            let (end, inside) = own[t * block..(t + 1) * block].split_at(n);
            let target = &mut ends[t * n..(t + 1) * n];
            target.copy_from_slice(end);
            for (v, line) in inside.iter().zip(system.lines(t).chunks_exact(width)) {
                subtract(*v, &line[..n], target);
                subtract(*v, &line[n..], &mut sigma);
            }
        }
        let mut first = ends[..n].to_vec();
        let mut beyond = vec![T::default(); n];
        match system.gentle {
            true => system.products.forward_transposed(&ends, &mut first, &mut sigma, n, q),
            false => system.pieces.forward_transposed(&mut ends, &mut first, &mut beyond, &mut sigma),
        }
        let mut nodes = unzipped(&first);
        let after = unzipped(&beyond);
        add(1.0, &after[..(T::COUNT - 1) * n], &mut nodes[n..]);
        let mut tail = nodes[..n].to_vec();
        tail.extend(sigma.iter().zip(&z[size..]).map(|(s, z)| z + total(*s)));
        let mut closing = after[(T::COUNT - 1) * n..].to_vec();
        let (start, scalars) = tail.split_at_mut(n);
        system.whole.forward_transposed(&mut nodes, start, &mut closing, scalars);
        let mut conditions = Vec::new();
        match &system.open {
            None => {
                add(closure, &closing, start);
                lu::solve_transposed(&system.last, width, &system.last_pivots, &mut tail);
            }
            Some(open) => {
                let right = [&*start, &closing, &*scalars].concat();
                let [relation, border, own] = open.solve_transposed(right, [n, q]);
                (tail, conditions) = ([relation, border].concat(), own);
            }
        }
        let (carry, border) = tail.split_at(n);
        system.whole.backward_transposed(&mut nodes, carry, border);
        let mut carry = vec![T::default(); n];
        zip(&nodes, &mut carry);
        let rows: Vec<T> = border.iter().map(|b| T::splat(*b)).collect();
        match system.gentle {
            true => {
                system.products.backward_transposed(system.links(), system.border_at_ends(), &mut ends, &carry, &rows)
            }
            false => system.pieces.backward_transposed(&mut ends, &carry, &rows),
        }
        for t in 0..length {
            let out = &mut own[t * block..(t + 1) * block];
            let end = &ends[t * n..(t + 1) * n];
            out[..n].copy_from_slice(end);
            for (c, end) in end.iter().enumerate() {
                for k in 0..m {
                    let at = n + system.slot(k, c);
                    out[at] = out[at] + T::splat(system.end[k + 1]) * *end;
                }
            }
            for c in 0..q {
                let row = &system.border[(c * length + t) * block + n..(c * length + t + 1) * block];
                subtract(rows[c], row, &mut out[n..]);
            }
            system.interior_solve(t, true, &mut out[n..]);
        }
        system.convert(&mut own, true);
        system.collect(&own, y, block);
        y[size..size + q].copy_from_slice(border);
        y[size + q..].copy_from_slice(&conditions);
    }
}

#[cfg(test)]
mod tests {
    use super::super::lane::Eight;
    use super::*;
    use foldline_general::{Factored, Mat};

    /// Equations (1)–(4) as one dense matrix.
    fn dense<T: Lane>(s: &Condensed<T>, closure: f64) -> Mat<f64> {
        let (n, inner, q, count) = (s.n, s.m * s.n, s.q, s.intervals);
        let (block, width) = (n + inner, n + q);
        let size = count * block + q;
        let mut a = Mat::zeros(size, size);
        for j in 0..count {
            let (lane, t) = (j / s.length, j % s.length);
            let row = j * block;
            let (next, factor) = if j + 1 == count { (0, closure) } else { ((j + 1) * block, 1.0) };
            for i in 0..n {
                a[(row + i, next + i)] += factor;
                a[(row + i, row + i)] -= s.end[0];
                for k in 0..s.m {
                    a[(row + i, row + n + k * n + i)] -= s.end[k + 1];
                }
            }
            for i in 0..inner {
                let i_row = row + s.order[n + i];
                for k in 0..inner {
                    a[(i_row, row + s.order[n + k])] = s.interior[(t * inner + i) * inner + k].lanes()[lane];
                }
                for k in 0..width {
                    let column = if k < n { row + k } else { count * block + k - n };
                    a[(i_row, column)] = s.coupling[(t * inner + i) * width + k].lanes()[lane];
                }
            }
            for r in 0..q {
                for k in 0..block {
                    let entry = s.border[(r * s.length + t) * block + k];
                    a[(count * block + r, row + s.order[k])] = entry.lanes()[lane];
                }
            }
        }
        for k in 0..q * q {
            a[(count * block + k / q, count * block + k % q)] = s.corner[k];
        }
        a
    }

    /// True if component c depends on component d: a table for three components, neighbours for more, everything with
    /// two scalars.
    fn coupled(s: &Condensed<impl Lane>, c: usize, d: usize) -> bool {
        match (s.q, s.n) {
            (2, _) => true,
            (_, 3) => [false, true, false, true, false, false, true, true, true][c * 3 + d],
            _ => c.abs_diff(d) == 1 || (c == d && c % 2 == 1),
        }
    }

    fn empty<T: Lane>(n: usize, intervals: usize, q: usize) -> Condensed<T> {
        let mut s = Condensed::<T>::new(n, &[0.4, -0.7, 1.3], q);
        if q != 2 {
            let pattern: Vec<bool> = (0..n * n).map(|k| coupled(&s, k / n, k % n)).collect();
            s.couple(&pattern);
        }
        s.resize(intervals);
        s
    }

    /// Fills the system with entries between -1/2 and 1/2 and a strong diagonal; beyond the last interval the length is
    /// zero. Returns right-hand sides.
    fn fill<T: Lane>(s: &mut Condensed<T>, strength: f64) -> Vec<f64> {
        let Condensed { n, q, intervals, .. } = *s;
        let mut seed = 0.3f64;
        let mut next = || {
            seed = (seed * 97.13 + 0.711).fract();
            seed - 0.5
        };
        let (inner, width, block) = (2 * n, n + q, 3 * n);
        (0..s.length).for_each(|t| s.clear(t));
        for lane in 0..T::COUNT {
            for t in 0..s.length {
                let real = lane * s.length + t < intervals;
                let mut entry = |x: &mut T, empty: f64, shift: f64| {
                    x.lanes_mut()[lane] = if real { next() + shift } else { empty };
                };
                for k in 0..inner * inner {
                    let unit = f64::from(k % (inner + 1) == 0);
                    let (c, d) = (s.order[n + k / inner] % n, s.order[n + k % inner] % n);
                    let coupled = coupled(s, c, d);
                    let x = &mut s.interior[t * inner * inner + k];
                    if coupled {
                        entry(x, unit, strength * unit);
                    } else if unit == 1.0 {
                        x.lanes_mut()[lane] = unit;
                    }
                }
                for k in 0..inner * width {
                    let (c, d) = (s.order[n + k / width] % n, k % width);
                    let unit = f64::from(c == d);
                    let x = &mut s.coupling[t * inner * width + k];
                    if d < n && c != d && q != 2 {
                        x.lanes_mut()[lane] = 0.0;
                    } else {
                        entry(x, -unit, 0.0);
                    }
                }
                for r in 0..q {
                    for k in 0..block {
                        entry(&mut s.border[(r * s.length + t) * block + k], 0.0, 0.0);
                    }
                }
            }
        }
        s.corner.iter_mut().for_each(|x| *x = next());
        (0..intervals * block + q).map(|_| next()).collect()
    }

    /// Compares all solutions with dense ones; returns true if the pieces were compactified.
    fn agrees<T: Lane>(n: usize, intervals: usize, q: usize, closure: f64, strength: f64) -> bool {
        let mut system = empty::<T>(n, intervals, q);
        // The remains of an earlier factorisation, with or without row exchanges, must not matter.
        for earlier in [3.0, 0.1] {
            fill(&mut system, earlier);
            system.condense().unwrap();
        }
        let rhs = fill(&mut system, strength);
        let matrix = dense(&system, closure);
        let column = Mat::from_fn(rhs.len(), 1, |i, _| rhs[i]);
        system.condense().unwrap();
        system.eliminate(closure).unwrap();
        // A right-hand side that is zero except for the scalars.
        let border = |i: usize| if i < rhs.len() - q { 0.0 } else { rhs[i] };
        let alone: Vec<f64> = (0..rhs.len()).map(border).collect();
        let [mut x, mut y, mut z] = [(); 3].map(|()| vec![0.0; rhs.len()]);
        system.solve(&rhs, &mut x);
        system.solve_transposed(&rhs, &mut y);
        system.solve(&alone, &mut z);
        let factored = Factored::new(matrix.as_ref());
        let reference = factored.solve(&column);
        let transposed = Factored::new(matrix.transpose()).solve(&column);
        let of_border = factored.solve(&Mat::from_fn(rhs.len(), 1, |i, _| border(i)));
        for i in 0..rhs.len() {
            let what = format!("{n} components, {intervals} intervals in {} lanes, component {i}", T::COUNT);
            let near = |x: f64, reference: f64| (x - reference).abs() < 1e-9 * (1.0 + reference.abs());
            assert!(near(x[i], reference[(i, 0)]), "{what}: {} against {}", x[i], reference[(i, 0)]);
            assert!(near(y[i], transposed[(i, 0)]), "{what}, transposed");
            assert!(near(z[i], of_border[(i, 0)]), "{what}, border alone");
        }
        system.gentle
    }

    /// Compares solutions with conditions on both ends with dense ones: b conditions, and `live` of the q scalars in use.
    fn agrees_open<T: Lane>(n: usize, intervals: usize, q: usize, [b, live]: [usize; 2], strength: f64) {
        let mut s = empty::<T>(n, intervals, q);
        let sizes: Vec<f64> = (0..n).map(|k| f64::from(1 << (2 * k))).collect();
        s.measure_in(&sizes, &sizes);
        let rhs = fill(&mut s, strength);
        let (used, block) = (n + live - b, 3 * n);
        let (size, whole) = (intervals * block, intervals * block + n + q);
        let wave = |k: usize| (0.7 + (k * k) as f64 * 1.3).sin();
        let rows: Vec<f64> = (0..b * (2 * n + q)).map(wave).collect();
        // x_N follows the profile, then come the scalars; rows: x_N, then border rows and conditions.
        let cycle = dense(&s, 0.0);
        let place = |k: usize| if k < size { k } else { k + n };
        let mut a = Mat::zeros(whole, whole);
        for i in 0..size + used {
            (0..size + q).for_each(|k| a[(i, place(k))] = cycle[(i, k)]);
        }
        for i in 0..n {
            a[(size - block + i, size + i)] = 1.0;
        }
        for (r, row) in rows.chunks_exact(2 * n + q).enumerate() {
            for (k, x) in row.iter().enumerate() {
                a[(size + used + r, if k < n { k } else { size + k - n })] = *x;
            }
        }
        (0..q - live).for_each(|k| a[(size + used + b + k, size + n + live + k)] = 1.0);
        let c: Vec<f64> = (0..b).map(|k| wave(k + 7)).collect();
        let right = |i: usize| match i {
            _ if i < size + used => rhs[i],
            _ if i < size + used + b => c[i - size - used],
            _ => 0.0,
        };
        let reference = Factored::new(a.as_ref()).solve(&Mat::from_fn(whole, 1, |i, _| right(i)));
        s.open(Some(Ends::new(rows, used, live)));
        s.condense().unwrap();
        s.eliminate(1.0).unwrap();
        let mut x = vec![0.0; size + q];
        s.solve(&[&rhs[..], &c].concat(), &mut x);
        for (k, x) in x.iter().enumerate() {
            let expected = reference[(place(k), 0)];
            assert!((x - expected).abs() < 1e-8 * (1.0 + expected.abs()), "{k}: {x} against {expected}");
        }
        // Aᵀ y = z, which is tested by z·x = y·rhs.
        let z: Vec<f64> = (0..size + q).map(|k| if k < size + live { wave(k + 3) } else { 0.0 }).collect();
        let mut y = vec![0.0; size + q + b];
        s.solve_transposed(&z, &mut y);
        let known: Vec<f64> = (0..size + q).map(|k| if k < size + used { rhs[k] } else { 0.0 }).chain(c).collect();
        let [one, other] = [[&z, &x], [&y, &known]].map(|[a, b]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>());
        assert!((one - other).abs() < 1e-8 * (1.0 + one.abs()), "{one} against {other}");
    }

    #[test]
    fn conditions_on_both_ends_agree_with_a_dense_solution() {
        for strength in [3.0, 0.1] {
            for (intervals, q, ends) in
                [(1, 2, [3, 2]), (9, 2, [3, 2]), (17, 3, [1, 1]), (20, 3, [4, 3]), (40, 2, [3, 2])]
            {
                agrees_open::<f64>(3, intervals, q, ends, strength);
                agrees_open::<Eight>(3, intervals, q, ends, strength);
            }
        }
    }

    #[test]
    fn many_components_are_compactified_where_errors_do_not_grow() {
        for (intervals, q, closure) in [(1, 2, 1.0), (5, 1, -1.0), (9, 2, 1.0)] {
            for n in [MANY, MANY + 7] {
                assert!(agrees::<f64>(n, intervals, q, closure, 30.0), "{n} components, {intervals} intervals");
            }
        }
        assert!(!agrees::<f64>(MANY, 9, 2, 1.0, 1.0), "weak diagonals: errors grow");
    }

    /// Compares the solutions for eight columns with those for single ones.
    #[test]
    fn eight_columns_are_solved_like_single_ones() {
        for (strength, q) in [(3.0, 1), (0.1, 1), (3.0, 2)] {
            let mut s = empty::<f64>(20, 3, q);
            s.measure_in(&(0..20).map(|k| f64::from(1 << (k % 5))).collect::<Vec<_>>(), &[1.0; 20]);
            fill(&mut s, strength);
            s.condense().unwrap();
            let inner = s.m * s.n;
            let mut x: Vec<Eight> = (0..inner).map(|k| Eight::each(|lane| ((7 * k + lane) as f64).sin())).collect();
            let alone: Vec<Vec<f64>> = (0..8)
                .map(|lane| {
                    let mut own = vec![0.0; s.n + inner];
                    (0..inner).for_each(|k| own[s.n + s.slot(k / s.n, k % s.n)] = x[k].0[lane]);
                    s.convert(&mut own, true);
                    s.interior_solve(1, false, &mut own[s.n..]);
                    s.convert(&mut own, false);
                    (0..inner).map(|k| own[s.n + s.slot(k / s.n, k % s.n)]).collect()
                })
                .collect();
            s.solve_inner_columns(1, &mut x);
            for (k, x) in x.iter().enumerate() {
                for lane in 0..8 {
                    let expected = alone[lane][k];
                    assert!((x.0[lane] - expected).abs() < 1e-10 * (1.0 + expected.abs()), "{k} in lane {lane}");
                }
            }
            let (mut columns, mut all) = (vec![Eight::default(); inner], vec![0.0; s.m * s.n * s.n]);
            s.inner_columns(1, 16, &mut columns);
            s.inner(1..2, 1, &mut all);
            for (k, x) in columns.iter().enumerate() {
                assert_eq!(x.0[..4], all[k * s.n + 16..(k + 1) * s.n]);
                assert_eq!(x.0[4..], [0.0; 4]);
            }
        }
    }

    #[test]
    fn agrees_with_a_dense_solution_of_the_same_equations() {
        let mut chains = 0;
        for (intervals, q, closure) in [
            (1, 2, 1.0),
            (2, 1, -1.0),
            (7, 2, 1.0),
            (8, 2, 1.0),
            (5, 0, -1.0),
            (6, 3, 1.0),
            (17, 2, -1.0),
            (40, 2, 1.0),
        ] {
            assert!(!agrees::<f64>(3, intervals, q, closure, 3.0), "one lane is the whole cycle");
            let gentle = agrees::<Eight>(3, intervals, q, closure, 3.0);
            assert_eq!(gentle, q > 0, "{intervals} intervals");
            // Diagonals are rarely accepted as pivots, and errors grow from interval to interval.
            chains += usize::from(!agrees::<Eight>(3, intervals, q, closure, 0.1));
        }
        assert!(chains > 1, "the longer ones among those are eliminated as chains");
        // Sizes that are constants.
        assert!(agrees::<Eight>(4, 60, 2, 1.0, 3.0));
    }

    #[test]
    fn large_blocks_agree_with_a_dense_solution_whether_sparse_or_full() {
        for (intervals, q) in [(1, 1), (3, 2), (4, 3)] {
            for strength in [3.0, 0.1] {
                let plain = empty::<f64>(24, intervals, q).shape.is_plain();
                assert_eq!(plain, q == 2);
                let _ = agrees::<f64>(24, intervals, q, 1.0, strength);
            }
        }
    }
}
