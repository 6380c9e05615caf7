//! Cells of a map over parameters, and their refinement.
//!
//! **Idea.** A refined map is a grid of boxes with a cell at each corner. A box is halved along every dimension if two
//! cells on its edges differ in their category, those of smaller neighbours included, until all that differ are one
//! step of the fine grid apart.
//!
//! **Fails when** a region lies within one box of the first grid, so that no cell falls into it.

use super::super::plan::{MapPlan, Over};
use crate::diagram::{CellAnswer, MapCell};
use std::collections::{BTreeSet, HashMap};

/// Category of cells without an answer.
const FAILED: &str = "failed";

/// Largest number of cells of a fine grid: each is a place in memory, and a pixel of a picture with 2000 × 2000.
pub const LARGEST: usize = 4_000_000;

/// A map with the cells that are known.
#[derive(Clone, Debug)]
pub struct ParameterMap {
    /// Values of every parameter on the fine grid; `None` for a list of cases.
    pub axes: Option<Vec<Vec<f64>>>,
    /// Cells, the last parameter varying fastest; those of a list in its order.
    pub cells: Vec<ShownCell>,
    /// False if cells are missing that the map needs.
    pub complete: bool,
}

/// A cell of a map.
#[derive(Clone, Debug)]
pub struct ShownCell {
    /// `[q]` values of the parameters.
    pub at: Vec<f64>,
    /// The answer, or the reason why there is none; `None` if the cell was not computed.
    pub answer: Option<Result<CellAnswer, String>>,
    /// Category: in a refined map, that of the cells around it if it was not computed.
    pub category: Option<String>,
}

impl ParameterMap {
    /// Number of cells that were computed.
    pub fn computed(&self) -> usize {
        self.cells.iter().filter(|cell| cell.answer.is_some()).count()
    }

    /// Reasons why cells have no answer, and remarks on what fell short in others, each with the number of such cells;
    /// the most frequent first.
    pub fn complaints(&self) -> [Vec<(String, usize)>; 2] {
        let answers = || self.cells.iter().filter_map(|cell| cell.answer.as_ref());
        let counted = |all: &mut dyn Iterator<Item = &String>| {
            let mut found: Vec<(String, usize)> = Vec::new();
            for text in all {
                match found.iter_mut().find(|(known, _)| known == text) {
                    Some((_, count)) => *count += 1,
                    None => found.push((text.clone(), 1)),
                }
            }
            found.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
            found
        };
        let failures = counted(&mut answers().filter_map(|answer| answer.as_ref().err()));
        let remarks = answers().filter_map(|answer| answer.as_ref().ok().map(|own| &own.remark));
        [failures, counted(&mut remarks.filter(|remark| !remark.is_empty()))]
    }
}

/// Index of a cell on the fine grid.
type Index = Vec<usize>;

/// Fine grid and its boxes.
struct Grid {
    axes: Vec<Vec<f64>>,
    /// Lowest corner and size of each box.
    boxes: Vec<(Index, usize)>,
}

impl Grid {
    fn new(axes: &[Vec<f64>], depth: usize) -> Grid {
        let factor = 1 << depth;
        let fine: Vec<Vec<f64>> = axes.iter().map(|own| finer(own, factor)).collect();
        let corners: Vec<Vec<usize>> =
            axes.iter().map(|own| (0..own.len() - 1).map(|k| k * factor).collect()).collect();
        let boxes = if depth == 0 { Vec::new() } else { product(&corners).into_iter().map(|c| (c, factor)).collect() };
        Grid { axes: fine, boxes }
    }

    fn at(&self, index: &[usize]) -> Vec<f64> {
        self.axes.iter().zip(index).map(|(own, k)| own[*k]).collect()
    }

    fn all(&self) -> Vec<Index> {
        product(&self.axes.iter().map(|own| (0..own.len()).collect()).collect::<Vec<_>>())
    }

    fn first(&self, factor: usize) -> Vec<Index> {
        product(&self.axes.iter().map(|own| (0..own.len()).step_by(factor).collect()).collect::<Vec<_>>())
    }

    /// Halves the boxes with different categories on their edges. Returns the corners of the new ones; `None` if no box
    /// is to be halved.
    fn split(&mut self, categories: &HashMap<Index, String>) -> Option<Vec<Index>> {
        let (mut kept, mut wanted, before) = (Vec::new(), BTreeSet::new(), self.boxes.len());
        for (corner, size) in std::mem::take(&mut self.boxes) {
            let differs = size > 1 && {
                let mut seen = edge(&corner, size).into_iter().filter_map(|index| categories.get(&index));
                let first = seen.next();
                seen.any(|other| Some(other) != first)
            };
            if !differs {
                kept.push((corner, size));
                continue;
            }
            let half = size / 2;
            let moved = |steps: &[usize]| corner.iter().zip(steps).map(|(c, s)| c + half * s).collect::<Index>();
            let choices = |most: usize| product(&vec![(0..=most).collect(); corner.len()]);
            kept.extend(choices(1).iter().map(|steps| (moved(steps), half)));
            wanted.extend(choices(2).iter().map(|steps| moved(steps)));
        }
        self.boxes = kept;
        (self.boxes.len() != before).then(|| wanted.into_iter().collect())
    }
}

/// Returns an axis with `factor` times as many steps.
fn finer(own: &[f64], factor: usize) -> Vec<f64> {
    let share = |j: usize| j as f64 / factor as f64;
    let inner = own.windows(2).flat_map(|pair| (0..factor).map(move |j| pair[0] + (pair[1] - pair[0]) * share(j)));
    inner.chain(own.last().copied()).collect()
}

/// Returns all combinations of one element of each list, the last varying fastest.
fn product(lists: &[Vec<usize>]) -> Vec<Index> {
    lists.iter().fold(vec![Vec::new()], |found, list| {
        found.iter().flat_map(|head| list.iter().map(|k| [&head[..], &[*k]].concat())).collect()
    })
}

/// Indices on the edges of a box over two parameters, or the ends of one over one parameter.
fn edge(corner: &[usize], size: usize) -> Vec<Index> {
    match corner {
        [i] => vec![vec![*i], vec![i + size]],
        [i, j] => (0..=size)
            .flat_map(|k| [vec![i + k, *j], vec![i + k, j + size], vec![*i, j + k], vec![i + size, j + k]])
            .collect(),
        _ => Vec::new(),
    }
}

/// Values of parameters as a key: equal if they agree to the bit.
fn key(at: &[f64]) -> Vec<u64> {
    at.iter().map(|value| value.to_bits()).collect()
}

/// Visits the cells of a map. `compute` receives the cells that are needed and not yet known, and returns those that it
/// computed; if one is missing, the visit ends.
pub(super) fn visit(
    plan: &MapPlan,
    known: &[MapCell],
    compute: &mut dyn FnMut(Vec<Vec<f64>>) -> Vec<MapCell>,
) -> ParameterMap {
    let own = known.iter().filter(|cell| cell.map == plan.name);
    let mut answers: HashMap<Vec<u64>, Result<CellAnswer, String>> =
        own.map(|cell| (key(&cell.at), cell.answer.clone())).collect();
    let mut obtain = |wanted: &[Vec<f64>], answers: &mut HashMap<Vec<u64>, Result<CellAnswer, String>>| {
        let missing: Vec<Vec<f64>> = wanted.iter().filter(|at| !answers.contains_key(&key(at))).cloned().collect();
        if !missing.is_empty() {
            answers.extend(compute(missing).into_iter().map(|cell| (key(&cell.at), cell.answer)));
        }
        wanted.iter().all(|at| answers.contains_key(&key(at)))
    };
    let category = |answer: &Result<CellAnswer, String>| match answer {
        Ok(own) => own.category().map_or(String::new(), |(_, text)| text.to_string()),
        Err(_) => FAILED.to_string(),
    };
    let shown = |at: Vec<f64>, between: Option<String>, answers: &HashMap<Vec<u64>, Result<CellAnswer, String>>| {
        let answer = answers.get(&key(&at)).cloned();
        let category = answer.as_ref().map(category).or(between);
        ShownCell { at, answer, category }
    };
    match &plan.over {
        Over::Cases(cases) => {
            let complete = obtain(cases, &mut answers);
            let cells = cases.iter().map(|at| shown(at.clone(), None, &answers)).collect();
            ParameterMap { axes: None, cells, complete }
        }
        Over::Grid(axes) => {
            let mut grid = Grid::new(axes, plan.refine);
            let mut categories: HashMap<Index, String> = HashMap::new();
            let mut wanted = grid.first(1 << plan.refine);
            let complete = loop {
                let at: Vec<Vec<f64>> = wanted.iter().map(|index| grid.at(index)).collect();
                if !obtain(&at, &mut answers) {
                    break false;
                }
                for (index, at) in wanted.iter().zip(&at) {
                    categories.entry(index.clone()).or_insert_with(|| category(&answers[&key(at)]));
                }
                match grid.split(&categories) {
                    Some(next) => wanted = next,
                    None => break true,
                }
            };
            let mut between: HashMap<Index, String> = HashMap::new();
            if complete {
                for (corner, size) in grid.boxes.iter().filter(|(_, size)| *size > 1) {
                    let inside: Vec<Vec<usize>> = corner.iter().map(|c| (*c..=c + size).collect()).collect();
                    let own = &categories[corner];
                    product(&inside).into_iter().for_each(|index| _ = between.entry(index).or_insert(own.clone()));
                }
            }
            let all = grid.all().into_iter();
            let cells = all.map(|index| shown(grid.at(&index), between.get(&index).cloned(), &answers)).collect();
            ParameterMap { axes: Some(grid.axes), cells, complete }
        }
    }
}

/// Returns a map with the cells that are known.
pub fn assembled(plan: &MapPlan, known: &[MapCell]) -> ParameterMap {
    visit(plan, known, &mut |_| Vec::new())
}

#[cfg(test)]
mod tests {
    use super::super::super::plan::{Drawn, Question};
    use super::*;
    use crate::diagram::CellValue;

    fn plan(axes: Vec<Vec<f64>>, refine: usize) -> MapPlan {
        MapPlan {
            name: "m".into(),
            names: vec!["a".into(), "b".into()],
            indices: vec![0, 1],
            base: vec![0.0, 0.0],
            over: Over::Grid(axes),
            refine,
            question: Question::Motions(Drawn { samples: 1, random: 1 }),
            most: usize::MAX,
        }
    }

    fn answer(text: &str) -> CellAnswer {
        CellAnswer { values: vec![("motions".into(), CellValue::Text(text.into()))], ..CellAnswer::default() }
    }

    #[test]
    fn a_refined_map_of_a_disc_is_right_everywhere_and_computes_cells_near_the_circle_only() {
        let axis: Vec<f64> = (0..9).map(|k| -2.0 + 0.5 * f64::from(k)).collect();
        let inside = |at: &[f64]| if at[0] * at[0] + at[1] * at[1] < 2.0 { "in" } else { "out" };
        let own = plan(vec![axis.clone(), axis], 3);
        let mut asked = 0;
        let found = visit(&own, &[], &mut |cells| {
            asked += cells.len();
            cells.into_iter().map(|at| MapCell { map: "m".into(), answer: Ok(answer(inside(&at))), at }).collect()
        });
        assert!(found.complete && found.cells.len() == 65 * 65 && found.computed() == asked);
        // The circle crosses some 2 × 4 × 1.41 / 0.0625 = 181 lines of the fine grid; a box of each size on the way has at most
        // eight new cells.
        assert!(asked < 65 * 65 / 3, "{asked}");
        assert!(found.cells.iter().all(|cell| cell.category.as_deref() == Some(inside(&cell.at))));
    }

    #[test]
    fn an_unfinished_map_says_so_and_keeps_its_cells() {
        let own = plan(vec![vec![0.0, 1.0], vec![0.0, 2.0]], 0);
        let known = [MapCell { map: "m".into(), at: vec![0.0, 2.0], answer: Ok(answer("in")) }];
        let found = assembled(&own, &known);
        assert!(!found.complete && found.computed() == 1 && found.cells[1].answer.is_some());
    }

    #[test]
    fn no_cell_is_computed_twice() {
        let own = plan(vec![vec![0.0, 1.0, 2.0], vec![0.0, 2.0, 3.0]], 2);
        let mut seen = Vec::new();
        let side = |at: &[f64]| if at[0] + at[1] < 1.3 { "a" } else { "b" };
        let mut compute = |cells: Vec<Vec<f64>>| -> Vec<MapCell> {
            seen.extend(cells.iter().map(|at| key(at)));
            cells.into_iter().map(|at| MapCell { map: "m".into(), answer: Ok(answer(side(&at))), at }).collect()
        };
        let first = visit(&own, &[], &mut compute);
        let computed = first
            .cells
            .iter()
            .filter_map(|cell| Some(MapCell { map: "m".into(), at: cell.at.clone(), answer: cell.answer.clone()? }));
        let computed: Vec<MapCell> = computed.collect();
        let distinct: std::collections::HashSet<_> = seen.iter().cloned().collect();
        assert_eq!((seen.len(), distinct.len()), (computed.len(), computed.len()));
        let again = visit(&own, &computed, &mut |cells| panic!("computed again: {cells:?}"));
        assert!(again.complete && again.computed() == first.computed());
    }
}
