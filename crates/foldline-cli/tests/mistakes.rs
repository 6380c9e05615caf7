//! Every mistake in the input is reported with its place, cause and remedy, and exit code 2.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const MODEL: &str = r#"name = "pendulum"
description = "A driven pendulum in a rotating frame"

[parameters]
mu = 0.5
kappa = { value = 1.0, description = "stiffness" }

[states.x]
equation = "y"
range = [-2, 2]

[states.y]
equation = "mu*x - kappa*x^3 - y"
range = [-2, 2]

[outputs]
r = "hypot(x, y)"
"#;

const STUDY: &str = r#"model = "pendulum.toml"
tolerance = 1e-6

[[seed]]
name = "rest"
state = { x = 0.7, y = 0 }

[[branch]]
name = "main"
from = "rest"
free = "mu"
range = [-1, 2]
"#;

/// Folder with a model and a study.
pub struct Desk {
    folder: tempfile::TempDir,
}

impl Desk {
    /// Returns a folder with a correct model and study.
    pub fn new() -> Desk {
        let desk = Desk { folder: tempfile::tempdir().unwrap() };
        desk.write("pendulum.toml", MODEL);
        desk.write("study.toml", STUDY);
        desk
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    pub fn foldline(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(self.folder.path()).output().unwrap()
    }

    /// Returns the message of a command that must fail with exit code 2.
    pub fn refused(&self, arguments: &[&str]) -> String {
        let output = self.foldline(arguments);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(!message.contains("panicked"), "{message}");
        message
    }

    /// Returns the message for the study with one piece of it replaced.
    pub fn study(&self, piece: &str, by: &str) -> String {
        self.refuse_changed("study.toml", STUDY, piece, by)
    }

    /// Returns the message for the model with one piece of it replaced.
    pub fn model(&self, piece: &str, by: &str) -> String {
        self.refuse_changed("pendulum.toml", MODEL, piece, by)
    }

    fn refuse_changed(&self, file: &str, text: &str, piece: &str, by: &str) -> String {
        assert_eq!(text.matches(piece).count(), 1, "{piece:?} must stand once in {file}");
        self.write(file, &text.replace(piece, by));
        let checked = self.refused(&["check", file]);
        let run = self.refused(&["run", "study.toml"]);
        assert!(!self.path("runs").exists(), "nothing is written before the input is right");
        self.write(file, text);
        assert!(run.contains(first_line(&checked)), "run says the same as check:\n{run}\n{checked}");
        checked
    }
}

fn first_line(message: &str) -> &str {
    message.lines().next().unwrap_or("")
}

/// Asserts that a message contains all of the given pieces.
#[track_caller]
pub fn says(message: &str, pieces: &[&str]) {
    for piece in pieces {
        assert!(message.contains(piece), "\"{piece}\" is missing in:\n{message}");
    }
}

#[test]
fn the_unmodified_files_are_correct() {
    let desk = Desk::new();
    for file in ["pendulum.toml", "study.toml"] {
        let output = desk.foldline(&["check", file]);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        says(&String::from_utf8_lossy(&output.stdout), &[file, "is valid", "pendulum"]);
    }
}

#[test]
fn an_unknown_parameter_is_refused() {
    let desk = Desk::new();
    says(&desk.study("free = \"mu\"", "free = \"nu\""), &["study.toml:11:8", "no parameter `nu`", "did you mean `mu`"]);
    let overrides = desk.study("tolerance = 1e-6", "parameters = { kapa = 3 }");
    says(&overrides, &["study.toml:2:16", "no parameter `kapa`", "did you mean `kappa`"]);
}

#[test]
fn a_reversed_range_is_refused() {
    let message = Desk::new().study("[-1, 2]", "[2, -1]");
    says(&message, &["study.toml:12:9", "wrong way round", "write [-1, 2]"]);
}

#[test]
fn a_range_that_does_not_contain_the_start_is_refused() {
    let message = Desk::new().study("[-1, 2]", "[1, 2]");
    says(&message, &["study.toml:12:9", "starts at mu = 0.5, outside its range", "a range that contains 0.5"]);
}

#[test]
fn an_unknown_origin_and_one_further_down_are_refused() {
    let desk = Desk::new();
    says(
        &desk.study("\"rest\"\nfree", "\"test\"\nfree"),
        &["study.toml:10:8", "no seed, branch, curve or homotopy \"test\"", "did you mean `rest`"],
    );
    let above = "[[branch]]\nname = \"early\"\nfrom = \"main\"\nfree = \"kappa\"\nrange = [0, 2]\n";
    let message = desk.study("[[branch]]\n", &format!("{above}[[branch]]\n"));
    says(&message, &["study.toml:10:8", "\"main\" is defined further down", "defined above it"]);
    let own = desk.study("\"rest\"\nfree", "\"main\"\nfree");
    says(&own, &["\"main\" is defined further down", "defined above it"]);
}

#[test]
fn duplicate_names_are_refused() {
    let message = Desk::new().study("name = \"main\"", "name = \"rest\"");
    says(&message, &["study.toml:9:8", "\"rest\" is used twice", "a name of its own"]);
}

#[test]
fn a_tolerance_that_is_out_of_bounds_or_no_number_is_refused() {
    let desk = Desk::new();
    says(&desk.study("1e-6", "0.5"), &["study.toml:2:13", "5e-1 is out of range", "from 1e-10 to 1e-4"]);
    says(&desk.study("1e-6", "\"small\""), &["study.toml:2:13", "not a number", "write a number"]);
    says(&desk.study("1e-6", "nan"), &["study.toml:2:13", "not a finite number"]);
}

#[test]
fn unknown_keys_and_kinds_are_refused() {
    let desk = Desk::new();
    says(
        &desk.study("tolerance =", "tolerence ="),
        &["study.toml:2:1", "unknown key `tolerence`", "did you mean `tolerance`"],
    );
    let switch = desk.study("range = [-1, 2]", "range = [-1, 2]\nswitch = { period-dubling = 2 }");
    says(&switch, &["study.toml:13:12", "\"period-dubling\"", "did you mean `period-doubling`"]);
    let fold = desk.study("range = [-1, 2]", "range = [-1, 2]\nswitch = { fold = 1 }");
    says(&fold, &["no branch of equilibria or cycles starts at a fold", "hopf"]);
}

#[test]
fn under_and_overspecified_seeds_are_refused() {
    let desk = Desk::new();
    says(
        &desk.study("state = { x = 0.7, y = 0 }", ""),
        &["study.toml:4:1", "this seed names no solution", "attractor = "],
    );
    says(&desk.study(", y = 0 }", " }"), &["study.toml:6:9", "lacks y", "x, y"]);
    says(&desk.study("y = 0 }", "y = 0, z = 1 }"), &["study.toml:6:27", "no state `z`"]);
    says(
        &desk.study("state = {", "attractor = \"2:1\"\nstate = {"),
        &["both an `attractor` and a `state`", "keep one"],
    );
    says(&desk.study("state = { x = 0.7, y = 0 }", "attractor = \"2;1\""), &["study.toml:6:13", "\"2:1\""]);
    says(&desk.study("state = { x = 0.7, y = 0 }", "attractor = \"2:1\""), &["does not name", "whirl ="]);
}

#[test]
fn several_mistakes_are_reported_at_once() {
    let desk = Desk::new();
    desk.write("study.toml", &STUDY.replace("1e-6", "1").replace("[-1, 2]", "[2, -1]").replace("\"mu\"", "\"nu\""));
    let message = desk.refused(&["check", "study.toml"]);
    says(&message, &["out of range", "wrong way round", "no parameter `nu`"]);
}

#[test]
fn mistakes_in_curves_and_homotopies_are_reported() {
    let desk = Desk::new();
    let added = "range = [-1, 2]\n\n[[curve]]\nname = \"folds\"\nhold = \"fold\"\nof = \"main\"\nfree = \"kappa\"\nuntil = 2\n\n\
                 [[homotopy]]\nname = \"way\"\nfrom = \"rest\"\nto = { kappa = 3 }\nvia = \"mu\"\nrange = [-1, 2]\n";
    desk.write("more.toml", &STUDY.replace("range = [-1, 2]\n", added));
    let output = desk.foldline(&["check", "more.toml"]);
    says(&String::from_utf8_lossy(&output.stdout), &["is valid", "1 seed, 1 branch, 1 curve, 1 homotopy"]);

    let spoilt = |piece: &str, by: &str| desk.study("range = [-1, 2]\n", &added.replacen(piece, by, 1));
    says(&spoilt("\"fold\"", "\"fld\""), &["study.toml:16:8", "\"fld\"", "did you mean `fold`"]);
    says(&spoilt("\"main\"", "\"rest\""), &["study.toml:17:6", "\"rest\" is a seed", "lies on a branch"]);
    says(&spoilt("free = \"kappa\"", "free = \"mu\""), &["study.toml:18:8", "already", "such as `kappa`"]);
    says(
        &spoilt("via = \"mu\"", "via = \"kappa\""),
        &["study.toml:25:7", "part of the goal", "remove kappa from `to`"],
    );
    let both = spoilt("kappa = 3 }\nvia = \"mu\"", "kapa = 3 }\nvia = \"nu\"");
    says(&both, &["study.toml:24:8", "did you mean `kappa`", "study.toml:25:7", "no parameter `nu`"]);
}

#[test]
fn files_that_are_missing_or_not_toml_are_reported() {
    let desk = Desk::new();
    says(&desk.refused(&["run", "nowhere.toml"]), &["nowhere.toml", "cannot be read", "path"]);
    says(&desk.refused(&["check", "nowhere.toml"]), &["nowhere.toml", "cannot be read"]);
    says(&desk.refused(&["attractors", "nowhere.toml"]), &["nowhere.toml", "cannot be read"]);
    says(
        &desk.study("\"pendulum.toml\"", "\"pendel.toml\""),
        &["study.toml:1:9", "pendel.toml", "relative to the folder"],
    );
    says(&desk.study("[-1, 2]", "[-1, 2"), &["study.toml:12:"]);
    desk.write("bytes.toml", "");
    std::fs::write(desk.path("bytes.toml"), [0xff, 0xfe, 0x00]).unwrap();
    says(&desk.refused(&["run", "bytes.toml"]), &["bytes.toml", "UTF-8"]);
}

#[test]
fn mistakes_in_a_model_are_reported_in_place() {
    let desk = Desk::new();
    let at = "pendulum.toml:13:";
    says(&desk.model("mu*x", "nu*x"), &[at, "nu", "mu"]);
    says(&desk.model("mu*x", "hypott(x, y)"), &[at, "hypott", "hypot"]);
    says(&desk.model("kappa*x^3 - y", "kappa*(x^3 - y"), &[at, "("]);
    says(&desk.model("[states.y]", "[states.z]"), &["pendulum.toml", "y"]);
}

#[test]
fn a_model_that_is_not_finite_at_the_start_is_refused() {
    let desk = Desk::new();
    desk.write("pendulum.toml", &MODEL.replace("mu*x - kappa*x^3 - y", "log(-1 - x^2)"));
    let pieces = ["pendulum.toml:13:12", "`y` is not finite at x = ", "mu = 0.5", "log or sqrt"];
    says(&desk.refused(&["check", "pendulum.toml"]), &pieces);
    says(&desk.refused(&["attractors", "pendulum.toml"]), &pieces);
    says(&desk.refused(&["run", "study.toml"]), &["study.toml:4:1", "\"rest\" cannot start", "pendulum.toml:13:12"]);
}

#[test]
fn a_seed_state_at_which_the_model_is_not_finite_is_refused() {
    let desk = Desk::new();
    desk.write("pendulum.toml", &MODEL.replace("mu*x - kappa*x^3 - y", "sqrt(1 - x) - y"));
    desk.write("study.toml", &STUDY.replace("x = 0.7", "x = 1.5"));
    let message = desk.refused(&["run", "study.toml"]);
    says(&message, &["study.toml:4:1", "\"rest\" cannot start", "x = 1.5", "pendulum.toml:13:12"]);
}

#[test]
fn a_folder_that_cannot_be_written_to_is_reported() {
    let desk = Desk::new();
    desk.write("occupied", "a file, not a folder");
    for out in ["occupied", "occupied/below"] {
        says(&desk.refused(&["run", "study.toml", "--out", out]), &["occupied", "--out DIR"]);
    }
}

#[test]
fn a_folder_with_a_run_is_not_overwritten() {
    let desk = Desk::new();
    std::fs::create_dir(desk.path("run")).unwrap();
    desk.write("run/run.sqlite", "precious");
    says(
        &desk.refused(&["run", "study.toml", "--out", "run"]),
        &["run.sqlite already exists", "--resume", "--out DIR"],
    );
    says(&desk.refused(&["run", "study.toml", "--out", "run", "--resume"]), &["not a foldline run file"]);
    assert_eq!(std::fs::read_to_string(desk.path("run/run.sqlite")).unwrap(), "precious");
}

#[test]
fn tables_and_plots_of_missing_runs_are_refused() {
    let desk = Desk::new();
    says(&desk.refused(&["table", "nowhere"]), &["there is no run file nowhere/run.sqlite", "foldline run"]);
    says(&desk.refused(&["plot", "nowhere", "-o", "a.svg"]), &["there is no run file"]);
}

#[test]
fn arguments_of_attractors_are_checked() {
    let desk = Desk::new();
    let set = |assignment: &str| desk.refused(&["attractors", "pendulum.toml", "--set", assignment]);
    says(&set("kapa=1"), &["--set kapa=1", "no parameter `kapa`", "did you mean `kappa`"]);
    says(&set("kappa"), &["--set kappa", "`=` is missing", "NAME=VALUE"]);
    says(&set("kappa=much"), &["`much` is neither a finite number", "a number such as"]);
    desk.refused(&["attractors", "pendulum.toml", "--samples", "0"]);
}

#[test]
fn unknown_commands_are_refused() {
    let desk = Desk::new();
    says(&desk.refused(&["rum", "study.toml"]), &["run"]);
    desk.refused(&["run"]);
    desk.refused(&["table", "x", "--format", "yaml"]);
    desk.refused(&["table", "x", "--points", "--branches"]);
}

#[test]
fn help_lists_the_exit_codes() {
    let output = Desk::new().foldline(&["--help"]);
    assert_eq!(output.status.code(), Some(0));
    says(
        &String::from_utf8_lossy(&output.stdout),
        &["Exit codes", "2 error in the input", "3 finished but incomplete"],
    );
}

#[test]
fn the_studies_of_this_repository_are_correct() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for study in ["bouncing", "homotopy"] {
        let file = root.join(format!("studies/overhung-rotor/{study}.toml"));
        let output = Desk::new().foldline(&["check", &file.display().to_string()]);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn the_curves_and_homotopies_of_the_book_are_correct() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = std::fs::read_to_string(root.join("docs/book/study-files.md")).unwrap();
    let blocks: Vec<&str> = page.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    let with = |table: &str| blocks.iter().find(|block| block.starts_with(table)).expect("the page has such a block");
    let study = blocks[0].replace("../../models/overhung-rotor.toml", "rotor.toml");
    let cubic = "[[branch]]\nname = \"cubic SL\"\nfrom = \"cubic SL at 5\"\nfree = \"Omega\"\nrange = [0.5, 12]\n";
    let curve = with("[[curve]]").replace("\"contact SL\"", "\"contact SL from the fold\"");
    let homotopy = with("[[homotopy]]").replace("\"contact SL\"", "\"contact SL by homotopy\"");
    let desk = Desk::new();
    std::fs::copy(root.join("models/overhung-rotor.toml"), desk.path("rotor.toml")).unwrap();
    desk.write("book.toml", &[&study[..], cubic, &curve, &homotopy].join("\n"));
    let output = desk.foldline(&["check", "book.toml"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    says(&String::from_utf8_lossy(&output.stdout), &["5 branches, 1 curve, 1 homotopy"]);
}

#[test]
fn mistakes_in_explorations_are_reported() {
    let desk = Desk::new();
    let explored = |lines: &str| desk.study("[[branch]]", &format!("[[explore]]\n{lines}\n[[branch]]"));
    let right = "name = \"all\"\nfree = \"mu\"\nrange = [0, 1]\n";
    says(&explored("free = \"mu\"\nrange = [0, 1]"), &["this exploration has no name"]);
    says(&explored("name = \"all\"\nfree = \"mu\""), &["this exploration has no `range`", "range = [0.5, 12]"]);
    says(&explored(&right.replace("mu", "my")), &["no parameter `my`", "did you mean `mu`"]);
    says(&explored(&right.replace("all", "main")), &["\"main\" is used twice"]);
    let inside = "name = \"main/hopf-1\"\nfree = \"mu\"\nrange = [0, 1]\n";
    says(&explored(inside), &["could have the same name as \"main\""]);
    says(&explored(&format!("{right}connect = {{ mu = [0, 1] }}")), &["`mu` is already the free parameter"]);
    says(&explored(&format!("{right}connect = {{ kappa = [2, 3] }}")), &["at kappa = 1", "a range that contains 1"]);
    says(&explored(&format!("{right}connect = {{ }}")), &["must name exactly one parameter"]);
    says(&explored(&format!("{right}values = 0")), &["`values`"]);
    says(
        &explored(&format!("{right}switch = {{ fold = 1 }}")),
        &["no branch of equilibria or cycles starts at a fold"],
    );
}

#[test]
fn arguments_of_explore_are_checked() {
    let desk = Desk::new();
    let told = |arguments: &[&str]| desk.refused(&[&["explore", "pendulum.toml"], arguments].concat());
    says(&told(&["--free", "mi=0:1"]), &["no parameter `mi`", "did you mean `mu`"]);
    says(&told(&["--free", "mu"]), &["`=` is missing", "--free NAME=LOW:HIGH"]);
    says(&told(&["--free", "mu=1"]), &["`:` is missing between two values"]);
    says(&told(&["--free", "mu=1:x"]), &["an end is neither a finite number"]);
    says(&told(&["--free", "mu=1:0"]), &["not smaller than the second"]);
    says(&told(&["--free", "mu=0:1", "--set", "kappa"]), &["`=` is missing"]);
    says(&told(&["--free", "mu=0:1", "--connect", "mu=0:1"]), &["this is already the parameter of --free"]);
    says(&told(&["--free", "mu=0:1", "--connect", "kappa=2:3"]), &["at kappa = 1", "a range that contains 1"]);
    says(&told(&["--free", "mu=0:1", "--tolerance", "1"]), &["tolerance", "1e-10 to 1e-4"]);
    says(&told(&["--free", "mu=0:1", "--set", "mu=1"]), &["this is the free parameter"]);
    let few = desk.foldline(&["explore", "pendulum.toml", "--free", "mu=-1:2", "--budget", "5", "--out", "few"]);
    says(&String::from_utf8_lossy(&few.stderr), &["the budget of 5 points is used up"]);
    assert_eq!(few.status.code(), Some(3));
    // The printed study gives the same result.
    let printed = desk.foldline(&["explore", "pendulum.toml", "--free", "mu=-1:2", "--values", "3", "--print"]);
    desk.write("all.toml", &String::from_utf8_lossy(&printed.stdout));
    let [own, other] = [
        desk.foldline(&["explore", "pendulum.toml", "--free", "mu=-1:2", "--values", "3", "--out", "a"]),
        desk.foldline(&["run", "all.toml", "--out", "b"]),
    ];
    assert_eq!(own.status.code(), Some(0), "{}", String::from_utf8_lossy(&own.stderr));
    assert_eq!(own.stdout, other.stdout);
    assert!(String::from_utf8_lossy(&own.stdout).contains("pendulum/equilibrium-1"));
}

#[test]
fn a_misnamed_table_is_the_only_mistake_reported() {
    let desk = Desk::new();
    for (word, hint) in [("params", "did you mean `parameters`?"), ("settings", "the key for this is `parameters`")] {
        let message = desk.model("[parameters]", &format!("[{word}]"));
        says(&message, &["pendulum.toml:4:2", &format!("unknown key `{word}` in the model"), hint]);
        assert_eq!(message.matches("error:").count(), 1, "{message}");
    }
}

#[test]
fn words_of_other_programs_lead_to_the_key_that_is_meant() {
    let desk = Desk::new();
    says(&desk.study("free = \"mu\"", "vary = \"mu\""), &["unknown key `vary`", "the key for this is `free`"]);
    says(&desk.study("from = \"rest\"", "start = \"rest\""), &["unknown key `start`", "the key for this is `from`"]);
    says(
        &desk.study("[[branch]]", "[[continuation]]"),
        &["unknown key `continuation`", "the key for this is `branch`"],
    );
}

#[test]
fn a_key_of_a_study_in_a_model_is_told_its_place() {
    let desk = Desk::new();
    let range = desk.model("mu = 0.5", "mu = { value = 0.5, range = [0, 1] }");
    says(&range, &["unknown key `range` in the parameter `mu`", "belong to the study", "[[branch]]"]);
    desk.write("named.toml", "model = \"decay\"\n[states]\nx = 1\n[equations]\n\"x'\" = \"-x\"\n");
    let named = desk.refused(&["check", "named.toml"]);
    says(&named, &["named.toml:1:1", "unknown key `model` in the model", "a model is called by its `name`"]);
}

#[test]
fn a_function_without_brackets_and_a_key_without_quotes_are_recognised() {
    let desk = Desk::new();
    says(&desk.model("\"hypot(x, y)\"", "\"sin x\""), &["an operator is missing", "`sin(…)`"]);
    let key = desk.model("[outputs]", "[equations]\nx' = \"y\"\n[outputs]");
    says(&key, &["write the name in quotes: `\"x'\" = …`"]);
}

#[test]
fn a_list_of_states_and_the_notations_of_a_derivative_are_recognised() {
    let desk = Desk::new();
    desk.write("list.toml", "states = [\"x\", \"v\"]\n[equations]\nx = \"v\"\nv = \"-x\"\n");
    let list = desk.refused(&["check", "list.toml"]);
    says(&list, &["list.toml:1:10", "`states` is a list, not a table", "`[states]`"]);
    assert_eq!(list.matches("error:").count(), 1, "{list}");
    for name in ["x'", "dx/dt", "dxdt", "dx_dt", "xdot", "x_dot", "dx"] {
        desk.write("rate.toml", &format!("[states]\nx = 1\n[equations]\n\"{name}\" = \"-x\"\n"));
        let rate = desk.refused(&["check", "rate.toml"]);
        says(&rate, &["rate.toml:4:1", "the rate of change of `x` is written `x = \"…\"`"]);
    }
}
