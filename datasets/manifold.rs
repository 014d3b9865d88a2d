//! Whether a triangle mesh is the oriented boundary of a solid, combinatorially.

use medial::surface::TriMesh;

/// What keeps a mesh from being a closed, oriented 2-manifold; `None` when nothing does.
///
/// Every directed edge must have exactly one opposite, every vertex a single fan of triangles.
/// Cost `O(F log F)`.
pub(crate) fn first_defect(mesh: &TriMesh) -> Option<String> {
    let mut directed: Vec<[u32; 2]> = mesh.faces.iter().flat_map(directed_edges).collect();
    directed.sort_unstable();
    if let Some(pair) = directed.windows(2).find(|pair| pair[0] == pair[1]) {
        return Some(format!("directed edge {:?} stands twice", pair[0]));
    }
    if let Some(edge) = directed.iter().find(|[a, b]| directed.binary_search(&[*b, *a]).is_err()) {
        return Some(format!("edge {edge:?} has no opposite"));
    }
    if let Some([a, _]) = directed.iter().find(|[a, b]| a == b) {
        return Some(format!("a face names vertex {a} twice"));
    }
    vertex_without_single_fan(mesh)
}

fn directed_edges(&[a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

fn vertex_without_single_fan(mesh: &TriMesh) -> Option<String> {
    // For the corner `a` of a face `abc`, the fan goes on from `b` to `c`.
    let mut links: Vec<[u32; 3]> =
        mesh.faces.iter().flat_map(|&[a, b, c]| [[a, b, c], [b, c, a], [c, a, b]]).collect();
    links.sort_unstable();
    let mut start = 0;
    for vertex in 0..mesh.vertices.len() as u32 {
        let end = start + links[start..].partition_point(|link| link[0] == vertex);
        let fan = &links[start..end];
        let Some(&[_, first, _]) = fan.first() else {
            return Some(format!("vertex {vertex} belongs to no face"));
        };
        let next = |at: u32| fan.binary_search_by_key(&at, |link| link[1]).map(|i| fan[i][2]);
        let mut at = first;
        for step in 1..=fan.len() {
            at = match next(at) {
                Ok(next) => next,
                Err(_) => return Some(format!("the fan of vertex {vertex} is open")),
            };
            if at == first && step < fan.len() {
                return Some(format!("vertex {vertex} has more than one fan"));
            }
        }
        start = end;
    }
    None
}

/// Euler number of a closed triangle mesh, `V - E + F` with `E = 3 F / 2`.
pub(crate) fn euler(mesh: &TriMesh) -> i64 {
    mesh.vertices.len() as i64 - mesh.faces.len() as i64 / 2
}
