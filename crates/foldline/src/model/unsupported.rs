//! Messages about problems that are not solved here, and about settings of other programs that have no counterpart.
//!
//! **Idea.** An unknown key, value or function name may ask for a kind of problem. The answer names it and says what to
//! do instead, here or with another program.

/// Feature that is not supported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unsupported {
    /// Statement that it is not supported, in terms of the field.
    pub message: &'static str,
    /// Alternative.
    pub instead: &'static str,
}

/// Kind of problem: the words that ask for it, in lower case without `-`, `_` and a final `s`.
type Kind = (&'static [&'static str], &'static str, &'static str);

const KINDS: [Kind; 15] = [
    (
        &["map", "iterate", "iteration", "discrete", "discretetime"],
        "a map is a model whose table [map] takes the place of [equations]",
        "write `[map]` in the model file, with the next value of each state, as in `x = \"r*x*(1 - x)\"`; if the map \
         samples a flow, give the flow, whose cycles are the fixed points",
    ),
    (
        &["reset", "jump", "event", "guard", "impact", "restitution", "hybrid", "transition"],
        "states that jump are written as [events.NAME], walls as [contact.NAME]",
        "write `[events.stop]` with `when = \"x - d\"` and `set = { v = \"-e*v\" }`, or `[contact.stop]` with `at = \"x\"`, \
         `clearance` and `restitution`",
    ),
    (
        &["boundarie", "boundarycondition", "bc", "bvp", "nbc", "nint"],
        "a boundary-value problem is a model with the tables [interval] and [boundary]",
        "give `[interval]` with its `length`, and `[boundary]` with one condition for each state, such as `left = \
         \"u@0\"`; integral conditions belong under [integrals]",
    ),
    (
        &["integralcondition", "integralconstraint", "constraint", "algebraic", "dae"],
        "algebraic equations are not supported",
        "solve the equation for a variable under [definitions], or give that variable a fast differential equation, \
         such as eps*z' = g(x, z)",
    ),
    (
        &["delay", "lag", "delayed", "history", "dde"],
        "delay differential equations are not supported",
        "approximate the delay by a chain of states, z1' = n/tau*(x - z1), z2' = n/tau*(z1 - z2), …, with `count` for its length; for \
         an exact delay use DDE-BIFTOOL or knut",
    ),
    (
        &["torus", "tori", "quasiperiodic", "invarianttorus"],
        "invariant tori are branches that leave cycles at torus points",
        "write `switch = { torus = 1 }` in the [[branch]] of the cycles; where a small forcing acts on an autonomous cycle, \
         give the [[seed]] of the cycle `torus = true` and follow the branch in the size of the forcing",
    ),
    (
        &["homoclinic", "heteroclinic", "connection", "connectingorbit", "homcont"],
        "connecting orbits are curves in two parameters, which belong to a study",
        "write a [[curve]] with `hold = \"homoclinic\"`, `\"heteroclinic\"` or `\"saddle-node-homoclinic\"`, `of` a branch of cycles \
         that ends at such an orbit; the first two also start `of` a branch of equilibria",
    ),
    (
        &["frequencie", "secondfrequency", "frequency2"],
        "two forcing frequencies belong in a list `frequencies`",
        "write `frequencies = [\"Omega\", \"nu\"]` under [forcing], and `t1` and `t2` for the time in the terms of each; if \
         their ratio is m:n, give the common period, as in `period = \"2*pi*n/omega\"`: the response is then a cycle",
    ),
    (
        &["noise", "stochastic", "diffusion", "sde", "wiener"],
        "random forcing is not supported: the equations are deterministic",
        "study the deterministic part here; simulate with noise in another program",
    ),
    (
        &["pde", "space", "spatial", "laplacian"],
        "partial differential equations are not supported",
        "discretise in space with a repeated state (`count`); up to about a hundred states are practical. For more use BifurcationKit or \
         pde2path",
    ),
    (
        &["initial", "initialcondition", "initialvalue", "initialstate", "init", "ic", "x0", "y0"],
        "initial conditions do not belong to this table",
        "give an initial state in the study, as in [[seed]] with `state = { x = 1, v = 0 }`, or a `range` of each \
         state in the model, from which initial states are sampled",
    ),
    (
        &["ds", "dsmin", "dsmax", "step", "stepsize", "maxstep", "minstep", "initialstep", "maxstepsize", "iad"],
        "step sizes of the continuation cannot be set",
        "they follow from `tolerance`; remove this",
    ),
    (
        &["ntst", "ncol", "mesh", "meshinterval", "collocationpoint", "nmx"],
        "meshes cannot be set",
        "they adapt to `tolerance`; `degree` sets the order of collocation, and `max-points` the length of a branch",
    ),
    (
        &[
            "dt",
            "timestep",
            "solver",
            "integrator",
            "method",
            "rtol",
            "atol",
            "reltol",
            "abstol",
            "epsl",
            "epsu",
            "epss",
        ],
        "the method and its tolerances cannot be set individually",
        "they follow from `tolerance`; remove this",
    ),
    (
        &["jacobian", "jac", "derivative", "gradient"],
        "derivatives need not be given",
        "they are computed exactly from the equations; remove this",
    ),
];

/// Unsupported kind of problem that an unknown word asks for, if any.
pub fn unsupported(word: &str) -> Option<Unsupported> {
    let plain: String = word.to_lowercase().chars().filter(|c| !matches!(c, '-' | '_' | ' ')).collect();
    let stem = plain.strip_suffix('s').unwrap_or(&plain);
    KINDS
        .iter()
        .find(|(words, ..)| words.iter().any(|own| *own == stem || *own == plain))
        .map(|(_, message, instead)| Unsupported { message, instead })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_recognised_in_every_spelling() {
        for word in
            ["delay", "delays", "Delays", "boundary-conditions", "boundary_conditions", "DSMAX", "ds", "tori", "events"]
        {
            assert!(unsupported(word).is_some(), "{word}");
        }
        for word in ["name", "state", "range", "switches", "x"] {
            assert!(unsupported(word).is_none(), "{word}");
        }
    }

    #[test]
    fn no_word_is_listed_twice() {
        let words: Vec<&str> = KINDS.iter().flat_map(|(words, ..)| words.iter().copied()).collect();
        let distinct: std::collections::HashSet<&str> = words.iter().copied().collect();
        assert_eq!(words.len(), distinct.len());
    }
}
