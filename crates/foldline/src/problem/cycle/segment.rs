//! A segment: one trajectory over the period of a torus, whose ends are joined with those of others.
//!
//! **Idea.** The trajectories of a torus satisfy equations (1) and (2) of [`super`] on a common mesh, with x_N left free.
//! Each is condensed and eliminated like a cycle, which leaves a relation between its ends; [`crate::problem::torus`]
//! joins them.

use super::CycleProblem;
use crate::contract::{Batch, Parameters, Singular};
use crate::diagram::Mesh;
use crate::linalg::apart::Remainder;
use crate::linalg::lane::Eight;
use crate::linalg::system::{System, either};
use crate::problem::Setting;
use crate::problem::defect::Defect;

impl<'a> CycleProblem<'a> {
    /// A segment that lasts `forcing_periods` (0 without forcing), with room for `rows` border rows.
    pub(in crate::problem) fn segment(
        setting: Setting<'a>,
        degree: usize,
        mesh: &Mesh,
        forcing_periods: u32,
        rows: usize,
    ) -> CycleProblem<'a> {
        let mut problem = CycleProblem::new(setting, degree, mesh);
        let q = rows.max(1 + problem.setting.freedom());
        problem.system = System::new(problem.n, &problem.scheme.end, q);
        problem.system.leave_apart();
        problem.forcing_periods = forcing_periods;
        problem.arrange();
        problem
    }

    /// Number of scalars of the eliminated segment: T, the free parameters, and zeros that make room for border rows.
    pub(in crate::problem) fn scalars(&self) -> usize {
        self.system.shape().1
    }

    /// Moves the segment to another mesh.
    pub(in crate::problem) fn move_to(&mut self, mesh: &Mesh) {
        self.mesh = mesh.clone();
        self.arrange();
    }

    /// Evaluates (1) and (2) at `u`, the profile with T and the free parameters, without x_N in the last row of (2).
    pub(in crate::problem) fn segment_residual(&mut self, u: &[f64], r: &mut [f64]) {
        let (size, n) = (self.profile_size(), self.n);
        self.gather(u);
        let all = self.setting.at(&u[size + 1..]);
        let batch = Batch {
            lanes: self.lanes(),
            states: &self.states,
            parameters: Parameters::Shared(&all),
            times: &self.times,
            signs: &[],
        };
        self.setting.field.evaluate(batch, &mut self.f);
        match self.width {
            1 => self.defects::<f64>(u, r),
            _ => self.defects::<Eight>(u, r),
        };
        let last = size - self.block();
        r[last..last + n].iter_mut().zip(&u[..n]).for_each(|(r, x)| *r -= x);
    }

    /// Linearises at `u`, condenses and eliminates. `rows` `[·][profile]` act on the profile through the inner product
    /// of a cycle with the scales `scale` `[n]`. Returns ∫ tr f_x dt.
    ///
    /// # Errors
    /// [`Singular`] if the block of an interval is.
    pub(in crate::problem) fn segment_factorise(
        &mut self,
        u: &[f64],
        rows: &[Vec<f64>],
        scale: &[f64],
    ) -> Result<f64, Singular> {
        self.scale.copy_from_slice(scale);
        self.linearise(u);
        self.condense_all(u)?;
        either!(&mut self.system, s => {
            s.border.fill(Default::default());
            s.corner.fill(0.0);
        });
        rows.iter().enumerate().for_each(|(r, row)| self.fill_row(r, row));
        self.system.eliminate(1.0)?;
        Ok(self.trace)
    }

    /// The relation between the ends that the elimination left.
    pub(in crate::problem) fn remainder(&self) -> Option<&Remainder> {
        self.system.remainder()
    }

    /// Carries the residuals of the profile to the ends: h `[n]`, then s of the border rows.
    pub(in crate::problem) fn segment_forward(&self, rhs: &[f64]) -> Vec<f64> {
        let (n, q) = self.system.shape();
        let mut out = vec![0.0; n + q];
        self.system.forward(&[&rhs[..self.profile_size()], &vec![0.0; q]].concat(), &mut out);
        out
    }

    /// The profile for residuals `rhs` with known x_0, x_N and scalars.
    pub(in crate::problem) fn segment_backward(&self, rhs: &[f64], known: &[f64]) -> Vec<f64> {
        let (size, (_, q)) = (self.profile_size(), self.system.shape());
        let mut out = vec![0.0; size + q];
        self.system.backward(&[&rhs[..size], &vec![0.0; q]].concat(), known, &mut out);
        out.truncate(size);
        out
    }

    /// Defect of the segment, and the right-hand sides for its effect on the torus.
    pub(in crate::problem) fn segment_defect(&self, u: &[f64], scale: &[f64]) -> (Defect, Vec<f64>) {
        let size = self.profile_size();
        let parameters = self.setting.at(&u[size + 1..]);
        let found = self.defect(self.setting.field, &parameters, &u[..size], &self.mesh, u[size], scale);
        let rhs = self.defects_of(&found.ends, &found.sources, size);
        (found, rhs)
    }
}

impl CycleProblem<'_> {
    /// Transition matrices `[N][n × n]` and dependence of inner nodes on the left ends `[m][n × n][N]` along a cycle, with n
    /// and m; `None` if the equations cannot be condensed.
    pub(in crate::problem) fn transports_at(&mut self, u: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        self.linearise(u);
        self.condense_all(u).ok()?;
        let (n, m, count) = (self.n, self.scheme.degree, self.intervals());
        let mut inner = vec![0.0; m * n * n * count];
        self.system.inner(0..count, count, &mut inner);
        Some((self.transitions(), inner))
    }
}
