//! `foldline new`: a commented model and study as a starting point.

use crate::arguments::New as Typed;
use crate::failure::{Failure, Outcome};
use foldline::contract::VectorField;
use foldline::model::Model;
use foldline_store::model_file::read_model;
use foldline_store::nearest::suggest;
use foldline_view::Example;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write, stdout};
use std::path::{Path, PathBuf};

/// A model with a study of it.
struct Template {
    name: &'static str,
    about: &'static str,
    model: &'static str,
    study: &'static str,
    /// Options of `foldline plot` for its picture.
    plot: &'static str,
}

macro_rules! template {
    ($name:literal, $about:literal, $plot:literal) => {
        Template {
            name: $name,
            about: $about,
            model: include_str!(concat!("../templates/", $name, "/model.toml")),
            study: include_str!(concat!("../templates/", $name, "/study.toml")),
            plot: $plot,
        }
    };
}

const TEMPLATES: [Template; 4] = [
    template!(
        "oscillator",
        "a forced oscillator with an elastic stop: resonance curve, jumps, sweeps",
        "-o resonance.png --y x_max"
    ),
    template!(
        "rotor",
        "a Jeffcott rotor that touches a ring, in SI units: unbalance response, run-up and run-down",
        "-o speed.png --y r_max --unit Omega=rpm --unit r=mm"
    ),
    template!(
        "neuron",
        "a Morris-Lecar neuron: rest, firing, and the onset of firing in two parameters",
        "-o firing.png --y V_max"
    ),
    template!("chain", "a driven chain of masses: repetition, resonances", "-o chain.png --y tip_max"),
];

/// Writes the files of a template, or a study for a model; without either, lists the templates.
pub fn write(typed: &Typed) -> Result<Outcome, Failure> {
    match (&typed.template, &typed.study) {
        (Some(name), _) => template(name, typed.out.as_deref()),
        (None, Some(model)) => study_of(model, typed.out.as_deref()),
        (None, None) => list(),
    }
}

fn list() -> Result<Outcome, Failure> {
    let mut out = stdout().lock();
    writeln!(out, "templates for `foldline new TEMPLATE`:")?;
    for own in &TEMPLATES {
        writeln!(out, "  {:<11} {}", own.name, own.about)?;
    }
    writeln!(out, "`foldline new --study MODEL.toml` writes a study for an existing model")?;
    Ok(Outcome::Done)
}

fn template(name: &str, folder: Option<&Path>) -> Result<Outcome, Failure> {
    let Some(own) = TEMPLATES.iter().find(|own| own.name == name) else {
        let names: Vec<&str> = TEMPLATES.iter().map(|own| own.name).collect();
        return Err(Failure::typed(format!("there is no template `{name}`"), suggest(name, &names)));
    };
    let folder = folder.unwrap_or(Path::new(name));
    let files = [("model.toml", own.model), ("study.toml", own.study)].map(|(file, text)| (folder.join(file), text));
    create(&files)?;
    let mut out = stdout().lock();
    writeln!(out, "wrote {} and {}", files[0].0.display(), files[1].0.display())?;
    let at = if folder == Path::new(".") { String::new() } else { format!("cd {}\n  ", folder.display()) };
    writeln!(out, "next:\n  {at}foldline run study.toml\n  foldline plot runs/study {}", own.plot)?;
    Ok(Outcome::Done)
}

fn study_of(file: &Path, folder: Option<&Path>) -> Result<Outcome, Failure> {
    let (model, _) = read_model(file)?;
    let beside = file.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = folder.unwrap_or(beside);
    // The study names a model in its own folder by file name, any other by full path.
    let named = match (std::path::absolute(beside)? == std::path::absolute(folder)?, file.file_name()) {
        (true, Some(name)) => PathBuf::from(name),
        _ => std::path::absolute(file)?,
    };
    let target = folder.join("study.toml");
    let text = study_text(&model, &named)?;
    create(&[(target.clone(), &text)])?;
    let mut out = stdout().lock();
    writeln!(out, "wrote {}", target.display())?;
    writeln!(
        out,
        "next: adjust the range, then\n  foldline run {}\n  foldline plot runs/study -o diagram.png",
        target.display()
    )?;
    Ok(Outcome::Done)
}

/// A study with one branch in the first parameter.
pub fn study_text(model: &Model, file: &Path) -> Result<String, Failure> {
    let Some(free) = model.parameters.first() else {
        let message = "the model has no parameter in which to follow a branch";
        return Err(Failure::typed(message, "add one, such as `mu = 1` under `[parameters]`"));
    };
    let quoted = |text: &str| serde_json::Value::from(text).to_string();
    let around = |value: f64| match value {
        0.0 => [-1.0, 1.0],
        v if v > 0.0 => [0.5 * v, 2.0 * v],
        v => [2.0 * v, 0.5 * v],
    };
    let [low, high] = around(free.value);
    let (attractor, switch, found) = match model.forced() {
        true if model.iterated() => {
            ("cycle", "period-doubling = 2", "the cycle or fixed point that orbits reach at the values of the model")
        }
        true => ("cycle", "period-doubling = 1", "the cycle that trajectories reach at the values of the model"),
        false => (
            "equilibrium",
            "hopf = 1",
            "the equilibrium that trajectories reach at the values of the model; if they oscillate there, write \"cycle\"",
        ),
    };
    let (model, free) = (quoted(&file.display().to_string()), quoted(&free.name));
    Ok(format!(
        "# What to compute; the keys are described in docs/book/study-files.md.\n\nmodel = {model}\n\n\
         # A first solution: {found}.\n[[seed]]\nname = \"first\"\nattractor = \"{attractor}\"\n\n\
         # The solution is followed in a parameter, stable or not, and so are the branches that bifurcate from it.\n\
         [[branch]]\nname = \"main\"\nfrom = \"first\"\nfree = {free}\nrange = [{low:?}, {high:?}]\n\
         switch = {{ {switch} }}\n"
    ))
}

/// The templates and, in a clone of the repository, its models, as examples to begin with.
pub fn examples() -> Vec<Example> {
    let templates = TEMPLATES.iter().map(|own| Example {
        name: own.name.to_string(),
        about: own.about.to_string(),
        model: own.model.to_string(),
        study: own.study.to_string(),
    });
    let mut files: Vec<PathBuf> = std::fs::read_dir("models")
        .into_iter()
        .flatten()
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| path.extension().is_some_and(|end| end == "toml"))
        .collect();
    files.sort();
    let example = |file: &PathBuf| {
        let (model, text) = read_model(file).ok()?;
        let study = study_text(&model, Path::new("model.toml")).ok()?;
        let about = model.description.split_whitespace().collect::<Vec<_>>().join(" ");
        let name = file.file_stem()?.to_string_lossy().into_owned();
        Some(Example { name, about, model: text, study })
    };
    templates.chain(files.iter().filter_map(example)).collect()
}

/// Writes new files; writes none if one of them already exists.
fn create(files: &[(PathBuf, &str)]) -> Result<(), Failure> {
    if let Some((file, _)) = files.iter().find(|(file, _)| file.exists()) {
        let message = format!("{} already exists and is not overwritten", file.display());
        return Err(Failure::typed(message, "choose another folder with --out"));
    }
    for (file, text) in files {
        let refused = |error: std::io::Error| {
            let cure = "choose a writable folder with --out";
            match error.kind() {
                ErrorKind::PermissionDenied
                | ErrorKind::NotADirectory
                | ErrorKind::NotFound
                | ErrorKind::ReadOnlyFilesystem
                | ErrorKind::AlreadyExists => Failure::typed(format!("cannot write {}: {error}", file.display()), cure),
                _ => Failure::Outside(format!("cannot write {}: {error}", file.display())),
            }
        };
        if let Some(folder) = file.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).map_err(refused)?;
        }
        let mut file = OpenOptions::new().write(true).create_new(true).open(file).map_err(refused)?;
        file.write_all(text.as_bytes())?;
    }
    Ok(())
}
