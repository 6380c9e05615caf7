//! Every test of this crate that needs no access to its inside, as one program: it is linked once, and all tests share the
//! processors.

#[path = "auto/main.rs"]
mod auto;
mod basins;
mod designs;
mod emitted;
#[path = "export/main.rs"]
mod export;
mod growing_study;
mod hostile;
mod model_file;
mod model_language;
mod responses;
#[path = "rotors/main.rs"]
mod rotors;
mod run_file;
mod study_file;
mod symmetry;

#[test]
fn every_file_is_part_of_this_program() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let here = |file: String| {
        let folder = std::path::Path::new(folder).join(&file).join("main.rs");
        file.strip_suffix(".rs").map(String::from).or(folder.exists().then_some(file))
    };
    for name in files.filter_map(here).filter(|name| name != "main") {
        assert!(include_str!("main.rs").contains(&format!("\nmod {name};\n")), "tests/{name} is not run");
    }
}
