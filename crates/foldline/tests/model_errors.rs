//! What is wrong with a model is said with its place, its cause and its cure.

use foldline::model::{Definition, Field, Item, Model, ModelError, ModelSource, Output, Parameter, State};

fn oscillator() -> ModelSource {
    ModelSource {
        name: "oscillator".into(),
        parameters: vec![Parameter::new("Omega", 1.0), Parameter::new("K", 2.0)],
        definitions: vec![Definition::new("r", "hypot(u, v)")],
        states: vec![State::new("u"), State::new("v")],
        equations: vec![Definition::new("u", "v"), Definition::new("v", "-u*r")],
        outputs: vec![Output::new("radius", "r")],
        ..ModelSource::default()
    }
}

fn errors(source: ModelSource) -> Vec<ModelError> {
    match Model::compile(source) {
        Ok(_) => Vec::new(),
        Err(errors) => errors,
    }
}

fn only(source: ModelSource) -> ModelError {
    let mut errors = errors(source);
    assert_eq!(errors.len(), 1, "{errors:?}");
    errors.remove(0)
}

/// The mistake in the equation of v, the words it points at, its message and its hint.
fn in_equation(expression: &str) -> (String, String, String) {
    let mut source = oscillator();
    source.equations[1].expression = expression.into();
    let error = only(source);
    assert_eq!((error.item, error.field), (Item::Equation(1), Field::Expression));
    let span = error.span.clone().unwrap_or(0..0);
    (expression[span].to_string(), error.message, error.hint)
}

#[test]
fn the_oscillator_is_right() {
    assert_eq!(errors(oscillator()), []);
}

#[test]
fn mistakes_in_expressions() {
    // expression, the place, part of the message, part of the hint
    let cases = [
        ("-u*tahn(r)", "tahn", "no function `tahn`", "did you mean `tanh`?"),
        ("-u*ln(r)", "ln", "no function `ln`", "write `log(x)`"),
        ("-u*K(r - 1)", "K", "no function `K`", "`K` is a parameter; write a product with a star"),
        ("-u*omega", "omega", "unknown name `omega`", "did you mean `Omega`?"),
        ("-u*Omgea", "Omgea", "unknown name `Omgea`", "did you mean `Omega`?"),
        ("-u*tanh", "tanh", "unknown name `tanh`", "write `tanh(x)`"),
        ("-u*cos(Omega*t)", "t", "unknown name `t`", "do not depend on time"),
        ("-u*radius", "radius", "is an output", "definitions"),
        ("-u*(r - 1", "(", "never closed", "add the missing `)`"),
        ("-u*tanh(r - 1", "(", "never closed", "add the missing `)`"),
        ("-u*r - 1)", ")", "closes nothing", "remove it"),
        ("-u*atan2(v)", "atan2(v)", "takes 2 arguments, 1 given", "write `atan2(y, x)`"),
        ("-u*sin(u, v)", "sin(u, v)", "takes 1 argument, 2 given", "write `sin(x)`"),
        ("-u*if(u, v)", "if(u, v)", "takes 3 arguments, 2 given", "write `if(condition, then, else)`"),
        ("-u*sin()", "sin()", "takes 1 argument, 0 given", "write `sin(x)`"),
        ("2u", "2u", "runs into `u`", "`2*u`"),
        ("-u r", "r", "operator is missing", "write `*`"),
        ("-u(2)", "u", "no function `u`", "`u` is a state"),
        ("(u)(v)", "(", "operator is missing", "write `*`"),
        ("-u*", "", "ends where a value is expected", "write a number"),
        ("-u**2", "**", "not an operator", "write `^`"),
        ("*u", "*", "unexpected `*`", "a value is expected"),
        ("u = v", "=", "unexpected character `=`", "`==`"),
        ("u < v < 1", "<", "cannot be chained", "product"),
        ("1,5*u", ",", "comma", "decimal point"),
        ("(1,5)*u", ",", "comma", "decimal point"),
        ("1.5.2*u", "1.5.", "two decimal points", "one decimal point"),
        ("1e400*u", "1e400", "too large", "1.8e308"),
        ("u·v", "·", "unexpected character", "write `*`"),
        ("", "", "empty", "write a formula"),
    ];
    for (expression, place, message, hint) in cases {
        let found = in_equation(expression);
        assert_eq!(found.0, place, "{expression}: {found:?}");
        assert!(found.1.contains(message), "{expression}: {found:?}");
        assert!(found.2.contains(hint), "{expression}: {found:?}");
    }
}

#[test]
fn equations_and_states_belong_together() {
    let mut source = oscillator();
    source.equations[1].name = "w".into();
    let found = errors(source);
    assert_eq!(found.len(), 2);
    assert_eq!(found[0].item, Item::Equation(1));
    assert!(found[0].message.contains("`w`, which is not a declared state"), "{found:?}");
    assert_eq!(found[1].item, Item::State(1));
    assert!(found[1].message.contains("the state `v` has no equation"), "{found:?}");

    let mut source = oscillator();
    source.equations.push(Definition::new("u", "1"));
    assert!(only(source).message.contains("second equation"));
}

#[test]
fn names_are_unique_and_free() {
    let mut source = oscillator();
    source.definitions.push(Definition::new("K", "1"));
    let error = only(source);
    assert_eq!((error.item, error.field), (Item::Definition(1), Field::Name));
    assert!(error.message.contains("`K` is used twice: it is a parameter already"), "{error:?}");

    for (name, part) in [("sin", "name of a function"), ("pi", "constant"), ("2x", "not a name"), ("", "not a name")] {
        let mut source = oscillator();
        source.parameters[1].name = name.into();
        let error = only(source);
        assert_eq!(error.item, Item::Parameter(1));
        assert!(error.message.contains(part), "{error:?}");
    }

    let mut source = oscillator();
    source.outputs.push(Output::new("u", "u"));
    assert!(only(source).message.contains("the name of a state"));
}

#[test]
fn definitions_in_a_circle() {
    let mut source = oscillator();
    source.definitions.extend([Definition::new("p", "q + 1"), Definition::new("q", "r*p")]);
    let error = only(source);
    assert!(error.message.contains("p → q → p") || error.message.contains("q → p → q"), "{error:?}");
    assert!(matches!(error.item, Item::Definition(1 | 2)) && error.span.is_some());

    let mut source = oscillator();
    source.definitions.push(Definition::new("s", "s + 1"));
    assert!(only(source).message.contains("s → s"));
}

#[test]
fn numbers_make_sense() {
    let mut source = oscillator();
    source.states[0].range = [1.0, -1.0];
    let error = only(source);
    assert_eq!((error.item, error.field), (Item::State(0), Field::Range));
    assert!(error.message.contains("wrong way round") && error.hint.contains("[-1, 1]"), "{error:?}");

    let mut source = oscillator();
    source.states[1].scale = 0.0;
    assert_eq!(only(source).field, Field::Scale);

    let mut source = oscillator();
    source.parameters[0].value = f64::NAN;
    assert_eq!(only(source).field, Field::Value);
}

#[test]
fn the_signal_is_made_of_two_states() {
    let mut source = oscillator();
    source.whirl = Some(["u".into(), "r".into()]);
    assert_eq!(only(source).item, Item::Whirl);
    let mut source = oscillator();
    source.whirl = Some(["u".into(), "u".into()]);
    assert!(only(source).message.contains("same state"));
}

#[test]
fn all_mistakes_are_said_at_once() {
    let mut source = oscillator();
    source.equations[0].expression = "v + w".into();
    source.equations[1].expression = "-(u".into();
    source.outputs[0].expression = "hypot(u)".into();
    let found = errors(source);
    assert_eq!(
        found.iter().map(|e| e.item).collect::<Vec<_>>(),
        [Item::Equation(0), Item::Equation(1), Item::Output(0)]
    );
    assert!(found[0].to_string().starts_with("the equation of `u`, byte 5: unknown name `w` ("), "{}", found[0]);
}

#[test]
fn a_model_without_states_is_none() {
    let source = ModelSource { name: "empty".into(), ..ModelSource::default() };
    assert!(only(source).message.contains("no state"));
}
