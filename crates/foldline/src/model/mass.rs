//! Equations coupled by a mass matrix.
//!
//! **Idea.** M(y) dy/dt = f(y) is solved for dy/dt once, on the graph, by Gaussian elimination with diagonal pivots in
//! the order of the equations; structurally zero entries are skipped. The result is an ordinary vector field with exact
//! derivatives.
//!
//! **Fails when** a pivot becomes zero at some state: the field is not finite there, and the computation reports that.

use super::graph::{Graph, Id};

/// Entry: row, column, node.
pub(super) type Entry = (usize, usize, Id);

/// Replaces `field` by M⁻¹ `field`; rows without entries are those of the identity. Returns the row of a pivot that is
/// identically zero.
pub(super) fn solve(graph: &mut Graph, entries: &[Entry], field: &mut [Id]) -> Result<(), usize> {
    let mut members: Vec<usize> = entries.iter().flat_map(|(row, column, _)| [*row, *column]).collect();
    members.sort_unstable();
    members.dedup();
    let n = members.len();
    let place = |state: usize| members.binary_search(&state).unwrap_or(0);
    let (zero, one) = (graph.constant(0.0), graph.constant(1.0));
    let mut m = vec![zero; n * n];
    for (k, member) in members.iter().enumerate() {
        if entries.iter().all(|(row, ..)| row != member) {
            m[k * n + k] = one;
        }
    }
    for &(row, column, id) in entries {
        m[place(row) * n + place(column)] = id;
    }
    let mut right: Vec<Id> = members.iter().map(|&state| field[state]).collect();
    for p in 0..n {
        let pivot = m[p * n + p];
        if pivot == zero {
            return Err(members[p]);
        }
        for row in p + 1..n {
            if m[row * n + p] == zero {
                continue;
            }
            let factor = graph.divide(m[row * n + p], pivot);
            for column in p + 1..n {
                let product = graph.multiply(factor, m[p * n + column]);
                m[row * n + column] = graph.subtract(m[row * n + column], product);
            }
            let product = graph.multiply(factor, right[p]);
            right[row] = graph.subtract(right[row], product);
        }
    }
    for p in (0..n).rev() {
        for column in p + 1..n {
            let product = graph.multiply(m[p * n + column], right[column]);
            right[p] = graph.subtract(right[p], product);
        }
        right[p] = graph.divide(right[p], m[p * n + p]);
    }
    members.iter().zip(right).for_each(|(state, rate)| field[*state] = rate);
    Ok(())
}
