mod common;
use common::*;
use foldline::contract::*;
use foldline::diagram::*;
use foldline::explore::*;
use std::sync::Mutex;

struct Print(Mutex<usize>);
impl Observer for Print { fn observe(&self, e: Event) -> Verdict {
    match e { Event::Note(a, b) => println!("NOTE {a}: {b}"),
      Event::SideEnded(b, s, e) => println!("{} side {s}: {e} ({} points)", b.name, b.points.len()), _ => {} }
    Verdict::Continue } }

#[test] fn bouncing() {
    let tol = std::env::var("TOL").ok().and_then(|t| t.parse().ok()).unwrap_or(1e-6);
    let mut system = System::new(&Rotor);
    system.whirl = Some([0, 1]);
    system.parameter_scales = REFERENCE.iter().map(|p| if *p == 0.0 { 1.0 } else { p.abs() }).collect();
    system.ranges = vec![[-6.0, 6.0], [-6.0, 6.0], [-15.0, 15.0], [-15.0, 15.0]];
    system.find_reflections(&REFERENCE);
    println!("{:?}", system.reflections);
    let mut seeds = vec![]; let mut branches = vec![];
    for (k, name) in [(0.0, "cubic"), (1.0, "contact")] {
        let mut p = REFERENCE.to_vec(); p[1] = k;
        for (key, n) in [(AttractorKey::Equilibrium, "S"), (AttractorKey::Ratio(2,1), "SL"), (AttractorKey::Ratio(3,1), "DL")].into_iter().filter(|k| std::env::var("ONLY").map_or(true, |o| o == format!("{name} {}", k.1))) {
            seeds.push(SeedPlan { name: format!("{name} {n}"), source: SeedSource::Attractor(key), parameters: p.clone(), samples: 128, random: 1 });
            branches.push(BranchPlan { name: format!("{name} {n}"), start: Start::Seed(seeds.len()-1), free: 0, range: [0.5, 12.0], until: None, switching: Switching { depth: vec![(Kind::PeriodDoubling, 2)] }, max_points: 2000 });
        }
    }
    let plan = Plan { tolerance: tol, degree: 4, seeds, branches };
    let t = std::time::Instant::now();
    let s = seeds::find(&system, &plan, 1, &Diagram::default(), &Unobserved);
    println!("seeds {:?}", t.elapsed()); let _ = s;
    let t = std::time::Instant::now();
    let d = run(&system, &plan, 1, Diagram::default(), &Print(Mutex::new(0)));
    println!("total {:?}", t.elapsed());
    for b in &d.branches {
        let c = b.cost();
        println!("{:40} {} points {:?} | {:?}", b.name, b.points.len(), c, b.ends);
        for s in &b.special { println!("   {:16} {:.9} T {:?} r {:.6} {}->{} err {:.1e}", s.kind, s.point.parameters[0], s.point.solution.period(), s.point.ranges[4][1], s.unstable_before, s.unstable_after, s.error); }
        for w in b.points.windows(2) { // silent changes?
            let n = b.special.iter().filter(|s| s.point.position == w[0].position).count();
            if w[0].unstable != w[1].unstable && n == 0 { println!("SILENT {} {}", b.name, w[0].position); } }
        let worst = b.points.iter().map(|p| p.trust.trivial_defect.max(p.trust.liouville_defect)).fold(0.0, f64::max);
        println!("   worst defect {worst:.1e}");
    }
}
