//! Execution of a tape over the lanes of a batch.
//!
//! **Idea.** Lanes are taken 64 or 32 at a time (16 or 8 for a short remainder). Each instruction is decoded once and
//! then runs as a loop of fixed length, which the compiler turns into vector instructions; the widest instruction set
//! of the machine is chosen at run time. Values common to all lanes are computed once, as plain numbers, and reused
//! while one tape runs at unchanged parameters. Registers live in a per-thread store that grows to the largest tape and
//! is then reused; they are cells, so an instruction may write where it reads.

use super::graph::{Binary, Leaf, Unary};
use super::kernels;
use super::tape::{Code, Instruction, Place, Sum, Tape, Term};
use crate::contract::{Batch, Parameters};
use crate::linalg::lane::{Eight, Lane as _};
use std::cell::{Cell, RefCell};

/// Groups of eight lanes taken at a time, …
const FEW: usize = 4;
/// … if the registers then fill at most [`IN_CACHE`] f64x8, a good part of the first-level cache, …
const MANY: usize = 8;
const IN_CACHE: usize = 256;
/// … or for a short remainder; a single group is the smallest.
const PAIR: usize = 2;

/// Value for the lanes taken together.
type Lanes<const W: usize> = [Cell<Eight>; W];

#[derive(Default)]
struct Store {
    registers: Vec<Eight>,
    scalars: Vec<f64>,
    /// Code and parameters to which the scalars belong.
    code: u64,
    parameters: Vec<f64>,
}

thread_local! {
    static STORE: RefCell<Store> = const {
        RefCell::new(Store { registers: Vec::new(), scalars: Vec::new(), code: 0, parameters: Vec::new() })
    };
}

/// Inputs of a tape.
#[derive(Clone, Copy)]
struct Inputs<'a> {
    at: Batch<'a>,
    directions: &'a [&'a [f64]],
    scalars: &'a [f64],
    /// First of the lanes taken together.
    first: usize,
    /// Number of those lanes that exist.
    live: usize,
}

impl Tape {
    /// Runs the tape for all lanes and writes the results to `arrays`.
    pub fn run(&self, at: Batch, directions: &[&[f64]], arrays: &mut [&mut [f64]]) {
        let (code, parameters): (&Code, &[f64]) = match at.parameters {
            Parameters::Shared(values) => (&self.shared, values),
            Parameters::PerLane(_) => (&self.own, &[]),
        };
        STORE.with_borrow_mut(|Store { registers, scalars, code: last, parameters: known }| {
            let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
            let unchanged = known.len() == parameters.len() && known.iter().zip(parameters).all(same);
            if *last != code.number || !unchanged {
                scalars.clear();
                for node in &code.scalars {
                    scalars.push(node.value(|id| scalars[id.at()], parameters));
                }
                *last = code.number;
                known.clear();
                known.extend_from_slice(parameters);
            }
            for &(scalar, place) in &code.uniform {
                component(arrays, place, at.lanes).fill(scalars[scalar as usize]);
            }
            if code.body.is_empty() || at.lanes == 0 {
                return;
            }
            if registers.len() < code.registers * MANY {
                registers.resize(code.registers * MANY, Eight([0.0; 8]));
            }
            let registers = Cell::from_mut(registers.as_mut_slice()).as_slice_of_cells();
            let inputs = Inputs { at, directions, scalars, first: 0, live: 0 };
            pulp::Arch::new().dispatch(Run { code, inputs, arrays, registers });
        });
    }
}

/// One run, passed to the dispatcher of instruction sets.
struct Run<'a, 'b, 'c> {
    code: &'a Code,
    inputs: Inputs<'a>,
    arrays: &'b mut [&'c mut [f64]],
    registers: &'b [Cell<Eight>],
}

impl pulp::NullaryFnOnce for Run<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Run { code, mut inputs, arrays, registers } = self;
        let lanes = inputs.at.lanes;
        let most = if code.registers * MANY > IN_CACHE { FEW } else { MANY };
        while inputs.first < lanes {
            let left = lanes - inputs.first;
            // Two narrow passes cost less than one wide pass that is half empty.
            let eights = [most, FEW, PAIR].into_iter().find(|eights| left > 4 * eights).unwrap_or(1);
            inputs.live = left.min(8 * eights);
            for &(register, scalar) in &code.filled {
                let value = Eight([inputs.scalars[scalar as usize]; 8]);
                registers[register as usize * eights..][..eights].iter().for_each(|eight| eight.set(value));
            }
            match eights {
                MANY => section::<MANY>(code, registers, inputs, arrays),
                FEW => section::<FEW>(code, registers, inputs, arrays),
                PAIR => section::<PAIR>(code, registers, inputs, arrays),
                _ => section::<1>(code, registers, inputs, arrays),
            }
            inputs.first += inputs.live;
        }
    }
}

/// Lanes of one component of a result.
#[inline(always)]
fn component<'a>(arrays: &'a mut [&mut [f64]], place: Place, lanes: usize) -> &'a mut [f64] {
    let start = place.component as usize * lanes;
    &mut arrays[place.array as usize][start..start + lanes]
}

#[inline(always)]
fn store<const W: usize>(value: &Lanes<W>, place: Place, inputs: Inputs, arrays: &mut [&mut [f64]]) {
    let target = &mut component(arrays, place, inputs.at.lanes)[inputs.first..inputs.first + inputs.live];
    let (full, rest) = target.as_chunks_mut::<8>();
    for (block, eight) in full.iter_mut().zip(value) {
        *block = eight.get().0;
    }
    if let Some(eight) = value.get(full.len()) {
        rest.copy_from_slice(&eight.get().0[..rest.len()]);
    }
}

/// Copies the lanes; missing lanes repeat the last one.
#[inline(always)]
fn load<const W: usize>(to: &Lanes<W>, source: &[f64], index: u32, inputs: Inputs) {
    let start = index as usize * inputs.at.lanes + inputs.first;
    let (full, rest) = source[start..start + inputs.live].as_chunks::<8>();
    to.iter().zip(full).for_each(|(to, eight)| to.set(Eight(*eight)));
    if let (Some(to), Some(&last)) = (to.get(full.len()), rest.last()) {
        to.set(Eight(std::array::from_fn(|l| rest.get(l).copied().unwrap_or(last))));
    }
}

#[inline(always)]
fn map<const W: usize>(to: &Lanes<W>, a: &Lanes<W>, f: impl Fn(f64) -> f64) {
    for (to, a) in to.iter().zip(a) {
        let (x, mut y) = (a.get().0, [0.0; 8]);
        (0..8).for_each(|l| y[l] = f(x[l]));
        to.set(Eight(y));
    }
}

#[inline(always)]
fn zip<const W: usize>(to: &Lanes<W>, a: &Lanes<W>, b: &Lanes<W>, f: impl Fn(f64, f64) -> f64) {
    for ((to, a), b) in to.iter().zip(a).zip(b) {
        let (p, q, mut y) = (a.get().0, b.get().0, [0.0; 8]);
        (0..8).for_each(|l| y[l] = f(p[l], q[l]));
        to.set(Eight(y));
    }
}

#[inline(always)]
fn zip3<const W: usize>(to: &Lanes<W>, a: &Lanes<W>, b: &Lanes<W>, c: &Lanes<W>, f: impl Fn(f64, f64, f64) -> f64) {
    for (((to, a), b), c) in to.iter().zip(a).zip(b).zip(c) {
        let (p, q, r, mut y) = (a.get().0, b.get().0, c.get().0, [0.0; 8]);
        (0..8).for_each(|l| y[l] = f(p[l], q[l], r[l]));
        to.set(Eight(y));
    }
}

/// Like [`zip`], but only for existing lanes, for functions that are evaluated lane by lane anyway.
#[inline(always)]
fn zip_live<const W: usize>(to: &Lanes<W>, a: &Lanes<W>, b: &Lanes<W>, live: usize, f: impl Fn(f64, f64) -> f64) {
    for (w, ((to, a), b)) in to.iter().zip(a).zip(b).enumerate() {
        let (p, q, mut y) = (a.get().0, b.get().0, [0.0; 8]);
        (0..8.min(live.saturating_sub(8 * w))).for_each(|l| y[l] = f(p[l], q[l]));
        to.set(Eight(y));
    }
}

/// Runs instructions for W groups of eight lanes.
#[inline(always)]
fn section<const W: usize>(code: &Code, registers: &[Cell<Eight>], inputs: Inputs, arrays: &mut [&mut [f64]]) {
    let registers: &[[Cell<Eight>; W]] = registers.as_chunks().0;
    let r = |register: u32| &registers[register as usize];
    let scalar = |s: u32| inputs.scalars[s as usize];
    for &instruction in &code.body {
        match instruction {
            Instruction::Load { to, from } => match (from, inputs.at.parameters) {
                (Leaf::State(i), _) => load(r(to), inputs.at.states, i, inputs),
                (Leaf::Direction(d, i), _) => load(r(to), inputs.directions[d as usize], i, inputs),
                (Leaf::Time, _) if inputs.at.times.is_empty() => map(r(to), r(to), |_| 0.0),
                (Leaf::Time, _) => load(r(to), inputs.at.times, 0, inputs),
                (Leaf::Parameter(k), Parameters::PerLane(values)) => load(r(to), values, k, inputs),
                // Shared parameters are scalars.
                (Leaf::Parameter(_), Parameters::Shared(_)) => {}
            },
            Instruction::Unary { op, to, a } => unary(op, r(to), r(a), inputs.live),
            Instruction::Binary { op, to, a, b } => binary(op, r(to), r(a), r(b), inputs.live),
            Instruction::Right { op, to, a, s } => right(op, r(to), r(a), scalar(s)),
            Instruction::Left { op, to, s, b } => left(op, r(to), scalar(s), r(b)),
            Instruction::Fused { sum, to, a, b, c } => match sum {
                Sum::Plus => zip3(r(to), r(a), r(b), r(c), |x, y, z| x * y + z),
                Sum::Minus => zip3(r(to), r(a), r(b), r(c), |x, y, z| x * y - z),
                Sum::From => zip3(r(to), r(a), r(b), r(c), |x, y, z| z - x * y),
            },
            Instruction::Scaled { sum, to, a, s, c } => {
                let s = scalar(s);
                match sum {
                    Sum::Plus => zip(r(to), r(a), r(c), |x, z| x * s + z),
                    Sum::Minus => zip(r(to), r(a), r(c), |x, z| x * s - z),
                    Sum::From => zip(r(to), r(a), r(c), |x, z| z - x * s),
                }
            }
            Instruction::Terms { to, c, first, count } => {
                terms(r(to), r(c), &code.terms[first as usize..][..count as usize], registers, inputs.scalars);
            }
            Instruction::Integer { to, a, n } => match n {
                2 => map(r(to), r(a), |x| kernels::power(x, 2)),
                3 => map(r(to), r(a), |x| kernels::power(x, 3)),
                4 => map(r(to), r(a), |x| kernels::power(x, 4)),
                _ => map(r(to), r(a), |x| kernels::power(x, n)),
            },
            Instruction::Select { to, c, a, b } => {
                zip3(r(to), r(c), r(a), r(b), |c, x, y| if c != 0.0 { x } else { y });
            }
            Instruction::Store { from, place } => store(r(from), place, inputs, arrays),
        }
    }
}

/// Adds products to c, [`FEW`] groups of eight lanes at a time, so that the sums stay in vector registers.
#[inline(always)]
fn terms<const W: usize>(to: &Lanes<W>, c: &Lanes<W>, terms: &[Term], registers: &[[Cell<Eight>; W]], scalars: &[f64]) {
    let (whole, _) = c.as_chunks::<FEW>();
    for (part, c) in whole.iter().enumerate() {
        let mut sums = [c[0].get(), c[1].get(), c[2].get(), c[3].get()];
        let of = |register: u32| -> [Eight; FEW] {
            let own = &registers[register as usize][FEW * part..][..FEW];
            [own[0].get(), own[1].get(), own[2].get(), own[3].get()]
        };
        for &term in terms {
            let (sum, [a0, a1, a2, a3], [b0, b1, b2, b3]) = match term {
                Term::Product { sum, a, b } => (sum, of(a), of(b)),
                Term::Scaled { sum, a, s } => (sum, of(a), [Eight::splat(scalars[s as usize]); FEW]),
            };
            let [s0, s1, s2, s3] = sums;
            let [p0, p1, p2, p3] = [a0 * b0, a1 * b1, a2 * b2, a3 * b3];
            sums = match sum {
                Sum::Plus => [p0 + s0, p1 + s1, p2 + s2, p3 + s3],
                Sum::Minus => [p0 - s0, p1 - s1, p2 - s2, p3 - s3],
                Sum::From => [s0 - p0, s1 - p1, s2 - p2, s3 - p3],
            };
        }
        to[FEW * part..][..FEW].iter().zip(sums).for_each(|(to, sum)| to.set(sum));
    }
    for w in FEW * whole.len()..W {
        let mut own = c[w].get();
        for &term in terms {
            let (sum, p) = match term {
                Term::Product { sum, a, b } => (sum, registers[a as usize][w].get() * registers[b as usize][w].get()),
                Term::Scaled { sum, a, s } => (sum, registers[a as usize][w].get() * Eight::splat(scalars[s as usize])),
            };
            own = match sum {
                Sum::Plus => p + own,
                Sum::Minus => p - own,
                Sum::From => own - p,
            };
        }
        to[w].set(own);
    }
}

#[inline(always)]
fn unary<const W: usize>(op: Unary, to: &Lanes<W>, a: &Lanes<W>, live: usize) {
    match op {
        Unary::Negate => map(to, a, |x| Unary::Negate.of(x)),
        Unary::Sqrt => map(to, a, |x| Unary::Sqrt.of(x)),
        Unary::Exp => map(to, a, |x| Unary::Exp.of(x)),
        // No `for_each`: a closure of that size would be compiled as a separate function, without the vector
        // instructions.
        Unary::Tanh => {
            for (to, a) in to.iter().zip(a) {
                to.set(kernels::tanhs(a.get()));
            }
        }
        Unary::SechSquared => map(to, a, |x| Unary::SechSquared.of(x)),
        Unary::Abs => map(to, a, |x| Unary::Abs.of(x)),
        Unary::Sign => map(to, a, |x| Unary::Sign.of(x)),
        Unary::Heaviside => map(to, a, |x| Unary::Heaviside.of(x)),
        Unary::Floor => map(to, a, |x| Unary::Floor.of(x)),
        Unary::Expm1 => map(to, a, |x| Unary::Expm1.of(x)),
        Unary::Exprel(0) => map(to, a, |x| Unary::Exprel(0).of(x)),
        _ => zip_live(to, a, a, live, |x, _| op.of(x)),
    }
}

#[inline(always)]
fn binary<const W: usize>(op: Binary, to: &Lanes<W>, a: &Lanes<W>, b: &Lanes<W>, live: usize) {
    match op {
        Binary::Add => zip(to, a, b, |x, y| x + y),
        Binary::Subtract => zip(to, a, b, |x, y| x - y),
        Binary::Multiply => zip(to, a, b, |x, y| x * y),
        Binary::Divide => zip(to, a, b, |x, y| x / y),
        Binary::Min => zip(to, a, b, |x, y| Binary::Min.of(x, y)),
        Binary::Max => zip(to, a, b, |x, y| Binary::Max.of(x, y)),
        Binary::Hypot => {
            for ((to, a), b) in to.iter().zip(a).zip(b) {
                to.set(kernels::hypots(a.get(), b.get()));
            }
        }
        Binary::Less => zip(to, a, b, |x, y| Binary::Less.of(x, y)),
        Binary::LessOrEqual => zip(to, a, b, |x, y| Binary::LessOrEqual.of(x, y)),
        Binary::Equal => zip(to, a, b, |x, y| Binary::Equal.of(x, y)),
        Binary::NotEqual => zip(to, a, b, |x, y| Binary::NotEqual.of(x, y)),
        Binary::Power | Binary::Atan2 => zip_live(to, a, b, live, |x, y| op.of(x, y)),
    }
}

/// a op s, for the operations that [`super::tape::takes_scalars`] names.
#[inline(always)]
fn right<const W: usize>(op: Binary, to: &Lanes<W>, a: &Lanes<W>, s: f64) {
    match op {
        Binary::Add => map(to, a, |x| x + s),
        Binary::Subtract => map(to, a, |x| x - s),
        Binary::Multiply => map(to, a, |x| x * s),
        Binary::Divide => map(to, a, |x| x / s),
        Binary::Less => map(to, a, |x| Binary::Less.of(x, s)),
        Binary::LessOrEqual => map(to, a, |x| Binary::LessOrEqual.of(x, s)),
        Binary::Min => map(to, a, |x| Binary::Min.of(x, s)),
        _ => map(to, a, |x| Binary::Max.of(x, s)),
    }
}

/// s op b, for the operations that [`super::tape::takes_scalars`] names.
#[inline(always)]
fn left<const W: usize>(op: Binary, to: &Lanes<W>, s: f64, b: &Lanes<W>) {
    match op {
        Binary::Add => map(to, b, |x| s + x),
        Binary::Subtract => map(to, b, |x| s - x),
        Binary::Multiply => map(to, b, |x| s * x),
        Binary::Divide => map(to, b, |x| s / x),
        Binary::Less => map(to, b, |x| Binary::Less.of(s, x)),
        Binary::LessOrEqual => map(to, b, |x| Binary::LessOrEqual.of(s, x)),
        Binary::Min => map(to, b, |x| Binary::Min.of(s, x)),
        _ => map(to, b, |x| Binary::Max.of(s, x)),
    }
}

#[cfg(test)]
mod tests {
    use crate::contract::{Batch, Parameters, VectorField};
    use crate::model::{Definition, Model, ModelSource, Parameter, State};

    /// Sums of products of every sign and length, in batches of every width, match the formula to the bit.
    #[test]
    fn sums_of_products_are_added_in_their_order() {
        let text = |f: &[(&str, &str)]| f.iter().map(|(name, text)| Definition::new(name, text)).collect();
        let model = Model::compile(ModelSource {
            parameters: vec![Parameter::new("p", 0.0)],
            states: ["x", "y", "z"].map(State::new).to_vec(),
            equations: text(&[
                ("x", "z + p*x - y*z + x*y - p*z + z^2 - y*x*z + 0.3*y"),
                ("y", "x*y - z + p*x - y*z"),
                ("z", "p*y - (x*z - y) + z*(x - p*y)"),
            ]),
            ..ModelSource::default()
        })
        .unwrap();
        for lanes in [1, 3, 8, 9, 16, 17, 24, 32, 33, 64, 65, 100, 200] {
            let p = -0.7;
            let states: Vec<f64> =
                (0..3 * lanes).map(|k| (1.7 * k as f64).sin() * 10f64.powi(k as i32 % 5 - 2)).collect();
            for own in [false, true] {
                let all = vec![p; lanes];
                let parameters = if own { Parameters::PerLane(&all) } else { Parameters::Shared(&all[..1]) };
                let mut f = vec![f64::NAN; 3 * lanes];
                model.evaluate(Batch { lanes, states: &states, parameters, times: &[], signs: &[] }, &mut f);
                for l in 0..lanes {
                    let [x, y, z] = [states[l], states[lanes + l], states[2 * lanes + l]];
                    let expected = [
                        z + p * x - y * z + x * y - p * z + z * z - y * x * z + 0.3 * y,
                        x * y - z + p * x - y * z,
                        p * y - (x * z - y) + z * (x - p * y),
                    ];
                    for i in 0..3 {
                        assert_eq!(f[i * lanes + l].to_bits(), expected[i].to_bits(), "{lanes} lanes, {own}, {l}, {i}");
                    }
                }
            }
        }
    }
}
