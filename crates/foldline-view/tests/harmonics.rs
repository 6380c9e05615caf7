//! Harmonics as axes: computed from the profiles when they are asked for.

use crate::common::{Served, run_of, split};
use foldline::diagram::Point;
use foldline::special::quantity::Quantity;
use foldline_store::study_file::{Study, parse_study};
use foldline_view::{Shown, html};

const MODEL: &str = "name = \"oscillator\"\n[parameters]\nF = 0.4\nOmega = 0.8\n[forcing]\nfrequency = \"Omega\"\n\
    [states.x]\nequation = \"v\"\n[states.v]\nequation = \"-x - x^3 - 0.1*v + F*cos(Omega*t)\"\n\
    [outputs]\na = \"x + 1\"\n";
const STUDY: &str = "model = \"oscillator.toml\"\n[[seed]]\nname = \"start\"\nattractor = \"cycle\"\nsamples = 4\n\
    [[branch]]\nname = \"main\"\nfrom = \"start\"\nfree = \"Omega\"\nrange = [0.6, 2.2]\n";

fn study() -> Study {
    parse_study(STUDY, "study.toml", MODEL, "oscillator.toml").expect("the study is right")
}

/// Header and columns of a frame with the given number of leading columns.
fn frame(bytes: &[u8], leading: usize) -> Vec<Vec<f64>> {
    let length = u32::from_le_bytes(bytes[..4].try_into().expect("four bytes")) as usize;
    let header: serde_json::Value = serde_json::from_slice(&bytes[8..8 + length]).expect("the header is JSON");
    let rows = header["rows"].as_u64().expect("a number") as usize;
    let columns = leading + header["columns"].as_array().expect("a list").len();
    let numbers: Vec<f64> = bytes[8 + length..].as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
    assert_eq!(numbers.len(), rows * columns);
    numbers.chunks(rows).map(<[f64]>::to_vec).collect()
}

#[test]
fn harmonics_of_points_and_special_points_are_those_of_their_profiles() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let path = folder.path().join("run");
    let (study, diagram) = (study(), run_of(&path, &study()));
    let branch = &diagram.branches[0];
    assert!(branch.special.len() >= 2, "the response has folds");
    let served = Served::new(&path);
    let cookie = served.enter();
    let run: serde_json::Value = serde_json::from_slice(&served.get("/api/run", &cookie)).expect("JSON");
    let listed = run["quantities"].as_array().expect("a list");
    let index = |name: &str| listed.iter().position(|own| own["name"] == name).unwrap_or_else(|| panic!("no {name}"));
    let names = ["x_h1", "x_h3_dB", "a_h1_phase", "x_max"];
    let columns = names.map(|name| index(name).to_string()).join(",");
    assert_eq!(listed[index("x_h3_dB")]["unit"], "dB");
    assert_eq!(listed[index("a_h1_phase")]["class"], "phase");
    let value = |name: &str, point: &Point| {
        Quantity::named(name, &study.model).and_then(|own| own.on(point, &study.model)).expect("a cycle has harmonics")
    };
    let found = frame(&served.get(&format!("/api/points?epoch=1&since=0&columns={columns}"), &cookie), 3);
    assert_eq!(found[1].len(), branch.points.len());
    for (row, point) in branch.points.iter().enumerate() {
        assert_eq!(found[1][row], point.position as f64);
        names.iter().zip(&found[3..]).for_each(|(name, column)| assert_eq!(column[row], value(name, point), "{name}"));
    }
    let found = frame(&served.get(&format!("/api/special?columns={columns}"), &cookie), 2);
    assert_eq!(found[1].len(), branch.special.len());
    for (row, special) in branch.special.iter().enumerate() {
        names.iter().zip(&found[2..]).for_each(|(name, column)| assert_eq!(column[row], value(name, &special.point)));
    }
}

#[test]
fn quantities_are_added_by_name_once_and_wrong_ones_are_refused() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let path = folder.path().join("run");
    let (study, diagram) = (study(), run_of(&path, &study()));
    let served = Served::new(&path);
    let cookie = served.enter();
    let post = |body: &str| {
        let (host, port, length) = (served.host(), served.port, body.len());
        let head = format!(
            "POST /api/quantity HTTP/1.1\r\n{host}\r\nOrigin: http://127.0.0.1:{port}\r\n{cookie}\r\n\
             Content-Type: application/json\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n"
        );
        split(&served.raw(format!("{head}{body}").as_bytes(), false))
    };
    let count = || {
        let run: serde_json::Value = serde_json::from_slice(&served.get("/api/run", &cookie)).expect("JSON");
        run["quantities"].as_array().expect("a list").len()
    };
    let before = count();
    let name = "x_h3/x_h1_dB";
    for _ in 0..2 {
        let (status, _, answer) = post(&serde_json::json!({ "name": name }).to_string());
        assert_eq!(status, 200, "{}", String::from_utf8_lossy(&answer));
        let answer: serde_json::Value = serde_json::from_slice(&answer).expect("JSON");
        assert_eq!(answer["index"].as_u64(), Some(before as u64));
    }
    let found = frame(&served.get(&format!("/api/points?epoch=1&since=0&columns={before}"), &cookie), 3);
    let quantity = Quantity::named(name, &study.model).expect("a ratio");
    let expected: Vec<Option<f64>> =
        diagram.branches[0].points.iter().map(|own| quantity.on(own, &study.model)).collect();
    assert_eq!(found[3].iter().map(|value| Some(*value)).collect::<Vec<_>>(), expected);
    let (status, _, answer) = post("{\"name\":\"x_h0\"}");
    assert_eq!(status, 409);
    assert!(String::from_utf8_lossy(&answer).contains("there is no quantity x_h0"));
    assert_eq!(post("{}").0, 400);
    assert_eq!(count(), before + 1);
}

#[test]
fn a_saved_page_has_the_harmonics_that_were_asked_for() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let path = folder.path().join("run");
    run_of(&path, &study());
    let shown = Shown { axes: vec!["x_h1_dB".into()], view: "#x=Omega&y=x_h1_dB".into(), ..Shown::default() };
    let (page, _) = html(&path, &shown).expect("the run can be read");
    assert!(page.contains("\"name\":\"x_h1_dB\"") && !page.contains("\"name\":\"x_h1\""));
    assert!(page.contains("id=\"data-view\">\"#x=Omega&y=x_h1_dB\"</script>"));
    let (plain, _) = html(&path, &Shown::default()).expect("the run can be read");
    assert!(!plain.contains("\"name\":\"x_h1_dB\"") && !plain.contains("id=\"data-view\""));
    // With a kernel behind it a page needs no orbits; otherwise it has those of all special points.
    let none = Shown { space: 0, special: false, ..Shown::default() };
    let (bare, amount) = html(&path, &none).expect("the run can be read");
    assert_eq!((amount.solutions, bare.matches("id=\"data-special-").count()), (0, 0));
    assert!(plain.matches("id=\"data-special-").count() >= 2);
    // The last value of each special point is the harmonic.
    let state =
        page.split("id=\"data-state\">").nth(1).and_then(|rest| rest.split("</script>").next()).expect("a state");
    let state: serde_json::Value = serde_json::from_str(state).expect("JSON");
    let special = state["state"]["special"].as_array().expect("a list");
    assert!(!special.is_empty());
    for own in special {
        assert!(own["values"].as_array().and_then(|all| all.last()?.as_f64()).is_some_and(f64::is_finite));
    }
}
