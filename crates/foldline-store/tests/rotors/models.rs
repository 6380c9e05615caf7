//! Rotors of friswell2010, section 5.9.

/// Overhung rotor, example 5.9.9.
pub const R599: &str = r#"
[parameters]
Omega = { value = 100, unit = "rad/s" }

[rotor]
speed = "Omega"

[[material]]
name = "steel"
E = "211 GPa"
G = "81.2 GPa"
density = "7810 kg/m^3"

[[shaft]]
length = "1.5 m"
elements = 6
diameter = "50 mm"
material = "steel"

[[disc]]
node = 6
outer = "350 mm"
inner = "50 mm"
width = "70 mm"

[[bearing]]
node = 0
k = "1e7 N/m"

[[bearing]]
at = "1 m"
k = "1e7 N/m"
"#;

/// Model text of one of the rotors.
pub fn rotor(name: &str) -> String {
    let simple = R599.split("[[disc]]").next().unwrap();
    let disc = |node: u32, outer: &str| {
        format!("[[disc]]\nnode = {node}\nouter = \"{outer}\"\ninner = \"50 mm\"\nwidth = \"70 mm\"\n\n")
    };
    let bearings = |own: &str| format!("[[bearing]]\nnode = 0\n{own}\n\n[[bearing]]\nnode = 6\n{own}\n");
    let supported = |own: &str| format!("{simple}{}{}{}", disc(2, "280 mm"), disc(4, "350 mm"), bearings(own));
    match name {
        "R591" => supported("k = \"1e6 N/m\""),
        "R592" => supported("kxx = \"1e6 N/m\"\nkyy = \"8e5 N/m\""),
        "R595" => supported("k = \"1e6 N/m\"\nc = \"3e3 N s/m\""),
        "R599" => R599.to_string(),
        _ => panic!("{name}"),
    }
}
