//! Unknown keys whose meaning is clear: words of other programs, and keys in the wrong place.
//!
//! **Idea.** Where spelling does not lead to the intended key, the meaning of the word may: `odes` means `equations`,
//! and the `range` of a parameter belongs to a branch.

/// Words for a key, and the key. All are written in full: abbreviations are recognised by their letters.
const MEANINGS: [(&[&str], &str); 16] = [
    (&["ode", "odes", "rhs", "dynamics", "field", "system", "rates"], "equations"),
    (&["variables", "unknowns", "coordinates"], "states"),
    (&["settings", "arguments", "args"], "parameters"),
    (&["observables", "measurements", "monitors"], "outputs"),
    (&["expressions", "auxiliary", "intermediates", "algebra", "where"], "definitions"),
    (&["excitation", "forced", "drive"], "forcing"),
    (&["parameter", "param", "vary", "continue", "icp", "par", "over"], "free"),
    (&["seed", "start", "origin", "begin"], "from"),
    (&["bounds", "limits", "interval", "window", "span"], "range"),
    (&["continuation", "family", "follow"], "branch"),
    (&["solution", "guess", "attractors"], "seed"),
    (&["locus", "loci", "codim2"], "curve"),
    (&["branching", "branch-at", "bifurcations"], "switch"),
    (&["from", "branch", "on"], "of"),
    (&["equilibrium", "fixed-point", "point", "guess", "initial", "x0", "values"], "state"),
    (
        &["optimise", "optimize", "optimisation", "optimization", "minimise", "minimize", "maximise", "maximize"],
        "design",
    ),
];

/// Keys in a place, by the beginning of its name in messages, and where they belong.
const PLACES: [(&str, &[&str], &str); 8] = [
    (
        "the parameter",
        &["range", "from", "to", "min", "max"],
        "the values over which a parameter varies belong to the study, as in [[branch]] with `free` and `range`; `low` \
         and `high` are the bounds of an uncertain parameter",
    ),
    (
        "the model",
        &["model"],
        "a model is called by its `name`; the key `model` belongs to a study, where it gives the file of the model",
    ),
    (
        "the model",
        &["seed", "branch", "curve", "survey", "sweep", "explore", "homotopy", "design"],
        "this belongs to a study, a second file, which names this one with `model = \"FILE\"`",
    ),
    (
        "the model",
        &["frequency", "period"],
        "write it under `[forcing]`: `frequency = \"…\"` (angular) or `period = \"…\"`",
    ),
    (
        "the study",
        &["states", "equations", "forcing", "symmetry", "boundary", "interval", "integrals", "outputs", "definitions"],
        "this belongs to the model, the file that the study names with `model = \"FILE\"`",
    ),
    (
        "the study",
        &["plot", "plots", "figure", "picture", "output"],
        "pictures are drawn when the run has finished: `foldline plot runs/NAME -o FILE.svg`",
    ),
    (
        "the study",
        &["basin", "basins"],
        "`foldline basins MODEL.toml` computes basins of attraction; over a parameter, write [[map]] with `what = \"shares\"`",
    ),
    (
        "a branch",
        &["direction", "directions", "both", "backward", "backwards"],
        "a branch is followed in both directions, to the ends of its `range`; remove this",
    ),
];

/// Returns the key among `known` that a word of the same meaning asks for.
pub(crate) fn meant<'k>(word: &str, known: &[&'k str]) -> Option<&'k str> {
    let word = word.to_lowercase().replace('_', "-");
    let of = |key: &str| MEANINGS.iter().any(|(words, own)| *own == key && words.contains(&word.as_str()));
    known.iter().copied().find(|key| of(key))
}

/// Returns where a key in this place belongs, if it is known to belong elsewhere.
pub(crate) fn belongs(key: &str, whose: &str) -> Option<&'static str> {
    let place = PLACES.iter().find(|(place, keys, _)| whose.starts_with(place) && keys.contains(&key));
    place.map(|(_, _, hint)| *hint)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_means_a_key_only_where_that_key_is_known() {
        assert_eq!(meant("ODEs", &["states", "equations"]), Some("equations"));
        assert_eq!(meant("seed", &["name", "from", "free"]), Some("from"));
        assert_eq!(meant("odes", &["name", "from", "free"]), None);
        assert_eq!(meant("colour", &["states", "equations"]), None);
    }

    #[test]
    fn no_word_has_two_meanings_in_one_place() {
        let of_model = ["equations", "states", "parameters", "outputs", "definitions", "forcing"];
        let of_branch = ["free", "from", "range", "switch"];
        let of_study = ["branch", "seed", "curve"];
        for place in [&of_model[..], &of_branch, &of_study] {
            let of_place = MEANINGS.iter().filter(|(_, key)| place.contains(key));
            let words: Vec<&str> = of_place.flat_map(|(words, _)| words.iter().copied()).collect();
            let distinct: std::collections::HashSet<&str> = words.iter().copied().collect();
            assert_eq!(words.len(), distinct.len());
        }
    }
}
