//! The canonical form of a complex, against ordered sets.

use std::collections::BTreeSet;

use medial::Vec3;
use medial::complex::{ComplexError, MedialMesh, Sphere};
use proptest::prelude::*;

fn spheres(count: u32) -> Vec<Sphere> {
    (0..count).map(|k| Sphere::new(Vec3::X * f64::from(k), 1.0)).collect()
}

fn distinct<const N: usize>(simplex: &[u32; N]) -> bool {
    BTreeSet::from(*simplex).len() == N
}

proptest! {
    #[test]
    fn simplices_come_out_as_from_ordered_sets(
        count in 3_u32..120,
        edges in prop::collection::vec(prop::array::uniform2(0_u32..120), 0..200),
        faces in prop::collection::vec(prop::array::uniform3(0_u32..120), 0..200),
    ) {
        let edges: Vec<[u32; 2]> =
            edges.into_iter().map(|e| e.map(|v| v % count)).filter(distinct).collect();
        let faces: Vec<[u32; 3]> =
            faces.into_iter().map(|f| f.map(|v| v % count)).filter(distinct).collect();
        let sorted = |mut face: [u32; 3]| { face.sort_unstable(); face };
        let expected_faces: BTreeSet<[u32; 3]> = faces.iter().copied().map(sorted).collect();
        let mut expected_edges: BTreeSet<[u32; 2]> =
            edges.iter().map(|&[a, b]| [a.min(b), a.max(b)]).collect();
        for &[a, b, c] in &expected_faces {
            expected_edges.extend([[a, b], [a, c], [b, c]]);
        }
        let mesh = MedialMesh::from_simplices(spheres(count), edges, faces).expect("valid");
        prop_assert!(mesh.edges.iter().eq(&expected_edges));
        prop_assert!(mesh.faces.iter().eq(&expected_faces));
        prop_assert!(mesh.check().is_ok());
        // Without any one of its edges a complex with faces is not closed.
        for k in (0..mesh.edges.len()).step_by(7) {
            let mut open = mesh.clone();
            let side = open.edges.remove(k);
            let needed = mesh.faces.iter().any(|f| side.iter().all(|v| f.contains(v)));
            let missing = matches!(open.check(), Err(ComplexError::MissingEdge { side: s, .. }) if s == side);
            prop_assert_eq!(missing, needed);
        }
    }
}

#[test]
fn ids_out_of_range_are_refused() {
    for (edges, faces) in
        [(vec![[0, 5]], vec![]), (vec![[7, 9]], vec![]), (vec![], vec![[9, 8, 7]])]
    {
        assert!(MedialMesh::from_simplices(spheres(3), edges, faces).is_err());
    }
}
