//! A figure of several panels with a layer of every kind.

use foldline_plot::palette::{BLUE, GREEN, ORANGE, PURPLE, VERMILION};
use foldline_plot::{Axis, Figure, Layer, LegendPlace, Marker, Panel, figure_svg, png};

fn wave(k: usize) -> [f64; 2] {
    let t = k as f64 / 40.0;
    [t, (2.0 * t).sin() * (1.0 + 0.2 * t)]
}

fn curves() -> Panel {
    let points: Vec<[f64; 2]> = (0..400).map(wave).collect();
    let stable: Vec<bool> = (0..400).map(|k| !(80..170).contains(&k)).collect();
    let lower: Vec<[f64; 2]> = points.iter().map(|[x, y]| [*x, y - 2.0]).collect();
    Panel::new("(a)", "a curve & its window", Axis::new("Ω"), Axis::new("max r"))
        .with(Layer::band(2.0, 3.0, ORANGE).named("window"))
        .with(Layer::masked(&points, &stable, BLUE).named("upper"))
        .with(Layer::curve(&lower, VERMILION).named("lower"))
        .with(Layer::scatter(vec![wave(80), wave(170)], Marker::Circle, BLUE).hollow().named("fold"))
        .with(Layer::horizontal(1.0))
        .with(Layer::note(wave(170), "an unstable piece ends here"))
        .zooming([4.0, 5.5, 0.2, 1.9], "(b)")
}

fn zoom() -> Panel {
    let points: Vec<[f64; 2]> = (0..400).step_by(8).map(wave).collect();
    let cloud: Vec<[f64; 2]> = (0..4000).map(|k| [wave(k / 10)[0], wave(k / 10)[1] + 0.02 * (k % 7) as f64]).collect();
    let panel = Panel::new("(b)", "", Axis::new("Ω").from(4.0, 5.5), Axis::new("max r").from(0.2, 1.9));
    let panel = panel.with(Layer::scatter(cloud, Marker::Dot, GREEN).named("simulation"));
    Panel { legend: LegendPlace::Inside, ..panel.with(Layer::curve(&points, BLUE).smooth().named("branch")) }
}

fn orbit() -> Panel {
    let points: Vec<[f64; 2]> = (0..=300)
        .map(|k| k as f64 * std::f64::consts::TAU / 300.0)
        .map(|t| [2.0 * t.cos() - (2.0 * t).cos(), 2.0 * t.sin() + (2.0 * t).sin()])
        .collect();
    Panel::new("(c)", "orbit", Axis::new("u"), Axis::new("v"))
        .equal()
        .with(Layer::circle([0.0, 0.0], 1.0, PURPLE).named("contact"))
        .with(Layer::curve(&points, BLUE))
}

fn spectrum() -> Panel {
    let peaks = vec![[-6.2, 0.6], [-3.1, 1.8], [0.0, 0.02], [0.3, 0.015]];
    let labels = ["−2w", "−w", "0", "0.3"].map(String::from).to_vec();
    Panel::new("(d)", "spectrum", Axis::new("ω").from(-8.0, 2.0), Axis::new("amplitude").from(1e-4, 10.0).log())
        .with(Layer::stems(peaks, labels, VERMILION))
}

#[test]
fn every_kind_of_layer_is_drawn_within_the_page() {
    let figure = Figure::grid("Everything <there> is", 2, vec![curves(), zoom(), orbit(), spectrum()]);
    let text = figure_svg(&figure);
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(folder.join("figure.svg"), &text).unwrap();
    std::fs::write(folder.join("figure.png"), png(&text, 1.0).unwrap()).unwrap();
    assert!(text.contains("Everything &lt;there&gt; is") && text.contains("a curve &amp; its window"));
    for name in ["upper", "lower", "window", "fold", "contact", "simulation", "stable", "unstable"] {
        assert!(text.contains(&format!(">{name}</text>")), "{name} is not in a legend");
    }
    let height: f64 = text.split("height=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
    for path in text.split(" d=\"M").skip(1).map(|p| p.split('"').next().unwrap()).filter(|p| p.contains('L')) {
        for pair in path.split(['L', 'M']) {
            let numbers: Vec<f64> = pair.split(' ').filter_map(|n| n.parse().ok()).collect();
            let [x, y] = numbers[..] else { continue };
            assert!((-10.0..=960.0).contains(&x) && (-10.0..=height).contains(&y), "{x} {y} is off the page");
        }
    }
}

/// The extents of a circle agree in both directions, on a panel that is not square.
#[test]
fn a_circle_is_round_where_units_are_equal() {
    let panel = Panel::new("", "", Axis::new("").from(-1.5, 1.5), Axis::new("").from(-1.5, 1.5)).equal();
    let text =
        figure_svg(&Figure { panels: vec![panel.with(Layer::circle([0.0, 0.0], 1.0, BLUE))], ..Figure::default() });
    let path = text.split("<path d=\"M").find(|p| p.matches('L').count() > 100).unwrap().split('"').next().unwrap();
    let places: Vec<[f64; 2]> = path
        .split('L')
        .map(|pair| {
            let (x, y) = pair.split_once(' ').unwrap();
            [x.parse().unwrap(), y.parse().unwrap()]
        })
        .collect();
    let extent = |i: usize| {
        let values = places.iter().map(|p| p[i]);
        values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
    };
    // Coordinates have two decimals.
    assert!((extent(0) - extent(1)).abs() < 0.03, "{} {}", extent(0), extent(1));
}

#[test]
fn values_that_are_not_finite_are_left_out() {
    let points = [[0.0, 1.0], [1.0, f64::NAN], [2.0, 1.0], [3.0, f64::INFINITY], [4.0, 2.0], [5.0, 3.0]];
    for axis in [Axis::new(""), Axis::new("").log()] {
        let panel = Panel::new("", "", axis.clone(), axis).with(Layer::curve(&points, BLUE)).with(Layer::scatter(
            points.to_vec(),
            Marker::Plus,
            GREEN,
        ));
        let text = figure_svg(&Figure { panels: vec![panel], ..Figure::default() });
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
        assert!(png(&text, 1.0).is_ok());
    }
}
