//! The limit of vanishing unbalance and damping, which the publication leaves open: natural frequencies, the backbones
//! rooted where they are in the ratio n:1, and the forced cycles that tend to them.
//!
//! **Idea.** The damping falls like ε² with the unbalance ε, so that every branch continues to exist: SL needs ζ/ε
//! below a limit, DL needs ζ/ε² below one. What remains in the limit is the backbone of `foldline_rotor::backbone`.

mod claims;
mod panels;
mod turning;

use super::rotor::{OMEGA, parameters};
use crate::publication::{FigurePlan, Made};
use crate::runs::{Run, Runs};
use foldline::diagram::{Branch, Kind, Point, SpecialPoint};
use foldline_plot::Figure;
use foldline_rotor::{Backbone, ContactLaw, Nondimensional, Ratio, Reach, backbone};

pub const PLAN: FigurePlan =
    FigurePlan { name: "limits", title: "vanishing unbalance and damping", runs: &["diagrams", "limits"], make };

/// Fractions of the reference unbalance, as in the branch names of the study `limits`; the first is the reference
/// itself.
const PARTS: [&str; 4] = ["", " 1/2", " 1/4", " 1/8"];

/// One type of cycle under one law: its backbone, and its branches by decreasing unbalance.
struct Family<'r> {
    law: &'static str,
    name: &'static str,
    ratio: Ratio,
    /// The constants of the reference.
    constants: Nondimensional,
    /// Ω at which its cycles are compared with the backbone.
    compared: f64,
    backbone: Backbone,
    levels: Vec<Level<'r>>,
}

/// A forced branch.
struct Level<'r> {
    run: &'r Run,
    branch: &'r Branch,
    zeta: f64,
    epsilon: f64,
}

impl<'r> Family<'r> {
    fn of(runs: &'r Runs, law: &'static str, name: &'static str, ratio: Ratio) -> Result<Family<'r>, String> {
        let level = |part: &&str| {
            let run = runs.run(if part.is_empty() { "diagrams" } else { "limits" })?;
            let branch = run.branch(&format!("{law} {name}{part}"))?;
            let [_, _, zeta, epsilon, ..] = parameters(&branch.points[0]);
            Ok(Level { run, branch, zeta, epsilon })
        };
        let levels = PARTS.iter().map(level).collect::<Result<Vec<Level>, String>>()?;
        let constants = Nondimensional::from_parameters(parameters(&levels[0].branch.points[0]));
        let backbone = rooted(&constants, ContactLaw::Tanh, ratio)?;
        // At Ω = 5 the smallest unbalance still changes contact SL by a quarter of its penetration of the ring.
        let compared = if law == "contact" && name == "SL" { 8.0 } else { 5.0 };
        Ok(Family { law, name, ratio, constants, compared, backbone, levels })
    }

    /// Title such as `cubic SL`.
    fn title(&self) -> String {
        format!("{} {}", self.law, self.name)
    }

    fn has_contact(&self) -> bool {
        self.constants.kappa > 0.0
    }
}

impl<'r> Level<'r> {
    /// All cycles at that Ω.
    fn at(&self, omega: f64) -> Result<Vec<Point>, String> {
        self.run.at(&self.branch.name, omega)
    }

    /// Folds by increasing Ω.
    fn folds(&self) -> Vec<&'r SpecialPoint> {
        let mut folds: Vec<&SpecialPoint> = self.branch.special.iter().filter(|s| s.kind == Kind::Fold).collect();
        folds.sort_by(|a, b| a.point.parameters[OMEGA].total_cmp(&b.point.parameters[OMEGA]));
        folds
    }
}

/// Backbone over the range of a forced branch of the figure.
fn rooted(constants: &Nondimensional, law: ContactLaw, ratio: Ratio) -> Result<Backbone, String> {
    let reach = Reach { speeds: [0.5, 12.0], radius: 60.0, tolerance: 1e-8 };
    backbone(constants, law, ratio, &reach).map_err(|mistake| mistake.to_string())
}

fn make(runs: &Runs) -> Result<Made, String> {
    let kinds = [
        ("cubic", "SL", Ratio::SINGLE_LOOP),
        ("cubic", "DL", Ratio::DOUBLE_LOOP),
        ("contact", "SL", Ratio::SINGLE_LOOP),
        ("contact", "DL", Ratio::DOUBLE_LOOP),
    ];
    let families = kinds
        .into_iter()
        .map(|(law, name, ratio)| Family::of(runs, law, name, ratio))
        .collect::<Result<Vec<Family>, String>>()?;
    let panels = panels::all(&families)?;
    Ok(Made {
        figure: Figure { columns: 6, ..Figure::grid("Vanishing unbalance and damping", 6, panels) },
        caption: "(a), (b): natural frequencies of the undamped rotor, free and as if the ring were always touched; in the rotating \
                  frame those of SL are in the ratio 2:1 and those of DL 3:1 at the speeds marked. (c) to (f): largest radius of \
                  forced cycles, ζ falling with the square of ε, and the conservative backbone to which they tend; for contact the \
                  speeds between which cycles can touch the ring are shaded. (g), (h): distance from the backbone, the larger of all \
                  sheets, with the power of ε of the last step. (i): the largest ζ/ε with a single loop, to first order, and the folds of the forced branches."
            .into(),
        claims: claims::all(&families),
    })
}
