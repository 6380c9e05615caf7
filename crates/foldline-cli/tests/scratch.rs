use foldline::contract::{Event, Observer, Verdict};
use foldline::diagram::Diagram;
use foldline::explore::{HomotopyPlan, Start, System, run};
use foldline_store::study_file::parse_study;
struct Tell;
impl Observer for Tell {
    fn observe(&self, e: Event) -> Verdict {
        if let Event::Note(a, b) = e { println!("NOTE {a}: {b}") }
        if let Event::End(b) = e {
            println!("END {} free {} held {:?} {} pts ends {:?} specials {:?}", b.name, b.free, b.held, b.points.len(), b.ends,
              b.special.iter().map(|s| format!("{} {:.5}", s.kind, s.point.parameters[b.free])).collect::<Vec<_>>());
        }
        Verdict::Continue
    }
}
#[test]
fn scratch() {
    let which = std::env::var("W").unwrap_or("2:1".into());
    let model = include_str!("../../../models/overhung-rotor.toml");
    let text = format!("model = \"m\"\n[[seed]]\nname = \"s\"\nattractor = \"{which}\"\nparameters = {{ Omega = 5, kappa = 0 }}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [4.9, 5.1]\n");
    let mut study = parse_study(&text, "study", model, "model").unwrap();
    let p = |n: &str| study.model.parameter_index(n).unwrap();
    let targets: Vec<(usize, f64)> = std::env::var("T").unwrap().split(',').map(|t| { let (a, b) = t.split_once('=').unwrap(); (p(a), b.parse().unwrap()) }).collect();
    let h = HomotopyPlan { name: "h".into(), start: Start::Seed(0), targets, via: 0, range: [0.5, 12.0], max_points: 500 };
    study.plan.homotopies.push(h);
    study.plan.branches.clear();
    let d = run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Tell);
    println!("{} legs", d.branches.len());
}
