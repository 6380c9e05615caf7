//! A chain whose ends stay free, to be joined with other chains.
//!
//! **Idea.** The elimination of a chain leaves one relation between its ends and the scalars. Chains that are joined by
//! conditions of any kind, such as the trajectories of a torus, are eliminated one by one; these relations, the
//! conditions and the sum of the border rows then form one system for the ends.
//!
//! **Equations.** F x_0 + E x_N + g σ = h and P x_0 + Q x_N + D σ = s, as in [`super::ends`].
//!
//! **Source.** ascher1995, §7.

use super::chain::Chain;
use super::lu;
use crate::contract::Singular;

/// Relation and border rows of an eliminated chain, in the units of the states.
#[derive(Clone, Debug, Default)]
pub struct Remainder {
    /// F, `[n × n]`.
    pub left: Vec<f64>,
    /// E, `[n × n]`.
    pub right: Vec<f64>,
    /// g, `[n × q]`.
    pub scalars: Vec<f64>,
    /// P, `[q × n]`.
    pub first: Vec<f64>,
    /// Q, `[q × n]`.
    pub last: Vec<f64>,
    /// D, `[q × q]`.
    pub corner: Vec<f64>,
}

impl Remainder {
    /// Takes the relation and border of an eliminated chain whose states are in `units` `[n]`.
    pub(super) fn take(&mut self, chain: &Chain<f64>, corner: Vec<f64>, units: &[f64], [n, q]: [usize; 2]) {
        let rows = |first: usize| -> Vec<f64> {
            let lines = chain.relation.chunks_exact(3 * n + q);
            lines.flat_map(|line| (0..n).map(move |c| line[first + c] / units[c])).collect()
        };
        let border = |rows: &[f64]| -> Vec<f64> { rows.iter().enumerate().map(|(k, x)| x / units[k % n]).collect() };
        (self.left, self.right) = (rows(2 * n), rows(n));
        self.scalars = chain.relation.chunks_exact(3 * n + q).flat_map(|line| &line[3 * n..]).copied().collect();
        (self.first, self.last, self.corner) = (border(&chain.first), border(&chain.last), corner);
    }

    /// The transition matrix from the left to the right end, `[n × n]`: -E⁻¹ F.
    ///
    /// # Errors
    /// [`Singular`] if E is.
    pub fn transition(&self) -> Result<Vec<f64>, Singular> {
        let n = (self.left.len() as f64).sqrt() as usize;
        let (mut matrix, mut pivots) = (self.right.clone(), vec![0; n]);
        lu::factorise(&mut matrix, n, &mut pivots)?;
        let mut all = vec![0.0; n * n];
        for c in 0..n {
            let mut column: Vec<f64> = (0..n).map(|i| -self.left[i * n + c]).collect();
            lu::solve(&matrix, n, &pivots, &mut column, 1);
            (0..n).for_each(|i| all[i * n + c] = column[i]);
        }
        Ok(all)
    }
}
