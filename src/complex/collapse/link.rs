//! The link condition: which collapses keep the homotopy type.

use super::CollapseComplex;

impl CollapseComplex {
    /// Whether `Lk(a) ∩ Lk(b) = Lk(ab)` for the edge `{a, b}`: then its collapse keeps the homotopy
    /// type of the complex.
    ///
    /// In a complex of dimension two these are two tests:
    /// - T1: every vertex `c` adjacent to both ends forms a face `{a, b, c}`; otherwise a hole
    ///   bounded by three edges closes.
    /// - T2: no edge `{c, d}` has both faces `{a, c, d}` and `{b, c, d}`; otherwise a void bounded
    ///   by faces closes.
    ///
    /// Source: Dey, Edelsbrunner, Guha, Nekhayev 1999, *Topology preserving edge contraction*,
    /// Publ. Inst. Math. 66. Cost: the two links.
    pub fn link_condition(&mut self, a: u32, b: u32) -> bool {
        self.link_obstacle(a, b).is_none()
    }

    /// What violates the link condition of `{a, b}`: `[c, c]` for a vertex that fails T1, `[c, d]`
    /// for an edge that fails T2. While neither was part of a collapse, nor `a` and `b`, the
    /// condition stays violated. Cost: the two links.
    pub fn link_obstacle(&mut self, a: u32, b: u32) -> Option<[u32; 2]> {
        self.find_shared(a, b);
        if let Some(&side) = self.shared.first() {
            return Some(side);
        }
        // Unmark the third vertices of the faces at the edge: a common neighbour left is a hole.
        let sides = self.side_pool.get(self.sides[b as usize]);
        for &[p, q] in sides.iter().filter(|side| side.contains(&a)) {
            self.marks.remove(if p == a { q } else { p });
        }
        let hole = self.neighbours(b).iter().find(|&&c| self.marks.contains(c));
        hole.map(|&c| [c, c])
    }
}
