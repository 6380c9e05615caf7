//! From graph to tape: a straight list of instructions over registers.
//!
//! **Idea.** The nodes that the results depend on are put in order, results first come first served, and each gets a
//! register; a register is used again once its value is no longer needed. What depends on parameters alone goes to a prologue,
//! which runs once per batch where all lanes share their parameters. Running the tape is in `run`.

use super::graph::{Binary, Graph, Id, Leaf, Node, Unary};
use std::collections::{HashMap, HashSet};

/// Number of a register.
pub(super) type Register = u32;

/// One step. The target is never also an operand, and the two operands of a binary step differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Instruction {
    Load { to: Register, from: Leaf },
    Unary { op: Unary, to: Register, a: Register },
    Binary { op: Binary, to: Register, a: Register, b: Register },
    Integer { to: Register, a: Register, n: i32 },
    Select { to: Register, c: Register, a: Register, b: Register },
    Store { from: Register, place: Place },
}

/// Where a result goes: which array, which component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub array: u32,
    pub component: u32,
}

/// Instructions that compute a set of results.
#[derive(Clone, Debug, Default)]
pub(super) struct Tape {
    /// How many registers are used.
    pub registers: usize,
    /// Registers that hold numbers.
    pub constants: Vec<(Register, f64)>,
    /// What depends on parameters only.
    pub prologue: Vec<Instruction>,
    /// Results that depend on parameters only.
    pub uniform: Vec<(Register, Place)>,
    /// What differs from lane to lane.
    pub body: Vec<Instruction>,
}

/// Whether a value is the same in all lanes that share their parameters.
#[derive(Clone, Copy, PartialEq)]
enum Extent {
    Constant,
    Uniform,
    Varying,
}

impl Tape {
    /// The tape for `results`: one list per array, components in order.
    pub fn new(graph: &Graph, results: &[&[Id]]) -> Tape {
        let roots: Vec<Id> = results.iter().flat_map(|list| list.iter().copied()).collect();
        let reached = graph.reachable(&roots);
        let extent = extents(graph);
        let uniform = |id: &Id| extent[id.at()] == Extent::Uniform;
        let mut order = Order { graph, extent: &extent, done: vec![false; graph.len()], steps: Vec::new() };

        // Prologue: every uniform value that a varying one or a result asks for.
        let varying = (0..graph.len()).filter(|&i| reached[i] && extent[i] == Extent::Varying);
        let mut kept: HashSet<Id> = varying.flat_map(|i| graph.node(Id(i as u32)).operands()).filter(uniform).collect();
        kept.extend(roots.iter().copied().filter(uniform));
        let mut wanted: Vec<Id> = kept.iter().copied().collect();
        wanted.sort();
        wanted.iter().for_each(|&id| order.visit(id));
        let prologue = std::mem::take(&mut order.steps);

        // Body: each result is stored as soon as it is known.
        let mut settled: Vec<(Id, Place)> = Vec::new();
        for (array, list) in results.iter().enumerate() {
            for (component, &id) in list.iter().enumerate() {
                let place = Place { array: array as u32, component: component as u32 };
                if extent[id.at()] == Extent::Varying {
                    order.visit(id);
                    order.steps.push(Step::Store(id, place));
                } else {
                    settled.push((id, place));
                }
            }
        }
        let body = order.steps;

        let mut builder = Builder { graph, tape: Tape::default(), registers: HashMap::new(), free: Vec::new() };
        let operands = prologue.iter().chain(&body).flat_map(|step| step.operands(graph));
        for id in operands.chain(settled.iter().map(|s| s.0)).filter(|id| extent[id.at()] == Extent::Constant) {
            builder.constant(id);
        }
        builder.tape.prologue = builder.section(&prologue, &kept);
        builder.tape.uniform = settled.into_iter().map(|(id, place)| (builder.registers[&id], place)).collect();
        builder.tape.body = builder.section(&body, &HashSet::new());
        builder.tape
    }
}

#[derive(Clone, Copy)]
enum Step {
    Compute(Id),
    Store(Id, Place),
}

impl Step {
    fn operands(self, graph: &Graph) -> impl Iterator<Item = Id> {
        let (computed, stored) = match self {
            Step::Compute(id) => (Some(id), None),
            Step::Store(id, _) => (None, Some(id)),
        };
        computed.map(|id| graph.node(id).operands()).into_iter().flatten().chain(stored)
    }
}

fn extents(graph: &Graph) -> Vec<Extent> {
    let mut extent: Vec<Extent> = Vec::with_capacity(graph.len());
    for i in 0..graph.len() {
        let node = graph.node(Id(i as u32));
        extent.push(match node {
            Node::Constant(_) => Extent::Constant,
            Node::Leaf(Leaf::Parameter(_)) => Extent::Uniform,
            Node::Leaf(_) => Extent::Varying,
            _ if node.operands().any(|a| extent[a.at()] == Extent::Varying) => Extent::Varying,
            _ => Extent::Uniform,
        });
    }
    extent
}

/// Depth-first order without recursion.
struct Order<'a> {
    graph: &'a Graph,
    extent: &'a [Extent],
    done: Vec<bool>,
    steps: Vec<Step>,
}

impl Order<'_> {
    /// Appends what `root` needs and `root` itself, as far as it is of the same extent and not in the order yet.
    fn visit(&mut self, root: Id) {
        let (graph, extent) = (self.graph, self.extent);
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
                let same = |a: &Id| extent[a.at()] == extent[root.at()];
                stack.extend(graph.node(id).operands().filter(same).map(|a| (a, false)));
            }
        }
    }
}

/// Hands out registers.
struct Builder<'a> {
    graph: &'a Graph,
    tape: Tape,
    registers: HashMap<Id, Register>,
    free: Vec<Register>,
}

impl Builder<'_> {
    fn fresh(&mut self) -> Register {
        self.free.pop().unwrap_or_else(|| {
            self.tape.registers += 1;
            self.tape.registers as Register - 1
        })
    }

    fn constant(&mut self, id: Id) {
        if let (Some(value), false) = (self.graph.value(id), self.registers.contains_key(&id)) {
            let register = self.fresh();
            self.registers.insert(id, register);
            self.tape.constants.push((register, value));
        }
    }

    /// Instructions for the steps. Registers of values in `kept`, and of values from before, are not given to others.
    fn section(&mut self, steps: &[Step], kept: &HashSet<Id>) -> Vec<Instruction> {
        let mut last: HashMap<Id, usize> = HashMap::new();
        for (i, step) in steps.iter().enumerate() {
            if let Step::Compute(id) = step {
                last.insert(*id, i);
            }
            for operand in step.operands(self.graph) {
                if let Some(at) = last.get_mut(&operand) {
                    *at = i;
                }
            }
        }
        let mut instructions = Vec::with_capacity(steps.len());
        for (i, step) in steps.iter().enumerate() {
            match *step {
                Step::Store(id, place) => instructions.push(Instruction::Store { from: self.registers[&id], place }),
                Step::Compute(id) => {
                    // The target is taken before the operands are given back, so it is none of them.
                    let to = self.fresh();
                    self.compute(id, to, &mut instructions);
                    self.registers.insert(id, to);
                }
            }
            let mut finished: Vec<Id> = step.operands(self.graph).collect();
            finished.sort();
            finished.dedup();
            for id in finished.into_iter().filter(|id| last.get(id) == Some(&i) && !kept.contains(id)) {
                self.free.push(self.registers[&id]);
            }
        }
        instructions
    }

    fn compute(&mut self, id: Id, to: Register, instructions: &mut Vec<Instruction>) {
        let node = self.graph.node(id);
        // An operand that is used twice is read from a copy the second time: registers of one instruction all differ.
        let mut copies = Vec::new();
        let mut operands: Vec<Register> = Vec::new();
        for operand in node.operands() {
            let mut register = self.registers[&operand];
            if operands.contains(&register) {
                let copy = self.fresh();
                instructions.push(Instruction::Integer { to: copy, a: register, n: 1 });
                copies.push(copy);
                register = copy;
            }
            operands.push(register);
        }
        instructions.push(match (node, operands.as_slice()) {
            (Node::Leaf(from), _) => Instruction::Load { to, from },
            (Node::Unary(op, _), &[a]) => Instruction::Unary { op, to, a },
            (Node::Binary(op, ..), &[a, b]) => Instruction::Binary { op, to, a, b },
            (Node::Integer(_, n), &[a]) => Instruction::Integer { to, a, n },
            (Node::Select(..), &[c, a, b]) => Instruction::Select { to, c, a, b },
            _ => unreachable!("constants are no steps, and every node has its own number of operands"),
        });
        self.free.append(&mut copies);
    }
}
