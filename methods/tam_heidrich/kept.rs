//! Parts of a medial mesh.

use medial::complex::MedialMesh;

/// A subcomplex of a mesh, in the mesh's order. It contains the sides of its faces and the ends of its
/// edges.
pub(super) fn kept_part(
    whole: &MedialMesh,
    sphere_kept: &[bool],
    edge_kept: &[bool],
    face_kept: &[bool],
) -> MedialMesh {
    let mut mesh = whole.induced(sphere_kept);
    let mut number = vec![u32::MAX; whole.spheres.len()];
    let kept = (0..number.len()).filter(|&v| sphere_kept[v]);
    kept.zip(0..).for_each(|(old, new)| number[old] = new);
    let number = |v: u32| number[v as usize];
    let edges = whole.edges.iter().zip(edge_kept).filter(|e| *e.1);
    mesh.edges = edges.map(|(edge, _)| edge.map(number)).collect();
    let faces = whole.faces.iter().zip(face_kept).filter(|f| *f.1);
    mesh.faces = faces.map(|(face, _)| face.map(number)).collect();
    mesh
}
