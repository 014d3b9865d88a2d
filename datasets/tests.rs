#[test]
fn probe() {
    for s in crate::catalogue() {
        let t = std::time::Instant::now();
        let m = s.mesh(s.default_resolution);
        let el = t.elapsed();
        let (lo, hi) = m.bounding_box().unwrap();
        let mut min_angle: f64 = 180.0;
        let (mut emin, mut emax, mut esum) = (f64::MAX, 0f64, 0.0);
        for f in 0..m.faces.len() {
            let t = m.triangle(f);
            for i in 0..3 {
                let (a, b, c) = (t[i], t[(i + 1) % 3], t[(i + 2) % 3]);
                min_angle = min_angle.min((b - a).angle_between(c - a).to_degrees());
                let e = a.distance(b);
                emin = emin.min(e);
                emax = emax.max(e);
                esum += e;
            }
        }
        let mean = esum / (3 * m.faces.len()) as f64;
        eprintln!(
            "{:14} v {:5} f {:5} chi {:3} defect {:?} diag {:.3}/{:.3} ext {:.3} angle {:.1} edge {:.3}..{:.3} mean/target {:.2} {:?}",
            s.id,
            m.vertices.len(),
            m.faces.len(),
            crate::manifold::euler(&m),
            crate::manifold::first_defect(&m),
            (hi - lo).length(),
            s.diagonal,
            hi - lo,
            min_angle,
            emin,
            emax,
            mean / (s.diagonal / s.default_resolution as f64),
            el
        );
        if let Some(a) = s.axis() {
            eprintln!(
                "    axis {} {} {} betti {:?} tol {:.2e}",
                a.mesh.spheres.len(),
                a.mesh.edges.len(),
                a.mesh.faces.len(),
                medial::complex::betti(&a.mesh),
                a.tolerance
            );
        }
    }
}
