//! Measures a mesh and decides whether it may be used: closed, manifold, two-sided, with volume.

use super::Inspection;
use super::intersections::{Intersections, intersections};
use super::mesh::{Normalisation, TriMesh, Unit};
use super::repair::Repaired;
use super::report::{Fault, SurfaceReport, VertexName, counted};
use super::soup::PolygonSoup;
use super::topology::{self, Shell, Topology};
use crate::Vec3;
use crate::sum::Sum;

/// Orients a repaired mesh and examines it.
pub(super) fn orient_and_examine(repaired: Repaired) -> Inspection {
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
    let mut fault = match (evidence.structural_fault(), one_sided) {
        // No filling closes a one-sided surface.
        (Some(Fault::Open { .. }), Some(one_sided)) => Some(one_sided),
        (fault, one_sided) => fault.or(one_sided),
    };
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
    Inspection {
        mesh,
        report,
        refused: fault.map(Into::into),
        resolved: None,
        file: None,
        file_vertex,
    }
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
            extents: self.mesh.bounding_box().map_or([0.0; 3], |(lo, hi)| (hi - lo).to_array()),
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
        let cavities = shells.iter().filter(|s| s.is_cavity).count();
        report.genus = usize::try_from(genus).ok();
        report.expected_betti =
            report.genus.map(|genus| [report.components - cavities, genus, cavities]);
        let mut volume = Sum::default();
        for shell in shells {
            let size = shell.volume.abs();
            volume.add(if shell.is_cavity { -size } else { size });
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
