//! Polygons with the lines of a file that they came from.

use super::report::{Fault, Place};
use crate::Vec3;

/// Positions and polygons as read, with the lines they came from.
#[derive(Clone, Debug, Default)]
pub(super) struct PolygonSoup {
    /// Finite positions in the unit of the file.
    pub vertices: Vec<Vec3>,
    /// Corners of all polygons, one polygon after the other; valid vertex indices.
    pub corners: Vec<u32>,
    /// For each polygon the end of its corners in `corners`.
    pub ends: Vec<u32>,
    /// Line of each polygon, or nothing for a binary file.
    pub lines: Vec<u32>,
    /// Skipped parts of the file.
    pub warnings: Vec<String>,
}

impl PolygonSoup {
    /// The triangles of arrays; places are numbers of rows.
    ///
    /// # Errors
    /// When a coordinate is not finite, a corner is no vertex, or there are too many.
    pub fn of_triangles(vertices: &[Vec3], faces: &[[u32; 3]]) -> Result<Self, Fault> {
        let mut soup = Self::default();
        for (row, vertex) in vertices.iter().enumerate() {
            soup.push_vertex(vertex.to_array(), || Place::Element("vertex", row))?;
        }
        for (face, corners) in faces.iter().enumerate() {
            let at = Place::Element("face", face);
            for &corner in corners {
                soup.corners.push(checked_index(corner.into(), vertices.len(), &at, face)?);
            }
            soup.end_polygon(None)?;
        }
        Ok(soup)
    }

    /// Number of polygons.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// The corners of a polygon.
    pub fn polygon(&self, index: usize) -> &[u32] {
        let start = if index == 0 { 0 } else { self.ends[index - 1] as usize };
        &self.corners[start..self.ends[index] as usize]
    }

    /// The place of a polygon in the file.
    pub fn place(&self, index: usize) -> Place {
        match self.lines.get(index) {
            Some(&line) => Place::Line(line as usize),
            None => Place::Element("face", index),
        }
    }

    /// Adds a position.
    ///
    /// # Errors
    /// When a coordinate is not finite, or there are too many vertices.
    pub fn push_vertex(
        &mut self,
        [x, y, z]: [f64; 3],
        at: impl FnOnce() -> Place,
    ) -> Result<(), Fault> {
        let vertex = self.vertices.len();
        if let Some(value) = [x, y, z].into_iter().find(|c| !c.is_finite()) {
            return Err(Fault::Coordinate { at: at(), vertex, value });
        }
        if vertex >= MAX_FACES {
            return Err(Fault::TooLarge { what: "vertices", count: vertex as u64 + 1 });
        }
        self.vertices.push(Vec3::new(x, y, z));
        Ok(())
    }

    /// Adds a position with a new corner.
    pub fn push_corner(&mut self, xyz: [f64; 3], at: impl FnOnce() -> Place) -> Result<(), Fault> {
        self.push_vertex(xyz, at)?;
        self.corners.push(self.vertices.len() as u32 - 1);
        Ok(())
    }

    /// Ends the polygon whose corners were pushed since the last one.
    ///
    /// # Errors
    /// When it has fewer than three corners, or there are too many.
    pub fn end_polygon(&mut self, line: Option<usize>) -> Result<(), Fault> {
        let start = self.ends.last().map_or(0, |&end| end as usize);
        let (face, corners) = (self.len(), self.corners.len() - start);
        if corners < 3 {
            let at = line.map_or(Place::Element("face", face), Place::Line);
            return Err(Fault::TooFewCorners { at, face, corners });
        }
        if self.corners.len() > MAX_FACES {
            return Err(Fault::TooLarge { what: "corners", count: self.corners.len() as u64 });
        }
        self.ends.push(self.corners.len() as u32);
        self.lines.extend(line.map(|line| line.min(u32::MAX as usize) as u32));
        Ok(())
    }
}

/// Bound on the number of faces: half-edge indices, three for each triangle, have to fit 32 bits with
/// one value to spare.
const MAX_FACES: usize = (u32::MAX - 1) as usize / 3;

/// A face index from a file that counts from 0.
pub(super) fn checked_index(
    index: i64,
    vertices: usize,
    at: &Place,
    face: usize,
) -> Result<u32, Fault> {
    match usize::try_from(index) {
        Ok(i) if i < vertices => Ok(i as u32),
        _ => Err(Fault::Index { at: at.clone(), face, index, vertices }),
    }
}
