//! The kernel through its public interface, against definitions and brute force.

mod delaunay;
mod dual_complex;
mod hull_distances;
mod poles;
mod regular;

use medial_geometry::triangulation::Triangulation;
use medial_geometry::{DualComplex, Sphere, Vec3, VertexId};
use rand::RngExt;
use rand_pcg::Pcg64;

/// A random point of the cube from -1 to 1.
fn in_cube(rng: &mut Pcg64) -> Vec3 {
    let mut x = || rng.random_range(-1.0..1.0);
    Vec3::new(x(), x(), x())
}

/// The points of a grid of `n` by `n` by `n`, `step` apart.
fn lattice(n: u32, step: f64) -> Vec<Vec3> {
    let cells = (0..n.pow(3)).map(|i| [i % n, i / n % n, i / n / n]);
    cells.map(|c| Vec3::from(c.map(|x| f64::from(x) * step))).collect()
}

fn shuffle<T>(items: &mut [T], rng: &mut Pcg64) {
    for i in (1..items.len()).rev() {
        items.swap(i, rng.random_range(0..=i));
    }
}

/// Finite cells as sorted quadruples of keys, which do not depend on the order of the input.
fn cell_set<K: Ord>(triangulation: &Triangulation, key: impl Fn(VertexId) -> K) -> Vec<[K; 4]> {
    let cells = triangulation.finite_cells().map(|cell| {
        let mut keys = triangulation.vertices(cell).map(&key);
        keys.sort_unstable();
        keys
    });
    let mut cells: Vec<_> = cells.collect();
    cells.sort_unstable();
    cells
}

/// The dual complex of balls, checked.
fn dual_complex(balls: &[Sphere]) -> DualComplex<'static> {
    let complex = DualComplex::of_balls(balls).expect("admissible balls");
    complex.check().expect("a simplicial complex with consistent classes");
    complex
}

/// The result of `build` on this number of threads.
fn on_threads<T: Send>(threads: usize, build: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool").install(build)
}
