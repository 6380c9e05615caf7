//! Mistakes of the first hour: files that are no text, habits of other languages and programs, commands on the wrong thing.

use crate::mistakes::{Desk, says};

#[test]
fn files_that_are_not_utf_8_text_are_named_for_what_they_are() {
    let desk = Desk::new();
    let text = std::fs::read_to_string(desk.path("pendulum.toml")).unwrap();
    let utf16: Vec<u8> = format!("\u{feff}{text}").encode_utf16().flat_map(u16::to_le_bytes).collect();
    std::fs::write(desk.path("wide.toml"), utf16).unwrap();
    says(&desk.refused(&["check", "wide.toml"]), &["wide.toml", "UTF-16", "save the file as UTF-8 text"]);
    let latin1 = [text.as_bytes(), b"# Schwingf\xe4hig\n"].concat();
    std::fs::write(desk.path("latin.toml"), latin1).unwrap();
    let place = format!("latin.toml:{}:11", text.lines().count() + 1);
    says(&desk.refused(&["check", "latin.toml"]), &[&place, "not UTF-8 text", "save the file as UTF-8 text"]);
    // A byte order mark and line ends of Windows are no mistakes.
    desk.write("pendulum.toml", &format!("\u{feff}{}", text.replace('\n', "\r\n")));
    assert_eq!(desk.foldline(&["check", "pendulum.toml"]).status.code(), Some(0));
}

#[test]
fn a_folder_or_a_run_where_a_file_is_wanted_leads_on() {
    let desk = Desk::new();
    says(&desk.refused(&["run", "."]), &["this is a folder", "give a file in it, such as ./pendulum.toml"]);
    assert_eq!(desk.foldline(&["run", "study.toml"]).status.code(), Some(0));
    let folder = desk.refused(&["run", "runs/study"]);
    says(&folder, &["the folder of a run, not a study file", "`foldline table runs/study`", "--resume"]);
    says(
        &desk.refused(&["run", "runs/study/run.sqlite"]),
        &["a database, such as a run file", "`foldline table runs/study`"],
    );
    let table = desk.refused(&["table", "study.toml"]);
    says(&table, &["study.toml is a file, not the folder of a run", "runs/study"]);
    says(&desk.refused(&["view", "runs/none"]), &["neither a run nor a study or model", "runs/study"]);
}

#[test]
fn a_file_or_a_foreign_word_in_place_of_the_command_is_recognised() {
    let desk = Desk::new();
    says(&desk.refused(&["study.toml"]), &["the command is missing", "`foldline run study.toml`"]);
    says(&desk.refused(&["pendulum.toml"]), &["the command is missing", "`foldline explore pendulum.toml --free"]);
    says(&desk.refused(&["continue", "study.toml"]), &["no command `continue`", "`foldline run STUDY.toml`"]);
    says(&desk.refused(&["version"]), &["`foldline --version`"]);
    // An unknown option brings no advice on how to pass it as a value.
    let option = desk.refused(&["export", "runs/study", "--format", "csv", "--to", "x"]);
    assert!(!option.contains("as a value"), "{option}");
    says(&desk.refused(&["simulate", "pendulum.toml", "--time", "-1"]), &["--time -1: not a positive time"]);
}

#[test]
fn a_file_of_another_language_is_recognised() {
    let desk = Desk::new();
    desk.write("model.py", "def f(x):\n    return x\n");
    says(&desk.refused(&["check", "model.py"]), &["this is a Python file", "@foldline.model"]);
    desk.write("readme.md", "# Title\n\nA program for people.\n");
    says(&desk.refused(&["run", "readme.md"]), &["this is a Markdown file", "`foldline new oscillator`"]);
    // A sentence is no key with a value.
    desk.write("prose.toml", "This program computes diagrams of equations: it continues cycles\n");
    says(&desk.refused(&["run", "prose.toml"]), &["the file must be TOML"]);
    desk.write("lor.f90", "      SUBROUTINE FUNC(NDIM,U,ICP,PAR)\n");
    says(&desk.refused(&["check", "lor.f90"]), &["this is a Fortran file", "`foldline import-auto`"]);
}

#[test]
fn slips_in_toml_are_answered_with_the_line_as_it_should_be() {
    let desk = Desk::new();
    for (wrong, right) in [
        ("mu = 0,5", "`mu = 0.5`"),
        ("mu = .5", "`mu = 0.5`"),
        ("mu: 0.5", "`mu = 0.5`"),
        ("mu = 1/2", "`mu = 0.5`"),
        ("mu = 0.5;", "`mu = 0.5`"),
        ("mu = 0.5 // start", "write comments with `#`"),
        ("mu =", "`mu = …`"),
        ("μ = 0.5", "`\"μ\" = …`"),
    ] {
        says(&desk.model("mu = 0.5", wrong), &["pendulum.toml:5:", right]);
    }
    says(&desk.model("\"y\"\nrange", "“y”\nrange"), &["pendulum.toml:9:", "straight quotation marks"]);
    says(&desk.model("\"y\"\nrange", "\"y\nrange"), &["pendulum.toml:9:", "the missing `\"`"]);
    says(&desk.study("\"mu\"", "mu"), &["study.toml:11:8", "text without quotes", "`free = \"mu\"`"]);
    says(&desk.study("[-1, 2]", "[-1, 2*pi]"), &["study.toml:12:", "`range = [-1.0, 6.283185307179586]`"]);
    says(&desk.study("[-1, 2]", "(-1, 2)"), &["study.toml:12:", "`range = [-1, 2]`"]);
    says(&desk.study("free = \"mu\"", "free = \"mu\"\nfree = \"mu\""), &["study.toml:12:1", "`free` is given twice"]);
    says(&desk.study("\"pendulum.toml\"", "\"sub\\model.toml\""), &["study.toml:1:", "write a path with `/`"]);
}

#[test]
fn notations_of_other_languages_in_an_expression_are_translated() {
    let desk = Desk::new();
    for (wrong, right) in [
        ("mu.*x", "write `*`"),
        ("x.^2", "write `^`"),
        ("x**2", "write `^`"),
        ("np.sin(x)", "`sin(…)`"),
        ("p.mu*x", "`mu`"),
        ("sin^2(x)", "`sin(…)^2`"),
        ("x if x > 0 else 0", "`if(condition, then, else)`"),
        ("x > 0 ? x : 0", "`if(condition, then, else)`"),
        ("x > 0 and y > 0", "`*` for and"),
        ("not x", "`1 - (c)`"),
        ("|x|", "`abs(x)`"),
        ("x % 2", "`mod(a, b)`"),
        ("e^x", "`exp(x)`"),
        ("π*x", "`pi`"),
        ("x²", "`x^2`"),
        ("x'' = -x", "under [states]"),
        ("y' = mu*x", "remove `y' =`"),
        ("dy/dt = mu*x", "remove `dy/dt =`"),
        ("1_000*x", "`1000`"),
        ("alpha*x", "declare it under [parameters]"),
    ] {
        says(&desk.model("mu*x", wrong), &["pendulum.toml:13:", right]);
    }
}

#[test]
fn names_of_the_field_and_of_other_programs_are_translated() {
    let desk = Desk::new();
    let seed = |by: &str| desk.study("state = { x = 0.7, y = 0 }", by);
    says(&seed("attractor = \"limit cycle\""), &["study.toml:6:13", "write \"cycle\""]);
    says(&seed("attractor = \"steady state\""), &["write \"equilibrium\""]);
    says(&seed("state = [0.7, 0]"), &["study.toml:6:9", "`state = { x = …, y = … }`"]);
    says(&seed("equilibrium = { x = 0, y = 0 }"), &["the key for this is `state`"]);
    let branch = |line: &str| desk.study("range = [-1, 2]", &format!("range = [-1, 2]\n{line}"));
    says(&branch("switch = \"HB\""), &["study.toml:13:10", "`switch = { hopf = 1 }`"]);
    says(&branch("switch = { flip = 1 }"), &["study.toml:13:12", "write `period-doubling`"]);
    says(&branch("direction = -1"), &["study.toml:13:1", "in both directions"]);
    let curve = |lines: &str| branch(&format!("[[curve]]\nname = \"c\"\nfree = \"kappa\"\nrange = [0.5, 2]\n{lines}"));
    says(&curve("hold = \"saddle-node\"\nof = \"main\""), &["study.toml:17:8", "write \"fold\""]);
    says(&curve("hold = \"fold\"\nfrom = \"main\""), &["study.toml:18:1", "the key for this is `of`"]);
    says(&desk.study("free = \"mu\"", "free = \"x\""), &["`x` is a state; the parameters are: mu, kappa"]);
    says(&desk.study("[-1, 2]", "[-1e200, 1e200]"), &["study.toml:12:9", "too wide"]);
    says(&desk.study("\"pendulum.toml\"", "\"pendulm.toml\""), &["study.toml:1:9", "did you mean `pendulum.toml`?"]);
}

#[test]
fn tables_of_a_model_and_wishes_for_pictures_in_a_study_are_told_their_place() {
    let desk = Desk::new();
    let study = |table: &str| desk.study("[[branch]]", &format!("{table}\n[[branch]]"));
    says(&study("[forcing]\nfrequency = \"mu\"\n"), &["unknown key `forcing`", "this belongs to the model"]);
    says(&study("[plot]\nx = \"mu\"\n"), &["unknown key `plot`", "`foldline plot runs/NAME -o FILE.svg`"]);
    says(&study("[[optimise]]\nname = \"o\"\n"), &["the key for this is `design`"]);
}

#[test]
fn a_seed_of_the_wrong_kind_is_told_the_other_one() {
    let desk = Desk::new();
    let study = std::fs::read_to_string(desk.path("study.toml")).unwrap();
    let with = |attractor: &str| study.replace("state = { x = 0.7, y = 0 }", attractor);
    let short = |name: &str| {
        let output = desk.foldline(&["run", name]);
        assert_eq!(output.status.code(), Some(3));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    desk.write("cycle.toml", &with("attractor = \"cycle\""));
    says(&short("cycle.toml"), &["no stable cycle", "come to rest", "`attractor = \"equilibrium\"`"]);
    let model = std::fs::read_to_string(desk.path("pendulum.toml")).unwrap();
    desk.write("pendulum.toml", &model.replace("mu*x - kappa*x^3 - y", "mu*(1 - x^2)*y - kappa*x"));
    desk.write("rest.toml", &with("attractor = \"equilibrium\""));
    says(&short("rest.toml"), &["no stable equilibrium", "unstable at these parameter values", "give a `state`"]);
}
