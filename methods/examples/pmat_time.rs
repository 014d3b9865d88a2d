#[derive(Clone, Copy)]
struct Instant(u64);
impl Instant {
    fn now() -> Self {
        let mut t = 0;
        for e in std::fs::read_dir("/proc/self/task").unwrap() {
            let p = e.unwrap().path().join("schedstat");
            let s = std::fs::read_to_string(p).unwrap();
            t += s.split(' ').next().unwrap().parse::<u64>().unwrap();
        }
        Self(t)
    }
    fn elapsed(self) -> std::time::Duration {
        std::time::Duration::from_nanos(Self::now().0 - self.0)
    }
}
use medial::complex;
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::*;
use medial::surface;
use std::sync::Arc;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    rayon::ThreadPoolBuilder::new()
        .num_threads(args.get(3).map_or(1, |a| a.parse().unwrap()))
        .build_global()
        .unwrap();
    let loaded = surface::read(&args[1]).unwrap();
    let shape = Shape::new("x", &loaded.mesh, loaded.report, ShapeOptions::default()).unwrap();
    let initial = complex::read(&args[2]).unwrap().mesh;
    let shape = shape.with_initial(&initial);
    let m = medial_methods::find("pmat").unwrap();
    for _ in 0..args.get(4).map_or(1, |a| a.parse().unwrap()) {
        let t = Instant::now();
        let mut s = m.prepare(&shape, &Params::none(), &RunContext::default()).unwrap();
        println!("prepare {:?}", t.elapsed());
        let r = s.at(Level::Published).unwrap();
        let h = r.extras.hierarchy.unwrap();
        println!("{:?} left {}", r.diagnostics.counts, r.mesh.spheres.len());
        let n = h.initial().spheres.len();
        let t = Instant::now();
        let h2 =
            complex::collapse::Hierarchy::new(Arc::clone(h.initial()), h.steps().to_vec()).unwrap();
        println!("layers {:?}", t.elapsed());
        drop(h2);
        if args.get(5).is_some() {
            let (mut e, mut f, mut ea, mut fa, mut big) = (0, 0, 0, 0, 0);
            for t in 0..h.last_stage() {
                let c = h.change(t, t + 1);
                let d = c.edges_removed().len();
                if d > 100 {
                    big += d;
                }
                e += d;
                ea += c.edges_added().len();
                f += c.faces_removed().len();
                fa += c.faces_added().len();
            }
            println!("dying {e} {f} arising {ea} {fa} of large {big}");
        }
        for (a, b) in [
            (0, n - 100),
            (n - 100, 0),
            (0, n / 2),
            (n / 2, 0),
            (n / 2, n / 2 + 1000),
            (n / 10, n / 10 * 9),
            (n / 10 * 9, n / 10),
        ] {
            let b = b.min(h.last_stage());
            let a = a.min(h.last_stage());
            let t = Instant::now();
            let c = h.change(a, b);
            let sizes = (
                c.spheres_removed().len(),
                c.spheres_added().len(),
                c.edges_removed().len(),
                c.edges_added().len(),
                c.faces_removed().len(),
                c.faces_added().len(),
            );
            let e1 = t.elapsed();
            let t = Instant::now();
            let st = h.stage(b);
            let (v, e, f) = (st.spheres().len(), st.edges().len(), st.faces().len());
            let e2 = t.elapsed();
            let t = Instant::now();
            let mesh = st.to_mesh();
            let e3 = t.elapsed();
            println!(
                "{a}->{b}: change {e1:?} {sizes:?}; lists {e2:?} {v} {e} {f}; mesh {e3:?} {}",
                mesh.spheres.len()
            );
        }
        for spheres in [500_000, 100_000, 10_000, 1000, 100, 10] {
            let st = h.stage(n - spheres);
            println!(
                "{spheres}: {} edges {} faces scale {}",
                st.edge_count(),
                st.face_count(),
                s.at(Level::Spheres(spheres)).unwrap().native_level.unwrap_or(f64::INFINITY)
            );
        }
    }
}
