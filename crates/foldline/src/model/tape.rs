//! Translation of a graph to a tape: straight-line instructions over registers.
//!
//! **Idea.** The nodes that the results depend on are ordered depth first, in the order of the results, and each gets a
//! register, which is reused once its value is no longer needed. If all lanes share their parameters, values that
//! depend on parameters alone are computed once per batch, as plain numbers. A product used by only one sum is merged
//! with it into one instruction, still rounded twice. The tape is executed in `run`.

use super::graph::{Binary, Graph, Id, Leaf, Node, Unary};
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};

/// Number of a register, which holds a value per lane.
pub(super) type Register = u32;

/// Number of a scalar, which all lanes share.
pub(super) type Scalar = u32;

/// One instruction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Instruction {
    Load {
        to: Register,
        from: Leaf,
    },
    Unary {
        op: Unary,
        to: Register,
        a: Register,
    },
    Binary {
        op: Binary,
        to: Register,
        a: Register,
        b: Register,
    },
    /// The second operand is a scalar; for operations that [`takes_scalars`] accepts, as in `Left`.
    Right {
        op: Binary,
        to: Register,
        a: Register,
        s: Scalar,
    },
    /// The first operand is a scalar.
    Left {
        op: Binary,
        to: Register,
        s: Scalar,
        b: Register,
    },
    /// Product of a and b in a sum with c.
    Fused {
        sum: Sum,
        to: Register,
        a: Register,
        b: Register,
        c: Register,
    },
    /// Product of a and a scalar in a sum with c.
    Scaled {
        sum: Sum,
        to: Register,
        a: Register,
        s: Scalar,
        c: Register,
    },
    /// Successive products in a sum that begins with c: `count` of [`Code::terms`] from `first` on.
    Terms {
        to: Register,
        c: Register,
        first: u32,
        count: u32,
    },
    Integer {
        to: Register,
        a: Register,
        n: i32,
    },
    Select {
        to: Register,
        c: Register,
        a: Register,
        b: Register,
    },
    Store {
        from: Register,
        place: Place,
    },
}

/// Product in a sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Term {
    /// Product of a and b.
    Product { sum: Sum, a: Register, b: Register },
    /// Product of a and a scalar.
    Scaled { sum: Sum, a: Register, s: Scalar },
}

/// Way in which a product p and another operand c form a sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sum {
    /// p + c
    Plus,
    /// p - c
    Minus,
    /// c - p
    From,
}

/// Destination of a result: array and component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub array: u32,
    pub component: u32,
}

/// Instructions that compute a set of results.
#[derive(Clone, Debug)]
pub(super) struct Tape {
    /// For lanes that share their parameters.
    pub shared: Code,
    /// For lanes with parameters of their own.
    pub own: Code,
}

/// Instructions for shared or for per-lane parameters.
#[derive(Clone, Debug, Default)]
pub(super) struct Code {
    /// Unique number of this code; never 0.
    pub number: u64,
    /// Number of registers used.
    pub registers: usize,
    /// Scalars in order of computation; an operand is the number of an earlier one.
    pub scalars: Vec<Node>,
    /// Registers that hold a scalar, for instructions without scalar operands.
    pub filled: Vec<(Register, Scalar)>,
    /// Results that are scalars.
    pub uniform: Vec<(Scalar, Place)>,
    /// Instructions for values that differ between lanes.
    pub body: Vec<Instruction>,
    /// Products of [`Instruction::Terms`].
    pub terms: Vec<Term>,
}

/// True if an operation has the forms [`Instruction::Right`] and [`Instruction::Left`].
pub(super) fn takes_scalars(op: Binary) -> bool {
    use Binary::{Add, Divide, Less, LessOrEqual, Max, Min, Multiply, Subtract};
    matches!(op, Add | Subtract | Multiply | Divide | Less | LessOrEqual | Min | Max)
}

impl Tape {
    /// Tape for `results`: one list per array, components in order.
    pub fn new(graph: &Graph, results: &[&[Id]]) -> Tape {
        Tape { shared: Code::new(graph, results, true), own: Code::new(graph, results, false) }
    }
}

impl Code {
    fn new(graph: &Graph, results: &[&[Id]], shared: bool) -> Code {
        let varying = varying(graph, shared);
        let roots: Vec<Id> = results.iter().flat_map(|list| list.iter().copied()).collect();
        let fusions = fusions(graph, &varying, &roots);
        let mut order =
            Order { graph, varying: &varying, fusions: &fusions, done: vec![false; graph.len()], steps: vec![] };
        let mut builder = Builder {
            graph,
            varying: &varying,
            fusions: &fusions,
            code: Code::default(),
            scalars: HashMap::new(),
            registers: HashMap::new(),
            free: Vec::new(),
        };
        // Store each result as soon as it is known.
        for (array, list) in results.iter().enumerate() {
            for (component, &id) in list.iter().enumerate() {
                let place = Place { array: array as u32, component: component as u32 };
                if varying[id.at()] {
                    order.visit(id);
                    order.steps.push(Step::Store(id, place));
                } else {
                    let scalar = builder.scalar(id);
                    builder.code.uniform.push((scalar, place));
                }
            }
        }
        let steps = order.steps;
        builder.fill(&steps);
        builder.body(&steps);
        static MADE: AtomicU64 = AtomicU64::new(1);
        Code { number: MADE.fetch_add(1, Ordering::Relaxed), ..builder.code }
    }
}

#[derive(Clone, Copy)]
enum Step {
    Compute(Id),
    Store(Id, Place),
}

/// Maximum number of products in one sum: the sums for four groups of eight lanes fill half of sixteen vector
/// registers, and every operand needs a register until the last product has been added.
const MOST_TERMS: usize = 4;

/// Chain of sums with products that nothing else uses: each adds to its predecessor, the first to c.
#[derive(Clone)]
struct Fusion {
    c: Id,
    terms: Vec<(Sum, [Id; 2])>,
}

/// Marks the nodes that differ between lanes.
fn varying(graph: &Graph, shared: bool) -> Vec<bool> {
    let mut varying: Vec<bool> = Vec::with_capacity(graph.len());
    for i in 0..graph.len() {
        let node = graph.node(Id(i as u32));
        varying.push(match node {
            Node::Leaf(Leaf::Parameter(_)) => !shared,
            Node::Leaf(_) => true,
            _ => node.operands().any(|a| varying[a.at()]),
        });
    }
    varying
}

/// Fusions, keyed by the node of the sum.
fn fusions(graph: &Graph, varying: &[bool], roots: &[Id]) -> HashMap<Id, Fusion> {
    let reached = graph.reachable(roots);
    let mut uses = vec![0; graph.len()];
    roots.iter().for_each(|root| uses[root.at()] += 1);
    for i in (0..graph.len()).filter(|&i| reached[i]) {
        graph.node(Id(i as u32)).operands().for_each(|a| uses[a.at()] += 1);
    }
    let factors = |id: Id| match graph.node(id) {
        _ if uses[id.at()] != 1 || !varying[id.at()] => None,
        Node::Binary(Binary::Multiply, a, b) if varying[a.at()] => Some((a, b)),
        Node::Binary(Binary::Multiply, a, b) => Some((b, a)),
        Node::Integer(a, 2) => Some((a, a)),
        _ => None,
    };
    let fusion = |id: Id| {
        let (x, y, second) = match graph.node(id) {
            Node::Binary(Binary::Add, x, y) => (x, y, Sum::Plus),
            Node::Binary(Binary::Subtract, x, y) => (x, y, Sum::From),
            _ => return None,
        };
        let first = if second == Sum::Plus { Sum::Plus } else { Sum::Minus };
        match (factors(x), factors(y)) {
            (_, Some((a, b))) if varying[x.at()] => Some((x, (second, [a, b]))),
            (Some((a, b)), _) if varying[y.at()] => Some((y, (first, [a, b]))),
            _ => None,
        }
    };
    let mut found: HashMap<Id, Fusion> = HashMap::new();
    // Operands have smaller numbers than the nodes that use them.
    for id in (0..graph.len() as u32).map(Id).filter(|id| reached[id.at()]) {
        let Some((c, term)) = fusion(id) else { continue };
        let before = if uses[c.at()] == 1 { found.remove(&c) } else { None };
        let own = match before {
            Some(Fusion { c, terms }) if terms.len() < MOST_TERMS => {
                Fusion { c, terms: [&terms[..], &[term]].concat() }
            }
            Some(full) => {
                found.insert(c, full);
                Fusion { c, terms: vec![term] }
            }
            None => Fusion { c, terms: vec![term] },
        };
        found.insert(id, own);
    }
    found
}

/// Varying operands of a node; those of its fusion, if it has one.
fn operands(graph: &Graph, varying: &[bool], fusions: &HashMap<Id, Fusion>, id: Id) -> impl Iterator<Item = Id> {
    let list: Vec<Id> = match fusions.get(&id) {
        Some(Fusion { c, terms }) => terms.iter().flat_map(|(_, factors)| *factors).chain([*c]).collect(),
        None => graph.node(id).operands().collect(),
    };
    list.into_iter().filter(|id| varying[id.at()])
}

/// Depth-first order without recursion.
struct Order<'a> {
    graph: &'a Graph,
    varying: &'a [bool],
    fusions: &'a HashMap<Id, Fusion>,
    done: Vec<bool>,
    steps: Vec<Step>,
}

impl Order<'_> {
    /// Appends `root` and everything it needs, as far as it varies and is not in the order yet.
    fn visit(&mut self, root: Id) {
        let mut stack = vec![(root, false)];
        while let Some((id, ready)) = stack.pop() {
            if self.done[id.at()] {
                continue;
            }
            if ready {
                self.done[id.at()] = true;
                self.steps.push(Step::Compute(id));
            } else {
                stack.push((id, true));
                stack.extend(operands(self.graph, self.varying, self.fusions, id).map(|a| (a, false)));
            }
        }
    }
}

/// Allocates registers and scalars.
struct Builder<'a> {
    graph: &'a Graph,
    varying: &'a [bool],
    fusions: &'a HashMap<Id, Fusion>,
    code: Code,
    scalars: HashMap<Id, Scalar>,
    registers: HashMap<Id, Register>,
    free: Vec<Register>,
}

impl Builder<'_> {
    fn fresh(&mut self) -> Register {
        self.free.pop().unwrap_or_else(|| {
            self.code.registers += 1;
            self.code.registers as Register - 1
        })
    }

    /// Number of a value that all lanes share; its operands are computed before it.
    fn scalar(&mut self, root: Id) -> Scalar {
        let mut stack = vec![(root, false)];
        while let Some((id, ready)) = stack.pop() {
            if self.scalars.contains_key(&id) {
                continue;
            }
            if ready {
                let node = self.graph.node(id).renamed(|a| Id(self.scalars[&a]));
                self.scalars.insert(id, self.code.scalars.len() as Scalar);
                self.code.scalars.push(node);
            } else {
                stack.push((id, true));
                stack.extend(self.graph.node(id).operands().map(|a| (a, false)));
            }
        }
        self.scalars[&root]
    }

    /// Loads scalars into registers for instructions that need them there.
    fn fill(&mut self, steps: &[Step]) {
        for step in steps {
            let Step::Compute(id) = *step else { continue };
            let node = self.graph.node(id);
            if matches!(node, Node::Binary(op, ..) if takes_scalars(op)) {
                continue;
            }
            for operand in node.operands().filter(|a| !self.varying[a.at()]) {
                if !self.registers.contains_key(&operand) {
                    let (scalar, register) = (self.scalar(operand), self.fresh());
                    self.registers.insert(operand, register);
                    self.code.filled.push((register, scalar));
                }
            }
        }
    }

    fn operands(&self, step: Step) -> Vec<Id> {
        let mut list: Vec<Id> = match step {
            Step::Compute(id) => operands(self.graph, self.varying, self.fusions, id).collect(),
            Step::Store(id, _) => vec![id],
        };
        list.sort();
        list.dedup();
        list
    }

    /// Emits instructions for the steps.
    fn body(&mut self, steps: &[Step]) {
        let mut last: HashMap<Id, usize> = HashMap::new();
        for (i, step) in steps.iter().enumerate() {
            last.extend(self.operands(*step).into_iter().map(|id| (id, i)));
        }
        for (i, step) in steps.iter().enumerate() {
            // Instructions read their operands before they write, so a target may be the register of an operand.
            let finished = self.operands(*step).into_iter().filter(|id| last.get(id) == Some(&i));
            let finished: Vec<Register> = finished.map(|id| self.registers[&id]).collect();
            match *step {
                Step::Store(id, place) => {
                    self.code.body.push(Instruction::Store { from: self.registers[&id], place });
                    self.free.extend(finished);
                }
                Step::Compute(id) => {
                    self.free.extend(finished);
                    let to = self.fresh();
                    let instruction = self.instruction(id, to);
                    self.code.body.push(instruction);
                    self.registers.insert(id, to);
                }
            }
        }
    }

    /// Instruction for products in sums that begin with c.
    fn sum(&mut self, to: Register, c: Id, terms: &[(Sum, [Id; 2])]) -> Instruction {
        let c = self.registers[&c];
        let mut own = Vec::with_capacity(terms.len());
        for &(sum, [a, b]) in terms {
            let register = self.registers[&a];
            own.push(match self.varying[b.at()] {
                true => Term::Product { sum, a: register, b: self.registers[&b] },
                false => Term::Scaled { sum, a: register, s: self.scalar(b) },
            });
        }
        match own[..] {
            [Term::Product { sum, a, b }] => Instruction::Fused { sum, to, a, b, c },
            [Term::Scaled { sum, a, s }] => Instruction::Scaled { sum, to, a, s, c },
            _ => {
                let (first, count) = (self.code.terms.len() as u32, own.len() as u32);
                self.code.terms.append(&mut own);
                Instruction::Terms { to, c, first, count }
            }
        }
    }

    fn instruction(&mut self, id: Id, to: Register) -> Instruction {
        if let Some(Fusion { c, terms }) = self.fusions.get(&id) {
            return self.sum(to, *c, terms);
        }
        let varies = |id: Id| self.varying[id.at()];
        let at = |id: Id| self.registers[&id];
        match self.graph.node(id) {
            Node::Constant(_) => unreachable!("constants do not vary"),
            Node::Leaf(from) => Instruction::Load { to, from },
            Node::Unary(op, a) => Instruction::Unary { op, to, a: at(a) },
            Node::Binary(op, a, b) if takes_scalars(op) && !varies(b) => {
                Instruction::Right { op, to, a: at(a), s: self.scalar(b) }
            }
            Node::Binary(op, a, b) if takes_scalars(op) && !varies(a) => {
                Instruction::Left { op, to, b: at(b), s: self.scalar(a) }
            }
            Node::Binary(op, a, b) => Instruction::Binary { op, to, a: at(a), b: at(b) },
            Node::Integer(a, n) => Instruction::Integer { to, a: at(a), n },
            Node::Select(c, a, b) => Instruction::Select { to, c: at(c), a: at(a), b: at(b) },
        }
    }
}
