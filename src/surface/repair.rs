//! From a polygon soup to an indexed triangle mesh. Nothing is changed without being reported.
//!
//! 1. Set coordinates below 2^-150 of the largest to zero, so that exact predicates stay exact.
//! 2. Weld vertices at exactly the same position. There is no tolerance, because none is right for
//!    every file: it would close intended slits and tear thin walls. Formats that repeat vertices
//!    (STL, OBJ with seams) repeat them bit by bit.
//! 3. Drop corners that repeat their predecessor, then faces with fewer than three corners.
//! 4. Drop faces with the same corners as an earlier one, whatever their orientation. Two faces that
//!    share all sides with each other and none with a third face stay: they are a component without
//!    volume, which is reported as such.
//! 5. Triangulate polygons.
//! 6. Drop vertices without faces.
//!
//! A surface is a set of points: two bodies that touch in a vertex or along an edge are not
//! manifold there, even if the file gives each its own vertices. Welding brings that to light.

use std::collections::HashMap;

use super::error::Fault;
use super::report::Repair;
use super::soup::PolygonSoup;
use super::topology::Topology;
use super::triangulate::Triangulator;
use super::unit::Unit;
use crate::Vec3;

/// A triangle mesh with the repairs made. Its faces have distinct corners, but may be defective
/// otherwise.
#[derive(Debug)]
pub(super) struct Repaired {
    pub vertices: Vec<Vec3>,
    pub faces: Vec<[u32; 3]>,
    /// For each vertex its index in the file.
    pub file_vertex: Vec<u32>,
    pub topology: Topology,
    pub unit: Unit,
    /// The vertices in scaled units.
    pub points: Vec<Vec3>,
    pub repairs: Vec<Repair>,
    pub warnings: Vec<String>,
}

/// Repairs a soup as far as indices go; orientation comes later.
pub(super) fn repair(mut soup: PolygonSoup) -> Result<Repaired, Fault> {
    let unit = Unit::of(&soup.vertices);
    let flushed = flush(unit, &mut soup.vertices);
    let welds = weld(&soup.vertices);
    let merged = welds.iter().enumerate().filter(|&(i, &w)| i != w as usize).count();
    let mut repaired = build(&soup, unit, &welds)?;
    let unreferenced = soup.vertices.len() - repaired.vertices.len() - merged;
    let first = [
        Repair::FlushedCoordinates { coordinates: flushed },
        Repair::WeldedVertices { vertices: merged },
    ];
    let last = Repair::DroppedUnreferencedVertices { vertices: unreferenced };
    let all = first.into_iter().chain(repaired.repairs).chain([last]);
    repaired.repairs = all.filter(|r| r.count() > 0).collect();
    repaired.warnings.splice(0..0, soup.warnings);
    Ok(repaired)
}

/// Sets tiny coordinates to zero, in place; returns how many.
fn flush(unit: Unit, vertices: &mut [Vec3]) -> usize {
    let mut flushed = 0;
    for vertex in vertices {
        let scaled = unit.forward(*vertex);
        for axis in 0..3 {
            if scaled[axis] == 0.0 && vertex[axis] != 0.0 {
                vertex[axis] = 0.0;
                flushed += 1;
            }
        }
    }
    flushed
}

/// For each vertex the first one at the same position.
fn weld(vertices: &[Vec3]) -> Vec<u32> {
    let mut first = HashMap::with_capacity(vertices.len());
    // Adding zero turns -0 into 0.
    let bits = |v: &Vec3| v.to_array().map(|x| (x + 0.0).to_bits());
    (0..).zip(vertices).map(|(i, v)| *first.entry(bits(v)).or_insert(i)).collect()
}

/// Steps 3 to 6, with vertices replaced by those they are welded to.
fn build(soup: &PolygonSoup, unit: Unit, welds: &[u32]) -> Result<Repaired, Fault> {
    let (polygons, collapsed) = merge_corners(soup, welds);
    let duplicate = duplicates(&polygons);
    let points = unit.forward_all(&soup.vertices);
    let mut faces = Vec::with_capacity(polygons.corners.len().saturating_sub(2 * polygons.len()));
    let mut triangulator = Triangulator::new(polygons.corners.len());
    let (mut cut, mut pieces, mut first_crossing) = (0, 0, None);
    for index in (0..polygons.len()).filter(|&i| !duplicate[i]) {
        let polygon = polygons.polygon(index);
        let (before, crossing) = (faces.len(), triangulator.crossing);
        if triangulator.cut(polygon, &points, &mut faces).is_err() {
            // The number in the file is lost where faces were dropped; the line is not.
            let (at, corners) = (polygons.place(index), polygon.len());
            return Err(Fault::Polygon { at, face: index, corners });
        }
        if triangulator.crossing > crossing {
            first_crossing.get_or_insert(polygons.place(index));
        }
        if polygon.len() > 3 {
            cut += 1;
            pieces += faces.len() - before;
        }
    }
    if faces.is_empty() {
        return Err(Fault::Collapsed { faces: soup.len() });
    }
    let warnings = first_crossing.map(|first| {
        format!(
            "{} polygons cross themselves or are far from planar, the first at {first}",
            triangulator.crossing
        )
    });
    let repairs = vec![
        Repair::DroppedDegenerateFaces { faces: collapsed },
        Repair::DroppedDuplicateFaces { faces: duplicate.iter().filter(|&&d| d).count() },
        Repair::TriangulatedPolygons { polygons: cut, triangles: pieces },
    ];
    let file_vertex = compact(soup.vertices.len(), &mut faces);
    let pick = |all: &[Vec3]| file_vertex.iter().map(|&v| all[v as usize]).collect();
    let (vertices, points): (Vec<_>, Vec<_>) = (pick(&soup.vertices), pick(&points));
    let topology = Topology::new(vertices.len(), &faces);
    let warnings = warnings.into_iter().collect();
    Ok(Repaired { vertices, faces, file_vertex, topology, unit, points, repairs, warnings })
}

/// Replaces corners by the vertices they are welded to and drops those that repeat their
/// predecessor; returns the polygons that are left and the number of those that are not.
fn merge_corners(soup: &PolygonSoup, welds: &[u32]) -> (PolygonSoup, usize) {
    let mut merged = PolygonSoup::default();
    merged.corners.reserve(soup.corners.len());
    let mut collapsed = 0;
    for index in 0..soup.len() {
        let start = merged.corners.len();
        for &corner in soup.polygon(index) {
            let corner = welds[corner as usize];
            if merged.corners.len() == start || merged.corners.last() != Some(&corner) {
                merged.corners.push(corner);
            }
        }
        while merged.corners.len() > start + 1
            && merged.corners.last() == Some(&merged.corners[start])
        {
            merged.corners.pop();
        }
        if merged.corners.len() < start + 3 {
            merged.corners.truncate(start);
            collapsed += 1;
            continue;
        }
        merged.ends.push(merged.corners.len() as u32);
        merged.lines.extend(soup.lines.get(index));
    }
    (merged, collapsed)
}

/// For each polygon whether it repeats the corners of an earlier one.
fn duplicates(polygons: &PolygonSoup) -> Vec<bool> {
    let mut sorted = polygons.corners.clone();
    let mut start = 0;
    for &end in &polygons.ends {
        sorted[start..end as usize].sort_unstable();
        start = end as usize;
    }
    let key = |&i: &u32| {
        let start = if i == 0 { 0 } else { polygons.ends[i as usize - 1] };
        &sorted[start as usize..polygons.ends[i as usize] as usize]
    };
    let mut order: Vec<u32> = (0..polygons.len() as u32).collect();
    order.sort_unstable_by(|i, j| key(i).cmp(key(j)).then(i.cmp(j)));
    let mut duplicate = vec![false; polygons.len()];
    let mut pairs = Vec::new();
    for group in order.chunk_by(|i, j| key(i) == key(j)).filter(|group| group.len() > 1) {
        group[1..].iter().for_each(|&i| duplicate[i as usize] = true);
        if let &[first, second] = group {
            pairs.push([first, second]);
        }
    }
    if !pairs.is_empty() {
        let sides = sorted_sides(polygons);
        for [first, second] in pairs {
            duplicate[second as usize] = !closes_up(polygons, &sides, first, second);
        }
    }
    duplicate
}

/// All sides of all polygons, as ascending pairs, sorted.
fn sorted_sides(polygons: &PolygonSoup) -> Vec<[u32; 2]> {
    let mut sides: Vec<_> =
        (0..polygons.len()).flat_map(|i| sides_of(polygons, i as u32)).collect();
    sides.sort_unstable();
    sides
}

fn sides_of(polygons: &PolygonSoup, index: u32) -> impl Iterator<Item = [u32; 2]> {
    let corners = polygons.polygon(index as usize);
    corners.iter().zip(corners.iter().cycle().skip(1)).map(|(&a, &b)| [a.min(b), a.max(b)])
}

/// Whether two polygons have all their sides in common, and with no third one.
fn closes_up(polygons: &PolygonSoup, sides: &[[u32; 2]], first: u32, second: u32) -> bool {
    let uses = |side: &[u32; 2]| {
        let start = sides.partition_point(|s| s < side);
        sides[start..].iter().take(3).take_while(|s| *s == side).count()
    };
    [first, second].into_iter().all(|i| sides_of(polygons, i).all(|side| uses(&side) == 2))
}

/// Renumbers the vertices that occur in faces, in their order; returns their former numbers.
fn compact(vertices: usize, faces: &mut [[u32; 3]]) -> Vec<u32> {
    let mut number = vec![u32::MAX; vertices];
    for &vertex in faces.as_flattened() {
        number[vertex as usize] = 0;
    }
    let kept: Vec<u32> = (0..vertices as u32).filter(|&v| number[v as usize] == 0).collect();
    for (new, &old) in (0..).zip(&kept) {
        number[old as usize] = new;
    }
    for vertex in faces.as_flattened_mut() {
        *vertex = number[*vertex as usize];
    }
    kept
}
