//! The command `medial` with one more method: `cargo run -- compare --methods largest-rust,qmat`.

use medial::simplifier::{MethodInfo, simple};

fn main() -> std::process::ExitCode {
    let info = MethodInfo::new("largest-rust", "Largest balls first (Rust)")
        .citation("An example")
        .summary("Keeps the largest balls, with the edges and faces between them.");
    // Lengths are fractions of the surface's bounding-box diagonal. The initial medial mesh is shared
    // by all methods of a comparison, and its seconds are reported apart from those of the method.
    let largest = simple(info, |shape, spheres| {
        let initial = shape.initial()?;
        let radius = |i: usize| initial.spheres[i].radius;
        let mut order: Vec<usize> = (0..initial.spheres.len()).collect();
        // Equal radii in the order of ids: the same input gives the same bytes.
        order.sort_by(|&a, &b| radius(b).total_cmp(&radius(a)).then(a.cmp(&b)));
        let mut keep = vec![false; order.len()];
        order.iter().take(spheres).for_each(|&i| keep[i] = true);
        Ok(initial.induced(&keep))
    });
    let mut methods = medial_methods::registry();
    methods.push(largest.into());
    medial_bench::main_with(methods)
}
