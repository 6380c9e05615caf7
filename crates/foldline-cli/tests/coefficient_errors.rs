//! Every coefficient of a normal form has an error that is neither too small nor uselessly large, and none where the
//! coefficient is undefined. Hopf points are equally accurate for any number of states.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Kind, SpecialPoint};
use foldline::explore::{System, run};
use foldline_store::study_file::parse_study;

fn grown(model: &str, rest: &str) -> Diagram {
    let study = parse_study(&format!("model = \"m\"\n{rest}"), "study", model, "model")
        .unwrap_or_else(|found| panic!("{}", found[0]));
    run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved)
}

fn of_kind(branch: &Branch, kind: Kind) -> Vec<&SpecialPoint> {
    branch.special.iter().filter(|special| special.kind == kind).collect()
}

/// Asserts that the first coefficient is within its error of `known`, and that this error is at most
/// `largest` times |`known`|.
fn honest(point: &SpecialPoint, known: f64, largest: f64) {
    let ([value, ..], [error, ..]) = (&point.coefficients[..], &point.coefficient_errors[..]) else {
        panic!("no coefficient: {}", point.normal_form())
    };
    assert!((value - known).abs() <= *error, "{value:?} ± {error:e}, {known:?}");
    assert!(*error <= largest * known.abs(), "{value:?} ± {error:e}");
}

/// Brusselators in a row, A = 2, B = 5.45, between walls held at the equilibrium A, B/A. The Laplacian has the
/// eigenvalues -4 sin²(kπ/2(N+1)), and a pair crosses the imaginary axis where
/// B - 1 - A² = (D_x + D_y) (N+1)²/L² 4 sin²(…).
#[test]
fn hopf_points_of_many_states_are_as_accurate_as_those_of_two() {
    for cells in [1usize, 3, 8] {
        let walls = (cells + 1) as f64;
        let square = walls * walls;
        let mut states = String::new();
        for i in 1..=cells {
            let beside = |name: &str, wall: &str, j: usize| {
                if j == 0 || j == cells + 1 { wall.to_string() } else { format!("{name}{j}") }
            };
            let [x, y] = [("x", "2.0"), ("y", "2.725")].map(|(name, wall)| {
                format!("({} - 2*{name}{i} + {})", beside(name, wall, i - 1), beside(name, wall, i + 1))
            });
            states += &format!("x{i} = \"x{i}^2*y{i} - 6.45*x{i} + 2 + 0.008*{square:?}/L^2*{x}\"\n");
            states += &format!("y{i} = \"-x{i}^2*y{i} + 5.45*x{i} + 0.004*{square:?}/L^2*{y}\"\n");
        }
        let start: Vec<String> = (1..=cells).map(|i| format!("x{i} = 2.0, y{i} = 2.725")).collect();
        let model = format!("[parameters]\nL = 0.4\n[states]\n{states}");
        let study = format!(
            "[[seed]]\nname = \"s\"\nstate = {{ {} }}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"L\"\nrange = [0.4, 1.4]\n",
            start.join(", ")
        );
        let diagram = grown(&model, &study);
        let expected = (1..=cells).map(|k| {
            let wave = 2.0 * (k as f64 * std::f64::consts::PI / (2.0 * walls)).sin();
            (0.012 * square * wave * wave / 0.45).sqrt()
        });
        let expected: Vec<f64> = expected.filter(|l| (0.4..1.4).contains(l)).collect();
        let found = of_kind(diagram.branch("b").unwrap(), Kind::Hopf);
        assert_eq!(found.len(), expected.len(), "{cells} cells");
        for (hopf, known) in found.iter().zip(expected) {
            let off = (hopf.point.parameters[0] - known).abs() / (1.0 + known);
            assert!(off <= hopf.error && hopf.error < 1e-10, "{cells} cells: off by {off:e}, stated {:e}", hopf.error);
        }
    }
}

/// An oscillator of radius 1 beside a plane: z' = (p + iω) z + c z |z|² + g z (ρ² - 1), ρ' = ρ (k (1 - ρ²) + |z|²).
/// With ∫ |v|² dt = 1 over a period, d = (c + g/k) 2/T.
#[test]
fn a_torus_point_has_an_honest_error() {
    let (c, g, k) = (0.2, 0.6, 0.75);
    let model = format!(
        "[parameters]\np = -0.1\n[definitions]\nsize = \"x^2 + y^2\"\nsquare = \"u^2 + v^2\"\nrate = \"p + {c}*square + {g}*(size - 1)\"\n\
         grow = \"{k}*(1 - size) + square\"\nturn = \"1 + 0.4*square + 0.3*x\"\n[states]\n\
         x = {{ equation = \"grow*x - turn*y\", range = [-1, 1] }}\ny = {{ equation = \"grow*y + turn*x\", range = [-1, 1] }}\n\
         u = {{ equation = \"rate*u - 0.31*v\", range = [-0.1, 0.1] }}\nv = {{ equation = \"rate*v + 0.31*u\", range = [-0.1, 0.1] }}\n"
    );
    let diagram = grown(&model, &branch("cycle", [-0.1, 0.1]));
    let [torus] = of_kind(diagram.branch("b").unwrap(), Kind::Torus)[..] else { panic!("one torus point") };
    // φ' = 1 + 0.3 cos φ.
    let period = std::f64::consts::TAU / (1.0f64 - 0.09).sqrt();
    honest(torus, (c + g / k) * 2.0 / period, 1e-5);
    assert_eq!(torus.criticality(), Some("subcritical"));
}

fn branch(attractor: &str, [from, to]: [f64; 2]) -> String {
    format!(
        "[[seed]]\nname = \"s\"\nattractor = \"{attractor}\"\nparameters = {{ p = {from:?} }}\n\
         [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p\"\nrange = [{from:?}, {to:?}]\n"
    )
}

/// ρ' = ρ (p + 2 ρ² - ρ⁴), φ' = 1 + (ρ² - 1)/2: a fold of cycles at p = -1, ρ = 1, with a = 4, and a Hopf point
/// at p = 0.
fn turning_back(angle: &str) -> String {
    format!(
        "[parameters]\np = 0.5\n[definitions]\ngrow = \"p + 2*(x^2 + y^2) - (x^2 + y^2)^2\"\nturn = \"1 + 0.5*(x^2 + y^2 - 1){angle}\"\n\
         [states]\nx = {{ equation = \"grow*x - turn*y\", range = [-2, 2] }}\ny = {{ equation = \"turn*x + grow*y\", range = [-2, 2] }}\n"
    )
}

const BACK: &str = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nparameters = { p = 0.5 }\n\
                    [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p\"\nrange = [-2, 1]\n";

#[test]
fn a_fold_of_cycles_has_an_honest_error_and_so_has_the_hopf_point_at_its_end() {
    let rest = "[[seed]]\nname = \"rest\"\nstate = { x = 0, y = 0 }\nparameters = { p = -0.5 }\n[[branch]]\nname = \"r\"\nfrom = \"rest\"\nfree = \"p\"\nrange = [-0.5, 0.5]\n";
    let diagram = grown(&turning_back(""), &format!("{BACK}{rest}"));
    let [fold] = of_kind(diagram.branch("b").unwrap(), Kind::Fold)[..] else { panic!("one fold") };
    honest(fold, 4.0, 1e-5);
    let [hopf] = of_kind(diagram.branch("r").unwrap(), Kind::Hopf)[..] else { panic!("one Hopf point") };
    // z' = … + 2 z |z|², |z|² = 2 |w|², and ω = ½ where ρ is 0.
    honest(hopf, 8.0, 1e-9);
}

#[test]
fn an_orbit_across_a_switch_has_no_coefficients_and_the_table_says_why() {
    // Only the angle depends on the switch, so the fold stays where it is.
    let passes = grown(&turning_back("*if(x > 0.2, 1, 0.8)"), BACK);
    let [fold] = of_kind(passes.branch("b").unwrap(), Kind::Fold)[..] else { panic!("one fold") };
    assert!((fold.point.parameters[0] + 1.0).abs() < 1e-4);
    assert_eq!(fold.normal_form(), "no coefficients: the orbit crosses 2 switching points of the right-hand side");
    assert_eq!(fold.criticality(), None);
    let misses = grown(&turning_back("*if(x > 7, 0.8, 1)"), BACK);
    let [fold] = of_kind(misses.branch("b").unwrap(), Kind::Fold)[..] else { panic!("one fold") };
    honest(fold, 4.0, 1e-5);
}

/// Competition of three species with cyclic symmetry: at α + β = 2 cycles fill a surface, and l₁ is 0 (may1975). And
/// the free vibration of a rotor whose cubic stiffness is too small to show in numbers of this size.
#[test]
fn a_coefficient_that_is_zero_within_its_error_decides_nothing() {
    let competition = "[parameters]\nalpha = 0.5\nbeta = 1.3\n[states]\nx = \"x*(1 - x - alpha*y - beta*z)\"\ny = \"y*(1 - beta*x - y - alpha*z)\"\nz = \"z*(1 - alpha*x - beta*y - z)\"\n";
    let study = "[[seed]]\nname = \"s\"\nstate = { x = 0.357, y = 0.357, z = 0.357 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"alpha\"\nrange = [0.5, 0.9]\n";
    let rotor = "[parameters]\nOmega = 0.5\n[states]\nx = \"u\"\ny = \"v\"\nu = \"-0.2*u - x - 0.1*Omega*y - 1e-75*x^3\"\nv = \"-0.2*v - y + 0.1*Omega*x - 1e-75*y^3\"\n";
    let other = "[[seed]]\nname = \"s\"\nstate = { x = 0, y = 0, u = 0, v = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [0.5, 3]\n";
    for (model, study, at) in [(competition, study, 0.7), (rotor, other, 2.0)] {
        let diagram = grown(model, study);
        let [hopf] = of_kind(diagram.branch("b").unwrap(), Kind::Hopf)[..] else { panic!("one Hopf point") };
        assert!((hopf.point.parameters[0] - at).abs() < 1e-9, "{}", hopf.point.parameters[0]);
        let (value, error) = (hopf.coefficients[0], hopf.coefficient_errors[0]);
        assert!(value.abs() <= error && error < 1e-9, "{value:e} ± {error:e}");
        assert_eq!(hopf.criticality(), Some("degenerate"), "{}", hopf.normal_form());
    }
}

/// Nothing drives ξ on the invariant plane ξ = 0: c of the zero-Hopf point is 0, and quotients by it are undefined.
#[test]
fn a_zero_hopf_point_on_an_invariant_plane_has_no_coefficients() {
    let model = "[parameters]\np = -0.5\nq = -0.3\n[states]\nx = \"p*x + x^2 - x*(y^2 + z^2)\"\ny = \"(q + x)*y - z - y*(y^2 + z^2)\"\nz = \"y + (q + x)*z\"\n";
    let study = "[[seed]]\nname = \"s\"\nstate = { x = 0, y = 0, z = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"q\"\nrange = [-1, 1]\n[[curve]]\nname = \"c\"\nhold = \"hopf\"\nof = \"b\"\nfree = \"p\"\nrange = [-1, 1]\n";
    let diagram = grown(model, study);
    let [point] = of_kind(diagram.branch("c").unwrap(), Kind::ZeroHopf)[..] else { panic!("one zero-Hopf point") };
    assert!(point.coefficients.is_empty(), "{}", point.normal_form());
    assert!(point.normal_form().starts_with("no coefficients: c of the normal form"), "{}", point.normal_form());
}

/// Two coupled cells x' = a x - x⁵ + k (y - x), k = 0.3: at a = 5 k / 2 both mixed branches leave the antisymmetric one,
/// x = -y, at x⁴ = a - 2 k. b = -4 is the derivative of the eigenvalue a - 5 x⁴ there. Along one of the mixed branches the
/// point is a vertex, which is located only to the square root of the error of the parameter.
#[test]
fn coefficients_of_a_pitchfork_are_the_same_from_the_branch_that_turns_back() {
    let model = "[parameters]\na = 0.3\n[states]\nx = \"a*x - x^5 + 0.3*(y - x)\"\ny = \"a*y - y^5 + 0.3*(x - y)\"\n";
    for tolerance in [1e-5, 1e-6, 1e-8] {
        let study = format!(
            "tolerance = {tolerance:e}\n[[seed]]\nname = \"s\"\nstate = {{ x = 0, y = 0 }}\nparameters = {{ a = -0.5 }}\n\
             [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"a\"\nrange = [-0.5, 1.5]\nswitch = {{ branch-point = 2 }}\n"
        );
        let diagram = grown(model, &study);
        let special = diagram.branches.iter().flat_map(|branch| &branch.special);
        let there: Vec<&SpecialPoint> =
            special.filter(|special| (special.point.parameters[0] - 0.75).abs() < 1e-3).collect();
        assert_eq!(there.len(), 2, "along both branches");
        for point in there {
            // c = √60 for the null vector (1, 1)/√2, after elimination of (1, -1).
            for (k, known, largest) in [(0, 0.0, 1e-2), (1, -4.0, 1e-2), (2, 60f64.sqrt(), 1e-2)] {
                let (value, error) = (point.coefficients[k], point.coefficient_errors[k]);
                assert!((value - known).abs() <= error && error < largest, "{tolerance:e} {k}: {value} ± {error:e}");
            }
        }
    }
}

/// x' = mu x - a x² - 0.3 x³ + x z, z' = -z + x²/2, in the states u = x and w = x + z/1000: x = 0 is crossed where mu = 0, with the
/// quadratic coefficient -a/√2 for the null vector (1, 1)/√2. The states nearly coincide, so that an error of their difference
/// is large beside z.
#[test]
fn a_small_quadratic_term_between_states_that_nearly_coincide_is_no_pitchfork() {
    for (a, tolerance) in [(0.01, 1e-6), (0.01, 1e-4), (1.0, 1e-6), (1e-4, 1e-8)] {
        let model = format!(
            "[parameters]\nmu = -1.0\n[definitions]\nx = \"u\"\nz = \"(w-u)/0.001\"\n[states]\n\
             u = {{ range = [-2, 2], equation = \"mu*x - {a:?}*x^2 - 0.3*x^3 + x*z\" }}\n\
             w = {{ range = [-2, 2], equation = \"mu*x - {a:?}*x^2 - 0.3*x^3 + x*z + 0.001*(-z + 0.5*x^2)\" }}\n"
        );
        let study = format!(
            "tolerance = {tolerance:e}\n[[seed]]\nname = \"o\"\nstate = \"zero\"\n\
             [[branch]]\nname = \"e\"\nfrom = \"o\"\nfree = \"mu\"\nrange = [-1, 1]\n"
        );
        let diagram = grown(&model, &study);
        let [point] = &diagram.branch("e").unwrap().special[..] else { panic!("one point") };
        honest(point, -a / 2f64.sqrt(), f64::INFINITY);
        let said = point.normal_form();
        assert!(!said.contains("pitchfork, s"), "{said}");
    }
}
