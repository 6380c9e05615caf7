//! Repetition, functions, second-order equations, masses and tables in model files, each compared with the same model
//! written out in full.

use foldline::contract::{Batch, Parameters, VectorField};
use foldline::explore::SeedSource;
use foldline::model::Model;
use foldline_store::model_file::parse_model;
use foldline_store::study_file::parse_study;

#[track_caller]
fn model(text: &str) -> Model {
    parse_model(text, "model.toml").unwrap_or_else(|found| panic!("{}", found[0]))
}

/// Evaluates f at a state with different components.
fn field(model: &Model) -> Vec<f64> {
    let n = model.dim();
    let states: Vec<f64> = (0..n).map(|i| (1.3 * i as f64 + 0.4).sin()).collect();
    let p = model.defaults();
    let mut f = vec![0.0; n];
    model.evaluate(
        Batch { lanes: 1, states: &states, parameters: Parameters::Shared(&p), times: &[0.3], signs: &[] },
        &mut f,
    );
    f
}

fn names(model: &Model) -> Vec<&str> {
    model.states.iter().map(|s| s.name.as_str()).collect()
}

#[track_caller]
fn same(short: &str, long: &str) {
    let (short, long) = (model(short), model(long));
    assert_eq!(short.dim(), long.dim());
    for (a, b) in field(&short).iter().zip(field(&long)) {
        assert!((a - b).abs() <= 1e-14 * (1.0 + b.abs()), "{:?}\n{:?}", field(&short), field(&long));
    }
}

/// Returns line, column, message and hint of the only mistake.
#[track_caller]
fn mistake(text: &str) -> ((usize, usize), String, String) {
    let found = parse_model(text, "model.toml").expect_err("a model with a mistake");
    let [one] = &found[..] else { panic!("{found:#?}") };
    ((one.line, one.column), one.message.clone(), one.hint.clone().unwrap_or_default())
}

const CHAIN: &str = r#"
[constants]
n = 4
[parameters]
k = 2.0
c = 0.1
[states.x]
count = "n"
equation = "v[i]"
before = "0"
after = "x[n]"
[states.v]
count = "n"
equation = "k*(x[i+1] - 2*x[i] + x[i-1]) - c*v[i] + sin(pi*i/n)"
"#;

#[test]
fn a_chain_is_the_chain_written_out() {
    let mut long = String::from("[parameters]\nk = 2.0\nc = 0.1\n[states]\n");
    for i in 1..=4 {
        let before = if i == 1 { "0".to_string() } else { format!("x{}", i - 1) };
        let after = format!("x{}", (i + 1).min(4));
        long += &format!("x{i} = \"v{i}\"\nv{i} = \"k*({after} - 2*x{i} + {before}) - c*v{i} + sin(pi*{i}/4)\"\n");
    }
    same(CHAIN, &long);
    assert_eq!(names(&model(CHAIN)), ["x[1]", "v[1]", "x[2]", "v[2]", "x[3]", "v[3]", "x[4]", "v[4]"]);
}

#[test]
fn states_of_other_counts_are_not_interleaved() {
    let text = "[states]\na = { count = 2, equation = '-a[i]' }\nb = { count = 3, equation = '-b[i]' }\ns = '-s'\n\
                c = { count = 2, equation = '-c[i]' }\nd = { count = 2, equation = '-d[i]' }\n";
    let expected = ["a[1]", "a[2]", "b[1]", "b[2]", "b[3]", "s", "c[1]", "d[1]", "c[2]", "d[2]"];
    assert_eq!(names(&model(text)), expected);
}

#[test]
fn rings_beams_and_conditions_on_the_index() {
    let ring = "[states.x]\ncount = 5\nperiodic = true\nequation = 'x[i+1]*x[i-3] - x[i]'\n";
    let mut long = String::from("[states]\n");
    (0..5).for_each(|i| long += &format!("x{i} = 'x{}*x{} - x{i}'\n", (i + 1) % 5, (i + 2) % 5));
    same(ring, &long);
    // A clamped beam: two values beyond each end.
    let beam = "[states.w]\ncount = 3\nbefore = [0, 'w[1]']\nafter = ['2*w[3] - w[2]', '4*w[3] - 4*w[2] + w[1]']\n\
                equation = '-(w[i-2] - 4*w[i-1] + 6*w[i] - 4*w[i+1] + w[i+2])'\n";
    let long = "[states]\na = '-(a - 4*0 + 6*a - 4*b + c)'\nb = '-(0 - 4*a + 6*b - 4*c + (2*c - b))'\n\
                c = '-(a - 4*b + 6*c - 4*(2*c - b) + (4*c - 4*b + a))'\n";
    same(beam, long);
    let cascade = "[states.x]\ncount = 3\nequation = 'if(i > 1, x[i-1], 1) - x[i] + (i == 3)*2'\n";
    same(cascade, "[states]\na = '1 - a'\nb = 'a - b'\nc = 'b - c + 2'\n");
}

#[test]
fn sums_parameters_definitions_and_outputs_have_indices_too() {
    let text = "[constants]\nn = 3\n[parameters]\nK = 0.7\nw = [1.0, 1.1, 1.3]\ng = { count = 3, value = 0.5 }\n\
                [definitions]\nr = 'sum(j, 1, n, cos(p[j]))/n'\n\
                pull = { count = 'n', expression = 'K/n*sum(j, 1, n, sin(p[j] - p[i]))' }\n\
                run = { count = 'n', expression = 'if(i == 1, 0, run[i-1]) + p[i]' }\n\
                [states.p]\ncount = 'n'\nequation = 'w[i] + g[i]*pull[i] + r + run[n+1-i]'\n\
                [outputs]\nz = { count = 2, expression = 'p[i+1] - p[i]' }\n";
    let pull = |i: &str| format!("0.5*0.7/3*(sin(a - {i}) + sin(b - {i}) + sin(c - {i}))");
    let long = format!(
        "[definitions]\nr = '(cos(a) + cos(b) + cos(c))/3'\n[states]\na = '1.0 + {} + r + a + b + c'\n\
         b = '1.1 + {} + r + a + b'\nc = '1.3 + {} + r + a'\n",
        pull("a"),
        pull("b"),
        pull("c")
    );
    same(text, &long);
    let own = model(text);
    assert_eq!(
        own.parameters.iter().map(|p| (p.name.as_str(), p.value)).collect::<Vec<_>>(),
        [("K", 0.7), ("w[1]", 1.0), ("w[2]", 1.1), ("w[3]", 1.3), ("g[1]", 0.5), ("g[2]", 0.5), ("g[3]", 0.5)]
    );
    assert_eq!(own.outputs.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(), ["z[1]", "z[2]"]);
}

#[test]
fn a_neighbour_that_does_not_exist_is_refused() {
    let (place, message, hint) = mistake(&CHAIN.replace("before = \"0\"\n", ""));
    assert_eq!(place, (13, 34));
    assert_eq!(message, "there is no `x[0]`: `x` has elements 1 to 4, at i = 1");
    assert!(
        hint.starts_with("give its value: `before = \"0\"` if it is fixed, `before = \"x[1]\"` at a free end"),
        "{hint}"
    );
    let (_, message, hint) = mistake(&CHAIN.replace("x[i+1]", "x[i+2]"));
    assert_eq!(message, "there is no `x[6]`: `x` has elements 1 to 4, at i = 4");
    assert!(hint.contains("`after` gives 1; list one more"), "{hint}");
}

#[test]
fn mistakes_with_indices_are_reported_with_position() {
    let cases = [
        ("2*x[i]", "2*x", (14, 27), "`x` is repeated over an index"),
        ("c*v[i]", "c[i]*v[i]", (14, 44), "`c` has no index"),
        ("c*v[i]", "c*v[i", (14, 47), "this bracket is never closed"),
        ("c*v[i]", "c*v[i/2]", (14, 46), "the index of `v` is 0.5, not an integer"),
        ("c*v[i]", "c*v[k]", (14, 46), "the index of `v` depends on a quantity that varies"),
        ("c*v[i]", "c*[i]", (14, 46), "an index belongs to a name"),
        ("c*v[i]", "c*sum(j, 1, k, v[j])", (14, 50), "the limits of this sum are not two integers"),
        (
            "c*v[i]",
            "c*sum(i, 1, 4, v[i])",
            (14, 50),
            "the index `i` of this sum has a name that is already in use: it is an index",
        ),
        ("c*v[i]", "c*sum(v, 1)", (14, 46), "`sum` is not written correctly"),
        ("c*v[i]", "c*v(i)", (14, 46), "there is no function `v`"),
        ("count = \"n\"\nequation = \"v[i]\"", "count = \"m\"\nequation = \"v[i]\"", (8, 10), "`m` is not a constant"),
        ("c = 0.1", "c = 0.1\ni = 3", (8, 9), "the index `i` has a name that is already in use: it is a parameter"),
        ("n = 4", "n = 0", (8, 9), "the count of the state `x` is 0"),
        ("n = 4", "n = -3", (8, 9), "the count of the state `x` is -3"),
        ("n = 4", "n = 2.5", (8, 9), "the count of the state `x` is 2.5"),
        ("n = 4", "n = 1e9", (8, 9), "the model has 2000000000 states; the limit is 1000"),
        ("n = 4", "n = 1e300", (8, 9), "the count of the state `x` is"),
        ("before = \"0\"", "before = \"x[0]\"", (10, 11), "circular definitions: x[0] → x[0]"),
        ("before = \"0\"", "periodic = 3", (10, 12), "`periodic` is neither true nor false"),
        ("before = \"0\"", "periodic = true", (10, 12), "has values beyond its ends"),
    ];
    for (from, to, place, words) in cases {
        let text = CHAIN.replacen(from, to, 1);
        let found = parse_model(&text, "model.toml").expect_err(to);
        assert!(found[0].message.contains(words), "{to}: {}", found[0]);
        assert_eq!((found[0].line, found[0].column), place, "{to}: {}", found[0]);
    }
}

#[test]
fn excessive_repetition_is_rejected() {
    let text = "[states.x]\ncount = 1000\nequation = 'sum(j, 1, 1000, sum(k, 1, 1000, sum(l, 1, 1000, sin(x[j]*x[k]*x[l]))))'\n";
    assert_eq!(mistake(text).1, "repeated equations, sums and functions expand to more than four million terms");
    let text = "[states]\nx = 'sum(j, 1, 900000000, x)'\n";
    assert_eq!(mistake(text).1, "repeated equations, sums and functions expand to more than four million terms");
    let deep = format!("[states]\nx = '{}x{}'\n", "sum(j, 1, 1, ".repeat(5000), ")".repeat(5000));
    assert!(!parse_model(&deep, "m").expect_err("too deep").is_empty());
    let indices = format!("[states.x]\ncount = 1\nequation = '{}1{}'\n", "x[".repeat(5000), "]".repeat(5000));
    assert!(!parse_model(&indices, "m").expect_err("too deep").is_empty());
    let mut text = String::from("[functions]\n\"f0(x)\" = 'x'\n");
    (1..40).for_each(|k| text += &format!("\"f{k}(x)\" = 'f{}(x) + f{}(2*x)'\n", k - 1, k - 1));
    assert_eq!(
        mistake(&(text + "[states]\nx = 'f39(x)'\n")).1,
        "repeated equations, sums and functions expand to more than four million terms"
    );
}

#[test]
fn functions_are_replaced_by_their_expressions() {
    let text = "[parameters]\nV = 2.0\n[functions]\n\"hill(x, K, n)\" = 'x^n/(K^n + x^n)'\n\"twice(u)\" = 'V*hill(u, 1, 2) + d*y'\n\
                [definitions]\nd = 'hill(y, 0.5, 4)'\n[states]\nx = 'twice(y) - x'\ny = 'hill(x, 2, 1) - y'\n";
    let long = "[states]\nx = '2*y^2/(1 + y^2) + y^4/(0.5^4 + y^4)*y - x'\ny = 'x/(2 + x) - y'\n";
    same(text, long);
}

#[test]
fn mistakes_with_functions_are_reported_with_position() {
    let text = "[functions]\n\"f(x, y)\" = 'x + g(y)'\n\"g(z)\" = 'z^2'\n[states]\nx = 'f(x, 1)'\n";
    model(text);
    let cases = [
        ("f(x, 1)", "f(x)", (5, 6), "`f` takes 2 arguments, 1 given"),
        ("z^2", "f(z, z)", (3, 11), "circular function calls: f → g → f"),
        ("z^2", "g(z)", (3, 11), "circular function calls: g → g"),
        ("z^2", "w^2", (3, 11), "unknown name `w`"),
        ("f(x, 1)", "h(x, 1)", (5, 6), "there is no function `h`"),
        ("f(x, 1)", "f*x", (5, 6), "unknown name `f`"),
        ("\"g(z)\"", "\"g\"", (3, 1), "`g` is not a function name with arguments"),
        ("\"g(z)\"", "\"g()\"", (3, 1), "`g()` is not a function name with arguments"),
        ("\"g(z)\"", "\"g(z, z)\"", (3, 1), "two arguments have the name `z`"),
        ("\"g(z)\"", "\"sin(z)\"", (3, 1), "`sin` is the name of a function"),
        ("\"g(z)\"", "\"x(z)\"", (5, 1), "the name `x` is already taken by a function"),
    ];
    for (from, to, place, words) in cases {
        let found = parse_model(&text.replacen(from, to, 1), "model.toml").expect_err(to);
        let own = found.iter().find(|d| d.message.contains(words)).unwrap_or_else(|| panic!("{to}: {}", found[0]));
        assert_eq!((own.line, own.column), place, "{to}: {own}");
    }
}

#[test]
fn accelerations_declare_a_state_and_its_velocity() {
    let text = "[parameters]\nz = 0.1\n[states]\n\"x''\" = \"-x - 2*z*x'\"\n";
    same(text, "[parameters]\nz = 0.1\n[states]\nx = 'v'\nv = '-x - 2*z*v'\n");
    assert_eq!(names(&model(text)), ["x", "x'"]);
    let apart = "[parameters]\nz = 0.1\n[states.x]\nscale = 2\nvelocity = { scale = 3 }\n[equations]\n\"x''\" = \"-x - 2*z*x'\"\n";
    same(text, apart);
    assert_eq!(model(apart).scales(), [2.0, 3.0]);
    let (place, message, hint) = mistake("[states]\nx = \"-x'\"\n");
    assert_eq!((place, message.as_str()), ((2, 7), "unknown name `x'`"));
    assert!(hint.contains("`\"x''\" = \"…\"` under [states]"), "{hint}");
    assert!(mistake("[states]\n\"x'\" = \"1\"\n").2.contains("`\"x''\" = \"…\"` declares `x` and `x'`"));
    // A higher derivative has no notation of its own: the first-order form is spelled out, and is a model.
    let form = "`u = \"u1\"`, `u1 = \"u2\"`, `u2 = \"u3\"` and `u3 = \"…\"` under [states]";
    for text in ["\"u''''\" = \"-u\"", "u = \"u'''' = -u\"", "u = \"-u''''\""] {
        let (_, message, hint) = mistake(&format!("[states]\n{text}\n"));
        assert!(hint.contains(form), "{text}: {message}: {hint}");
    }
    assert_eq!(names(&model("[states]\nu = 'u1'\nu1 = 'u2'\nu2 = 'u3'\nu3 = '-u'\n")), ["u", "u1", "u2", "u3"]);
}

#[test]
fn velocities_beyond_the_ends_are_the_derivatives_of_the_states_there() {
    let text = "[parameters]\nw = 2.0\nY = 0.3\n[forcing]\nfrequency = 'w'\n[states.\"x''\"]\ncount = 2\n\
                before = 'Y*sin(w*t)'\nafter = '2*x[2]'\n\
                equation = \"x[i-1] - 2*x[i] + x[i+1] + 0.1*(x'[i-1] - 2*x'[i] + x'[i+1])\"\n";
    let long = "[parameters]\nw = 2.0\nY = 0.3\n[forcing]\nfrequency = 'w'\n[states]\na = 'va'\n\
                va = 'Y*sin(w*t) - 2*a + b + 0.1*(Y*w*cos(w*t) - 2*va + vb)'\nb = 'vb'\n\
                vb = 'a - 2*b + 2*b + 0.1*(va - 2*vb + 2*vb)'\n";
    same(text, long);
    let ring = "[states.\"x''\"]\ncount = 3\nperiodic = true\nequation = \"x[i-1] - x[i] + x'[i+1] - x'[i]\"\n";
    let long = "[states]\na = 'p'\np = 'c - a + q - p'\nb = 'q'\nq = 'a - b + r - q'\nc = 'r'\nr = 'b - c + p - r'\n";
    same(ring, long);
}

/// Pendulum on a cart.
#[test]
fn masses_couple_equations() {
    let text = "[parameters]\nM = 2.0\nm = 0.5\nl = 0.8\n[states]\n\"x''\" = \"m*l*sin(th)*th'^2 - x\"\n\"th''\" = \"-9.81*m*l*sin(th)\"\n\
                [mass]\nx = { x = 'M + m', th = 'm*l*cos(th)' }\nth = { x = 'm*l*cos(th)', th = 'm*l^2' }\n";
    let long = "[parameters]\nM = 2.0\nm = 0.5\nl = 0.8\n[definitions]\na = 'M + m'\nb = 'm*l*cos(th)'\nd = 'm*l^2'\n\
                p = 'm*l*sin(th)*w^2 - x'\nq = '-9.81*m*l*sin(th)'\n[states]\nx = 'v'\nv = '(d*p - b*q)/(a*d - b^2)'\nth = 'w'\nw = '(a*q - b*p)/(a*d - b^2)'\n";
    same(text, long);
    same("[states]\nx = 'y'\ny = '-x'\n[mass]\ny = 4\n", "[states]\nx = 'y'\ny = '-x/4'\n");
    let (place, message, _) = mistake(&text.replace("th = { x = 'm*l*cos(th)', th", "th = { th"));
    assert_eq!((place.0, message.as_str()), (9, "the mass of `x` and `th` is given, but that of `th` and `x` is not"));
    let singular = text.replace("th = 'm*l^2'", "th = 0").replace("m*l*cos(th)", "0");
    assert!(
        mistake(&singular).1.starts_with("the mass matrix is singular: elimination leaves no diagonal entry for `th'`")
    );
    assert_eq!(mistake(&text.replace("\nth = {", "\ny = {")).1, "`y` is not a state");
}

#[test]
fn tables_are_functions() {
    let text = "[tables.k]\nx = [0, 1, 3]\ny = [0, 2, 3]\n[states]\nx = '-k(x) + k(-2) + k(5)'\ny = 'k(2)'\n";
    same(text, "[states]\nx = '-if(x < 1, 2*x, 2 + (x - 1)/2) - 4 + 4'\ny = '2.5'\n");
    let held = text.replace("[states]", "outside = 'constant'\n[states]");
    same(&held, "[states]\nx = '-if(x < 0, 0, if(x < 1, 2*x, if(x < 3, 2 + (x - 1)/2, 3))) + 0 + 3'\ny = '2.5'\n");
    assert_eq!((model(text).switch_count(), model(&held).switch_count()), (1, 3));
    assert!(mistake(&text.replace("[0, 1, 3]", "[0, 3, 1]")).1.contains("do not increase: 3 is followed by 1"));
    assert_eq!(mistake(&text.replace("[0, 1, 3]", "[0, 1]")).1, "the table has 2 `x` values and 3 `y` values");
    assert_eq!(mistake(&text.replace("[0, 1, 3]", "3")).0, (2, 5));
    assert!(mistake(&text.replace("[states]", "interpolation = 'spline'\n[states]")).1.contains("neither"));
}

#[test]
fn a_parameter_computed_from_others_is_a_definition() {
    let text = "[parameters]\nm = 2.0\nk = 8.0\nw0 = \"sqrt(k/m)\"\n[states]\nx = 'v'\nv = '-w0^2*x'\n";
    same(text, "[states]\nx = 'v'\nv = '-4*x'\n");
    assert_eq!(model(text).parameters.len(), 2);
}

#[test]
fn the_largest_allowed_number_of_repeated_states() {
    let text = "[states.\"x''\"]\ncount = 500\nbefore = 0\nafter = 0\nequation = 'x[i-1] - 2*x[i] + x[i+1]'\n";
    assert_eq!(model(text).dim(), 1000);
}

#[test]
fn a_state_is_given_for_all_elements_or_for_each() {
    let text = "[states.\"x''\"]\ncount = 3\nperiodic = true\nequation = \"x[i-1] - 2*x[i] - x'[i]\"\n";
    let study = |state: &str| {
        let study = format!(
            "model = \"m.toml\"\n[[seed]]\nname = \"s\"\nstate = {state}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p\"\nrange = [0, 1]\n"
        );
        parse_study(&study, "s.toml", &format!("[parameters]\np = 0\n{text}"), "m.toml")
    };
    let given = |state: &str| match &study(state).unwrap_or_else(|found| panic!("{}", found[0])).plan.seeds[0].source {
        SeedSource::State(state) => state.clone(),
        _ => Vec::new(),
    };
    assert_eq!(given("{ x = [1, 2, 3], \"x'\" = 0, \"x'[2]\" = 5 }"), [1.0, 0.0, 2.0, 5.0, 3.0, 0.0]);
    let message = |state: &str| study(state).expect_err(state)[0].message.clone();
    assert_eq!(message("{ x = [1, 2], \"x'\" = 0 }"), "the state `x` has 3 elements, but 2 values are given");
    assert_eq!(message("{ x = 1 }"), "the state lacks x'[1], x'[2], x'[3]");
    assert!(message("{ x = \"1\", \"x'\" = 0 }").contains("the state `x`"));
}

/// All complete models on the page about model files.
#[test]
fn the_examples_of_the_book_are_right() {
    let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/book/model-files.md");
    let page = std::fs::read_to_string(page).expect("the page is there");
    let blocks: Vec<&str> = page.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    let complete = |block: &&&str| block.contains("[parameters]") && block.contains("[states");
    assert_eq!(blocks.iter().filter(complete).map(|block| model(block).dim()).collect::<Vec<_>>(), [2, 80]);
    // The other models lack parameters.
    let [functions, short, table, mass] = &blocks[2..] else { panic!("{} blocks", blocks.len()) };
    let parameters = "[parameters]\nk = 1\nk3 = 0.1\nzeta = 0.1\nm = 1\nM = 2\nl = 1\ng = 9.81\n";
    assert_eq!(
        model(&format!("{parameters}{functions}[states]\nx = 'hill(x, 1, 2) - spring(x)*stiffness(x)'\n")).dim(),
        1
    );
    assert_eq!([short, table].map(|block| model(&format!("{parameters}{block}")).dim()), [2, 2]);
    assert_eq!(model(&format!("{parameters}{mass}")).dim(), 4);
}
