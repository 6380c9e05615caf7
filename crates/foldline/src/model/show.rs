//! Text of an expression graph, for messages.

use super::graph::{Binary, Graph, Id, Leaf, Node, Unary};

/// Characters beyond which a text is no longer readable in a table.
const LONGEST: usize = 40;

/// Text of a node with the given names of states and parameters; `None` if it would be too long.
pub(super) fn text(graph: &Graph, id: Id, states: &[&str], parameters: &[&str]) -> Option<String> {
    let (text, _) = written(graph, id, &|leaf| match leaf {
        Leaf::State(i) => states.get(i as usize).map_or("?", |name| name).to_string(),
        Leaf::Parameter(k) => parameters.get(k as usize).map_or("?", |name| name).to_string(),
        Leaf::Time => "t".into(),
        Leaf::Direction(..) => "?".into(),
    })?;
    Some(text)
}

/// Text and binding strength: 0 for sums, 1 for products, 2 for powers and negation, 3 for names and calls.
fn written(graph: &Graph, id: Id, leaf: &dyn Fn(Leaf) -> String) -> Option<(String, u8)> {
    let of = |id: Id| written(graph, id, leaf);
    let bound = |id: Id, least: u8| -> Option<String> {
        let (text, strength) = of(id)?;
        Some(if strength < least { format!("({text})") } else { text })
    };
    let call = |name: &str, operands: &[Id]| -> Option<(String, u8)> {
        let texts: Option<Vec<String>> = operands.iter().map(|operand| Some(of(*operand)?.0)).collect();
        Some((format!("{name}({})", texts?.join(", ")), 3))
    };
    let (text, strength) = match graph.node(id) {
        Node::Constant(bits) => {
            let value = f64::from_bits(bits);
            (format!("{value}"), if value < 0.0 { 0 } else { 3 })
        }
        Node::Leaf(own) => (leaf(own), 3),
        Node::Unary(Unary::Negate, a) => (format!("-{}", bound(a, 2)?), 1),
        Node::Unary(op, a) => call(&format!("{op:?}").to_lowercase(), &[a])?,
        Node::Binary(Binary::Add, a, b) => (format!("{} + {}", bound(a, 0)?, bound(b, 0)?), 0),
        Node::Binary(Binary::Subtract, a, b) => (format!("{} - {}", bound(a, 0)?, bound(b, 1)?), 0),
        Node::Binary(Binary::Multiply, a, b) => (format!("{}*{}", bound(a, 1)?, bound(b, 1)?), 1),
        Node::Binary(Binary::Divide, a, b) => (format!("{}/{}", bound(a, 1)?, bound(b, 2)?), 1),
        Node::Binary(Binary::Power, a, b) => (format!("{}^{}", bound(a, 3)?, bound(b, 3)?), 2),
        Node::Binary(op, a, b) => call(&format!("{op:?}").to_lowercase(), &[a, b])?,
        Node::Integer(a, n) => (format!("{}^{n}", bound(a, 3)?), 2),
        Node::Select(..) => return None,
    };
    (text.chars().count() <= LONGEST).then_some((text, strength))
}

#[cfg(test)]
mod tests {
    use crate::contract::VectorField;
    use crate::model::{Definition, Model, ModelSource, Parameter, State};

    #[test]
    fn switches_are_named_by_their_expressions() {
        let cases = [
            ("max(x - p, 0)", "x - p"),
            ("if(hypot(x, y) > 1, x, 0)", "1 - hypot(x, y)"),
            ("abs(x*(y - p))", "x*(y - p)"),
            ("sign(x^2 - 3)", "x^2 - 3"),
        ];
        for (equation, name) in cases {
            let source = ModelSource {
                parameters: vec![Parameter::new("p", 0.5)],
                states: vec![State::new("x"), State::new("y")],
                equations: vec![Definition::new("x", equation), Definition::new("y", "-x")],
                ..ModelSource::default()
            };
            assert_eq!(Model::compile(source).unwrap().switch_name(0), name, "{equation}");
        }
    }
}
