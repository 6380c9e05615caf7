//! Sparsity of the interior matrix of an interval, and the order of elimination.
//!
//! **Idea.** Component c of f depends on few components: a velocity, for instance, is the rate of only one position.
//! Zero blocks that are skipped cost nothing. The nodes of a component stay together as one block. The components are
//! ordered so that each elimination touches as few entries (rows times columns) as possible, and the elimination is
//! carried out once on the pattern alone.
//!
//! **Equations.** Entry (i, c), (k, d) of A is δ_ik δ_cd - a_ik J_cd(k): zero if J_cd is, except on the diagonal.
//!
//! **Source.** duff2017, §7.2 (Markowitz's rule).

use std::ops::Range;

/// Order of elimination, and the blocks that each step touches. Components are numbered in that order from here on.
#[derive(Clone, Debug, Default)]
pub struct Shape {
    /// `[n × n]`, in the order of the model: true if component c depends on component d.
    pattern: Vec<bool>,
    /// Position of each component in the order of elimination.
    rank: Vec<usize>,
    /// Number of rows and columns of a component.
    pub nodes: usize,
    /// Elimination steps.
    pub steps: Vec<Step>,
    /// Blocks (row and column) that are zero before elimination but not afterwards, and diagonal blocks that are the
    /// identity.
    pub fresh: Vec<[usize; 2]>,
}

/// Blocks that the elimination of a component touches.
#[derive(Clone, Debug, Default)]
pub struct Step {
    /// True if its own block is not just the identity.
    pub own: bool,
    /// Later components whose equations contain it.
    pub below: Vec<usize>,
    /// Earlier components that its equations contain.
    pub left: Vec<usize>,
    /// Later components that its equations contain.
    pub right: Vec<usize>,
    /// Nonzero columns of the right-hand sides before back substitution.
    pub carried: Vec<Range<usize>>,
    /// Nonzero columns of the right-hand sides after back substitution.
    pub solved: Vec<Range<usize>>,
}

impl Shape {
    /// Shape for `nodes` nodes and `columns` right-hand sides: those of the n left ends, nonzero where `ends` `[n × n]`
    /// is true, then dense ones.
    pub fn new(pattern: &[bool], ends: &[bool], nodes: usize, columns: usize) -> Shape {
        let n = pattern.len().isqrt();
        let rank = ranks(pattern, n);
        let mut order = vec![0; n];
        rank.iter().enumerate().for_each(|(c, place)| order[*place] = c);
        let width = n + columns;
        let mut filled = vec![false; n * width];
        for (row, c) in filled.chunks_exact_mut(width.max(1)).zip(&order) {
            (0..n).for_each(|p| row[p] = pattern[c * n + order[p]]);
            (0..columns).for_each(|d| row[n + d] = d >= n || ends[c * n + d]);
        }
        for p in 0..n {
            let (upper, lower) = filled.split_at_mut((p + 1) * width);
            for row in lower.chunks_exact_mut(width).filter(|row| row[p]) {
                (p + 1..width).for_each(|at| row[at] |= upper[p * width + at]);
            }
        }
        let starts_empty = |p: usize, j: usize| !pattern[order[p] * n + order[j]];
        let fresh = (0..n * n)
            .map(|k| [k / n, k % n])
            .filter(|&[p, j]| starts_empty(p, j) && (p == j || filled[p * width + j]))
            .collect();
        let mut steps: Vec<Step> = (0..n)
            .map(|p| {
                let row = &filled[p * width..(p + 1) * width];
                Step {
                    own: row[p],
                    below: (p + 1..n).filter(|i| filled[i * width + p]).collect(),
                    left: (0..p).filter(|j| row[*j]).collect(),
                    right: (p + 1..n).filter(|j| row[*j]).collect(),
                    carried: ranges(&row[n..]),
                    solved: Vec::new(),
                }
            })
            .collect();
        for p in (0..n).rev() {
            let (head, tail) = filled.split_at_mut((p + 1) * width);
            let row = &mut head[p * width..];
            for (i, below) in tail.chunks_exact(width).enumerate() {
                if row[p + 1 + i] {
                    (n..width).for_each(|at| row[at] |= below[at]);
                }
            }
            steps[p].solved = ranges(&row[n..]);
        }
        Shape { pattern: pattern.to_vec(), rank, nodes, steps, fresh }
    }

    /// Shape with the components in their own order and no steps, for matrices that fill the vectors by themselves.
    pub fn plain(pattern: &[bool], nodes: usize) -> Shape {
        Shape { pattern: pattern.to_vec(), rank: (0..pattern.len().isqrt()).collect(), nodes, ..Shape::default() }
    }

    /// True if there are no steps, so that every entry is processed.
    #[inline(always)]
    pub fn is_plain(&self) -> bool {
        self.steps.is_empty()
    }

    /// Number of products of entries in all steps, as a share of that for a full matrix.
    pub fn share(&self, columns: usize) -> f64 {
        let products = |below: usize, right: usize| (below * right * self.nodes + (below + right) * columns) as f64;
        let taken: f64 = self.steps.iter().map(|step| products(step.below.len(), step.right.len())).sum();
        taken / (0..self.steps.len()).map(|rest| products(rest, rest)).sum::<f64>()
    }

    /// The pattern given to [`Shape::new`] or [`Shape::plain`].
    pub fn pattern(&self) -> &[bool] {
        &self.pattern
    }

    /// Row and column of node i of component c, in the order of the model.
    #[inline(always)]
    pub fn slot(&self, i: usize, c: usize) -> usize {
        self.rank[c] * self.nodes + i
    }
}

/// Position of each component in the order of elimination.
fn ranks(pattern: &[bool], n: usize) -> Vec<usize> {
    let mut coupled = pattern.to_vec();
    let mut rank = vec![usize::MAX; n];
    for place in 0..n {
        let rest: Vec<usize> = (0..n).filter(|c| rank[*c] == usize::MAX).collect();
        let cost = |c: &usize| {
            let own = usize::from(coupled[c * n + c]);
            let others = || rest.iter().filter(|d| *d != c);
            let rows = others().filter(|d| coupled[*d * n + c]).count();
            let columns = others().filter(|d| coupled[c * n + *d]).count();
            // The additional column stands for the right-hand sides.
            (rows + own) * (columns + own + 1)
        };
        let Some(next) = rest.iter().copied().min_by_key(cost) else { break };
        rank[next] = place;
        for i in rest.iter().copied().filter(|i| *i != next && coupled[i * n + next]).collect::<Vec<_>>() {
            for j in rest.iter().filter(|j| **j != next) {
                coupled[i * n + j] |= coupled[next * n + j];
            }
        }
    }
    rank
}

/// Indices that are set, with consecutive ones combined.
fn ranges(set: &[bool]) -> Vec<Range<usize>> {
    let mut out: Vec<Range<usize>> = Vec::new();
    for k in (0..set.len()).filter(|k| set[*k]) {
        match out.last_mut() {
            Some(last) if last.end == k => last.end += 1,
            _ => out.push(k..k + 1),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(n: usize) -> Vec<bool> {
        (0..n * n).map(|k| k % (n + 1) == 0).collect()
    }

    fn indices(ranges: &[Range<usize>]) -> Vec<usize> {
        ranges.iter().cloned().flatten().collect()
    }

    #[test]
    fn positions_are_eliminated_before_their_velocities() {
        // Velocities come first: both accelerations depend on everything, u' = w, v' = z.
        let pattern = [1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 1, 0, 0].map(|x| x == 1);
        let shape = Shape::new(&pattern, &unit(4), 2, 6);
        assert_eq!((0..4).map(|c| shape.slot(1, c)).collect::<Vec<_>>(), [5, 7, 1, 3]);
        // A position is eliminated from the accelerations, along with its velocity, its left end and the scalars.
        let position = &shape.steps[1];
        assert!(!position.own);
        assert_eq!((&position.below[..], &position.left[..], &position.right[..]), (&[2, 3][..], &[][..], &[3][..]));
        assert_eq!(indices(&position.carried), [3, 4, 5]);
        let velocity = &shape.steps[2];
        assert!(velocity.own);
        assert_eq!(velocity.left, [0, 1]);
        assert_eq!(indices(&velocity.carried), [0, 2, 3, 4, 5]);
        assert_eq!(indices(&velocity.solved), [0, 1, 2, 3, 4, 5]);
    }

    #[test]
    fn components_without_coupling_leave_nothing_to_eliminate() {
        let shape = Shape::new(&unit(2), &unit(2), 2, 3);
        assert!(shape.steps.iter().all(|step| step.own && step.below.is_empty() && step.right.is_empty()));
        assert_eq!(indices(&shape.steps[1].solved), [1, 2]);
    }
}
