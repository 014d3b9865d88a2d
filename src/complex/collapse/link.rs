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
        self.find_shared(a, b);
        if !self.shared.is_empty() {
            return false;
        }
        let common = self.neighbours(b).iter().filter(|&&c| self.marks.contains(c)).count();
        // The third vertices of the faces at the edge are among the common neighbours, each once.
        let faces = self.opposite_sides(b).iter().filter(|side| side.contains(&a)).count();
        common == faces
    }
}
