//! Switching functions: nonsmooth points of the expressions of a model.
//!
//! **Idea.** A comparison, a minimum, an absolute value or a step changes its branch where one number, its *switch*,
//! changes sign. If the signs of all switches are prescribed instead of taken from the state, every branch is fixed and
//! the expressions are smooth: they continue past the zero of a switch as if it had not been crossed.
//!
//! **Equations.** With σ the given sign (±1) of the switch s:
//!
//! 1. a < b, a ≤ b: s = a - b, true where σ < 0;   min(a, b), max(a, b): s = a - b, the operand that σ selects
//! 2. |a|: s = a, σ a;   sign(a): s = a, σ;   heaviside(a): s = a, (1 + σ)/2
//!
//! 3. ⌊a⌋: s = sin πa, the integer k, even where σ > 0 and odd where σ < 0, for which k + ½ is closest to a
//!
//! Where both branches f⁻, f⁺ of σ = ∓1 lead towards the surface s = 0, the motion continues along it (Filippov) with
//!
//! 4. f = f⁻ + a/(a - b) (f⁺ - f⁻),   a = ∇s·f⁻ + s_t > 0,   b = ∇s·f⁺ + s_t < 0
//!
//! **Source.** filippov1988, §4.
//!
//! **Departures.** An expression that cannot change sign (a radius compared with 0) or depends on parameters only is
//! not a switch. A comparison for equality holds at isolated instants and has no effect. A branch that is undefined
//! beyond its switch, such as a root, is not continued; the branch that applies at the state is used instead
//! ([`super::Model`]).

use super::graph::{Binary, Graph, Id, Leaf, Node, Unary};
use super::tape::Tape;

/// The switches of a list of expressions.
#[derive(Debug)]
pub(super) struct Switches {
    /// Number of switches.
    pub count: usize,
    /// Values of the switches.
    pub values: Tape,
    /// Values of the switches with given signs, if some switches depend on the branch of others, as `mod(t, T) < c` does: their values
    /// jump, which does not show at the place of the jump itself.
    pub given_values: Option<Tape>,
    /// Graph and nodes of the switches.
    pub graph: Graph,
    pub switches: Vec<Id>,
    roots: Vec<Id>,
    reached: Vec<bool>,
    own: Vec<Option<(u32, bool)>>,
}

impl Switches {
    /// Switches that `roots` depend on, then those of the events, which no root depends on as such.
    pub fn new(graph: &Graph, roots: &[Id], events: &[Id]) -> Switches {
        let mut graph = graph.clone();
        let reached = graph.reachable(roots);
        let varying = depends_on_state(&graph);
        let (mut switches, mut own) = (Vec::new(), vec![None; reached.len()]);
        for i in (0..reached.len()).filter(|&i| reached[i]) {
            let switch = match graph.node(Id(i as u32)) {
                // The sign of sin πa alternates between consecutive intervals of integers.
                Node::Unary(Unary::Floor, a) if varying[a.at()] => {
                    let pi = graph.constant(std::f64::consts::PI);
                    let turns = graph.multiply(pi, a);
                    Some((graph.unary(Unary::Sin, turns), false))
                }
                Node::Unary(Unary::Abs | Unary::Sign | Unary::Heaviside, a) => Some((a, false)),
                Node::Binary(Binary::Less | Binary::LessOrEqual | Binary::Min | Binary::Max, a, b)
                    if varying[a.at()] || varying[b.at()] =>
                {
                    // a < b and b < a share one switch.
                    let (difference, reverse) = (graph.subtract(a, b), graph.subtract(b, a));
                    Some(if switches.contains(&reverse) { (reverse, true) } else { (difference, false) })
                }
                _ => None,
            };
            let Some((id, reversed)) = switch else { continue };
            if changes_sign(&graph, id) && (id.at() >= varying.len() || varying[id.at()]) {
                let place = switches.iter().position(|s| *s == id).unwrap_or_else(|| {
                    switches.push(id);
                    switches.len() - 1
                });
                own[i] = Some((place as u32, reversed));
            }
        }
        switches.extend_from_slice(events);
        let values = Tape::new(&graph, &[&switches]);
        let given_values = nested(&graph, &switches, &own);
        Switches { count: switches.len(), values, given_values, graph, switches, roots: roots.to_vec(), reached, own }
    }

    /// The expressions with the signs of the switches in the components of direction `direction`, and their graph.
    pub fn given(&self, direction: u32) -> (Graph, Vec<Id>) {
        let mut graph = self.graph.clone();
        let given = self.with_signs(&mut graph, &|graph, switch| graph.leaf(Leaf::Direction(direction, switch)));
        (graph, given)
    }

    /// Right-hand sides of motion along the surface of a switch, (4), with the signs of the others as in
    /// [`Switches::given`].
    pub fn sliding(&self, direction: u32, along: usize) -> (Graph, Vec<Id>) {
        let mut graph = self.graph.clone();
        let sides = self.sides(&mut graph, direction, along);
        let [speed_below, speed_above] = self.normal_speeds(&mut graph, &sides, along);
        let [below, above] = sides;
        let apart = graph.subtract(speed_below, speed_above);
        let share = graph.divide(speed_below, apart);
        let slides = below.iter().zip(&above).map(|(below, above)| {
            let jump = graph.subtract(*above, *below);
            let shift = graph.multiply(share, jump);
            graph.add(*below, shift)
        });
        let slides = slides.collect();
        (graph, slides)
    }

    /// a and b of (4) for the surface of a switch, with the signs of the others as in [`Switches::given`].
    pub fn speeds(&self, direction: u32, along: usize) -> (Graph, Vec<Id>) {
        let mut graph = self.graph.clone();
        let sides = self.sides(&mut graph, direction, along);
        let speeds = self.normal_speeds(&mut graph, &sides, along).to_vec();
        (graph, speeds)
    }

    /// f⁻ and f⁺ of (4).
    fn sides(&self, graph: &mut Graph, direction: u32, along: usize) -> [Vec<Id>; 2] {
        [-1.0, 1.0].map(|side| {
            self.with_signs(graph, &|graph, switch| match switch as usize == along {
                true => graph.constant(side),
                false => graph.leaf(Leaf::Direction(direction, switch)),
            })
        })
    }

    /// a and b of (4).
    fn normal_speeds(&self, graph: &mut Graph, sides: &[Vec<Id>; 2], along: usize) -> [Id; 2] {
        let surface = self.switches[along];
        [0, 1].map(|side| {
            let field = &sides[side];
            let rate = |graph: &mut Graph, leaf: Leaf| match leaf {
                Leaf::State(j) => Some(field[j as usize]),
                Leaf::Time => Some(graph.constant(1.0)),
                _ => None,
            };
            graph.derivative(&[surface], rate)[0]
        })
    }

    fn with_signs(&self, graph: &mut Graph, sign: &dyn Fn(&mut Graph, u32) -> Id) -> Vec<Id> {
        with_given_signs(graph, &self.roots, &self.reached, &self.own, sign)
    }
}

/// The switches with the signs of direction 0, if any of them depends on another.
fn nested(graph: &Graph, switches: &[Id], own: &[Option<(u32, bool)>]) -> Option<Tape> {
    let mut graph = graph.clone();
    let reached = graph.reachable(switches);
    let own: Vec<_> = (0..reached.len()).map(|i| own.get(i).copied().flatten()).collect();
    if !(0..reached.len()).any(|i| reached[i] && own[i].is_some()) {
        return None;
    }
    let sign = |graph: &mut Graph, switch: u32| graph.leaf(Leaf::Direction(0, switch));
    let given = with_given_signs(&mut graph, switches, &reached, &own, &sign);
    Some(Tape::new(&graph, &[&given]))
}

/// Marks the nodes that change along a trajectory.
fn depends_on_state(graph: &Graph) -> Vec<bool> {
    let mut depends: Vec<bool> = Vec::with_capacity(graph.len());
    for i in 0..graph.len() {
        let node = graph.node(Id(i as u32));
        let own = matches!(node, Node::Leaf(Leaf::State(_) | Leaf::Time));
        depends.push(own || node.operands().any(|a| depends[a.at()]));
    }
    depends
}

/// True if a switch may take both signs, judged by the form of its expression.
fn changes_sign(graph: &Graph, id: Id) -> bool {
    let opposite = match graph.node(id) {
        Node::Unary(Unary::Negate, a) => Some(a),
        _ => None,
    };
    !(graph.nonnegative(id) || opposite.is_some_and(|a| graph.nonnegative(a)))
}

/// Roots rebuilt with every switch in `own` decided by its given sign.
fn with_given_signs(
    graph: &mut Graph,
    roots: &[Id],
    reached: &[bool],
    own: &[Option<(u32, bool)>],
    sign_of: &dyn Fn(&mut Graph, u32) -> Id,
) -> Vec<Id> {
    let mut new: Vec<Id> = (0..reached.len()).map(|i| Id(i as u32)).collect();
    for i in (0..reached.len()).filter(|&i| reached[i]) {
        let at = |id: Id| new[id.at()];
        let node = graph.node(Id(i as u32));
        let rebuilt = match (node, own[i]) {
            (Node::Constant(_) | Node::Leaf(_), _) => Id(i as u32),
            (Node::Unary(op, a), Some((switch, _))) => {
                let sign = sign_of(graph, switch);
                match op {
                    Unary::Abs => graph.multiply(sign, at(a)),
                    Unary::Heaviside => graph.unary(op, sign),
                    Unary::Floor => floor(graph, at(a), sign),
                    _ => sign,
                }
            }
            (Node::Binary(op, a, b), Some((switch, reversed))) => {
                let (sign, zero) = (sign_of(graph, switch), graph.constant(0.0));
                let (low, high) = if reversed { (zero, sign) } else { (sign, zero) };
                let first_is_less = graph.binary(Binary::Less, low, high);
                match op {
                    Binary::Min => graph.select(first_is_less, at(a), at(b)),
                    Binary::Max => graph.select(first_is_less, at(b), at(a)),
                    _ => first_is_less,
                }
            }
            (Node::Unary(op, a), None) => graph.unary(op, at(a)),
            (Node::Binary(op, a, b), None) => graph.binary(op, at(a), at(b)),
            (Node::Integer(a, n), _) => graph.integer(at(a), n),
            (Node::Select(c, a, b), _) => graph.select(at(c), at(a), at(b)),
        };
        new[i] = rebuilt;
    }
    roots.iter().map(|root| new[root.at()]).collect()
}

/// Even (p = 0) or odd (p = 1) integer k, by the sign, for which k + ½ is closest to `a`: 2⌊(a - p + ½)/2⌋ + p.
fn floor(graph: &mut Graph, a: Id, sign: Id) -> Id {
    let (half, one) = (graph.constant(0.5), graph.constant(1.0));
    let step = graph.unary(Unary::Heaviside, sign);
    let odd = graph.subtract(one, step);
    let from = graph.subtract(a, odd);
    let from = graph.add(from, half);
    let pairs = graph.multiply(half, from);
    let pairs = graph.unary(Unary::Floor, pairs);
    let two = graph.constant(2.0);
    let even = graph.multiply(two, pairs);
    graph.add(even, odd)
}

#[cfg(test)]
mod tests {
    use crate::contract::{Batch, Parameters, VectorField};
    use crate::model::{Definition, Model, ModelSource, Parameter, State};

    fn model(equation: &str) -> Model {
        let source = ModelSource {
            parameters: vec![Parameter::new("p", 0.5)],
            states: vec![State::new("x"), State::new("y")],
            equations: vec![Definition::new("x", equation), Definition::new("y", "-x")],
            ..ModelSource::default()
        };
        Model::compile(source).unwrap()
    }

    #[test]
    fn expressions_that_cannot_change_sign_have_no_switch() {
        for smooth in ["x*y", "if(p > 0, x, y)", "if(hypot(x, y) > 0, x, y)", "abs(x^2) + sqrt(x)", "if(x == y, 1, y)"]
        {
            assert_eq!(model(smooth).switch_count(), 0, "{smooth}");
        }
        for (kinked, count) in [
            ("max(x - p, 0)", 1),
            ("if(x > y, x, 0) + if(y > x, y, 0)", 1),
            ("abs(x) + sign(y)", 2),
            ("min(x, p*y)*heaviside(x)", 2),
            ("floor(x) + x*floor(p)", 1),
            ("mod(x, 2)", 1),
        ] {
            assert_eq!(model(kinked).switch_count(), count, "{kinked}");
        }
    }

    #[test]
    fn an_undefined_branch_is_replaced_by_the_branch_in_force() {
        // The comparison x > p has the switch p - x, the maximum x - p.
        for (text, sign, beyond, inside) in
            [("max(x - p, 0)^1.5", 1.0, 0.0, 1.0), ("if(x > p, log(x - p), 7)", -1.0, 7.0, 0.0)]
        {
            let model = model(text);
            let states = [0.2, 1.5, 0.0, 0.0];
            let at =
                Batch { lanes: 2, states: &states, parameters: Parameters::Shared(&[0.5]), times: &[], signs: &[] };
            let mut f = [0.0; 4];
            model.evaluate(Batch { signs: &[sign; 2], ..at }, &mut f);
            assert_eq!(f[..2], [beyond, inside], "{text}");
        }
        // An expression that is undefined on both sides stays undefined.
        let model = model("if(x > p, sqrt(x - 0.9), 0)");
        let at =
            Batch { lanes: 1, states: &[0.7, 0.0], parameters: Parameters::Shared(&[0.5]), times: &[], signs: &[] };
        let mut f = [0.0; 2];
        model.evaluate(Batch { signs: &[-1.0], ..at }, &mut f);
        assert!(f[0].is_nan());
    }

    #[test]
    fn prescribed_signs_select_the_branch_and_actual_signs_reproduce_the_field() {
        let cases = [
            "max(x - p, 0)",
            "min(x, y)",
            "abs(x) + 2*sign(y)*x",
            "heaviside(x - y)*y",
            "floor(3*x)*y",
            "mod(x, 0.5) + ceil(y)",
            "if(x > y, x^2, y) + if(y > x, 3, 4)",
        ];
        for text in cases {
            let model = model(text);
            let value = |x: [f64; 2], signs: Option<&[f64]>| {
                let at = Batch { lanes: 1, states: &x, parameters: Parameters::Shared(&[0.5]), times: &[], signs: &[] };
                let mut f = [0.0; 2];
                match signs {
                    None => model.evaluate(at, &mut f),
                    Some(signs) => model.evaluate(Batch { signs, ..at }, &mut f),
                }
                f[0]
            };
            for x in [[0.7, 0.2], [-0.3, 0.1], [-0.4, -0.9]] {
                let mut switches = vec![0.0; model.switch_count()];
                let at = Batch { lanes: 1, states: &x, parameters: Parameters::Shared(&[0.5]), times: &[], signs: &[] };
                model.switches(at, &mut switches);
                let actual: Vec<f64> = switches.iter().map(|s| s.signum()).collect();
                assert_eq!(value(x, Some(&actual)), value(x, None), "{text} at {x:?}");
                let other: Vec<f64> = actual.iter().map(|s| -s).collect();
                assert_ne!(value(x, Some(&other)), value(x, None), "{text} at {x:?} with the signs reversed");
            }
        }
    }
}
