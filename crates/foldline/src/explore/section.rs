//! Plane sections that are computed where the fate changes.
//!
//! **Idea.** The cells of a section are covered by blocks that share their edges. The fates at the corners and in the middle of
//! each are computed. A block in which all known fates agree, those of smaller neighbours on its edges included, is filled; any
//! other one is divided into four. Boundaries are thus followed to single cells. At the end some of the filled cells, drawn
//! at random, are computed too: how many of them are wrong is the error rate of the filled ones. Blocks with a wrong cell are
//! divided further.
//!
//! **Fails when** a part of a basin lies within a block and touches neither its corners nor its middle: it is
//! found only if a checked cell lies in it.

use super::System;
use super::basins::{Basins, Filled, Plane};
use super::rounds::Rounds;
use super::seeds::sampling;
use crate::attractors::{Fate, SplitMix64};
use std::collections::BTreeSet;

/// Number of filled cells that are checked: if none of them is wrong, at most 1 % of all are, at a confidence of 95 %
/// (Wilson's interval: z²/(N + z²) = 0.01 with z = 1.96).
const CHECKED: usize = 381;

/// A block: first and last column, first and last row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Block {
    columns: [usize; 2],
    rows: [usize; 2],
}

impl Block {
    fn corners(&self) -> [[usize; 2]; 4] {
        let ([a, b], [c, d]) = (self.columns, self.rows);
        [[a, c], [b, c], [a, d], [b, d]]
    }

    fn middle(&self) -> [usize; 2] {
        [self.columns, self.rows].map(|[a, b]| a.midpoint(b))
    }

    /// True if it consists of its corners.
    fn is_least(&self) -> bool {
        [self.columns, self.rows].iter().all(|[a, b]| b - a <= 1)
    }

    /// Returns the parts into which the block is divided at its middle.
    fn parts(&self) -> Vec<Block> {
        let halves = |[a, b]: [usize; 2]| {
            let middle = a.midpoint(b);
            if b - a <= 1 { vec![[a, b]] } else { vec![[a, middle], [middle, b]] }
        };
        let rows = halves(self.rows);
        halves(self.columns)
            .into_iter()
            .flat_map(|columns| rows.iter().map(move |rows| Block { columns, rows: *rows }))
            .collect()
    }

    /// Cells whose fates are needed.
    fn needed(&self) -> impl Iterator<Item = [usize; 2]> {
        let middle = if self.is_least() { None } else { Some(self.middle()) };
        self.corners().into_iter().chain(middle)
    }

    fn cells(self) -> impl Iterator<Item = [usize; 2]> {
        let [a, b] = self.columns;
        (self.rows[0]..=self.rows[1]).flat_map(move |row| (a..=b).map(move |column| [column, row]))
    }
}

/// Blocks of at most `size` steps that cover a section.
fn cover(cells: [usize; 2], size: usize) -> Vec<Block> {
    let along = |count: usize| -> Vec<[usize; 2]> {
        if count == 1 {
            return vec![[0, 0]];
        }
        (0..count - 1).step_by(size.max(1)).map(|first| [first, (first + size.max(1)).min(count - 1)]).collect()
    };
    let rows = along(cells[1]);
    along(cells[0])
        .into_iter()
        .flat_map(|columns| rows.iter().map(move |rows| Block { columns, rows: *rows }))
        .collect()
}

/// Fates of a section, as far as they are known.
struct Section<'p> {
    plane: &'p Plane,
    fates: Vec<Option<Fate>>,
    computed: usize,
}

impl Section<'_> {
    fn index(&self, [column, row]: [usize; 2]) -> usize {
        row * self.plane.cells[0] + column
    }

    /// States at the centres of cells.
    fn states(&self, cells: &[[usize; 2]]) -> Vec<f64> {
        cells.iter().flat_map(|[column, row]| self.plane.state(*column, *row)).collect()
    }

    fn missing(&self, cells: impl Iterator<Item = [usize; 2]>) -> Vec<[usize; 2]> {
        let distinct: BTreeSet<[usize; 2]> = cells.filter(|cell| self.fates[self.index(*cell)].is_none()).collect();
        distinct.into_iter().collect()
    }

    fn record(&mut self, cells: &[[usize; 2]], fates: &[Fate]) {
        for (cell, fate) in cells.iter().zip(fates) {
            let index = self.index(*cell);
            self.fates[index] = Some(*fate);
        }
        self.computed += cells.len();
    }

    /// The fate of a block whose known fates agree.
    fn common(&self, block: &Block) -> Option<Fate> {
        let mut known = block.cells().filter_map(|cell| self.fates[self.index(cell)]);
        let first = known.next()?;
        known.all(|fate| fate == first).then_some(first)
    }
}

/// Follows states drawn from the box, and the cells of a plane where the fate changes, to their attractors; see
/// [`super::basins::basins`]. `size` is the number of cells along the edges of the first blocks.
pub fn adaptive(
    system: &System,
    parameters: &[f64],
    plane: &Plane,
    (samples, seed): (usize, u64),
    (jobs, tolerance): (usize, f64),
    size: usize,
) -> Basins {
    let drawn = sampling(system, samples, seed, jobs, tolerance).uniform_starts();
    let mut rounds = Rounds::new(system, parameters, jobs, tolerance);
    let total = plane.cells[0] * plane.cells[1];
    let mut section = Section { plane, fates: vec![None; total], computed: 0 };
    let mut blocks = cover(plane.cells, size);
    let wanted = section.missing(blocks.iter().flat_map(|block| block.needed()));
    let mut fates = rounds.fates(&[&drawn[..], &section.states(&wanted)].concat());
    let of_plane = fates.split_off(samples.min(fates.len()));
    section.record(&wanted, &of_plane);
    let mut checked: Option<[usize; 2]> = None;
    while !system.field.ended() {
        let (mut kept, mut divided) = (Vec::new(), Vec::new());
        for block in blocks {
            match section.common(&block) {
                _ if block.is_least() => {}
                Some(_) => kept.push(block),
                None => divided.extend(block.parts()),
            }
        }
        if !divided.is_empty() {
            let wanted = section.missing(divided.iter().flat_map(|block| block.needed()));
            let fates = rounds.fates(&section.states(&wanted));
            section.record(&wanted, &fates);
            blocks = [kept, divided].concat();
            continue;
        }
        blocks = kept;
        if checked.is_some() {
            break;
        }
        let [all, wrong] = check(&mut section, &blocks, &mut rounds, seed);
        checked = Some([all, wrong]);
        if wrong == 0 {
            break;
        }
    }
    let known: Vec<bool> = section.fates.iter().map(Option::is_some).collect();
    for block in &blocks {
        let Some(own) = section.common(block) else { continue };
        for cell in block.cells() {
            let index = section.index(cell);
            section.fates[index].get_or_insert(own);
        }
    }
    let plane_fates = section.fates.iter().map(|fate| fate.unwrap_or(Fate::Left)).collect();
    let [checked, wrong] = checked.unwrap_or_default();
    let filled = Filled { computed: section.computed, known, checked, wrong };
    Basins {
        attractors: rounds.attractors,
        box_fates: fates,
        plane_fates,
        early: None,
        samples: drawn,
        filled: Some(filled),
    }
    .sorted()
}

/// Computes some of the cells that would be filled. Returns their number, and how many have another fate.
fn check(section: &mut Section, blocks: &[Block], rounds: &mut Rounds, seed: u64) -> [usize; 2] {
    let mut unknown: Vec<([usize; 2], Fate)> = Vec::new();
    for block in blocks {
        let Some(own) = section.common(block) else { continue };
        unknown
            .extend(block.cells().filter(|cell| section.fates[section.index(*cell)].is_none()).map(|cell| (cell, own)));
    }
    // Cells on a common edge belong to two blocks.
    unknown.sort_by_key(|(cell, _)| *cell);
    unknown.dedup_by_key(|(cell, _)| *cell);
    let mut random = SplitMix64(seed);
    let count = CHECKED.min(unknown.len());
    for k in 0..count {
        let other = k + (random.next() % (unknown.len() - k) as u64) as usize;
        unknown.swap(k, other);
    }
    unknown.truncate(count);
    let cells: Vec<[usize; 2]> = unknown.iter().map(|(cell, _)| *cell).collect();
    let fates = rounds.fates(&section.states(&cells));
    section.record(&cells, &fates);
    let wrong = unknown.iter().zip(&fates).filter(|((_, expected), fate)| expected != *fate).count();
    [count, wrong]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_cover_every_cell_and_divide_to_single_steps() {
        for (cells, size) in [([17, 9], 8), ([20, 13], 8), ([1, 5], 4), ([2, 2], 16)] {
            let mut blocks = cover(cells, size);
            let covered: BTreeSet<[usize; 2]> = blocks.iter().flat_map(|block| block.cells()).collect();
            assert_eq!(covered.len(), cells[0] * cells[1]);
            for _ in 0..5 {
                blocks = blocks.iter().flat_map(|block| block.parts()).collect();
            }
            assert!(blocks.iter().all(Block::is_least));
            let corners: BTreeSet<[usize; 2]> = blocks.iter().flat_map(|block| block.corners()).collect();
            assert_eq!(corners, covered);
        }
    }
}
