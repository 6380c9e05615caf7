//! Every test of this crate that needs no access to its inside, as one program: it is linked once, and all tests share the
//! processors.

mod accidents;
mod accounted;
mod angles;
mod auto;
mod basins_in_detail;
mod beginning;
mod book;
mod boundary;
mod branch_point_curves;
mod classical;
mod coefficient_errors;
mod connecting;
mod contact;
mod crossings;
mod curves;
mod design;
mod ends;
mod exchange;
mod explore;
mod fast_modes;
mod first_solutions;
mod forced;
mod friction;
mod gallery;
mod harmonics;
mod held;
mod homotopies;
mod impact;
mod impact_and_switches;
mod kinds;
mod large_rotors;
mod light_damping;
mod many_components;
mod maps;
mod marks;
mod mistakes;
mod neutral;
mod newcomers;
mod normal_forms;
mod null_spaces;
mod other_fields;
mod pages;
mod parameter_maps;
mod permuted;
mod pictures;
mod pulses;
mod quasi_periodic;
mod responses;
mod rotor;
mod runs;
mod scales;
mod sensitivities;
mod shaft;
mod shortfalls;
mod smoothed_laws;
mod stiff;
mod surveys;
mod susceptible;
mod switched_starts;
mod tables;
mod tori;
mod tori_folds;
mod tori_verified;
mod totals;
mod units;
mod verify;

#[test]
fn every_file_is_part_of_this_program() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    for name in files.filter_map(|file| file.strip_suffix(".rs").map(String::from)).filter(|name| name != "main") {
        assert!(include_str!("main.rs").contains(&format!("\nmod {name};\n")), "tests/{name}.rs is not run");
    }
}
