//! Product of a small matrix and long rows.
//!
//! **Idea.** Values at the nodes of every interval, stored with the intervals as lanes, are converted to values at
//! other points of every interval by the same small matrix. Eight lanes fill one or two vector registers.

/// Number of lanes processed together.
const WIDTH: usize = 8;

/// `out` `[rows × lanes]` = `matrix` `[rows × columns]` · `panel` `[columns × lanes]`, all row-major.
pub fn multiply(matrix: &[f64], panel: &[f64], lanes: usize, out: &mut [f64]) {
    if lanes > 0 {
        pulp::Arch::new().dispatch(Multiply { matrix, panel, lanes, out });
    }
}

struct Multiply<'a, 'b> {
    matrix: &'a [f64],
    panel: &'a [f64],
    lanes: usize,
    out: &'b mut [f64],
}

impl pulp::NullaryFnOnce for Multiply<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        // The usual degree as a constant.
        match self.panel.len() / self.lanes {
            5 => self.multiplied_by::<5>(),
            _ => self.multiplied(),
        }
    }
}

impl Multiply<'_, '_> {
    /// Product for C columns: eight lanes of all of them stay in registers for every row.
    #[inline(always)]
    fn multiplied_by<const C: usize>(self) {
        let Multiply { matrix, panel, lanes, out } = self;
        if lanes < WIDTH {
            return Multiply { matrix, panel, lanes, out }.multiplied();
        }
        for first in (0..lanes).step_by(WIDTH) {
            // The last eight may include lanes that were already processed.
            let first = first.min(lanes - WIDTH);
            let mut columns = [[0.0; WIDTH]; C];
            for k in 0..C {
                columns[k].copy_from_slice(&panel[k * lanes + first..][..WIDTH]);
            }
            for (line, weights) in out.chunks_exact_mut(lanes).zip(matrix.as_chunks::<C>().0) {
                let mut sum = [0.0; WIDTH];
                for k in 0..C {
                    for l in 0..WIDTH {
                        sum[l] += weights[k] * columns[k][l];
                    }
                }
                line[first..first + WIDTH].copy_from_slice(&sum);
            }
        }
    }

    #[inline(always)]
    fn multiplied(self) {
        let Multiply { matrix, panel, lanes, out } = self;
        let columns = panel.len() / lanes;
        for (line, weights) in out.chunks_exact_mut(lanes).zip(matrix.chunks_exact(columns)) {
            let eight = |first: usize| {
                let mut sum = [0.0; WIDTH];
                for (k, w) in weights[..columns].iter().enumerate() {
                    if let Some(values) = panel[k * lanes + first..].first_chunk::<WIDTH>() {
                        (0..WIDTH).for_each(|l| sum[l] += w * values[l]);
                    }
                }
                sum
            };
            let (blocks, rest) = line.as_chunks_mut::<WIDTH>();
            for (b, block) in blocks.iter_mut().enumerate() {
                *block = eight(b * WIDTH);
            }
            if rest.is_empty() {
                continue;
            }
            // The rest is part of the last eight lanes, some of which are already known.
            if let Some(first) = lanes.checked_sub(WIDTH) {
                let own = eight(first);
                rest.copy_from_slice(&own[WIDTH - rest.len()..]);
            } else {
                for (l, value) in rest.iter_mut().enumerate() {
                    *value = weights.iter().zip(panel.chunks_exact(lanes)).map(|(w, row)| w * row[l]).sum();
                }
            }
        }
    }
}

/// Rearranges a profile `[interval][node][component]` to `[component][node][interval]`, with the intervals as lanes.
pub fn by_component(profile: &[f64], nodes: usize, n: usize, out: &mut [f64]) {
    let block = (nodes * n).max(1);
    let count = profile.len() / block;
    // Eight intervals at a time, so that stores are contiguous.
    let (eights, rest) = profile.split_at(profile.len() - profile.len() % (WIDTH * block));
    for (first, eight) in (0..).step_by(WIDTH).zip(eights.chunks_exact(WIDTH * block)) {
        let own: [&[f64]; WIDTH] = std::array::from_fn(|l| &eight[l * block..(l + 1) * block]);
        for k in 0..nodes {
            for i in 0..n {
                let to = &mut out[(i * nodes + k) * count + first..][..WIDTH];
                (0..WIDTH).for_each(|l| to[l] = own[l][k * n + i]);
            }
        }
    }
    for (j, interval) in (eights.len() / block..).zip(rest.chunks_exact(block)) {
        for (k, node) in interval.chunks_exact(n).enumerate() {
            node.iter().enumerate().for_each(|(i, x)| out[(i * nodes + k) * count + j] = *x);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_product_agrees_with_its_definition_for_any_number_of_lanes() {
        let (rows, columns) = (3, 5);
        let matrix: Vec<f64> = (0..rows * columns).map(|k| (k as f64 * 0.7).sin()).collect();
        for lanes in [1, 7, 8, 9, 30] {
            let panel: Vec<f64> = (0..columns * lanes).map(|k| (k as f64 * 1.3).cos()).collect();
            let mut out = vec![f64::NAN; rows * lanes];
            multiply(&matrix, &panel, lanes, &mut out);
            for (at, value) in out.iter().enumerate() {
                let (r, l) = (at / lanes, at % lanes);
                let expected: f64 = (0..columns).map(|k| matrix[r * columns + k] * panel[k * lanes + l]).sum();
                // Bitwise: the sums have the same order.
                assert_eq!(*value, expected, "{lanes} lanes, entry {at}");
            }
        }
        multiply(&matrix, &[], 0, &mut []);
    }

    #[test]
    fn a_profile_is_rearranged_by_component() {
        let (nodes, n) = (2, 3);
        for count in [0, 3, 8, 19] {
            let profile: Vec<f64> = (0..count * nodes * n).map(|k| k as f64).collect();
            let mut by = vec![f64::NAN; profile.len()];
            by_component(&profile, nodes, n, &mut by);
            for at in 0..profile.len() {
                let (j, k, i) = (at / (nodes * n), at / n % nodes, at % n);
                assert_eq!(by[(i * nodes + k) * count + j], profile[at], "{count} intervals, entry {at}");
            }
        }
    }
}
