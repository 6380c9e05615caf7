use foldline::contract::Unobserved;
use foldline::diagram::Diagram;
use foldline::explore::{System, run};
use foldline_store::study_file::parse_study;
fn main() {
    for path in std::env::args().skip(1) {
        let text = std::fs::read_to_string(&path).unwrap();
        let model = text.lines().find_map(|l| l.strip_prefix("model = ")).unwrap().trim_matches('"').to_string();
        let own = std::fs::read_to_string(&model).unwrap();
        let started = std::time::Instant::now();
        let study = match parse_study(&text, "study", &own, "model") {
            Ok(s) => s,
            Err(e) => {
                println!("{path}: {}", e[0]);
                continue;
            }
        };
        let d: Diagram =
            run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved);
        println!("=== {path} {:.2} s", started.elapsed().as_secs_f64());
        for b in &d.branches {
            println!("{}: {} points; {:?}", b.name, b.points.len(), b.ends);
            for s in &b.special {
                println!(
                    "  {:?} {} pars {:.12?} period {:?} err {:.1e} disc {:.1e} {} {:.3?}",
                    s.kind,
                    s.point.position,
                    &s.point.parameters[..study.model.parameters.len()],
                    s.point.solution.period(),
                    s.error,
                    s.point.trust.discretisation,
                    s.remark,
                    s.coefficients
                );
            }
            if b.is_connecting() {
                if std::env::var("FLIPS").is_ok() {
                    use foldline::contract::VectorField;
                    let system = System::of_plan(&study.model, &study.plan);
                    let f = foldline::problem::connecting::ConnectingField::of_stored(
                        system.field,
                        &system.scales,
                        1,
                        &b.points[0].parameters,
                    )
                    .unwrap();
                    for p in &b.points {
                        let foldline::diagram::Solution::Cycle(c) = &p.solution else { continue };
                        let v = f.flips(c, &p.parameters).map(|t| t.map(|t| t.value));
                        println!("    flips {} {:?}", p.position, v);
                    }
                }
                for p in &b.points {
                    let k = study.model.parameters.len();
                    println!(
                        "    {} {:.12?} T {:.3} disc {:.1e} eig {:.4?}",
                        p.position,
                        &p.parameters[..k],
                        p.parameters[k],
                        p.trust.discretisation,
                        p.spectrum
                    );
                }
            }
        }
    }
}
