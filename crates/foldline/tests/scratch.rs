mod common;
use common::*;
use foldline::continuation::*;
use foldline::continuation::corrector::*;
use foldline::contract::*;
use foldline::diagram::*;
use foldline::problem::{cycle::CycleProblem, gauss::Scheme, mesh, Setting, equilibrium::EquilibriumProblem};

fn run(mut problem: Box<dyn ZeroProblem + '_>, u: Vec<f64>, family: Family, tol: f64) {
    let scales = [1.0; 4];
    let settings = Settings::new(tol, [0.5, 12.0], &scales);
    let mut cost = Cost::default();
    problem.anchor(&u);
    let plane = Plane { row: parameter_row(u.len()), base: u.clone(), distance: 0.0 };
    let start = settle(&mut *problem, &settings, plane, u, 1.0, &mut cost).unwrap();
    println!("start {:?} {:?} mesh {} {:?} {:?}", start.point.solution.period(), start.point.ranges[4], start.mesh.len(), start.point.trust, start.point.spectrum);
    let monitors = foldline::special::monitors(family);
    let home = start.point.clone();
    for direction in [1.0, -1.0] {
        let mut s = start.clone();
        if direction < 0.0 { s.tangent.iter_mut().for_each(|t| *t = -*t); }
        let mut walk = Follow { problem: &mut *problem, settings: &settings, monitors: &monitors, collapses: &[], direction, free: 0, home: Some(&home) };
        let mut n = 0; let mut c = Cost::default(); let mut mm = 0; let mut worst = 0.0f64;
        let t0 = std::time::Instant::now();
        let e = follow(&mut walk, s, None, 0, &mut |item| { match item {
            Item::Special(sp) => println!("   {} {:.9} {:?} {:.6} {}->{} err {:.1e}", sp.kind, sp.point.parameters[0], sp.point.solution.period(), sp.point.ranges[4][1], sp.unstable_before, sp.unstable_after, sp.error),
            Item::Point(p) => { n += 1; c += p.cost; worst = worst.max(p.trust.liouville_defect).max(p.trust.trivial_defect);
               if let Solution::Cycle(cy) = &p.solution { mm = mm.max(cy.intervals()); }
               if std::env::var("V").is_ok() { println!("{} {:.5} {:.5} r {:.4} uns {} step {:.3} {:?} N {} {:.1e} {:.1e} {:.1e}", p.position, p.parameters[0], p.solution.period().unwrap_or(0.), p.ranges[4][1], p.unstable, p.step, p.cost, if let Solution::Cycle(cy) = &p.solution {cy.intervals()} else {0}, p.trust.discretisation, p.trust.trivial_defect, p.trust.liouville_defect) } }
        } Verdict::Continue });
        println!("direction {direction}: {e} points {n} {c:?} mesh max {mm} defects {worst:.1e} {:?}", t0.elapsed());
    }
}

fn cycle(kappa: f64, x: [f64; 4], period: f64, tol: f64) {
    let scales = [1.0; 4];
    let mut p = REFERENCE.to_vec();
    p[1] = kappa;
    let setting = Setting { field: &Rotor, scales: &scales, parameters: p.clone(), free: 0, parameter_scale: 5.0 };
    let scheme = Scheme::new(4);
    let m = mesh::uniform(60);
    let mut u = shoot(&p, &x, period, 60, &scheme.nodes);
    u.extend([period, 5.0]);
    let problem = CycleProblem::new(setting, 4, &m);
    run(Box::new(problem), u, Family::Cycle, tol);
}

fn tol() -> f64 { std::env::var("TOL").ok().and_then(|t| t.parse().ok()).unwrap_or(1e-6) }

#[test] fn cubic_sl() { cycle(0.0, [0.15353773,2.35231575,11.1670571,-0.46452523], 2.0147198658, tol()); }
#[test] fn cubic_dl() { cycle(0.0, [-1.28510156,-3.66161685,-12.31731823,10.80656247], 2.6261014808, tol()); }
#[test] fn contact_sl() {
    // settle by brute force first
    let mut p = REFERENCE.to_vec(); p[1] = 1.0;
    let mut x = vec![0.0; 4];
    'o: for a in 0..12 { for b in 1..6 {
      x = vec![0.0, 1.0, a as f64, -(b as f64)*0.5];
      for _ in 0..300 { x = shoot(&p, &x, 1.9910645451, 60, &[0.0, 0.5]) .rchunks(4).next().unwrap().to_vec(); }
      let y = shoot(&p, &x, 1.9910645451, 60, &[0.0, 0.5, 1.0]) .rchunks(4).next().unwrap().to_vec();
      let d = x.iter().zip(&y).map(|(a,b)| (a-b).abs()).fold(0.0, f64::max);
      if d < 0.2 && x[0].hypot(x[1]) > 0.42 { println!("{a} {b} {d}"); break 'o; }
    } }
    println!("{x:?}");
    cycle(1.0, [x[0], x[1], x[2], x[3]], 1.9910645451, tol());
}
#[test] fn cubic_s() {
    let scales = [1.0; 4];
    let setting = Setting { field: &Rotor, scales: &scales, parameters: REFERENCE.to_vec(), free: 0, parameter_scale: 5.0 };
    run(Box::new(EquilibriumProblem::new(setting)), vec![-0.3895, 0.0, 0.0, 0.0, 5.0], Family::Equilibrium, tol());
}
