//! Limit on the work of one side of a branch.
//!
//! **Idea.** Factorisations on a mesh are charged to an allowance, and every accepted point restores part of it. A few
//! hard points may use work that easy points saved; a branch on which every point is hard ends. The work of a side is
//! therefore bounded by the allowance and the number of points.
//!
//! A side also ends after several consecutive points with unexplained changes of stability. If multipliers lie on the
//! unit circle along the whole branch, rounding changes the number of unstable ones, and special points found there are
//! meaningless.

use crate::diagram::{Ending, Mesh, Shown};

/// Factorisations available to one point if none were used before. It takes 28 halvings to get from the longest step,
/// 0.2, to the shortest, 1e-9. A step that fails late takes 8 Newton iterations and then some 30 factorisations for its
/// mesh: about 1100 in all. Special points take 60 to 200 each, and up to 14 cuts of the step to separate them:
/// 14 · 200 more. The limit is twice the sum, rounded up. The hardest point of a completed branch in
/// `cargo xtask outside` took some 4800.
pub(super) const ALLOWANCE: usize = 10_000;
/// Factorisations that an accepted point restores: the cost of one special point on its step. A point without one costs
/// 5 to 7.
const RENEWED: usize = 200;
/// Consecutive accepted steps with an unexplained change of stability after which the side ends. A safety factor:
/// isolated unexplained changes must not end a branch.
const IN_A_ROW: usize = 10;

/// Intervals per unit of work: a factorisation on a mesh of up to this size counts once, and its cost grows in
/// proportion to the mesh. Most cycles need fewer intervals.
const INTERVALS: usize = 1000;

/// Work of a number of factorisations on a mesh. Equilibria have no mesh, and their factorisations are not counted.
pub(super) fn work(factorisations: usize, mesh: &Mesh) -> usize {
    factorisations * mesh.len().div_ceil(INTERVALS)
}

/// Remaining work of a side, and its consecutive unexplained changes of stability.
#[derive(Clone, Copy, Debug)]
pub(super) struct Allowance {
    left: usize,
    unexplained: usize,
}

impl Allowance {
    pub(super) fn new() -> Allowance {
        Allowance { left: ALLOWANCE, unexplained: 0 }
    }

    /// True if the work spent on the point in progress exceeds the allowance.
    pub(super) fn is_used_up(&self, work: usize) -> bool {
        work > self.left
    }

    /// Records an accepted step to the parameter value `at`; returns the reason if the side ends there. `unexplained`
    /// is true if stability changes on the step without explanation.
    pub(super) fn accepted(&mut self, unexplained: bool, work: usize, at: f64) -> Option<Ending> {
        self.unexplained = if unexplained { self.unexplained + 1 } else { 0 };
        if self.unexplained >= IN_A_ROW {
            return Some(Ending::GivenUp(format!(
                "stability changed at {IN_A_ROW} consecutive points up to {} with no special point to explain \
                 it\nlikely cause: multipliers on the unit circle along the whole branch, as in a conservative \
                 system\nwhat to do: ignore the stability of this branch, or add a term that breaks the conservation \
                 law, such as a small damping",
                Shown(at)
            )));
        }
        if self.is_used_up(work) {
            return Some(self.ending(at, work, "it converged in the end"));
        }
        self.left = (self.left - work + RENEWED).min(ALLOWANCE);
        None
    }

    /// Ending of a side whose allowance is used up near the parameter value `at`.
    pub(super) fn ending(&self, at: f64, work: usize, last: &str) -> Ending {
        let before = ALLOWANCE - self.left;
        let also = if before > 0 {
            format!(", and the points before it took {before} more than usual")
        } else {
            String::new()
        };
        Ending::GivenUp(format!(
            "near {}, one point took the work of {work} factorisations{also}; {last}\nlikely cause: ever shorter \
             steps or finer meshes are needed here, as near a homoclinic orbit, a canard or a cluster of special \
             points\nwhat to do: end the range before this point, or set a `stop` there; with a larger tolerance, \
             longer steps may pass it",
            Shown(at)
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hard_point_may_use_what_easy_points_left_over() {
        let mut own = Allowance::new();
        assert!(!own.is_used_up(ALLOWANCE) && own.is_used_up(ALLOWANCE + 1));
        own.left -= ALLOWANCE - 1000;
        assert!(own.is_used_up(1001) && !own.is_used_up(1000));
        let Ending::GivenUp(text) = own.ending(1.5, 1001, "it failed") else { panic!() };
        assert!(text.starts_with(
            "near 1.5, one point took the work of 1001 factorisations, and the points before it took 9000 more than usual; it failed"
        ));
    }

    #[test]
    fn only_consecutive_unexplained_changes_end_a_side() {
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
    fn work_grows_with_the_mesh_and_is_zero_without_one() {
        let mesh =
            |intervals: usize| Mesh::from((0..=intervals).map(|k| k as f64 / intervals as f64).collect::<Vec<f64>>());
        assert_eq!((work(7, &mesh(200)), work(7, &mesh(6900))), (7, 49));
        assert_eq!(work(7, &Mesh::from(Vec::new())), 0);
    }
}
