//! Betti numbers of the union of spheres, cones and slabs: the reconstruction, not the medial mesh.
//!
//! A medial mesh and its union can differ: where parts that are far apart along the mesh meet in
//! space, the union has a loop that the mesh does not have (Li et al. 2015, figure 20).
//!
//! The primitives are replaced by balls at a given spacing. The Betti numbers are those of the dual
//! complex of the balls, which are exact for the balls (Edelsbrunner 1995). The surface of the balls
//! lies below that of a cone of radius `r` by up to about `spacing^2 / (8 r)`, of a slab by twice
//! that. So contacts shallower than this are missed. Balls smaller than 0.7 spacings are enlarged to that, or the balls
//! of one thin primitive would not touch: the corner of a box, where the radius is 0, would be a component. A gap counts
//! as a contact only next to such a ball.

use super::error::MetricError;
use crate::complex::{MedialMesh, UnionError};
use crate::geometry::{DualComplex, Sphere};

/// Least radius of a ball, in spacings. Circles of this radius around the corners cover every triangle of neighbours: of
/// sides of one spacing (0.58), and between a row of a face and the balls of its side (0.67).
const LEAST_RADIUS: f64 = 0.7;

/// Bound on the number of balls.
const MAX_BALLS: usize = 5_000_000;

/// The Betti numbers `[b0, b1, b2]` of the union, from balls at most `spacing` apart.
///
/// Cost `O(n log n)` for `n` balls, which grow as the length of the edges over the spacing and the
/// area of the faces over its square.
///
/// # Errors
/// When the mesh is empty or not valid, the spacing is not positive, or the balls are too many.
pub fn union_betti(mesh: &MedialMesh, spacing: f64) -> Result<[u64; 3], MetricError> {
    mesh.check().map_err(UnionError::from)?;
    if mesh.spheres.is_empty() {
        return Err(UnionError::Empty.into());
    }
    if spacing.is_nan() || spacing <= 0.0 {
        return Err(MetricError::Spacing(spacing));
    }
    Ok(DualComplex::of_balls(&balls(mesh, spacing)?)?.betti())
}

/// The spheres, then those between the ends of each edge, then those within each face.
fn balls(mesh: &MedialMesh, spacing: f64) -> Result<Vec<Sphere>, MetricError> {
    let on_edges: f64 = mesh.edges.iter().map(|&e| parts(&mesh.spheres_of(e), spacing)).sum();
    let in_faces: f64 =
        mesh.faces.iter().map(|&f| parts(&mesh.spheres_of(f), spacing).powi(2) / 2.0).sum();
    let count = mesh.spheres.len() as f64 + on_edges + in_faces;
    if count > MAX_BALLS as f64 {
        return Err(MetricError::TooManyBalls { count, most: MAX_BALLS });
    }
    let mut balls = mesh.spheres.clone();
    for edge in &mesh.edges {
        let [a, b] = mesh.spheres_of(*edge);
        let n = parts(&[a, b], spacing);
        balls.extend((1..n as u32).map(|k| a.lerp(b, f64::from(k) / n)));
    }
    for face in &mesh.faces {
        let [a, b, c] = mesh.spheres_of(*face);
        let n = parts(&[a, b, c], spacing);
        for i in 1..n as u32 {
            // A row from side ab to side ac, parallel to bc, without its ends.
            let t = f64::from(i) / n;
            let (from, to) = (a.lerp(b, t), a.lerp(c, t));
            balls.extend((1..i).map(|j| from.lerp(to, f64::from(j) / f64::from(i))));
        }
    }
    // A sphere without an edge has no neighbours of its own.
    let mut least = vec![LEAST_RADIUS * spacing; balls.len()];
    mesh.isolated().into_iter().for_each(|sphere| least[sphere as usize] = 0.0);
    balls.iter_mut().zip(least).for_each(|(ball, least)| ball.radius = ball.radius.max(least));
    Ok(balls)
}

/// Parts that are no longer than `spacing`, of the longest side of an edge or a triangle.
fn parts(corners: &[Sphere], spacing: f64) -> f64 {
    let ends = (0..corners.len()).map(|k| [corners[k], corners[(k + 1) % corners.len()]]);
    ends.map(|[a, b]| (a.centre.distance(b.centre) / spacing).ceil()).fold(1.0, f64::max)
}

// The warning about Betti numbers that differ from the solid's.

/// A sentence about the difference, if the Betti numbers of a medial mesh are not the solid's.
///
/// ```
/// use medial::metrics::topology_warning;
///
/// assert_eq!(topology_warning([1, 0, 0], Some([1, 0, 0])), None);
/// let hole = topology_warning([1, 1, 0], Some([1, 0, 0])).unwrap();
/// assert!(hole.contains("[1, 1, 0]"));
/// ```
pub fn topology_warning(found: [u64; 3], expected: Option<[u64; 3]>) -> Option<String> {
    let expected = expected.filter(|&expected| expected != found)?;
    let mut parts = Vec::new();
    for (k, one) in ["component", "tunnel", "closed pocket"].into_iter().enumerate() {
        let number = found[k].abs_diff(expected[k]);
        let plural = if number == 1 { "" } else { "s" };
        let what = if found[k] > expected[k] { "too many" } else { "missing" };
        if number > 0 {
            parts.push(format!("{number} {one}{plural} {what}"));
        }
    }
    Some(format!("the Betti numbers are {found:?}, the solid's {expected:?}: {}", parts.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;

    fn chain(points: &[[f64; 2]], radius: f64) -> MedialMesh {
        let centre = |&[x, y]: &[f64; 2]| Sphere::new(Vec3::new(x, y, 0.0), radius);
        let edges = (1..points.len() as u32).map(|i| [i - 1, i]).collect();
        MedialMesh::from_simplices(points.iter().map(centre).collect(), edges, vec![]).unwrap()
    }

    #[test]
    fn a_chain_whose_ends_meet_has_a_loop_only_in_space() {
        let horseshoe = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [0.0, 0.7]];
        assert_eq!(union_betti(&chain(&horseshoe, 0.3), 0.02).unwrap(), [1, 0, 0]);
        assert_eq!(union_betti(&chain(&horseshoe, 0.4), 0.02).unwrap(), [1, 1, 0]);
        let apart = MedialMesh::from_simplices(chain(&horseshoe, 0.3).spheres, vec![], vec![]);
        assert_eq!(union_betti(&apart.unwrap(), 0.02).unwrap(), [5, 0, 0]);
    }

    /// Parts thinner than the balls are apart, such as the corners of a box.
    #[test]
    fn a_connected_mesh_has_a_connected_union_at_any_radius() {
        let ball = |x: f64, y: f64, radius| Sphere::new(Vec3::new(x, y, 0.0), radius);
        for radius in [0.0, 1e-6, 0.005, 0.01, 0.013, 0.02, 0.1] {
            let horseshoe = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [0.0, 0.7]];
            assert_eq!(union_betti(&chain(&horseshoe, radius), 0.02).unwrap(), [1, 0, 0]);
            // A sheet whose corners are points or balls.
            for middle in [radius, 0.3] {
                let corners = [[0.0, 0.0], [1.37, 0.0], [1.21, 1.13], [0.1, 0.8]]
                    .map(|[x, y]| ball(x, y, radius));
                let spheres = corners.into_iter().chain([ball(0.61, 0.47, middle)]).collect();
                let faces = vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [0, 3, 4]];
                let sheet = MedialMesh::from_simplices(spheres, vec![], faces).unwrap();
                assert_eq!(union_betti(&sheet, 0.02).unwrap(), [1, 0, 0], "{radius} {middle}");
            }
        }
    }

    #[test]
    fn a_slab_is_solid_and_a_hollow_tetrahedron_of_slabs_has_a_void() {
        let corner = |v: [f64; 3]| Sphere::new(Vec3::from(v), 0.1);
        let corners = [[0., 0., 0.], [3., 0., 0.], [0., 3., 0.], [0., 0., 3.]].map(corner);
        let faces = vec![[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];
        let hollow = MedialMesh::from_simplices(corners.to_vec(), vec![], faces.clone()).unwrap();
        assert_eq!(union_betti(&hollow, 0.1).unwrap(), [1, 0, 1]);
        let open =
            MedialMesh::from_simplices(corners.to_vec(), vec![], faces[..3].to_vec()).unwrap();
        assert_eq!(union_betti(&open, 0.1).unwrap(), [1, 0, 0]);
    }

    #[test]
    fn unmeasurable_unions_are_errors() {
        let mesh = chain(&[[0.0, 0.0], [1.0, 0.0]], 0.1);
        assert!(matches!(union_betti(&mesh, 0.0), Err(MetricError::Spacing(_))));
        assert!(matches!(union_betti(&mesh, 1e-9), Err(MetricError::TooManyBalls { .. })));
    }
}
