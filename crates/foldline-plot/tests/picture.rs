//! Pictures of a made-up diagram whose curves are known in closed form.

use foldline::diagram::{
    Branch, Cost, Cycle, Diagram, Ending, Family, Kind, Origin, Point, Solution, SpecialPoint, Trust,
};
use foldline::model::Model;
use foldline_plot::quantity::default_x;
use foldline_plot::{Picture, Quantity, curve, pdf, png, svg};
use foldline_store::model_file::parse_model;

fn model() -> Model {
    let text = "name = \"made up\"\n[parameters]\nOmega = 1.0\n[states.x]\nequation = \"-x\"\n[states.y]\nequation = \"-y\"\n\
                [outputs]\nr = \"hypot(x, y)\"\n";
    parse_model(text, "made-up.toml").expect("the model is right")
}

fn point(position: i64, omega: f64, r: f64, unstable: usize, cycle: bool) -> Point {
    let solution = match cycle {
        true => Solution::Cycle(Cycle {
            points: foldline::problem::gauss::Points::Gauss,
            period: 6.0 / omega,
            forcing_periods: 0,
            mesh: vec![0.0, 1.0].into(),
            degree: 1,
            profile: vec![0.0; 4],
            gain: Vec::new(),
        }),
        false => Solution::Equilibrium(vec![r, 0.0]),
    };
    Point {
        position,
        parameters: vec![omega],
        solution,
        tangent: Vec::new(),
        step: 0.1,
        spectrum: Vec::new(),
        unstable,
        ranges: vec![[-r, r], [-r, r], [0.5 * r, r]],
        averages: vec![[0.0, 0.5 * r * r], [0.0, 0.5 * r * r], [0.75 * r, 0.6 * r * r]],
        trust: Trust::default(),
        cost: Cost::default(),
    }
}

/// A resonance peak that leans over: amplitude 1/sqrt((1 - s²)² + c²), with s the position along the curve.
fn peak(name: &str, scale: f64) -> Branch {
    let mut branch = Branch::new(name, Family::Equilibrium, 0, Origin::Seed("start".into()));
    let at = |t: f64| {
        let r = scale / (0.08 + (t - 1.0).powi(2)).sqrt();
        [1.0 + 5.0 * t + 0.35 * r, r]
    };
    let folds = [0.83, 1.01];
    for k in 0..200 {
        let t = k as f64 / 100.0;
        let [omega, r] = at(t);
        branch.insert(point(k, omega, r, usize::from(t > folds[0] && t < folds[1]), false));
    }
    for (k, t) in folds.into_iter().enumerate() {
        let [omega, r] = at(t);
        let special = point((t * 100.0) as i64, omega, r, 0, false);
        branch.insert_special(SpecialPoint {
            kind: Kind::Fold,
            point: special,
            unstable_before: k,
            unstable_after: 1 - k,
            error: 1e-9,
            coefficients: Vec::new(),
            coefficient_errors: Vec::new(),
            remark: String::new(),
        });
    }
    branch.ends = [Some(Ending::Bound(0.5)), Some(Ending::Bound(12.0))];
    branch
}

/// A closed branch: an ellipse with two folds, two period doublings, a torus and a branch point on it.
fn isola(name: &str, centre: [f64; 2]) -> Branch {
    let mut branch = Branch::new(name, Family::Cycle, 0, Origin::Seed("start".into()));
    let at = |angle: f64| [centre[0] - 2.5 * angle.cos(), centre[1] + 1.6 * angle.sin() - 0.5 * angle.cos()];
    let specials = [
        (0.7, Kind::PeriodDoubling, 0, 1),
        (1.4, Kind::PeriodDoubling, 1, 0),
        (2.2, Kind::Torus, 0, 2),
        (2.7, Kind::Torus, 2, 0),
        (3.3, Kind::Fold, 0, 1),
        (4.5, Kind::BranchPoint, 1, 2),
        (5.2, Kind::BranchPoint, 2, 1),
        (6.1, Kind::Fold, 1, 0),
    ];
    let turn = std::f64::consts::TAU;
    for k in 0..120 {
        let angle = turn * k as f64 / 120.0;
        let unstable = specials.iter().rev().find(|s| s.0 < angle).map_or(0, |s| s.3);
        branch.insert(point(k, at(angle)[0], at(angle)[1], unstable, true));
    }
    for (angle, kind, unstable_before, unstable_after) in specials {
        let special = point((angle / turn * 120.0) as i64, at(angle)[0], at(angle)[1], 0, true);
        branch.insert_special(SpecialPoint {
            kind,
            point: special,
            unstable_before,
            unstable_after,
            error: 1e-9,
            coefficients: Vec::new(),
            coefficient_errors: Vec::new(),
            remark: String::new(),
        });
    }
    branch.ends = [Some(Ending::Closed), Some(Ending::Closed)];
    branch
}

fn diagram() -> Diagram {
    let origin = Origin::Switch { parent: "contact SL".into(), kind: Kind::PeriodDoubling, parameter: 4.1 };
    let mut doubled = Branch::new("contact SL/period-doubling 1", Family::Cycle, 0, origin);
    for k in 0..40 {
        let t = k as f64 / 39.0;
        doubled.insert(point(k, 4.1 + 1.45 * t, 4.1 + 1.5 * t - 2.0 * t * (t - 1.0), usize::from(k > 20), true));
    }
    let branches = vec![
        peak("cubic S", 1.0),
        peak("contact S", 1.6),
        isola("contact SL", [6.0, 4.0]),
        doubled,
        isola("contact DL", [8.5, 5.5]),
    ];
    Diagram { branches, ..Diagram::default() }
}

#[test]
fn the_curve_is_cut_exactly_at_the_special_points() {
    let (x, y) = (Quantity::Parameter(0), Quantity::Largest(2));
    let branch = peak("cubic S", 1.0);
    let pieces = curve::pieces(&branch, x, y, [12.0, 6.0]);
    assert_eq!(pieces.iter().map(|p| p.stable).collect::<Vec<_>>(), [true, false, true]);
    for (k, special) in branch.special.iter().enumerate() {
        let place = [x.of(&special.point).unwrap(), y.of(&special.point).unwrap()];
        assert_eq!(pieces[k].vertices.last(), Some(&place));
        assert_eq!(pieces[k + 1].vertices.first(), Some(&place));
    }
}

#[test]
fn a_closed_branch_is_drawn_closed() {
    let pieces =
        curve::pieces(&isola("contact SL", [6.0, 4.0]), Quantity::Parameter(0), Quantity::Largest(2), [12.0, 6.0]);
    assert_eq!(pieces[0].vertices.first(), pieces.last().unwrap().vertices.last());
}

/// Equilibria sin(r) = p with r an angle: the branch closes around the circle, a full turn from where it began.
#[test]
fn a_branch_that_closes_around_a_circle_is_not_drawn_back_across_it() {
    let mut branch = Branch::new("round", Family::Equilibrium, 0, Origin::Seed("start".into()));
    for k in 0..60 {
        let r = std::f64::consts::TAU * k as f64 / 60.0;
        branch.insert(point(k, r.sin(), r, 0, false));
    }
    branch.ends = [Some(Ending::Closed), Some(Ending::Closed)];
    let drawn = curve::stretches(&branch, Quantity::Parameter(0), Quantity::Largest(2));
    assert_eq!(drawn.iter().map(Vec::len).collect::<Vec<_>>(), [60]);
}

#[test]
fn equilibria_are_not_drawn_against_the_period() {
    assert!(curve::pieces(&peak("cubic S", 1.0), Quantity::Parameter(0), Quantity::Period, [12.0, 6.0]).is_empty());
}

#[test]
fn each_format_is_written_as_its_file_extension_says() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    let picture = Picture { title: Some("Made up: cubic & contact".into()), ..Picture::default() };
    let text = svg(&diagram(), &model(), &picture);
    assert!(text.contains("max r") && text.contains("Ω") && text.contains("cubic &amp; contact"));
    // Two peaks and two closed branches change stability twice and five times, the doubled branch never at a special
    // point.
    assert!(text.matches("stroke-dasharray").count() > 4, "there are unstable pieces and a sample in the legend");
    let pixels = png(&text, 1.5).unwrap();
    assert_eq!(&pixels[1..4], b"PNG");
    let page = pdf(&text).unwrap();
    assert_eq!(&page[..5], b"%PDF-");
    for (name, bytes) in [("picture.svg", text.as_bytes()), ("picture.png", &pixels), ("picture.pdf", &page)] {
        std::fs::write(folder.join(name), bytes).unwrap();
    }
}

#[test]
fn all_coordinates_lie_in_the_window_and_an_empty_diagram_has_axes() {
    let window = Some([4.0, 6.0, 3.0, 5.0]);
    let text = svg(&diagram(), &model(), &Picture { window, ..Picture::default() });
    std::fs::write(std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("window.png"), png(&text, 1.0).unwrap())
        .unwrap();
    for path in text.split(" d=\"M").skip(1) {
        let numbers = path.split('"').next().unwrap().split(['L', ' ', 'M', 'V', 'H', 'Z', 'h']);
        for number in numbers.filter_map(|n| n.parse::<f64>().ok()) {
            assert!((-10.0..=960.0).contains(&number), "{number} is off the page");
        }
    }
    let empty = svg(&Diagram::default(), &model(), &Picture::default());
    assert!(png(&empty, 1.0).is_ok());
}

#[test]
fn requested_marks_are_visible_in_diagram_and_legend() {
    let mut branch = peak("curve", 1.0);
    let special = point(50, 3.5, 1.2, 0, false);
    branch.insert_special(SpecialPoint {
        kind: Kind::Mark,
        point: special,
        unstable_before: 0,
        unstable_after: 0,
        error: 1e-9,
        coefficients: Vec::new(),
        coefficient_errors: Vec::new(),
        remark: String::new(),
    });
    let diagram = Diagram { branches: vec![branch], ..Diagram::default() };
    let drawn = svg(&diagram, &model(), &Picture::default());
    // A dot has no outline, so white on white would be invisible.
    let dots: Vec<&str> = drawn.lines().filter(|line| line.contains("stroke=\"none\"/></g>")).collect();
    assert_eq!(dots.len(), 2, "in the diagram and in the legend");
    assert!(dots.iter().all(|dot| !dot.contains("fill=\"#fff\"")), "{dots:?}");
    assert!(drawn.contains(">mark<"));
}

#[test]
fn homotopy_runs_do_not_determine_the_axis() {
    let mut legs: Vec<Branch> = ["way/1", "way/2", "way/10"].map(|name| peak(name, 1.0)).to_vec();
    legs.iter_mut().for_each(|leg| leg.free = 7);
    let only = Diagram { branches: legs.clone(), ..Diagram::default() };
    assert_eq!(default_x(&only), Quantity::Parameter(7));
    legs.push(peak("resonance", 1.0));
    assert_eq!(default_x(&Diagram { branches: legs, ..Diagram::default() }), Quantity::Parameter(0));
}
