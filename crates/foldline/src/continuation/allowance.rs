//! How much work a side may take.
//!
//! **Idea.** Factorisations on a mesh are counted against an allowance that every accepted point renews in part. A place that is hard to pass may
//! use up what easy points have left; a branch on which every point is hard ends. So the work of a side is bounded by the allowance and
//! its number of points, whatever happens on it.
//!
//! Next to this, changes of stability without explanation at one point after the other end a side as well: where multipliers lie on
//! the unit circle for all solutions, rounding changes their count, and nothing that is found there means anything.

use crate::diagram::{Ending, Mesh};

/// Factorisations that one point may take when nothing was used before. From the longest step, 0.2, to the shortest, 1e-9, lead 28
/// halvings. A step that fails late takes 8 Newton iterations and then some 30 for its mesh; that makes about 1100. Special points take 60
/// to 200 each, and up to 14 cuts each to tell them apart: 14 · 200 more. This is twice the sum, rounded up. The hardest point of a completed
/// branch among the problems of others had taken some 4800.
pub(super) const ALLOWANCE: usize = 10_000;
/// What an accepted point renews of it: as much as a special point on its step takes. A point without one takes 5 to 7.
const RENEWED: usize = 200;
/// Accepted steps in a row, each with a change of stability that nothing explains, until the side ends.
const IN_A_ROW: usize = 10;

/// Intervals of a mesh up to which a factorisation counts once; it takes time in proportion to them, and most cycles need fewer.
const INTERVALS: usize = 1000;

/// Factorisations on a mesh by their size. Without a mesh they cost next to nothing.
pub(super) fn work(factorisations: usize, mesh: &Mesh) -> usize {
    factorisations * mesh.len().div_ceil(INTERVALS)
}

/// What is left of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Allowance {
    left: usize,
    unexplained: usize,
}

impl Allowance {
    pub(super) fn new() -> Allowance {
        Allowance { left: ALLOWANCE, unexplained: 0 }
    }

    /// True if a point that is still to be found has used it up.
    pub(super) fn is_used_up(&self, work: usize) -> bool {
        work > self.left
    }

    /// Takes note of an accepted step up to `at`, which ends the side if it says why. `unexplained` says that stability changes on
    /// it without explanation.
    pub(super) fn accepted(&mut self, unexplained: bool, work: usize, at: f64) -> Option<Ending> {
        self.unexplained = if unexplained { self.unexplained + 1 } else { 0 };
        if self.unexplained >= IN_A_ROW {
            return Some(Ending::GivenUp(format!(
                "up to {at}, stability changes at {IN_A_ROW} points in a row without a special point that explains it\nlikely cause: \
                 multipliers that lie on the unit circle along the whole branch, as in a system with a conserved quantity\nwhat to do: \
                 read the branch without its stability, or add what breaks the conservation"
            )));
        }
        if self.is_used_up(work) {
            return Some(self.ending(at, work, "the point was found at last"));
        }
        self.left = (self.left - work + RENEWED).min(ALLOWANCE);
        None
    }

    /// How a side ends that has used it up, next to `at`.
    pub(super) fn ending(&self, at: f64, work: usize, last: &str) -> Ending {
        let before = ALLOWANCE - self.left;
        let also = if before > 0 { format!(", and those before it {before} more than usual") } else { String::new() };
        Ending::GivenUp(format!(
            "next to {at}, a point took the work of {work} factorisations{also}; {last}\nlikely cause: a place to which ever shorter steps or \
             finer meshes lead, such as a homoclinic orbit, a canard or a cluster of special points\nwhat to do: end the range or `stop` \
             before it; a larger tolerance passes it in longer steps"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hard_point_may_use_up_what_easy_ones_renew() {
        let mut own = Allowance::new();
        assert!(!own.is_used_up(ALLOWANCE) && own.is_used_up(ALLOWANCE + 1));
        own.left -= ALLOWANCE - 1000;
        assert!(own.is_used_up(1001) && !own.is_used_up(1000));
        let Ending::GivenUp(text) = own.ending(1.5, 1001, "it failed") else { panic!() };
        assert!(text.starts_with(
            "next to 1.5, a point took the work of 1001 factorisations, and those before it 9000 more than usual; it failed"
        ));
    }

    #[test]
    fn changes_without_explanation_end_a_side_only_one_after_the_other() {
        let mut own = Allowance::new();
        for _ in 0..5 {
            assert!((1..IN_A_ROW).all(|_| own.accepted(true, 5, 0.5).is_none()));
            assert!(own.accepted(false, 5, 0.5).is_none(), "an explained step in between");
        }
        assert!((1..IN_A_ROW).all(|_| own.accepted(true, 5, 0.5).is_none()));
        assert!(matches!(own.accepted(true, 5, 0.5), Some(Ending::GivenUp(_))));
    }

    #[test]
    fn the_work_of_a_side_is_bounded_by_its_points() {
        let mut own = Allowance::new();
        let points = (0..1000).take_while(|_| own.accepted(false, 2 * RENEWED, 0.5).is_none()).count();
        assert!((40..60).contains(&points), "{points} points at twice what is renewed");
        let mut own = Allowance::new();
        assert!(
            (0..100_000).all(|_| own.accepted(false, RENEWED, 0.5).is_none()),
            "as much as is renewed goes on for ever"
        );
    }

    #[test]
    fn large_meshes_count_more_and_none_counts_nothing() {
        let mesh =
            |intervals: usize| Mesh::from((0..=intervals).map(|k| k as f64 / intervals as f64).collect::<Vec<f64>>());
        assert_eq!((work(7, &mesh(200)), work(7, &mesh(6900))), (7, 49));
        assert_eq!(work(7, &Mesh::from(Vec::new())), 0);
    }
}
