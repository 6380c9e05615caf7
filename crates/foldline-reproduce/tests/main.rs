//! Every test of this crate that needs no access to its inside, as one program: it is linked once, and all tests share the
//! processors.

mod figures;
mod limits;
mod simulation;

#[test]
fn every_file_is_part_of_this_program() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    for name in files.filter_map(|file| file.strip_suffix(".rs").map(String::from)).filter(|name| name != "main") {
        assert!(include_str!("main.rs").contains(&format!("\nmod {name};\n")), "tests/{name}.rs is not run");
    }
}

/// The copy is what a published package contains, which cannot reach files outside its folder.
#[test]
fn the_model_is_a_copy_of_that_among_the_models() {
    let [own, common] =
        [include_str!("../models/overhung-rotor.toml"), include_str!("../../../models/overhung-rotor.toml")];
    assert!(own == common, "copy models/overhung-rotor.toml to crates/foldline-reproduce/models");
}
