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

fn quick(k: f64, n: &str, key: AttractorKey) -> SeedSource {
  match (k == 0.0, n) { (true, "S") | (false, "S") => SeedSource::State(vec![-0.389, 0.0, 0.0, 0.0]),
   (true, "SL") => SeedSource::State(vec![0.15353773,2.35231575,11.1670571,-0.46452523]),
   (true, "DL") => SeedSource::State(vec![-1.28510156,-3.66161685,-12.31731823,10.80656247]),
   (false, "SL") => SeedSource::State(vec![-0.6347324651583496, 0.14936291047655573, 1.7877344038671743, -0.790005600384476]),
   (false, "DL") => SeedSource::State(vec![-2.0427062453663054, -0.9368122169483627, -5.512814475004374, 5.384519958381742]),
   _ => SeedSource::Attractor(key) }
}
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
            seeds.push(SeedPlan { name: format!("{name} {n}"), source: quick(k, n, key), parameters: p.clone(), samples: 128, random: 1 });
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
        for s in &b.special { println!("   {:16} {:.9} T {:?} r {:.6} {}->{} err {:.1e}", s.kind, s.point.parameters[0], s.point.solution.period(), s.point.ranges[4][1], s.unstable_before, s.unstable_after, s.error); println!("   pos {} {:?}", s.point.position, b.points.iter().filter(|p| (p.position - s.point.position).abs() < 2).map(|p| (p.position, p.unstable, p.parameters[0])).collect::<Vec<_>>()); }
        for w in b.points.windows(2) { // silent changes?
            let n = b.special.iter().filter(|s| s.point.position == w[0].position).count();
            if w[0].unstable != w[1].unstable && n == 0 { println!("SILENT {} {}", b.name, w[0].position); } }
        let worst = b.points.iter().map(|p| p.trust.trivial_defect.max(p.trust.liouville_defect)).fold(0.0, f64::max);
        if std::env::var("VV").map_or(false, |v| v == b.name) { for p in &b.points { println!("{} {:.7} r {:.6} u {} slope {:.2e} step {:.1e} N {} {:?} {:?}", p.position, p.parameters[0], p.ranges[4][1], p.unstable, p.parameter_slope(), p.step, if let Solution::Cycle(c) = &p.solution {c.intervals()} else {0}, p.trust, &p.spectrum[1..]); } } println!("   worst defect {worst:.1e}");
    }
}
#[test] fn census() {
    let mut system = System::new(&Rotor);
    system.whirl = Some([0, 1]);
    system.ranges = vec![[-6.0, 6.0], [-6.0, 6.0], [-15.0, 15.0], [-15.0, 15.0]];
    for kappa in [0.0, 1.0] {
    let mut p = REFERENCE.to_vec(); p[1] = kappa;
    let t = std::time::Instant::now();
    let c = attractors(&system, &p, 128, 1, 1, 1e-6);
    println!("{kappa} {:?} unsettled {} escaped {}", t.elapsed(), c.unsettled, c.escaped);
    for a in c.attractors { println!("  {:?} {:?} {} {:?} {:?}", a.ratio, a.point.solution.period(), a.hits, a.point.ranges[4], a.example); }
    }
}
#[test] fn contact_s() {
    let mut system = System::new(&Rotor);
    let mut p = REFERENCE.to_vec(); p[1] = 1.0;
    let plan = Plan { tolerance: 1e-6, degree: 4, seeds: vec![SeedPlan { name: "s".into(), source: SeedSource::State(vec![-0.4, 0.0, 0.0, 0.0]), parameters: p, samples: 1, random: 1}],
       branches: vec![BranchPlan { name: "S".into(), start: Start::Seed(0), free: 0, range: [0.5, 12.0], until: None, switching: Switching::default(), max_points: 2000 }] };
    system.parameter_scales[0] = 5.0;
    let d = run(&system, &plan, 1, Diagram::default(), &Print(Mutex::new(0)));
    for s in &d.branches[0].special { println!("SP {} {} {}->{} pos {} {:?}", s.kind, s.point.parameters[0], s.unstable_before, s.unstable_after, s.point.position, s.point.spectrum); }
    for q in d.branches[0].points.iter().take(0) { println!("{} {:.6} r {:.5} uns {} slope {:.2e} {:?}", q.position, q.parameters[0], q.ranges[4][1], q.unstable, q.parameter_slope(), q.spectrum); }
}
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
struct Counted([AtomicUsize; 4]);
impl VectorField for Counted {
    fn dim(&self) -> usize { 4 } fn parameter_count(&self) -> usize { 9 }
    fn evaluate(&self, at: Batch, f: &mut [f64]) { self.0[0].fetch_add(1, Relaxed); self.0[1].fetch_add(at.lanes, Relaxed); Rotor.evaluate(at, f) }
    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) { self.0[2].fetch_add(1, Relaxed); self.0[3].fetch_add(at.lanes, Relaxed); Rotor.linearise(at, free, f, fx, fp) }
    fn directional(&self, _: Batch, _: &[&[f64]], _: &mut [f64]) {}
    fn output_count(&self) -> usize { 1 }
    fn outputs(&self, at: Batch, out: &mut [f64]) { Rotor.outputs(at, out) }
}
#[test] fn counted() {
    let c = Counted(Default::default());
    let mut system = System::new(&c);
    system.whirl = Some([0, 1]);
    system.ranges = vec![[-6.0, 6.0], [-6.0, 6.0], [-15.0, 15.0], [-15.0, 15.0]];
    let p = REFERENCE.to_vec();
    let t = std::time::Instant::now();
    let _ = attractors(&system, &p, 128, 1, 1, 1e-6);
    println!("COUNT {:?} {:?}", t.elapsed(), c.0);
}
