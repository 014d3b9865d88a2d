//! Measures a mesh and decides whether it may be used: closed, manifold, two-sided, with volume. Finds intersecting faces.

use std::ops::ControlFlow;

use rayon::prelude::*;

use super::mesh::{Normalisation, TriMesh, Unit};
use super::read::PolygonSoup;
use super::repair::Repaired;
use super::report::{Fault, SurfaceReport, VertexName, counted};
use super::topology::{self, Shell, Topology};
use crate::Vec3;
use crate::geometry::predicates::projection_axis;
use crate::geometry::{TriangleTree, triangles_meet};
use crate::sum::Sum;

/// A mesh with its report, and the reason why it may not be used, if any.
pub(super) struct Examined {
    pub mesh: TriMesh,
    pub report: SurfaceReport,
    pub fault: Option<Fault>,
}

/// Orients a repaired mesh and examines it.
pub(super) fn orient_and_examine(repaired: Repaired) -> Examined {
    let Repaired { vertices, faces, file_vertex, topology, unit, points, mut repairs, warnings } =
        repaired;
    let mut mesh = TriMesh { vertices, faces };
    let turns = topology.turns(&mesh.faces);
    // A one-sided surface has no turns: its faces stay as they are, and the fault comes below.
    let turned = turns.clone().unwrap_or_default();
    topology::turn_over(&mut mesh.faces, turned.iter().copied());

    let found = intersections(&points, &mesh.faces, &topology.component);
    let names = Some(&file_vertex[..]);
    let evidence = Evidence { mesh: &mesh, topology: &topology, unit, points, found, names };
    let one_sided = turns.as_ref().err().map(|&face| Fault::NonOrientable { face: face as usize });
    let mut fault = evidence.structural_fault().or(one_sided);
    let mut report = evidence.measure();
    report.oriented = turns.is_ok();
    report.warnings.splice(0..0, warnings);
    let mut shells = Vec::new();
    if fault.is_none() {
        match evidence.shells() {
            Ok(found) => shells = found,
            Err(too_many) => fault = Some(too_many),
        }
    }
    // Last of all: the volume of a shell means something only for a closed manifold.
    fault = fault.or_else(|| evidence.flat_shell(&shells));
    if fault.is_none() {
        evidence.add_solid(&mut report, &shells);
    }
    let wrong: Vec<bool> = shells.iter().map(|s| fault.is_none() && !s.is_right()).collect();
    repairs.extend(topology::repairs(&turned, &wrong, &shells, &topology.component));
    // Without shells nothing is known to be wrong.
    let wrong = topology.component.iter().map(|&c| wrong.get(c as usize) == Some(&true));
    topology::turn_over(&mut mesh.faces, wrong);
    report.repairs = repairs;
    Examined { mesh, report, fault }
}

/// Examines a mesh as it is: nothing is repaired, every defect is a fault.
///
/// # Errors
/// The first defect.
pub(super) fn examine_unrepaired(mesh: &TriMesh) -> Result<SurfaceReport, Fault> {
    check_indices(mesh)?;
    let topology = Topology::new(mesh.vertices.len(), &mesh.faces);
    let unit = Unit::of(&mesh.vertices);
    let points = unit.forward_all(&mesh.vertices);
    let found = intersections(&points, &mesh.faces, &topology.component);
    let evidence = Evidence { mesh, topology: &topology, unit, points, found, names: None };
    if let Some(fault) = evidence.structural_fault() {
        return Err(fault);
    }
    if let Err(face) = topology.turns(&mesh.faces) {
        return Err(Fault::NonOrientable { face: face as usize });
    }
    if let Some(face) = topology.first_inconsistent {
        return Err(Fault::Inconsistent { face: face as usize });
    }
    let shells = evidence.shells()?;
    if let Some(fault) = evidence.flat_shell(&shells) {
        return Err(fault);
    }
    if let Some(component) = shells.iter().position(|s| !s.is_right()) {
        return Err(Fault::WrongWay { face: topology.first_face[component] as usize });
    }
    let mut report = evidence.measure();
    report.oriented = true;
    evidence.add_solid(&mut report, &shells);
    Ok(report)
}

/// Checks the guarantees of repairs for files: finite coordinates, valid and distinct corners, no
/// repeated face, no vertex without a face.
fn check_indices(mesh: &TriMesh) -> Result<(), Fault> {
    let vertices = mesh.vertices.len();
    // Coordinates and indices, as for arrays.
    PolygonSoup::of_triangles(&mesh.vertices, &mesh.faces)?;
    let mut used = vec![false; vertices];
    for (face, &[a, b, c]) in mesh.faces.iter().enumerate() {
        if a == b || b == c || c == a {
            return Err(Fault::RepeatedCorner { face });
        }
        [a, b, c].iter().for_each(|&vertex| used[vertex as usize] = true);
    }
    if mesh.faces.is_empty() {
        return Err(Fault::NoFaces { vertices });
    }
    if let Some(vertex) = used.iter().position(|&u| !u) {
        return Err(Fault::Unreferenced { vertex });
    }
    let mut sorted: Vec<([u32; 3], usize)> = mesh.faces.iter().copied().zip(0..).collect();
    sorted.iter_mut().for_each(|(corners, _)| corners.sort_unstable());
    sorted.sort_unstable();
    match sorted.windows(2).find(|w| w[0].0 == w[1].0) {
        Some(pair) => Err(Fault::DuplicateFace { first: pair[0].1, second: pair[1].1 }),
        None => Ok(()),
    }
}

/// A mesh and everything that was found out about it.
struct Evidence<'a> {
    mesh: &'a TriMesh,
    topology: &'a Topology,
    unit: Unit,
    /// Vertices in scaled units.
    points: Vec<Vec3>,
    found: Intersections,
    /// Numbers of the vertices in the file, where they differ.
    names: Option<&'a [u32]>,
}

impl Evidence<'_> {
    fn name(&self, vertex: u32) -> VertexName {
        let index = self.names.map_or(vertex, |names| names[vertex as usize]) as usize;
        VertexName { index, position: self.mesh.vertices[vertex as usize] }
    }

    /// The first reason, from extent and adjacency, why the mesh does not bound a solid.
    fn structural_fault(&self) -> Option<Fault> {
        let t = self.topology;
        if !Normalisation::of(self.mesh).is_some_and(|n| n.diagonal.is_normal()) {
            return Some(Fault::Extent { diagonal: raw_diagonal(self.mesh) });
        }
        let edges = t.nonmanifold_edges;
        let doubled = t.first_nonmanifold.map(|(first, faces)| Fault::NonManifoldEdge {
            edges,
            first: first.map(|v| self.name(v)),
            faces,
        });
        let open = t.first_boundary.map(|first| Fault::Open {
            edges: t.boundary_edges,
            first: first.map(|v| self.name(v)),
        });
        let vertices = t.nonmanifold_vertices;
        let pinched = t
            .first_nonmanifold_vertex
            .map(|first| Fault::NonManifoldVertex { vertices, first: self.name(first) });
        doubled.or(open).or(pinched)
    }

    fn shells(&self) -> Result<Vec<Shell>, Fault> {
        let shells =
            topology::shells(self.unit, &self.points, &self.mesh.faces, self.topology, &self.found);
        shells.map_err(|_| Fault::TooManyNested { components: self.topology.first_face.len() })
    }

    fn flat_shell(&self, shells: &[Shell]) -> Option<Fault> {
        let flat = shells.iter().position(Shell::is_flat)?;
        let faces = self.topology.component.iter().filter(|&&c| c as usize == flat).count();
        Some(Fault::ZeroVolume { face: self.topology.first_face[flat] as usize, faces })
    }

    /// Everything but orientation and solid.
    fn measure(&self) -> SurfaceReport {
        let (t, found) = (self.topology, &self.found);
        let (vertices, faces) = (self.mesh.vertices.len(), self.mesh.faces.len());
        SurfaceReport {
            vertices,
            faces,
            components: t.first_face.len(),
            closed: t.boundary_edges == 0,
            manifold: t.is_manifold(),
            self_intersecting: found.pairs > 0,
            intersecting_pairs: found.pairs,
            intersecting_pairs_complete: found.complete,
            degenerate_faces: found.degenerate_faces,
            diagonal: raw_diagonal(self.mesh),
            boundary_edges: t.boundary_edges,
            nonmanifold_edges: t.nonmanifold_edges,
            nonmanifold_vertices: t.nonmanifold_vertices,
            euler: vertices as i64 - t.edges as i64 + faces as i64,
            area: self.area(),
            warnings: self.warnings(),
            ..SurfaceReport::default()
        }
    }

    fn area(&self) -> Option<f64> {
        let mut sum = Sum::default();
        for face in &self.mesh.faces {
            let [a, b, c] = face.map(|v| self.points[v as usize]);
            sum.add(0.5 * (b - a).cross(c - a).length());
        }
        self.unit.backward(sum.value(), 2)
    }

    fn warnings(&self) -> Vec<String> {
        let found = &self.found;
        let mut warnings = Vec::new();
        if let Some(face) = found.first_degenerate {
            let (n, near) = (counted(found.degenerate_faces, "face"), self.place_of(face));
            warnings.push(format!("{n} without area, the first is {near}"));
        }
        if let Some([face, _]) = found.first {
            let least = if found.complete { "" } else { "at least " };
            let (n, near) = (counted(found.pairs, "pair"), self.place_of(face));
            warnings.push(format!("{least}{n} of intersecting faces, the first is {near}"));
        }
        if !found.complete {
            let why = "too many faces overlap in space to test them all for intersections";
            warnings.push(why.into());
        }
        warnings
    }

    fn place_of(&self, face: u32) -> String {
        let Vec3 { x, y, z } = self.mesh.triangle(face as usize)[0];
        format!("at ({x:?}, {y:?}, {z:?})")
    }

    /// Adds the figures that are defined only for a closed two-sided manifold.
    fn add_solid(&self, report: &mut SurfaceReport, shells: &[Shell]) {
        // Each closed shell has the Euler number 2 - 2 g; the sum over all shells gives the total genus.
        let genus = report.components as i64 - report.euler / 2;
        let cavities = shells.iter().filter(|s| s.is_cavity()).count();
        report.genus = usize::try_from(genus).ok();
        report.expected_betti =
            report.genus.map(|genus| [report.components - cavities, genus, cavities]);
        let mut volume = Sum::default();
        for shell in shells {
            let size = shell.volume.abs();
            volume.add(if shell.is_cavity() { -size } else { size });
        }
        report.volume = self.unit.backward(volume.value(), 3);
        if !self.found.components.is_empty() {
            let n = counted(self.found.components.len(), "pair");
            report.warnings.push(format!(
                "{n} of components that meet; the expected Betti numbers count each by itself"
            ));
        }
    }
}

/// The diagonal of the bounding box, also if that has no size or its diagonal overflows.
fn raw_diagonal(mesh: &TriMesh) -> f64 {
    // The normalisation survives an underflow of squares, but not an overflow.
    match Normalisation::of(mesh) {
        Some(normalisation) => normalisation.diagonal,
        None => mesh.bounding_box().map_or(0.0, |(lo, hi)| (hi - lo).length()),
    }
}

// Pairs of faces that meet outside their common vertices and edges. Exact.
//
// Vertices are shared if they have the same index; see [`triangles_meet`]. Faces of zero area are not
// tested; they are reported separately.

/// The intersecting pairs of a mesh.
#[derive(Debug, Default)]
pub(super) struct Intersections {
    /// Number of pairs.
    pub pairs: usize,
    /// The pair with the smallest indices.
    pub first: Option<[u32; 2]>,
    /// Whether all pairs were tested.
    pub complete: bool,
    /// Faces with exactly collinear corners.
    pub degenerate_faces: usize,
    pub first_degenerate: Option<u32>,
    /// Pairs of components with intersecting faces, ascending.
    pub components: Vec<[u32; 2]>,
}

/// Faces tested in parallel before the budget is checked again.
const BLOCK: usize = 512;
/// Bound on the faces that are tested against one face.
const MAX_TESTS_PER_FACE: usize = 10_000;

/// Finds all intersections. `O(F log F + pairs)`, but gives up, and reports it, after a number of
/// tests that no surface of practical use needs.
///
/// `points` are scaled as [`super::mesh::Unit`] does.
pub(super) fn intersections(
    points: &[Vec3],
    faces: &[[u32; 3]],
    component: &[u32],
) -> Intersections {
    let corners = |face: u32| faces[face as usize].map(|v| points[v as usize]);
    let flat: Vec<bool> = (0..faces.len() as u32)
        .into_par_iter()
        .map(|face| projection_axis(corners(face)).is_none())
        .collect();
    let tree = TriangleTree::new(0..faces.len() as u32, corners);
    let mut found = Intersections {
        complete: true,
        degenerate_faces: flat.iter().filter(|&&f| f).count(),
        first_degenerate: flat.iter().position(|&f| f).map(|f| f as u32),
        ..Intersections::default()
    };
    // The budget counts tests, not seconds: the result is the same on every machine.
    let mut budget = 5_000_000 + 200 * faces.len();
    // In blocks: a budget shared by running threads would make the result depend on them.
    for block in (0..tree.len()).step_by(BLOCK) {
        let end = (block + BLOCK).min(tree.len());
        let partial: Vec<Partial> =
            (block..end).into_par_iter().map(|item| meets(&tree, item, faces, component)).collect();
        for part in partial {
            found.pairs += part.pairs;
            found.complete &= part.complete;
            budget = budget.saturating_sub(part.tests);
            found.first = found.first.into_iter().chain(part.first).min();
            found.components.extend(part.components);
        }
        // Now, not after the last block: the list would grow with the pairs of faces.
        found.components.sort_unstable();
        found.components.dedup();
        if budget == 0 && end < tree.len() {
            found.complete = false;
            break;
        }
    }
    found
}

/// The intersections of one face with faces of larger index.
struct Partial {
    pairs: usize,
    tests: usize,
    first: Option<[u32; 2]>,
    complete: bool,
    components: Vec<[u32; 2]>,
}

fn meets(tree: &TriangleTree, item: usize, faces: &[[u32; 3]], component: &[u32]) -> Partial {
    let (face, triangle) = tree.at(item);
    let mut part = Partial { pairs: 0, tests: 0, first: None, complete: true, components: vec![] };
    tree.overlapping(triangle, |other, other_triangle| {
        part.tests += 1;
        if part.tests > MAX_TESTS_PER_FACE {
            part.complete = false;
            return ControlFlow::Break(());
        }
        // Each pair once, from the smaller index.
        if other <= face
            || !triangles_meet(
                faces[face as usize],
                triangle,
                faces[other as usize],
                other_triangle,
            )
        {
            return ControlFlow::Continue(());
        }
        part.pairs += 1;
        part.first = part.first.into_iter().chain([[face, other]]).min();
        let [a, b] = [component[face as usize], component[other as usize]];
        let pair = [a.min(b), a.max(b)];
        if a != b && part.components.last() != Some(&pair) {
            part.components.push(pair);
        }
        ControlFlow::Continue(())
    });
    part
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    type Point = [i128; 3];

    fn sub(a: Point, b: Point) -> Point {
        [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
    }

    fn cross(a: Point, b: Point) -> Point {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    }

    /// Whether two convex planar polygons are disjoint: the separating axis theorem with exact
    /// integers, over all normals, pairs of edges, and edges within each plane.
    fn disjoint(s: &[Point], t: &[Point]) -> bool {
        let [es, et] = [s, t].map(|p| -> Vec<Point> {
            (0..p.len()).map(|i| sub(p[(i + 1) % p.len()], p[i])).collect()
        });
        let normals = [s, t].map(|p| cross(sub(p[1], p[0]), sub(p[2], p[0])));
        let mut axes = normals.to_vec();
        axes.extend(es.iter().flat_map(|&e| et.iter().map(move |&f| cross(e, f))));
        axes.extend(es.iter().chain(&et).flat_map(|&e| normals.map(|n| cross(n, e))));
        axes.into_iter().any(|axis| {
            let [(l, h), (m, i)] = [s, t].map(|polygon| {
                let values = polygon.iter().map(|p| (0..3).map(|k| axis[k] * p[k]).sum::<i128>());
                (values.clone().min().unwrap(), values.max().unwrap())
            });
            h < m || i < l
        })
    }

    /// A face scaled by 1000, cut back by a thousandth at the vertices it shares: the rest
    /// meets the other face if and only if they meet elsewhere than there.
    fn cut_back(corners: [Point; 3], shared: [bool; 3]) -> Vec<Point> {
        let large = corners.map(|p| p.map(|x| 1000 * x));
        let toward = |i: usize, j: usize| {
            let step = sub(corners[j], corners[i]);
            std::array::from_fn(|k| large[i][k] + step[k])
        };
        match shared.iter().filter(|&&s| s).count() {
            0 => large.to_vec(),
            1 => {
                let i = shared.iter().position(|&s| s).unwrap();
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                vec![toward(i, j), large[j], large[k], toward(i, k)]
            }
            _ => {
                let i = shared.iter().position(|&s| !s).unwrap();
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                vec![large[i], toward(j, i), toward(k, i)]
            }
        }
    }

    fn brute_force(points: &[Point], faces: &[[u32; 3]]) -> Vec<[u32; 2]> {
        let corners = |face: [u32; 3]| face.map(|v| points[v as usize]);
        let flat = |face: [u32; 3]| {
            let [a, b, c] = corners(face);
            cross(sub(b, a), sub(c, a)) == [0; 3]
        };
        let mut pairs = Vec::new();
        for (i, &f) in faces.iter().enumerate().filter(|(_, f)| !flat(**f)) {
            for (j, &g) in faces.iter().enumerate().skip(i + 1).filter(|(_, g)| !flat(**g)) {
                let rest = cut_back(corners(f), f.map(|v| g.contains(&v)));
                let other = corners(g).map(|p| p.map(|x| 1000 * x));
                if !disjoint(&rest, &other) {
                    pairs.push([i as u32, j as u32]);
                }
            }
        }
        pairs
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        /// Any faces among few vertices on a small lattice: all cases of contact occur.
        #[test]
        fn agrees_with_separating_axes(
            coordinates in prop::collection::vec(prop::array::uniform3(0_i32..5), 9),
            corners in prop::collection::vec(prop::sample::subsequence((0..9_u32).collect::<Vec<_>>(), 3), 12),
        ) {
            let mut faces: Vec<[u32; 3]> = corners.iter().map(|c| [c[0], c[1], c[2]]).collect();
            faces.sort_unstable();
            faces.dedup();
            let points: Vec<Point> = coordinates.iter().map(|p| p.map(i128::from)).collect();
            let floats: Vec<Vec3> =
                coordinates.iter().map(|p| Vec3::from_array(p.map(f64::from)) / 8.0).collect();
            let expected = brute_force(&points, &faces);
            let found = intersections(&floats, &faces, &vec![0; faces.len()]);
            prop_assert_eq!(found.pairs, expected.len());
            prop_assert_eq!(found.first, expected.first().copied());
            prop_assert!(found.complete && found.components.is_empty());
        }
    }

    #[test]
    fn gives_up_on_hopeless_heaps_and_says_so() {
        // 12,000 large triangles through one another.
        let count = 12_000;
        let angle = |i: u32, k: u32| f64::from(i) * 0.001 + f64::from(k) * 2.0943951;
        let corner = |i: u32, k: u32| {
            Vec3::new(angle(i, k).cos(), angle(i, k).sin(), f64::from((i * 7 + k * 3) % 11) / 11.0)
                * 0.5
        };
        let points: Vec<Vec3> =
            (0..count).flat_map(|i| (0..3).map(move |k| corner(i, k))).collect();
        let faces: Vec<[u32; 3]> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let found = intersections(&points, &faces, &vec![0; faces.len()]);
        assert!(!found.complete && found.pairs > 1_000_000);
    }
}
