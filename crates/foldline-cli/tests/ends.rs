//! Models whose branches cannot be continued: each run ends with the reason, the likely cause and a remedy.

use std::process::Command;

/// A model of `states` (name and equation) in parameters, and one branch from a seed.
struct Case<'a> {
    parameters: &'a [(&'a str, f64)],
    states: &'a [(&'a str, &'a str)],
    seed: &'a str,
    /// The first parameter is free.
    range: [f64; 2],
    /// Further lines of the branch.
    more: &'a str,
}

impl Case<'_> {
    /// Exit code, and what the user is told at the end of the run.
    fn run(&self) -> (Option<i32>, String) {
        let folder = tempfile::tempdir().unwrap();
        let mut model = String::from("[parameters]\n");
        self.parameters.iter().for_each(|(name, value)| model += &format!("{name} = {value:?}\n"));
        self.states.iter().for_each(|(name, f)| model += &format!("[states.{name}]\nequation = \"{f}\"\n"));
        let (free, [low, high]) = (self.parameters[0].0, self.range);
        let study = format!(
            "model = \"m.toml\"\n[[seed]]\nname = \"s\"\n{}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n\
             free = \"{free}\"\nrange = [{low:?}, {high:?}]\n{}\n",
            self.seed, self.more
        );
        std::fs::write(folder.path().join("m.toml"), model).unwrap();
        std::fs::write(folder.path().join("s.toml"), study).unwrap();
        let command = ["run", "s.toml", "--out", "r"];
        let output =
            Command::new(env!("CARGO_BIN_EXE_foldline")).args(command).current_dir(folder.path()).output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    }

    /// Asserts that the run ends short and mentions all of these.
    #[track_caller]
    fn ends(&self, pieces: &[&str]) {
        let (code, said) = self.run();
        assert_eq!(code, Some(3), "{said}");
        for piece in pieces {
            assert!(said.contains(piece), "{piece:?} is missing in\n{said}");
        }
        assert!(said.contains("\n  what to do: ") || said.contains("period grew"), "{said}");
        // Reported once, not for each side.
        assert_eq!(said.matches("incomplete: ").count(), 1, "{said}");
    }

    /// Asserts that the study is refused before anything is computed, and that the message contains all of these.
    #[track_caller]
    fn is_refused(&self, pieces: &[&str]) {
        let (code, said) = self.run();
        assert_eq!(code, Some(2), "{said}");
        for piece in pieces {
            assert!(said.contains(piece), "{piece:?} is missing in\n{said}");
        }
    }
}

const MU: &[(&str, f64)] = &[("mu", 1.0)];

#[test]
fn a_branch_ends_where_f_is_not_finite_beyond_a_state() {
    let states = [("x", "mu - 0.5*sqrt(1 - x) - x")];
    Case { parameters: MU, states: &states, seed: "state = { x = 0.6 }", range: [0.0, 4.0], more: "" }.ends(&[
        "vector field not finite: near 1.0000",
        "the boundary of the region where the vector field is defined",
    ]);
}

#[test]
fn a_branch_ends_where_f_is_not_finite_beyond_a_parameter_value() {
    let states = [("x", "log(mu) - x")];
    Case { parameters: MU, states: &states, seed: "state = { x = 0 }", range: [-1.0, 2.0], more: "" }
        .ends(&["vector field not finite: the parameter converges to", "the boundary of the region"]);
}

#[test]
fn a_branch_ends_at_an_asymptote() {
    let states = [("x", "mu*x - 1")];
    Case { parameters: MU, states: &states, seed: "state = { x = 1 }", range: [-1.0, 1.0], more: "" }
        .ends(&["solution unbounded: a state has grown to", "the branch has an asymptote there"]);
}

/// x' = 2 mu (y - x), y' = mu (x - y): the Jacobian is singular everywhere.
#[test]
fn a_conserved_combination_of_states_is_named() {
    let states = [("x", "2*mu*(y - x)"), ("y", "mu*(x - y)")];
    Case { parameters: MU, states: &states, seed: "state = { x = 0.5, y = 0.5 }", range: [0.5, 2.0], more: "" }
        .is_refused(&["x + 2*y is conserved", "T1 = { sum = \"x + 2*y\", value = … }"]);
    let states = [("x", "0*mu")];
    Case { parameters: MU, states: &states, seed: "state = { x = 0.5 }", range: [0.5, 2.0], more: "" }
        .is_refused(&["x is conserved"]);
    // 2x + mu y is conserved at every mu, but 2x + y only at mu = 1.
    let states = [("x", "mu*(y - x^2)"), ("y", "2*(x^2 - y)")];
    Case { parameters: MU, states: &states, seed: "state = { x = 0.5, y = 0.25 }", range: [0.5, 2.0], more: "" }
        .ends(&["no start", "likely cause: 2*x + y is conserved", "eliminate one state"]);
}

/// At mu = 0 the oscillator is conservative and linear: it has cycles of all sizes.
#[test]
fn a_family_of_cycles_at_one_parameter_value_is_recognised() {
    let parameters = [("mu", -0.5)];
    let states = [("x", "y"), ("y", "mu*y - x")];
    let more = "switch = { hopf = 1 }";
    Case { parameters: &parameters, states: &states, seed: "attractor = \"equilibrium\"", range: [-1.0, 1.0], more }
        .ends(&["b/hopf-1: solution unbounded", "a conservative system"]);
}

/// The cycles from the Hopf point at mu = 1 end at the homoclinic orbit of the saddle (1, 0), near mu = 5/7.
#[test]
fn a_branch_of_cycles_ends_at_a_homoclinic_orbit() {
    let parameters = [("mu", 1.5)];
    let states = [("x", "y"), ("y", "-1 + mu*y + x^2 + x*y")];
    let more = "switch = { hopf = 1 }";
    let case =
        Case { parameters: &parameters, states: &states, seed: "state = { x = -1, y = 0 }", range: [0.0, 2.0], more };
    let (code, said) = case.run();
    assert!(code == Some(0) && said.contains("approaches an orbit homoclinic to the saddle (1.000000, "), "{said}");
}

/// The branch of cycles from its other end: it shrinks to the equilibrium, and should end there.
#[test]
fn a_branch_of_cycles_ends_at_its_hopf_point() {
    let states = [("x", "mu*x - y - x*(x^2 + y^2)"), ("y", "x + mu*y - y*(x^2 + y^2)")];
    let case = Case { parameters: MU, states: &states, seed: "attractor = \"cycle\"", range: [-1.0, 1.5], more: "" };
    let (code, said) = case.run();
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("shrank to an equilibrium at 0.000000") || said.contains("at -0.000000"), "{said}");
}

/// The equilibrium reaches a surface where f jumps over zero.
#[test]
fn a_branch_of_equilibria_ends_at_a_jump() {
    let states = [("x", "mu - x - 2*heaviside(-x)")];
    Case {
        parameters: MU,
        states: &states,
        seed: "state = { x = 1 }\nparameters = { mu = 1 }",
        range: [-1.0, 2.0],
        more: "",
    }
    .ends(&[
        "reaches a switching surface at which the right-hand side jumps",
        "stay on the surface",
        "smooth the switches",
    ]);
}

#[test]
fn trajectories_that_slide_along_two_surfaces_are_explained() {
    let states = [("x", "-2*sign(x) + mu*y"), ("y", "-2*sign(y) - x - y")];
    Case { parameters: MU, states: &states, seed: "attractor = \"cycle\"", range: [0.0, 1.0], more: "" }.ends(&[
        "stopped because the step size became too small",
        "slide along two discontinuities at once",
        "replace the jumps by smooth steps",
    ]);
}

#[test]
fn a_seed_without_attractor_is_explained() {
    let states = [("x", "1 + x^2 + mu^2")];
    Case { parameters: MU, states: &states, seed: "attractor = \"equilibrium\"", range: [-1.0, 2.0], more: "" }
        .ends(&["escaped (128)", "no attractor can be reached from the ranges of the states"]);
}

#[test]
fn an_isolated_point_and_a_cusp_end_a_branch() {
    let parameters = [("mu", 0.0)];
    let states = [("x", "-x^2 - mu^2")];
    Case { parameters: &parameters, states: &states, seed: "state = { x = 0 }", range: [-1.0, 1.0], more: "" }
        .ends(&["the state is a singular equilibrium"]);
    let states = [("x", "mu^3 - x^2")];
    Case { parameters: MU, states: &states, seed: "state = { x = 1 }", range: [-1.0, 2.0], more: "" }
        .ends(&["steps of", "the solutions do not form a smooth curve here: a cusp"]);
}

#[test]
fn trajectories_that_leave_the_domain_of_definition_are_explained() {
    let states = [("x", "v"), ("v", "-mu*v/10 - sqrt(x)")];
    let exit = ["leaves the region where the vector field is defined", "likely cause: at time", "x = 0.000000"];
    Case { parameters: MU, states: &states, seed: "state = { x = 1, v = 0 }", range: [0.5, 2.0], more: "" }.ends(&exit);
}

/// Two masses on springs without damping: no trajectory settles, because energy is conserved.
#[test]
fn conserved_energy_is_named_as_the_reason_for_not_settling() {
    let parameters = [("delta", 0.0)];
    let states = [("x", "v"), ("y", "w"), ("v", "-2*x + y - 0.5*x^3 + delta*v"), ("w", "-2*y + x + delta*w")];
    let seed = "state = { x = 1, y = 0.5, v = 0, w = 0 }";
    Case { parameters: &parameters, states: &states, seed, range: [-0.1, 0.1], more: "" }
        .ends(&["likely cause: there is no damping and the forces derive from a potential, so energy is conserved"]);
}
