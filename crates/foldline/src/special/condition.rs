//! Defining system for each kind of bifurcation point.

use super::on_branch_points::OnBranchPoints;
use super::on_cycles::OnCycles;
use super::on_equilibria::OnEquilibria;
use super::on_impacts::OnImpacts;
use super::on_maps::OnMaps;
use super::on_surfaces::OnSurfaces;
use super::on_tangents::OnTangents;
use crate::contract::Condition;
use crate::diagram::{Cycle, Kind, Solution};
use crate::problem::impact::stored::{hard, impacts};
use crate::problem::{Setting, mesh};

/// Returns the defining system of a bifurcation point of the given kind for solutions like `at`, on its mesh; `None` if
/// that kind cannot be continued there. The setting has two free parameters.
pub fn condition<'a>(
    kind: Kind,
    setting: Setting<'a>,
    degree: usize,
    at: &Solution,
) -> Option<Box<dyn Condition + 'a>> {
    if setting.field.iterated() {
        return Some(Box::new(OnMaps::new(kind, setting, at)?));
    }
    match at {
        Solution::Cycle(arc) if setting.field.conditions() != [0, 0] => {
            Some(Box::new(OnTangents::new(kind, setting, &mesh::at_least_some(arc, degree))?))
        }
        Solution::Cycle(cycle) if has_events(kind, &setting, cycle) => {
            Some(Box::new(OnImpacts::new(kind, setting, cycle)?))
        }
        _ if matches!(kind, Kind::Grazing | Kind::ImpactGrazing | Kind::BoundaryEquilibrium) => {
            let whole = match at {
                Solution::Cycle(cycle) => Solution::Cycle(mesh::at_least_some(cycle, degree)),
                Solution::Equilibrium(_) | Solution::Torus(_) => at.clone(),
            };
            Some(Box::new(OnSurfaces::new(kind, setting, &whole)?))
        }
        Solution::Equilibrium(_) if kind == Kind::BranchPoint => Some(Box::new(OnBranchPoints::new(setting))),
        Solution::Equilibrium(_) => Some(Box::new(OnEquilibria::new(kind, setting)?)),
        Solution::Torus(torus) if kind == Kind::Fold => Some(Box::new(OnTangents::of_tori(setting, torus))),
        Solution::Torus(_) => None,
        Solution::Cycle(cycle) => Some(Box::new(OnCycles::new(kind, setting, &mesh::at_least_some(cycle, degree))?)),
    }
}

/// True if a bifurcation of that kind concerns cycles with events: an impact without speed is none.
fn has_events(kind: Kind, setting: &Setting, cycle: &Cycle) -> bool {
    let (field, parameters) = (setting.field, &setting.parameters);
    match kind {
        Kind::ImpactGrazing => !hard(field, parameters, cycle).is_empty(),
        _ => !impacts(field, parameters, cycle).is_empty(),
    }
}
