//! The collapse of an edge, with set semantics for the simplices that become equal.

use super::{Collapse, CollapseComplex};
use crate::geometry::Sphere;

impl CollapseComplex {
    /// Collapses the edge `{kept, removed}`: one vertex with the id `kept` and the given sphere
    /// takes the place of both.
    ///
    /// Edges and faces that become equal are merged. Faces with both ends vanish; an edge that
    /// loses its last face stays as a lone edge unless it is merged. Nothing is tested here:
    /// [`CollapseComplex::link_condition`] and [`CollapseComplex::folded_face`] are the caller's.
    /// Cheapest when `removed` has the smaller star. Cost: the stars of both ends and the lists of
    /// the neighbours of `removed`.
    ///
    /// # Panics
    /// If the two are not the ends of an edge.
    pub fn collapse(&mut self, kept: u32, removed: u32, sphere: Sphere) {
        let is_edge = self.is_alive(removed) && self.neighbours(removed).contains(&kept);
        assert!(is_edge, "{kept} and {removed} are not the ends of an edge");
        // The marks and shared sides describe both links before either changes.
        self.find_shared(kept, removed);
        self.rename_in_neighbours(kept, removed);
        self.absorb_neighbours(kept, removed);
        self.absorb_sides(kept, removed);
        self.sphere_count -= 1;
        self.alive[removed as usize] = false;
        self.spheres[kept as usize] = sphere;
        self.touch(kept);
        if let Some(record) = &mut self.record {
            record.push(Collapse { kept, removed, sphere });
        }
    }

    /// Marks the neighbours of `a` and finds the sides `{c, d}` for which both `{a, c, d}` and
    /// `{b, c, d}` are faces.
    pub(super) fn find_shared(&mut self, a: u32, b: u32) {
        self.marks.clear();
        for &c in self.neighbour_pool.get(self.neighbours[a as usize]) {
            self.marks.insert(c);
        }
        let mut shared = std::mem::take(&mut self.shared);
        shared.clear();
        for &[c, d] in self.opposite_sides(b) {
            // Marks first: they rule out almost every side without a search through links.
            if self.marks.contains(c) && self.marks.contains(d) && self.has_face(a, c, d) {
                shared.push([c, d]);
            }
        }
        // Sorted for the binary searches of the collapse.
        shared.sort_unstable();
        self.shared = shared;
    }

    fn rename_in_neighbours(&mut self, kept: u32, removed: u32) {
        // By index: the lists of other vertices change in the same pool meanwhile.
        let around = self.neighbours[removed as usize];
        for index in 0..around.len() {
            let v = self.neighbour_pool.at(around, index);
            if v != kept {
                self.rename_neighbour_of(v, kept, removed);
                self.rename_sides_of(v, kept, removed);
            }
        }
    }

    fn rename_neighbour_of(&mut self, v: u32, kept: u32, removed: u32) {
        let list = &mut self.neighbours[v as usize];
        let position = self.neighbour_pool.get(*list).iter().position(|&w| w == removed);
        let position = position.expect("neighbours name each other");
        // A common neighbour names `kept` already: its two edges merge.
        if self.marks.contains(v) {
            self.neighbour_pool.swap_remove(list, position);
            self.edge_count -= 1;
        } else {
            self.neighbour_pool.get_mut(*list)[position] = kept;
        }
    }

    fn rename_sides_of(&mut self, v: u32, kept: u32, removed: u32) {
        let list = &mut self.sides[v as usize];
        let mut index = 0;
        while index < list.len() {
            let [p, q] = self.side_pool.at(*list, index);
            let other = match (p == removed, q == removed) {
                (true, _) => q,
                (_, true) => p,
                _ => {
                    index += 1;
                    continue;
                }
            };
            let merges = !self.shared.is_empty()
                && self.shared.binary_search(&[v.min(other), v.max(other)]).is_ok();
            // A face with both ends vanishes; of two that merge, the one of `kept` stays.
            if other == kept || merges {
                // `index` stays, since the last side has moved here.
                self.side_pool.swap_remove(list, index);
            } else {
                self.side_pool.get_mut(*list)[index] = [kept.min(other), kept.max(other)];
                index += 1;
            }
        }
    }

    fn absorb_neighbours(&mut self, kept: u32, removed: u32) {
        let [a, b] = [kept as usize, removed as usize];
        let position = self.neighbours(kept).iter().position(|&w| w == removed);
        let position = position.expect("neighbours name each other");
        self.neighbour_pool.swap_remove(&mut self.neighbours[a], position);
        self.edge_count -= 1;
        for index in 0..self.neighbours[b].len() {
            let v = self.neighbour_pool.at(self.neighbours[b], index);
            // Marked vertices are neighbours of `kept` already.
            if v != kept && !self.marks.contains(v) {
                self.neighbour_pool.push(&mut self.neighbours[a], v);
            }
        }
        self.neighbour_pool.release(&mut self.neighbours[b]);
    }

    fn absorb_sides(&mut self, kept: u32, removed: u32) {
        let [a, b] = [kept as usize, removed as usize];
        let mut index = 0;
        // Faces with both ends are counted here, faces that merge in the next loop.
        while index < self.sides[a].len() {
            if self.side_pool.at(self.sides[a], index).contains(&removed) {
                self.side_pool.swap_remove(&mut self.sides[a], index);
                self.face_count -= 1;
            } else {
                index += 1;
            }
        }
        for index in 0..self.sides[b].len() {
            let side = self.side_pool.at(self.sides[b], index);
            // A face with both ends: it was removed and counted above.
            if side.contains(&kept) {
                continue;
            }
            if !self.shared.is_empty() && self.shared.binary_search(&side).is_ok() {
                self.face_count -= 1;
            } else {
                self.side_pool.push(&mut self.sides[a], side);
            }
        }
        self.side_pool.release(&mut self.sides[b]);
    }
}
