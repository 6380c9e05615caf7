//! Running a tape over the lanes of a batch.
//!
//! **Idea.** Lanes are taken in blocks of 32 (8 for a short rest), so that one instruction is looked up once and then runs as
//! a loop of fixed length, which the compiler turns into vector instructions; the widest set that the machine has is chosen
//! when the program runs. Registers live in a per-thread store that grows to the largest tape and is then reused.

use super::graph::{Binary, Leaf, Unary};
use super::kernels;
use super::tape::{Instruction, Place, Tape};
use crate::contract::{Batch, Parameters};
use std::cell::RefCell;

/// Eight lanes, in one cache line.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Eight([f64; 8]);

/// Blocks of eight lanes per register.
const WIDE: usize = 4;

/// A value for up to 32 lanes.
type Lanes = [Eight; WIDE];

thread_local! {
    static REGISTERS: RefCell<Vec<Lanes>> = const { RefCell::new(Vec::new()) };
}

/// What a tape reads.
#[derive(Clone, Copy)]
struct Inputs<'a> {
    at: Batch<'a>,
    directions: &'a [&'a [f64]],
    /// First lane of the block.
    first: usize,
    /// How many lanes of the block exist.
    live: usize,
}

impl Tape {
    /// Runs the tape for all lanes and writes the results to `arrays`.
    pub fn run(&self, at: Batch, directions: &[&[f64]], arrays: &mut [&mut [f64]]) {
        REGISTERS.with_borrow_mut(|registers| {
            if registers.len() < self.registers {
                registers.resize(self.registers, [Eight([0.0; 8]); WIDE]);
            }
            pulp::Arch::new().dispatch(Run { tape: self, at, directions, arrays, registers });
        });
    }
}

/// One run, handed to the dispatcher of instruction sets.
struct Run<'a, 'b, 'c> {
    tape: &'a Tape,
    at: Batch<'a>,
    directions: &'a [&'a [f64]],
    arrays: &'b mut [&'c mut [f64]],
    registers: &'b mut [Lanes],
}

impl pulp::NullaryFnOnce for Run<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        // A few lanes need only the first block of each register; two narrow blocks cost less than a wide one that is half empty.
        match self.at.lanes {
            0 => {}
            1..=16 => self.run::<1>(),
            _ => self.run::<WIDE>(),
        }
    }
}

impl Run<'_, '_, '_> {
    /// Runs the tape in blocks of 8 W lanes, and a short rest in blocks of 8.
    #[inline(always)]
    fn run<const W: usize>(self) {
        let Run { tape, at, directions, arrays, registers } = self;
        let lanes = at.lanes;
        let inputs = |first: usize, width: usize| Inputs { at, directions, first, live: width.min(lanes - first) };
        for &(register, value) in &tape.constants {
            registers[register as usize][..W].fill(Eight([value; 8]));
        }
        let shared = matches!(at.parameters, Parameters::Shared(_));
        if shared {
            section::<W>(&tape.prologue, registers, inputs(0, 8 * W), arrays);
            for &(register, place) in &tape.uniform {
                let value = registers[register as usize][0].0[0];
                component(arrays, place, lanes).fill(value);
            }
        }
        let mut first = 0;
        while first < lanes {
            let wide = lanes - first > 16;
            let width = if wide { 8 * W } else { 8 };
            let inputs = inputs(first, width);
            if !shared {
                match wide {
                    true => section::<W>(&tape.prologue, registers, inputs, arrays),
                    false => section::<1>(&tape.prologue, registers, inputs, arrays),
                }
                for &(register, place) in &tape.uniform {
                    store(&registers[register as usize], place, inputs, arrays);
                }
            }
            match wide {
                true => section::<W>(&tape.body, registers, inputs, arrays),
                false => section::<1>(&tape.body, registers, inputs, arrays),
            }
            first += width;
        }
    }
}

/// The lanes of one component of a result.
#[inline(always)]
fn component<'a>(arrays: &'a mut [&mut [f64]], place: Place, lanes: usize) -> &'a mut [f64] {
    let start = place.component as usize * lanes;
    &mut arrays[place.array as usize][start..start + lanes]
}

#[inline(always)]
fn store(value: &Lanes, place: Place, inputs: Inputs, arrays: &mut [&mut [f64]]) {
    let target = &mut component(arrays, place, inputs.at.lanes)[inputs.first..inputs.first + inputs.live];
    for (chunk, eight) in target.chunks_mut(8).zip(value) {
        if let Ok(full) = <&mut [f64; 8]>::try_from(&mut *chunk) {
            *full = eight.0;
        } else {
            chunk.copy_from_slice(&eight.0[..chunk.len()]);
        }
    }
}

/// Copies the lanes of the block; lanes that do not exist repeat the last one.
#[inline(always)]
fn load<const W: usize>(to: &mut Lanes, source: &[f64], index: u32, inputs: Inputs) {
    let start = index as usize * inputs.at.lanes + inputs.first;
    let source = &source[start..start + inputs.live];
    let last = source[inputs.live - 1];
    for w in 0..W {
        let rest = source.get(8 * w..).unwrap_or(&[]);
        if let Some(full) = rest.first_chunk::<8>() {
            to[w].0 = *full;
        } else {
            for l in 0..8 {
                to[w].0[l] = rest.get(l).copied().unwrap_or(last);
            }
        }
    }
}

#[inline(always)]
fn map<const W: usize>(to: &mut Lanes, a: &Lanes, f: impl Fn(f64) -> f64) {
    for w in 0..W {
        for l in 0..8 {
            to[w].0[l] = f(a[w].0[l]);
        }
    }
}

/// Like [`map`], for functions that are evaluated lane by lane anyway: only for lanes that exist.
#[inline(always)]
fn map_live<const W: usize>(to: &mut Lanes, a: &Lanes, live: usize, f: impl Fn(f64) -> f64) {
    for w in 0..W {
        for l in 0..8usize.min(live.saturating_sub(8 * w)) {
            to[w].0[l] = f(a[w].0[l]);
        }
    }
}

#[inline(always)]
fn zip<const W: usize>(to: &mut Lanes, a: &Lanes, b: &Lanes, f: impl Fn(f64, f64) -> f64) {
    for w in 0..W {
        for l in 0..8 {
            to[w].0[l] = f(a[w].0[l], b[w].0[l]);
        }
    }
}

#[inline(always)]
fn zip_live<const W: usize>(to: &mut Lanes, a: &Lanes, b: &Lanes, live: usize, f: impl Fn(f64, f64) -> f64) {
    for w in 0..W {
        for l in 0..8usize.min(live.saturating_sub(8 * w)) {
            to[w].0[l] = f(a[w].0[l], b[w].0[l]);
        }
    }
}

/// Runs instructions for the first W blocks of the registers.
#[inline(always)]
fn section<const W: usize>(
    instructions: &[Instruction],
    registers: &mut [Lanes],
    inputs: Inputs,
    arrays: &mut [&mut [f64]],
) {
    for &instruction in instructions {
        match instruction {
            Instruction::Load { to, from } => {
                let to = &mut registers[to as usize];
                match (from, inputs.at.parameters) {
                    (Leaf::State(i), _) => load::<W>(to, inputs.at.states, i, inputs),
                    (Leaf::Direction(d, i), _) => load::<W>(to, inputs.directions[d as usize], i, inputs),
                    (Leaf::Parameter(k), Parameters::PerLane(values)) => load::<W>(to, values, k, inputs),
                    (Leaf::Parameter(k), Parameters::Shared(values)) => to[..W].fill(Eight([values[k as usize]; 8])),
                }
            }
            Instruction::Unary { op, to, a } => {
                if let Ok([to, a]) = registers.get_disjoint_mut([to as usize, a as usize]) {
                    unary::<W>(op, to, a, inputs.live);
                }
            }
            Instruction::Binary { op, to, a, b } => {
                if let Ok([to, a, b]) = registers.get_disjoint_mut([to as usize, a as usize, b as usize]) {
                    binary::<W>(op, to, a, b, inputs.live);
                }
            }
            Instruction::Integer { to, a, n } => {
                if let Ok([to, a]) = registers.get_disjoint_mut([to as usize, a as usize]) {
                    match n {
                        2 => map::<W>(to, a, |x| kernels::power(x, 2)),
                        3 => map::<W>(to, a, |x| kernels::power(x, 3)),
                        4 => map::<W>(to, a, |x| kernels::power(x, 4)),
                        _ => map::<W>(to, a, |x| kernels::power(x, n)),
                    }
                }
            }
            Instruction::Select { to, c, a, b } => {
                let places = [to as usize, c as usize, a as usize, b as usize];
                if let Ok([to, c, a, b]) = registers.get_disjoint_mut(places) {
                    for w in 0..W {
                        for l in 0..8 {
                            to[w].0[l] = if c[w].0[l] != 0.0 { a[w].0[l] } else { b[w].0[l] };
                        }
                    }
                }
            }
            Instruction::Store { from, place } => store(&registers[from as usize], place, inputs, arrays),
        }
    }
}

#[inline(always)]
fn unary<const W: usize>(op: Unary, to: &mut Lanes, a: &Lanes, live: usize) {
    match op {
        Unary::Negate => map::<W>(to, a, |x| Unary::Negate.of(x)),
        Unary::Sqrt => map::<W>(to, a, |x| Unary::Sqrt.of(x)),
        Unary::Exp => map::<W>(to, a, |x| Unary::Exp.of(x)),
        Unary::Tanh => map::<W>(to, a, |x| Unary::Tanh.of(x)),
        Unary::SechSquared => map::<W>(to, a, |x| Unary::SechSquared.of(x)),
        Unary::Abs => map::<W>(to, a, |x| Unary::Abs.of(x)),
        Unary::Sign => map::<W>(to, a, |x| Unary::Sign.of(x)),
        Unary::Heaviside => map::<W>(to, a, |x| Unary::Heaviside.of(x)),
        _ => map_live::<W>(to, a, live, |x| op.of(x)),
    }
}

#[inline(always)]
fn binary<const W: usize>(op: Binary, to: &mut Lanes, a: &Lanes, b: &Lanes, live: usize) {
    match op {
        Binary::Add => zip::<W>(to, a, b, |x, y| x + y),
        Binary::Subtract => zip::<W>(to, a, b, |x, y| x - y),
        Binary::Multiply => zip::<W>(to, a, b, |x, y| x * y),
        Binary::Divide => zip::<W>(to, a, b, |x, y| x / y),
        Binary::Min => zip::<W>(to, a, b, |x, y| Binary::Min.of(x, y)),
        Binary::Max => zip::<W>(to, a, b, |x, y| Binary::Max.of(x, y)),
        Binary::Hypot => zip::<W>(to, a, b, |x, y| Binary::Hypot.of(x, y)),
        Binary::Less => zip::<W>(to, a, b, |x, y| Binary::Less.of(x, y)),
        Binary::LessOrEqual => zip::<W>(to, a, b, |x, y| Binary::LessOrEqual.of(x, y)),
        Binary::Equal => zip::<W>(to, a, b, |x, y| Binary::Equal.of(x, y)),
        Binary::NotEqual => zip::<W>(to, a, b, |x, y| Binary::NotEqual.of(x, y)),
        Binary::Power | Binary::Atan2 => zip_live::<W>(to, a, b, live, |x, y| op.of(x, y)),
    }
}
