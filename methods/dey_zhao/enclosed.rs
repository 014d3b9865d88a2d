//! Step 4 by Delaunay edges: those that the surface encloses.

use medial::Vec3;
use medial::geometry::{Delaunay, VertexId};
use medial::shape::{Shape, ShapeError};
use medial::simplifier::Diagnostics;
use medial::surface::Side;

use super::{PUBLISHED, Strength};

/// Keeps the facets whose edge has its middle inside, and counts the differences between the two
/// readings of step 4 at the paper's constants: `facets_of_edges_not_enclosed` have all vertices
/// inside but the middle of the edge outside, `enclosed_edges_without_facet` the reverse.
/// `O(n log n)`.
pub(super) fn restrict(
    strength: &mut Strength,
    shape: &Shape,
    diagnostics: &mut Diagnostics,
) -> Result<(), ShapeError> {
    let delaunay = shape.delaunay()?;
    let inside = shape.inside_test();
    let are_enclosed = |edges: &[[VertexId; 2]]| -> Vec<bool> {
        let middle = |&[p, q]: &[VertexId; 2]| delaunay.point(p).midpoint(delaunay.point(q));
        let middles: Vec<Vec3> = edges.iter().map(middle).collect();
        inside.sides(&middles).into_iter().map(|side| side == Side::Inside).collect()
    };
    let passes = |&[p, q]: &[VertexId; 2]| strength.of_edge(p, q) > PUBLISHED;
    let dual: Vec<[VertexId; 2]> =
        (0..strength.facets.len()).map(|facet| strength.facets.ends(facet)).collect();
    let enclosed = are_enclosed(&dual);
    let outside = dual.iter().zip(&enclosed).filter(|&(edge, &enclosed)| !enclosed && passes(edge));
    diagnostics.count("facets_of_edges_not_enclosed", outside.count());
    let others: Vec<[VertexId; 2]> =
        edges_but(&delaunay, &dual).into_iter().filter(passes).collect();
    let bare = are_enclosed(&others).into_iter().filter(|&enclosed| enclosed);
    diagnostics.count("enclosed_edges_without_facet", bare.count());
    strength.enclosed = Some(enclosed);
    Ok(())
}

/// The finite Delaunay edges, each once, except `some`.
fn edges_but(delaunay: &Delaunay, some: &[[VertexId; 2]]) -> Vec<[VertexId; 2]> {
    let ordered = |[p, q]: [VertexId; 2]| if p.0 < q.0 { [p, q] } else { [q, p] };
    let mut known: Vec<[u32; 2]> = some.iter().map(|&edge| ordered(edge).map(|v| v.0)).collect();
    known.sort_unstable();
    let mut edges: Vec<[u32; 2]> = Vec::new();
    for cell in delaunay.finite_cells() {
        let v = delaunay.vertices(cell);
        let pairs = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
        edges.extend(pairs.map(|[i, j]| ordered([v[i], v[j]]).map(|v| v.0)));
    }
    edges.sort_unstable();
    edges.dedup();
    edges.retain(|edge| known.binary_search(edge).is_err());
    edges.into_iter().map(|edge| edge.map(VertexId)).collect()
}
