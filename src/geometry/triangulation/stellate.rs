//! Step 4 of the construction (`build.rs`): the conflict zone is replaced by a cone.

use super::build::Builder;
use super::cells::{Cell, Face, INFINITE, MAX_CELLS, UNUSED};
use super::error::TriangulationError;
use super::zone::UNKNOWN;
use crate::predicates::Metric;

/// Local number of a vertex that is not on the boundary of the conflict zone.
pub(super) const ABSENT: u8 = u8::MAX;

/// Boundaries of up to this many vertices are linked through a square table.
pub(super) const TABLE: usize = 64;

impl<M: Metric> Builder<'_, M> {
    /// Replaces the conflict zone by the cone of its walls from the site.
    pub(super) fn stellate(&mut self, vertex: u32) -> Result<(), TriangulationError> {
        self.allocate()?;
        let Self { cells, state, zone, walls, .. } = self;
        for (wall, &id) in walls.iter_mut().zip(zone.iter()) {
            // The vertex at infinity goes last; a rotation keeps the orientation.
            if wall.v[0] == INFINITE {
                wall.v.rotate_left(1);
            } else if wall.v[1] == INFINITE {
                wall.v.rotate_right(1);
            }
            let [a, b, c] = wall.v;
            let outside = wall.outside;
            cells[id as usize] = Cell { v: [vertex, a, b, c], n: [outside; 4] };
            state[id as usize] = UNKNOWN;
            cells[outside.cell() as usize].n[outside.index()] = Face::new(id, 0);
            // Each tested cell outside the zone is behind a wall, so this resets all their marks.
            state[outside.cell() as usize] = UNKNOWN;
        }
        // The next site is close on the curve, so the walk to it starts at a new cell.
        self.last = self.zone[self.walls.len() - 1];
        for &id in &self.zone[self.walls.len()..] {
            self.cells[id as usize].v[0] = UNUSED;
            self.state[id as usize] = UNKNOWN;
            self.free.push(id);
        }
        // The walls are a triangulated sphere: by Euler's relation it has two more vertices than
        // half its triangles.
        if self.walls.len() / 2 + 2 <= TABLE {
            self.link_by_table();
        } else {
            self.link_by_hashing();
        }
        Ok(())
    }

    /// Extends the zone by records until there is one for each wall.
    fn allocate(&mut self) -> Result<(), TriangulationError> {
        while self.zone.len() < self.walls.len() {
            let id = if let Some(id) = self.free.pop() {
                id
            } else if self.cells.len() < MAX_CELLS {
                self.state.push(UNKNOWN);
                self.cells.push(Cell { v: [UNUSED; 4], n: [Face::NONE; 4] });
                self.cells.len() as u32 - 1
            } else {
                let points = self.sites.len() - 1;
                return Err(TriangulationError::TooLarge { points, limit: MAX_CELLS });
            };
            self.zone.push(id);
        }
        Ok(())
    }

    /// Links new cells with each other: two share a facet where their walls share an edge, and
    /// each directed edge belongs to one wall.
    ///
    /// The vertices of the walls are numbered, and a table indexed by pairs of numbers is filled,
    /// then read. It need not be cleared: the walls form a closed surface, so every edge that is
    /// read was written just before.
    fn link_by_table(&mut self) {
        let Self { walls, local, rim, table, cells, zone, .. } = self;
        // Numbers are below TABLE, so the remainder changes nothing; it spares the bounds check.
        let at = |a: u8, b: u8| (usize::from(a) * TABLE + usize::from(b)) % (TABLE * TABLE);
        let mut count = 0;
        for (wall, &id) in walls.iter_mut().zip(zone.iter()) {
            for (v, number) in wall.v.into_iter().zip(&mut wall.local) {
                let known = &mut local[v as usize];
                let fresh = *known == ABSENT;
                *known = if fresh { count as u8 } else { *known };
                *number = *known;
                // Branch-free: a vertex that is not fresh is overwritten by the next one.
                rim[count] = v;
                count += usize::from(fresh);
            }
            let [a, b, c] = wall.local;
            table[at(b, c)] = Face::new(id, 1);
            table[at(c, a)] = Face::new(id, 2);
            table[at(a, b)] = Face::new(id, 3);
        }
        for (wall, &id) in walls.iter().zip(zone.iter()) {
            let [a, b, c] = wall.local;
            let n = &mut cells[id as usize].n;
            n[1] = table[at(c, b)];
            n[2] = table[at(a, c)];
            n[3] = table[at(b, a)];
        }
        for &v in &rim[..count] {
            local[v as usize] = ABSENT;
        }
    }

    /// The same for large conflict zones, through a hash table of undirected edges.
    fn link_by_hashing(&mut self) {
        let Self { walls, edges, cells, zone, .. } = self;
        // At most half full: there are three edges for every two walls.
        let size = (3 * walls.len()).next_power_of_two();
        edges.clear();
        edges.resize(size, (0, Face::NONE));
        for (wall, &id) in walls.iter().zip(zone.iter()) {
            let [a, b, c] = wall.v;
            for (i, (x, y)) in [(b, c), (c, a), (a, b)].into_iter().enumerate() {
                let face = Face::new(id, i + 1);
                // Never zero, the mark of a free slot, since the ends differ.
                let key = u64::from(x.min(y)) << 32 | u64::from(x.max(y));
                // Fibonacci hashing with linear probing: the upper half depends on both ends.
                let mut slot = (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize % size;
                while edges[slot].0 != 0 && edges[slot].0 != key {
                    slot = (slot + 1) % size;
                }
                if edges[slot].0 == 0 {
                    edges[slot] = (key, face);
                } else {
                    let twin = edges[slot].1;
                    cells[face.cell() as usize].n[face.index()] = twin;
                    cells[twin.cell() as usize].n[twin.index()] = face;
                }
            }
        }
    }
}
